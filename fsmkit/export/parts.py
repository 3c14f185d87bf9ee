"""The local states of all machines of a network, taken apart."""

from __future__ import annotations

from collections.abc import Collection

from fsmkit.export.components import components_of
from fsmkit.export.cubes import Cube, Cubes
from fsmkit.export.local_states import ranges
from fsmkit.export.network import Network

FEW = 3
"""So many values are listed one by one."""


class Parts:
    """By machine: ``components``, and ``codes``, its local states by them."""

    def __init__(self, network: Network) -> None:
        """Take the local states apart."""
        charts = network.closed.charts
        found = [
            components_of(
                chart,
                [local.snapshot for local in automaton.locals],
                untimed=network.closed.untimed,
            )
            for chart, automaton in zip(charts, network.automata, strict=True)
        ]
        self.components = tuple(components for components, _ in found)
        self.codes = tuple(codes for _, codes in found)
        self._cubes = tuple(map(Cubes, self.codes))

    def cover(self, machine: int, locals_: Collection[int]) -> list[Cube] | None:
        """Return cubes that hold just these local states; None for all local states."""
        if len(set(locals_)) == len(self.codes[machine]):
            return None
        return self._cubes[machine].cover(locals_)

    def excluded(self, machine: int, component: int, values: Collection[int]) -> int | None:
        """Return the value of a component that alone is not among several."""
        others = [n for n in self.components[machine][component].texts if n not in values]
        return others[0] if len(others) == 1 < len(values) else None

    def runs(self, machine: int, component: int, values: Collection[int]) -> list[tuple[int, int]]:
        """Return the first and the last of each run of values; few are listed one by one."""
        every = sorted(self.components[machine][component].texts)
        places = {number: place for place, number in enumerate(every)}
        found = []
        for first, last in ranges([places[number] for number in values]):
            if last - first < FEW:
                found += [(number, number) for number in every[first : last + 1]]
            else:
                found.append((every[first], every[last]))
        return found
