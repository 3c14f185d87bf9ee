"""The names that an expression can use: the interface of typing to the chart."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from fsmkit.diagnostics import Diagnostic
from fsmkit.language.tree import Expr, FunctionBody, Literal, Storage
from fsmkit.language.types import Field, Type


@dataclass(frozen=True, slots=True)
class Signature:
    """Parameters and result of an operation of the host.

    ``result`` is None if it returns nothing.
    """

    parameters: tuple[Field, ...] = ()
    result: Type | None = None


@dataclass(frozen=True, slots=True)
class Scope:
    """The names that are visible at an expression.

    ``dialect`` is ``fsmkit``, ``ecmascript`` or ``null`` (which only has ``In(...)``).
    """

    variables: Mapping[str, tuple[Type, Storage]] = field(default_factory=dict)
    constants: Mapping[str, Literal] = field(default_factory=dict)
    types: Mapping[str, Type] = field(default_factory=dict)
    """Declared enumerations and records."""
    operations: Mapping[str, Signature] = field(default_factory=dict)
    functions: Mapping[str, FunctionBody] = field(default_factory=dict)
    """Functions of the chart that are declared earlier."""
    fixed: frozenset[str] = frozenset()
    """Local names that nothing assigns: ``let``, parameters, loop variables."""
    states: Mapping[str, int] = field(default_factory=dict)
    """Indices of states by id, for ``In``. Histories are never active, so they are not included."""
    histories: frozenset[str] = frozenset()
    events: frozenset[str] = frozenset()
    """Names of declared events, which are not values."""
    event_fields: Mapping[str, Type] | None = None
    """The payload of the current event; None where no event is being handled."""
    event_facts: Mapping[str, str | None] = field(default_factory=dict)
    """Facts about the current event that are known at compile time: its ``type``, ``origin`` ...

    (SCXML 5.10.1). None means undefined; missing facts are unknown.
    """
    copies: Mapping[str, Expr] = field(default_factory=dict)
    """Readable variables and constants of copies of other charts, by dotted name (``left.tries``).
    """
    copied: frozenset[str] = frozenset()
    """The first parts of these names."""
    indices: frozenset[str] = frozenset()
    """Constants that are always printed as values: each element of an array of copies has another.
    """
    tick: int = 1000
    """Microseconds in a tick, the unit of durations."""
    dialect: str = "fsmkit"
    super_guard: Expr | None = None
    """The meaning of ``super`` in a guard: the guard of the base chart."""
    bound: dict[tuple[str, Type | None, bool], tuple[Expr | None, tuple[Diagnostic, ...]]] = field(
        default_factory=dict, init=False, compare=False, repr=False
    )
    """Cached expressions, by text, expected type and whether they are written (`typing`)."""

    def is_copy(self, name: str) -> bool:
        """Return whether a name belongs to a copy, or to an array of copies."""
        return name in self.copied and name not in self.variables
