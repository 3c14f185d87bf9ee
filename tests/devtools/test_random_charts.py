"""The generator of random charts makes what it promises, and exercises what it makes."""

from __future__ import annotations

from collections import Counter
from dataclasses import fields, is_dataclass
from functools import cache
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings

from devtools.differential import Case, elaborated, random_case
from devtools.random_charts.charts import documents
from fsmkit.diagnostics import Span
from fsmkit.document.document import Document, Trigger
from fsmkit.testing.harness.harness import INTERPRETER

CASES = 250


@cache
def cases() -> tuple[tuple[Case, tuple[str, ...]], ...]:
    made = [random_case(7, number) for number in range(CASES)]
    return tuple((case, tuple(INTERPRETER.run(case.chart, case.script))) for case in made)


def nodes(tree: Any) -> list[Any]:
    if isinstance(tree, tuple):
        return [found for part in tree for found in nodes(part)]
    if is_dataclass(tree) and not isinstance(tree, Span | type):
        below = [found for part in fields(tree) for found in nodes(getattr(tree, part.name))]
        return [tree, *below]
    return []


@pytest.mark.slow
@settings(max_examples=60, deadline=None, suppress_health_check=list(HealthCheck), database=None)
@given(documents())
def test_drawn_documents_elaborate_without_errors(document: Document) -> None:
    assert len(elaborated((document,)).states) > 1


def test_the_same_seed_gives_the_same_case() -> None:
    assert random_case(3, 4) == random_case(3, 4)
    assert random_case(3, 4).documents != random_case(3, 5).documents


@pytest.mark.slow
def test_charts_hold_everything_there_is() -> None:
    kinds: Counter[str] = Counter()
    for case, _ in cases():
        kinds.update(state.kind.value for state in case.chart.states)
        kinds.update(transition.trigger.value for transition in case.chart.transitions)
        for transition in case.chart.transitions:
            kinds["internal"] += transition.internal
            kinds["guard"] += transition.guard is not None
            kinds["targetless"] += not transition.targets
            kinds["several targets"] += len(transition.targets) > 1
            is_default = transition.trigger is Trigger.INITIAL
            kinds["content of a default"] += is_default and bool(transition.content)
            for descriptor in transition.descriptors:
                kinds["wildcard"] += descriptor == "*"
                kinds["prefix"] += descriptor == "group"
                kinds["done"] += descriptor.startswith("done.state.")
        kinds["defer"] += any(state.defer for state in case.chart.states)
        kinds.update(
            type(node).__name__ for node in nodes((case.chart.transitions, case.chart.states))
        )
        kinds.update(type(variable.type).__name__ for variable in case.chart.data)
    rare = {name: kinds[name] for name in EXPECTED if kinds[name] < EXPECTED[name]}
    assert not rare


EXPECTED = dict.fromkeys(
    (
        *("atomic", "compound", "parallel", "final", "choice", "shallow history", "deep history"),
        *("event", "eventless", "after", "every", "initial"),
        *("internal", "guard", "targetless", "several targets", "content of a default"),
        *("wildcard", "prefix", "done", "defer"),
        *("Assign", "Raise", "Send", "Cancel", "Log", "If", "ForEach", "Reply", "CallOperation"),
        *("InState", "Element", "EventField", "Conditional", "Convert", "Apply", "Call", "Unary"),
        *("IntType", "BoolType", "EnumType", "SymbolType", "FloatType", "ArrayType"),
        *("DurationType", "RecordType", "Member"),
    ),
    5,
)


@pytest.mark.slow
def test_scripts_make_the_charts_move() -> None:
    verbs: Counter[str] = Counter()
    taken = 0
    for case, trace in cases():
        verbs.update(" ".join(line.split()[1:3]) for line in trace if line.startswith("@"))
        verbs.update(line.split()[0] for line in trace)
        verbs.update(line for line in trace if line.startswith(("error", "full", "fault")))
        verbs.update(line.split()[0] for line in case.script)
        numbers = {line for line in trace if line.startswith("t ")}
        taken += len(numbers)
    for verb in ("+", "-", "t", "op", "out", "raise", "send", "delay", "cancel", "log", "reply"):
        assert verbs[verb] >= 10, verb
    for verb in ("> start", "> event", "> timeout", "unhandled", "dispatch", "input"):
        assert verbs[verb] >= 50, verb
    for verb in ("error error.execution", "error error.range", "full queue", "full delayed"):
        assert verbs[verb] >= 10, verb
    assert verbs["fault microsteps"] >= 2
    assert verbs["fault internal"] >= 2
    assert taken >= 2 * CASES
