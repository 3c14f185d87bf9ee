"""A property: a kind, its conditions, and the decision procedure of the kind."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from enum import Enum
from typing import TYPE_CHECKING, Protocol

from fsmkit.diagnostics import Span, Text
from fsmkit.emit import guard
from fsmkit.language import Expr
from fsmkit.system.properties.condition import Atom, Condition

if TYPE_CHECKING:
    from pathlib import Path

    from fsmkit.diagnostics import Findings
    from fsmkit.system.machine import Machine, Monitor
    from fsmkit.yaml.nodes import Node


class PropertyContext(Protocol):
    """The context for reading a kind's own form (`fsmkit.system.properties.reading`)."""

    machines: tuple[Machine, ...]
    folder: Path
    findings: Findings
    strict: bool
    monitors: list[Monitor]
    """The machines that properties add to the system."""
    own: int | None
    """The machine in whose chart the property is written, so that names need no machine."""

    def condition(self, name: Text, node: Node) -> Condition | None:
        """Parse a condition of the property of that name; return None after a finding."""
        ...


@dataclass(frozen=True, slots=True)
class AtStates:
    """Decided by whether some state (with `occurs`: some step) is ever marked.

    ``negated``: the states where the condition does not hold are marked. ``existential``: a mark
    proves the property instead of violating it.
    """

    negated: bool = False
    existential: bool = False


@dataclass(frozen=True, slots=True)
class OverGraph:
    """Decided by a procedure over the graph of all states, in which the conditions are marked.

    ``procedure`` names the option of the explorer (``core/main.c``) and the function of the oracle
    (`verify.engines.python.temporal`). ``is_timed``: it compares times with the duration.
    ``is_fair``: only fair runs count. ``violation`` is the text at the end of a counterexample.
    """

    procedure: str
    is_timed: bool = False
    is_fair: bool = False
    violation: str = ""


class Builtin(Enum):
    """Decided for every system, whether listed or not."""

    DEADLOCK = "deadlock"
    LIVELOCK = "livelock"


class Part(Enum):
    """A part of the value of a kind's key."""

    CONDITION = "condition"
    DURATION = "duration"


@dataclass(frozen=True, slots=True)
class Kind:
    """A kind of property.

    ``form``: the parts under its ``key``, several of them as a list. ``read`` reads another form
    from the name, the node of the property and a `PropertyContext`; it returns None after a
    finding. ``refuted`` is the text for a violated property. ``is_local``: in a chart, it is
    evaluated again for each machine of a system that runs the chart.
    """

    key: str
    decided: AtStates | OverGraph | Builtin
    form: tuple[Part, ...] = (Part.CONDITION,)
    example: str = ""
    refuted: str = "does not hold"
    is_local: bool = False
    read: Callable[[Text, Node, PropertyContext], Property | None] | None = None


@dataclass(frozen=True, slots=True)
class Property:
    """A required property. ``goal`` is the second condition of kinds that have two.

    The variables of the condition are the names in ``atoms``, or, for the invariant of a state,
    those of the machine that is its ``owner``.
    """

    name: str
    kind: Kind
    text: str
    condition: Expr | None = None
    atoms: tuple[tuple[str, Atom], ...] = ()
    owner: int | None = None
    goal: Condition | None = None
    ticks: int = 0
    """The duration, of those that have one."""
    span: Span | None = field(default=None, compare=False, repr=False)
    req: tuple[Text, ...] = field(default=(), compare=False, repr=False)
    """The requirements that it states."""

    def __post_init__(self) -> None:
        guard(self, "name", "text")

    @property
    def is_of_steps(self) -> bool:
        """Whether this is evaluated at steps and the states after them."""
        return any(atom.event is not None for _, atom in self.atoms)

    @property
    def is_negated(self) -> bool:
        """Whether the states are marked where the condition does not hold."""
        return isinstance(self.kind.decided, AtStates) and self.kind.decided.negated

    @property
    def is_existential(self) -> bool:
        """Whether a mark proves the property."""
        return isinstance(self.kind.decided, AtStates) and self.kind.decided.existential


# --- what an exploration marks --------------------------------------------------------------------


def evaluated(properties: tuple[Property, ...]) -> tuple[Property, ...]:
    """Return the conditions to mark, in the order of the marks: properties, then goals."""
    goals = (
        replace(p, condition=p.goal.expression, atoms=p.goal.atoms)
        for p in properties
        if p.goal is not None
    )
    return (*properties, *goals)


def temporal_properties(
    properties: tuple[Property, ...], *, untimed: bool = False
) -> tuple[int, ...]:
    """Return the numbers of the properties that the graph decides; untimed: without timed ones."""
    decided = ((number, p.kind.decided) for number, p in enumerate(properties))
    return tuple(
        number
        for number, how in decided
        if isinstance(how, OverGraph) and not (untimed and how.is_timed)
    )


def goal_place(properties: tuple[Property, ...], index: int) -> int:
    """Return the index of the goal of a property among the marks."""
    return len(properties) + sum(p.goal is not None for p in properties[:index])
