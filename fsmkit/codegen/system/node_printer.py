"""The C of a node: its joined machines, and their connections to other nodes over a link.

It is the C of a system (`glue`) in which some connections end at ``fsm_link.h``. A sent message is
written into the ring to the worker; received messages are posted at the start of a cycle.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence

from fsmkit.codegen.c.expressions.cases import default
from fsmkit.codegen.c.header import parameters
from fsmkit.codegen.system.glue import GluePrinter, header, literal
from fsmkit.codegen.system.node import Node
from fsmkit.codegen.system.parts import Part, parts_of
from fsmkit.codegen.system.payload import checks, getter, places, putter, size_of
from fsmkit.emit import Emitter, printing
from fsmkit.emit.c import comment, quoted
from fsmkit.language import Field
from fsmkit.system.deployment.event_map import LEVELS, EventMap, LevelType, MessageType
from fsmkit.system.machine import EventLink, InputLink


@printing
def compose_node(node: Node, queued: Collection[str]) -> dict[str, str]:
    """Return header and source; ``queued``: the names of charts whose code has a queue."""
    parts = parts_of(node.system, node.charts, queued)
    return {
        f"{node.prefix}.h": _header(node, parts),
        f"{node.prefix}.c": NodePrinter(node, parts).text(),
    }


def _header(node: Node, parts: tuple[Part, ...]) -> str:
    prefix, upper = node.prefix, node.prefix.upper()
    deployment = node.deployment
    lines = ["", "/* The nodes of the deployment, for fsm_link_count and the like. */"]
    lines += [f"#define {upper}_NODE_{word} {place}u" for place, word in enumerate(node.words)]
    lines += [
        "",
        "/* What crosses the nodes. */",
        f"extern const fsm_link_map {prefix}_map;",
    ]
    if deployment.map.endpoints:
        lines += [
            "",
            "/* Where each node publishes, as the deployment says. */",
            f"extern const char *const {prefix}_endpoints[{len(deployment.nodes)}];",
        ]
    lines += [
        "",
        "/* A cycle: post what other nodes sent, run all machines until `now`, let out what they",
        " * send, and the levels. False as X_run. Without a link: only the run. */",
        f"bool {prefix}_cycle({prefix} *s, uint32_t now);",
    ]
    host_functions = NodePrinter(node, parts).host_functions()
    if host_functions:
        lines += ["", "/* Connected both to other machines and to the environment: the host's. */"]
        lines += [
            f"void {name}({prefix} *s{parameters(f, p.names)});" for name, p, f in host_functions
        ]
    return header(
        node.system,
        prefix,
        parts,
        includes=['#include "fsm_link.h"'],
        members=["fsm_link *link; /* NULL: what goes to other nodes is lost */"],
        calls="\n".join(lines),
    )


class NodePrinter(GluePrinter):
    """Prints the source of a node."""

    def __init__(self, node: Node, parts: tuple[Part, ...]) -> None:
        """Print for these machines, in the order in which they run."""
        super().__init__(node.system, node.prefix, parts)
        self.node = node
        self.map = node.deployment.map
        self.sent: dict[tuple[int, int], list[tuple[MessageType, EventLink]]] = {}
        for message, link in zip(self.map.messages, node.deployment.wires.events, strict=True):
            if message.sender == node.place:
                key = node.position_of(link.source), link.port
                self.sent.setdefault(key, []).append((message, link))
        self.beyond = {
            key: [link.arguments for _, link in found] for key, found in self.sent.items()
        }
        for key, link in self._outside():
            self.beyond[key] = [*self.beyond.get(key, ()), link.arguments]

    def _outside(self) -> list[tuple[tuple[int, int], EventLink]]:
        """Return connections to the environment from ports that are also connected elsewhere."""
        whole, placed = self.node.deployment.system, self.node.deployment.placed
        joined = {(link.source, link.port) for link in self.system.event_links} | set(self.sent)
        found = []
        for link in whole.event_links:
            if link.source in self.node.numbers and placed[link.target] is None:
                key = self.node.position_of(link.source), link.port
                if key in joined:
                    found.append((key, link))
        return found

    def host_functions(self) -> list[tuple[str, Part, tuple[Field, ...]]]:
        """Return the functions of the host for additionally connected environment ports."""
        return [
            (name, self.by_index[number], self._port(self.by_index[number], port)[1])
            for (number, port), name in self.host_function_names().items()
        ]

    def host_function_names(self) -> dict[tuple[int, int], str]:
        """Return the names of these functions by machine and port."""
        keys = dict.fromkeys(key for key, _ in self._outside())
        return {key: self._host_function_name(self.by_index[key[0]], key[1]) for key in keys}

    def _host_function_name(self, part: Part, port: int) -> str:
        return f"{self.prefix}_{part.member}_{self._port(part, port)[0].removeprefix('send_')}"

    # --- what leaves -----------------------------------------------------------------------------

    def _first(self, out: Emitter) -> None:
        if not self.sent:
            return
        out.text(f"""
        static uint8_t *{self.prefix}_claim({self.prefix} *s, uint16_t message)
        {{
            if (s->link != NULL) {{
                return fsm_link_claim(s->link, message);
            }}
            if (s->lost < 65535u) {{
                s->lost++;
            }}
            return NULL;
        }}
        """)
        out.line()

    def _send(self, out: Emitter, part: Part, port: int, fields: tuple[Field, ...]) -> None:
        for message, link in self.sent.get((part.index, port), ()):
            with out.block("{"):
                out.line(f"/* {comment(message.name)} */")
                out.line(f"uint8_t *p = {self.prefix}_claim(s, {message.number}u);")
                with out.block("if (p != NULL) {"):
                    types = [field.type for field in message.fields]
                    for at, place in zip(places(types), link.arguments, strict=True):
                        value = part.names.field(fields[place].name)
                        out.line(putter(fields[place].type, at, value))
                    out.line("fsm_link_put(s->link);")
        if any(key == (part.index, port) for key, _ in self._outside()):
            values = "".join(f", {part.names.field(field.name)}" for field in fields)
            out.line(f"{self._host_function_name(part, port)}(s{values});")

    # --- what comes in ---------------------------------------------------------------------------

    def _more_first_inputs(self) -> list[str]:
        lines = []
        for _, link in self._levels(receives=True):
            source = self.node.deployment.system.machines[link.source].chart
            value = literal(source.outputs[link.output].init.value)
            lines.append(f"{self._input(link)} = {value};")
        return lines

    def _levels(self, *, receives: bool) -> list[tuple[LevelType, InputLink]]:
        """Return the incoming or the outgoing levels."""
        all_of_them = zip(self.map.levels, self.node.deployment.wires.levels, strict=True)
        own = self.node.place
        return [
            (level, link)
            for level, link in all_of_them
            if (level.receiver if receives else level.sender) == own
        ]

    def _input(self, link: InputLink) -> str:
        part = self.by_index[self.node.position_of(link.target)]
        return f"s->{part.member}.{part.names.variables[part.chart.inputs[link.input].name]}"

    def _output(self, link: InputLink) -> str:
        part = self.by_index[self.node.position_of(link.source)]
        return f"s->{part.member}.{part.names.variables[part.chart.outputs[link.output].name]}"

    def _more(self, out: Emitter) -> None:
        print_validity(out, self.node)
        print_tables(out, self.node)
        self._take(out)
        senders = sorted({level.sender for level, _ in self._levels(receives=True)})
        for sender in senders:
            self._sample(out, sender)
        self._publish(out)
        self._cycle(out, senders)

    def _take(self, out: Emitter) -> None:
        """Print the posting of an event; its result is whether the machine exists and had room."""
        s = self.prefix
        received = [
            (message, link)
            for message, link in zip(
                self.map.messages, self.node.deployment.wires.events, strict=True
            )
            if message.receiver == self.node.place
        ]
        out.line(
            "/* Post an event; false: the queue of its machine is full. A machine that does not"
        )
        out.line(" * run gets none. */")
        with out.function(f"static bool {s}_take({s} *s, const fsm_link_frame *frame)"):
            out.line("const uint8_t *p = frame->bytes + FSM_LINK_HEADER;")
            out.line("(void)p;")
            with out.block("switch (fsm_link_message_of(frame)) {"):
                for message, link in received:
                    self._post(out, message, link)
                default(out)
            out.lines(["if (s->lost < 65535u) {", "    s->lost++;", "}", "return true;"])

    def _post(self, out: Emitter, message: MessageType, link: EventLink) -> None:
        part = self.by_index[self.node.position_of(link.target)]
        names, member = part.names, f"s->{part.member}"
        with out.block(f"case {message.number}u: {{ /* {comment(message.name)} */"):
            out.line(f"{part.prefix}_event e = {names.upper}_NO_EVENT;")
            out.line(f"e.event = {names.events[link.event]};")
            types = [field.type for field in message.fields]
            wanted = names.chart.events[link.event].fields
            for at, field, sent in zip(places(types), wanted, types, strict=True):
                into = f"e.of.{names.payloads[link.event]}.{names.field(field.name)}"
                out.line(f"{into} = {getter(sent, field.type, at)};")
            with out.block(f"if ({part.prefix}_in(&{member}, {names.states[0]})) {{"):
                out.line(f"return {part.prefix}_post(&{member}, &e);")
            out.line("break;")

    def _sample(self, out: Emitter, sender: int) -> None:
        """Print the copy of another node's levels to inputs."""
        all_of_them = self.map.levels_of(sender)
        at = dict(zip(all_of_them, places([level.type for level in all_of_them]), strict=True))
        with out.function(
            f"static void {self._sample_name(sender)}({self.prefix} *s, const uint8_t *p)"
        ):
            for level, link in self._levels(receives=True):
                if level.sender == sender:
                    target = self.node.deployment.system.machines[link.target].chart
                    wanted = target.inputs[link.input].type
                    out.line(f"{self._input(link)} = {getter(level.type, wanted, at[level])};")

    def _sample_name(self, sender: int) -> str:
        return f"{self.prefix}_sample_{self.node.words[sender].lower()}"

    def _publish(self, out: Emitter) -> None:
        """Print the publication of this node's levels."""
        levels = self._levels(receives=False)
        if not levels:
            return
        with out.function(f"static void {self.prefix}_publish(const {self.prefix} *s, uint8_t *p)"):
            for at, (level, link) in zip(
                places([level.type for level, _ in levels]), levels, strict=True
            ):
                out.line(putter(level.type, at, self._output(link)))

    def _cycle(self, out: Emitter, senders: list[int]) -> None:
        s = self.prefix
        with out.function(f"bool {s}_cycle({s} *s, uint32_t now)"):
            out.line("const fsm_link_frame *frame;")
            if senders:
                out.line("const uint8_t *levels;")
            out.lines(["bool rests, goes_on, first = true;", "uint8_t *payload;"])
            out.lines(["if (s->link == NULL) {", f"    return {s}_run(s, now);", "}"])
            out.line("fsm_link_begin(s->link);")
            for sender in senders:
                out.line(f"levels = fsm_link_levels(s->link, {sender}u);")
                with out.block("if (levels != NULL) {"):
                    out.line(f"{self._sample_name(sender)}(s, levels);")
            with out.block("do {", "} while (frame != NULL && goes_on);"):
                out.line("goes_on = first; /* what the host posted, the first run takes */")
                out.line("first = false;")
                out.open("while ((frame = fsm_link_front(s->link)) != NULL) {")
                with out.block(f"if (!{s}_take(s, frame)) {{"):
                    out.line("break; /* no room: it stays until the machines have run */")
                out.line("fsm_link_release(s->link);")
                out.line("goes_on = true;")
                out.close()
                out.line(f"rests = {s}_run(s, now);")
            out.line("payload = fsm_link_levels_out(s->link);")
            if self._levels(receives=False):
                out.lines(["if (payload != NULL)", f"    {s}_publish(s, payload);"])
            else:
                out.line("(void)payload; /* none here: the frame says that this node is alive */")
            out.lines(["fsm_link_end(s->link);", "return rests;"])


