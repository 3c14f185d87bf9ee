"""Strings joined of variables with few values are known when compiling."""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest

from devtools.random_charts.choices import SeededChoices
from devtools.random_charts.ecmascript import random_scxml
from devtools.runtimes import harnesses
from fsmkit.chart.ecmascript import joined_values
from fsmkit.chart.ecmascript.known_values import MOST_VALUES, find_values
from fsmkit.chart.ecmascript.string_values import Value
from fsmkit.chart.loading import load_with_findings
from fsmkit.diagnostics import Findings, FsmkitError
from fsmkit.testing.conformance.expectations import ends_in
from fsmkit.testing.harness.harness import INTERPRETER, Harness

HEAD = (
    '<scxml xmlns="http://www.w3.org/2005/07/scxml" xmlns:fk="urn:fsmkit:scxml" version="1.0"'
    ' name="M" datamodel="ecmascript" initial="s"><datamodel>{}</datamodel>'
)
FINALS = '<final id="ok"/><final id="bad"/></scxml>'
TOLD = "content-not-evaluable"
DATA = (
    '<data id="i" expr="0"/><data id="on" expr="false"/><data id="s" expr="\'\'"/>'
    '<data id="mode" expr="\'low\'"/><data id="typed" fk:type="0..50" expr="7"/>'
    '<data id="n" expr="0"/>'
)
COUNTED = (
    '<transition event="step" cond="i &lt; {most}"><assign location="i" expr="i + 1"/>'
    '<assign location="on" expr="!on"/>'
    '<if cond="i % 2 == 0"><assign location="mode" expr="\'high\'"/>'
    '<else/><assign location="mode" expr="\'low\'"/></if></transition>'
    '<transition event="more"><assign location="n" expr="n + 1"/></transition>'
)
JOINS = {
    "'lamp ' + i": "lamp 3",
    "i + ' of ' + 4": "3 of 4",
    "'' + i": "3",
    "i + 1 + '!'": "4!",
    "'a' + i + 1": "a31",
    "'a' + (i + 1)": "a4",
    "'on: ' + on": "on: true",
    "on + '/' + mode + '/' + i": "true/low/3",
    "mode + typed": "low7",
    "'<' + (on ? 'yes' : 'no') + i + '>'": "<yes3>",
    "(i > 2 ? 'many' : i) + 'x'": "manyx",
    "'t' + i * 2 % 5": "t1",
    "String(i) + i.toString()": "33",
    "('k' + i).length + 'c'": "2c",
}


def chart(join: str, expected: str, most: int = 4, data: str = DATA) -> str:
    """Return a chart that joins after three steps, and ends in `ok` if it made what it should."""
    text = join.replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;")
    wanted = expected.replace("<", "&lt;").replace(">", "&gt;")
    return (
        f'{HEAD.format(data)}<state id="s">{COUNTED.format(most=most)}'
        f'<transition event="go" target="t"><assign location="s" expr="{text}"/></transition>'
        '<transition event="error" target="bad"/></state>'
        f'<state id="t"><onentry><send event="made"><param name="p" expr="{text}"/></send>'
        "</onentry>"
        f"<transition event=\"made\" cond=\"s == '{wanted}' &amp;&amp; _event.data.p == '{wanted}'"
        f' &amp;&amp; {text} == \'{wanted}\'" target="ok"/>'
        f'<transition event="*" target="bad"/></state>{FINALS}'
    )


SCRIPT = ("start 0", "post step", "post step", "post step", "post go", "run 1", "run 2")


@pytest.mark.parametrize(("join", "expected"), JOINS.items())
def test_a_join_of_known_values_is_known(scxml: Any, join: str, expected: str) -> None:
    result = scxml(chart(join, expected))
    assert TOLD not in result.rules, result.messages
    assert ends_in(INTERPRETER.run(result.chart, SCRIPT)) == ("ok",)


@pytest.mark.external
@pytest.mark.parametrize("runtime", harnesses(), ids=lambda runtime: runtime.name)
def test_every_runtime_makes_the_same_string(runtime: Harness, scxml: Any) -> None:
    for join in ("on + '/' + mode + '/' + i", "mode + typed"):
        result = scxml(chart(join, JOINS[join]))
        assert ends_in(runtime.run(result.chart, SCRIPT)) == ("ok",)


