"""The driver of one generated machine, in C: it answers requests (see ``driver.h``)."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import fsmkit.language as lang
from fsmkit.chart.analysis.host_events import posted_events, sent_events
from fsmkit.chart.chart import Chart
from fsmkit.codegen.c.generate import Machine, generate_machine
from fsmkit.codegen.c.host import print_host
from fsmkit.codegen.c.layout import reply_type
from fsmkit.codegen.c.names import Names
from fsmkit.codegen.c.options import Options
from fsmkit.codegen.c.storage import storage
from fsmkit.emit import Emitter, printing
from fsmkit.plan.image import code, scalars

OWN = "certify_own_"
"""The prefix of the driver's functions that replace those of a firmware's host."""
OPTIONAL = (
    "dispatch", "post", "run", "active", "finished", "fault", "next_deadline", "in", "rebase",
    "post_by_name", "step_event", "step_eventless", "step_timer",
)  # fmt: skip
"""Functions of a machine that a firmware may lack: its linker removes those that nothing calls."""
FOLDER = Path(__file__).parent
ALMOST_FULL = 65534
"""The value of counters at the start of a step with full counters: one below their maximum."""
MOST_SEEN = 8192
"""The bytes of the trace of a step for what the host sees during calls: half of a trace."""
SIZES = {"b": 8, "h": 16, "i": 32, "q": 64}
"""The bits of the codes of `struct` for integers, in lower case."""


@dataclass(frozen=True, slots=True)
class Program:
    """A generated machine, the library that it needs, and its driver."""

    machine: Machine
    files: dict[str, str]
    """All files by name: the machine's, and those of the driver."""
    shipped: tuple[str, ...]
    """The names of the files that a project compiles."""
    is_default: bool
    """Whether the machine's source is the one that is generated without ``--with save``."""

    @property
    def names(self) -> Names:
        """The names of the machine."""
        return self.machine.names

    @property
    def prefix(self) -> str:
        """The prefix of the machine."""
        return self.machine.names.prefix

    @property
    def payloads(self) -> dict[str, dict[int, str]]:
        """For each machine the member of the payload that an event uses, by its number."""
        return {
            names.prefix: {
                event.index + 1: names.payloads[event.index]
                for event in names.chart.events
                if event.fields
            }
            for names, _ in self.machine.family
        }

    @property
    def sources(self) -> list[str]:
        """The sources that a project compiles."""
        return [name for name in self.shipped if name.endswith(".c")]


def program_of(chart: Chart, prefix: str | None, options: Options) -> Program:
    """Return the program of a chart, generated with these options."""
    plain = generate_machine(chart, prefix, options)
    saving = Options(
        without=options.without,
        extras=options.extras | {"save"},
        is_small=options.is_small,
        is_tabled=options.is_tabled,
    )
    machine = generate_machine(chart, prefix, saving)
    own = [name for name in machine.files if name in plain.files]
    name = f"{machine.names.prefix}.c"
    files = dict(machine.files)
    files[f"driver_{name}"] = driver(machine.names)
    for each in ("driver.h", "driver.c", "host.c"):
        files[each] = (FOLDER / each).read_text(encoding="utf-8")
    shipped = tuple(sorted(own))
    is_default = plain.files[name] == machine.files[name]
    return Program(machine, files, shipped, is_default)


@printing
def driver(names: Names) -> str:
    """Return the source of the driver of a machine."""
    out = Emitter()
    p = names.prefix
    out.lines([f'#include "{p}.h"', '#include "driver.h"', ""])
    for inner, _ in _family(names):
        if inner is not names:
            out.line(f'#include "{inner.prefix}.h"')
    out.lines(
        [
            f"static {p} fsm_machine CERTIFY_ALIGNED;",
            f"static {p} fsm_state CERTIFY_ALIGNED;",
            f"static {p}_event fsm_event;",
            f"static {p}_event fsm_posted;",
            "static uint8_t fsm_posts, fsm_posts_left;",
            "static uint16_t fsm_looks_left;",
        ]
    )
    out.line(f"static {p} fsm_given;")
    leaves = max(1, sum(state.is_leaf for state in names.chart.states))
    out.line(f"static {p}_state fsm_seen[{leaves}];")
    out.lines(["static uint32_t fsm_deadline, fsm_now;", ""])
    out.text(f"""
    const uint32_t certify_machine_size = (uint32_t)sizeof({p});

    void *certify_state(void)
    {{
        return &fsm_state;
    }}

    void *certify_machine(void)
    {{
        return &fsm_machine;
    }}
    """)
    _read_event(out, names)
    _prepare(out, names)
    _restore_inputs(out, names)
    _look(out, names)
    _call_back(out, names)
    _host_functions(out, names)
    _perform(out, names)
    _saving(out, names)
    return out.finish()