# --- the map as constants, and what is valid ------------------------------------------------------

HEADER_BYTES = 22
"""The value of ``FSM_LINK_HEADER``."""


def print_validity(out: Emitter, node: Node) -> None:
    """Print the test that the values of a payload are within their types."""
    s = node.prefix
    with out.function(
        f"static bool {s}_is_valid(uint8_t sender, uint16_t message, const uint8_t *p)"
    ):
        out.lines(["(void)sender;", "(void)p;"])
        with out.block("switch (message) {"):
            for message in node.map.messages:
                found = checks([field.type for field in message.fields])
                if found:
                    out.line(f"case {message.number}u: /* {comment(message.name)} */")
                    out.line(f"    return {' && '.join(found)};")
            for sender in range(len(node.map.nodes)):
                found = checks([level.type for level in node.map.levels_of(sender)])
                if found and sender != node.place:
                    _levels_validity(out, node)
                    break
            out.lines(["default:", "    return true;"])


def _levels_validity(out: Emitter, node: Node) -> None:
    out.line(f"case {LEVELS}u:")
    with out.indented(), out.block("switch (sender) {"):
        for sender, name in enumerate(node.map.nodes):
            found = checks([level.type for level in node.map.levels_of(sender)])
            if found:
                out.line(f"case {sender}u: /* {comment(name)} */")
                out.line(f"    return {' && '.join(found)};")
        out.lines(["default:", "    return true;"])


