"""A page and a text editor that change one file in turn: ``python -m devtools.interleaved``.

The page applies random operations, each made for the text that the page has seen. Meanwhile the
text editor replaces lines of the file. After each edit of the page, the file must be the text of
the text editor with the operation, or that text unchanged if the operation was rejected.
"""

from __future__ import annotations

import sys
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory

import click

from devtools.edits import random_operation, sources
from devtools.random_charts.choices import Choices, SeededChoices
from fsmkit.diagnostics import FsmkitError, Source
from fsmkit.diagnostics.fixes import apply_edits
from fsmkit.editor.editing.applying import apply, read
from fsmkit.editor.editing.session import EditSession, rebased


@dataclass
class Tally:
    """Counts of edits, and the problems found."""

    counts: Counter[str] = field(default_factory=Counter)
    problems: list[str] = field(default_factory=list)


def text_edit(choices: Choices, text: str) -> str:
    """Return a text after an edit by hand, which may break it."""
    lines = text.splitlines(keepends=True)
    at = choices.integer(0, len(lines) - 1)
    match choices.integer(0, 4):
        case 0:
            lines.insert(at, f"# remark {choices.integer(0, 999)}\n")
        case 1:
            lines[at] = lines[at].rstrip("\n") + "  # more\n"
        case 2:
            lines.append(f"  by_hand{choices.integer(0, 9999)}: {{}}\n")
        case 3:
            del lines[at]
        case _:
            lines[at] = lines[at].replace("e0", "e1")
    return "".join(lines)


def run(source: Source, seed: str, count: int, folder: Path, tally: Tally) -> None:
    """Change a file by so many edits of a page and a text editor in turn."""
    choices = SeededChoices(f"interleaved {seed}")
    path = folder / source.name
    path.write_text(source.text, encoding="utf-8")
    session = EditSession(path)
    for number in range(count):
        seen, seen_hash = session.text, session.hash
        operation = random_operation(choices, read(Source(str(path), seen)))
        theirs = seen
        if choices.chance(60):
            theirs = text_edit(choices, seen)
            path.write_text(theirs, encoding="utf-8")
        expected = theirs
        try:
            fitted = rebased(
                operation, read(Source(str(path), seen)), read(Source(str(path), theirs))
            )
            now = Source(str(path), theirs)
            expected = apply_edits(theirs, apply(now, fitted))
        except FsmkitError:
            tally.counts["rejected"] += 1
        else:
            tally.counts["applied"] += 1
        try:
            session.edit([operation], seen_hash)
        except FsmkitError:
            if expected != theirs:
                tally.problems.append(f"{seed} step {number}: {operation}: lost")
        found = path.read_text(encoding="utf-8")
        if found != expected:
            tally.problems.append(f"{seed} step {number}: {operation}: another text")
        tally.counts["by both" if theirs != seen else "by the page"] += 1
        if not _is_readable(path, found):  # the text editor broke it, and takes that back
            tally.counts["broken by hand"] += 1
            path.write_text(seen, encoding="utf-8")
            session.refresh()


def _is_readable(path: Path, text: str) -> bool:
    try:
        read(Source(str(path), text))
    except FsmkitError:
        return False
    return True


@click.command()
@click.option("--charts", default=25, help="Random charts, each in both notations.")
@click.option("--edits", default=20, help="Edits of each file by the page.")
@click.option("--seed", default=1, help="The first seed.")
def main(charts: int, edits: int, seed: int) -> None:
    """Change files by a page and a text editor in turn."""
    tally = Tally()
    with TemporaryDirectory() as folder:
        for number in range(seed, seed + charts):
            for source in sources(number):
                run(source, f"{number} {source.name}", edits, Path(folder), tally)
    for problem in tally.problems[:5]:
        sys.stdout.write(f"{problem}\n")
    words = ", ".join(f"{count} {name}" for name, count in sorted(tally.counts.items()))
    sys.stdout.write(f"{words}, {len(tally.problems)} problems\n")
    sys.exit(bool(tally.problems))


if __name__ == "__main__":
    main()
