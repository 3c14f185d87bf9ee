"""The protocol of drawings of charts in notations of text."""

from __future__ import annotations

from dataclasses import dataclass
from importlib import import_module
from typing import TYPE_CHECKING, Protocol, runtime_checkable

if TYPE_CHECKING:
    from fsmkit.chart.chart import Chart


@runtime_checkable
class Drawing(Protocol):
    """Draws a chart in one notation of text."""

    name: str
    suffixes: tuple[str, ...]

    def draw(self, chart: Chart, active: frozenset[int]) -> str:
        """Return the text of a diagram in which the given states stand out."""
        ...


@dataclass(frozen=True, slots=True)
class Notation:
    """A drawing that the module ``draw`` beside a plug-in makes, imported when it is needed."""

    name: str
    suffixes: tuple[str, ...]
    package: str

    def draw(self, chart: Chart, active: frozenset[int]) -> str:
        """Return a diagram in which the given states stand out."""
        text: str = import_module(f"{self.package}.draw").draw(chart, active)
        return text
