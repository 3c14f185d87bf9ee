"""A flat machine as a grid: for each state and event the number of a case, which is straight code.

The target state is a number too, so equal contents appear once, whatever their target. A compiler
generates less code than for a function per state, and less than for tables with their readers,
unless too many fields of the grid are empty (see `forms`).
"""

from __future__ import annotations

from dataclasses import dataclass

from fsmkit.chart.chart import Transition
from fsmkit.codegen.c.ir import Unit
from fsmkit.codegen.c.layout import narrowest
from fsmkit.codegen.c.reactions.form_printer import Lines
from fsmkit.codegen.c.reactions.reactions import ReactionPrinter
from fsmkit.emit import Emitter


@dataclass(frozen=True, slots=True)
class _Answer:
    """A case of the grid; ``to``: the number of the state entered, 0 for none."""

    lines: Lines
    to: int


class GridPrinter:
    """Prints the grid, its cases, and the function that looks them up."""

    def __init__(self, reactions: ReactionPrinter) -> None:
        """Create a printer for these reactions."""
        self._reactions = reactions
        self._names = reactions.names
        self._plan = reactions.plan
        self._ignored = f"return {reactions.own}_unhandled(m, cause);"

    def print(self, out: Unit) -> None:
        """Print the grid and its functions."""
        names, events = self._names, self._reactions.by_event
        p, width = names.own, max(events, default=0) + 1
        answers: dict[_Answer, int] = {}
        states = self._plan.regions[0].states
        rows = [[0] * width for _ in states]
        for row, state in zip(rows, states, strict=True):
            for event in events:
                answer = self._answer(state, event)
                if answer is not None:
                    row[event] = answers.setdefault(answer, len(answers) + 1)
        ctype = narrowest(len(answers))
        out.define("grid")
        out.line("/* By state and event: which of the answers below; 0 for none. */")
        with out.block(f"static const {ctype} {p}_grid[{len(rows) * width}] = {{", "};"):
            for state, row in zip(states, rows, strict=True):
                out.line(f"{', '.join(f'{number}u' for number in row)}, {names.note(state)}")
        out.line()
        ctype = narrowest(len(states))
        targets = ", ".join(f"{to}u" for to in (0, *(answer.to for answer in answers)))
        out.define("enters")
        out.line("/* By answer: the number of the state that is entered; 0 for none. */")
        out.line(f"static const {ctype} {p}_enters[{len(answers) + 1}] = {{{targets}}};")
        out.line()
        out.define("respond")
        out.line(f"static fsm_result {p}_respond({p} *m, const {p}_event *cause)")
        with out.block("{"):
            self._respond(out, answers, width, ctype)
        out.line()

    def _respond(self, out: Emitter, answers: dict[_Answer, int], width: int, ctype: str) -> None:
        p, active = self._names.own, f"m->{self._names.regions[0]}"
        with out.block(f"if (cause->event == 0u || cause->event > {width}u) {{"):
            out.line(self._ignored)
        place = f"{active} * {width}u + cause->event - {width + 1}u"
        out.line(f"const uint32_t answer = {p}_grid[{place}];")
        out.line(f"{ctype} to = {p}_enters[answer];")
        with out.block("switch (answer) {"):
            for answer, number in answers.items():
                out.line(f"case {number}u:")
                with out.indented():
                    out.lines(answer.lines)
            out.lines(["default:", f"    {self._ignored}"])
        out.lines(["if (to != 0u) {", f"    {p}_enter_place(m, to);", "}", "return FSM_HANDLED;"])

    def _answer(self, state: int, event: int) -> _Answer | None:
        found = self._reactions.candidates(state, event)
        if not found:
            return None
        out = Emitter()
        first = self._to(found[0])
        for transition in found:
            is_last = transition is found[-1]
            out.line(self._reactions.comment(transition))
            if transition.guard is not None:
                condition = self._reactions.guard(transition)
                if is_last:
                    out.lines([f"if (!({condition})) {{", f"    {self._ignored}", "}"])
                else:
                    out.open(f"if ({condition}) {{")
            step = self._reactions.step(transition)
            out.lines((*step.leave, *step.act))
            if self._to(transition) != first:
                out.line(f"to = {self._to(transition)}u;")
            out.line("break;")
            if not is_last:
                out.close()
        return _Answer(out.collected(), first)

    def _to(self, transition: Transition) -> int:
        return transition.targets[0] if transition.targets else 0
