"""The Plan: what a machine executes. Numbers, intervals, and ordered lists of exits and entries.

A *region* is a part of the chart in which one path of states is active: the root, and each child
of a parallel state. States have one number, their place in document order (`State.index`), in
the Chart, in generated code and in saved machines; histories have theirs among them. A machine
keeps for each region the number of its deepest active state, 0 while nothing of it is active. So
a state is active exactly if the number of its region lies between its own and that of its last
descendant there, also in the midst of a step, when its children are left already or not entered
yet.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from fsmkit.chart.chart import Chart
from fsmkit.chart.structure import forgotten_histories
from fsmkit.diagnostics.frozen import quick
from fsmkit.plan.features import Features, features_of


@dataclass(frozen=True, slots=True)
class Region:
    """``states`` in document order; ``top`` is the child of the parallel state ``owner``.

    Or the root, which is in no region: its number is 0, which stands for nothing active.
    """

    index: int
    top: int
    owner: int | None
    states: tuple[int, ...]


@quick
@dataclass(frozen=True, slots=True)
class Enter:
    """Enter a state: its number, its timers, its handlers; then the content of defaults.

    ``defaults``: the initial transition and the default of a history, where they have content.
    """

    state: int
    defaults: tuple[int, ...] = ()


@dataclass(frozen=True, slots=True)
class Restore:
    """Enter what a history recorded, as far as it lies strictly below a state."""

    history: int
    below: int


@dataclass(frozen=True, slots=True)
class Branch:
    """One list of operations if a history is recorded, another if not."""

    history: int
    recorded: tuple[Op, ...]
    unrecorded: tuple[Op, ...]


@dataclass(frozen=True, slots=True)
class Content:
    """The content of a default transition on its own."""

    transition: int


Op = Enter | Restore | Branch | Content


@dataclass(frozen=True, slots=True)
class Within:
    """A condition: what a history recorded in a region has a number from ``first`` to ``last``."""

    history: int
    region: int
    first: int
    last: int


@quick
@dataclass(frozen=True, slots=True)
class Variant:
    """A domain and what is entered below it, if all conditions hold.

    The domain is None for a transition without a target, which exits and enters nothing.
    """

    conditions: tuple[Within, ...]
    domain: int | None
    entry: tuple[Op, ...]


@quick
@dataclass(frozen=True, slots=True)
class Move:
    """What taking a transition does: the first variant whose conditions hold. The last has none.

    More than one only where a deep history of an ancestor of the source is a target: the domain of
    Appendix D (getTransitionDomain) then depends on what was recorded.
    """

    transition: int
    variants: tuple[Variant, ...]

    @property
    def is_static(self) -> bool:
        """Whether the domain is known when compiling."""
        return len(self.variants) == 1


@dataclass(frozen=True)
class Plan:
    """A chart lowered."""

    chart: Chart
    regions: tuple[Region, ...]
    region_of: tuple[int, ...]
    """By state; of a history that of its parent."""
    last_below: tuple[int, ...]
    """By state: the last of its descendants in its own region, or itself."""
    moves: tuple[Move, ...]
    """By transition; of an initial one what it enters below its source, of a default below the
    parent of the history."""
    start: tuple[Op, ...]
    """What entering the machine enters, after the content of the root's initial transition."""
    recorded_regions: tuple[tuple[int, ...], ...]
    """By state: of a history the regions whose numbers it records, its parent's own first."""

    @cached_property
    def features(self) -> Features:
        """What the machine needs."""
        return features_of(self.chart)

    @cached_property
    def is_single(self) -> bool:
        """Whether there is but one region, so that one transition is taken at a time."""
        return len(self.regions) == 1

    @cached_property
    def forgotten(self) -> tuple[tuple[int, ...], ...]:
        """By state: those of its histories that hold nothing while it is active."""
        return forgotten_histories(self.chart)

    @cached_property
    def inner(self) -> tuple[list[Region], ...]:
        """By state: the regions of a parallel state, in document order; of any other none."""
        found: tuple[list[Region], ...] = tuple([] for _ in self.chart.states)
        for region in self.regions:
            if region.owner is not None:
                found[region.owner].append(region)
        return found

    @cached_property
    def chains(self) -> tuple[tuple[int, ...], ...]:
        """By state: itself and its ancestors without the root, innermost first."""
        return tuple(
            () if state.index == 0 else (state.index, *self.chart.ancestors(state.index)[:-1])
            for state in self.chart.states
        )
