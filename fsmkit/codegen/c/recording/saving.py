"""The source that saves and restores a machine: linked by those who call it, no cost for others."""

from __future__ import annotations

from collections.abc import Sequence

from fsmkit.chart.statements import Destination
from fsmkit.codegen.c.expressions.content import ROUTES
from fsmkit.codegen.c.header import NOTICE, event_type
from fsmkit.codegen.c.helpers import fill
from fsmkit.codegen.c.layout import Member
from fsmkit.codegen.c.names import Names
from fsmkit.codegen.c.reactions.exit_sets import ungrouped
from fsmkit.codegen.c.reactions.sharing import number_of, record_of, take_record
from fsmkit.codegen.c.recording.values import Values
from fsmkit.document.document import Trigger
from fsmkit.emit import Emitter
from fsmkit.plan.image import Image, head, image_of
from fsmkit.texts.c import comment

ENDS = """
bool @_save(const @ *m, uint32_t now, uint8_t *bytes)
{
    fsm_writer w = {bytes};
[guarded]    if (m->busy)
[guarded]        return false;
    for (unsigned i = 0u; i < FSM_SAVED_HEAD; i++)
        *w.at++ = @_head[i];
    @_put_machine(&w, m, now);
    fsm_put(&w, fsm_crc(bytes, %_SAVED_BYTES - FSM_SAVED_CRC), 4u);
    return true;
}

fsm_restored @_restore(@ *m, uint32_t now, const uint8_t *bytes, size_t size)
{
    fsm_reader r = {bytes + FSM_SAVED_HEAD, true};
    fsm_restored found;
[guarded]    if (m->busy)
[guarded]        return FSM_IN_STEP;
    found = fsm_check(bytes, size, @_head, %_SAVED_BYTES);
    if (found != FSM_RESTORED)
        return found;
    @_init(m);
    @_get_machine(&r, m, now);
    if (r.sound) {
$LOG
        return FSM_RESTORED;
    }
    @_init(m);
    return FSM_DAMAGED;
}
"""

LOG = """
#ifdef FSM_LOGGED
        fsm_log_restored((uint16_t)FSM_INSTANCE(m), now, bytes, size);
#endif
"""

PUT_TIMERS = """
    fsm_put(w, m->timer_count, 1u);
    for (uint8_t i = 0u; i < m->timer_count; i++) {
        fsm_put(w, m->timers[i].deadline - now, 4u);
        fsm_put(w, m->timers[i].what, 2u);
    }
    fsm_fill(w, w->at + 6u * ($TIMERSu - m->timer_count));
"""

PUT_DELAYED = """
    uint8_t rank = 0u;
    for (uint8_t i = 0u; i < m->timer_count; i++) {
        if (m->timers[i].what != FSM_TIMER_SEND)
            continue;
        fsm_put(w, fsm_find(@_routes, $ROUTESu, m->delayed[rank].route), 2u);
        fsm_put(w, fsm_find(@_ids, $IDSu, m->timers[i].mark), 2u);
        fsm_put(w, fsm_find(@_peers, $PEERSu, m->delayed[rank].peer), 2u);
        @_put_event(w, &m->delayed[rank].e);
        rank++;
    }
    fsm_fill(w, w->at + $EACHu * ((uint32_t)%_DELAYED - rank));
"""

GET_TIMERS = """
    m->timer_count = (uint8_t)fsm_take(r, 1u, 0u, %_TIMERS);
    for (uint8_t i = 0u; i < $TIMERSu; i++) {
        uint32_t left = fsm_get(r, 4u);
        uint16_t what = (uint16_t)fsm_get(r, 2u);
        if (i >= m->timer_count)
            continue;
        m->timers[i].deadline = now + left;
        m->timers[i].what = what;
        switch (what) {
$KNOWN
            break;
        default:
            r->sound = false;
            break;
        }
    }
"""

