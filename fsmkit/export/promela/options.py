"""What the processes of a model do, option by option, and where the machines are on a path."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from fsmkit.export.changes import Joint, joined
from fsmkit.export.network import Move, Network, Sent
from fsmkit.export.promela.identifiers import Spelling


def options(spelling: Spelling, machine: int) -> tuple[Joint, ...]:
    """Return the moves of a machine by what an option of its process does."""
    automaton = spelling.network.automata[machine]
    return joined(automaton.moves, automaton.signature, spelling.parts.codes[machine])


class Walk:
    """Where the machines are on a path: their local states, as moves of the network change them."""

    def __init__(self, network: Network, start: int) -> None:
        """Begin in an initial state, by its number."""
        self._network = network
        self._at = [place.local for place in network.initial[start]]

    def take(self, machine: int, option: Joint) -> Move | None:
        """Perform the move of an option that comes from here; None: there is none."""
        found = next((move for move in option.moves if move.source == self._at[machine]), None)
        if found is not None:
            self._at[machine] = found.target
            self._tell(found.sent)
        return found

    def elapse(self) -> None:
        """Let a unit of time pass."""
        self._at = [
            automaton.elapsed.get(at, at)
            for automaton, at in zip(self._network.automata, self._at, strict=True)
        ]

    def _tell(self, sent: Iterable[Sent]) -> None:
        for target, message in ((s.target, s.message) for s in sent):
            automaton = self._network.automata[target]
            if automaton.queues(message):
                continue
            after, is_full = automaton.receives.get((self._at[target], message), (None, True))
            if after is not None and not is_full:
                self._at[target] = after


def performers(spelling: Spelling) -> Iterator[tuple[int, Joint]]:
    """Yield all options with their machines, in the order of the model."""
    for machine in range(len(spelling.network.automata)):
        for option in options(spelling, machine):
            yield machine, option
