"""``possible-loop`` and ``leaves-all-regions``: seeded errors are found, and nothing else."""

from __future__ import annotations

import pytest

from fsmkit.chart.elaborate import elaborate
from fsmkit.diagnostics import Findings, Source
from fsmkit.yaml.reader import read_document

HEAD = """
chart: C
inputs: {p: bool, q: bool, x: 0..9}
data: {n: 0..9 wrap = 0, m: 0..9 = 0}
operations: ["ask() -> bool", beep]
events: {in: [go], internal: [hop]}
"""


def rules(text: str, rule: str) -> list[str]:
    findings = Findings()
    document = read_document(Source("c.yaml", HEAD + text), findings)
    assert document is not None, [f.message for f in findings]
    assert elaborate((document,), findings) is not None, [f.message for f in findings]
    found = [f for f in findings if f.rule.name == rule and f.primary is not None]
    return [
        f.primary.span.source.text[f.primary.span.start : f.primary.span.end]
        for f in found
        if f.primary is not None
    ]


def flat(**states: str) -> str:
    body = "".join(f"  {name}: {{{text}}}\n" for name, text in states.items())
    return f"initial: a\nstates:\n{body}"


LOOPS = [
    flat(a="always: {if: p, target: b}", b="always: {if: q, target: a}"),
    flat(a="always: {if: p, target: b}", b="always: {target: a}"),
    flat(a="always: {if: p}"),
    flat(a="always: {if: p, target: a}"),
    flat(a="always: {if: p, do: beep()}"),
    flat(a="always: {if: p, do: n += 1}"),
    flat(a="always: {if: x > 3, target: b}", b="always: {if: x < 7, target: a}"),
    flat(a="always: [{if: p, target: b}, {target: c}]", b="", c="always: {if: q, target: a}"),
    flat(
        a="always: {if: p, target: b}",
        b="always: {if: q, target: c}",
        c="always: {if: x == 3, target: a}",
    ),
    flat(a="on: {go: b}", b="always: {if: m == 0, target: c, do: n += 1}", c="always: b"),
    flat(a="always: {if: x > m, target: b}", b="always: {if: x == 1, target: a}"),
    flat(a="always: {if: x + m > 16, target: b}", b="always: {if: m < 9, target: a}"),
    flat(a="always: {if: not (x / m > 9), target: b}", b="always: {if: p, target: a}"),
    flat(a="initial: i, always: {if: p, target: i}, states: {i: {always: j}, j: {}}"),
    flat(a="on: {go: c}", c="choice: [{if: p, target: d}, {target: a}]", d="always: c"),
    flat(a="always: [{if: p and q, target: b}, {if: p, do: raise hop}]", b=""),
]
REGIONS = (
    "regions: {r: {states: {i: {always: {if: n == 0, target: k}}, k: {always: i}}}, "
    "s: {states: {l: {always: {if: n == 0, target: o, do: n = 1}}, o: {}}}}"
)
QUIET = [
    flat(a="always: {if: p, target: b}", b="always: {if: not p, target: a}"),
    flat(a="always: {if: x > 7, target: b}", b="always: {if: x < 3, target: a}"),
    flat(a="always: {if: -x > m}"),  # by what they lie between
    flat(a="always: {if: x > m, target: b}", b="always: {if: x == 0, target: a}"),
    flat(a="always: {if: x + m > 16, target: b}", b="always: {if: m < 7, target: a}"),
    flat(a="always: {if: x - m >= 0, target: b}", b="always: {if: x < 2 and m == 4, target: a}"),
    flat(a="always: {if: n < 5, do: n += 1}"),
    flat(a="always: {if: n < 5, target: b}", b="entry: n += 1, always: a"),
    flat(a="always: {if: n < 5, target: b}, exit: n += 1", b="always: a"),
    flat(a="always: {if: ask(), target: b}", b="always: {if: p, target: a}"),
    flat(a="always: [{if: p, target: b}, {target: c}]", b="", c="always: {if: p, target: a}"),
    flat(a="always: {if: p, target: b}", b="on: {go: a}"),
    flat(a="on: {go: b}", b="always: {if: p, target: c}", c="always: {if: q, target: d}", d=""),
    flat(a="initial: i, always: {if: In(j), target: i}, states: {i: {on: {go: j}}, j: {}}"),
    flat(
        a="initial: i, always: {if: p, target: b}, states: {i: {always: j}, j: {}}",
        b="on: {go: a}",
    ),
    flat(a=REGIONS),
]


@pytest.mark.parametrize("text", LOOPS)
def test_a_loop_that_nothing_ends_is_found(text: str) -> None:
    assert rules(text, "possible-loop")


@pytest.mark.parametrize("text", QUIET)
def test_a_loop_that_ends_is_none(text: str) -> None:
    assert rules(text, "possible-loop") == []


def test_each_transition_of_the_cycle_is_marked_once() -> None:
    assert rules(LOOPS[0], "possible-loop") == ["{if: p, target: b}", "{if: q, target: a}"]
    assert rules(flat(a="always: b", b="always: a"), "possible-loop") == []
    assert len(rules(flat(a="always: b", b="always: a"), "endless-loop")) == 1


def test_a_chart_of_many_eventless_transitions_is_looked_through_in_time() -> None:
    """The search is bounded: 120 states, each with a way to the next twelve."""
    states = {
        f"s{n}": "always: ["
        + ", ".join(f"{{if: x == {k % 9}, target: s{(n + k) % 120}}}" for k in range(1, 13))
        + "]"
        for n in range(120)
    }
    body = "".join(f"  {name}: {{{text}}}\n" for name, text in states.items())
    rules(f"initial: s0\nstates:\n{body}", "possible-loop")


def parallel(on: str, more: str = "") -> str:
    return (
        "initial: w\nstates:\n  w:\n    regions:\n"
        f"      r: {{states: {{i: {{on: {{go: {on}}}}}, j: {{}}}}}}\n"
        "      s: {states: {k: {}, l: {}}}\n"
        f"      t: {{states: {{o: {{}}}}}}\n  out: {{}}\n{more}"
    )


@pytest.mark.parametrize(
    ("on", "is_found"),
    [
        ("l", True),
        ("s", True),
        ("[j, l]", True),
        ("{target: [j, l, o]}", False),
        ("{target: l, ordered: true}", False),
        ("j", False),
        ("out", False),
        ("w", False),
        ("{do: beep()}", False),
    ],
)
def test_a_target_in_another_region(on: str, is_found: bool) -> None:
    text = parallel(on if on.startswith("{") else f"{{target: {on}}}")
    assert bool(rules(text, "leaves-all-regions")) is is_found


def test_regions_that_are_deeper_count_too() -> None:
    inner = "q: {regions: {u: {states: {v: {on: {go: y}}}}, z: {states: {y: {}, yy: {}}}}}"
    text = f"initial: a\nstates:\n  a: {{states: {{{inner}}}}}\n"
    assert rules(text, "leaves-all-regions") == ["go: y"]


@pytest.mark.parametrize("kind", ["shallow", "deep"])
@pytest.mark.parametrize("target", ["l", "r"])
def test_a_default_leaves_no_region(kind: str, target: str) -> None:
    """The default of a history is taken on entry, when no region is active yet."""
    regions = f"h: {{history: {kind}, default: {target}}}, l: {{}}, r: {{states: {{m1: {{}}}}}}"
    text = flat(a=f"regions: {{{regions}}}, on: {{go: b}}", b="on: {go: h}")
    assert rules(text, "leaves-all-regions") == []
