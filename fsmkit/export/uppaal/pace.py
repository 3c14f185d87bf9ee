"""Urgency without an urgent channel: a template of its own lets time pass where nothing hurries.

TChecker's importer (uppaal-to-tchecker) reads an urgent channel as any other, and models whose
queues may then wait. It keeps urgent locations and broadcasts. So time passes in one location of
``Time`` only, which is entered where all queues are empty and no eventless transition is enabled,
and left with the first edge of any step. That is where no edge that hurries is enabled: a queue
that holds something can be taken from, if not by its own machine then by one that goes first.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

from fsmkit.export.uppaal.network import Declared, Edge, Location, Sort, Template


@dataclass(slots=True)
class Pace:
    """The names of the channel that steps begin with, of what tells that time passes, of both."""

    moves: str
    calm: str
    instance: str
    template: str
    declared: list[Declared] = field(default_factory=list)
    """What is declared for all templates, if anything ever hurries."""

    def paced(
        self,
        templates: Sequence[Template],
        rests: Sequence[Mapping[str, tuple[str, ...]]],
        lengths: Sequence[str],
    ) -> list[Template]:
        """Return the templates, and the one of time if anything ever hurries.

        ``rests``: for each template, by location, what holds where no eventless transition is
        enabled; ``lengths``: the lengths of the queues.
        """
        if not lengths and not any(any(resting.values()) for resting in rests):
            return list(templates)
        self.declared = [
            Declared(self.moves, Sort.BROADCAST),
            Declared(self.calm, Sort.BOOL, init=(0,), comment="time passes"),
        ]
        found = [self._moving(one, resting) for one, resting in zip(templates, rests, strict=True)]
        return [*found, self._time(lengths)]

    def _moving(self, template: Template, rests: Mapping[str, tuple[str, ...]]) -> Template:
        stable = {location.id for location in template.locations if not location.committed}
        return replace(
            template,
            locations=tuple(
                replace(one, invariant=(*one.invariant, *map(self._only_if, rests.get(one.id, ()))))
                for one in template.locations
            ),
            edges=tuple(
                replace(one, sync=f"{self.moves}!") if one.source in stable else one
                for one in template.edges
            ),
        )

    def _only_if(self, condition: str) -> str:
        """Return that time passes only if a condition holds."""
        return f"!{self.calm}" if condition == "false" else f"(!{self.calm} || {condition})"

    def _time(self, lengths: Sequence[str]) -> Template:
        now, later = Location("now", "now", urgent=True), Location("later", "later")
        empty = tuple(f"{length} == 0" for length in lengths)
        return Template(
            self.template,
            self.instance,
            (),
            (now, later),
            now.id,
            (
                Edge(now.id, later.id, guard=empty, update=(f"{self.calm} = true",)),
                Edge(later.id, now.id, sync=f"{self.moves}?", update=(f"{self.calm} = false",)),
            ),
        )