def print_tables(out: Emitter, node: Node) -> None:
    """Print the map in the format of the library."""
    s, upper, nodes = node.prefix, node.prefix.upper(), len(node.map.nodes)
    largest = max([*_sizes(node.map), *_level_sizes(node.map)], default=0) + HEADER_BYTES
    out.line(f"#if FSM_LINK_BYTES < {largest}")
    out.line(f'#error "define FSM_LINK_BYTES as at least {largest}"')
    out.lines(["#endif", f"#if FSM_LINK_NODES < {nodes}"])
    out.line(f'#error "define FSM_LINK_NODES as at least {nodes}"')
    out.lines(["#endif", ""])
    with out.block(f"static const fsm_link_message {s}_messages[] = {{", "};"):
        for message, size in zip(node.map.messages, _sizes(node.map), strict=True):
            ends = f"{message.sender}u, {message.receiver}u, {size}u"
            out.line(f"{{{ends}}}, /* {message.number}: {comment(message.name)} */")
        if not node.map.messages:
            out.line("{0u, 0u, 0u}")
    sizes = ", ".join(f"{size}u" for size in _level_sizes(node.map))
    names = ", ".join(map(quoted, node.map.nodes))
    out.line(f"static const uint16_t {s}_levels[] = {{{sizes}}};")
    out.line(f"static const char *const {s}_nodes[] = {{{names}}};")
    out.line()
    out.text(f"""
    const fsm_link_map {s}_map = {{
        0x{node.map.hash:08x}u,
        {upper}_NODE_{node.words[node.place]},
        {nodes}u,
        {len(node.map.messages)}u,
        {s}_messages,
        {s}_levels,
        {s}_nodes,
        {s}_is_valid,
        {node.deployment.every}u,
        {str(node.map.is_insecure).lower()},
        {node.deployment.watchdog}u
    }};
    """)
    out.line()
    if node.map.endpoints:
        with out.block(f"const char *const {s}_endpoints[{nodes}] = {{", "};"):
            out.lines(f"{quoted(at) if at else 'NULL'}," for at in node.map.endpoints)
        out.line()


def _sizes(map_: EventMap) -> Sequence[int]:
    return [size_of([field.type for field in m.fields]) for m in map_.messages]


def _level_sizes(map_: EventMap) -> Sequence[int]:
    nodes = range(len(map_.nodes))
    return [size_of([level.type for level in map_.levels_of(node)]) for node in nodes]
