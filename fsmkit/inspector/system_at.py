"""Compute the system at each entry of a history, by simulation or from the source."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import NamedTuple

import msgspec
from msgspec import Struct
from msgspec.structs import replace

from fsmkit.inspector.as_messages import MessageEncoder
from fsmkit.inspector.commands import wrong
from fsmkit.inspector.folding import Folded, Folding, fold
from fsmkit.inspector.history import FOLDED_EVERY, LIMIT, Branch, ClientAction, History
from fsmkit.inspector.simulation import Moment, Simulation, SimulationStep
from fsmkit.inspector.sources import Entry
from fsmkit.runtime.live.messages import (
    AnyMessage,
    Lost,
    Pass,
    Post,
    Set,
    State,
    Step,
    to_json,
)

_messages: msgspec.json.Decoder[list[AnyMessage]] = msgspec.json.Decoder(list[AnyMessage])


class HistoryEntry(NamedTuple):
    """An entry, and the system before and after it; None where that is not known."""

    n: int
    before: Moment | None
    after: Moment | None


class _Timed(Struct):
    at: int


_times: msgspec.json.Decoder[list[_Timed]] = msgspec.json.Decoder(list[_Timed])


class Course:
    """A history, and the system at each of its entries."""

    def __init__(
        self,
        simulation: Simulation,
        begin: Moment | None,
        limit: int = LIMIT,
        *,
        is_whole: bool = False,
        is_followed: bool = False,
    ) -> None:
        """Start at a moment.

        ``is_whole``: never drop entries of a source. ``is_followed``: its entries arrive over
        time.
        """
        self.simulation = simulation
        self.encoder = MessageEncoder(simulation)
        self.history = History(begin, limit, is_whole=is_whole)
        self.is_followed = is_followed
        self._folding: Folding | None = None
        """The machines after the last entry that was given, if no moment is known there."""
        self.on_entry: Callable[[bytes], None] | None = None
        """Called with the messages of each entry; for a followed program, of given entries only."""

    # --- adding entries -----------------------------------------------------------------------

    def add(self, moment: Moment, messages: Sequence[AnyMessage]) -> bytes:
        """Append an entry of the simulation to the branch in view; return its messages."""
        text = _joined(messages)
        self.history.add(moment, text, self._action(messages[0]))
        if self.on_entry is not None and not self.is_followed:
            self.on_entry(text)
        return text

    def give(self, entry: Entry) -> bytes:
        """Append an entry of a source to branch 0; return its messages, numbered."""
        given = self.history.given
        n = given.head + 1
        text = b",".join([to_json(replace(message, n=n)) for message in entry.messages])
        first = entry.messages[0]
        action = self._action(first) if isinstance(first, Post | Set) else None
        if entry.moment is not None:
            self._folding = None
        else:
            if self._folding is None:
                self._folding = Folding(self._fold(given, n - 1))
            self._folding.take(entry.messages)
            if n % FOLDED_EVERY == 0:
                given.folded[n] = self._folding.folded
        self.history.give(text, entry.moment, entry.stepped, action)
        if self.on_entry is not None:
            self.on_entry(text)
        return text

    def _action(self, message: AnyMessage) -> ClientAction | None:
        line = self.encoder.action_line(message)
        if line is None or not isinstance(message, Post | Set):
            return None
        is_refused = isinstance(message, Post) and message.how == "refused"
        return ClientAction(line, message.at, is_refused)

    # --- queries -------------------------------------------------------------------------

    def messages(self, n: int) -> list[AnyMessage]:
        """Return the messages of an entry."""
        return _messages.decode(b"[" + self.history.branch.text(n) + b"]")

    def at(self, n: int) -> int:
        """Return the time of an entry (ticks)."""
        branch = self.history.branch
        text = branch.text(n)
        if not text or n in branch.moments:
            return branch.moments[n].now if n in branch.moments else 0
        return _times.decode(b"[" + text + b"]")[0].at

    def last_at(self, at: int) -> int:
        """Return the last entry up to a time, or the first that is known."""
        low, high = self.history.first, self.history.head
        while low < high:
            middle = (low + high + 1) // 2
            low, high = (middle, high) if self.at(middle) <= at else (low, middle - 1)
        return low

    def moment(self, n: int) -> Moment | None:
        """Return the system after an entry; None if that is not known."""
        branch = self.history.branch
        found = branch.known(n)
        if found is None or found[0] < n <= branch.given:
            return None
        kept, moment = found
        for _ in range(n - kept):
            moment, _ = self.simulation.step(moment)
        return moment

    def after(self, n: int, before: Moment | None) -> Moment | None:
        """Return the system after an entry, by the one after the entry before it."""
        branch = self.history.branch
        if n <= branch.given or n in branch.moments:
            return self.moment(n)
        return None if before is None else self.simulation.step(before)[0]

    def stepped(self, n: int) -> SimulationStep | None:
        """Return the macrostep of an entry; None if it is not one, or is unknown."""
        branch = self.history.branch
        if n <= branch.given or n in branch.actions:
            return branch.steps.get(n)
        before = self.moment(n - 1)
        return None if before is None else self.simulation.step(before)[1]

    def back(self, n: int) -> Iterator[HistoryEntry]:
        """Yield the entries up to `n`, the latest first, with the system before and after each."""
        branch = self.history.branch
        while n > branch.first:
            known = branch.known(n - 1)
            first = n if n <= branch.given or known is None else known[0] + 1
            moment = self.moment(first - 1)
            made: list[HistoryEntry] = []
            for number in range(first, n + 1):
                before = moment
                if number <= branch.given or number in branch.actions:
                    moment = self.moment(number)
                elif before is not None:
                    moment, _ = self.simulation.step(before)
                made.append(HistoryEntry(number, before, moment))
            yield from reversed(made)
            n = first - 1

    def folded(self, n: int) -> Folded:
        """Return all machines after an entry, as far as they are known."""
        moment = self.moment(n)
        if moment is not None:
            return Folded(self.encoder.states(n, moment))
        branch = self.history.branch
        if self._folding is not None and branch is self.history.given and n == branch.head:
            return self._state_of_entry(self._folding.folded, n)
        return self._fold(branch, n)

    def _fold(self, branch: Branch, n: int) -> Folded:
        """Return the machines after an entry without a moment, by the messages up to there."""
        first, folded = branch.first, Folded(self.encoder.unknown(branch.first))
        known = branch.known(n)
        if known is not None:
            unknown = (replace(each, known=False) for each in self.encoder.states(*known))
            first, folded = known[0], Folded(tuple(unknown))
        last = max((k for k in branch.folded if k <= n), default=-1)
        if last > first:
            first, folded = last, branch.folded[last]
        texts = [branch.text(k) for k in range(first + 1, n + 1)]
        found = _messages.decode(b"[" + b",".join(filter(None, texts)) + b"]")
        return self._state_of_entry(fold(folded, found), n)

    def _state_of_entry(self, folded: Folded, n: int) -> Folded:
        """Return the state in an entry's messages: active states in document order."""
        charts = dict(zip(self.simulation.names, self.simulation.charts, strict=True))
        states = []
        for state in folded.states:
            places = charts[state.m].state_index
            on = [name for name in places if name in state.on]
            states.append(replace(state, n=n, on=on))
        return Folded(tuple(states), folded.lost)

    # --- branches ------------------------------------------------------------------------------

    def switch(self, number: int) -> None:
        """Take another branch into view."""
        self.history.switch(number)
        for text in filter(None, self.history.branch.texts):
            if self.on_entry is not None and not self.is_followed:
                self.on_entry(text)

    def cut(self, n: int, moment: Moment | None, *, always: bool = False) -> Moment:
        """Continue after an entry whose system is `moment`; return that moment.

        A given branch is never continued itself. Raises `FsmkitError` if the moment is unknown.
        """
        if moment is None:
            raise wrong(
                "the data are not known at this entry",
                "go to an entry where they are known, and start there",
            )
        is_given = self.history.number == 0 and n == self.history.branch.given > 0
        self.history.cut(n, moment, always=always or is_given)
        return moment


def time_of(message: AnyMessage) -> int:
    """Return the time of a message in ticks."""
    return message.at if isinstance(message, Step | State | Set | Post | Pass | Lost) else 0


def _joined(messages: Sequence[AnyMessage]) -> bytes:
    return b",".join([to_json(message) for message in messages])
