"""The operations of a Plan in their order: record, exit, run content, enter."""

from __future__ import annotations

from dataclasses import dataclass

from fsmkit.chart.statements import Block
from fsmkit.diagnostics.fast_init import fast_init
from fsmkit.language import Expr

# --- entering one state, and leaving it -----------------------------------------------------------


@fast_init
@dataclass(frozen=True, slots=True)
class Forget:
    """Clear a history."""

    history: int


@fast_init
@dataclass(frozen=True, slots=True)
class Arm:
    """Arm the timer of a transition, with a delay in ticks."""

    transition: int
    delay: int


@fast_init
@dataclass(frozen=True, slots=True)
class Disarm:
    """Disarm the timer of a transition."""

    transition: int


@fast_init
@dataclass(frozen=True, slots=True)
class Run:
    """Run a block of content."""

    block: Block


@dataclass(frozen=True, slots=True)
class WantInvoke:
    """Request the invocation of a state at the end of the macrostep (SCXML 6.4)."""

    state: int


@dataclass(frozen=True, slots=True)
class DropInvoke:
    """Cancel the requested invocation of a state."""

    state: int


@dataclass(frozen=True, slots=True)
class EndInvoked:
    """End an invoked machine."""

    invocation: int


@fast_init
@dataclass(frozen=True, slots=True)
class RaiseDone:
    """Raise a ``done.state`` event; ``data`` are its first fields, the others have defaults."""

    event: int
    data: tuple[Expr, ...]


@dataclass(frozen=True, slots=True)
class IfFinal:
    """Raise an event if a parallel state is in final states (Appendix D, isInFinalState).

    ``finals``: for each compound region its final states, of which one must be active.
    """

    state: int
    finals: tuple[tuple[int, ...], ...]
    event: RaiseDone


@dataclass(frozen=True, slots=True)
class Finish:
    """End the machine: a final state of the root was entered."""


Action = (
    Forget
    | Arm
    | Disarm
    | Run
    | WantInvoke
    | DropInvoke
    | EndInvoked
    | RaiseDone
    | IfFinal
    | Finish
)

# --- entering states ------------------------------------------------------------------------------


@fast_init
@dataclass(frozen=True, slots=True)
class Enter:
    """Enter a state: its number, its actions; then the content of defaults.

    ``defaults``: the initial transition and the default of a history, if they have content.
    """

    state: int
    defaults: tuple[int, ...] = ()


@dataclass(frozen=True, slots=True)
class Restore:
    """Enter the recorded states of a history that lie strictly below a state."""

    history: int
    below: int


@dataclass(frozen=True, slots=True)
class Branch:
    """Two lists of operations: for a recorded and for an unrecorded history."""

    history: int
    recorded: tuple[Op, ...]
    unrecorded: tuple[Op, ...]


@dataclass(frozen=True, slots=True)
class Content:
    """The content of a default transition on its own."""

    transition: int


Op = Enter | Restore | Branch | Content


@dataclass(frozen=True, slots=True)
class Resume:
    """Enter by the number that a history recorded in a region; do nothing without a case for it."""

    history: int
    region: int
    cases: tuple[tuple[int, Ops], ...]


Ops = tuple[Op | Resume, ...]


# --- leaving states -------------------------------------------------------------------------------


@fast_init
@dataclass(frozen=True, slots=True)
class Leave:
    """Exit one state, below which nothing is active in its region."""

    state: int


@fast_init
@dataclass(frozen=True, slots=True)
class LeaveRegion:
    """Exit all active states in a region of a parallel state, innermost first."""

    region: int


@fast_init
@dataclass(frozen=True, slots=True)
class LeaveBelow:
    """Exit all active states strictly below a domain, innermost first.

    ``top``: the active child of the domain: the source or its ancestor.
    """

    domain: int
    top: int


@fast_init
@dataclass(frozen=True, slots=True)
class Record:
    """Record a history before its parent is exited (SCXML 3.10).

    ``is_sure``: the parent is active; else that is tested. ``kept``: the record, if it is known.
    """

    history: int
    state: int
    is_sure: bool
    kept: int | None = None


@dataclass(frozen=True, slots=True)
class Kept:
    """The record of a region by a history: its number, or the active one of some states.

    ``states`` are None for the number. A single state is always the active one.
    """

    region: int
    states: tuple[int, ...] | None


# --- transitions ----------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Within:
    """A condition: the number that a history recorded in a region is in ``first`` to ``last``."""

    history: int
    region: int
    first: int
    last: int


@fast_init
@dataclass(frozen=True, slots=True)
class Variant:
    """A domain and what is entered below it, if all conditions hold.

    The domain is None for a transition without a target, which exits and enters nothing. The first
    variant whose conditions hold is taken, and the last has none. There are several only where a
    deep history of an ancestor of the source is a target: the domain of Appendix D
    (getTransitionDomain) then depends on what was recorded.
    """

    conditions: tuple[Within, ...]
    domain: int | None
    entry: tuple[Op, ...]


@fast_init
@dataclass(frozen=True, slots=True)
class Reaction:
    """One complete variant of a transition: record, exit, run its content, enter."""

    conditions: tuple[Within, ...]
    domain: int | None
    record: tuple[Record, ...]
    leave: tuple[Leave | LeaveRegion | LeaveBelow, ...]
    transition: int
    enter: tuple[Op, ...]

    @property
    def is_listed(self) -> bool:
        """Whether the exit set is known at compile time."""
        return all(isinstance(op, Leave) for op in self.leave)

    @property
    def top(self) -> int | None:
        """The outermost exited state, or the domain itself if it is the source."""
        match self.leave[-1:]:
            case (Leave(state),):
                return state
            case (LeaveBelow(_, top),):
                return top
            case _:
                return None
