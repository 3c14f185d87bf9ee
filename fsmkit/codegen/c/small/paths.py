"""What is entered, as bytes: places of states, and codes for what has to be asked or done between.

A path ends with 0. A code greater than all places stands for a special step, which says how many
bytes to skip: so the branches of histories need no code of their own.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

from fsmkit.codegen.c.reactions.entry_sets import MovePrinter
from fsmkit.document.document import Kind
from fsmkit.emit import Emitter
from fsmkit.plan import Branch, Content, Enter, Op, Restore
from fsmkit.plan.entries import entry_by_default

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
        self._known: dict[tuple[int | None, tuple[Op, ...]], int] = {}
        self._ends: dict[tuple[int, ...], list[int]] = {}
        """Where paths end, by their last codes."""

    def add(self, ops: tuple[Op, ...], until: int | None = None) -> int:
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

    def at(self, ops: tuple[Op, ...], until: int | None = None) -> int:
        """Return where a path begins that was added before the machine was printed."""
        return self._known[until, ops]

    def _encoded(self, ops: Sequence[Op]) -> list[int]:
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
                case Restore(history, below):
                    found += self._restored(history, below)
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

    def _restored(self, history: int, below: int) -> list[int]:
        chart, plan, names = self._chart, self._plan, self._moves.names
        if chart.states[history].kind is Kind.SHALLOW_HISTORY:
            region = plan.region_of[below]
            member = f"m->{names.histories[history, region]}"
            found: list[int] = []
            for child in reversed(chart.states[below].children):
                if not chart.states[child].is_history:
                    path = self._encoded(entry_by_default(chart, child))
                    found = self._either(f"{member} == {names.number(child)}", path, found)
            return found
        self.restores = True
        calls = []
        for index in plan.recorded_regions[history]:
            top = plan.regions[index].top
            own = plan.region_of[below] == index and chart.states[below].kind is Kind.COMPOUND
            if not own and not chart.is_descendant(top, below):
                continue
            begin = below if own else top - 1
            end = f"m->{names.histories[history, index]}"
            calls.append(f"{names.own}_enter_recorded(m, {begin}u, {end});")
        return [self._special(calls)]
