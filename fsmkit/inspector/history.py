"""What happened: each entry as it was told, and moments from which any of them is made again.

An entry is a macrostep, or something that a client did. A moment is kept every `EVERY` entries and
after each of a client; between two of them steps follow from each other. Of the others only the
text is kept.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterator
from dataclasses import dataclass, field

from fsmkit.inspector.simulation import Moment

EVERY = 64
"""Entries from one kept moment to the next."""
LIMIT = 64_000_000
"""Bytes of text that a history keeps of its branch, and as many of the others; the oldest go."""
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
    texts: list[bytes] = field(default_factory=list)
    moments: dict[int, Moment] = field(default_factory=dict)
    actions: dict[int, ClientAction] = field(default_factory=dict)
    """The entries of clients."""
    size: int = 0

    @property
    def head(self) -> int:
        """The last entry."""
        return self.first + len(self.texts) - 1


class History:
    """A branch that grows, and those that were left."""

    def __init__(self, moment: Moment, limit: int = LIMIT) -> None:
        """Begin with entry 0, before the start."""
        self.limit = limit
        self.number = 0
        """Of the branch in view; each branch has its own."""
        self.branch = Branch(0, [b""], {0: moment})
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

    def add(self, moment: Moment, text: bytes, action: ClientAction | None = None) -> int:
        """Append an entry, after which it is that moment; return its number."""
        branch = self.branch
        branch.texts.append(text)
        branch.size += len(text)
        if action is not None:
            branch.actions[branch.head] = action
        if action is not None or branch.head % EVERY == 0:
            branch.moments[branch.head] = moment
        while branch.size > self.limit and len(branch.texts) > 2 * EVERY:
            self._drop_oldest()
        return branch.head

    def before(self, n: int) -> tuple[int, Moment]:
        """Return the last moment that is kept up to an entry, and its number."""
        kept = sorted(self.branch.moments)
        found = kept[bisect_right(kept, n) - 1]
        return found, self.branch.moments[found]

    def texts(self, first: int, last: int) -> Iterator[bytes]:
        """Yield the messages of entries."""
        branch = self.branch
        for n in range(max(first, branch.first), min(last, branch.head) + 1):
            if branch.texts[n - branch.first]:
                yield branch.texts[n - branch.first]

    def cut(self, n: int, moment: Moment) -> None:
        """Begin a branch after an entry; what came later stays as another one."""
        old = self.branch
        if n == old.head:
            return
        count = n - old.first + 1
        self.others[self.number] = old
        self.branch = Branch(
            old.first,
            old.texts[:count],
            {**{k: m for k, m in old.moments.items() if k < n}, n: moment},
            {k: action for k, action in old.actions.items() if k <= n},
            sum(map(len, old.texts[:count])),
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
        """Forget the oldest of the other branches: they share one limit, and their number has one.

        What branches have in common is counted for each of them.
        """
        others = self.others
        while len(others) > MOST_BRANCHES or sum(b.size for b in others.values()) > self.limit:
            del others[min(others)]

    def _drop_oldest(self) -> None:
        """Forget the entries up to the next moment that is kept."""
        branch = self.branch
        kept = sorted(branch.moments)
        until = next(k for k in kept if k > branch.first)
        count = until - branch.first
        branch.size -= sum(map(len, branch.texts[:count]))
        del branch.texts[:count]
        branch.first = until
        branch.moments = {k: m for k, m in branch.moments.items() if k >= until}
        branch.actions = {k: action for k, action in branch.actions.items() if k >= until}
