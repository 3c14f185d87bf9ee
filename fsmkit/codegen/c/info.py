"""The source with the description of a machine: a constant table for every tool that runs machines.

It is a separate file, so a program that does not use the table does not contain it. Offsets are
``offsetof`` and ``sizeof`` expressions, which the compiler evaluates.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence, Sized

import fsmkit.language as lang
from fsmkit.chart.analysis.host_events import posted_events, sent_events
from fsmkit.chart.statements import Destination
from fsmkit.codegen.c.expressions.content import ROUTES
from fsmkit.codegen.c.expressions.types import integer, interval
from fsmkit.codegen.c.header import NOTICE
from fsmkit.codegen.c.layout import OWN, reply_type
from fsmkit.codegen.c.names import Names
from fsmkit.codegen.c.storage import storage
from fsmkit.document.document import Kind, Trigger
from fsmkit.emit import Emitter
from fsmkit.emit.c import comment, quoted
from fsmkit.plan.image import Image, head, image_of, scalars

SAVING = """
bool @_save(const @ *m, uint32_t now, uint8_t *bytes)
{
    return fsm_save(&@_info, m, now, bytes);
}

fsm_restored @_restore(@ *m, uint32_t now, const uint8_t *bytes, size_t size)
{
    const fsm_restored found = fsm_restore(&@_info, m, now, bytes, size);
~#ifdef FSM_LOGGED
~    if (found == FSM_RESTORED)
~        fsm_log_restored((uint16_t)FSM_INSTANCE(m), now, bytes, size);
~#endif
%#if defined FSM_TRACE_LEVEL && FSM_TRACE_LEVEL > 0
%    if (found == FSM_RESTORED)
%        fsm_@_restored(m, now);
%#endif
    return found;
}
"""
"""Lines with ``~`` are for a machine that may be logged, lines with ``%`` for a recorded one."""

LONGEST_LITERAL = 4095
"""The length in characters of a string literal that every C99 compiler accepts (5.2.4.1)."""
UNPRINTED = 0xFFFF
"""The number for an item that the machine never uses."""
KINDS = {
    Kind.COMPOUND: "FSM_COMPOUND",
    Kind.PARALLEL: "FSM_PARALLEL",
    Kind.FINAL: "FSM_FINAL",
}
"""The kinds of states in the table; all other states are atomic."""

LISTS = ("routes", "marks", "peers", "texts")
Route = tuple[Destination, tuple[int, ...]]
Machines = Sequence[tuple[Names, frozenset[str]]]
"""Names, and the member paths of each machine."""


def info_source(machines: Machines) -> str:
    """Return the source for machines; those in slots precede those that hold them."""
    names = machines[-1][0]
    extras = names.options.extras
    out = Emitter()
    out.line(f"/* {names.prefix}_info.c: describes {comment(names.chart.name)}. {NOTICE} */")
    out.line(f'#include "{names.prefix}.h"')
    library = {"save": "fsm_save.h", "trace": "fsm_trace.h"}
    used = [file for extra, file in library.items() if extra in extras] or ["fsm_info.h"]
    out.lines([*(f'#include "{file}"' for file in used), ""])
    for each, members in machines:
        _Table(out, each, members).print()
    if "save" in extras:
        marks = {"~": "trace", "%": "records"}
        if "records" in extras:
            out.lines([f"void fsm_{names.prefix}_restored({names.prefix} *m, uint32_t now);", ""])
        lines = SAVING.strip("\n").replace("@", names.prefix).split("\n")
        kept = (line for line in lines if marks.get(line[:1], "save") in extras)
        out.lines(line.lstrip("~%") for line in kept)
    return out.finish()


def row(*members: object) -> str:
    """Return an initializer in the order of the struct, which C and C++ take alike."""
    return f"{{{', '.join(map(str, members))}}},"


class _Table:
    """Prints the tables of one machine; their names differ from all names of a chart."""

    def __init__(self, out: Emitter, names: Names, members: frozenset[str]) -> None:
        self._out = out
        self._names = names
        self._chart = names.chart
        self._members = members
        self._image: Image = image_of(names.chart)
        self._own = f"fsm_{names.prefix}"
        self._types: dict[lang.Type, int] = {}
        self._texts = 0
        self._reply = reply_type(names.chart)

    def print(self) -> None:
        chart, names, p = self._chart, self._names, self._names.prefix
        events = [(f"event_{event.index}", event) for event in chart.events]
        operations = list(enumerate(chart.operations))
        variables = (*chart.data, *chart.outputs, *chart.inputs)
        self._print_types(
            *(v.type for v in variables),
            *(part.type for event in chart.events for part in event.fields),
            *(event.reply for event in chart.events if event.reply is not None),
            *(part.type for _, o in operations for part in o.parameters),
            *(o.result for _, o in operations if o.result is not None),
            *([self._reply] if self._reply is not None else []),
        )
        self._array(
            "fsm_field",
            "variables",
            [self._field(v.name, v.type, f"{p}, {names.variables[v.name]}") for v in variables],
        )
        for name, event in events:
            self._fields(name, event.fields, f"{p}_event, of.{names.payloads[event.index]}.")
        for number, operation in operations:
            self._fields(f"operation_{number}", operation.parameters, "")
        self._events()
        self._array(
            "fsm_operation_info",
            "operations",
            [
                row(
                    self._text(o.name),
                    self._name(f"operation_{number}", o.parameters),
                    self._type(o.result),
                    len(o.parameters),
                )
                for number, o in operations
            ],
        )
        self._states()
        self._timeouts()
        self._numbers()
        self._array("fsm_slot", "slots", list(self._slots(names, "", f"{p}, ")))
        self._functions()
        self._info()

    # --- parts of tables ------------------------------------------------------------------

    def _name(self, name: str, content: Sized) -> str:
        """Return the name of an array, or NULL if it is empty."""
        return f"{self._own}_{name}" if content else "NULL"

    def _array(self, ctype: str, name: str, rows: Sequence[str]) -> None:
        if rows:
            with self._out.block(f"static const {ctype} {self._own}_{name}[] = {{", "};"):
                self._out.lines(rows)
            self._out.line()

    def _text(self, text: str) -> str:
        """Return an optional text as an expression; one longer than a literal is declared."""
        content = text.encode()
        if len(content) <= LONGEST_LITERAL:
            return f"FSM_TEXT({quoted(text)})"
        name = f"{self._own}_text_{self._texts}"
        self._texts += 1
        with self._out.block(f"static const char {name}[] = {{", "};"):
            for at in range(0, len(content), 12):
                self._out.line(" ".join(f"'\\{byte:03o}'," for byte in content[at : at + 12]))
            self._out.line("'\\0',")
        return f"FSM_TEXT({name})"

    def _field(self, name: str, type_: lang.Type, place: str) -> str:
        offset = f"offsetof({place})" if place else 0
        return row(self._text(name), self._type(type_), offset)

    def _fields(self, name: str, fields: Sequence[lang.Field], holder: str) -> None:
        """Print fields; with a ``holder``, they have offsets in it."""
        places = [holder and holder + self._names.field(part.name) for part in fields]
        pairs = zip(fields, places, strict=True)
        self._array("fsm_field", name, [self._field(f.name, f.type, place) for f, place in pairs])

    def _offset(self, member: str) -> str:
        """Return the offset of an optional member."""
        if member not in self._members:
            return "FSM_ABSENT"
        return f"offsetof({self._names.prefix}, {member})"

    # --- types ----------------------------------------------------------------------------

    def _declare(self, type_: lang.Type) -> None:
        """Assign a number to a type, after the types of its parts."""
        match type_:
            case lang.ArrayType(element, _):
                self._declare(element)
            case lang.RecordType(_, fields):
                for part in fields:
                    self._declare(part.type)
            case _:
                pass
        self._types.setdefault(type_, len(self._types))

    def _type(self, type_: lang.Type | None) -> str:
        return "NULL" if type_ is None else f"&{self._own}_type_{self._types[type_]}"

    def _print_types(self, *types: lang.Type) -> None:
        for type_ in types:
            self._declare(type_)
        for type_, number in self._types.items():
            members, fields, element, numbers, count = "NULL", "NULL", "NULL", "NULL", 0
            match type_:
                case lang.RecordType(name, parts):
                    self._fields(f"record_{number}", parts, f"{self._names.records[name]}, ")
                    fields, count = self._name(f"record_{number}", parts), len(parts)
                case lang.EnumType(_, texts):
                    listed = [f"{self._text(text)}," for text in texts]
                    self._array("char *const", f"members_{number}", listed)
                    members, count = f"{self._own}_members_{number}", len(texts)
                    if not type_.is_counted:
                        listed = [f"{integer(n, 'int32_t')}," for n in type_.numbers]
                        self._array("int32_t", f"numbers_{number}", listed)
                        numbers = f"{self._own}_numbers_{number}"
                case lang.ArrayType(of, length):
                    element, count = self._type(of), length
                case _:
                    pass
            many = sum(1 for _ in scalars(type_))
            of_parts = (*bounds(type_), element, fields, members, numbers)
            initial = row(kind_of(type_), self._size(type_), count, f"{many}u", *of_parts)
            self._out.line(
                f"static const fsm_type {self._own}_type_{number} = {initial.removesuffix(',')};"
            )
        self._out.line()

    def _size(self, type_: lang.Type) -> str:
        if isinstance(type_, lang.ArrayType):
            return f"{self._size(type_.element)} * {type_.length}u"
        return f"sizeof({storage(type_, self._names.records).text})"

    # --- what the machine has -------------------------------------------------------------

    def _events(self) -> None:
        flagged: dict[str, Collection[int]] = {
            "FSM_EVENT_IN": posted_events(self._chart),
            "FSM_EVENT_OUT": sent_events(self._chart),
            "FSM_EVENT_NAMED": set(self._chart.event_index.values()),
        }
        rows = []
        for event in self._chart.events:
            flags = [flag for flag, of in flagged.items() if event.index in of]
            rows.append(
                row(
                    self._text(event.name),
                    self._name(f"event_{event.index}", event.fields),
                    self._type(event.reply),
                    len(event.fields),
                    " | ".join(flags) or 0,
                )
            )
        self._array("fsm_event_info", "events", rows)

    def _states(self) -> None:
        names, plan = self._names, self._names.plan
        rows = []
        for state in self._chart.states:
            around = plan.parents[state.index]
            parent = names.states[around] if state.index else "FSM_NO_NUMBER"
            if state.is_history:
                rows.append(row(self._text(state.id), "FSM_HISTORY", parent, 0, 0))
                continue
            kind = KINDS.get(state.kind, "FSM_ATOMIC")
            last = names.states[plan.last_below[state.index]]
            region = plan.region_of[state.index]
            rows.append(row(self._text(state.id), kind, parent, region, last))
        self._array("fsm_state_info", "states", rows)

    def _timeouts(self) -> None:
        rows = [
            row(
                f"{t.delay}u",
                f"{t.delay if t.least is None else t.least}u",
                t.index,
                self._names.states[t.source],
                str(t.trigger is Trigger.EVERY).lower(),
            )
            for t in self._chart.transitions
            if t.has_timer
        ]
        self._array("fsm_timeout_info", "timeouts", rows)

    def _numbers(self) -> None:
        """Print the offsets of the numbers of regions and of histories."""
        names, image = self._names, self._image
        shared = names.shared
        rows = []
        for region in image.plan.regions:
            kind = "FSM_ACTIVE_OF_BOTH" if region.index in shared else "FSM_PLAIN"
            member = names.regions[region.index]
            rows.append(self._number(member, region.index, kind, "FSM_NO_NUMBER", None))
        for history, of in image.histories:
            kind = "FSM_RECORDED_OF_BOTH" if shared.get(of) == history else "FSM_PLAIN"
            member = names.recorded(history, of)
            is_unread = image.plan.is_forgotten(history) and member in self._members
            is_cleared = is_unread and kind == "FSM_PLAIN"
            where = names.states[image.plan.parents[history]] if is_cleared else "FSM_NO_NUMBER"
            rows.append(self._number(member, of, kind, where, history))
        self._array("fsm_number", "numbers", rows)

    def _number(self, member: str, region: int, kind: str, state: str, history: int | None) -> str:
        size = f"sizeof({self._names.number_type(region)})"
        number = "FSM_NO_NUMBER" if history is None else history
        is_deep = history is not None and self._chart.states[history].kind is Kind.DEEP_HISTORY
        return row(self._offset(member), size, region, kind, state, number, str(is_deep).lower())

    def _slots(self, names: Names, path: str, holder: str) -> Iterator[str]:
        """Yield the machines in slots, each before those within it."""
        for inner, slot, invocation in zip(
            names.invoked, names.slots, names.chart.invocations, strict=True
        ):
            within = list(self._slots(inner, f"{path}{slot}.", holder))
            place = f"offsetof({holder}{path}{slot})"
            info = f"&{inner.prefix}_info"
            yield row(info, self._text(invocation.id), place, len(within))
            yield from within

    def _functions(self) -> None:
        out, p, names = self._out, self._names.prefix, self._names
        out.line(f"FSM_DEFINE_INIT({p})")
        if not names.is_invoked:
            known = {"POST": names.does.queued, "RUN": names.does.runs}
            known |= {"SAVE": "save" in names.options.extras}
            out.line(f"FSM_DEFINE_DRIVER({p})")
            out.lines(f"FSM_DEFINE_{verb}({p})" for verb, is_there in known.items() if is_there)
        out.line()

    # --- the whole ------------------------------------------------------------------------

    def _list(self, member: str, room: int) -> str:
        count = "timer_count" if member == "timers" else f"{member}_count"
        places = (self._offset(f"{OWN}.{name}") for name in (member, count))
        return row(*places, room).removesuffix(",")

    def _saved_lists(self) -> Iterator[tuple[str, str]]:
        """Print the C numbers that a saved machine needs; yield the lists by name."""
        names, image = self._names, self._image
        lists: dict[str, list[int]] = {name: [] for name in LISTS}
        if f"{OWN}.delayed" in self._members:
            routes: list[Route] = [(destination, ()) for destination in ROUTES]
            routes += [(Destination.INVOKER, ())] if "to_invoker" in names.used else []
            routes += [(Destination.INVOKED, slots) for slots in names.reached]
            lists["routes"] = [routes.index(w) if w in routes else UNPRINTED for w in image.routes]
            lists["marks"] = [0 if n is None else names.marks.get(n, 0) for n in image.ids]
            lists["peers"] = [names.numbers.get(n or "", UNPRINTED) for n in image.peers]
        if image.stores_symbols:
            lists["texts"] = [names.symbol(text) for text in image.texts]
        for name, numbers in lists.items():
            self._array("uint16_t", name, [f"{number}u," for number in numbers])
            yield name, f"{{{self._name(name, numbers)}, {len(numbers)}}}"

    def _info(self) -> None:
        """Print the table, in the order of ``fsm_machine_info``."""
        names, chart, image, p = self._names, self._chart, self._image, self._names.prefix
        timeouts = [t for t in chart.transitions if t.has_timer]
        has_delayed = f"{OWN}.delayed" in self._members
        members: dict[str, object] = {
            "name": self._text(chart.name),
            "size": f"sizeof({p})",
            "event_size": f"sizeof({p}_event)",
            "event_number": f"offsetof({p}_event, event)",
            "event_width": f"sizeof((({p}_event *)0)->event)",
            "saved_size": image.size - sum(inner.size for inner in image.inner),
            "payload": image.payload,
            "state_count": f"{names.upper}_STATES",
            "event_count": len(chart.events),
            "transition_count": len(chart.transitions),
            "operation_count": len(chart.operations),
            "timeout_count": len(timeouts),
            "region_count": len(image.plan.regions),
            "number_count": len(image.plan.regions) + len(image.histories),
            "data_count": len(chart.data),
            "output_count": len(chart.outputs),
            "input_count": len(chart.inputs),
            "slot_count": sum(1 for _ in within(names)),
            "symbol_count": len(names.symbols),
            "states": f"{self._own}_states",
            "events": self._name("events", chart.events),
            "variables": self._name("variables", image.values),
            "operations": self._name("operations", chart.operations),
            "timeouts": self._name("timeouts", timeouts),
            "numbers": f"{self._own}_numbers",
            "slots": self._name("slots", chart.invocations),
            "queue": self._list("queue", chart.capacities.queue),
            "internal": self._list("internal", chart.capacities.internal),
            "deferred": self._list("deferred", image.deferred),
            "timers": self._list("timers", image.timers),
            "delayed": self._list("delayed", image.delayed),
            "delayed_size": f"sizeof({p}_delayed)" if has_delayed else 0,
            "delayed_route": f"offsetof({p}_delayed, route)" if has_delayed else 0,
            "delayed_peer": f"offsetof({p}_delayed, peer)" if has_delayed else 0,
            **dict(self._saved_lists()),
        }
        for member in ("running", "finished", "fault", "busy", "now", "reply"):
            members[member] = self._offset(f"{OWN}.{member}")
        members["reply_type"] = self._type(self._reply)
        if not names.is_invoked:
            self._array("uint8_t", "head", [" ".join(f"0x{byte:02X}u," for byte in head(chart))])
        members["head"] = "NULL" if names.is_invoked else f"{self._own}_head"
        members["init"] = f"{self._own}_init"
        members["symbol"] = f"FSM_TEXT({p}_symbol)"
        if names.is_invoked:
            self._out.line(f"extern const fsm_machine_info {p}_info;")
        self._whole("fsm_machine_info", f"{p}_info", members)
        if not names.is_invoked:
            self._driver()

    def _driver(self) -> None:
        """Print the functions, in the order of ``fsm_driver``."""
        does = self._names.does
        is_saved = "save" in self._names.options.extras
        functions = {"start": True, "run": does.runs, "post": does.queued}
        functions |= {"dispatch": True, "next_deadline": True}
        functions |= {"save": is_saved, "restore": is_saved}
        members = {
            name: f"{self._own}_{name}" if is_there else "NULL"
            for name, is_there in functions.items()
        }
        p = self._names.prefix
        self._whole("fsm_driver", f"{p}_driver", {"info": f"&{p}_info", **members})

    def _whole(self, ctype: str, name: str, members: Mapping[str, object]) -> None:
        with self._out.block(f"const {ctype} {name} = {{", "};"):
            self._out.lines(f"{value}, /* {member} */" for member, value in members.items())
        self._out.line()


def kind_of(type_: lang.Type) -> str:
    """Return the ``fsm_type_kind`` of a type."""
    match type_:
        case lang.ArrayType():
            return "FSM_ARRAY"
        case lang.RecordType():
            return "FSM_RECORD"
        case lang.FloatType():
            return "FSM_FLOAT"
        case lang.EnumType():
            return "FSM_ENUMERATION"
        case lang.BoolType():
            return "FSM_BOOL"
        case lang.DurationType():
            return "FSM_DURATION"
        case lang.SymbolType():
            return "FSM_SYMBOL"
        case _:
            return "FSM_SIGNED" if interval(type_).lo < 0 else "FSM_UNSIGNED"


def bounds(type_: lang.Type) -> tuple[str, str]:
    """Return the bounds of a number in two's complement; other types have the bounds 0 and 0."""
    if isinstance(type_, lang.ArrayType | lang.RecordType | lang.FloatType):
        return "0u", "0u"
    of = interval(type_)
    return f"UINT64_C({of.lo % 2**64})", f"UINT64_C({of.hi % 2**64})"


def within(names: Names) -> Iterator[Names]:
    """Yield the machines in the slots of a machine, each before those within it."""
    for inner in names.invoked:
        yield inner
        yield from within(inner)
