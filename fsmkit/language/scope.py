"""What the names in an expression may mean: the one thing typing asks of the chart."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from fsmkit.diagnostics import Diagnostic
from fsmkit.language.tree import Expr, FunctionBody, Literal, Storage
from fsmkit.language.types import Field, Type


@dataclass(frozen=True, slots=True)
class Signature:
    """Parameters and result of an operation of the host; ``result`` None: nothing is returned."""

    parameters: tuple[Field, ...] = ()
    result: Type | None = None


@dataclass(frozen=True, slots=True)
class Scope:
    """The names at hand where an expression stands.

    ``dialect`` is ``fsmkit``, ``ecmascript`` or ``null`` (of which only ``In(...)`` is known).
    """

    variables: Mapping[str, tuple[Type, Storage]] = field(default_factory=dict)
    constants: Mapping[str, Literal] = field(default_factory=dict)
    types: Mapping[str, Type] = field(default_factory=dict)
    """Declared enumerations and records."""
    operations: Mapping[str, Signature] = field(default_factory=dict)
    functions: Mapping[str, FunctionBody] = field(default_factory=dict)
    """Functions of the chart, those that are declared before."""
    fixed: frozenset[str] = frozenset()
    """Local names that nothing assigns: ``let``, parameters, loop variables."""
    states: Mapping[str, int] = field(default_factory=dict)
    """Indices of states by id, for ``In``: those that can be active, which no history can."""
    histories: frozenset[str] = frozenset()
    events: frozenset[str] = frozenset()
    """Names of declared events, which are no values."""
    event_fields: Mapping[str, Type] | None = None
    """The payload of the event being handled; None where no event is at hand."""
    event_facts: Mapping[str, str | None] = field(default_factory=dict)
    """What is known when compiling of the event being handled: its ``type``, ``origin`` ...
    (SCXML 5.10.1), None where it is undefined. What is missing is not known."""
    copies: Mapping[str, Expr] = field(default_factory=dict)
    """What can be read of copies of other charts, by dotted names (``left.tries``)."""
    copied: frozenset[str] = frozenset()
    """The first names of those."""
    indices: frozenset[str] = frozenset()
    """Constants that stand for their value alone: of an array of copies, each has another."""
    tick: int = 1000
    """Microseconds in a tick, the unit of durations."""
    dialect: str = "fsmkit"
    super_guard: Expr | None = None
    """What ``super`` in a guard means: the guard of the base chart."""
    bound: dict[tuple[str, Type | None, bool], tuple[Expr | None, tuple[Diagnostic, ...]]] = field(
        default_factory=dict, init=False, compare=False, repr=False
    )
    """The expressions of texts, by text, type wanted and whether it is written (`typing`)."""

    def is_copy(self, name: str) -> bool:
        """Whether a name is that of a copy, or of an array of copies."""
        return name in self.copied and name not in self.variables
