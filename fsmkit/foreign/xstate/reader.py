"""Reading of machines of XState 5 from JSON, JavaScript and TypeScript."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import PurePath

from fsmkit.diagnostics import Findings, FsmkitError, Source, Span, Text
from fsmkit.foreign.imports import Import
from fsmkit.foreign.xstate.machine import Machine, read_machine
from fsmkit.foreign.xstate.meaning import import_document
from fsmkit.foreign.xstate.script import Creation, Script, arguments
from fsmkit.foreign.xstate.types import declared_events
from fsmkit.foreign.xstate.values import (
    Array,
    Constant,
    Number,
    Record,
    String,
    Value,
    in_order,
)
from fsmkit.yaml import nodes

NUMBER = re.compile(r"-?(?:0|[1-9][0-9]*)(?:\.[0-9]+)?(?:[eE][-+]?[0-9]+)?")
PAIRS = re.compile(r"\\(?:u(d[89ab]..)\\u(d[c-f]..)|.)", re.IGNORECASE | re.DOTALL)
"""An escape of JSON; one for a character in two halves has groups."""
WORDS = {"true": True, "false": False, "null": None}


def machines(source: Source, findings: Findings) -> tuple[str, ...]:
    """Return the names of the machines of a file: of their variables, else of their ids."""
    if source.name.lower().endswith(".json"):
        return (_stem(source),)
    try:
        script = Script(source)
        found = tuple(name for name, _ in _named(script))
        if not found and (broken := script.error_in(script.root)) is not None:
            _report_broken(broken, findings)
        return found
    except FsmkitError as error:
        findings.extend(error.diagnostics)
        return ()


def import_machine(source: Source, machine: str, findings: Findings) -> Import | None:
    """Return a machine as a document with the report, or None after reporting errors."""
    try:
        if source.name.lower().endswith(".json"):
            found = _from_json(source, findings)
        else:
            found = _from_script(Script(source), machine, findings)
        return None if found is None else import_document(found, machine, findings)
    except FsmkitError as error:
        findings.extend(error.diagnostics)
        return None


def _from_json(source: Source, findings: Findings) -> Machine | None:
    source = Source(source.name, PAIRS.sub(_joined, source.text))
    root = nodes.read_nodes(source, findings)
    if root is None:
        return None
    name = Text(_stem(source), Span(source, 0, 0))
    return read_machine(source, name, _value(root), (), {}, findings)


def _joined(escape: re.Match[str]) -> str:
    """Return an escape of JSON as one of YAML, which has no pairs of surrogates."""
    if escape[1] is None:
        return escape[0]
    high, low = (int(half, 16) for half in escape.groups())
    return f"\\U{0x10000 + ((high & 0x3FF) << 10 | low & 0x3FF):08x}"


def _value(node: nodes.Node) -> Value:
    match node:
        case nodes.Mapping(entries, span):
            return Record(in_order((key, _value(value)) for key, value in entries), span)
        case nodes.Sequence(items, span):
            return Array(tuple(map(_value, items)), span)
        case nodes.Scalar(text, quoted):
            if not quoted and text.value in WORDS:
                return Constant(WORDS[text.value], text.span)
            if not quoted and NUMBER.fullmatch(text.value):
                return _number(text)
            return String(text)


def _number(text: Text) -> Value:
    value = float(text.value)
    if value in (float("inf"), float("-inf")):
        return String(text)
    return Number(int(value) if value.is_integer() and abs(value) < 2**53 else value, text.span)


def _stem(source: Source) -> str:
    return PurePath(source.name).name.partition(".")[0] or "machine"


# --- programs -------------------------------------------------------------------------------------


def _named(script: Script) -> Iterator[tuple[str, Creation]]:
    """Yield the machines of a program with different names."""
    taken: set[str] = set()
    for creation in script.creations():
        base = "machine" if creation.name is None else creation.name.value
        name, number = base, 1
        while name in taken:
            number += 1
            name = f"{base}_{number}"
        taken.add(name)
        yield name, creation


def _report_broken(at: Span, findings: Findings) -> None:
    findings.add("foreign-syntax", "this is no JavaScript or TypeScript", at,
                 help="correct the program until it compiles")  # fmt: skip


def _from_script(script: Script, machine: str, findings: Findings) -> Machine | None:
    creation = next(found for name, found in _named(script) if name == machine)
    broken = script.error_in(creation.node)
    if broken is not None:
        _report_broken(broken, findings)
        return None
    given = script.arguments(creation.node)
    setup = () if creation.setup is None else script.arguments(creation.setup)
    if not given:
        findings.add("foreign-construct", "`createMachine` has no configuration",
                     script.span(creation.node), help="pass an object literal")  # fmt: skip
        return None
    raw = [
        next(arguments(call.child_by_field_name("arguments")))
        for call in (creation.node, creation.setup)
        if call is not None and call.child_by_field_name("arguments").named_children
    ]
    name = creation.name or Text(machine, script.span(creation.node), ())
    declared = declared_events(script, raw)
    return read_machine(script.source, name, given[0], (*setup, *given[1:]), declared, findings)
