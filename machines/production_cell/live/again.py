"""Does a session again, without a page: ``python -m machines.production_cell.live.again FILE``."""

from __future__ import annotations

import sys
import tempfile
from dataclasses import replace
from pathlib import Path

import click

from ..simulation.__main__ import console, reported_errors, stay_on_one_core, tell
from ..simulation.nodes import CellError
from ..simulation.options import Options, prepare
from ..simulation.orchestrator import Orchestrator, Outcome
from .session import Again, Session, digest, read


def again(session: Session, out: Path) -> tuple[Options, Outcome]:
    """Do a session again; what it comes to is in a folder. Raises `CellError`, `FaultError`."""
    options = Options(session.steps, out, **session.options)
    with tempfile.TemporaryDirectory(prefix="cell") as folder:
        setup, world = prepare(options, Path(folder))
        run = Orchestrator(
            setup, lambda states: replace(world, states=states), Again(session.deeds)
        )
        return options, run.run()


def digest_of(text: str, out: Path) -> str:
    """Do the session of a text again; return the digest of its recording."""
    again(read(text), out)
    return digest(out / "run.rec")


@click.command()
@click.argument("file", type=click.Path(path_type=Path))
@click.option("--out", type=click.Path(path_type=Path), default=Path("build/cell"))
def main(file: Path, out: Path) -> None:
    """Replay the session in a file, and print its results."""
    out = out.resolve()
    with reported_errors():
        try:
            session = read(file.read_text(encoding="utf-8"), file.name)
        except (OSError, UnicodeDecodeError) as error:
            raise CellError(f"{file}: {error}") from error
        stay_on_one_core()
        options, outcome = again(session, out)
        code = tell(out, outcome, has_faults=True, ring=options.ring)
        console.print(f"digest: {digest(out / 'run.rec')}")
        sys.exit(code)


if __name__ == "__main__":
    main()