def _family(names: Names, place: str = "fsm_machine") -> Iterator[tuple[Names, str]]:
    """Yield a machine after those in its slots, each with the C expression of its struct."""
    for inner, slot in zip(names.invoked, names.slots, strict=True):
        yield from _family(inner, f"{place}.{slot}")
    yield names, place


def _prepare(out: Emitter, names: Names) -> None:
    out.lines(["", "void certify_prepare(void)"])
    with out.block("{"):
        out.line("certify_copy(&fsm_machine, &fsm_state, (uint32_t)sizeof fsm_machine);")
        for declared in names.chart.inputs:
            _take(out, f"fsm_machine.{names.variables[declared.name]}", declared.type, names)
        out.line(f"fsm_looks_left = {looks(names)}u;")
        if names.does.counted:
            with out.block("if ((certify_manner & CERTIFY_FULL) != 0u) {"):
                out.line(f"fsm_machine.fsm.unhandled = {ALMOST_FULL}u;")
                if names.does.queued:
                    out.line(f"fsm_machine.fsm.rejected = {ALMOST_FULL}u;")
        with out.block("if ((certify_manner & (CERTIFY_POSTING | CERTIFY_NESTING)) != 0u) {"):
            out.lines(["fsm_posts = certify_take8();", "fsm_posts_left = certify_take8();"])
            out.line("fsm_read_event(&fsm_posted);")


def _read_event(out: Emitter, names: Names) -> None:
    out.lines(["", f"static void fsm_read_event({names.prefix}_event *e)"])
    with out.block("{"):
        out.line("fsm_clear(e, sizeof *e);")
        out.line("e->event = certify_take16();")
        with out.block("switch (e->event) {"):
            for index in posted_events(names.chart):
                event = names.chart.events[index]
                if not event.fields:
                    continue
                out.line(f"case {index + 1}u:")
                for part in event.fields:
                    place = f"e->of.{names.payloads[index]}.{names.field(part.name)}"
                    _take(out, place, part.type, names)
                out.line("break;")
            out.lines(["default:", "break;"])


def _restore_inputs(out: Emitter, names: Names) -> None:
    out.lines(["", "bool certify_restore_inputs(void)"])
    with out.block("{"):
        out.line("bool kept = true;")
        for declared in names.chart.inputs:
            place = names.variables[declared.name]
            _take(out, f"fsm_given.{place}", declared.type, names)
            for path, _ in _scalars(declared.type, names):
                at = f"{place}{path}"
                out.line(f"kept = kept && fsm_machine.{at} == fsm_given.{at};")
                out.line(f"fsm_machine.{at} = fsm_state.{at};")
        out.lines(["(void)fsm_given;", "return kept;"])


def _look(out: Emitter, names: Names) -> None:
    """Print the function that puts into the trace what the host sees of the machine."""
    p, chart = names.prefix, names.chart
    leaves = "(uint16_t)(sizeof fsm_seen / sizeof fsm_seen[0])"
    room = f"room == 2u ? {leaves} : room"
    out.text(f"""

    static void fsm_look(void)
    {{
        uint16_t count;
        (void)count;
    #ifndef CERTIFY_WITHOUT_ACTIVE
        for (uint16_t room = 0u; room < 3u; room++) {{
            fsm_clear(fsm_seen, sizeof fsm_seen);
            CERTIFY_LOOK(count = {p}_active(&fsm_machine, fsm_seen, {room}));
            certify_put16(count);
            for (uint16_t i = 0u; i < count; i++) {{
                certify_put16((uint16_t)fsm_seen[i]);
            }}
        }}
    #endif
    #ifndef CERTIFY_WITHOUT_IN
        for (uint16_t i = 0u; i < {len(chart.states)}u; i += 8u) {{
            uint8_t bits = 0u;
            /* During calls the root is omitted: between exit and entry it depends on the code. */
            const uint16_t from = i == 0u && certify_active != 0u ? 1u : i;
            for (uint16_t k = from; k < i + 8u && k < {len(chart.states)}u; k++) {{
                CERTIFY_LOOK(count = {p}_in(&fsm_machine, ({p}_state)k));
                bits |= (uint8_t)((uint32_t)count << (k - i));
            }}
            certify_put8(bits);
        }}
    #endif
    #ifndef CERTIFY_WITHOUT_FINISHED
        CERTIFY_LOOK(count = {p}_finished(&fsm_machine));
        certify_put8((uint8_t)count);
    #endif
    #ifndef CERTIFY_WITHOUT_FAULT
        CERTIFY_LOOK(count = (uint16_t){p}_fault(&fsm_machine));
        certify_put8((uint8_t)count);
    #endif
    """)
    out.line("#ifndef CERTIFY_WITHOUT_NEXT_DEADLINE")
    # the timers of a machine in a slot change while it calls the host
    with out.block("if (certify_active == 0u) {" if names.invoked else "{"):
        out.line("fsm_deadline = 0u;")
        out.line(f"CERTIFY_LOOK(count = {p}_next_deadline(&fsm_machine, &fsm_deadline));")
        out.line("certify_put8((uint8_t)count);")
        out.line("certify_put32(count != 0u ? fsm_deadline - fsm_now : 0u);")
    out.line("#endif")
    for declared in seen_data(names):
        _put(out, f"fsm_machine.{names.variables[declared.name]}", declared.type, names)
    out.line("}")


