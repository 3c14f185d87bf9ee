"""The source of a generated machine, section by section in the order of the file."""

from __future__ import annotations

from fsmkit.chart.analysis.host_events import sent_events
from fsmkit.codegen.c.allowed import print_allowed
from fsmkit.codegen.c.coverage import is_counted, print_access, print_counters
from fsmkit.codegen.c.expressions.cases import default
from fsmkit.codegen.c.expressions.content import ROUTES, ContentPrinter
from fsmkit.codegen.c.expressions.functions import print_functions
from fsmkit.codegen.c.expressions.types import loaded, parameter_type
from fsmkit.codegen.c.forms import Form
from fsmkit.codegen.c.header import banner, parameters
from fsmkit.codegen.c.interface import InterfacePrinter
from fsmkit.codegen.c.ir import Unit, reachable, resolve_prefixes
from fsmkit.codegen.c.layout import narrowest
from fsmkit.codegen.c.names import Names
from fsmkit.codegen.c.pieces import print_pieces
from fsmkit.codegen.c.reactions.deferral import print_is_deferred, print_is_kept
from fsmkit.codegen.c.reactions.form_printer import FormPrinter
from fsmkit.codegen.c.reactions.grid import GridPrinter
from fsmkit.codegen.c.reactions.invocation import InvocationPrinter
from fsmkit.codegen.c.reactions.reactions import ReactionPrinter
from fsmkit.codegen.c.reactions.selection import SelectionPrinter
from fsmkit.codegen.c.reactions.steps import StepPrinter
from fsmkit.codegen.c.reactions.straight import StraightPrinter
from fsmkit.codegen.c.small.tables import TablePrinter
from fsmkit.language import RecordType


