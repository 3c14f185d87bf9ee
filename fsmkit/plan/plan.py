"""The Plan: what a machine executes, in numbers and ordered lists of operations."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from fsmkit.document.document import Trigger
from fsmkit.plan import restoring
from fsmkit.plan.actions import Actions, entry_actions, exit_actions
from fsmkit.plan.exits import exits, kept_parts, records
from fsmkit.plan.features import Features, features_of
from fsmkit.plan.instances import Instances, instances_of
from fsmkit.plan.operations import Kept, Move, Op, Reaction, Restore, Resume
from fsmkit.plan.regions import Regions
from fsmkit.plan.selection import Selection


@dataclass(frozen=True)
class Plan(Regions):
    """A chart lowered."""

    moves: tuple[Move, ...]
    """By transition; of an initial one what it enters below its source, of a default below the
    parent of the history."""
    start: tuple[Op, ...]
    """What entering the machine enters, after the content of the root's initial transition."""

    @cached_property
    def features(self) -> Features:
        """What the machine needs."""
        return features_of(self.chart)

    @cached_property
    def instances(self) -> Instances:
        """The copies of used charts."""
        return instances_of(self.chart)

    @cached_property
    def selection(self) -> Selection:
        """The candidates for each state and event."""
        return Selection(self, self.moves)

    @cached_property
    def entering(self) -> tuple[Actions, ...]:
        """By state: what entering it does."""
        return entry_actions(self)

    @cached_property
    def leaving(self) -> tuple[Actions, ...]:
        """By state: what leaving it does."""
        return exit_actions(self)

    @cached_property
    def reactions(self) -> tuple[tuple[Reaction, ...], ...]:
        """By transition: its variants whole, of which the last has no conditions.

        Initial and default transitions, which are taken while states are entered, have none.
        """
        return tuple(
            () if transition.trigger is Trigger.INITIAL else self._reactions(move)
            for transition, move in zip(self.chart.transitions, self.moves, strict=True)
        )

    def _reactions(self, move: Move) -> tuple[Reaction, ...]:
        source, found = self.chart.transitions[move.transition].source, []
        for variant in move.variants:
            domain = variant.domain
            leave = () if domain is None else exits(self, source, domain)
            record = () if domain is None else records(self, source, domain, leave)
            found.append(
                Reaction(variant.conditions, domain, record, leave, move.transition, variant.entry)
            )
        return tuple(found)

    @cached_property
    def records(self) -> dict[int, tuple[Kept, ...]]:
        """By history: what it records of each region."""
        return {history: kept_parts(self, history) for history in self.every_history}

    def resumed(self, restore: Restore) -> tuple[Resume, ...]:
        """Return what a history enters, by the numbers that it recorded."""
        return restoring.resumed(self, restore)