def _call_back(out: Emitter, names: Names) -> None:
    """Print the function that does what the host does during a call, by the manner."""
    p, does = names.prefix, names.does
    out.lines(["", "static void fsm_call_back(void)"])
    with out.block("{"):
        out.line("static bool is_inside;")
        with out.block("if (is_inside) {"):
            out.line("return; /* a faulty machine has started a step within a step */")
        out.line("is_inside = true;")
        with out.block("if ((certify_manner & CERTIFY_LOOKING) != 0u && fsm_looks_left > 0u) {"):
            out.lines(["fsm_looks_left--;", "fsm_look();"])
        with out.block("if ((certify_manner & CERTIFY_NESTING) != 0u) {"):
            out.lines([f"{p}_start(&fsm_machine, ~fsm_now);"])
            _unless_absent(
                out,
                "dispatch",
                f"certify_put8((uint8_t){p}_dispatch(&fsm_machine, &fsm_posted, ~fsm_now));",
            )
            if does.runs:
                _unless_absent(out, "run", f"{p}_run(&fsm_machine, ~fsm_now);")
            for name in single_steps(names):
                call = f"certify_put8((uint8_t){p}_{name}(&fsm_machine));"
                _unless_absent(out, name, call)
        if does.queued:
            many = "for (uint8_t i = 0u; i < fsm_posts && fsm_posts_left > 0u; i++) {"
            with out.block("if ((certify_manner & CERTIFY_POSTING) != 0u) {"), out.block(many):
                out.line("fsm_posts_left--;")
                _post(out, names)
        out.line("is_inside = false;")


def _post(out: Emitter, names: Names) -> None:
    """Print the statements that post an event; one without a payload is posted by its name."""
    p, events = names.prefix, names.chart.events
    plain = [index for index in posted_events(names.chart) if not events[index].fields]
    with out.block("switch (fsm_posted.event) {"):
        if plain:
            out.line("#ifndef CERTIFY_WITHOUT_POST_BY_NAME")
            out.lines(f"case {index + 1}u:" for index in plain)
            name = f"({p}_event_name)fsm_posted.event"
            out.line(f"certify_put8((uint8_t){p}_post_by_name(&fsm_machine, {name}));")
            out.lines(["break;", "#endif"])
        out.line("default:")
        call = f"certify_put8((uint8_t){p}_post(&fsm_machine, &fsm_posted));"
        _unless_absent(out, "post", call)
        out.line("break;")


def single_steps(names: Names) -> tuple[str, ...]:
    """Return the single steps of `run` that a machine has functions for."""
    has = {"step_eventless": names.does.polls, "step_event": names.does.queued, "step_timer": True}
    return tuple(name for name, is_there in has.items() if is_there)


def seen_data(names: Names) -> tuple[lang.Field, ...]:
    """Return the data and outputs that a look at the machine puts into the trace."""
    declared = (*names.chart.data, *names.chart.outputs)
    fields = tuple(lang.Field(each.name, each.type) for each in declared)
    return fields if _data_size(fields) <= MOST_SEEN else ()


