"""The source that replaces a machine's own in builds that record.

Like the source of `tracing`, it includes the machine's source under hooks and other names for the
host's calls. The chart-independent part is in ``fsm_recorded.h`` and ``fsm_records.c``. The numbers
are those of `runtime.tracing.numbering`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import assert_never

import fsmkit.language as lang
from fsmkit.chart.chart import Event
from fsmkit.codegen.c.expressions.types import loaded, parameter_type
from fsmkit.codegen.c.header import NOTICE, declaration, parameters
from fsmkit.codegen.c.info import Machines
from fsmkit.codegen.c.names import Names
from fsmkit.codegen.c.sharing import RECORDED
from fsmkit.codegen.c.storage import storage
from fsmkit.codegen.c.tracing import print_observed
from fsmkit.diagnostics import fail
from fsmkit.emit import Emitter
from fsmkit.emit.c import comment
from fsmkit.plan.image import code, image_of, scalars, size_of
from fsmkit.runtime.tracing.numbering import Numbering
from fsmkit.runtime.tracing.records import DIRECT, LONGEST_SYNC, TELLS_ALL

LEVEL_2 = "#if FSM_TRACE_LEVEL >= 2"
SYNC_HEAD = 13
"""The bytes of a sync record beside its numbers, at most."""

FLAT = str.maketrans({".": "_", "[": "_", "]": None})
"""Replaces the dots of a member path to form a name."""


@dataclass(frozen=True, slots=True)
class _Member:
    """A machine of the family: its names, its members, its path from the outermost machine."""

    names: Names
    members: frozenset[str]
    path: str
    number: int


def _nothing(names: Names) -> Sequence[str]:
    del names
    return ()


def recording_source(
    machines: Machines,
    before: Callable[[Names], Sequence[str]] = _nothing,
    after: Callable[[Names], Sequence[str]] = _nothing,
) -> str:
    """Return the source for machines; those in slots precede those that hold them.

    ``before`` and ``after`` return lines for another observer, around each machine.
    """
    outer = machines[-1][0]
    numbers = len(Numbering(outer.chart).greatest)
    if 3 * numbers + SYNC_HEAD > LONGEST_SYNC:
        raise fail(
            "c-limit", f"`{outer.chart.name}` has {numbers:,} regions and histories, whose states "
            "do not fit in a record",
            help="compile it without `--with records`",
        )  # fmt: skip
    return _Source(outer, machines).text(before, after)


class _Source:
    """Prints the source."""

    def __init__(self, outer: Names, machines: Machines) -> None:
        self._out = Emitter()
        self._outer = outer
        self._machines = machines
        self._own = f"fsm_{outer.prefix}"
        self._numbering = Numbering(outer.chart)
        members = {names.prefix: members for names, members in machines}
        places = _places(outer)
        self._family = [
            _Member(names, members[names.prefix], path, number)
            for number, (names, path) in enumerate(places)
        ]

    def text(
        self, before: Callable[[Names], Sequence[str]], after: Callable[[Names], Sequence[str]]
    ) -> str:
        out, outer = self._out, self._outer
        what = comment("the machine " + outer.chart.name + ", recorded")
        out.line(f"/* {outer.prefix}_records.c: {what}. {NOTICE}")
        out.line(" * Compile it instead of the sources that it includes. */")
        out.lines([f'#include "{outer.prefix}.h"', '#include "fsm_records.h"', ""])
        sources = [f'#include "{names.prefix}.c"' for names, _ in self._machines]
        out.lines(["#if FSM_TRACE_LEVEL == 0", *sources, "#else", ""])
        self._shared()
        by_prefix = {each.names.prefix: each for each in self._family}
        for names, _ in self._machines:
            out.lines(before(names))
            self._machine(by_prefix[names.prefix])
            out.lines(after(names))
        out.line("#endif")
        return out.finish()

    # --- what all need --------------------------------------------------------------------

    def _shared(self) -> None:
        """Print the hash, and room for a record with a payload."""
        out, numbering = self._out, self._numbering
        data = ", ".join(f"0x{byte:02X}u" for byte in numbering.hash)
        out.line(f"static const uint8_t {self._own}_hash[] = {{{data}}};")
        ticks = max(1, 1_000_000 // self._outer.chart.capacities.tick)
        out.line("#undef FSM_RECORDED_SYNC")
        with_default = ["#ifdef FSM_TRACE_SYNC", "#define FSM_RECORDED_SYNC (FSM_TRACE_SYNC)"]
        out.lines([*with_default, "#else", f"#define FSM_RECORDED_SYNC {ticks}u", "#endif", ""])
        most = max((size for _, _, size in numbering.fields), default=0)
        if any(fields for _, fields, _ in numbering.fields):
            room = f"static uint8_t {self._own}_bytes[FSM_RECORDS_HEAD + {most}];"
            out.lines([LEVEL_2, room, "#endif", ""])

    def _machine(self, member: _Member) -> None:
        """Print one machine: the definitions for its source, and the source."""
        out, names, p = self._out, member.names, member.names.prefix
        now = "(m)->fsm.now" if "fsm.now" in member.members else "fsm_records.call.now"
        defined = {
            "": p,
            "_FIRST": f"{self._numbering.base(member.number)}u",
            "_START": f"{self._numbering.first_start + member.number}u",
            "_BUSY(m)": "(m)->fsm.busy" if "fsm.busy" in member.members else "false",
        }
        if not names.is_invoked:
            defined["_STOPPED(m)"] = f"({names.stopped.replace('m->', '(m)->')})"
            defined["_HOSTED"] = ""
        if not names.is_invoked and names.does.runs:
            defined["_RUNS"] = ""
        if not names.is_invoked and "save" in names.options.extras:
            defined["_SAVED"] = ""
        out.lines(f"#define FSM_RECORDED{name} {value}".rstrip() for name, value in defined.items())
        out.lines([LEVEL_2, "#define FSM_RECORDED_NOW(m) fsm_records.call.now", "#else"])
        out.lines([f"#define FSM_RECORDED_NOW(m) {now}", "#endif"])
        out.line('#include "fsm_recorded.h"')
        results = [(number, m, o) for number, (m, o) in enumerate(self._numbering.results)]
        own = [
            (self._numbering.first_result + number, o.name)
            for number, m, o in results
            if m == member.number and "call " + o.name in names.used
        ]
        is_level_2 = bool(own) or not names.is_invoked
        if is_level_2:
            out.line(LEVEL_2)
        symbols = image_of(names.chart).stores_symbols and self._puts_symbols(names)
        if is_level_2 and symbols:
            self._symbols(names)
        for number, name in own:
            self._result(names, name, number)
        if not names.is_invoked:
            self._came(names)
            self._read(names)
        if is_level_2:
            out.lines(["#endif", ""])
        if names.is_invoked:
            out.line(f'#include "{p}.c"')
        else:
            self._sync(names)
            self._snapshot(names)
            self._calls(names)
        if own:
            out.line(LEVEL_2)
            out.lines(f"#undef {p}_{names.operations[name]}" for _, name in own)
            out.line("#endif")
        out.lines(f"#undef FSM_RECORDED{name.removesuffix('(m)')}" for name in defined)
        out.lines(["#undef FSM_RECORDED_NOW", ""])

    # --- values ---------------------------------------------------------------------------

    def _puts_symbols(self, names: Names) -> bool:
        return any(
            isinstance(part, lang.SymbolType)
            for machine, fields, _ in self._numbering.fields
            for field in fields
            for part in scalars(field.type)
            if self._family[machine].names is names
        )

    def _symbols(self, names: Names) -> None:
        """Print the place of a symbol in the list of the chart; one of the host has none."""
        numbers = [names.symbol(text) for text in image_of(names.chart).texts]
        own = f"fsm_{names.prefix}"
        listed = ", ".join(f"{number}u" for number in numbers)
        self._out.text(f"""
        static uint32_t {own}_place(uint16_t symbol)
        {{
            static const uint16_t texts[] = {{{listed}}};
            const uint32_t place = fsm_find(texts, {len(numbers)}u, symbol);
            return place < {len(numbers)}u ? place : 0x10000u + symbol;
        }}
        """)

    def _value(self, names: Names, type_: lang.Type, value: str, depth: int = 0) -> None:
        """Print the statements that record a value."""
        out = self._out
        match type_:
            case lang.ArrayType(element, length):
                index = f"i{depth}"
                with out.block(f"for (uint32_t {index} = 0u; {index} < {length}u; {index}++) {{"):
                    self._value(names, element, f"{value}[{index}]", depth + 1)
            case lang.RecordType(_, parts):
                for part in parts:
                    self._value(names, part.type, f"{value}.{names.field(part.name)}", depth)
            case lang.FloatType(bits):
                kind = "fsm_float_bits" if bits == 32 else "fsm_double_bits"
                put = "fsm_put(&w, bits.bits, 4u)" if bits == 32 else "fsm_put_wide(&w, bits.bits)"
                with out.block("{"):
                    out.lines([f"{kind} bits;", f"bits.value = {value};", f"{put};"])
            case lang.SymbolType():
                out.line(f"fsm_put(&w, fsm_{names.prefix}_place({value}), 4u);")
            case lang.BoolType():
                out.line(f"fsm_put(&w, {value} ? 1u : 0u, 1u);")
            case lang.IntType() | lang.EnumType() | lang.DurationType():
                size = size_of(code(type_))
                if size == 8:
                    out.line(f"fsm_put_wide(&w, (uint64_t){value});")
                else:
                    out.line(f"fsm_put(&w, (uint32_t){value}, {size}u);")
            case _:
                assert_never(type_)

    def _open(self, now: str, instance: str, number: str) -> None:
        """Print the head of a record."""
        out, own = self._out, self._own
        out.line(f"uint8_t *const at = fsm_records_head({own}_bytes, {now}, {instance});")
        out.line(f"fsm_writer w = fsm_write_to(fsm_records_numbered(at, {number}));")

    def _close(self, now: str, instance: str) -> None:
        self._out.line(f"fsm_records_commit({self._own}_bytes, w.at, {now}, {instance});")

    # --- level 2 --------------------------------------------------------------------------

    def _result(self, names: Names, name: str, number: int) -> None:
        """Print a function that calls an operation and records its result, and its macro."""
        out, p = self._out, names.prefix
        operation = next(o for o in names.chart.operations if o.name == name)
        result, fields = operation.result, operation.parameters
        assert result is not None  # noqa: S101  (only such have a number)
        stored = storage(result, names.records).text
        called = names.operations[name]
        recorded = f"fsm_{p}_recorded_{called}"
        returned = parameter_type(result, names)
        out.line(f"static {returned} {recorded}({p} *m{parameters(fields, names)})")
        with out.block("{"):
            passed = "".join(f", {names.field(part.name)}" for part in fields)
            cast = f"({stored})" if isinstance(result, lang.EnumType) else ""
            out.line(f"{stored} result = {cast}{p}_{called}(m{passed});")
            now, instance = "fsm_records.call.now", "FSM_RECORDS_INSTANCE"
            self._open(now, instance, f"{number}u")
            self._value(names, result, "result")
            out.line("FSM_RECORDED_TOUCH();")
            self._close(now, instance)
            out.line(f"return {loaded(result, 'result', names)};")
        out.lines([f"#define {p}_{called} {recorded}", ""])

    def _came(self, names: Names) -> None:
        """Print the function that records an event."""
        out, p, chart = self._out, names.prefix, names.chart
        posted, dispatched = self._numbering.first_event, self._numbering.first_dispatched
        taken = f"const {p} *m, const {p}_event *e, bool is_dispatched"
        out.line(f"static void fsm_{p}_came({taken})")
        with out.block("{"):
            now, instance = "now", "FSM_INSTANCE_OF(m)"
            out.line(
                "const uint32_t now = is_dispatched ? fsm_records.call.now : fsm_records.told;"
            )
            first = f"is_dispatched ? {dispatched - 1}u : {posted - 1}u"
            out.line(f"const uint32_t number = ({first}) + (uint32_t)e->event;")
            out.line("(void)m;")
            with out.block("if (is_dispatched) {"):
                out.line("fsm_records.call.is_dispatched = false;")
            with out.block(f"if (e->event == 0u || e->event > {len(chart.events)}u) {{"):
                out.line("return; /* the machine answers it as any that it does not know */")
            with_fields = [event for event in chart.events if event.fields]
            if with_fields:
                with out.block("switch (e->event) {"):
                    for event in with_fields:
                        self._payload(names, event)
                    out.line("default:")
                    out.line("    break;")
            if self._numbering.first_input <= DIRECT:
                out.line(f"fsm_records_byte({now}, number, {instance});")
            else:
                out.line(f"FSM_RECORDS_NUMBER({now}, number, {instance});")
        out.line()

    def _payload(self, names: Names, event: Event) -> None:
        """Print the case of an event with a payload."""
        out, instance = self._out, "FSM_INSTANCE_OF(m)"
        payload = f"e->of.{names.payloads[event.index]}"
        with out.block(f"case {names.events[event.index]}: {{"):
            self._open("now", instance, "number")
            for part in event.fields:
                self._value(names, part.type, f"{payload}.{names.field(part.name)}")
            self._close("now", instance)
            out.line("return;")

    def _read(self, names: Names) -> None:
        """Print the function that records changed inputs, or all of them at the start."""
        out, p, inputs = self._out, names.prefix, names.chart.inputs
        paths = [names.variables[each.name].partition(".")[2] for each in inputs]
        plain = [path.translate(FLAT) for path in paths]
        kept = f"{self._own}_inputs"
        if inputs:
            with out.block("typedef struct {", f"}} {kept};"):
                pairs = zip(inputs, plain, strict=True)
                out.lines(f"{declaration(i.type, name, names)};" for i, name in pairs)
        out.line(f"static void fsm_{p}_read(const {p} *m, bool is_start)")
        with out.block("{"):
            if not inputs:
                out.lines(["(void)m;", "(void)is_start;"])
            else:
                held = f"{kept} *const recorded = ({kept} *)fsm_records.inputs;"
                static = f"static {kept} recorded[FSM_TRACE_INSTANCES];"
                out.lines(["#ifdef FSM_TRACE_STATE", held, "#else", static, "#endif"])
                out.line("const bool is_known = FSM_RECORDS_INSTANCE < FSM_TRACE_INSTANCES;")
                out.line("const uint32_t place = is_known ? FSM_RECORDS_INSTANCE : 0u;")
                for number, (each, name) in enumerate(zip(inputs, plain, strict=True)):
                    value = f"m->{names.variables[each.name]}"
                    recorded = f"recorded[place].{name}"
                    same = (
                        f"is_known && fsm_records_keeps(&{value}, &{recorded}, sizeof {recorded})"
                    )
                    with out.block(f"if (!({same}) || is_start) {{"):
                        now, instance = "fsm_records.call.now", "FSM_RECORDS_INSTANCE"
                        self._open(now, instance, f"{self._numbering.first_input + number}u")
                        self._value(names, each.type, value)
                        out.line("FSM_RECORDED_TOUCH();")
                        self._close(now, instance)
        out.line()

    # --- whole states ---------------------------------------------------------------------

    def _sync(self, names: Names) -> None:
        """Print the function that records the states of the machine and of those in its slots."""
        out, p = self._out, names.prefix
        numbers = list(self._numbers())
        root = self._family[0]
        running = names.running
        status = f"({running} ? 1u : 0u)"
        if "fsm.finished" in root.members:
            status += " | (m->fsm.finished ? 2u : 0u)"
        fault = "(uint16_t)m->fsm.fault" if "fsm.fault" in root.members else "0u"
        count = len(numbers) + 2
        out.line(f"static void fsm_{p}_sync(const {p} *m, uint32_t now)")
        with out.block("{"):
            out.line(f"uint16_t numbers[{count}];")
            out.line(f"uint8_t bytes[FSM_RECORDS_SYNC_BYTES({count}u)];")
            detail = f"(FSM_TRACE_LEVEL >= 2 ? {TELLS_ALL}u : 0u)"
            out.line(f"numbers[0] = (uint16_t)({status} | {detail});")
            out.line(f"numbers[1] = {fault};")
            out.lines(f"numbers[{i}] = {text};" for i, text in enumerate(numbers, start=2))
            out.line(f"fsm_records_sync({self._own}_hash, now, numbers, {count}u, bytes);")
        out.line()

    def _numbers(self) -> Iterator[str]:
        """Yield the states of regions and histories, machine by machine."""
        for machine in self._family:
            names, image = machine.names, image_of(machine.names.chart)
            own = list(_numbers(machine))
            assert len(own) == len(image.plan.regions) + len(image.histories)  # noqa: S101
            if not names.is_invoked:
                yield from own
                continue
            running = f"m->{machine.path}fsm.running"
            yield from (f"(uint16_t)({running} ? {number} : 0u)" for number in own)

    def _snapshot(self, names: Names) -> None:
        """Print the function that records the saved machine, if it can be saved."""
        if "save" not in names.options.extras:
            return
        out, p = self._out, names.prefix
        size = f"{names.upper}_SAVED_BYTES"
        out.line(LEVEL_2)
        out.line(f"static void fsm_{p}_snapshot(const {p} *m, uint32_t now)")
        with out.block("{"):
            out.line(f"static uint8_t bytes[FSM_RECORDS_HEAD + {size}];")
            out.line("const uint16_t instance = FSM_RECORDS_INSTANCE;")
            out.line("uint8_t *at = fsm_records_head(bytes, now, instance);")
            out.line("*at++ = (uint8_t)FSM_RECORD_SNAPSHOT;")
            out.line(f"at = fsm_records_varint(at, {size});")
            with out.block(f"if ({p}_save(m, now, at)) {{"):
                out.line(f"fsm_records_offer(bytes, at + {size}, now, instance);")
        out.lines(["#endif", ""])

    def _calls(self, names: Names) -> None:
        """Print the source with other names for the host's calls, then these functions."""
        restored = f"void fsm_{names.prefix}_restored({names.prefix} *m, uint32_t now);"
        more = [restored] if "save" in names.options.extras else []
        print_observed(self._out, names, "recorded", more)


def _places(names: Names, path: str = "") -> Iterator[tuple[Names, str]]:
    """Yield a machine and those in its slots, with their paths from the outermost."""
    yield names, path
    for inner, slot in zip(names.invoked, names.slots, strict=True):
        yield from _places(inner, f"{path}{slot}.")


def _numbers(machine: _Member) -> Iterator[str]:
    """Yield the states of one machine's regions and histories, as numbers in C."""
    names, image = machine.names, image_of(machine.names.chart)
    for region in image.plan.regions:
        member = names.regions[region.index]
        place = f"m->{machine.path}{member}"
        is_shared = region.index in names.shared
        there = member in machine.members
        plain = f"(uint16_t)({place} < {RECORDED}u ? {place} : 0u)" if is_shared else place
        yield plain if there else "0u"
    for history, of in image.histories:
        member = names.recorded(history, of)
        place = f"m->{machine.path}{member}"
        is_shared = names.shared.get(of) == history
        above = f"(uint16_t)({place} > {RECORDED}u ? {place} - {RECORDED}u : 0u)"
        yield (above if is_shared else place) if member in machine.members else "0u"
