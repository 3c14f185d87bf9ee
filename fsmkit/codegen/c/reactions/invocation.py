"""Invoked machines in C (SCXML 6.4, 6.5).

A machine that is invoked is a member of the struct of the one that invokes it: its slot. It is a
machine of its own, with types and functions of its own, and holds no pointer to what it lies in:
that is found by `offsetof`. It runs while its own ``running`` says so; as long as it does not, the
slot is as `init` leaves it, or holds what stopped with a fault.
"""

from __future__ import annotations

from functools import partial

from fsmkit.chart.chart import Passage
from fsmkit.codegen.c.expressions.cases import default
from fsmkit.codegen.c.expressions.content import ContentPrinter
from fsmkit.codegen.c.expressions.transfer import Place, copy, put_default
from fsmkit.codegen.c.ir import Unit
from fsmkit.codegen.c.names import Names
from fsmkit.codegen.c.pieces import Parts, print_pieces
from fsmkit.codegen.c.reserved import TO_INVOKE
from fsmkit.emit import Emitter
from fsmkit.emit.c import comment

INVOKER = "#_parent"
COMMUNICATION = "error.communication"


class InvocationPrinter:
    """Prints the exchange of a machine with the machines it invokes and with its invoker."""

    def __init__(self, names: Names, content: ContentPrinter) -> None:
        """Create a printer with these names."""
        self.names = names
        self.chart = names.chart
        self.content = content
        self.own = names.own

    def _slot(self, slot: int) -> Parts:
        """Return the replacements of the pieces for a slot."""
        return {
            "SLOT_ID": comment(self.chart.invocations[slot].id),
            "SLOT": self.names.slots[slot],
            "inside": self.names.invoked[slot].prefix,
            "N": str(slot),
        }

    # --- what content calls ---------------------------------------------------------------

    def print_calls(self, out: Unit) -> None:
        """Print the functions that content calls; all content is printed already."""
        names = self.names
        if "to_invoker" in names.used:
            parts = {"SELF_INVOKER": f"{names.symbol(INVOKER)}u"}
            print_pieces(out, names, "invocation", "to_invoker", parts=parts)
        for slot in range(len(names.slots)):
            pieces = partial(print_pieces, out, names, "invocation", parts=self._slot(slot))
            pieces("absorb_N", "end_N")
            if "to_invoker" in names.invoked[slot].used:
                pieces("holder_of_N")
                self._return(out, slot)
            self._give(out, slot)
        for slots, number in names.reached.items():
            self._to_invoked(out, slots, number)

    def _return(self, out: Unit, slot: int) -> None:
        """Print the function by which an invoked machine sends an event to this one."""
        inside = self.names.invoked[slot]
        p = self.own
        holder = f"{p}_holder_of_{slot}(m)"
        out.define()
        out.line(f"bool {inside.prefix}_return({inside.prefix} *m, const {inside.prefix}_event *e)")
        with out.block("{"):
            out.line(f"{p}_event coming = {p}_no_event;")
            with out.block("switch (e->event) {"):
                for event, passage in enumerate(self.chart.invocations[slot].answers):
                    if passage is None:
                        continue
                    out.line(f"case {inside.events[event]}:")
                    with out.indented():
                        self._carry(out, inside, event, self.names, passage, "coming")
                        out.line("break;")
                out.line("default:")
                out.line(f"    return {p}_has_room({holder});")
            out.line(f"return {holder}->fsm.running && {p}_enqueue({holder}, &coming);")
        out.line()

    def _carry(
        self, out: Emitter, names: Names, event: int, target: Names, passage: Passage, to: str
    ) -> None:
        """Print the conversion of an event ``e`` to an event ``to`` of another machine."""
        payload, fields = names.payloads[event], names.chart.events[event].fields
        out.line(f"{to}.event = {target.events[passage.event]};")
        parts = target.chart.events[passage.event].fields
        for part, place in zip(parts, passage.fields, strict=True):
            text = f"{to}.of.{target.payloads[passage.event]}.{target.field(part.name)}"
            there = Place(target, part.type, text)
            if place is None:
                put_default(out, there)
            else:
                text = f"e->of.{payload}.{names.field(fields[place].name)}"
                copy(out, Place(names, fields[place].type, text), there)

    def _give(self, out: Unit, slot: int) -> None:
        """Print the function that puts an event into the queue of an invoked machine."""
        names, inside = self.names, self.names.invoked[slot]
        p, member = self.own, f"m->{names.slots[slot]}"
        passages = self.chart.invocations[slot].passages
        out.define(f"give_{slot}")
        out.line(
            f"/* Give an event to the machine `{self._slot(slot)['SLOT_ID']}`, if it knows it. */"
        )
        out.line(f"static void {p}_give_{slot}({p} *m, const {p}_event *e)")
        with out.block("{"):
            out.line(f"{inside.prefix}_event given = {inside.upper}_NO_EVENT;")
            with out.block("switch (e->event) {"):
                for event, passage in enumerate(passages):
                    if passage is not None:
                        out.line(f"case {names.events[event]}:")
                        with out.indented():
                            self._carry(out, names, event, inside, passage, "given")
                            out.line("break;")
                out.line("default:")
                out.line("    return;")
            with out.block(f"if (!{inside.prefix}_post(&{member}, &given)) {{"):
                out.line('FSM_HOOK_TEXT(m, FSM_FULL, "queue", 0);')
        out.line()

    def _to_invoked(self, out: Unit, slots: tuple[int, ...], number: int) -> None:
        """Print the function that sends an event to the first of some machines that is running."""
        names = self.names
        p = self.own
        out.define(f"to_invoked_{number}")
        out.line(f"static void {p}_to_invoked_{number}({p} *m, const {p}_event *e, uint16_t peer)")
        with out.block("{"):
            out.line("FSM_HOOK_EVENT(m, FSM_LEFT, e);")
            out.line('FSM_HOOK_TEXT(m, FSM_LEFT, "", peer);')
            event = names.events[self.chart.event_index[COMMUNICATION]]
            error = f'{p}_error(m, {event}, "{COMMUNICATION}");'
            for place, slot in enumerate(slots):
                otherwise = "} else " if place else ""
                out.line(f"{otherwise}if (m->{names.slots[slot]}.fsm.running) {{")
                out.line(f"    {p}_give_{slot}(m, e);")
            if slots:
                out.lines(["} else {", f"    {error}", "}"])
            else:
                out.line(error)
        out.line()

    # --- steps ----------------------------------------------------------------------------

    def print_steps(self, out: Unit) -> None:
        """Print the functions that the macrostep loop calls."""
        names = self.names
        if names.slots:
            steps = Emitter()
            for slot in range(len(names.slots)):
                self._step_slot(steps, slot)
            parts = {"SELF_STEP_SLOTS": steps.collected()}
            print_pieces(out, names, "invocation", "run_invoked", "go_on", parts=parts)
        if names.invoking:
            self._invoke(out)
        if self.names.does.external:
            self._external(out)

    def print_timers(self, out: Unit) -> None:
        """Print the function that fires a timer of an invoked machine."""
        if self.names.slots:
            timers = Emitter()
            self._step_timers(timers)
            parts = {"SELF_STEP_TIMERS": timers.collected()}
            print_pieces(out, self.names, "invocation", "step_timer_within", parts=parts)

    def _step_slot(self, out: Emitter, slot: int) -> None:
        """Print the step of a machine in a slot: one event, if it runs."""
        names, p = self.names, self.own
        member, inside = f"m->{names.slots[slot]}", names.invoked[slot].prefix
        with out.block(f"if ({member}.fsm.running && m->fsm.fault == FSM_NO_FAULT) {{"):
            out.line(f"{member}.fsm.now = m->fsm.now;")
            with out.block(f"if ({inside}_step_event(&{member})) {{"):
                out.lines(["is_quiet = false;", f"{p}_absorb_{slot}(m);"])

    def _step_timers(self, out: Emitter) -> None:
        """Print the step that fires the machine's timers with the first deadline of all."""
        names, p = self.names, self.own
        for slot, (member, inside) in enumerate(zip(names.slots, names.invoked, strict=True)):
            word = "} else if" if slot else "if"
            out.line(f"{word} (m->{member}.fsm.running")
            out.line(
                f"    && {inside.prefix}_next_deadline(&m->{member}, &due) && due == deadline) {{"
            )
            out.line(f"    (void){inside.prefix}_step_timer(&m->{member});")
            out.line(f"    {p}_absorb_{slot}(m);")
        out.line("}")

    @property
    def waiting(self) -> str:
        """Return the condition that some entered state has not invoked its machine yet."""
        count = (len(self.names.invoking) + 7) // 8
        tests = [f"m->fsm.{TO_INVOKE}[{place}] != 0u" for place in range(count)]
        return tests[0] if count == 1 else f"({' || '.join(tests)})"

    def _invoke(self, out: Unit) -> None:
        p = self.own
        out.define("invoke")
        out.line(
            "/* What was entered in this macrostep, and not left since, invokes (SCXML 6.4). */"
        )
        out.line(f"static void {p}_invoke({p} *m)")
        with out.block("{"):
            for state in self.names.invoking:
                member, bit = self.names.to_invoke(state)
                with out.block(f"if (({member} & {bit}u) != 0u) {{"):
                    for block in self.chart.states[state].invokes:
                        what = "invocation by " + self.chart.states[state].id
                        self.content.block(out, block, (), what)
            for place in range((len(self.names.invoking) + 7) // 8):
                out.line(f"m->fsm.{TO_INVOKE}[{place}] = 0u;")
        out.line()

    def _external(self, out: Unit) -> None:
        """Print the effects of an event that has just left the external queue."""
        p, names = self.own, self.names
        out.define("external")
        out.line("/* An external event, before it is handled: its finalize (SCXML 6.5), then")
        out.line(" * to whom it is forwarded (6.4.1). */")
        out.line(f"static void {p}_external({p} *m, const {p}_event *e)")
        with out.block("{"):
            if any(event.finalize for event in self.chart.events):
                self._finalize(out)
            for invocation in self.chart.invocations:
                if invocation.autoforward:
                    with out.block(f"if (m->{names.slots[invocation.index]}.fsm.running) {{"):
                        out.line(f"{p}_give_{invocation.index}(m, e);")
        out.line()

    def _finalize(self, out: Emitter) -> None:
        names = self.names
        with out.block("switch (e->event) {"):
            for event in self.chart.events:
                if not event.finalize or event.invocation is None:
                    continue
                state = self.chart.invocations[event.invocation].state
                out.line(f"case {names.events[event.index]}:")
                with out.indented():
                    with out.block(f"if ({names.in_state('m', state).text}) {{"):
                        what = "finalize " + event.name
                        self.content.block(out, event.finalize, (event.index,), what)
                    out.line("break;")
            default(out)
