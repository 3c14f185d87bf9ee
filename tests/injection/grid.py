"""Places x payloads x outputs: every text in every place, through every output.

A round puts another payload into each place; over as many rounds as there are payloads, each
payload stands in each place once. A text that fsmkit refuses there, with a finding, is refused.
"""

from __future__ import annotations

import os
import random
from collections.abc import Mapping, Sequence
from contextlib import chdir
from dataclasses import dataclass, field
from pathlib import Path

from fsmkit.composition.deployment import load_deployment
from fsmkit.diagnostics import Findings, FsmkitError
from fsmkit.loading import load_with_findings
from fsmkit.verify.reader import load_system
from tests.injection.outputs import OUTPUTS, judge
from tests.injection.payloads import CANARY, PAYLOADS
from tests.injection.places import SHAPES, files, places

NAMES = tuple(PAYLOADS)


@dataclass
class Count:
    """What was tried: cells of the grid."""

    right: int = 0
    refused: int = 0
    """By the place, or by an output that cannot express the chart."""
    wrong: list[str] = field(default_factory=list)

    def add(self, other: Count) -> None:
        """Add another count."""
        self.right += other.right
        self.refused += other.refused
        self.wrong += other.wrong


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
    path = write(shape, texts, folder)
    try:
        if shape == "deployment":
            load_deployment(path, findings)
        elif shape == "system":
            load_system(path, findings)
        else:
            load_with_findings(path, findings)
    except FsmkitError:
        return False
    return True


def write(shape: str, texts: Mapping[str, str], folder: Path) -> Path:
    """Write the files and return the one that is given to fsmkit."""
    folder.mkdir(exist_ok=True)
    for name, text in files(shape, texts).items():
        (folder / name).write_text(text, encoding="utf-8", errors="replace")
    return folder / SHAPES[shape][1]


def tried(
    shape: str, texts: Mapping[str, str], folder: Path, *, is_quick: bool, name: str = ""
) -> Count:
    """Put texts into their places and make every output."""
    os.environ["XDG_CACHE_HOME"] = str(folder / "cache")
    count = Count()
    stand = accepted(shape, texts, folder / "tried")
    outputs = [o for o in OUTPUTS if shape in o.shapes and (o.is_quick or not is_quick)]
    count.refused += (len(texts) - len(stand)) * len(outputs)
    file = write(shape, stand, folder / "source")
    for output in outputs:
        where = folder / output.name.replace(" ", "_")
        try:
            with chdir(folder):
                if judge(output, file, where):
                    count.right += len(stand)
                else:
                    count.refused += len(stand)
        except Exception as error:  # noqa: BLE001  (whatever goes wrong is counted, with its cause)
            kind = type(error).__name__
            count.wrong.append(f"{name} {shape}, {output.name}: {kind}: {str(error)[:1500]}")
        executed = [path for path in folder.rglob(CANARY) if path.is_file()]
        if executed:
            count.wrong.append(f"{name} {shape}, {output.name}: EXECUTED {executed}")
            for path in executed:
                path.unlink()
    return count


def summary(count: Count, rounds: int, shapes: Sequence[str]) -> str:
    """Return the figures in one line."""
    stands = sum(len(places(shape)) for shape in shapes)
    executed = sum("EXECUTED" in wrong for wrong in count.wrong)
    return (
        f"{stands} places x {rounds} rounds, {len(OUTPUTS)} outputs: "
        f"{count.right + count.refused:,} cells, {count.right:,} right, {count.refused:,} refused "
        f"with a finding, {executed} executed, {len(count.wrong) - executed} unparsable"
    )
