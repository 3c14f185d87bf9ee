"""Print the binding of a generated machine to the search: its table as a ``fsm_machine``.

``core/system/machine.c`` drives a machine by its description (``fsm_info.h``) and by this table,
which holds the additional facts of an exploration. The source of an invoked machine is compiled
within its own file, with hooks of its own.
"""

from __future__ import annotations

import struct
from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

import fsmkit.language as lang
from fsmkit.chart.chart import Chart
from fsmkit.chart.walk import charts_within
from fsmkit.codegen.c.generate import Machine
from fsmkit.codegen.c.host import print_host
from fsmkit.codegen.c.layout import OWN
from fsmkit.codegen.c.names import Names
from fsmkit.codegen.c.options import COMPILING, Options, read_options
from fsmkit.emit import Emitter, plain, printing, snake
from fsmkit.emit.c import comment, quoted
from fsmkit.system.machine import OBSERVED
from fsmkit.system.properties.kinds.monitor import sampling_event
from fsmkit.system.shared import has_data_trigger, resting_states, type_of_slot
from fsmkit.verify.engines.c.shapes import Shape
from fsmkit.verify.statespace.closed_system import ClosedSystem, is_watchdog
from fsmkit.verify.statespace.spread import Kind, parts_of

MOST_STRAIGHT = 256
"""States of a machine up to which its straight code is explored, as it is by default."""
MOST_VALUES = 32
"""Scalars in one message: FSM_MOST_VALUES of core/system/recorder.h."""
MOST_SHARED = 64
"""Values of a shared variable up to which it can be a level (core/symbolic/split.h)."""
LONGEST_NAME = 60
COLUMNS = 16

WAITING = {
    Kind.QUEUE: ("deferred", "deferred_count", "queue", "queue_count"),
    Kind.TIMERS: ("delayed", "delayed_count", "timer_count", "timers"),
}
"""The members of a generated struct that hold what waits; it is gone where a machine stops."""
EMPTY = ("NULL", "0", "0u", "false")
"""Values that a member has unless it is given another."""
CLEARED = ("asked", "budget", "busy", "failed", "now", "rejected", "reply", "unhandled")
"""Those that are no state."""


@dataclass(frozen=True, slots=True)
class BoundMachine:
    """A machine in the binding: its C names, and the members of its struct."""

    number: int
    chart: Chart
    own: str
    """Its C name, distinct from others of its shape."""
    names: Names
    members: frozenset[str]
    constants: tuple[int, ...] = ()
    """Values of the last inputs of its struct, see `Shape`."""

    @property
    def prefix(self) -> str:
        """The prefix of its functions, which all machines of its shape share."""
        return self.names.prefix


def prefix_of(number: int, name: str) -> str:
    """Return the prefix under which a machine of a system is generated for exploration.

    It also names files, so it is short enough for a file system whatever the machine's name is.
    """
    return f"m{number}_{snake(name)[:LONGEST_NAME]}"


def options_for(chart: Chart, *, observes_reads: bool = False) -> Options:
    """Return the options with which a chart is generated for exploration.

    A compiler takes minutes for straight code of thousands of states, and seconds for tables.
    ``observes_reads``: inputs are chosen when they are read, see `ClosedSystem.read_inputs`.
    """
    states = sum(len(one.states) for one in charts_within(chart))
    aim = {"optimize": COMPILING} if states > MOST_STRAIGHT else {}
    return replace(read_options({"with": "info", **aim}), observes_reads=observes_reads)


