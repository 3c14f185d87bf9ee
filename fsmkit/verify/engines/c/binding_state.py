"""What the binding of a machine says about state: what counts as such, and what is seen of it."""

from __future__ import annotations

from collections.abc import Iterator

from fsmkit.codegen.c.expressions.types import storage
from fsmkit.codegen.c.reactions.sharing import number_of
from fsmkit.language import ArrayType, RecordType, Type, Value
from fsmkit.system.properties.kinds.monitor import look_event
from fsmkit.system.system import Slot
from fsmkit.verify.engines.c.binding_regions import (
    RegionWriter,
    configuration_size,
    own_configuration_size,
)
from fsmkit.verify.statespace.dead_variables import ResettableVariable
from fsmkit.verify.statespace.spread import Kind, Part, parts_of

MEMBERS = {
    Kind.QUEUE: {"queue", "queue_count", "deferred", "deferred_count"},
    Kind.TIMERS: {"timers", "timer_count", "delayed", "delayed_count"},
}
"""The members of a generated struct that hold what waits."""


def whole(variable: int) -> str:
    """Return a ``fsm_slot_of`` that is a variable of the table."""
    return f"{{{variable}u, UINT32_MAX}}"


class StateWriter(RegionWriter):
    """Writes C that sets inputs, clears what is no state, and looks at what is."""

    # --- inputs, outputs, what is state -----------------------------------------------------------

    def _inputs_and_outputs(self) -> None:
        out, t = self.out, self.type
        data, outputs, inputs = self.chart.data, self.chart.outputs, self.chart.inputs
        places = {v.name: n for n, v in enumerate((*data, *outputs, *inputs))}
        shared = [
            f"{{{places[s.name]}u, {'UINT32_MAX' if s.element is None else f'{s.element}u'}}}"
            for s in self.machine.shared
        ]
        for table, own, rest in (("inputs", inputs, ()), ("outputs", outputs, data)):
            first, last = ([whole(places[v.name]) for v in each] for each in (own, rest))
            listed = [*first, *shared, *last, whole(0)]
            out.line(f"static const fsm_slot_of {table}[] = {{{', '.join(listed)}}};")
        with out.block("static void set_input(void *state, uint32_t input, fsm_value value)\n{"):
            out.line(f"{t} *m = state;")
            if look_event(self.chart) is not None:
                out.line(f"{t} before = *m;")
            out.line("uint32_t offset;")
            out.line(f"const fsm_type *type = fsm_slot_at(&{t}_info, inputs[input], &offset);")
            out.line("fsm_set_value(type, fsm_place_at(m, offset), value);")
            self._look()
        out.line()
        with out.block("static fsm_value output(const void *state, uint32_t output_number)\n{"):
            out.line(f"const {t} *m = state;")
            out.line("uint32_t offset;")
            called = f"fsm_slot_at(&{t}_info, outputs[output_number], &offset)"
            out.line(f"const fsm_type *type = {called};")
            out.line("return fsm_value_at(type, fsm_at(m, offset));")
        out.line()
        if not self.closed.is_open:
            return
        with out.block("static void choose_inputs(void *state)\n{"):
            out.line(f"{t} *m = state;")
            out.line("(void)m;")
            for free in self.closed.free_inputs:
                declared = self.chart.inputs[free.input]
                self._choose(declared.name, declared.type, free.values)
        out.line()

    def _look(self) -> None:
        """Write what lets a monitor look at an input that has changed."""
        look = look_event(self.chart)
        if look is None:
            return
        t = self.type
        self.out.text(f"""
        if (memcmp(&before, m, sizeof before) == 0 || !{self.running})
            return;
        for (uint32_t i = 0u; i < m->queue_count; i++)
            if (m->queue[i].event == {self.names.events[look]})
                return;
        {t}_event e;
        fsm_make_event(&{t}_info, {look}u, NULL, &e);
        (void){t}_post(m, &e);
        """)

    def _copy(self, slot: Slot) -> str:
        """Spell the copy of a shared variable."""
        member = f"m->{self.names.variables[slot.name]}"
        return member if slot.element is None else f"{member}[{slot.element}]"

    def _choose(self, name: str, type_: Type, values: tuple[Value, ...]) -> None:
        out = self.out
        with out.block(f"switch (fsm_choose({len(values)}u)) {{"):
            for number, value in enumerate(values):
                out.line(f"case {number}u:" if number else "default:")
                with out.indented():
                    self.assign(f"m->{self.names.variables[name]}", type_, value)
                    out.line("break;")

    def assign(self, place: str, type_: Type, value: Value) -> None:
        """Write the assignments of a constant."""
        match type_, value:
            case ArrayType(element), tuple():
                for number, part in enumerate(value):
                    self.assign(f"{place}[{number}]", element, part)
            case RecordType(_, fields), tuple():
                for field, part in zip(fields, value, strict=True):
                    self.assign(f"{place}.{self.names.field(field.name)}", field.type, part)
            case _:
                cast = storage(type_, self.names.records).text
                self.out.line(f"{place} = ({cast})({self.literal(value, type_)});")

    def _settle(self) -> None:
        """Write what clears all that does not count as state."""
        out, t, members = self.out, self.type, self.built.members
        if self.closed.untimed and "delayed" in members and not self.machine.is_channel:
            out.text(f"""
            struct send {{ fsm_timer timer; {t}_delayed event; }};

            static bool is_after(const struct send *a, const struct send *b)
            {{
                if (a->event.e.event != b->event.e.event)
                    return a->event.e.event > b->event.e.event;
                return memcmp(a, b, sizeof *a) > 0;
            }}
            """)
            out.line()
        with out.block("static void settle(void *state)\n{"):
            out.line(f"{t} *m = state;")
            for name in ("now", "budget", "unhandled", "rejected", "failed", "busy"):
                if name in members:
                    out.line(f"m->{name} = 0;")
            if "reply" in members:
                out.line("memset(&m->reply, 0, sizeof m->reply);")
            if "asked" in members:
                out.line("memset(m->asked, 0, sizeof m->asked);")
            if self.closed.is_open and not self.closed.keeps_inputs:
                for declared in self.chart.inputs:
                    place = f"m->{self.names.variables[declared.name]}"
                    self.assign(place, declared.type, declared.init.value)
            with out.block(f"if (!{self.running}) {{"):
                for name in ("queue", "deferred", "delayed", "timers"):
                    if name in members:
                        out.line(f"memset(m->{name}, 0, sizeof m->{name});")
                for name in ("queue_count", "deferred_count", "delayed_count", "timer_count"):
                    if name in members:
                        out.line(f"m->{name} = 0u;")
                for name in self.names.histories.values():
                    out.line(f"m->{name} = 0u;")
                for region in self.names.shared:
                    place = f"m->{self.names.regions[region]}"
                    out.line(f"{place} = (uint8_t)({number_of(place)});")
                for names, slot in zip(self.names.invoked, self.names.slots, strict=True):
                    out.line(f"{names.prefix}_init(&m->{slot});")
            for slot, table in self.sessions:
                out.line(f"if (m->{slot}.running)")
                out.line(f"    {table}.settle(&m->{slot});")
            if self.closed.untimed and "timer_count" in members:
                self._sort_timers()
            self._reset_dead()
        out.line()

    @property
    def _mortal(self) -> tuple[ResettableVariable, ...]:
        """The data that are reset where they are dead."""
        return self.closed.mortal[self.built.number] if self.closed.mortal else ()

    def _reset_dead(self) -> None:
        """Write what sets data that nothing reads any more to their start values."""
        for mortal in self._mortal:
            data = self.chart.data[mortal.data]
            live = f"live_{mortal.data}"
            self._set_of(live, mortal.live)
            with self.out.block(f"if (!{self.running} || !is_any_active(m, {live})) {{"):
                self.assign(f"m->{self.names.variables[data.name]}", data.type, mortal.init)

    def _sort_timers(self) -> None:
        """Write what makes equal sets of timers equal bytes, without their deadlines."""
        out = self.out
        delayed = "delayed" in self.built.members
        out.text("""
        for (uint32_t i = 0u; i < m->timer_count; i++)
            m->timers[i].deadline = 0u;
        """)
        if self.machine.is_channel:
            return  # what was sent first comes first, at whatever time
        if delayed:
            out.text(f"""
            uint32_t rank = 0u;
            struct send sends[{self.upper}_DELAYED];
            memset(sends, 0, sizeof sends);
            for (uint32_t i = 0u; i < m->timer_count; i++)
                if (m->timers[i].what == FSM_TIMER_SEND) {{
                    sends[rank].timer = m->timers[i];
                    sends[rank].event = m->delayed[rank];
                    rank++;
                }}
            for (uint32_t i = 1u; i < rank; i++)
                for (uint32_t j = i; j > 0u && is_after(&sends[j - 1u], &sends[j]); j--) {{
                    struct send other = sends[j];
                    sends[j] = sends[j - 1u];
                    sends[j - 1u] = other;
                }}
            """)
        out.text("""
        for (uint32_t i = 1u; i < m->timer_count; i++)
            for (uint32_t j = i; j > 0u && m->timers[j - 1u].what > m->timers[j].what; j--) {
                fsm_timer other = m->timers[j];
                m->timers[j] = m->timers[j - 1u];
                m->timers[j - 1u] = other;
            }
        """)
        if delayed:
            out.text("""
            for (uint32_t i = 0u; i < rank; i++) {
                m->timers[m->timer_count - rank + i] = sends[i].timer;
                m->delayed[i] = sends[i].event;
            }
            """)

    # --- its parts -------------------------------------------------------------------------------

    def _spans(self) -> int:
        """Write which bytes belong to which part; return how many spans there are."""
        found = [
            f"{{{number}u, offsetof({self.type}, {member}), sizeof((({self.type} *)0)->{member})}},"
            for number, part in enumerate(parts_of(self.chart))
            for member in self._members(part)
        ]
        with self.out.block("static const fsm_span spans[] = {", "};"):
            self.out.lines([*found, "{0}"])
        return len(found)

    def _members(self, part: Part) -> Iterator[str]:
        """Yield the members of the struct that hold a part."""
        variables = {
            Kind.INPUT: self.chart.inputs,
            Kind.DATA: self.chart.data,
            Kind.OUTPUT: self.chart.outputs,
        }
        if part.kind in variables:
            yield self.names.variables[variables[part.kind][part.index].name]
        elif part.kind is Kind.INVOKED:
            yield self.names.slots[part.index]
        else:
            yield from sorted(self.built.members & MEMBERS[part.kind])

    # --- looking ---------------------------------------------------------------------------------

    def _view(self) -> None:
        out, t, members = self.out, self.type, self.built.members
        with out.block("static fsm_view view(const void *state)\n{"):
            out.line(f"const {t} *m = state;")
            out.line("fsm_view v = {0};")
            out.line(f"v.running = {self.running};")
            out.line(f"v.faulted = {t}_fault(m) != FSM_NO_FAULT;")
            with out.block(f"if (!{self.running}) {{"):
                out.line(f"v.at_rest = {t}_finished(m);")
                out.line("return v;")
            out.line("v.waiting = m->queue_count + recalled(m);")
            out.line(
                f"v.queued = m->queue_count{self._deferred_count};".replace(
                    "count +", "count + (uint32_t)"
                )
            )
            if "timer_count" in members:
                out.line("v.armed = m->timer_count;")
                out.line("for (uint32_t i = 0u; i < m->timer_count; i++)")
                out.line("    v.awaited += !is_silent(m->timers[i].what);")
                out.line("v.due = m->timer_count > 0u && fsm_reached(0u, m->timers[0].deadline);")
            self._view_within()
            out.line("v.at_rest = true;")
            out.line(self.each_region)
            out.line("    v.at_rest = v.at_rest && !state_restless[state_in(m, region)];")
            out.line("return v;")
        out.line()
        with out.block("static void configuration(const void *state, unsigned char *shown)\n{"):
            out.line(f"const {t} *m = state;")
            out.line(f"shown[0] = {self.running};")
            with out.block(f"{self.each_region} {{"):
                out.line("uint32_t deepest = state_in(m, region);")
                out.line("shown[2u * region + 1u] = (unsigned char)(deepest & 255u);")
                out.line("shown[2u * region + 2u] = (unsigned char)(deepest >> 8u);")
            at = own_configuration_size(self.chart)
            for inner, (slot, table) in zip(self.chart.invocations, self.sessions, strict=True):
                out.line(f"if (m->{slot}.running)")
                out.line(f"    {table}.configuration(&m->{slot}, shown + {at});")
                at += configuration_size(inner.chart)
        out.line()

    def _view_within(self) -> None:
        """Write what counts all that waits and is armed in the slots, too."""
        out = self.out
        if not self.sessions:
            return
        out.line("fsm_view within;")
        for slot, table in self.sessions:
            with out.block(f"if (m->{slot}.running) {{"):
                out.line(f"within = {table}.view(&m->{slot});")
                for name in ("waiting", "armed", "awaited"):
                    out.line(f"v.{name} += within.{name};")
        out.line("uint32_t first = 0u;")
        out.line(f"v.due = {self.type}_next_deadline(m, &first) && fsm_reached(0u, first);")

    def _dump(self) -> None:
        out, t = self.out, self.type
        with out.block("static void dump(const void *state)\n{"):
            out.line(f"const {t} *m = state;")
            out.line("fsm_dump_data(&binding, m);")
            out.line('printf("%s=", binding.path);')
            out.line(self.each_region)
            out.line("    if (state_leaf[state_in(m, region)])")
            out.line('        printf(" %u", (unsigned)state_in(m, region));')
            out.line(f'printf("%s\\n", {t}_finished(m) ? " finished" : "");')
            for slot, table in self.sessions:
                out.line(f"if (m->{slot}.running)")
                out.line(f"    {table}.dump(&m->{slot});")
        out.line()
