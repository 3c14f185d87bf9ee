"""The actions of entering and exiting a state in C, printed from the Plan."""

from __future__ import annotations

from collections.abc import Iterable
from typing import assert_never

from fsmkit.chart.analysis.effects import can_fail
from fsmkit.codegen.c.expressions.content import ContentPrinter
from fsmkit.codegen.c.expressions.expressions import Printer
from fsmkit.codegen.c.expressions.transfer import Place, copy, put_default
from fsmkit.codegen.c.ir import Unit
from fsmkit.codegen.c.names import Names
from fsmkit.codegen.c.storage import storage
from fsmkit.emit import Emitter
from fsmkit.language import Expr
from fsmkit.plan import Plan
from fsmkit.plan.operations import (
    Action,
    Arm,
    Disarm,
    DropInvoke,
    EndInvoked,
    Finish,
    Forget,
    IfFinal,
    RaiseDone,
    Run,
    WantInvoke,
)


class ActionPrinter:
    """Prints actions."""

    def __init__(self, names: Names, content: ContentPrinter) -> None:
        """Create a printer with these names."""
        self.names = names
        self.plan: Plan = names.plan
        self.chart = names.chart
        self.content = content
        self.own = names.own

    def exit_actions(self, out: Emitter, state: int) -> None:
        """Print the actions of exiting a state."""
        self.print(out, self.plan.leaving[state], "exit of " + self.chart.states[state].id)

    def entry_actions(self, out: Emitter, state: int) -> None:
        """Print the actions of entering a state, except clearing its histories."""
        actions = (each for each in self.plan.entering[state] if not isinstance(each, Forget))
        self.print(out, actions, "entry of " + self.chart.states[state].id)

    def take_content(self, out: Emitter, transition: int) -> None:
        """Print the hook and the content of a default transition."""
        out.line(f"{self.names.hook('TAKE')}(m, {transition}u);")
        content = self.chart.transitions[transition].content
        self.content.block(out, content, (), f"transition {transition}")

    def print(self, out: Emitter, actions: Iterable[Action], what: str) -> None:
        """Print actions in their order; ``what``: a description for comments."""
        for action in actions:
            match action:
                case Forget(history):
                    self.forget(out, history)
                case Arm(transition):
                    out.line(self.arm(transition))
                case Disarm(transition):
                    out.line(f"{self.own}_disarm(m, {self.names.timer(transition)});")
                case Run(block):
                    self.content.block(out, block, (), what)
                case WantInvoke(state):
                    member, bit = self.names.to_invoke(state)
                    out.line(f"{member} = (uint8_t)({member} | {bit}u);")
                case DropInvoke(state):
                    member, bit = self.names.to_invoke(state)
                    out.line(f"{member} = (uint8_t)({member} & {255 - bit}u);")
                case EndInvoked(invocation):
                    out.line(f"{self.own}_end_{invocation}(m);")
                case RaiseDone():
                    self._raise(out, action)
                case IfFinal(_, finals, event):
                    with out.block(f"if ({self._in_final(finals)}) {{"):
                        self._raise(out, event)
                case Finish():
                    out.lines(["m->fsm.running = false;", "m->fsm.finished = true;"])
                case _:
                    assert_never(action)

    def arm(self, transition: int) -> str:
        """Return the call that arms the timer of a transition."""
        names, timed = self.names, self.chart.transitions[transition]
        delay = names.constant(timed.delay_name) or f"{timed.delay}u"
        return f"{self.own}_arm(m, {names.timer(transition)}, {delay});"

    def forget(self, out: Emitter, history: int) -> None:
        """Print the statement that clears a history."""
        for region in self.plan.recorded_regions[history]:
            if (history, region) in self.names.histories:
                out.line(f"m->{self.names.histories[history, region]} = 0u;")

    def _in_final(self, finals: tuple[tuple[int, ...], ...]) -> str:
        """Return the condition that one of each of some final states is active."""
        tests = [[self.names.in_state("m", final).text for final in each] for each in finals]
        return " && ".join(f"({' || '.join(each)})" if each else "false" for each in tests)

    def _raise(self, out: Emitter, done: RaiseDone) -> None:
        self.done_event(out, done.event, done.data)
        out.line(f"{self.own}_raise(m, &e, false);")
        out.close()

    def print_end_report(self, out: Unit, event: int) -> None:
        """Print the function that reports the end to the invoker, with the final state's data."""
        names = self.names
        names.used.add("to_invoker")
        out.define("tell_end")
        out.line(f"static void {self.own}_tell_end({self.own} *m)")
        with out.block("{"):
            for final in self.plan.endings:
                test = names.in_state("m", final).text
                with out.block(f"if ({test}) {{ {names.note(final)}"):
                    self.done_event(out, event, self.chart.states[final].done_data)
                    out.line(f"{self.own}_to_invoker(m, &e);")
                    out.close()
        out.line()

    def done_event(self, out: Emitter, event: int, data: tuple[Expr, ...]) -> None:
        """Open a block in which ``e`` is the event with a final state's data (SCXML 5.5)."""
        names = self.names
        out.open("{")
        out.line(f"{self.own}_event e = {names.own_upper}_NO_EVENT;")
        out.line(f"e.event = {names.event(event)};")
        for number, part in enumerate(self.chart.events[event].fields):
            printer = Printer(names)
            place = f"e.of.{names.payloads[event]}.{names.field(part.name)}"
            put_default(out, Place(names, part.type, place))
            if number < len(data):
                text = printer.value(data[number], part.type)
                out.open("{")
                for ctype, name in printer.temporaries:
                    out.line(f"{ctype} {name};")
                if can_fail(data[number]):
                    out.line(f"{storage(part.type, names.records).text} value = {text};")
                    with out.block("if (m->fsm.failed == FSM_FINE) {"):
                        out.line(f"{place} = value;")
                    out.line(f"{self.own}_end_block(m);")
                    names.used.add("end_block")
                else:
                    copy(out, Place(names, part.type, text), Place(names, part.type, place))
                out.close()