def bind(
    closed: ClosedSystem, shape: Shape, generated: Machine
) -> tuple[list[BoundMachine], dict[str, str]]:
    """Return the machines of a shape, and the files of them and of their invoked machines."""
    files = dict(generated.files)
    prefix = generated.names.prefix
    files[f"{prefix}_info.inc"] = files.pop(f"{prefix}_info.c")
    *invoked, (names, members) = generated.family
    for inner, its_members in invoked:
        session = BoundMachine(shape.machines[0], inner.chart, inner.prefix, inner, its_members)
        files[f"{inner.prefix}.inc"] = files.pop(f"{inner.prefix}.c")
        files[f"explore_{inner.prefix}.c"] = _session_file(closed, session)
    built = [
        BoundMachine(number, closed.charts[number], own, names, members, constants)
        for number, constants in zip(shape.machines, shape.values, strict=True)
        for own in (prefix_of(number, closed.system.machines[number].name),)
    ]
    files[f"explore_{prefix}.c"] = _machines_file(closed, built)
    return built, files


# --- values ---------------------------------------------------------------------------------------


def scalars_of(names: Names, type_: lang.Type, value: lang.Value) -> Iterator[str]:
    """Yield the scalars of a value, in order, as ``fsm_value``."""
    match type_, value:
        case lang.ArrayType(element), tuple():
            for part in value:
                yield from scalars_of(names, element, part)
        case lang.RecordType(_, fields), tuple():
            yield from payload_of(names, fields, value)
        case lang.FloatType(), int() | float():
            yield _integer(struct.unpack("<q", struct.pack("<d", float(value)))[0])
        case lang.SymbolType(), str():
            yield str(names.symbol(value))
        case _:
            assert isinstance(value, int)  # noqa: S101  (all other scalars are integers)
            yield _integer(int(value))


def payload_of(
    names: Names, fields: Sequence[lang.Field], values: Sequence[lang.Value]
) -> list[str]:
    """Return the scalars of the fields of an event or a record."""
    pairs = zip(fields, values, strict=True)
    return [text for field, value in pairs for text in scalars_of(names, field.type, value)]


def _integer(value: int) -> str:
    if value >= 2**63:
        value -= 2**64
    return f"INT64_C({value})" if value > -(2**63) else "INT64_MIN"


# --- the tables -----------------------------------------------------------------------------------


@printing
def _machines_file(closed: ClosedSystem, built: Sequence[BoundMachine]) -> str:
    """Return the tables of the machines of a shape; the recorder selects the running one."""
    out, names = Emitter(), built[0].names
    out.line(f"/* The explorer's tables of `{comment(names.chart.name)}`. */")
    out.lines([f'#include "{names.prefix}.h"', '#include "system/machine.h"'])
    out.line(f'#include "{names.prefix}_info.inc"')
    inner = [f"fsm_machine_{within.prefix}" for within in names.invoked]
    out.lines(f"extern const fsm_machine {name};" for name in inner)
    out.lines(["#define FSM_THIS (fsm_recording.machine)", ""])
    out.line(f"static {names.prefix} initial[{len(built)}];")
    out.line(f"FSM_DEFINE_STEPS({names.prefix})")
    if any(_tries(closed, machine) for machine in built):
        out.line(f"FSM_DEFINE_EVENTLESS({names.prefix})")
    print_host(out, names)
    printed: dict[tuple[str, ...], str] = {}
    for place, machine in enumerate(built):
        _Binding(closed, machine, out, printed, is_outer=True).print(place)
    return out.finish()


@printing
def _session_file(closed: ClosedSystem, built: BoundMachine) -> str:
    """Return the table of a machine in a slot, with its code, which has hooks of its own."""
    out, p = Emitter(), built.prefix
    path = quoted(_path_of(built.names))
    out.line(f"/* The explorer's tables of `{comment(built.chart.name)}`. */")
    out.lines([f'#include "{p}.h"', '#include "system/machine.h"'])
    out.lines([f"#define FSM_PATH {path}", '#include "system/inner_hooks.h"'])
    out.lines([f'#include "{p}.inc"', f"extern const fsm_machine_info {p}_info;"])
    inner = [f"fsm_machine_{names.prefix}" for names in built.names.invoked]
    out.lines(f"extern const fsm_machine {name};" for name in (*inner, f"fsm_machine_{p}"))
    out.lines([f"#define FSM_THIS (&fsm_machine_{p})", "", f"static {p} initial[1];"])
    print_host(out, built.names)
    _Binding(closed, built, out, {}, is_outer=False).print(0)
    return out.finish()


