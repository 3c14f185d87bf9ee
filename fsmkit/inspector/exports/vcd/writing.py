"""Value changes (IEEE 1364, 18.2): states and events as strings, numbers as numbers.

A machine is a scope. Strings are the extension that GTKWave and PulseView read. All variables are
declared before the first change, so messages are gathered first.
"""

from __future__ import annotations

import io
from collections.abc import Iterable
from typing import Any, BinaryIO

from fsmkit.inspector.exports import Scene, active_of, event_of, missing, values_of
from fsmkit.runtime.live.messages import AnyMessage, Lost, Set, Step

UNKNOWN = "?"
WIDE = 64


def write(messages: Iterable[AnyMessage], out: BinaryIO) -> None:
    """Write all."""
    try:
        from vcd import VCDWriter
    except ImportError as error:
        raise missing("pyvcd", "VCD", error) from error
    told, scene = list(messages), Scene()
    for message in told:
        scene.take(message)
    text = io.TextIOWrapper(out, encoding="utf-8", write_through=True)
    variables: dict[tuple[str, str], Any] = {}
    with VCDWriter(text, timescale="1 us", date="", comment="written by fsmkit") as writer:
        taken: set[tuple[str, ...]] = set()
        for machine in scene.hashes:
            scope = _own((plain(machine),), taken)
            for name, start in (("state", UNKNOWN), ("event", "")):
                taken.add((scope, name))
                variables[machine, name] = writer.register_var((scope,), name, "string", init=start)
            chart = scene.chart(machine)
            for each in [] if chart is None else [*chart.data, *chart.inputs, *chart.outputs]:
                kind = {"bool": "wire", "int": "integer", "duration": "integer", "float": "real"}
                of = kind.get(each["type"]["kind"], "string")
                size = {"wire": 1, "integer": WIDE}.get(of)
                name = _own((scope, f"v_{plain(each['name'])}"), taken)
                variables[machine, f"v {each['name']}"] = writer.register_var(
                    (scope,), name, of, size=size, init="" if of == "string" else _start(of)
                )
        for message in told:
            _change(writer, variables, scene, message)
    text.detach()


def plain(name: str) -> str:
    """Return a name of letters and digits alone, as any reader takes it."""
    return "".join(c if c.isalnum() else "_" for c in name) or "_"


def _own(path: tuple[str, ...], taken: set[tuple[str, ...]]) -> str:
    """Return the last element of a path, made unique by a number, and reserve it."""
    *above, name = path
    number, own = 1, name
    while (*above, own) in taken:
        number += 1
        own = f"{name}_{number}"
    taken.add((*above, own))
    return own


def _start(of: str) -> object:
    """Return the representation of an unknown value."""
    return 0.0 if of == "real" else "x"


def _change(writer: Any, variables: dict[tuple[str, str], Any], scene: Scene, one: Any) -> None:
    if isinstance(one, Lost):
        at = scene.microseconds(one.at)
        for (machine, name), variable in variables.items():
            if name == "state" and one.m in ("", machine):
                writer.change(variable, at, UNKNOWN)
        return
    machine = getattr(one, "m", "")
    if (machine, "state") not in variables:
        return
    at = scene.microseconds(one.at)
    event, on = event_of(one), active_of(one)
    if isinstance(one, Step):
        writer.change(variables[machine, "event"], at, word(event))
    if on is not None:
        leaves = " ".join(scene.leaves(machine, on))
        writer.change(variables[machine, "state"], at, word(leaves))
    values = one.inputs.items() if isinstance(one, Set) else values_of(one)
    for name, value in values:
        variable = variables.get((machine, f"v {name}"))
        if variable is not None:
            writer.change(variable, at, _value(variable, value))


def word(text: str) -> str:
    """Return a text as one word, which a string of VCD is."""
    return "".join("_" if c.isspace() else c for c in text if c.isprintable()) if text else "-"


def _value(variable: Any, value: object) -> object:
    """Return a value as its variable takes it."""
    match value:
        case {"int": digits}:
            value = int(str(digits))
        case {"float": digits}:
            value = float(str(digits))
        case _:
            pass
    of = getattr(variable.type, "value", variable.type)
    if of == "string":
        return word(str(value))
    if of == "real":
        return float(value) if isinstance(value, int | float) else 0.0
    if isinstance(value, bool):
        return int(value)
    return value % 2**WIDE if isinstance(value, int) else "x"
