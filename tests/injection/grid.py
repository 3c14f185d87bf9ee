"""Places x payloads x outputs: every text in every place, through every output.

A round puts another payload into each place; over as many rounds as there are payloads, each
payload stands in each place once. A text that fsmkit refuses there, with a finding, is refused.
"""

from __future__ import annotations

import random
from collections.abc import Collection, Mapping, Sequence
from contextlib import chdir
from dataclasses import dataclass, field
from pathlib import Path

from fsmkit.chart.loading import load_with_findings
from fsmkit.diagnostics import Findings, FsmkitError
from fsmkit.system.any_file import read
from fsmkit.system.system_file import load_system
from tests.injection.outputs import OUTPUTS, Output, judge
from tests.injection.payloads import CANARY, PAYLOADS
from tests.injection.places import files, places

NAMES = tuple(PAYLOADS)


@dataclass
class Count:
    """What was tried: cells of the grid, each a text in a place through an output."""

    right: int = 0
    unread: int = 0
    """Refused as the file is read: the text cannot stand there."""
    refused: int = 0
    """By an output, which cannot express the chart with this text alone."""
    wrong: list[str] = field(default_factory=list)
    failed: int = 0
    """Cells in what was wrong."""

    def add(self, other: Count) -> None:
        """Add another count."""
        self.right += other.right
        self.unread += other.unread
        self.refused += other.refused
        self.wrong += other.wrong
        self.failed += other.failed

    @property
    def cells(self) -> int:
        """Of any outcome."""
        return self.right + self.unread + self.refused + self.failed


def texts_of_round(shape: str, number: int) -> dict[str, str]:
    """Return the payload for each place."""
    return {
        place: PAYLOADS[NAMES[(row + number) % len(NAMES)]]
        for row, place in enumerate(places(shape))
    }


def random_texts(shape: str, chance: random.Random) -> dict[str, str]:
    """Return texts that are put together from pieces of payloads and any characters."""
    return {place: random_text(chance) for place in places(shape)}


ENDS = (
    "\"'\\\n\r\t*/-<>[]{}()%$#@!`;:?&|~^=+,. \x00\x0b\x1b\x7f\x85\u2028\u2029\u202e\u2066\ufeffx0_"
)


def random_text(chance: random.Random) -> str:
    """Return a text; half of them are made mostly of what ends something somewhere."""
    parts = []
    for _ in range(chance.randint(1, 6)):
        if chance.random() < 0.5:
            payload = PAYLOADS[chance.choice(NAMES)]
            start = chance.randrange(len(payload))
            parts.append(payload[start : start + chance.randint(1, 60)])
        else:
            parts.append("".join(chance.choices(ENDS, k=chance.randint(1, 5))))
    return "".join(parts)


def accepted(shape: str, texts: Mapping[str, str], folder: Path) -> dict[str, str]:
    """Return the texts that can stand in their places: each alone, and all that fit together."""
    found: dict[str, str] = {}
    for place, text in texts.items():
        if is_read(shape, {place: text}, folder) and is_read(shape, {**found, place: text}, folder):
            found[place] = text
    return found


def is_read(shape: str, texts: Mapping[str, str], folder: Path) -> bool:
    """Whether fsmkit reads the files; a refusal is a finding, nothing else."""
    findings = Findings()
    try:
        path = write(shape, texts, folder)
        if shape == "deployment":
            read(path, findings)
        elif shape == "system":
            load_system(path, findings)
        else:
            load_with_findings(path, findings)
    except (FsmkitError, OSError):
        return False
    return True


def write(shape: str, texts: Mapping[str, str], folder: Path) -> Path:
    """Write the files and return the one that is given to fsmkit."""
    folder.mkdir(exist_ok=True)
    made = files(shape, texts)
    for name, text in made.items():
        (folder / name).write_text(text, encoding="utf-8", errors="replace")
    return folder / next(iter(made))


def outputs_of(shape: str, *, is_quick: bool = False) -> list[Output]:
    """Return the outputs that there are for a kind of files."""
    return [o for o in OUTPUTS if shape in o.shapes and (o.is_quick or not is_quick)]


def tried(
    shape: str,
    texts: Mapping[str, str],
    folder: Path,
    *,
    is_quick: bool,
    name: str = "",
    names: Collection[str] = (),
) -> Count:
    """Put texts into their places and make every output, or those of some names."""
    stand = accepted(shape, texts, folder / "tried")
    outputs = [o for o in outputs_of(shape, is_quick=is_quick) if not names or o.name in names]
    count = Count(unread=(len(texts) - len(stand)) * len(outputs))
    for output in outputs:
        _through(output, shape, stand, folder, f"{name} {shape}, {output.name}", count)
    return count


def _through(
    output: Output, shape: str, texts: Mapping[str, str], folder: Path, name: str, count: Count
) -> None:
    """Make an output of all texts; if it refuses them, of each half, until the cause is alone."""
    where = folder / f"{output.name.replace(' ', '_')}_{count.cells}_{len(texts)}"
    file = write(shape, texts, where.with_suffix(".source"))
    is_made = False
    try:
        with chdir(folder):
            is_made = judge(output, file, where)
    except Exception as error:  # noqa: BLE001  (whatever goes wrong is counted, with its cause)
        count.failed += len(texts)
        count.wrong.append(f"{name}: {type(error).__name__}: {str(error)[:1500]} {dict(texts)}")
        is_made = True
    else:
        count.right += len(texts) * is_made
    executed = [path for path in folder.rglob(CANARY) if path.is_file()]
    if executed:
        count.wrong.append(f"{name}: EXECUTED {executed} {dict(texts)}")
        for path in executed:
            path.unlink()
    if not is_made and len(texts) > 1:
        half = len(texts) // 2
        for part in (list(texts.items())[:half], list(texts.items())[half:]):
            _through(output, shape, dict(part), folder, name, count)
    elif not is_made:
        count.refused += len(texts)


def summary(count: Count, rounds: int, shapes: Sequence[str], *, is_quick: bool) -> str:
    """Return the figures in one line."""
    stands = sum(len(places(shape)) for shape in shapes)
    outputs = {o.name for shape in shapes for o in outputs_of(shape, is_quick=is_quick)}
    executed = sum("EXECUTED" in wrong for wrong in count.wrong)
    return (
        f"{stands} places x {rounds} texts, {len(outputs)} outputs: {count.cells:,} cells, "
        f"{count.right:,} right, {count.unread:,} refused by the reader, {count.refused:,} by the "
        f"output alone, {executed} executed, {len(count.wrong) - executed} unparsable"
    )
