"""The C of a system: a struct with all its machines, and their direct connections."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from types import MappingProxyType

from fsmkit.chart.chart import Chart, Operation
from fsmkit.codegen.c.header import NOTICE, parameters
from fsmkit.codegen.c.storage import storage
from fsmkit.codegen.system.parts import Part, parts_of
from fsmkit.diagnostics import Findings
from fsmkit.emit import Emitter, printing, snake
from fsmkit.emit.c import comment
from fsmkit.language import EnumType, Field, Type, Value
from fsmkit.system.limits_of_c import report_limits
from fsmkit.system.machine import EventLink
from fsmkit.system.system import System

STEPS = 1000
"""The default limit of machine runs in one call of ``X_run``."""


def compose(
    system: System,
    charts: tuple[Chart, ...],
    queued: Collection[str],
    findings: Findings,
    outside: Collection[tuple[int, int]] = (),
) -> dict[str, str]:
    """Return header and source; nothing after reporting why C cannot express the system.

    ``charts``: `named_charts`; ``queued``: the names of charts whose code has a queue. ``outside``:
    ports, by machine, that are also connected to the host.
    """
    if not report_limits(system, findings):
        return {}
    return glue(system, parts_of(system, charts, queued), outside)


@printing
def glue(
    system: System, parts: tuple[Part, ...], outside: Collection[tuple[int, int]]
) -> dict[str, str]:
    """Return header and source."""
    prefix = snake(system.name)
    printer = GluePrinter(system, prefix, parts, outside)
    return {
        f"{prefix}.h": header(system, prefix, parts, calls=printer.host_calls()),
        f"{prefix}.c": printer.text(),
    }


def header(
    system: System,
    prefix: str,
    parts: tuple[Part, ...],
    *,
    includes: Iterable[str] = (),
    members: Iterable[str] = (),
    calls: str = "",
) -> str:
    """Return the header, with additional includes, struct members and declarations."""
    out = Emitter()
    upper = prefix.upper()
    out.line(f"/* {prefix}.h: the system {comment(system.name)}. {NOTICE} */")
    out.lines([f"#ifndef {upper}_H", f"#define {upper}_H", ""])
    out.lines(f'#include "{name}.h"' for name in dict.fromkeys(part.prefix for part in parts))
    out.lines(includes)
    out.lines(["", "#ifdef __cplusplus", 'extern "C" {', "#endif", ""])
    out.line(f"#ifndef {upper}_STEPS /* runs of machines in one call of {prefix}_run */")
    out.lines([f"#define {upper}_STEPS {STEPS}u", "#endif", ""])
    out.line(
        "/* The machines and what lies between them. The host posts to the machines, writes inputs"
    )
    out.line(" * that are not connected, and reads outputs and data. */")
    with out.block(f"typedef struct {prefix} {{", f"}} {prefix};"):
        out.lines(f"struct {part.prefix} {part.member};" for part in parts)
        out.lines(members)
        out.line("uint32_t now;")
        out.line("uint32_t steps; /* left in this call */")
        out.line(
            "uint16_t lost; /* events rejected by a queue or a stopped machine; stops at 65535 */"
        )
        width = "uint8_t" if len(parts) < 256 else "uint16_t"
        out.line(f"{width} working; /* which machine runs, from 1 */")
        out.line("bool starting;")
        for part in (part for part in parts if part.samples):
            out.line(f"bool changed_{part.member}; /* an input, perhaps, since it ran */")
        for part in (part for part in parts if part.is_fed):
            queue = f"{part.prefix.upper()}_QUEUE"
            out.line(f"uint8_t count_to_{part.member};")
            out.line(f"{part.prefix}_event to_{part.member}[{queue}]; /* until all are started */")
    out.line()
    out.text(f"""
    /* Initialize a system. Then start all its machines, those of the
     * environment first, and run them until they are idle. */
    void {prefix}_init({prefix} *s);
    bool {prefix}_start({prefix} *s, uint32_t now);

    /* Run until now: expired timers of all machines by deadline, then posted events,
     * each with its consequences in the other machines. False if they are not idle
     * within {upper}_STEPS: call it again. Within a step of a machine, start and run do nothing
     * and return false. */
    bool {prefix}_run({prefix} *s, uint32_t now);

    /* Store the first deadline of all machines; false if no timer is armed. */
    bool {prefix}_next_deadline(const {prefix} *s, uint32_t *deadline);
    """)
    if calls:
        out.line()
        out.text(calls)
    out.lines(["", "#ifdef __cplusplus", "}", "#endif", "", "#endif"])
    return out.finish()


class GluePrinter:
    """Prints the source."""

    beyond: Mapping[tuple[int, int], Sequence[tuple[int, ...]]] = MappingProxyType({})
    """By machine and port: the arguments of each connection to another node or the host."""

    def __init__(
        self,
        system: System,
        prefix: str,
        parts: tuple[Part, ...],
        outside: Collection[tuple[int, int]] = (),
    ) -> None:
        """Print for these machines, in the order in which they run."""
        self.system = system
        self.outside = outside
        self.prefix = prefix
        self.parts = parts
        self.by_index = {part.index: part for part in parts}

    def text(self) -> str:
        """Return the file."""
        out = Emitter()
        out.line(f"/* {self.prefix}.c: the system {comment(self.system.name)}. {NOTICE} */")
        out.lines([f'#include "{self.prefix}.h"', ""])
        self._first(out)
        for part in self.parts:
            if part.is_fed:
                self._to(out, part)
        for part in self.parts:
            self._ports(out, part)
        self._copies(out)
        self._delivers(out)
        self._steps(out)
        self._calls(out)
        self._more(out)
        return out.finish()

    # --- the host's functions in place of an omitted world ----------------------------------

    def host_calls(self) -> str:
        """Return the prototypes of the functions that the host implements for connected ports."""
        lines = [
            f"void {self._host_function(part, port)}({self._given(part, port)});"
            for part in self.parts
            for port in range(len(part.chart.events) + len(part.chart.operations))
            if (part.index, port) in self.outside
        ]
        about = [
            "/* The host implements: what led to machines of which no code is written, too. */"
        ]
        return "\n".join([*about, *lines] if lines else [])

    def _host_function(self, part: Part, port: int) -> str:
        return f"{self.prefix}_outside_{part.member}_{self._port(part, port)[0]}"

    def _given(self, part: Part, port: int) -> str:
        return f"{part.prefix} *m{parameters(self._port(part, port)[1], part.names)}"

    # --- what a node has beyond its own machines (see `nodes`) -----------------------------------

    def _first(self, out: Emitter) -> None:
        """Print the lines before all functions."""

    def _send(self, out: Emitter, part: Part, port: int, fields: tuple[Field, ...]) -> None:
        """Print the effects of these connections."""

    def _more_first_inputs(self) -> list[str]:
        """Return the initial values of inputs that no machine here writes."""
        return []

    def _more(self, out: Emitter) -> None:
        """Print further calls."""

    # --- connections -----------------------------------------------------------------------------

    def _to(self, out: Emitter, part: Part) -> None:
        """Print the delivery of an event to a machine: immediately, if it can receive already."""
        s, member = self.prefix, part.member
        count = f"s->count_to_{member}"
        with out.function(f"static void {s}_to_{member}({s} *s, const {part.prefix}_event *e)"):
            out.open(f"if (s->starting || s->working == {self._number(part)}u) {{")
            with out.block(f"if ({count} < {part.prefix.upper()}_QUEUE) {{"):
                out.lines([f"s->to_{member}[{count}] = *e;", f"{count}++;", "return;"])
            out.turn(f"}} else if ({part.prefix}_post(&s->{member}, e)) {{")
            out.line("return;")
            out.close()
            with out.block("if (s->lost < 65535u) {"):
                out.line("s->lost++;")

    def _ports(self, out: Emitter, part: Part) -> None:
        """Print the functions of a machine's connected events and operations."""
        links: dict[int, list[EventLink]] = {}
        for link in self.system.event_links:
            if link.source == part.index:
                links.setdefault(link.port, []).append(link)
        for port in range(len(part.chart.events) + len(part.chart.operations)):
            found, beyond = links.get(port, []), self.beyond.get((part.index, port), ())
            if not found and not beyond:
                continue
            is_outside = (part.index, port) in self.outside
            name, fields = self._port(part, port)
            machine = f"{part.prefix} *m{parameters(fields, part.names)}"
            with out.function(f"void {part.prefix}_{name}({machine})"):
                s = self.prefix
                offset = f"offsetof({s}, {part.member})"
                out.line(f"{s} *s = ({s} *)(void *)((unsigned char *)m - {offset});")
                used = {place for link in found for place in link.arguments}
                used |= {place for arguments in beyond for place in arguments}
                for place, field in enumerate(fields):
                    if place not in used and not is_outside:
                        out.line(f"(void){part.names.field(field.name)};")
                for link in found:
                    self._pass_on(out, part, fields, link)
                self._send(out, part, port, fields)
                if is_outside:
                    given = ["m", *(part.names.field(field.name) for field in fields)]
                    out.line(f"{self._host_function(part, port)}({', '.join(given)});")

    def _port(self, part: Part, port: int) -> tuple[str, tuple[Field, ...]]:
        """Return the function of a port, without the prefix, and its fields."""
        events = part.chart.events
        if port < len(events):
            return f"send_{part.names.event_names[port]}", events[port].fields
        operation: Operation = part.chart.operations[port - len(events)]
        return part.names.operations[operation.name], operation.parameters

    def _pass_on(
        self, out: Emitter, source: Part, fields: tuple[Field, ...], link: EventLink
    ) -> None:
        target = self.by_index[link.target]
        names = target.names
        with out.block("{"):
            out.line(f"{target.prefix}_event e = {names.upper}_NO_EVENT;")
            out.line(f"e.event = {names.events[link.event]};")
            for field, place in zip(
                names.chart.events[link.event].fields, link.arguments, strict=True
            ):
                value = source.names.field(fields[place].name)
                into = f"e.of.{names.payloads[link.event]}.{names.field(field.name)}"
                out.line(f"{into} = {self._stored(fields[place].type, field.type)}{value};")
            out.line(f"{self.prefix}_to_{target.member}(s, &e);")

    def _copies(self, out: Emitter) -> None:
        """Print the copies of a machine's outputs to the connected inputs."""
        for part in self.parts:
            links = [link for link in self.system.input_links if link.source == part.index]
            if not links:
                continue
            with out.function(f"static void {self.prefix}_tell_{part.member}({self.prefix} *s)"):
                for link in links:
                    target = self.by_index[link.target]
                    output = part.chart.outputs[link.output]
                    variable = target.chart.inputs[link.input]
                    read = f"s->{part.member}.{part.names.variables[output.name]}"
                    written = f"s->{target.member}.{target.names.variables[variable.name]}"
                    if target.samples:
                        with out.block(f"if ({written} != {read}) {{"):
                            out.line(f"s->changed_{target.member} = true;")
                    out.line(f"{written} = {self._cast(output.type, variable.type)}{read};")

    def _cast(self, source: Type, target: Type) -> str:
        """Return the cast from one scalar type to another that holds its values."""
        ctype = storage(target, {}).text
        return "" if storage(source, {}).text == ctype else f"({ctype})"

    def _stored(self, argument: Type, stored: Type) -> str:
        """Return the cast of an argument to its stored type."""
        if isinstance(argument, EnumType):
            return f"({storage(stored, {}).text})"
        return self._cast(argument, stored)

    # --- running ---------------------------------------------------------------------------------

    def _number(self, part: Part) -> int:
        return self.parts.index(part) + 1

    def _publish_call(self, part: Part) -> list[str]:
        has = any(link.source == part.index for link in self.system.input_links)
        return [f"{self.prefix}_tell_{part.member}(s);"] if has else []

    def _delivers(self, out: Emitter) -> None:
        """Print the delivery of postponed events to the queue of a machine."""
        s = self.prefix
        for part in self.parts:
            if not part.is_fed:
                continue
            count = f"s->count_to_{part.member}"
            with out.function(f"static void {s}_deliver_to_{part.member}({s} *s)"):
                with out.block(f"for (uint8_t i = 0u; i < {count}; i++) {{"):
                    out.line(f"{s}_to_{part.member}(s, &s->to_{part.member}[i]);")
                out.line(f"{count} = 0u;")

    def _steps(self, out: Emitter) -> None:
        """Print the run of the next machine that has work."""
        s = self.prefix
        for part in self.parts:
            p, member = part.prefix, f"s->{part.member}"
            with out.function(f"static bool {s}_has_work_{part.member}(const {s} *s)"):
                out.line("uint32_t due = 0u;")
                tests = [f"{member}.fsm.queue_count > 0u"] if part.has_queue else []
                if part.samples:
                    tests.append(f"s->changed_{part.member}")
                due = f"{p}_next_deadline(&{member}, &due) && fsm_reached(s->now, due)"
                with out.block(f"if (!{p}_in(&{member}, {part.names.states[0]})) {{"):
                    out.line("return false;")
                if tests:
                    with out.block(f"if ({' || '.join(tests)}) {{"):
                        out.line("return true;")
                out.line(f"return {due};")
        with out.function(f"static bool {s}_step({s} *s)"):
            for part in self.parts:
                with out.block(f"if ({s}_has_work_{part.member}(s)) {{"):
                    if part.samples:
                        out.line(f"s->changed_{part.member} = false;")
                    out.line(f"s->working = {self._number(part)}u;")
                    out.line(f"{part.prefix}_run(&s->{part.member}, s->now);")
                    out.line("s->working = 0u;")
                    if part.is_fed:
                        out.line(f"{s}_deliver_to_{part.member}(s);")
                    out.lines([*self._publish_call(part), "return true;"])
            out.line("return false;")
        out.text(f"""
        /* Let one machine after the other run until all rest; false if that takes too long. */
        static bool {s}_settle({s} *s)
        {{
            while (s->steps > 0u) {{
                if (!{s}_step(s)) {{
                    return true;
                }}
                s->steps--;
            }}
            return false;
        }}
        """)
        out.line()

    def _calls(self, out: Emitter) -> None:
        """Print the functions for the host."""
        s, upper = self.prefix, self.prefix.upper()
        with out.function(f"void {s}_init({s} *s)"):
            out.line("unsigned char *bytes = (unsigned char *)s;")
            with out.block("for (size_t i = 0u; i < sizeof *s; i++) {"):
                out.line("bytes[i] = 0u;")
            out.lines(f"{part.prefix}_init(&s->{part.member});" for part in self.parts)
        with out.function(f"bool {s}_start({s} *s, uint32_t now)"):
            self._return_within_a_step(out)
            out.lines(["s->now = now;", f"s->steps = {upper}_STEPS;"])
            out.lines(["s->lost = 0u;", "s->starting = true;"])
            out.lines(f"s->count_to_{part.member} = 0u;" for part in self.parts if part.is_fed)
            out.lines([*self._first_inputs(), *self._more_first_inputs()])
            for part in self.parts:
                out.line(f"{part.prefix}_start(&s->{part.member}, now);")
                out.lines(self._publish_call(part))
            out.line("s->starting = false;")
            out.lines(f"{s}_deliver_to_{part.member}(s);" for part in self.parts if part.is_fed)
            out.line(f"return {s}_settle(s);")
        with out.function(f"bool {s}_run({s} *s, uint32_t now)"):
            out.line("uint32_t due = 0u;")
            self._return_within_a_step(out)
            out.line("const bool was_interrupted = s->steps == 0u;")
            out.line(f"s->steps = {upper}_STEPS;")
            with out.block(f"if (was_interrupted && !{s}_settle(s)) {{ /* at the time it had */"):
                out.line("return false;")
            if sampling := [part.member for part in self.parts if part.samples]:
                with out.block("if (!was_interrupted) {"):
                    out.lines(f"s->changed_{member} = true;" for member in sampling)
            with out.block(f"while ({s}_next_deadline(s, &due) && fsm_reached(now, due)) {{"):
                with out.block("if (fsm_reached(due, s->now)) { /* the clock goes on only */"):
                    out.line("s->now = due;")
                with out.block(f"if (!{s}_settle(s)) {{"):
                    out.line("return false;")
            out.lines(["s->now = now;", f"return {s}_settle(s);"])
        self._next_deadline(out)

    def _return_within_a_step(self, out: Emitter) -> None:
        """Print the return for a call from an operation of a machine, which has no effect."""
        with out.block("if (s->starting || s->working != 0u) {"):
            out.line("return false;")

    def _first_inputs(self) -> list[str]:
        """Return the initial values of inputs, until the machines that write them start."""
        lines = []
        for link in self.system.input_links:
            target, source = self.by_index[link.target], self.by_index[link.source]
            variable = target.chart.inputs[link.input]
            value = literal(source.chart.outputs[link.output].init.value)
            name = target.names.variables[variable.name]
            lines.append(f"s->{target.member}.{name} = {value};")
        return lines

    def _next_deadline(self, out: Emitter) -> None:
        s = self.prefix
        with out.function(f"bool {s}_next_deadline(const {s} *s, uint32_t *deadline)"):
            out.lines(["bool found = false;", "uint32_t due = 0u;"])
            for part in self.parts:
                p, member = part.prefix, f"s->{part.member}"
                running = f"{p}_in(&{member}, {part.names.states[0]})"
                out.line(f"if ({running} && {p}_next_deadline(&{member}, &due) &&")
                out.line("    (!found || !fsm_reached(due, *deadline))) {")
                with out.indented():
                    out.lines(["*deadline = due;", "found = true;"])
                out.line("}")
            out.line("return found;")


def literal(value: Value) -> str:
    """Return a scalar in C notation."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, float):
        return repr(value)
    assert isinstance(value, int)  # noqa: S101  (strings, arrays and records are rejected)
    return f"({value + 1} - 1)" if value < 0 else f"{value}u"
