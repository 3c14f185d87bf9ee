"""Reachable states counted by another program, `dd`, from networks of automata with queues.

Neither the explorer nor its diagrams have a part in it but for the local steps of machines: what
moves when, what a message does, and all states together are found here, as a binary diagram.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Any

import pytest

from fsmkit.export.collect import network_of
from fsmkit.export.exporter import ExportOptions
from fsmkit.export.network import Move, Network
from fsmkit.verify.statespace.actions import Action
from tests.verify.random_systems import load_files, random_system
from tests.verify.systems import SYSTEMS

autoref = pytest.importorskip("dd.autoref", reason="dd, of the extra dev, is not installed")
FEW = 1
"""Events that may wait where something comes from outside."""
NAMES = ["deadlock", "drive", "kitchen", "livelock", "losing", "post", "ring", "shared"]
SEEDS = [1, 3, 4, 5, 6, 13, 17, 18, 19, 21, 23, 27]


class Recount:
    """The states of a network. A variable has a value in bits: the local state, or the queue."""

    def __init__(self, network: Network) -> None:
        self.network = network
        self.bdd = autoref.BDD()
        self.bits: dict[tuple[str, int], list[str]] = {}
        for m, automaton in enumerate(network.automata):
            self._declare(("at", m), len(automaton.locals))
            self._declare(("queue", m), len(automaton.contents))
        self.places = [{c: n for n, c in enumerate(a.contents)} for a in network.automata]
        waiting = list(map(self._waiting, range(len(network.automata))))
        self.monitors_wait = self._any(self._some(waiting[m]) for m in network.monitors)
        self.plant_waits = self._any(self._some(waiting[m]) for m in network.plant)
        self.waits = [self._some(each) for each in waiting]
        self.few = self._at_most(waiting, FEW)

    def _declare(self, variable: tuple[str, int], count: int) -> None:
        names = [
            f"{variable[0]}{variable[1]}b{bit}" for bit in range(max(1, count - 1).bit_length())
        ]
        self.bdd.declare(*names)
        self.bits[variable] = names

    def _is(self, variable: tuple[str, int], value: int) -> Any:
        return self.bdd.cube(
            {name: bool(value >> n & 1) for n, name in enumerate(self.bits[variable])}
        )

    def _any(self, sets: Iterator[Any]) -> Any:
        found = self.bdd.false
        for each in sets:
            found |= each
        return found

    def _waiting(self, m: int) -> dict[int, Any]:
        """Return the states by how many events wait for a machine."""
        automaton = self.network.automata[m]
        found: dict[int, Any] = {}
        for at, local in enumerate(automaton.locals):
            for n, content in enumerate(automaton.contents):
                count = local.waiting + (len(content) if automaton.queue else 0)
                here = self._is(("at", m), at) & self._is(("queue", m), n)
                found[count] = found.get(count, self.bdd.false) | here
        return found

    def _some(self, waiting: Mapping[int, Any]) -> Any:
        return self._any(states for count, states in waiting.items() if count > 0)

    def _at_most(self, waiting: list[dict[int, Any]], most: int) -> Any:
        sums = {0: self.bdd.true}
        for each in waiting:
            joined: dict[int, Any] = {}
            for a, left in sums.items():
                for b, right in each.items():
                    if a + b <= most:
                        joined[a + b] = joined.get(a + b, self.bdd.false) | left & right
            sums = joined
        return self._any(iter(sums.values()))

    def _mapped(
        self, states: Any, variable: tuple[str, int], to: Callable[[int], int], count: int
    ) -> Any:
        found = self.bdd.false
        for value in range(count):
            part = states & self._is(variable, value)
            if part != self.bdd.false:
                freed = self.bdd.exist(self.bits[variable], part)
                found |= freed & self._is(variable, to(value))
        return found

    # --- steps ------------------------------------------------------------------------------------

    def _may(self, m: int, move: Move) -> Any:
        automaton, takes = self.network.automata[m], move.action is Action.TAKE
        calm = ~self.monitors_wait & ~self.plant_waits
        turn = calm
        if automaton.is_monitor:
            turn = self.bdd.true if takes else calm | self.waits[m]
        elif automaton.is_environment and takes:
            turn = ~self.monitors_wait
        elif automaton.is_environment and move.action is Action.EVENTLESS:
            turn = calm | ~self.monitors_wait & self.waits[m]
        allowed = turn & self._is(("at", m), move.source)
        if move.taken is not None:
            heads = (n for c, n in self.places[m].items() if c[:1] == (move.taken,))
            allowed &= self._any(self._is(("queue", m), n) for n in heads)
        elif move.needs_empty and automaton.queue:
            allowed &= self._is(("queue", m), self.places[m][()])
        return allowed & self.few if move.from_outside else allowed

    def after(self, m: int, move: Move, states: Any) -> Any:
        """Return where a move leads to from some of the states."""
        found = states & self._may(m, move)
        if found == self.bdd.false:
            return found
        automaton = self.network.automata[m]
        found = self._mapped(found, ("at", m), lambda _: move.target, len(automaton.locals))
        if move.taken is not None:
            found = self._queued(m, found, lambda content: content[1:])
        for sent in move.sent:
            found = self._told(sent.target, sent.message, found)
        return self._queued(m, found, lambda _: ()) if automaton.stops(move) else found

    def _queued(self, m: int, states: Any, to: Callable[[tuple[int, ...]], tuple[int, ...]]) -> Any:
        contents = self.network.automata[m].contents
        return self._mapped(
            states, ("queue", m), lambda n: self.places[m][to(contents[n])], len(contents)
        )

    def _told(self, m: int, message: int, states: Any) -> Any:
        automaton = self.network.automata[m]
        if not automaton.queues(message):
            maps = automaton.received(message)
            return self._mapped(states, ("at", m), lambda at: maps[at][0], len(automaton.locals))
        stopped = self._any(
            self._is(("at", m), at) for at in automaton.where(lambda local: not local.running)
        )
        room = automaton.queue
        posted = self._queued(m, states & ~stopped, lambda c: (*c, message) if len(c) < room else c)
        return posted | states & stopped

    def count(self) -> int:
        """Return how many states can be reached."""
        found = self.bdd.false
        for start in self.network.initial:
            here = self.bdd.true
            for m, place in enumerate(start):
                here &= self._is(("at", m), place.local)
                here &= self._is(("queue", m), self.places[m][place.queue])
            found |= here
        before = self.bdd.false
        while found != before:
            before = found
            for m, automaton in enumerate(self.network.automata):
                for move in automaton.moves:
                    found |= self.after(m, move, found)
        return int(self.bdd.count(found, nvars=sum(map(len, self.bits.values()))))


@pytest.mark.cc
@pytest.mark.parametrize("name", NAMES)
def test_as_many_states_are_found(name: str) -> None:
    network = network_of(load_files(SYSTEMS[name]), ExportOptions(untimed=True))
    assert Recount(network).count() == network.states


@pytest.mark.cc
@pytest.mark.parametrize("seed", SEEDS)
def test_as_many_states_of_random_systems_are_found(seed: int) -> None:
    network = network_of(load_files(random_system(seed)), ExportOptions(untimed=True))
    assert Recount(network).count() == network.states
