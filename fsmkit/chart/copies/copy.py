"""The copies in a chart during elaboration."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from fsmkit.chart.chart import Chart
from fsmkit.document.document import DocState, DocUse
from fsmkit.language import Expr, Literal

NO_CONSTANTS: Mapping[str, Literal] = {}


@dataclass(frozen=True, slots=True)
class Used:
    """A used chart, elaborated alone with certain constants.

    ``exits``: its exit points, by name, which are its top-level final states: the state, and the
    values that its ``done`` names. ``depth`` counts the charts that are used within each other.
    """

    chart: Chart
    datamodel: str
    is_late: bool
    exits: Mapping[str, tuple[int, Mapping[str, Expr]]]
    depth: int = 1


@dataclass(frozen=True, slots=True)
class Copy:
    """A copy of a used chart: its location, the used chart, and its connections.

    ``prefix`` is the id of the state that it fills. ``index``: the constant of an array's element.
    """

    number: int
    prefix: str
    use: DocUse
    state: DocState
    used: Used
    index: Mapping[str, Literal] = field(default_factory=dict)

    def name(self, inner: str) -> str:
        """Return the name in this chart of an element of the used chart."""
        return f"{self.prefix}.{inner}"


@dataclass(frozen=True, slots=True)
class Place:
    """The additional names in content of a using state or of an exit point."""

    constants: Mapping[str, Literal] = field(default_factory=dict)
    exit: Mapping[str, Expr] | None = None
    """``exit.name`` with its expression, in content that follows an exit point."""
