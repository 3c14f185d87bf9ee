"""The Plan: the program of a machine, as numbers and ordered lists of operations."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from fsmkit.chart.chart import Transition
from fsmkit.document.document import Trigger
from fsmkit.plan import restoring
from fsmkit.plan.actions import Actions, entry_actions, exit_actions
from fsmkit.plan.exits import exits, kept_parts, records
from fsmkit.plan.features import Features, features_of
from fsmkit.plan.instances import Instances, instances_of
from fsmkit.plan.operations import Kept, Op, Reaction, Restore, Resume, Variant
from fsmkit.plan.regions import Regions
from fsmkit.plan.selection import Selection


@dataclass(frozen=True)
class Plan(Regions):
    """A lowered chart."""

    variants: tuple[tuple[Variant, ...], ...]
    """The variants by transition; initial and default transitions contain the entries they
    cause.
    """
    start: tuple[Op, ...]
    """The entries at the start, after the content of the root's initial transition."""

    @cached_property
    def features(self) -> Features:
        """The mechanisms of the machine."""
        return features_of(self.chart)

    @cached_property
    def instances(self) -> Instances:
        """The copies of used charts."""
        return instances_of(self.chart)

    @cached_property
    def selection(self) -> Selection:
        """The candidates for each state and event."""
        return Selection(self, self.variants)

    @cached_property
    def entering(self) -> tuple[Actions, ...]:
        """The entry actions by state."""
        return entry_actions(self)

    @cached_property
    def leaving(self) -> tuple[Actions, ...]:
        """The exit actions by state."""
        return exit_actions(self)

    @cached_property
    def reactions(self) -> tuple[tuple[Reaction, ...], ...]:
        """The complete variants by transition, of which the last has no conditions.

        Initial and default transitions are part of entries and have none.
        """
        return tuple(
            ()
            if transition.trigger is Trigger.INITIAL
            else tuple(self._reaction(transition, each) for each in self.variants[transition.index])
            for transition in self.chart.transitions
        )

    def _reaction(self, transition: Transition, variant: Variant) -> Reaction:
        source, domain = transition.source, variant.domain
        leave = () if domain is None else exits(self, source, domain)
        record = () if domain is None else records(self, source, domain, leave)
        index, entry = transition.index, variant.entry
        return Reaction(variant.conditions, domain, record, leave, index, entry)

    @cached_property
    def kept(self) -> dict[int, tuple[Kept, ...]]:
        """The recorded parts of each region, by history."""
        return {history: kept_parts(self, history) for history in self.every_history}

    def resumed(self, restore: Restore) -> tuple[Resume, ...]:
        """Return the entries of a history, by the numbers that it recorded."""
        return restoring.resumed(self, restore)