def _path_of(names: Names) -> str:
    return "".join(f"{plain(slot)}: " for slot in names.path)


def _tries(closed: ClosedSystem, built: BoundMachine) -> bool:
    return has_data_trigger(closed.system.machines[built.number], built.chart)


class _Binding:
    """Prints the tables of one machine, except those that are ``printed`` in the file already."""

    def __init__(
        self,
        closed: ClosedSystem,
        built: BoundMachine,
        out: Emitter,
        printed: dict[tuple[str, ...], str],
        *,
        is_outer: bool,
    ) -> None:
        self._closed, self._built = closed, built
        self._names, self._chart = built.names, built.chart
        self._machine = closed.system.machines[built.number]
        self._is_outer = is_outer
        self._out = out
        self._printed = printed

    def print(self, place: int) -> None:
        """Print the tables and the ``fsm_machine`` with that index in the file."""
        inner = [f"&fsm_machine_{names.prefix}" for names in self._names.invoked]
        table: dict[str, object] = {
            "path": quoted(_path_of(self._names)),
            "info": f"&{self._built.prefix}_info",
            "inner": self._table("fsm_machine *const", "inner", inner),
            "initial": f"&initial[{place}]",
        }
        table |= self._common() | (self._outermost() if self._is_outer else {})
        with self._out.block(f"const fsm_machine fsm_machine_{self._built.own} = {{", "};"):
            given = {name: value for name, value in table.items() if str(value) not in EMPTY}
            self._out.lines(f".{name} = {value}," for name, value in given.items())

    def _table(self, ctype: str, name: str, rows: Sequence[object]) -> str:
        """Print an array, unless it exists; return its name, or NULL if it is empty."""
        if not rows:
            return "NULL"
        key = (ctype, *map(str, rows))
        if key not in self._printed:
            self._printed[key] = f"{name}_{len(self._printed)}"
            with self._out.block(f"static const {ctype} {self._printed[key]}[] = {{", "};"):
                for at in range(0, len(rows), COLUMNS):
                    self._out.line(", ".join(map(str, rows[at : at + COLUMNS])) + ",")
        return self._printed[key]

    def _flags(self, name: str, flags: Iterable[bool]) -> str:
        """Print a table of bytes; NULL if none is set."""
        listed = [int(flag) for flag in flags]
        return self._table("unsigned char", name, listed if any(listed) else [])

    def _spans(self, name: str, members: Iterable[tuple[int, str]]) -> dict[str, object]:
        """Print the offsets of members, each with its part; only members that the struct has."""
        p = self._built.prefix
        rows = [
            f"{{{part}u, offsetof({p}, {member}), sizeof((({p} *)0)->{member})}}"
            for part, member in members
        ]
        listed = self._table("fsm_span", name, rows)
        return {name: listed, f"{name.removesuffix('s')}_count": len(rows)}

    def _choices(
        self, name: str, variable: int, type_: lang.Type, values: Iterable[lang.Value]
    ) -> str:
        """Print values; return the ``fsm_choices``."""
        listed = list(values)
        texts = [text for value in listed for text in scalars_of(self._names, type_, value)]
        return f"{{{variable}u, {len(listed)}u, {self._table('fsm_value', name, texts)}}}"

    def _of(self, names: Iterable[str]) -> list[tuple[int, str]]:
        paths = (f"{OWN}.{name}" for name in names)
        return [(0, path) for path in paths if path in self._built.members]

    # --- for each machine ---------------------------------------------------------------------

    def _common(self) -> dict[str, object]:
        closed, chart = self._closed, self._chart
        rests = resting_states(chart, self._machine)
        silent = (closed.silent and is_watchdog(chart, t) for t in chart.transitions)
        waiting = [name for members in WAITING.values() for name in members]
        restless = [int(s.index > 0 and s.is_leaf and s.index not in rests) for s in chart.states]
        return {
            "untimed": _bool(closed.untimed),
            "zones": _bool(closed.zones),
            "is_channel": _bool(self._machine.is_channel),
            "resets_inputs": _bool(
                closed.is_open and len(closed.kept_inputs) < len(self._machine.chart.inputs)
            ),
            "restless": self._table("unsigned char", "restless", restless),
            "silent": self._flags("silent", silent),
            "deferring": self._deferring(),
            **self._spans("cleared", self._of(CLEARED)),
            **self._spans("stopped", self._of(waiting)),
            **self._host(),
        }

    def _deferring(self) -> str:
        """Print by event the states that defer it."""
        rows = []
        for event in self._chart.events:
            states = [s.index for s in self._chart.states if event.index in s.defer]
            listed = self._table("uint16_t", f"deferring_{event.index}", states)
            rows.append(f"{{{listed}, {len(states)}u}}")
        is_deferring = f"{OWN}.deferred_count" in self._built.members
        return self._table("fsm_number_list", "deferring", rows if is_deferring else [])

    def _host(self) -> dict[str, object]:
        """Print the results of operations, and the starts of wires: none for an invoked machine."""
        chart = self._chart
        first = len((self._machine.chart if self._is_outer else chart).events)
        ports = range(max(len(chart.events), first + len(chart.operations)))
        answers = []
        for place, operation in enumerate(chart.operations):
            values: tuple[lang.Value, ...] = ()
            if operation.result is not None:
                values = self._closed.results[self._built.number][operation.name]
            result = operation.result or lang.FloatType(64)
            answers.append(self._choices(f"answers_{place}", 0, result, values))
        return {
            "first_port": f"{first}u",
            "linked": self._table("unsigned char", "linked", [int(self._links(n)) for n in ports]),
            "answers": self._table("fsm_choices", "answers", answers),
        }

    def _links(self, port: int) -> bool:
        begin = self._built.number, port
        links = self._closed.system.event_links
        return self._is_outer and any((link.source, link.port) == begin for link in links)

    # --- for the outermost machine ---------------------------------------------------------------

    def _outermost(self) -> dict[str, object]:
        closed, chart, machine = self._closed, self._chart, self._machine
        p, number = self._built.prefix, self._built.number
        own = 0 if machine.is_monitor else len(machine.chart.events)
        noted = [int(n < own and bool(event.directions)) for n, event in enumerate(chart.events)]
        asked = closed.observed_events
        look = sampling_event(chart)
        is_interval = any(t.least is not None for t in chart.transitions)
        slack = [0 if t.least is None else t.delay - t.least for t in chart.transitions]
        return {
            "name": quoted(machine.name),
            "environment": _bool(machine.environment),
            "monitor": _bool(machine.is_monitor),
            "covered": len(chart.transitions) if closed.covers else 0,
            "microsteps": f"{self._names.upper}_MICROSTEPS",
            "look": "UINT32_MAX" if look is None else look,
            "noted": self._table("unsigned char", "noted", noted),
            "by_property": self._flags(
                "by_property", ((number, n) in asked for n in range(len(noted)))
            ),
            "by_monitor": self._flags(
                "by_monitor", (self._links(OBSERVED + n) for n in range(len(noted)))
            ),
            "slack": self._table("uint32_t", "slack", slack if is_interval else []),
            **self._variables(),
            **self._parts(),
            "driver": f"&{p}_driver",
            "take": "take",
            "fire_first": "fire_first",
            "eventless": "eventless" if _tries(closed, self._built) else "NULL",
            "rebase": "rebase",
        }

    def _variables(self) -> dict[str, object]:
        """Print the wired, chosen and reset variables."""
        closed, chart = self._closed, self._chart
        places = {v.name: n for n, v in enumerate((*chart.data, *chart.outputs, *chart.inputs))}
        whole = {name: f"{{{place}u, UINT32_MAX}}" for name, place in places.items()}
        shared = [
            whole[s.name] if s.element is None else f"{{{places[s.name]}u, {s.element}u}}"
            for s in self._machine.shared
        ]
        inputs = [whole[v.name] for v in chart.inputs]
        first = len(places)
        constants = [f"{{{first + n}u, UINT32_MAX}}" for n in range(len(self._built.constants))]
        outputs = [whole[v.name] for v in chart.outputs]
        first = len(chart.data) + len(chart.outputs)
        free = [
            self._choices(f"free_{n}", first + n, chart.inputs[n].type, one.values)
            for one in closed.free_inputs
            for n in (one.input,)
        ]
        resettable = closed.mortal[self._built.number] if closed.mortal else ()
        reset = [
            f"{{{one.data}u, {self._set_of(f'live_{one.data}', one.live)}}}" for one in resettable
        ]
        data = [whole[v.name] for v in chart.data]
        return {
            "inputs": self._table("fsm_slot_of", "inputs", [*inputs, *constants, *shared]),
            "constants": self._table(
                "fsm_value", "constants", [_integer(value) for value in self._built.constants]
            ),
            "constant_count": len(constants),
            "outputs": self._table("fsm_slot_of", "outputs", [*outputs, *shared, *data]),
            "shared_count": len(shared),
            "shared_ranges": self._table("fsm_range", "shared_ranges", list(self._ranges())),
            "free_inputs": self._table("fsm_choices", "free_inputs", free),
            "free_count": len(free),
            "kept_inputs": self._flags(
                "kept_inputs", (n in closed.kept_inputs for n in range(len(inputs)))
            ),
            "read_inputs": self._table(
                "uint16_t",
                "read_inputs",
                [closed.read_inputs.get(n, -1) + 1 for n in range(len(inputs))]
                if closed.read_inputs
                else [],
            ),
            "resettable": self._table("fsm_resettable", "resettable", reset),
            "resettable_count": len(reset),
        }

    def _ranges(self) -> Iterator[str]:
        """Yield for each shared variable its minimum, and its number of values if that is small."""
        for slot in self._machine.shared:
            match type_of_slot(self._chart, slot):
                case lang.BoolType():
                    yield "{0, 2u}"
                case lang.EnumType(_, members) if len(members) <= MOST_SHARED:
                    yield f"{{0, {len(members)}u}}"
                case lang.IntType(lo, hi) if hi - lo < MOST_SHARED:
                    yield f"{{{_integer(lo)}, {hi - lo + 1}u}}"
                case _:
                    yield "{0, 0u}"

    def _set_of(self, name: str, states: Collection[int]) -> str:
        """Print a set of states, a bit for each."""
        bits = bytearray(len(self._chart.states) // 8 + 1)
        for state in states:
            bits[state // 8] |= 1 << state % 8
        return self._table("unsigned char", name, list(bits))

    def _parts(self) -> dict[str, object]:
        """Print the bytes that belong to each part."""
        names, chart = self._names, self._chart
        variables = {
            Kind.INPUT: chart.inputs, Kind.DATA: chart.data, Kind.OUTPUT: chart.outputs,
        }  # fmt: skip
        parts = parts_of(chart)
        rows: list[tuple[int, str]] = []
        for number, part in enumerate(parts):
            if part.kind in variables:
                found = [names.variables[variables[part.kind][part.index].name]]
            elif part.kind is Kind.INVOKED:
                found = [names.slots[part.index]]
            else:
                found = [path for _, path in self._of(WAITING[part.kind])]
            rows += [(number, member) for member in found]
        return {**self._spans("spans", rows), "part_count": len(parts)}


def _bool(value: bool) -> str:
    return str(value).lower()
