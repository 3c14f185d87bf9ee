"""The whole grid of hostile texts, or random ones: ``python -m tests.injection --seconds 600``."""

from __future__ import annotations

import os
import random
import sys
import tempfile
import time
from pathlib import Path

import click

from fsmkit.emit import written
from tests.injection.grid import Count, random_texts, summary, texts_of_round, tried
from tests.injection.payloads import PAYLOADS
from tests.injection.places import SHAPES


@click.command()
@click.option("--rounds", default=len(PAYLOADS), show_default=True, help="Of the grid.")
@click.option("--first", default=0, show_default=True, help="The number of the first round.")
@click.option("--shape", "shapes", multiple=True, type=click.Choice(list(SHAPES)))
@click.option("--seconds", default=0.0, help="Random texts instead, for that long.")
@click.option("--seed", default=1, show_default=True)
@click.option("--quick", is_flag=True, help="Without the explorer.")
def main(
    rounds: int, first: int, shapes: tuple[str, ...], seconds: float, seed: int, *, quick: bool
) -> None:
    """Put hostile texts into every place of charts, systems and deployments."""
    written.is_strict = seconds == 0
    cache = tempfile.TemporaryDirectory(prefix="fsmkit-")
    os.environ["XDG_CACHE_HOME"] = cache.name  # the core of the explorer is compiled once
    count, number, began = Count(), first, time.monotonic()
    wanted = shapes or tuple(SHAPES)
    while time.monotonic() - began < seconds if seconds else number < first + rounds:
        for shape in wanted:
            chance = random.Random(f"{seed}-{number}-{shape}")
            texts = random_texts(shape, chance) if seconds else texts_of_round(shape, number)
            with tempfile.TemporaryDirectory(prefix="fsmkit-") as folder:
                found = tried(shape, texts, Path(folder), is_quick=quick, name=f"round {number}:")
            count.add(found)
            for wrong in found.wrong:
                click.echo(wrong)
        number += 1
        click.echo(f"{number - first} rounds: {count.cells:,} cells", err=True)
    click.echo(summary(count, number - first, wanted, is_quick=quick))
    sys.exit(1 if count.wrong else 0)


if __name__ == "__main__":
    main()
