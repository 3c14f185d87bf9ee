"""How many of the random charts have each feature: none may be lost without being noticed."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from dataclasses import fields, is_dataclass
from functools import cache
from typing import Any

import pytest

from devtools.differential import Case, elaborated, random_case
from devtools.reduction import Documents
from fsmkit.diagnostics import Source, Span
from fsmkit.document.document import DocState, DocTransition, Document, Kind
from fsmkit.language import ArrayType, EnumType, EventField, RecordType, SymbolType, Type
from fsmkit.language.statements import tree as stmt
from fsmkit.testing.harness.harness import INTERPRETER

CHARTS = 200
FEWEST = 2

Trace = tuple[str, ...]
Has = Callable[[Case, Trace], bool]
HISTORIES = (Kind.SHALLOW_HISTORY, Kind.DEEP_HISTORY)


def nodes(tree: Any) -> Iterator[Any]:
    if isinstance(tree, tuple):
        for part in tree:
            yield from nodes(part)
    elif is_dataclass(tree) and not isinstance(tree, Span | Source | type):
        yield tree
        for part in fields(tree):
            yield from nodes(getattr(tree, part.name))


@cache
def nodes_of(documents: Documents) -> dict[type[Any], list[Any]]:
    found: dict[type[Any], list[Any]] = {}
    for node in nodes(documents):
        found.setdefault(type(node), []).append(node)
    return found


def written(case: Case, kind: type[Any]) -> list[Any]:
    return nodes_of(case.documents).get(kind, [])


def holds_super(tree: Any) -> bool:
    return any(isinstance(node, stmt.Super) for node in nodes(tree))


def refined(case: Case) -> list[DocState]:
    return [state for document in case.documents for state in document.refine]


def overriding(case: Case) -> list[DocTransition]:
    return [t for t in written(case, DocTransition) if t.override is not None]


def is_ecmascript(case: Case) -> bool:
    return case.documents[0].datamodel == "ecmascript"


def payload(kind: type[Type]) -> Has:
    def has(case: Case, trace: Trace) -> bool:
        names = {
            e.name for e in case.chart.events if any(isinstance(f.type, kind) for f in e.fields)
        }
        return any(
            line.startswith("@") and line.split()[3:4] in ([n] for n in names) for line in trace
        )

    return has


def in_ecmascript(pattern: str) -> Has:
    sought = re.compile(pattern)
    return lambda case, _: (
        is_ecmascript(case) and sought.search(case.documents[0].source.text) is not None
    )


def reads_done_data(case: Case, trace: Trace) -> bool:
    """Whether a transition was taken that reads what came with ``done.state.x``."""
    return any(
        d.startswith("done.state.") and f"t {t.index}" in trace
        for t in case.chart.transitions
        if any(isinstance(node, EventField) for node in nodes((t.guard, t.content)))
        for d in t.descriptors
    )


def returns_to(kind: Kind) -> Has:
    """Whether a history within a region was the target of a transition taken."""

    def has(case: Case, trace: Trace) -> bool:
        states = case.chart.states
        found = set()
        for state in states:
            above = state.parent
            while above is not None and states[above].kind is not Kind.PARALLEL:
                above = states[above].parent
            if state.kind is kind and above is not None:
                found.add(state.index)
        taken = (t for t in case.chart.transitions if found & set(t.targets))
        return any(f"t {t.index}" in trace for t in taken)

    return has


def with_delays(has: Has) -> Has:
    return lambda case, trace: has(case, trace) and any(line.startswith("delay ") for line in trace)


def sends(attribute: str) -> Has:
    return lambda case, _: (
        is_ecmascript(case)
        and any(getattr(send, attribute) for send in written(case, stmt.DocSend))
    )


def holds(kind: type[Any]) -> Has:
    return lambda case, _: is_ecmascript(case) and bool(written(case, kind))


FEATURES: dict[str, Has] = {
    "data of final states": lambda case, _: any(s.done_data for s in written(case, DocState)),
    "a reader of the data of final states": reads_done_data,
    "a record in a payload": payload(RecordType),
    "an array in a payload": payload(ArrayType),
    "a string in a payload": payload(SymbolType),
    "an enumeration in a payload": payload(EnumType),
    "deep history in a region": returns_to(Kind.DEEP_HISTORY),
    "shallow history in a region": returns_to(Kind.SHALLOW_HISTORY),
    "deep history in a region, delayed sends": with_delays(returns_to(Kind.DEEP_HISTORY)),
    "shallow history in a region, delayed sends": with_delays(returns_to(Kind.SHALLOW_HISTORY)),
    # inheritance
    "extends": lambda case, _: len(case.documents) > 1,
    "extends twice": lambda case, _: len(case.documents) > 2,
    "super in entry": lambda case, _: any(holds_super(s.entry) for s in refined(case)),
    "super in exit": lambda case, _: any(holds_super(s.exit) for s in refined(case)),
    "super under a condition": lambda case, _: any(map(holds_super, written(case, stmt.If))),
    "replaced content": lambda case, _: any(s.overrides & {"entry", "exit"} for s in refined(case)),
    "another initial": lambda case, _: any("initial" in s.overrides for s in refined(case)),
    "another default": lambda case, _: any("default" in s.overrides for s in refined(case)),
    "super in content": lambda case, _: any(holds_super(t.content) for t in overriding(case)),
    "super in a guard": lambda case, _: any(
        t.guard is not None and "super" in t.guard.value for t in overriding(case)
    ),
    "overridden by trigger": lambda case, _: any(
        t.override is not None and t.override.value == "true" for t in overriding(case)
    ),
    "overridden by id": lambda case, _: any(
        t.override is not None and t.override.value != "true" for t in overriding(case)
    ),
    "first": lambda case, _: any(t.first for t in written(case, DocTransition)),
    "a simple state filled": lambda case, _: any(s.children and s.initial for s in refined(case)),
    "regions for a compound state": lambda case, _: any(
        s.id.endswith(".main") for s in case.chart.states
    ),
    "an abstract state filled": lambda case, _: any(s.abstract for s in written(case, DocState)),
    # ECMAScript
    "ecmascript": lambda case, _: is_ecmascript(case),
    "_event.data": in_ecmascript(r"_event\.data\."),
    "_event.data, one value": in_ecmascript(r"_event\.data\b(?!\.)"),
    "_event.name": in_ecmascript("_event.name"),
    "In()": in_ecmascript(r"In\('"),
    "typeof": in_ecmascript("typeof"),
    "late binding": lambda case, _: is_ecmascript(case) and case.documents[0].late_binding,
    "the script of a chart": lambda case, _: bool(case.documents[0].script),
    "a script": in_ecmascript("<script>"),
    "elseif": in_ecmascript("<elseif"),
    "foreach": holds(stmt.ForEach),
    "send with an id": sends("id"),
    "send with idlocation": sends("id_location"),
    "send with delay": sends("delay"),
    "send with delayexpr": sends("delay_expr"),
    "send with eventexpr": sends("event_expr"),
    "send with namelist": sends("name_list"),
    "send with content": lambda case, _: any(
        s.content is not None or s.content_expr is not None for s in written(case, stmt.DocSend)
    ),
    "send to #_internal": in_ecmascript("#_internal"),
    "cancel": holds(stmt.DocCancel),
    "unreadable content": holds(stmt.Fail),
    "error.execution by bad content": lambda case, trace: (
        is_ecmascript(case) and "error error.execution" in trace
    ),
    "error.communication": lambda case, trace: (
        is_ecmascript(case) and "raise error.communication" in trace
    ),
}


@cache
def cases() -> tuple[tuple[Case, Trace], ...]:
    made = [random_case(7, number) for number in range(CHARTS)]
    return tuple((case, tuple(INTERPRETER.run(case.chart, case.script))) for case in made)


@pytest.mark.slow
@pytest.mark.parametrize("feature", FEATURES)
def test_some_charts_have(feature: str) -> None:
    assert sum(FEATURES[feature](case, trace) for case, trace in cases()) >= FEWEST


def test_a_chart_of_one_state_has_no_feature() -> None:
    source = Source("<one state>", "")
    place = Span(source, 0, 0)
    only = DocState(None, Kind.COMPOUND, place)
    drawn = (random_case(7, number) for number in range(CHARTS))
    case = next(case for case in drawn if len(case.documents) == 1)
    name = case.documents[0].name
    child = DocState(name, Kind.ATOMIC, place)
    documents = (Document(source, name, DocState(None, only.kind, place, children=(child,))),)
    plain = Case(documents, elaborated(documents), ("start 0",))
    trace = tuple(INTERPRETER.run(plain.chart, plain.script))
    assert [name for name, has in FEATURES.items() if has(plain, trace)] == []
