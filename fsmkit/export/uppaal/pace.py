"""Urgency without an urgent channel: a template of its own lets time pass where nothing hurries.

TChecker's importer (uppaal-to-tchecker) reads an urgent channel as any other, and models whose
queues may then wait. It keeps urgent locations and broadcasts. So time passes in one location of
``Time`` only, which is entered where all queues are empty and no eventless transition is enabled,
and left with the first edge of any step. That is where no edge that hurries is enabled: a queue
that holds something can be taken from, if not by its own machine then by one that goes first.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from fsmkit.export.uppaal.network import Declared, Edge, Location, Sort, Template


@dataclass(frozen=True, slots=True)
class Pace:
    """The channel that steps begin with, what is true while time passes, and who sets that."""

    moves: str
    calm: str
    instance: str
    template: str

    def declared(self) -> list[Declared]:
        """Return what is declared for all templates."""
        return [
            Declared(self.moves, Sort.BROADCAST),
            Declared(self.calm, Sort.BOOL, init=(0,), comment="time passes"),
        ]

    def moving(self, template: Template, rests: Mapping[str, tuple[str, ...]]) -> Template:
        """Return a template whose steps end the passing of time.

        ``rests``: by location, what holds where no eventless transition is enabled.
        """
        committed = {location.id for location in template.locations if location.committed}
        return replace(
            template,
            locations=tuple(
                replace(one, invariant=(*one.invariant, *map(self._only_if, rests.get(one.id, ()))))
                for one in template.locations
            ),
            edges=tuple(
                one if one.source in committed else replace(one, sync=f"{self.moves}!")
                for one in template.edges
            ),
        )

    def _only_if(self, condition: str) -> str:
        """Return that time passes only if a condition holds."""
        return f"!{self.calm}" if condition == "false" else f"(!{self.calm} || {condition})"

    def time(self, lengths: Sequence[str]) -> Template:
        """Return the template that lets time pass where queues of these lengths are empty."""
        now, later = Location("now", "now", urgent=True), Location("later", "later")
        empty = tuple(f"{length} == 0" for length in lengths)
        edges = (
            Edge(now.id, later.id, guard=empty, update=(f"{self.calm} = true",)),
            Edge(later.id, now.id, sync=f"{self.moves}?", update=(f"{self.calm} = false",)),
        )
        return Template(self.template, self.instance, (), (now, later), now.id, edges)
