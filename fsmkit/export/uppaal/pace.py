"""Urgency without an urgent channel: a separate template lets time pass while nothing is urgent.

TChecker's importer (uppaal-to-tchecker) reads an urgent channel as any other, so it models systems
whose queues may wait. It keeps urgent locations and broadcasts. So time passes in one location of
``Time`` only. It is entered where all queues are empty and no eventless transition is enabled, and
left with the first edge of any step. No urgent edge is enabled there: an event in a queue can be
taken, by its own machine or by one with priority.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from fsmkit.export.uppaal.network import Declared, Edge, Location, Sort, Template


@dataclass(frozen=True, slots=True)
class Pace:
    """The channel at the start of steps, and the variable that is true while time passes."""

    moves: str
    calm: str
    instance: str
    template: str

    def declared(self) -> list[Declared]:
        """Return the declarations for all templates."""
        return [
            Declared(self.moves, Sort.BROADCAST),
            Declared(self.calm, Sort.BOOL, init=(0,), comment="time passes"),
        ]

    def moving(self, template: Template, rests: Mapping[str, tuple[str, ...]]) -> Template:
        """Return a template whose steps end the passing of time.

        ``rests``: by location, the condition without an enabled eventless transition.
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
        """Return the guard under which time passes only if a condition holds."""
        return f"!{self.calm}" if condition == "false" else f"(!{self.calm} || {condition})"

    def time(self, lengths: Sequence[str]) -> Template:
        """Return the template that lets time pass while queues of these lengths are empty."""
        now, later = Location("now", "now", urgent=True), Location("later", "later")
        empty = tuple(f"{length} == 0" for length in lengths)
        edges = (
            Edge(now.id, later.id, guard=empty, update=(f"{self.calm} = true",)),
            Edge(later.id, now.id, sync=f"{self.moves}?", update=(f"{self.calm} = false",)),
        )
        return Template(self.template, self.instance, (), (now, later), now.id, edges)
