"""Prints the source of a node: what leaves it, what comes in, and its cycle."""

from __future__ import annotations

from fsmkit.codegen.system.glue import GluePrinter, literal
from fsmkit.codegen.system.node import Node
from fsmkit.codegen.system.node_tables import print_tables, print_validity
from fsmkit.codegen.system.parts import Part
from fsmkit.codegen.system.payload import getter, places, putter
from fsmkit.emit import Emitter
from fsmkit.language import Field
from fsmkit.runtime.links.event_map import LevelType, MessageType
from fsmkit.system.system import EventLink, InputLink
from fsmkit.texts.c import comment


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
                key = node.here(link.source), link.port
                self.sent.setdefault(key, []).append((message, link))
        self.beyond = {
            key: [link.arguments for _, link in found] for key, found in self.sent.items()
        }
        for key, link in self._outside():
            self.beyond[key] = [*self.beyond.get(key, ()), link.arguments]

    def _outside(self) -> list[tuple[tuple[int, int], EventLink]]:
        """Return connections to the environment of ports that are connected elsewhere, too."""
        whole, placed = self.node.deployment.system, self.node.deployment.placed
        joined = {(link.source, link.port) for link in self.system.event_links} | set(self.sent)
        found = []
        for link in whole.event_links:
            if link.source in self.node.numbers and placed[link.target] is None:
                key = self.node.here(link.source), link.port
                if key in joined:
                    found.append((key, link))
        return found

    def told(self) -> list[tuple[str, Part, tuple[Field, ...]]]:
        """Return the functions of the host for what the environment hears besides others."""
        keys = dict.fromkeys(key for key, _ in self._outside())
        return [
            (self._told_name(part, port), part, self._port(part, port)[1])
            for number, port in keys
            for part in (self.by_index[number],)
        ]

    def _told_name(self, part: Part, port: int) -> str:
        return f"{self.prefix}_{part.member}_{self._port(part, port)[0].removeprefix('send_')}"

    # --- what leaves -----------------------------------------------------------------------------

    def _first(self, out: Emitter) -> None:
        if not self.sent:
            return
        out.text(f"""
        static uint8_t *{self.prefix}_claim({self.prefix} *s, uint16_t message)
        {{
            if (s->link != NULL)
                return fsm_link_claim(s->link, message);
            if (s->lost < 65535u)
                s->lost++;
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
            out.line(f"{self._told_name(part, port)}(s{values});")

    # --- what comes in ---------------------------------------------------------------------------

    def _more_first_inputs(self) -> list[str]:
        lines = []
        for _, link in self._levels(receives=True):
            source = self.node.deployment.system.machines[link.source].chart
            value = literal(source.outputs[link.output].init.value)
            lines.append(f"{self._input(link)} = {value};")
        return lines

    def _levels(self, *, receives: bool) -> list[tuple[LevelType, InputLink]]:
        """Return the levels that come in, or those that go out."""
        all_of_them = zip(self.map.levels, self.node.deployment.wires.levels, strict=True)
        own = self.node.place
        return [
            (level, link)
            for level, link in all_of_them
            if (level.receiver if receives else level.sender) == own
        ]

    def _input(self, link: InputLink) -> str:
        part = self.by_index[self.node.here(link.target)]
        return f"s->{part.member}.{part.names.variables[part.chart.inputs[link.input].name]}"

    def _output(self, link: InputLink) -> str:
        part = self.by_index[self.node.here(link.source)]
        return f"s->{part.member}.{part.names.variables[part.chart.outputs[link.output].name]}"

    def _more(self, out: Emitter) -> None:
        out.line()
        print_validity(out, self.node)
        print_tables(out, self.node)
        self._take(out)
        senders = sorted({level.sender for level, _ in self._levels(receives=True)})
        for sender in senders:
            self._sample(out, sender)
        self._publish(out)
        self._cycle(out, senders)

    def _take(self, out: Emitter) -> None:
        """Print how an event is posted: whether its machine had room, or is not there to have."""
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
        out.line(f"static bool {s}_take({s} *s, const fsm_link_frame *frame)")
        with out.block("{"):
            out.line("const uint8_t *p = frame->bytes + FSM_LINK_HEADER;")
            out.line("(void)p;")
            with out.block("switch (fsm_link_message_of(frame)) {"):
                for message, link in received:
                    self._post(out, message, link)
                out.lines(["default:", "    break;"])
            out.lines(["if (s->lost < 65535u)", "    s->lost++;", "return true;"])
        out.line()

    def _post(self, out: Emitter, message: MessageType, link: EventLink) -> None:
        part = self.by_index[self.node.here(link.target)]
        names, member = part.names, f"s->{part.member}"
        with out.block(f"case {message.number}u: {{ /* {comment(message.name)} */"):
            out.line(f"{part.prefix}_event e = {names.upper}_NO_EVENT;")
            out.line(f"e.event = {names.events[link.event]};")
            types = [field.type for field in message.fields]
            wanted = names.chart.events[link.event].fields
            for at, field, sent in zip(places(types), wanted, types, strict=True):
                into = f"e.of.{names.payloads[link.event]}.{names.field(field.name)}"
                out.line(f"{into} = {getter(sent, field.type, at)};")
            out.line(f"if ({part.prefix}_in(&{member}, {names.states[0]}))")
            out.line(f"    return {part.prefix}_post(&{member}, &e);")
            out.line("break;")

    def _sample(self, out: Emitter, sender: int) -> None:
        """Print how the levels of a node become inputs here."""
        all_of_them = self.map.levels_of(sender)
        at = dict(zip(all_of_them, places([level.type for level in all_of_them]), strict=True))
        out.line(f"static void {self._sample_name(sender)}({self.prefix} *s, const uint8_t *p)")
        with out.block("{"):
            for level, link in self._levels(receives=True):
                if level.sender == sender:
                    target = self.node.deployment.system.machines[link.target].chart
                    wanted = target.inputs[link.input].type
                    out.line(f"{self._input(link)} = {getter(level.type, wanted, at[level])};")
        out.line()

    def _sample_name(self, sender: int) -> str:
        return f"{self.prefix}_sample_{self.node.words[sender].lower()}"

    def _publish(self, out: Emitter) -> None:
        """Print how the levels of this node are written."""
        levels = self._levels(receives=False)
        if not levels:
            return
        out.line(f"static void {self.prefix}_publish(const {self.prefix} *s, uint8_t *p)")
        with out.block("{"):
            for at, (level, link) in zip(
                places([level.type for level, _ in levels]), levels, strict=True
            ):
                out.line(putter(level.type, at, self._output(link)))
        out.line()

    def _cycle(self, out: Emitter, senders: list[int]) -> None:
        s = self.prefix
        out.line(f"bool {s}_cycle({s} *s, uint32_t now)")
        with out.block("{"):
            out.line("const fsm_link_frame *frame;")
            if senders:
                out.line("const uint8_t *levels;")
            out.lines(["bool rests, goes_on, first = true;", "uint8_t *payload;"])
            out.lines(["if (s->link == NULL)", f"    return {s}_run(s, now);"])
            out.line("fsm_link_begin(s->link);")
            for sender in senders:
                out.line(f"levels = fsm_link_levels(s->link, {sender}u);")
                out.line("if (levels != NULL)")
                out.line(f"    {self._sample_name(sender)}(s, levels);")
            with out.block("do {", "} while (frame != NULL && goes_on);"):
                out.line("goes_on = first; /* what the host posted, the first run takes */")
                out.line("first = false;")
                out.open("while ((frame = fsm_link_front(s->link)) != NULL) {")
                out.line(f"if (!{s}_take(s, frame))")
                out.line("    break; /* no room: it stays until the machines have run */")
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
