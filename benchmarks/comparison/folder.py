"""Where the charts, the streams of events and the hand-written machines are."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

CHARTS = ("A", "B", "C")
VARIABLE = "FSMKIT_YARDSTICK"
BESIDE = Path("..") / "shared" / "benchmarks"
"""From the root of the project."""

NOT_A_LIMIT = ("null",)
"""What is in the folder only to measure the loop around a machine."""


class UnavailableError(Exception):
    """A tool, a peer or a file is missing, or does not do what it should; the text says which."""


@dataclass(frozen=True, slots=True)
class Folder:
    """The folder of the yardstick; nothing of it is copied."""

    path: Path

    @property
    def model(self) -> Path:
        """The interpreter of the charts, which is normative for streams and digests."""
        return self.path / "model.py"

    @property
    def limit(self) -> Path:
        """The folder of the hand-written machines."""
        return self.path / "limit"

    def chart(self, letter: str) -> Path:
        """Return the chart in SCXML."""
        return self.path / f"{letter}.scxml"

    def limits(self, letter: str) -> list[str]:
        """Return the names of the machines in C written by hand for a chart."""
        found = (path.stem.removeprefix(f"{letter}_") for path in self.limit.glob(f"{letter}_*.c"))
        return sorted(name for name in found if name not in NOT_A_LIMIT)

    def by_hand_in_python(self, letter: str) -> Path:
        """Return the module with the machine in Python written by hand for a chart."""
        return self.limit / "python" / f"m_{letter}.py"


def find_folder(chosen: str | None, environment: Mapping[str, str], root: Path) -> Folder:
    """Return the folder: the option's, else the variable's, else the one beside the project."""
    named = chosen or environment.get(VARIABLE, "").strip()
    path = Path(named) if named else root / BESIDE
    folder = Folder(Path(os.path.normpath(path.absolute())))
    if not folder.model.is_file():
        raise UnavailableError(
            f"there is no yardstick in {folder.path}: "
            f"name its folder with --yardstick or in the variable {VARIABLE}"
        )
    return folder
