"""Run each named fault with several seeds, and check that its effect is in time.

``python -m machines.production_cell.seeds --seeds 10``. A fault without a state starts after 12 s,
when the cell produces. The effect is the first fault of a machine; for lost frames it is that the
boards count them, at any time in the run. Exit code 1: a fault had no effect, or too late.
"""

from __future__ import annotations

import sys
import tempfile
from dataclasses import replace
from pathlib import Path

import click
import yaml

from .simulation import recording
from .simulation.__main__ import OUT, reported_errors, stay_on_one_core
from .simulation.effects import effects, losses
from .simulation.faults import BY_NAME, DEFAULTS
from .simulation.options import Options, prepare
from .simulation.orchestrator import Orchestrator

AT = 12
STEPS = 60_000
"""At most: a run ends when an effect can no longer be in time."""


def after(out: Path, fault: str, seed: int, within: float) -> float | None:
    """Run the cell with a fault; return in how many s it had its effect, None if it had none.

    It is waited for two seconds longer than ``within``.
    """
    line = {"fault": fault, **BY_NAME.get(fault, {"at": AT})}
    schedule = out / "fault.yaml"
    schedule.write_text(yaml.safe_dump([line]), encoding="utf-8")
    options = Options(STEPS, out, seed=seed, fault=str(schedule))
    with tempfile.TemporaryDirectory(prefix="cell") as folder:
        setup, world = prepare(options, Path(folder))
        run = Orchestrator(setup, lambda states: replace(world, states=states))

        def progress(step: int) -> None:
            begun = run.outcome.begun
            if begun and step > begun[0][0] + 1000 * (within + 2):
                run.stop()

        outcome = run.run(progress)
    record = recording.read(out / "run.rec")
    if fault == "loss":
        return 0.0 if losses(outcome) else None
    came = effects(record, outcome)
    if not came or came[0].is_idle:
        return None
    return came[0].after or 0.0


@click.command()
@click.option("--seeds", type=click.IntRange(1), default=10, show_default=True)
@click.option("--within", type=float, default=3.0, show_default=True, help="In s.")
@click.option("--fault", "names", type=click.Choice(list(DEFAULTS)), multiple=True)
@click.option("--out", type=click.Path(path_type=Path), default=OUT.with_name("seeds"))
def main(seeds: int, within: float, names: tuple[str, ...], out: Path) -> None:
    """Run each named fault with seeds from 1 on."""
    out = out.resolve()
    out.mkdir(parents=True, exist_ok=True)
    is_missed = False
    with reported_errors():
        stay_on_one_core()
        for name in names or DEFAULTS:
            found = [after(out, name, seed, within) for seed in range(1, seeds + 1)]
            came = [each for each in found if each is not None and each <= within]
            is_missed |= len(came) < seeds
            shown = ", ".join("none" if each is None else f"{each:.3f}" for each in found)
            click.echo(f"{name}: {len(came)} of {seeds} in time: {shown} s")
    sys.exit(is_missed)


if __name__ == "__main__":
    main()
