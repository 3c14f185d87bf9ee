"""The tables of ``fsm_can.h``: the messages between a node and foreign ones with a DBC file."""

from __future__ import annotations

from collections.abc import Sequence

from fsmkit.carriers.can.bus import CanNet
from fsmkit.carriers.can.dbc import Signal
from fsmkit.carriers.can.deployment import bus_of
from fsmkit.carriers.can.exchanged import CanWires, can_wires, types_of
from fsmkit.carriers.can.message import CanWire
from fsmkit.codegen.c.header import NOTICE
from fsmkit.codegen.system.node import Node
from fsmkit.codegen.system.payload import RANGES, places, size_of
from fsmkit.emit import Emitter, printing
from fsmkit.emit.c import comment
from fsmkit.language import FloatType, Type
from fsmkit.runtime.links.codec import code_of, layout

NOWHERE = "FSM_CAN_NOWHERE"


@printing
def compose_can(node: Node) -> dict[str, str]:
    """Return header and source of the tables; empty without a foreign node with a DBC file."""
    all_of_them = tuple(can_wires(node.deployment, node.place))
    net = bus_of(node.deployment)
    if not all_of_them and net is None:
        return {}
    file = f"{node.prefix}_can"
    head, out = Emitter(), Emitter()
    head.line(f"/* {file}.h: messages on buses of the node {comment(node.name)}. {NOTICE} */")
    guard = f"{file.upper()}_H"
    head.lines([f"#ifndef {guard}", f"#define {guard}", "", '#include "fsm_can.h"', ""])
    head.lines(["#ifdef __cplusplus", 'extern "C" {', "#endif", ""])
    out.line(f"/* {file}.c: see {file}.h. {NOTICE} */")
    out.lines([f'#include "{file}.h"', ""])
    if net is not None:
        head.line(f"extern const fsm_can_net {file}; /* {comment(net.bus)} */")
        _net(out, node, net, file)
    for wires in all_of_them:
        name = f"{file}_{node.words[wires.peer].lower()}"
        head.line(f"extern const fsm_can_node {name}; /* {comment(node.map.nodes[wires.peer])} */")
        _node(out, node, wires, name)
    head.lines(["", "#ifdef __cplusplus", "}", "#endif", "", "#endif"])
    return {f"{file}.h": head.finish(), f"{file}.c": out.finish()}


def _node(out: Emitter, node: Node, wires: CanWires, name: str) -> None:
    for which, sender in (("received", wires.peer), ("sent", node.place)):
        found: tuple[CanWire, ...] = getattr(wires, which)
        rows = []
        for place, wire in enumerate(found):
            types = types_of(node.deployment, sender, wire.number)
            rows.append(message_row(out, f"{name}_{which}_{place}", wire, types))
        if rows:
            with out.block(f"static const fsm_can_message {name}_{which}[] = {{", "};"):
                out.lines(rows)
    if wires.silences:
        with out.block(f"static const fsm_can_silence {name}_silence[] = {{", "};"):
            out.lines(f"{{{place}u, {number}u}}," for place, number in wires.silences)
    start = layout(tuple(level.type for level in node.map.levels_of(wires.peer)))
    levels = start.encode(wires.start)
    if levels:
        content = ", ".join(f"{byte}u" for byte in levels)
        out.line(f"static const uint8_t {name}_start[] = {{{content}}};")
    tables = {"received": wires.received, "sent": wires.sent, "silence": wires.silences}
    counts = ", ".join(f"{len(table)}u" for table in tables.values())
    names = ", ".join(f"{name}_{key}" if table else "NULL" for key, table in tables.items())
    start_values = f"{name}_start" if levels else "NULL"
    with out.block(f"const fsm_can_node {name} = {{", "};"):
        out.line(f"{wires.peer}u, {len(levels)}u, {start_values}, {counts}, {names}")
    out.line()


