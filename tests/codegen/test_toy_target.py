"""A target of another package is found and used, and behaves like the interpreter."""

from __future__ import annotations

import importlib.metadata
import os
from collections.abc import Iterator
from dataclasses import replace
from itertools import count, cycle, islice
from pathlib import Path

import pytest

import fsmkit
import fsmkit.language as lang
from devtools.differential import elaborated, first_difference
from devtools.random_charts.charts import random_document
from devtools.random_charts.choices import Choices, SeededChoices
from devtools.random_charts.content import Event
from devtools.random_charts.declarations import COLOR, RANGES, Declared
from devtools.random_charts.scripts import random_script
from devtools.random_charts.vocabulary import literal
from fsmkit import plugins
from fsmkit.chart.chart import Chart
from fsmkit.diagnostics import Findings
from fsmkit.document.document import Direction, DocState, Kind
from fsmkit.plan import lower
from fsmkit.testing.harness.harness import INTERPRETER, harness
from tests.codegen.toy_target import plugin as toy_target

CHARTS = int(os.environ.get("FSMKIT_TOY_CHARTS", "10"))
"""The number of random charts to compare."""
FEATURES = ("timeouts", "periods", "raises", "fails", "ends")
MECHANISMS = (
    *(kind.value for kind in (Kind.PARALLEL, Kind.SHALLOW_HISTORY, Kind.DEEP_HISTORY)),
    *(kind.value for kind in (Kind.FINAL, Kind.CHOICE)),
    *FEATURES,
)
"""Kinds of states and features of machines, each of which some chart has."""
TYPES: tuple[lang.Type, ...] = (
    *(type_ for type_ in RANGES if type_.overflow is not lang.Overflow.FAULT),
    *(lang.MACHINE_INTEGERS[name] for name in ("uint8", "int8", "uint16", "int16", "int32")),
    lang.BOOL,
    COLOR,
)


class EntryPoint:
    """As an installed package has one in the group `fsmkit.plugins`."""

    def load(self) -> toy_target.AwkTarget:
        return toy_target.PLUGIN


@pytest.fixture(autouse=True)
def installed(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    monkeypatch.setattr(plugins, "_may_be_registered", lambda: True)
    monkeypatch.setattr(
        importlib.metadata, "entry_points", lambda group: [EntryPoint()] if group else []
    )
    for cached in (plugins._every_plugin, plugins._of_kind):
        cached.cache_clear()
    yield
    for cached in (plugins._every_plugin, plugins._of_kind):
        cached.cache_clear()


def declared(choices: Choices) -> Declared:
    """Return declarations that awk can express."""
    types = [choices.pick(TYPES) for _ in range(choices.integer(1, 6))]
    variables = tuple((f"v{n}", type_, literal(choices, type_)) for n, type_ in enumerate(types))
    directions = (Direction.IN, Direction.IN, Direction.IN, Direction.INTERNAL, Direction.OUT)
    names = ("e0", "e1", "group.g2", "n0", "out0")
    events = tuple(
        Event(
            name,
            tuple(
                lang.Field(f"p{n}", choices.pick(TYPES))
                for n in range(0 if name == "e0" else choices.integer(0, 2))
            ),
            frozenset({direction}),
        )
        for name, direction in zip(names, directions, strict=True)
    )
    half = len(types) // 2
    return Declared((COLOR,), (), variables[half:], (), variables[:half], (), events)


def without_deferral(state: DocState) -> DocState:
    """Return a state that defers no events, nor does any state in it."""
    return replace(state, defer=(), children=tuple(map(without_deferral, state.children)))


def mechanisms(chart: Chart) -> set[str]:
    """Return the kinds of the states of a chart, and the features of its machine."""
    features = lower(chart).features
    kinds = {state.kind.value for state in chart.states}
    return kinds | {each for each in FEATURES if getattr(features, each)}


def examples() -> Iterator[tuple[str, Chart]]:
    """Yield random charts that awk can express with their seeds; each mechanism in its turn."""
    seeds = count()
    for mechanism in cycle(MECHANISMS):
        for seed in map("toy:{}".format, seeds):
            choices = SeededChoices(seed)
            document = random_document(choices, declared=declared(choices))
            chart = elaborated((replace(document, root=without_deferral(document.root)),))
            if mechanism in mechanisms(chart) and not any(toy_target.limits(chart)):
                yield seed, chart
                break


@pytest.mark.cc
def test_random_charts_do_as_in_the_interpreter() -> None:
    awk, words = harness("awk"), set[str]()
    for seed, chart in islice(examples(), CHARTS):
        script = random_script(SeededChoices(seed), chart)
        expected = INTERPRETER.run(chart, script)
        difference = first_difference("awk", expected, awk.run(chart, script))
        assert difference is None, f"{seed}: {difference}"
        words |= {line.split()[0] for line in expected}
    assert words >= {"raise", "delay", "out", "error", "log", "cancel"}


def test_it_is_a_target_as_any_other(tmp_path: Path) -> None:
    path = tmp_path / "lamp.yaml"
    path.write_text(
        "chart: Lamp\nevents: {in: [toggle]}\ndata: {count: 0..9 = 0}\ninitial: off\n"
        "states: {off: {on: {toggle: on}}, on: {entry: count += 1, after: {3s: off}}}\n"
    )
    assert fsmkit.compile(path, "awk")["Lamp.awk"].startswith("BEGIN {")


@pytest.mark.parametrize(
    ("declarations", "state", "message"),
    [
        ("operations: ['stop()']", "entry: stop()", "operations, inputs"),
        ("inputs: {pressed: bool}", "after: {1s: {if: pressed}}", "operations, inputs"),
        ("data: {x: float64 = 0.5}", "entry: x = 1.5", "the type of `x`"),
        ("data: {x: '0..9 fault = 1'}", "entry: x = 2", "the type of `x`"),
        ("data: {x: int64 = 1}", "entry: x = 2", "the type of `x`"),
        ("data: {x: 'bool[2]'}", "entry: 'x[0] = true'", "the type of `x`"),
        ("data: {x: duration = 1s}", "entry: 'send late after (x)'", "a delay that is computed"),
        ("data: {x: int32 = 1}", "entry: 'x = x * x * x'", "more than 53 bits"),
        ("data: {x: 0..9 = 1}", "entry: 'for i in 0..3 {x = i}'", "this statement"),
        ("", "defer: [late]", "the deferral of events in `a`"),
        ("", "entry: 'raise late'", None),
    ],
)
def test_it_rejects_what_it_lacks(
    tmp_path: Path, declarations: str, state: str, message: str | None
) -> None:
    path = tmp_path / "lamp.yaml"
    head = "chart: Lamp\nevents: {in: [late], internal: [late]}\ninitial: a\n"
    path.write_text(f"{head}{declarations}\nstates: {{a: {{{state}}}}}\n")
    findings = Findings()
    found = toy_target.PLUGIN.generate(fsmkit.read_chart(path), findings, {})
    messages = [each.message for each in findings]
    if message is None:
        assert found is not None
        assert not messages
    else:
        assert found is None
        assert any("awk lacks" in each and message in each for each in messages), messages