def looks(names: Names) -> int:
    """Return how often the host looks at the machine in one step, so that the trace has room."""
    states = len(names.chart.states)
    return MOST_SEEN // (6 * states + states // 8 + 16 + _data_size(seen_data(names)))


def _data_size(fields: tuple[lang.Field, ...]) -> int:
    return 8 * sum(1 for each in fields for _ in scalars(each.type))


def _unless_absent(out: Emitter, name: str, statement: str) -> None:
    """Print a statement that needs a function which a firmware may lack."""
    out.lines([f"#ifndef CERTIFY_WITHOUT_{name.upper()}", statement, "#endif"])


def counts(names: Names) -> bool:
    """Return whether the counters of a machine are compared: not those of machines in slots."""
    return names.does.counted and not names.invoked


def _host_functions(out: Emitter, names: Names) -> None:
    """Print the operations and the functions that take events, for each machine."""
    for number, (each, place) in enumerate(_family(names)):
        out.lines(["", f"static void fsm_call_{number}(bool is_own, uint32_t at,"])
        out.line("                       const void *const *given, void *result)")
        with out.block("{"):
            out.line("const uint8_t active = certify_leave();")
            out.lines(["(void)given;", "(void)result;", "certify_put8(CERTIFY_CALLED);"])
            out.lines([f"certify_put8({number}u);", "certify_put8((uint8_t)is_own);"])
            out.line("certify_put16((uint16_t)at);")
            with out.block("switch (at) {"):
                for index, operation in enumerate(each.chart.operations):
                    out.line(f"case {index}u:")
                    _given(out, operation.parameters, each)
                    if operation.result is not None:
                        text = storage(operation.result, each.records).text
                        _take(out, f"(*({text} *)result)", operation.result, each)
                    out.line("break;")
                out.lines(["default:", "break;"])
            out.lines(["fsm_call_back();", "certify_enter(active);"])
        out.lines(["", f"static void fsm_send_{number}(bool is_own, uint32_t at,"])
        out.line("                       const void *const *given)")
        with out.block("{"):
            out.line("const uint8_t active = certify_leave();")
            out.lines(["(void)given;", "certify_put8(CERTIFY_SENT);"])
            out.lines([f"certify_put8({number}u);", "certify_put8((uint8_t)is_own);"])
            out.line("certify_put16((uint16_t)at);")
            with out.block("switch (at) {"):
                for index in sent_events(each.chart):
                    out.line(f"case {index}u:")
                    _given(out, each.chart.events[index].fields, each)
                    out.line("break;")
                out.lines(["default:", "break;"])
            out.lines(["fsm_call_back();", "certify_enter(active);"])
        out.lines(["", "#undef FSM_HOST_CALL", "#undef FSM_HOST_SEND"])
        call = f"fsm_call_{number}((m) == &{place}, operation, given, result)"
        out.line(f"#define FSM_HOST_CALL(m, operation, given, result) {call}")
        send = f"fsm_send_{number}((m) == &{place}, event, given)"
        out.line(f"#define FSM_HOST_SEND(m, event, given) {send}")
        print_host(out, each)


def _perform(out: Emitter, names: Names) -> None:
    p, does = names.prefix, names.does
    out.text(f"""
    uint32_t certify_perform(uint8_t action, uint32_t now)
    {{
        uint32_t found = 0u;
        fsm_now = now;
        switch (action) {{
        case CERTIFY_START:
            CERTIFY({p}_start(&fsm_machine, now));
            break;
    #ifndef CERTIFY_WITHOUT_DISPATCH
        case CERTIFY_DISPATCH:
            fsm_read_event(&fsm_event);
            CERTIFY(found = (uint32_t){p}_dispatch(&fsm_machine, &fsm_event, now));
    """)
    reply = reply_type(names.chart)
    if reply is not None:
        with out.block("        if (found <= FSM_HANDLED) {"):
            _put(out, "fsm_machine.fsm.reply", reply, names)
    out.lines(["        break;", "#endif"])
    if does.queued:
        out.text("""
            #if !defined CERTIFY_WITHOUT_POST && !defined CERTIFY_WITHOUT_RUN
            case CERTIFY_POST: {
                const uint8_t count = certify_take8();
                for (uint8_t i = 0u; i < count; i++) {
                    bool fits;
                    fsm_read_event(&fsm_event);
        """)
        out.line(f"            CERTIFY(fits = {p}_post(&fsm_machine, &fsm_event));")
        out.text(f"""
                    found |= (uint32_t)fits << i;
                }}
                CERTIFY({p}_run(&fsm_machine, now));
                break;
            }}
            #endif
        """)
    if does.runs:
        out.text(f"""
            #ifndef CERTIFY_WITHOUT_RUN
            case CERTIFY_RUN:
                CERTIFY({p}_run(&fsm_machine, now));
                break;
            #endif
        """)
    for step in single_steps(names):
        out.text(f"""
        #ifndef CERTIFY_WITHOUT_{step.upper()}
        case CERTIFY_{step.upper()}:
            CERTIFY(found = {p}_{step}(&fsm_machine));
            break;
        #endif
        """)
    out.text(f"""
    #ifndef CERTIFY_WITHOUT_REBASE
        case CERTIFY_REBASE:
            CERTIFY({p}_rebase(&fsm_machine, now));
            break;
    #endif
        default:
            fsm_look();
            break;
        }}
    """)
    if counts(names):
        out.line("    certify_put16(fsm_machine.fsm.unhandled);")
        if does.queued:
            out.line("    certify_put16(fsm_machine.fsm.rejected);")
    out.text("""
        return found;
    }
    """)