def _net(out: Emitter, node: Node, net: CanNet, name: str) -> None:
    """Print the messages of a bus that nodes share: events, levels by node, hellos by node."""
    nodes = range(len(node.map.nodes))
    found: list[tuple[CanWire | None, int]] = [
        (wire, part.sender) for wire, part in zip(net.events, node.map.messages, strict=True)
    ]
    found += [(net.levels.get(place), place) for place in nodes]
    found += [(net.hellos.get(place), place) for place in nodes]
    rows = []
    for place, (wire, sender) in enumerate(found):
        if wire is None:
            rows.append("{0u, FSM_CAN_NOWHERE, 0u, 0u, false, 0u, NULL},")
            continue
        types = types_of(node.deployment, sender, wire.number)
        rows.append(message_row(out, f"{name}_message_{place}", wire, types))
    with out.block(f"static const fsm_can_message {name}_messages[] = {{", "};"):
        out.lines(rows)
    with out.block(f"const fsm_can_net {name} = {{", "};"):
        out.line(f"0x{net.hash:08x}u, {len(nodes)}u, {len(net.events)}u, {name}_messages")
    out.line()


def message_row(out: Emitter, name: str, wire: CanWire, types: Sequence[Type]) -> str:
    """Print the signals of a message, and return its row; ``types``: of the payload."""
    message = wire.message
    rows = []
    rows += [_selector(signal, number) for signal, number in message.selectors]
    for place, (signal, value) in enumerate(wire.parts):
        raw = "NULL"
        if signal.members:
            raw = f"{name}_raw_{place}"
            out.line(
                f"static const int64_t {raw}[] = {{{', '.join(map(_signed, signal.members))}}};"
            )
        rows.append(_signal(signal, value, types, raw))
    if rows:
        with out.block(f"static const fsm_can_signal {name}[] = {{", "};"):
            out.lines(rows)
    number = NOWHERE if wire.number is None else f"{wire.number}u"
    extended = " | FSM_CAN_EXTENDED" if message.is_extended else ""
    return (
        f"{{0x{message.frame:x}u{extended}, {number}, {message.cycle}u, {message.length}u, "
        f"{str(message.is_fd).lower()}, {len(rows)}u, {name if rows else 'NULL'}}}, "
        f"/* {comment(message.name)} */"
    )


def _selector(signal: Signal, number: int) -> str:
    flags = _flags(signal) | {"FSM_CAN_SELECTS"}
    raw = _unsigned(number)
    return (
        f"{{{signal.lowest}u, {signal.bits}u, {_either(flags)}, 0u, 0u, 0u, NULL, {raw}, {raw}, "
        f"{raw}}},"
    )


def _signal(signal: Signal, value: int | None, types: Sequence[Type], raw: str) -> str:
    flags = _flags(signal)
    at = size = 0
    least, most = signal.raw_bounds
    shift = signal.shift
    if value is None:
        shift = signal.raw_of(signal.idle)
    else:
        at, size = places(types)[value], size_of([types[value]])
        if not isinstance(types[value], FloatType) and RANGES[code_of(types[value])][0] < 0:
            flags.add("FSM_CAN_SIGNED_VALUE")
    return (
        f"{{{signal.lowest}u, {signal.bits}u, {_either(flags)}, {at}u, {size}u, "
        f"{len(signal.members)}u, {raw}, {_unsigned(least)}, {_unsigned(most)}, "
        f"{_unsigned(shift)}}}, /* {comment(signal.name)} */"
    )


def _flags(signal: Signal) -> set[str]:
    chosen = {
        "FSM_CAN_BIG": signal.is_big_endian,
        "FSM_CAN_SIGNED": signal.is_signed and not isinstance(signal.type, FloatType),
        "FSM_CAN_NEGATED": signal.sign < 0,
        "FSM_CAN_FLOAT": isinstance(signal.type, FloatType),
    }
    return {name for name, is_set in chosen.items() if is_set}


def _either(flags: set[str]) -> str:
    return " | ".join(sorted(flags)) or "0"


def _unsigned(value: int) -> str:
    return f"UINT64_C({value % 2**64})"


def _signed(value: int) -> str:
    return f"INT64_C({value})" if value > -(2**63) else "INT64_MIN"