class SourcePrinter:
    """Prints the content first, since its calls decide which helpers the file holds."""

    def __init__(self, names: Names) -> None:
        """Print everything that depends on the states of the chart."""
        self.names = names
        self.chart = names.chart
        self.functions = Unit()
        print_functions(self.functions, names)
        self.blocks = Unit()
        content = ContentPrinter(names, self.blocks)
        self.content = content
        self.guards = Unit()
        self.selection = SelectionPrinter(names, content, self.guards)
        kind = TablePrinter if names.options.is_small else StraightPrinter
        self.form: FormPrinter = kind(names, content, self.selection)
        self.invocation = InvocationPrinter(names, content)
        self.reactions = ReactionPrinter(names, content, self.form, self.selection)
        self.answers = Unit()
        """The functions that handle events, which the loop calls."""
        self.states = Unit()
        self.selectors = Unit()
        self.steps = Unit()
        self.form.print_states(self.states)
        self._print_selection()
        self._print_start()

    def text(self) -> str:
        """Return the whole file."""
        names = self.names
        out = Unit()
        out.lines(banner(names, f"{names.prefix}.c"))
        out.line(f'#include "{names.own}.h"')
        out.line()
        left = "(m)->fsm.budget" if names.does.loops else f"{names.own_upper}_MICROSTEPS - 1u"
        out.lines(["#undef FSM_MICROSTEPS_LEFT", f"#define FSM_MICROSTEPS_LEFT(m) ({left})"])
        out.line()
        if names.timers:
            out.line("/* Timers, by their transitions. */")
            with out.block("enum {", "};"):
                out.wrapped(f"{timer} = {index}" for index, timer in names.timers.items())
            out.line()
        if is_counted(names):
            print_counters(out, names)
        self._prologue(out)
        out.include(self.functions)
        self._calls(out)
        for part in (self.blocks, self.states, self.guards, self.selectors, self.steps):
            out.include(part)
            out.line()
        InterfacePrinter(names).print(out)
        if is_counted(names):
            print_access(out, names)
        return resolve_prefixes(reachable(out.definitions()), names.prefix, names.upper)

    # --- parts ----------------------------------------------------------------------------

    def _prologue(self, out: Unit) -> None:
        names = self.names
        if self.names.does.delays:
            reached = [f"INVOKED_{number}" for number in names.reached.values()]
            up = ["INVOKER"] if "to_invoker" in names.used else []
            routes = ", ".join(
                f"{names.own_upper}_TO_{r}" for r in (*ROUTES.values(), *up, *reached)
            )
            out.line(f"enum {{ {routes} }};")
            out.line()
        print_pieces(out, names, "queue", "no_event", "stop", "take_out", "has_room", "enqueue")
        print_pieces(out, names, "content")
        print_pieces(out, names, "timers")
        print_allowed(out, names)

    def _calls(self, out: Unit) -> None:
        """Print the wrappers of operations and of outgoing events."""
        names = self.names
        p = names.own
        for operation in self.chart.operations:
            fields, result = operation.parameters, operation.result
            ctype = "void" if result is None else parameter_type(result, names)
            name = names.operations[operation.name]
            head = f"static {ctype} {p}_call_{name}({p} *m{parameters(fields, names)})"
            passed = "".join(f", {names.field(part.name)}" for part in fields)
            out.define(f"call_{name}")
            out.line(head)
            with out.block("{"):
                with out.block("if (m->fsm.failed != FSM_FINE) {"):
                    empty = "{0}" if isinstance(result, RecordType) else "0"
                    if isinstance(result, RecordType):
                        out.line(f"return ({ctype}){empty};")
                    else:
                        zero = "false" if ctype == "bool" else f"({ctype}){empty}"
                        out.line("return;" if result is None else f"return {zero};")
                call = f"{p}_{name}(m{passed})"
                out.line(f"{call};" if result is None else f"return {call};")
            out.line()
        if names.does.delays:
            self._emit(out)
        self.invocation.print_calls(out)

    def _emit(self, out: Unit) -> None:
        names = self.names
        p = names.own
        out.define("emit")
        out.line(f"static void {p}_emit({p} *m, const {p}_event *e, uint16_t peer)")
        with out.block("{"):
            out.line("FSM_HOOK_EVENT(m, FSM_LEFT, e);")
            out.line('FSM_HOOK_TEXT(m, FSM_LEFT, "", peer);')
            with out.block("switch (e->event) {"):
                for event in (self.chart.events[index] for index in sent_events(self.chart)):
                    out.line(f"case {names.events[event.index]}:")
                    with out.indented():
                        payload = f"e->of.{names.payloads[event.index]}"
                        passed = "".join(
                            f", {loaded(part.type, f'{payload}.{names.field(part.name)}', names)}"
                            for part in event.fields
                        )
                        out.line(f"{p}_send_{names.event_names[event.index]}(m{passed});")
                        out.line("break;")
                default(out)
        out.line()

    def _print_selection(self) -> None:
        out, names = self.selectors, self.names
        reactions = self.reactions
        reactions.print_eventless(self.answers)
        if reactions.decisions.is_general:
            self.form.print_general(self.states)
            self._select(out)
        print_is_deferred(out, names)
        if names.does.defers and not reactions.decisions.has_straight:
            return
        if names.form is Form.GRID:
            GridPrinter(reactions).print(self.answers)
        elif names.form is Form.TABLES:
            answer = "respond_any" if reactions.decisions.is_general else "unhandled"
            parts = {"SELF_ANSWER": f"{names.own}_{answer}"}
            print_pieces(
                self.answers,
                names,
                "selection",
                "respond",
                parts=parts,
            )
        elif names.plan.is_single:
            reactions.print_by_state(self.answers)
        else:
            reactions.print_by_event(self.answers)

    def _select(self, out: Unit) -> None:
        self.form.print_selection(out)
        if not self.names.plan.is_single:
            print_pieces(out, self.names, "selection", "selection", "add")
        self.form.print_selectors(out)

    def _print_start(self) -> None:
        out, names = self.steps, self.names
        if not names.plan.is_single and self.reactions.decisions.is_general:
            self._tables(out)
            print_pieces(out, names, "selection", "conflict", "remove_conflicts", "microstep")
        StepPrinter(
            names,
            self.content,
            self.selection,
            self.form,
            self.reactions,
            self.answers,
            self.invocation,
        ).print(out)

    def _tables(self, out: Unit) -> None:
        chart, p = self.chart, self.names.own
        ends = [end + 1 for end in self.names.plan.ends]
        below = ", ".join(f"{end}u" for end in ends)
        sources = ", ".join(["0u", *(f"{t.source}u" for t in chart.transitions)])
        out.define("last_below")
        out.line("/* By state: the last state below it, plus one. */")
        out.line(f"static const {narrowest(max(ends))} {p}_last_below[] = {{{below}}};")
        out.line()
        out.define("source_of")
        out.line("/* By transition plus one: its source. */")
        ctype = narrowest(len(chart.states))
        out.line(f"static const {ctype} {p}_source_of[] = {{{sources}}};")
        out.line()
        print_is_kept(out, self.names)
