"""What is entered, as bytes: places of states, and codes for what has to be asked or done between.

A path ends with 0. A code greater than all places stands for a special step, which says how many
bytes to skip: so the branches of histories need no code of their own.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

from fsmkit.codegen.c.reactions.entry_sets import MovePrinter
from fsmkit.document.document import Kind
from fsmkit.emit import Emitter
from fsmkit.plan import Branch, Content, Enter, Restore
from fsmkit.plan.operations import Ops
from fsmkit.plan.restoring import restored_regions

Lines = tuple[str, ...]
SUFFIX = 8
"""By so many of its last codes a path is looked for."""


class Paths:
    """All paths of a machine, one after the other."""

    def __init__(self, moves: MovePrinter) -> None:
        """Begin without any."""
        self._moves = moves
        self._chart = moves.chart
        self._plan = moves.plan
        self.codes: list[int] = []
        self.specials: dict[Lines, int] = {}
        """The code of each special step, by its lines in C."""
        self.restores = False
        """Whether one enters what a deep history recorded."""
        self._known: dict[tuple[int | None, Ops], int] = {}
        self._ends: dict[tuple[int, ...], list[int]] = {}
        """Where paths end, by their last codes."""

    def add(self, ops: Ops, until: int | None = None) -> int:
        """Return where the path of operations begins; it may be an end of another.

        ``until``: the place that stands before it, where paths have one.
        """
        if (until, ops) not in self._known:
            path = [*([] if until is None else [until]), *self._encoded(ops), 0]
            self._known[until, ops] = self._place(path)
        return self._known[until, ops]

    def begin(self, codes: list[int]) -> None:
        """Put codes at the end, whatever stands there already."""
        first = len(self.codes) + 1
        self.codes += codes
        for end in range(first, len(self.codes) + 1):
            if self.codes[end - 1] == 0:
                self._note_end(end)

    def _note_end(self, end: int) -> None:
        for length in range(1, SUFFIX + 1):
            ends = self._ends.setdefault(tuple(self.codes[max(0, end - length) : end]), [])
            if length == SUFFIX or not ends:  # all that end with a shorter one are the same path
                ends.append(end)

    def _place(self, path: list[int]) -> int:
        """Return where the codes of a path stand first, put at the end if they stand nowhere."""
        for end in self._ends.get(tuple(path[-SUFFIX:]), ()):
            at = end - len(path)
            if at >= 0 and self.codes[at:end] == path:
                return at
        at = len(self.codes)
        self.begin(path)
        return at

    def at(self, ops: Ops, until: int | None = None) -> int:
        """Return where a path begins that was added before the machine was printed."""
        return self._known[until, ops]

    def _encoded(self, ops: Ops) -> list[int]:
        found: list[int] = []
        for op in ops:
            match op:
                case Enter(state, defaults):
                    found.append(state)
                    found += map(self._content, defaults)
                case Content(transition):
                    found.append(self._content(transition))
                case Branch(history, recorded, unrecorded):
                    test = self._moves.is_recorded(history)
                    found += self._either(test, self._encoded(recorded), self._encoded(unrecorded))
                case Restore():
                    found += self._restored(op)
        return found

    def _special(self, lines: Sequence[str], skip: str = "0u") -> int:
        key = (*lines, f"return {skip};")
        return self.specials.setdefault(key, len(self._chart.states) + len(self.specials))

    def _lines(self, print_: Callable[[Emitter], None]) -> Lines:
        out = Emitter()
        print_(out)
        return out.collected()

    def _content(self, transition: int) -> int:
        return self._special(self._lines(lambda out: self._moves.take_content(out, transition)))

    def _either(self, test: str, first: list[int], second: list[int]) -> list[int]:
        """Return the first path if a test holds, else the second."""
        if second:
            first = [*first, self._special((), f"{len(second)}u")]
        skip = (f"if ({test}) {{", "    return 0u;", "}")
        return [self._special(skip, f"{len(first)}u"), *first, *second]

    def _restored(self, restore: Restore) -> list[int]:
        names, history = self._moves.names, restore.history
        if self._chart.states[history].kind is Kind.SHALLOW_HISTORY:
            (resume,) = self._plan.resumed(restore)
            member = f"m->{names.histories[history, resume.region]}"
            found: list[int] = []
            for child, ops in reversed(resume.cases):
                test = f"{member} == {names.number(child)}"
                found = self._either(test, self._encoded(ops), found)
            return found
        self.restores = True
        calls = []
        for region, first in restored_regions(self._plan, restore):
            end = f"m->{names.histories[history, region]}"
            calls.append(f"{names.own}_enter_recorded(m, {first}u, {end});")
        return [self._special(calls)]
