"""A property: a kind, its conditions, and how properties of that kind are decided."""

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
    """What a kind with a form of its own is read with (`fsmkit.system.properties.reading`)."""

    machines: tuple[Machine, ...]
    folder: Path
    findings: Findings
    strict: bool
    monitors: list[Monitor]
    """The machines that properties add to the system."""
    own: int | None
    """The machine in whose chart the property is written, so that names need no machine."""


@dataclass(frozen=True, slots=True)
class AtStates:
    """Decided by whether some state (with `occurs`: some step) is ever marked.

    ``negated``: the states where the condition does not hold are marked. ``wanted``: a mark shows
    that the property holds, not that it is violated.
    """

    negated: bool = False
    wanted: bool = False


@dataclass(frozen=True, slots=True)
class OverGraph:
    """Decided over the graph of all states, where the conditions are marked, by a procedure.

    ``procedure`` names the option of the explorer (``core/main.c``) and the function of the oracle
    (`verify.engines.python.temporal`). ``is_timed``: it measures time, against the duration.
    ``is_fair``: only fair runs count. ``violation`` says what the end of a counterexample means.
    """

    procedure: str
    is_timed: bool = False
    is_fair: bool = False
    violation: str = ""


class Builtin(Enum):
    """Decided of every system, whether listed or not."""

    DEADLOCK = "deadlock"
    LIVELOCK = "livelock"


class Part(Enum):
    """A part of what is written behind the key of a kind."""

    CONDITION = "condition"
    DURATION = "duration"


@dataclass(frozen=True, slots=True)
class Kind:
    """A kind of property.

    ``form``: the parts behind its ``key``, several of them as a list. ``read`` reads another form;
    it gets the name, the node of the property and a `PropertyContext`, and returns None after a
    finding. ``refuted`` says of a property that it is violated. ``is_local``: where a chart says
    it of itself, it is evaluated again for each machine of a system that runs the chart.
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
    """Something that shall hold. ``goal`` is the second condition of those that have two.

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
    def is_wanted(self) -> bool:
        """Whether a mark shows that this holds."""
        return isinstance(self.kind.decided, AtStates) and self.kind.decided.wanted


# --- what an exploration marks --------------------------------------------------------------------


def asked_events(properties: tuple[Property, ...]) -> tuple[tuple[int, int], ...]:
    """Return the events, by machine and number, whose occurrence some property depends on."""
    atoms = (atom for property_ in properties for _, atom in property_.atoms)
    return tuple(sorted({(a.machine, a.event) for a in atoms if a.event is not None}))


def evaluated(properties: tuple[Property, ...]) -> tuple[Property, ...]:
    """Return what states are marked for, in the order of the marks: properties, then goals."""
    goals = (
        replace(p, condition=p.goal.expression, atoms=p.goal.atoms)
        for p in properties
        if p.goal is not None
    )
    return (*properties, *goals)


def temporal_properties(
    properties: tuple[Property, ...], *, untimed: bool = False
) -> tuple[int, ...]:
    """Return the numbers of the properties that the graph decides; untimed: no times."""
    decided = ((number, p.kind.decided) for number, p in enumerate(properties))
    return tuple(
        number
        for number, how in decided
        if isinstance(how, OverGraph) and not (untimed and how.is_timed)
    )


def goal_place(properties: tuple[Property, ...], index: int) -> int:
    """Return the place of the goal of a property among what is marked."""
    return len(properties) + sum(p.goal is not None for p in properties[:index])
