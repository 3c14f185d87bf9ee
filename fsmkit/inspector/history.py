"""Store the history of a session: entries, and moments from which they can be recomputed.

An entry is a macrostep or an action of a client. Entries are simulated, or *given* by a source.
For simulated ones, a moment is stored every `EVERY` entries and after each action; the steps
between are recomputed. For given ones, every known moment is stored.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterator
from dataclasses import dataclass, field

from fsmkit.inspector.folding import Folded
from fsmkit.inspector.packed_strings import Texts
from fsmkit.inspector.simulation import Moment, SimulationStep

EVERY = 64
"""Number of entries between stored moments."""
FOLDED_EVERY = 1_024
"""Number of entries without moments between stored states of the machines."""
LIMIT = 64_000_000
"""Bytes that a history keeps of its branch, and as many of the others; the oldest go."""
ENTRY_SIZE = 70
"""Size of an entry without its text: its share of the stored moments, in bytes."""
KNOWN_SIZE = 2_000
"""Size of a stored moment with its step, in bytes."""
MOST_BRANCHES = 32


@dataclass(frozen=True, slots=True)
class ClientAction:
    """Something that a client did, as a line of a script, and when (ticks)."""

    line: str
    at: int
    is_refused: bool = False


@dataclass(slots=True)
class Branch:
    """One course of events. Entry ``first + k`` is ``texts[k]``: messages, joined by commas."""

    first: int
    texts: Texts = field(default_factory=Texts)
    moments: dict[int, Moment] = field(default_factory=dict)
    actions: dict[int, ClientAction] = field(default_factory=dict)
    """The entries of clients."""
    given: int = 0
    """The last entry that a source gave."""
    steps: dict[int, SimulationStep] = field(default_factory=dict)
    """The macrosteps of given entries, where they are known."""
    folded: dict[int, Folded] = field(default_factory=dict)
    """The machines at some of the given entries whose moments are not known."""

    @property
    def head(self) -> int:
        """The last entry."""
        return self.first + len(self.texts) - 1

    def text(self, n: int) -> bytes:
        """Return the messages of an entry."""
        return self.texts[n - self.first]

    @property
    def size(self) -> int:
        """The bytes that it counts for."""
        return self.texts.size + len(self.texts) * ENTRY_SIZE + len(self.steps) * KNOWN_SIZE

    def forget(self, until: int) -> None:
        """Forget the entries before one."""
        self.texts.forget(until - self.first)
        self.first = until
        self.moments = {k: moment for k, moment in self.moments.items() if k >= until}
        self.actions = {k: action for k, action in self.actions.items() if k >= until}
        self.steps = {k: step for k, step in self.steps.items() if k >= until}
        self.folded = {k: folded for k, folded in self.folded.items() if k >= until}

    def known(self, n: int) -> tuple[int, Moment] | None:
        """Return the last moment that is kept up to an entry, and its number."""
        if n in self.moments:
            return n, self.moments[n]
        kept = list(self.moments)  # in order
        place = bisect_right(kept, n) - 1
        return None if place < 0 else (kept[place], self.moments[kept[place]])


class History:
    """The branch in view, and earlier branches.

    Entries of a source are appended to branch 0, which is never dropped, even if another branch is
    in view.
    """

    def __init__(
        self, moment: Moment | None, limit: int = LIMIT, *, is_whole: bool = False
    ) -> None:
        """Start with entry 0, before the start; ``is_whole``: never drop given entries."""
        self.limit = limit
        self._is_whole = is_whole
        self.number = 0
        """The entries of the branch in view."""
        self.branch = Branch(0, Texts([b""]), {} if moment is None else {0: moment})
        self.others: dict[int, Branch] = {}
        self._next = 1

    @property
    def first(self) -> int:
        """The first entry that is still known."""
        return self.branch.first

    @property
    def head(self) -> int:
        """The last entry of the branch in view."""
        return self.branch.head

    @property
    def given(self) -> Branch:
        """The branch to which a source gives its entries."""
        return self.branch if self.number == 0 else self.others[0]

    def add(self, moment: Moment, text: bytes, action: ClientAction | None = None) -> int:
        """Append an entry, after which it is that moment; return its number."""
        branch = self.branch
        branch.texts.append(text)
        if action is not None:
            branch.actions[branch.head] = action
        if action is not None or branch.head % EVERY == 0:
            branch.moments[branch.head] = moment
        self._drop_oldest(branch)
        return branch.head

    def give(
        self,
        text: bytes,
        moment: Moment | None,
        stepped: SimulationStep | None,
        action: ClientAction | None,
    ) -> int:
        """Append an entry of a source; return its number."""
        branch = self.given
        branch.texts.append(text)
        n = branch.given = branch.head
        if moment is not None:
            branch.moments[n] = moment
        if stepped is not None:
            branch.steps[n] = stepped
        if action is not None:
            branch.actions[n] = action
        self._drop_oldest(branch)
        return n

    def texts(self, first: int, last: int) -> Iterator[bytes]:
        """Yield the messages of entries."""
        branch = self.branch
        for n in range(max(first, branch.first), min(last, branch.head) + 1):
            if branch.text(n):
                yield branch.text(n)

    def cut(self, n: int, moment: Moment, *, always: bool = False) -> None:
        """Start a branch after an entry; later entries remain as another branch.

        At the head there are no later entries, so there is no new branch unless ``always``.
        """
        old = self.branch
        if n == old.head and not always:
            return
        self.others[self.number] = old
        self.branch = Branch(
            old.first,
            old.texts.first(n - old.first + 1),
            {**{k: m for k, m in old.moments.items() if k < n}, n: moment},
            {k: action for k, action in old.actions.items() if k <= n},
            min(old.given, n),
            {k: step for k, step in old.steps.items() if k <= n},
            {k: folded for k, folded in old.folded.items() if k <= n},
        )
        self.number, self._next = self._next, self._next + 1
        self._drop_branches()

    def switch(self, number: int) -> None:
        """Take another branch into view."""
        self.others[self.number] = self.branch
        self.branch = self.others.pop(number)
        self.number = number
        self._drop_branches()

    def _drop_branches(self) -> None:
        """Drop the oldest other branches, which share one limit of size and one of number.

        Common parts are counted for each branch. Given entries are kept.
        """
        others = {k: branch for k, branch in self.others.items() if k or not branch.given}
        while len(others) > MOST_BRANCHES or sum(b.size for b in others.values()) > self.limit:
            oldest = min(others)
            del others[oldest], self.others[oldest]

    def _drop_oldest(self, branch: Branch) -> None:
        """Keep a branch within the limit.

        A full branch drops many entries at once, up to the next stored moment, to keep the cost
        per entry low.
        """
        if branch.size <= self.limit or (branch.given and self._is_whole):
            return
        length = len(branch.texts)
        count = length - length * self.limit * 15 // (16 * branch.size)
        least = branch.first + min(count, length - 2 * EVERY)
        kept = (k for known in (branch.moments, branch.folded) for k in known)
        until = min((k for k in kept if k >= least), default=None)
        if until is not None and until > branch.first:
            branch.forget(until)
