"""What writes a closed system in the notation of another tool, a plug-in (`fsmkit.plugins`)."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

from fsmkit.model.chart import Chart
from fsmkit.verify.system import System


@dataclass(frozen=True, slots=True)
class Wanted:
    """How to export: time and watchdogs as `verify.explore` takes them, and where to give up.

    ``most``: states that are explored; ``seconds``: 0 for no limit. ``progress`` is told states and
    transitions so far.
    """

    untimed: bool = False
    silent: bool = False
    most: int = 1_000_000
    seconds: float = 0
    progress: Callable[[int, int], None] | None = None


@dataclass(frozen=True, slots=True)
class Exported:
    """A text, and figures to be told of it, by name: ``states``, ``transitions``."""

    text: str
    figures: Mapping[str, int]


@runtime_checkable
class Exporter(Protocol):
    """Writes systems in one notation."""

    name: str
    summary: str
    """For whom it is: a few words for ``--help``."""

    def export(self, system: System, wanted: Wanted) -> Exported:
        """Return the text; `FsmkitError`, with a place and a way out, for what it cannot say."""
        ...


@runtime_checkable
class RefinementExporter(Exporter, Protocol):
    """Writes, too, whether a chart refines another (`verify.refinement`)."""

    def export_refinement(self, derived: Chart, base: Chart, wanted: Wanted) -> Exported:
        """Return the text; `FsmkitError`, with a place and a way out, for what it cannot say."""
        ...
