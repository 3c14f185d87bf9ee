"""The source of a generated machine, section by section in the order of the file."""

from __future__ import annotations

from fsmkit.codegen.c.content import ContentPrinter, quoted
from fsmkit.codegen.c.expressions import Printer, literal_initializer
from fsmkit.codegen.c.header import NOTICE, event_type, parameters
from fsmkit.codegen.c.layout import Member
from fsmkit.codegen.c.moves import MovePrinter, entered
from fsmkit.codegen.c.names import Names, file_name, posted_events
from fsmkit.codegen.c.runtime import (
    CONFLICTS,
    DUE,
    LOOP_END,
    LOOP_MANY,
    LOOP_SINGLE,
    QUEUES,
    SELECTION,
    UNHANDLED,
    fill,
    helpers,
)
from fsmkit.codegen.c.selection import SelectionPrinter
from fsmkit.codegen.c.types import storage
from fsmkit.emit import Emitter
from fsmkit.expressions import ArrayType, Expr, Field, RecordType, Variable
from fsmkit.model.document import Direction, Trigger


class SourcePrinter:
    """Prints the parts in the order in which they learn what the others need.

    Content is printed first, since what it calls decides which helpers the file holds.
    """

    def __init__(self, names: Names) -> None:
        """Print everything that depends on the states of the chart."""
        self.names = names
        self.chart = names.chart
        self.blocks = Emitter()
        content = ContentPrinter(names, self.blocks)
        self.content = content
        self.selection = SelectionPrinter(names, content)
        self.moves = MovePrinter(names, content)
        self.states = Emitter()
        self.selectors = Emitter()
        self.steps = Emitter()
        self.has_timers = any(
            t.trigger in (Trigger.AFTER, Trigger.EVERY) for t in self.chart.transitions
        )
        self._print_states()
        self._print_selection()
        self._print_start()
        if "cancel" in names.used and "delay" not in names.used:
            names.used.remove("cancel")
            names.used.add("cancel_nothing")
        if "delay" in names.used:
            names.used.add("emit")

    @property
    def delays(self) -> bool:
        """Whether delayed sends occur."""
        return "delay" in self.names.used

    def text(self, members: list[Member]) -> str:
        """Return the whole file."""
        names = self.names
        out = Emitter()
        sources = " ".join(file_name(source.name) for source in self.chart.sources)
        out.line(f"/* {names.prefix}.c: the machine {self.chart.name}, from {sources}. {NOTICE} */")
        out.line(f'#include "{names.prefix}.h"')
        out.line()
        self._prologue(out)
        self._calls(out)
        out.lines(self.blocks.finish().rstrip("\n").split("\n"))
        out.line()
        for part in (self.states, self.selectors, self.steps):
            out.lines(part.finish().rstrip("\n").split("\n"))
            out.line()
        self._interface(out, members)
        self._names(out)
        return out.finish()

    # --- parts ----------------------------------------------------------------------------

    def _prologue(self, out: Emitter) -> None:
        names = self.names
        if self.delays:
            out.line(
                f"enum {{ {names.upper}_TO_SELF, {names.upper}_TO_INTERNAL, {names.upper}_TO_PORT }};"
            )
        deferred = " + m->deferred_count" if self._defers else ""
        left = "" if not deferred else ""
        body = QUEUES.replace(
            "m->queue_count$DEFERRED_COUNT <", f"m->queue_count{deferred}{left} <"
        )
        out.lines(fill(names, body))
        out.line()
        helpers(out, names, names.used, event_type(names))

    @property
    def _defers(self) -> bool:
        return any(state.defer for state in self.chart.states)

    def _calls(self, out: Emitter) -> None:
        """Print the wrappers of operations and of events that leave."""
        names = self.names
        p = names.prefix
        for operation in self.chart.operations:
            if f"call {operation.name}" not in names.used:
                continue
            fields, result = operation.parameters, operation.result
            ctype = "void" if result is None else storage(result, names.records).text
            name = names.operations[operation.name]
            head = f"static {ctype} {p}_call_{name}({p} *m{parameters(fields, names)})"
            passed = "".join(f", {names.field(part.name)}" for part in fields)
            out.line(head)
            with out.block("{"):
                out.line("if (m->failed != FSM_FINE)")
                with out.indented():
                    empty = "{0}" if isinstance(result, RecordType) else "0"
                    if isinstance(result, RecordType):
                        out.line(f"return ({ctype}){empty};")
                    else:
                        out.line("return;" if result is None else f"return ({ctype}){empty};")
                call = f"{p}_{name}(m{passed})"
                out.line(f"{call};" if result is None else f"return {call};")
            out.line()
        if "emit" in names.used:
            self._emit(out)

    def _emit(self, out: Emitter) -> None:
        names = self.names
        p = names.prefix
        out.line(f"static void {p}_emit({p} *m, const {p}_event *e, uint16_t peer)")
        with out.block("{"):
            out.lines(["(void)m;", "(void)peer;"])
            out.line("FSM_HOOK_EVENT(m, FSM_LEFT, e);")
            out.line('FSM_HOOK_TEXT(m, FSM_LEFT, "", peer);')
            with out.block("switch (e->event) {"):
                for event in self.chart.events:
                    if Direction.OUT not in event.directions:
                        continue
                    out.line(f"case {names.events[event.index]}:")
                    with out.indented():
                        payload = f"e->of.{names.payloads[event.index]}"
                        passed = "".join(
                            f", {payload}.{names.field(part.name)}" for part in event.fields
                        )
                        out.line(f"{p}_send_{names.event_names[event.index]}(m{passed});")
                        out.line("break;")
                out.line("default:")
                with out.indented():
                    out.line("break;")
        out.line()

    def _print_states(self) -> None:
        out, moves, names = self.states, self.moves, self.names
        p = names.prefix
        for region in reversed(names.plan.regions):
            moves.leave_region(out, region)
        reached = entered(names.plan)
        for state in self.chart.states[1:]:
            if not state.is_history and state.index in reached:
                out.line(f"static void {p}_enter_{state.index}({p} *m) /* {state.id} */")
                with out.block("{"):
                    moves.enter_state(out, state.index)
                out.line()
        moves.record(out)
        self._domains(out)
        taken = [t for t in self.chart.transitions if t.trigger is not Trigger.INITIAL]
        out.line(f"static void {p}_act({p} *m, uint16_t taken)")
        with out.block("{"):
            out.line("(void)m;")
            out.line("FSM_HOOK_TAKE(m, (uint16_t)(taken - 1u));")
            with out.block("switch (taken) {"):
                for t in taken:
                    if not t.content:
                        continue
                    what = self.selection.comment(t)
                    with _case(out, t.index, what):
                        self.content.block(out, t.content, t.events, what)
                with _default(out):
                    pass
        out.line()
        out.line(f"static void {p}_enter({p} *m, uint16_t taken)")
        with out.block("{"):
            out.line("(void)m;")
            with out.block("switch (taken) {"):
                for t in taken:
                    if t.targets:
                        with _case(out, t.index, self.selection.comment(t)):
                            moves.variants(out, names.plan.moves[t.index], entering=True)
                with _default(out):
                    pass

    def _domains(self, out: Emitter) -> None:
        """Print the domain of each transition, and what leaving below it is."""
        names, chart = self.names, self.chart
        p = names.prefix
        taken = [t for t in chart.transitions if t.trigger is not Trigger.INITIAL]
        moves = names.plan.moves
        out.line("/* The state plus one below which all lies that a transition leaves and enters;")
        out.line(" * 0 for one without a target. */")
        out.line(f"static uint16_t {p}_domain(const {p} *m, uint16_t taken)")
        groups: dict[int, list[int]] = {}
        with out.block("{"):
            out.line("(void)m;")
            with out.block("switch (taken) {"):
                for t in taken:
                    move = moves[t.index]
                    if move.is_static:
                        domain = move.variants[0].domain
                        groups.setdefault(0 if domain is None else domain + 1, []).append(t.index)
                    else:
                        out.open(f"case {t.index + 1}u:")
                        self.moves.variants(out, move, entering=False)
                        out.close("")
                for domain, members in groups.items():
                    if domain:
                        for index in members:
                            out.line(f"case {index + 1}u:")
                        with out.indented():
                            out.line(f"return {domain}u;")
                out.line("default:")
                with out.indented():
                    out.line("return 0u;")
        out.line()
        domains = sorted(
            {v.domain for t in taken for v in moves[t.index].variants if v.domain is not None}
        )
        out.line(f"static void {p}_leave({p} *m, uint16_t domain)")
        with out.block("{"):
            out.line("(void)m;")
            with out.block("switch (domain) {"):
                for domain in domains:
                    out.line(f"case {domain + 1}u: /* {chart.states[domain].id} */")
                    with out.indented():
                        out.line(self.moves.leave_below(domain))
                        out.line("break;")
                with _default(out):
                    pass
        out.line()

    def _print_selection(self) -> None:
        out, names = self.selectors, self.names
        out.line(f"#define {names.upper}_DEFER 0xFFFFu")
        out.line(f"#define {names.upper}_REGIONS {len(names.plan.regions)}")
        out.line()
        if not names.plan.is_single:
            out.lines(fill(names, SELECTION))
            out.line()
        for trigger in (Trigger.EVENT, Trigger.EVENTLESS):
            calls = self.selection.finders(out, trigger)
            self.selection.over_regions(out, trigger, calls)
        self._defer_test(out)

    def _defer_test(self, out: Emitter) -> None:
        names = self.names
        if not self._defers:
            return
        p = names.prefix
        out.line(f"static bool {p}_is_deferred(const {p} *m, uint16_t event)")
        with out.block("{"):
            for state in self.chart.states:
                for event in state.defer:
                    test = names.in_state("m", state.index)
                    out.line(f"if ({_group(test)} && event == {names.events[event]})")
                    with out.indented():
                        out.line("return true;")
            out.line("return false;")
        out.line()

    def _print_start(self) -> None:
        out, names, chart = self.steps, self.names, self.chart
        if not names.plan.is_single:
            self._tables(out)
            has_histories = any(s.is_history for s in chart.states)
            record = ""
            if has_histories:
                record = (
                    "    for (uint8_t i = 0u; i < found->count; i++)\n"
                    "        @_record(m, domains[i]);"
                )
            out.lines(fill(names, CONFLICTS, RECORD_ALL=record or "~"))
            out.line()
        # its content may be the only one that sends later, which the loop must know
        start = Emitter()
        self._start_function(start)
        self._loop(out)
        self._fire(out)
        out.lines(start.finish().rstrip("\n").split("\n"))

    def _tables(self, out: Emitter) -> None:
        chart = self.chart
        below = ", ".join(f"{s.last_descendant + 1}u" for s in chart.states)
        sources = ", ".join(f"{t.source}u" for t in chart.transitions)
        out.line("/* By state: the last state below it, plus one. By transition: its source. */")
        out.line(f"static const uint16_t last_below[] = {{{below}}};")
        out.line(f"static const uint16_t source_of[] = {{{sources}}};")
        out.line()

    def _loop(self, out: Emitter) -> None:
        names, chart = self.names, self.chart
        strict = "~"
        if not chart.lenient:
            errors = [e for e in chart.events if e.name.startswith("error.") and not e.directions]
            strict = "\n".join(
                f"    if (e->event == {names.events[e.index]})\n"
                f"        @_stop(m, FSM_FAULT_UNHANDLED_ERROR, {quoted(e.name)});"
                for e in errors
            )
        out.lines(fill(names, UNHANDLED, STRICT=strict))
        out.line()
        single = names.plan.is_single
        flag = (
            "taken == " + names.upper + "_DEFER" if single else "found.count == 0u && found.defers"
        )
        if self._defers:
            deferring = (
                f"    bool is_deferred = {flag};\n"
                + ("    if (is_deferred)\n        taken = 0u;\n" if single else "")
                + "    if (is_deferred && may_defer) {\n"
                "        m->deferred[m->deferred_count] = *e;\n"
                "        m->deferred_count++;\n"
                + ("        @_take(m, 0u);\n" if single else "        @_take(m, &found);\n")
                + "        return false;\n    }"
            )
        else:
            deferring = "    (void)may_defer;"
        has_histories = any(s.is_history for s in chart.states)
        remembered = len(self.selection.remembered)
        forget = (
            f"for (uint8_t i = 0u; i < {remembered}u; i++)\n        m->asked[i] = 0u;"
            if remembered
            else "~"
        )
        text = LOOP_SINGLE if single else LOOP_MANY
        lines = fill(
            names,
            text,
            DOMAIN="uint16_t domain = @_domain(m, taken);",
            RECORD="@_record(m, domain);" if has_histories else "~",
            DEFERRING=deferring,
            FORGET=forget,
        )
        out.lines(lines)
        out.line()
        clear = []
        if self._defers:
            clear.append(
                "        while (m->deferred_count > 0u)\n"
                "            (void)@_take_out(m->deferred, &m->deferred_count, %_QUEUE, 0u);"
            )
        if self.delays:
            clear.append(
                "        while (m->delayed_count > 0u)\n            (void)@_undelay(m, 0u);"
            )
        if self.has_timers or self.delays:
            clear.append(
                "        while (m->timer_count > 0u)\n"
                "            fsm_timers_remove(m->timers, &m->timer_count, 0u);"
            )
        recall = "~"
        if self._defers:
            recall = (
                "    for (uint8_t i = 0u; i < m->deferred_count; i++) {\n"
                "        if (!@_is_deferred(m, (uint16_t)m->deferred[i].event)) {\n"
                "            @_event recalled = @_take_out(m->deferred, &m->deferred_count, %_QUEUE, i);\n"
                "            (void)@_macrostep(m, &recalled, true);\n"
                "            return true;\n"
                "        }\n"
                "    }"
            )
        samples = any(
            t.trigger is Trigger.EVENTLESS and t.guard is not None and _reads_input(t.guard)
            for t in chart.transitions
        )
        self.steps.lines(
            fill(
                names,
                LOOP_END,
                CLEAR="\n".join(clear) or "~",
                RECALL=recall,
                DEFERRED_PLUS=" + m->deferred_count" if self._defers else "",
                TRY_EVENTLESS="    (void)@_step_eventless(m);" if samples else "~",
                TIMER_DUE=DUE.strip("\n") if self.has_timers or self.delays else "~",
            )
        )
        out.line()

    def _fire(self, out: Emitter) -> None:
        names, chart = self.names, self.chart
        p = names.prefix
        out.line(f"bool {p}_step_timer({p} *m)")
        with out.block("{"):
            if not self.has_timers and not self.delays:
                out.line("(void)m;")
                out.line("return false;")
            else:
                out.line("if (!m->running || m->timer_count == 0u)")
                with out.indented():
                    out.line("return false;")
                out.line("fsm_timer timer = m->timers[0];")
                out.line("fsm_timers_remove(m->timers, &m->timer_count, 0u);")
                out.line("m->now = timer.deadline;")
                if self.delays:
                    self._deliver(out)
                self._timeouts(out)
                out.line("return true;")
        out.line()
        del chart

    def _deliver(self, out: Emitter) -> None:
        self.names.used.add("emit")
        out.lines(
            fill(
                self.names,
                """
if (timer.what == FSM_TIMER_SEND) {
    const @_delayed due = @_undelay(m, 0u);
    if (due.route == %_TO_INTERNAL) {
        (void)@_macrostep(m, &due.e, false);
    } else if (due.route == %_TO_PORT) {
        @_emit(m, &due.e, due.peer);
    } else if (@_has_room(m)) {
        m->queue[m->queue_count] = due.e;
        m->queue_count++;
    } else {
        @_count(&m->rejected);
        FSM_HOOK_TEXT(m, FSM_FULL, "queue", 0);
    }
    return true;
}
""",
            )
        )

    def _timeouts(self, out: Emitter) -> None:
        names, chart = self.names, self.chart
        p = names.prefix
        timed = [t for t in chart.transitions if t.trigger in (Trigger.AFTER, Trigger.EVERY)]
        out.line(f"{p}_begin(m);")
        out.line("FSM_HOOK_BEGIN(m, FSM_TIMEOUT, timer.what);")
        if not timed:
            out.line(f"(void){p}_settle(m);")
            out.line("FSM_HOOK_END(m);")
            return
        out.line("uint16_t taken = 0u;")
        with out.block("switch (timer.what) {"):
            for t in timed:
                out.line(f"case {t.index}u: /* {self.selection.comment(t)} */")
                with out.indented():
                    if t.trigger is Trigger.EVERY:
                        names.used.add("arm")
                        out.line(f"{p}_arm(m, {t.index}u, {t.delay}u);")
                    if t.guard is None:
                        out.line(f"taken = {t.index + 1}u;")
                    else:
                        out.line(f"if ({self.selection.guard(self.selectors, t)})")
                        with out.indented():
                            out.line(f"taken = {t.index + 1}u;")
                    out.line("break;")
            with _default(out):
                pass
        if self.selection.remembered:
            count = len(self.selection.remembered)
            out.line(f"for (uint8_t i = 0u; i < {count}u; i++)")
            with out.indented():
                out.line("m->asked[i] = 0u;")
        if names.plan.is_single:
            out.line(f"{p}_take(m, taken);")
        else:
            out.line(f"{p}_selection found = {{{{0}}, 0, false}};")
            out.line(f"{p}_add(&found, taken);")
            out.line(f"{p}_take(m, &found);")
        out.line(f"(void){p}_settle(m);")
        out.line("FSM_HOOK_END(m);")

    def _start_function(self, out: Emitter) -> None:
        names, chart = self.names, self.chart
        p = names.prefix
        out.line(f"void {p}_start({p} *m, uint32_t now)")
        with out.block("{"):
            out.line(f"const {p} before = *m;")
            out.line(f"{p}_init(m);")
            for variable in chart.inputs:
                name = names.variables[variable.name]
                if isinstance(variable.type, ArrayType):
                    out.line(f"for (uint32_t i = 0u; i < {variable.type.length}u; i++)")
                    with out.indented():
                        out.line(f"m->{name}[i] = before.{name}[i];")
                else:
                    out.line(f"m->{name} = before.{name};")
            if not chart.inputs:
                out.line("(void)before;")
            out.line("m->now = now;")
            out.line("m->running = true;")
            out.line(f"{p}_begin(m);")
            out.line("FSM_HOOK_BEGIN(m, FSM_START, 0);")
            self.content.block(out, chart.script, (), "script")
            assert chart.root.initial is not None  # noqa: S101
            initial = chart.transitions[chart.root.initial]
            self.content.block(out, initial.content, (), "initial transition")
            out.line("m->budget--;")
            self.moves.ops(out, names.plan.start)
            out.line(f"(void){p}_settle(m);")
            out.line("FSM_HOOK_END(m);")
        out.line()

    # --- what the host calls --------------------------------------------------------------

    def _interface(self, out: Emitter, members: list[Member]) -> None:
        names, chart = self.names, self.chart
        p = names.prefix
        del members
        printer = Printer(names)
        out.line(f"void {p}_init({p} *m)")
        with out.block("{"):
            out.line("unsigned char *bytes = (unsigned char *)m;")
            out.line("for (size_t i = 0u; i < sizeof *m; i++)")
            with out.indented():
                out.line("bytes[i] = 0u;")
            for variable in (*chart.inputs, *chart.outputs, *chart.data):
                self._initialize(out, variable.name, variable.init.value, variable.type, printer)
        out.line()
        for event in posted_events(chart):
            self._post(out, event)
        has_timers = self.has_timers or self.delays
        out.line(f"bool {p}_next_deadline(const {p} *m, uint32_t *deadline)")
        with out.block("{"):
            if has_timers:
                out.line("if (m->timer_count == 0u)")
                with out.indented():
                    out.line("return false;")
                out.line("*deadline = m->timers[0].deadline;")
                out.line("return true;")
            else:
                out.lines(["(void)m;", "(void)deadline;", "return false;"])
        out.line()
        out.line(f"void {p}_rebase({p} *m, uint32_t now)")
        with out.block("{"):
            if has_timers:
                out.line("for (uint8_t i = 0u; i < m->timer_count; i++)")
                with out.indented():
                    out.line("m->timers[i].deadline -= now;")
            out.line("m->now -= now;")
        out.line()
        out.line(f"bool {p}_finished(const {p} *m)\n{{\n    return m->finished;\n}}\n")
        out.line(f"fsm_fault {p}_fault(const {p} *m)\n{{\n    return (fsm_fault)m->fault;\n}}\n")
        self._in_state(out)

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
                    out.line(f"for (uint32_t i = 0u; i < {type_.length}u; i++)")
                    with out.indented():
                        out.line(f"{member}[i] = initial[i];")
            return
        if value in (0, False, ""):
            return
        text = literal_initializer(value, type_, printer)  # type: ignore[arg-type]
        out.line(f"{member} = {text};")

    def _post(self, out: Emitter, event: int) -> None:
        names = self.names
        p = names.prefix
        fields = names.chart.events[event].fields
        name = names.event_names[event]
        out.line(f"bool {p}_post_{name}({p} *m{parameters(fields, names)})")
        with out.block("{"):
            out.line(f"{p}_event e = no_event;")
            out.line(f"e.event = {names.events[event]};")
            self._fill(out, fields, f"e.of.{names.payloads[event]}")
            out.line(f"return {p}_post(m, &e);")
        out.line()

    def _fill(self, out: Emitter, fields: tuple[Field, ...], payload: str) -> None:
        for part in fields:
            name = self.names.field(part.name)
            if isinstance(part.type, ArrayType):
                out.line(f"for (uint32_t i = 0u; i < {part.type.length}u; i++)")
                with out.indented():
                    out.line(f"{payload}.{name}[i] = {name}[i];")
            else:
                out.line(f"{payload}.{name} = {name};")

    def _in_state(self, out: Emitter) -> None:
        names, chart = self.names, self.chart
        p = names.prefix
        out.line(f"bool {p}_in(const {p} *m, {p}_state state)")
        with out.block("{"):
            with out.block("switch (state) {"):
                for state in chart.states:
                    if not state.is_history:
                        out.line(f"case {names.states[state.index]}:")
                        with out.indented():
                            out.line(f"return {_ungroup(names.in_state('m', state.index))};")
                out.line(f"case {names.upper}_STATES:")
                out.line("default:")
                with out.indented():
                    out.line("return false;")
        out.line()
        leaves = ", ".join(names.states[s.index] for s in chart.states if s.is_leaf)
        out.line(f"uint16_t {p}_active(const {p} *m, {p}_state *states, uint16_t room)")
        with out.block("{"):
            out.line(f"static const {p}_state leaves[] = {{{leaves}}};")
            out.line("uint16_t count = 0u;")
            with out.block("for (size_t i = 0u; i < sizeof leaves / sizeof leaves[0]; i++) {"):
                with out.block(f"if ({p}_in(m, leaves[i])) {{"):
                    out.line("if (count < room)")
                    with out.indented():
                        out.line("states[count] = leaves[i];")
                    out.line("count++;")
            out.line("return count;")
        out.line()

    def _names(self, out: Emitter) -> None:
        names, chart = self.names, self.chart
        p = names.prefix
        tables = (
            ("state_name", f"{p}_state", [s.id for s in chart.states]),
            ("event_text", "uint32_t", ["", *(e.name for e in chart.events)]),
            ("symbol", "uint32_t", names.symbols),
        )
        out.line("#ifndef FSM_NO_NAMES")
        for name, parameter, texts in tables:
            out.line()
            out.line(f"const char *{p}_{name}({parameter} number)")
            with out.block("{"):
                with out.block("static const char *const texts[] = {", "};"):
                    out.lines(f"{quoted(text)}," for text in texts)
                out.line(
                    'return (size_t)number < sizeof texts / sizeof texts[0] ? texts[number] : "?";'
                )
        out.lines(["", "#endif"])


class _case:  # noqa: N801  (reads as a keyword)
    """One case of a switch over transitions."""

    def __init__(self, out: Emitter, transition: int, comment: str) -> None:
        self._out = out
        self._label = f"case {transition + 1}u: /* {comment} */"

    def __enter__(self) -> None:
        self._out.open(self._label)

    def __exit__(self, *_: object) -> None:
        self._out.close("    break;")


class _default(_case):  # noqa: N801
    """The default of a switch."""

    def __init__(self, out: Emitter) -> None:
        super().__init__(out, 0, "")
        self._label = "default:"


def _reads_input(expr: Expr) -> bool:
    from fsmkit.codegen.c.expressions import parts
    from fsmkit.expressions import Storage

    if isinstance(expr, Variable):
        return expr.storage is Storage.INPUT
    return any(map(_reads_input, parts(expr)))


def _group(text: str) -> str:
    return text if text.startswith("(") else f"({text})"


def _ungroup(text: str) -> str:
    return text[1:-1] if text.startswith("(") and text.endswith(")") else text