GET_DELAYED = """
    uint8_t rank = 0u;
    for (uint8_t i = 0u; i < %_DELAYED; i++) {
        while (rank < m->timer_count && m->timers[rank].what != FSM_TIMER_SEND)
            rank++;
        m->delayed[i].route = fsm_take_place(r, @_routes, $ROUTESu);
        uint16_t mark = fsm_take_place(r, @_ids, $IDSu);
        m->delayed[i].peer = fsm_take_place(r, @_peers, $PEERSu);
        @_get_event(r, &m->delayed[i].e, rank < m->timer_count);
        if (rank < m->timer_count) {
            m->timers[rank].mark = mark;
            m->delayed_count++;
            rank++;
        } else {
            const @_delayed none = {%_NO_EVENT, 0u, 0u};
            m->delayed[i] = none;
        }
    }
    while (rank < m->timer_count) {
        if (m->timers[rank].what == FSM_TIMER_SEND)
            r->sound = false;
        rank++;
    }
"""

UNPRINTED = 0xFFFF
"""The number of what the machine never uses."""

Way = tuple[Destination, tuple[int, ...]]
Machines = Sequence[tuple[Names, list[Member]]]


def saving_source(machines: Machines) -> str:
    """Return the text for machines, those in the slots before those that hold them."""
    names = machines[-1][0]
    out = Emitter()
    what = comment("saves and restores the machine " + names.chart.name)
    out.line(f"/* {names.prefix}_save.c: {what}. {NOTICE} */")
    is_traced = "trace" in names.options.extras
    library = "fsm_trace.h" if is_traced else "fsm_bytes.h"
    out.lines([f'#include "{names.prefix}.h"', f'#include "{library}"', ""])
    for each, members in machines:
        _Saver(each, frozenset(member.name for member in members)).print(out)
    start = ", ".join(f"0x{byte:02X}u" for byte in head(names.chart))
    out.line("/* What every image of this chart begins with. */")
    out.line(f"static const uint8_t {names.prefix}_head[FSM_SAVED_HEAD] = {{{start}}};")
    out.line()
    out.lines(fill(names, ENDS, LOG=LOG.strip("\n") if is_traced else "~"))
    return out.finish()


def symbol_table(out: Emitter, names: Names, image: Image) -> None:
    """Print the numbers that the symbols of the image have in C."""
    _table(out, f"{names.prefix}_texts", [names.symbol(text) for text in image.texts])


def _table(out: Emitter, name: str, numbers: list[int]) -> None:
    listed = ", ".join(f"{number}u" for number in numbers)
    out.line(f"static const uint16_t {name}[] = {{{listed}}};")
    out.line()