def _saving(out: Emitter, names: Names) -> None:
    """Print what only this computer does: restoring a state, saving the machine of each answer."""
    p, upper = names.prefix, names.upper
    out.text(f"""

    #ifdef CERTIFY_HOST
    extern uint8_t certify_saved[];
    extern uint32_t certify_saved_size;
    uint32_t certify_restore(uint32_t now, const uint8_t *bytes, uint32_t size);

    uint32_t certify_restore(uint32_t now, const uint8_t *bytes, uint32_t size)
    {{
        {p}_init(&fsm_state);
        return (uint32_t){p}_restore(&fsm_state, now, bytes, size);
    }}

    void certify_after(uint32_t now)
    {{
        uint8_t *saved = certify_saved + certify_saved_size;
        saved[0] = (uint8_t)!{p}_save(&fsm_machine, now, saved + 1);
        certify_saved_size += {upper}_SAVED_BYTES + 1u;
    }}
    #else
    void certify_after(uint32_t now)
    {{
        (void)now;
    }}
    #endif
    """)


def _scalars(type_: lang.Type, names: Names, path: str = "") -> Iterator[tuple[str, lang.Type]]:
    """Yield the scalar parts of a type with their C paths, in the order of `plan.image`."""
    match type_:
        case lang.ArrayType(element, length):
            for place in range(length):
                yield from _scalars(element, names, f"{path}[{place}]")
        case lang.RecordType(_, fields):
            for part in fields:
                yield from _scalars(part.type, names, f"{path}.{names.field(part.name)}")
        case _:
            yield path, type_


def _given(out: Emitter, fields: tuple[lang.Field, ...], names: Names) -> None:
    """Print the statements that put the arguments of a call into the trace."""
    for number, part in enumerate(fields):
        text = storage(part.type, names.records).text
        pointer = f"((const {text} *)given[{number}])"
        place = pointer if isinstance(part.type, lang.ArrayType) else f"(*{pointer})"
        _put(out, place, part.type, names)


def _put(out: Emitter, place: str, type_: lang.Type, names: Names) -> None:
    for path, scalar in _scalars(type_, names):
        at = f"{place}{path}"
        if isinstance(scalar, lang.FloatType):
            kind = "float" if scalar.bits == 32 else "double"
            out.line(f"certify_put_{kind}({at});")
        else:
            bits = _bits(scalar)
            out.line(f"certify_put{bits}((uint{bits}_t){at});")


def _take(out: Emitter, place: str, type_: lang.Type, names: Names) -> None:
    """Print the statements that take a value from the request; an array's place is its first."""
    for path, scalar in _scalars(type_, names):
        at = f"{place}{path}"
        text = storage(scalar, names.records).text
        if isinstance(scalar, lang.FloatType):
            kind = "float" if scalar.bits == 32 else "double"
            out.line(f"{at} = certify_take_{kind}();")
        elif isinstance(scalar, lang.BoolType):
            out.line(f"{at} = certify_take8() != 0u;")
        else:
            out.line(f"{at} = ({text})certify_take{_bits(scalar)}();")


def _bits(scalar: lang.Type) -> int:
    """Return the bits of a scalar that is no float, in requests and answers."""
    return 16 if isinstance(scalar, lang.SymbolType) else SIZES[code(scalar).lower()]
