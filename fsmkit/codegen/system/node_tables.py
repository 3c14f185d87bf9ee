"""What the library for links knows of a node: the event map as constants, and what is valid."""

from __future__ import annotations

from collections.abc import Sequence

from fsmkit.codegen.system.node import Node
from fsmkit.codegen.system.payload import checks, size_of
from fsmkit.emit import Emitter
from fsmkit.runtime.links.event_map import LEVELS, EventMap
from fsmkit.texts.c import comment, quoted

HEADER_BYTES = 22
"""As ``FSM_LINK_HEADER``."""


def print_validity(out: Emitter, node: Node) -> None:
    """Print whether the values of a payload are of their types."""
    s = node.prefix
    out.line(f"static bool {s}_is_valid(uint8_t sender, uint16_t message, const uint8_t *p)")
    with out.block("{"):
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
    out.line()


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
    """Print the map as the library wants it."""
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
    with out.block(f"const fsm_link_map {s}_map = {{", "};"):
        out.line(f"0x{node.map.hash:08x}u,")
        out.line(f"{upper}_NODE_{node.words[node.place]},")
        out.line(f"{nodes}u,")
        out.line(f"{len(node.map.messages)}u,")
        out.lines(
            [
                f"{s}_messages,",
                f"{s}_levels,",
                f"{s}_nodes,",
                f"{s}_is_valid,",
                f"{node.deployment.every}u,",
                str(node.map.is_insecure).lower(),
            ]
        )
    out.line()
    if node.map.endpoints:
        with out.block(f"const char *const {s}_endpoints[{nodes}] = {{", "};"):
            out.lines(f"{quoted(endpoint)}," for endpoint in node.map.endpoints)
        out.line()


def _sizes(map_: EventMap) -> Sequence[int]:
    return [size_of([field.type for field in m.fields]) for m in map_.messages]


def _level_sizes(map_: EventMap) -> Sequence[int]:
    nodes = range(len(map_.nodes))
    return [size_of([level.type for level in map_.levels_of(node)]) for node in nodes]