class _Saver:
    """Prints what writes and reads one machine."""

    def __init__(self, names: Names, members: frozenset[str]) -> None:
        self._names = names
        self._members = members
        self._image: Image = image_of(names.chart)
        p = names.prefix
        self._values = Values(names, f"{p}_texts, {len(self._image.texts)}u")

    def print(self, out: Emitter) -> None:
        p = self._names.prefix
        self._tables(out)
        if self._has_events:
            self._put_event(out)
            self._get_event(out)
        out.line(f"static void {p}_put_machine(fsm_writer *w, const {p} *m, uint32_t now)")
        with out.block("{"):
            self._put_machine(out)
        out.line()
        out.line(f"static void {p}_get_machine(fsm_reader *r, {p} *m, uint32_t now)")
        with out.block("{"):
            self._get_machine(out)
        out.line()

    @property
    def _has_events(self) -> bool:
        return bool({"queue", "deferred", "delayed"} & self._members)

    def _tables(self, out: Emitter) -> None:
        """Print how what the image numbers is numbered in C."""
        names, image = self._names, self._image
        if "delayed" in self._members:
            ways: list[Way] = [(destination, ()) for destination in ROUTES]
            ways += [(Destination.INVOKER, ())] if "to_invoker" in names.used else []
            ways += [(Destination.INVOKED, slots) for slots in names.reached]
            self._table(out, "routes", [_place(ways, route) for route in image.routes])
            marks = [0 if name is None else names.marks.get(name, 0) for name in image.ids]
            self._table(out, "ids", marks)
            peers = [names.numbers.get(peer or "", UNPRINTED) for peer in image.peers]
            self._table(out, "peers", peers)
        if image.stores_symbols:
            symbol_table(out, names, image)

    def _table(self, out: Emitter, name: str, numbers: list[int]) -> None:
        _table(out, f"{self._names.prefix}_{name}", numbers)

    # --- events ---------------------------------------------------------------------------

    def _put_event(self, out: Emitter) -> None:
        names, payload = self._names, self._image.payload
        p = names.prefix
        out.line(f"static void {p}_put_event(fsm_writer *w, const {p}_event *e)")
        with out.block("{"):
            if payload:
                out.line(f"const uint8_t *end = w->at + {2 + payload}u;")
            out.line("fsm_put(w, (uint32_t)e->event, 2u);")
            if payload:
                self._values.payloads(out, names, self._values.put)
                out.line("fsm_fill(w, end);")
        out.line()

    def _get_event(self, out: Emitter) -> None:
        names, payload = self._names, self._image.payload
        p = names.prefix
        out.line(f"static void {p}_get_event(fsm_reader *r, {p}_event *e, bool is_there)")
        with out.block("{"):
            if payload:
                out.line(f"const uint8_t *end = r->at + {2 + payload}u;")
            count = len(names.chart.events)
            out.line(f"const uint32_t last = is_there ? {count}u : 0u;")
            out.line("const uint32_t event = fsm_take(r, 2u, is_there ? 1u : 0u, last);")
            out.line(f"const {p}_event none = {names.upper}_NO_EVENT;")
            out.line("*e = none;")
            out.line(f"e->event = ({event_type(names)})event;")
            if payload:
                self._values.payloads(out, names, self._values.get)
                out.line("r->at = end;")
        out.line()

    # --- machines -------------------------------------------------------------------------

    def _numbers(self) -> list[tuple[str, int, bool | None]]:
        """Return the members with the states of regions and histories, and their greatest.

        And of one that tells both whether it is asked for what was recorded.
        """
        names, regions, shared = self._names, self._image.plan.regions, self._names.shared
        found = [
            (names.regions[r.index], len(r.states), False if r.index in shared else None)
            for r in regions
        ]
        found += [
            (names.recorded(h, r), len(regions[r].states), True if shared.get(r) == h else None)
            for h, r in self._image.histories
        ]
        return found

    def _put_machine(self, out: Emitter) -> None:
        names, image = self._names, self._image
        status = f"({names.running} ? 1u : 0u)"
        if "finished" in self._members:
            status += " | (m->finished ? 2u : 0u)"
        out.line("(void)now;")
        out.line(f"fsm_put(w, {status}, 1u);")
        out.line(f"fsm_put(w, {'m->fault' if 'fault' in self._members else '0u'}, 1u);")
        for member, _, is_record in self._numbers():
            text = f"m->{member}" if member in self._members else "0u"
            if is_record is not None:
                text = record_of(text) if is_record else number_of(text)
            out.line(f"fsm_put(w, {text}, 2u);")
        for field in image.values:
            self._values.put(out, field.type, f"m->{names.variables[field.name]}")
        with out.block(f"if ({names.running}) {{"):
            self._put_waiting(out)
        with out.block("else {"):
            rest = image.waiting + sum(within.size for within in image.inner)
            out.line(f"fsm_fill(w, w->at + {rest}u);")

    def _put_waiting(self, out: Emitter) -> None:
        """Print how events and timers are written."""
        image = self._image
        self._put_queue(out, "queue", self._names.chart.capacities.queue)
        if image.deferred:
            self._put_queue(out, "deferred", image.deferred)
        each = 8 + image.payload
        if "timers" in self._members:
            self._fill(out, PUT_TIMERS, TIMERS=image.timers)
        elif image.timers:
            out.line(f"fsm_fill(w, w->at + {1 + 6 * image.timers}u);")
        if "delayed" in self._members:
            self._fill(out, PUT_DELAYED, EACH=each)
        elif image.delayed:
            out.line(f"fsm_fill(w, w->at + {each * image.delayed}u);")
        names = self._names
        for inner, slot, within in zip(names.invoked, names.slots, image.inner, strict=True):
            out.line(f"if (m->{slot}.running)")
            out.line(f"    {inner.prefix}_put_machine(w, &m->{slot}, now);")
            out.line("else")
            out.line(f"    fsm_fill(w, w->at + {within.size}u);")

    def _put_queue(self, out: Emitter, queue: str, room: int) -> None:
        if queue not in self._members:
            out.line(f"fsm_fill(w, w->at + {1 + room * (2 + self._image.payload)}u);")
            return
        out.line(f"fsm_put(w, m->{queue}_count, 1u);")
        out.line(f"for (uint8_t i = 0u; i < {room}u; i++)")
        out.line(f"    {self._names.prefix}_put_event(w, &m->{queue}[i]);")

    def _forget(self, out: Emitter) -> None:
        """Print that histories hold nothing that cannot be read; older versions kept it."""
        names, image = self._names, self._image
        for state in image.chart.states:
            wanted = image.plan.forgotten[state.index]
            held = (name for (h, _), name in names.histories.items() if h in wanted)
            kept = [member for member in held if member in self._members]
            if kept:
                with out.block(f"if ({ungrouped(names.in_state('m', state.index))}) {{"):
                    out.lines(f"m->{member} = 0u;" for member in kept)

    def _get_machine(self, out: Emitter) -> None:
        names, image = self._names, self._image
        has = self._members
        out.line("const uint32_t status = fsm_take(r, 1u, 0u, 3u);")
        out.line("const uint32_t fault = fsm_take(r, 1u, 0u, FSM_FAULT_INVOKED);")
        for member in ("running", "finished"):
            if member in has:
                out.line(f"m->{member} = (status & {1 + (member == 'finished')}u) != 0u;")
        out.line("(void)status;")
        out.line("m->fault = (uint8_t)fault;" if "fault" in has else "(void)fault;")
        for member, most, is_record in self._numbers():
            if is_record:
                take_record(out, f"m->{member}", most)
            elif member in has:
                ctype = "uint16_t" if most > 255 else "uint8_t"
                out.line(f"m->{member} = ({ctype})fsm_take(r, 2u, 0u, {most}u);")
            else:
                out.line("(void)fsm_get(r, 2u);")
        self._forget(out)
        for field in image.values:
            self._values.get(out, field.type, f"m->{names.variables[field.name]}")
        self._get_queue(out, "queue", names.chart.capacities.queue)
        if image.deferred:
            self._get_queue(out, "deferred", image.deferred)
        if "timers" in has:
            self._fill(out, GET_TIMERS, TIMERS=image.timers, KNOWN=self._known_timers())
        elif image.timers:
            self._none(out, 1 + 6 * image.timers)
        if "delayed" in has:
            self._fill(out, GET_DELAYED)
        elif image.delayed:
            self._none(out, (8 + image.payload) * image.delayed)
        out.line("m->now = now;" if "now" in has else "(void)now;")
        for inner, slot, within in zip(names.invoked, names.slots, image.inner, strict=True):
            out.line("if (r->at[0] != 0u || r->at[1] != 0u)")
            out.line(f"    {inner.prefix}_get_machine(r, &m->{slot}, now);")
            out.line("else")
            out.line(f"    r->at += {within.size}u;")

    def _get_queue(self, out: Emitter, queue: str, room: int) -> None:
        if queue not in self._members:
            self._none(out, 1 + room * (2 + self._image.payload))
            return
        out.line(f"m->{queue}_count = (uint8_t)fsm_take(r, 1u, 0u, {room}u);")
        out.line(f"for (uint8_t i = 0u; i < {room}u; i++)")
        out.line(f"    {self._names.prefix}_get_event(r, &m->{queue}[i], i < m->{queue}_count);")

    def _none(self, out: Emitter, size: int) -> None:
        """Print that what this machine does not have must not be there."""
        out.line("if (r->at[0] != 0u)")
        out.line("    r->sound = false;")
        out.line(f"r->at += {size}u;")

    def _known_timers(self) -> str:
        """Return the labels of all that a timer can be for."""
        timed = (Trigger.AFTER, Trigger.EVERY)
        labels = [f"{t.index}u" for t in self._names.chart.transitions if t.trigger in timed]
        labels += ["FSM_TIMER_SEND"] if "delayed" in self._members else []
        return "\n".join(f"        case {label}:" for label in labels)

    def _fill(self, out: Emitter, text: str, **parts: object) -> None:
        image = self._image
        known = {
            "ROUTES": len(image.routes),
            "IDS": len(image.ids),
            "PEERS": len(image.peers),
            **parts,
        }
        lines = fill(self._names, text, **{key: str(value) for key, value in known.items()})
        out.lines(line.removeprefix("    ") for line in lines)


def _place(ways: list[Way], way: Way) -> int:
    """Return the number of a way; one that the machine never goes is out of all bounds."""
    return ways.index(way) if way in ways else UNPRINTED