@pytest.mark.parametrize("most", [1, 9, MOST_VALUES - 1])
def test_a_guard_bounds_a_counter(scxml: Any, most: int) -> None:
    script = ("start 0", *["post step", "run 1"] * most, "post step", "post go", "run 1", "run 2")
    result = scxml(chart("'n' + i", f"n{most}", most))
    assert TOLD not in result.rules
    assert ends_in(INTERPRETER.run(result.chart, script)) == ("ok",)


@pytest.mark.parametrize(
    ("join", "most", "data"),
    [
        ("'n' + n", 4, DATA),
        ("'n' + i", MOST_VALUES, DATA),
        ("'n' + i", 10**6, DATA),
        ("'f' + f", 4, DATA + '<data id="f" expr="0.5"/>'),
        ("'u' + u", 4, DATA + '<data id="u"/>'),
        ("'d' + _event.data.x", 4, DATA),
        ("'w' + w", 4, DATA + '<data id="w" fk:type="uint8" expr="0"/>'),
        ("'h' + h", 4, DATA.replace("data>", "data>") + '<data id="h" expr="[1, 2]"/>'),
    ],
)
def test_what_is_not_known_is_told(scxml: Any, join: str, most: int, data: str) -> None:
    result = scxml(chart(join, "", most, data))
    assert TOLD in result.rules


@pytest.mark.parametrize(
    ("regions", "exits", "is_known"), [(False, "", True), (True, "", False), (False, "i", False)]
)
def test_a_guard_counts_only_if_nothing_comes_between(
    scxml: Any, regions: bool, exits: str, is_known: bool
) -> None:
    """A guard says nothing where an exit handler or another region may change the variable."""
    leave = f'<onexit><assign location="{exits}" expr="i * 2"/></onexit>' if exits else ""
    inner = (
        f'<state id="s">{leave}{COUNTED.format(most=4)}<transition event="go">'
        '<assign location="s" expr="\'n\' + i"/></transition></state>'
    )
    body = f'<parallel id="p">{inner}<state id="q"/></parallel>' if regions else inner
    head = HEAD.format(DATA).replace(' initial="s"', "")
    result = scxml(f"{head}{body}</scxml>")
    assert (TOLD not in result.rules) is is_known


def test_the_name_of_the_event_is_a_known_value(scxml: Any) -> None:
    result = scxml(
        f'{HEAD.format(DATA)}<state id="s"><transition event="go stop.now" cond="i == 0">'
        '<assign location="s" expr="\'got \' + _event.name"/></transition>'
        '<transition event="is" cond="s + \'!\' + mode == \'got stop.now!low\'" target="ok"/>'
        f'<transition event="*" target="bad"/></state>{FINALS}'
    )
    assert TOLD not in result.rules
    script = ("start 0", "post go", "post stop.now", "post is", "run 1")
    assert ends_in(INTERPRETER.run(result.chart, script)) == ("ok",)


@pytest.mark.slow
def test_variables_hold_only_known_values(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """On random charts, and on one that counts: what a run stores is among what is known."""
    known: dict[str, frozenset[Value]] = {}

    def find(*given: Any) -> Mapping[str, frozenset[Value]]:
        known.update(find_values(*given))
        return known

    monkeypatch.setattr(joined_values, "find_values", find)
    seen = 0
    for seed in range(60):
        path = tmp_path / f"{seed}.scxml"
        path.write_text(random_scxml(SeededChoices(f"values {seed}")))
        seen += observed(path, ("start 0", *(f"run {10 * n}" for n in range(1, 30))), known)
    path = tmp_path / "counted.scxml"
    path.write_text(chart("'n' + i", "n3"))
    seen += observed(path, ("start 0", *["post step", "post more", "run 1"] * 9), known)
    assert seen > 20


def observed(path: Path, script: tuple[str, ...], known: dict[str, frozenset[Value]]) -> int:
    """Return how many variables of a chart are known; what they hold in a run must be known."""
    known.clear()
    try:
        chart_ = load_with_findings(path, Findings())
    except FsmkitError:
        return 0
    lines = [line for step in script for line in (step, "dump")]
    held: dict[str, set[str]] = defaultdict(set)
    for line in INTERPRETER.run(chart_, lines):
        kind, _, rest = line.partition(" ")
        name, space, value = rest.partition(" ")
        if kind == "d" and space:
            held[name].add(re.sub(r'^"|"$', "", value))
    for name in known.keys() & held.keys():
        told = {str(int(v)) if isinstance(v, bool) else str(v) for v in known[name]}
        assert held[name] <= told, (path, name)
    return len(known.keys() & held.keys())
