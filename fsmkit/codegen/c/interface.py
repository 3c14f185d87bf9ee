"""The functions for hosts, except those that step: creation, posting, queries, names."""

from __future__ import annotations

from collections.abc import Sequence

from fsmkit.chart.analysis.host_events import posted_events
from fsmkit.codegen.c.expressions.cases import default
from fsmkit.codegen.c.expressions.expressions import Printer, literal_initializer
from fsmkit.codegen.c.header import parameters
from fsmkit.codegen.c.ir import Unit
from fsmkit.codegen.c.layout import narrowest
from fsmkit.codegen.c.names import Names
from fsmkit.codegen.c.pieces import print_pieces
from fsmkit.codegen.c.sharing import number_of
from fsmkit.codegen.c.storage import storage
from fsmkit.emit import Emitter
from fsmkit.emit.c import quoted
from fsmkit.language import ArrayType, EnumType, Field, RecordType


class InterfacePrinter:
    """Prints the functions of a machine's interface."""

    def __init__(self, names: Names) -> None:
        """Create a printer with these names."""
        self.names = names
        self.chart = names.chart

    def print(self, out: Unit) -> None:
        """Print all functions of the interface."""
        self._interface(out)
        self._names(out)

    def _interface(self, out: Unit) -> None:
        names, chart = self.names, self.chart
        p = names.own
        printer = Printer(names)
        out.define()
        out.line(f"void {p}_init({p} *m)")
        with out.block("{"):
            out.line("fsm_clear(m, sizeof *m);")
            for variable in (*chart.inputs, *chart.outputs, *chart.data):
                self._initialize(out, variable.name, variable.init.value, variable.type, printer)
            for inside, slot in zip(names.invoked, names.slots, strict=True):
                out.line(f"{inside.prefix}_init(&m->{slot});")
        out.line()
        if not names.is_invoked and names.does.queued:
            posted = posted_events(chart)
            for event in posted:
                if chart.events[event].fields:
                    self._post(out, event)
            if any(not chart.events[event].fields for event in posted):
                print_pieces(out, names, "queue", "post_by_name")
        has_timers = self.names.has_timers or self.names.does.delays
        out.define()
        out.line(f"bool {p}_next_deadline(const {p} *m, uint32_t *deadline)")
        with out.block("{"):
            if names.slots:
                self._first_of_all(out)
            elif has_timers:
                out.line("return fsm_timers_first(m->fsm.timers, m->fsm.timer_count, deadline);")
            else:
                out.lines(["(void)m;", "(void)deadline;", "return false;"])
        out.line()
        out.line(f"void {p}_rebase({p} *m, uint32_t now)")
        with out.block("{"):
            if has_timers:
                with out.block("for (uint8_t i = 0u; i < m->fsm.timer_count; i++) {"):
                    out.line("m->fsm.timers[i].deadline -= now;")
            if names.does.now:
                out.line("m->fsm.now -= now;")
            elif not has_timers:
                out.lines(["(void)m;", "(void)now;"])
            for inside, slot in zip(names.invoked, names.slots, strict=True):
                with out.block(f"if (m->{slot}.fsm.running) {{"):
                    out.line(f"{inside.prefix}_rebase(&m->{slot}, now);")
        out.line()
        print_pieces(out, names, "loop", "finished", "fault")
        out.define()
        self._in_state(out)

    def _first_of_all(self, out: Emitter) -> None:
        """Print the first deadline of the machine and of those in its slots."""
        names = self.names
        out.lines(["bool found = false;", "uint32_t due = 0u;", "uint32_t first = 0u;"])
        if names.has_timers or names.does.delays:
            with out.block("if (m->fsm.timer_count > 0u) {"):
                out.lines(["found = true;", "first = m->fsm.timers[0].deadline;"])
        for inside, slot in zip(names.invoked, names.slots, strict=True):
            out.line(
                f"if (m->{slot}.fsm.running && {inside.prefix}_next_deadline(&m->{slot}, &due)"
            )
            with out.block("    && (!found || !fsm_reached(due, first))) {"):
                out.lines(["found = true;", "first = due;"])
        out.lines(["if (found) {", "    *deadline = first;", "}", "return found;"])

    def _initialize(
        self, out: Emitter, name: str, value: object, type_: object, printer: Printer
    ) -> None:
        names = self.names
        member = f"m->{names.variables[name]}"
        if isinstance(type_, ArrayType | RecordType):
            ctype = storage(type_, names.records).text
            text = literal_initializer(value, type_, printer)  # type: ignore[arg-type]
            if isinstance(type_, RecordType):
                with out.block("{"):
                    out.line(f"const {ctype} initial = {text};")
                    out.line(f"{member} = initial;")
            else:
                with out.block("{"):
                    out.line(f"static const {ctype} initial[{type_.length}] = {text};")
                    with out.block(f"for (uint32_t i = 0u; i < {type_.length}u; i++) {{"):
                        out.line(f"{member}[i] = initial[i];")
            return
        if value in (0, False, ""):
            return
        text = literal_initializer(value, type_, printer)  # type: ignore[arg-type]
        out.line(f"{member} = {text};")

    def _post(self, out: Unit, event: int) -> None:
        names = self.names
        p = names.own
        fields = names.chart.events[event].fields
        name = names.event_names[event]
        out.define()
        out.line(f"bool {p}_post_{name}({p} *m{parameters(fields, names)})")
        with out.block("{"):
            out.line(f"{p}_event e = {p}_no_event;")
            out.line(f"e.event = {names.events[event]};")
            self._fill(out, fields, f"e.of.{names.payloads[event]}")
            out.line(f"return {p}_post(m, &e);")
        out.line()

    def _fill(self, out: Emitter, fields: tuple[Field, ...], payload: str) -> None:
        for part in fields:
            name = self.names.field(part.name)
            if isinstance(part.type, ArrayType):
                with out.block(f"for (uint32_t i = 0u; i < {part.type.length}u; i++) {{"):
                    out.line(f"{payload}.{name}[i] = {name}[i];")
            else:
                stored = storage(part.type, self.names.records).text
                cast = f"({stored})" if isinstance(part.type, EnumType) else ""
                out.line(f"{payload}.{name} = {cast}{name};")

    def _in_state(self, out: Unit) -> None:
        names, plan = self.names, self.names.plan
        p = names.own
        last = [0 if s.is_history else plan.last_below[s.index] for s in self.chart.states]
        out.line("/* By state: the last one below it in its region; 0 for a history. */")
        self._table(out, f"{p}_last_in_region", last)
        out.line()
        out.line(f"bool {p}_in(const {p} *m, {p}_state state)")
        with out.block("{"):
            with out.block(f"if (state == {names.states[0]}) {{"):
                out.line(f"return {names.in_state('m', 0).text};")
            with out.block(f"if ((size_t)state >= {len(self.chart.states)}u) {{"):
                out.line("return false;")
            self._number_of(out)
            out.line(f"return number >= (uint32_t)state && number <= {p}_last_in_region[state];")
        out.line()
        out.line(f"uint16_t {p}_active(const {p} *m, {p}_state *states, uint16_t room)")
        with out.block("{"):
            if plan.is_single:
                self._active_leaf(out)
            else:
                self._active_leaves(out)
        out.line()

    def _number_of(self, out: Unit) -> None:
        """Print the number of the region of a state."""
        names, plan = self.names, self.names.plan
        numbers = []
        for region in plan.regions:
            member = f"m->{names.regions[region.index]}"
            numbers.append(number_of(member) if region.index in names.shared else member)
        if plan.is_single:
            out.line(f"const uint32_t number = {numbers[0]};")
            return
        table = f"{names.own}_region_of"  # which the functions that read tables have
        if not names.options.is_small:
            table = "region_of"
            self._table(out, table, plan.region_of)
        out.line("uint32_t number = 0u;")
        with out.block(f"switch ({table}[state]) {{"):
            for region, number in zip(plan.regions, numbers, strict=True):
                out.lines([f"case {region.index}u:", f"    number = {number};", "    break;"])
            default(out)

    def _active_leaf(self, out: Emitter) -> None:
        """Print the one active atomic state of a region; above such a state lie others."""
        p, number = self.names.own, f"m->{self.names.regions[0]}"
        count = len(self.chart.states)
        out.line(f"const uint32_t number = {number};")
        test = f"number == 0u || number >= {count}u || {p}_last_in_region[number] != number"
        with out.block(f"if ({test}) {{"):
            out.line("return 0u;")
        with out.block("if (room > 0u) {"):
            out.line(f"states[0] = ({p}_state)number;")
        out.line("return 1u;")

    def _active_leaves(self, out: Emitter) -> None:
        p = self.names.own
        leaves = [self.names.states[s.index] for s in self.chart.states if s.is_leaf]
        with out.block(f"static const {p}_state leaves[] = {{", "};"):
            out.wrapped(leaves)
        out.line("uint16_t count = 0u;")
        each = "for (size_t i = 0u; i < sizeof leaves / sizeof leaves[0]; i++) {"
        with out.block(each), out.block(f"if ({p}_in(m, leaves[i])) {{"):
            with out.block("if (count < room) {"):
                out.line("states[count] = leaves[i];")
            out.line("count++;")
        out.line("return count;")

    def _table(self, out: Emitter, name: str, values: Sequence[int]) -> None:
        with out.block(f"static const {narrowest(max(values))} {name}[] = {{", "};"):
            out.wrapped([f"{value}u" for value in values])

    def _names(self, out: Unit) -> None:
        names, chart = self.names, self.chart
        p = names.own
        tables = (
            ("state_name", f"{p}_state", [s.id for s in chart.states]),
            ("event_text", "uint32_t", ["", *(e.name for e in chart.events)]),
            ("symbol", "uint32_t", names.symbols),
        )
        out.line("#ifndef FSM_NO_NAMES")
        for name, parameter, texts in tables:
            out.line()
            if name == "symbol" and names.is_invoked:
                out.line(f"const char *{names.outermost}_symbol({parameter} number);")
                out.line()
            out.line(f"const char *{p}_{name}({parameter} number)")
            with out.block("{"):
                if name == "symbol" and names.is_invoked:
                    out.line(f"return {names.outermost}_symbol(number);")
                    continue
                if not any(texts):
                    out.line('return number == 0u ? "" : "?";')
                    continue
                entries = [_entry(out, place, text) for place, text in enumerate(texts)]
                with out.block("static const char *const texts[] = {", "};"):
                    out.wrapped(entries)
                out.line(
                    'return (size_t)number < sizeof texts / sizeof texts[0] ? texts[number] : "?";'
                )
        out.lines(["", "#endif"])


LONGEST_LITERAL = 4095
"""The length in characters of a string literal that every C99 compiler accepts (5.2.4.1)."""


def _entry(out: Emitter, place: int, text: str) -> str:
    """Return an entry of a table of texts; one longer than a literal is declared here."""
    content = text.encode()
    if len(content) <= LONGEST_LITERAL:
        return quoted(text)
    with out.block(f"static const char text_{place}[] = {{", "};"):
        for at in range(0, len(content), 12):
            out.line("".join(f"'\\{byte:03o}', " for byte in content[at : at + 12]).rstrip())
        out.line("'\\0',")
    return f"text_{place}"
