"""Charts that the library cannot express are rejected, with location and advice."""

from __future__ import annotations

import pytest

from devtools.transitions_harness import TransitionsHarness
from fsmkit.chart.chart import Chart
from fsmkit.chart.elaborate import elaborate
from fsmkit.codegen.transitions.limits import check
from fsmkit.codegen.transitions.plugin import PLUGIN
from fsmkit.diagnostics import Findings, Source
from fsmkit.testing.harness.harness import INTERPRETER
from fsmkit.yaml.reader import read_document

HEAD = """\
chart: Refused
data: {n: uint8 = 0, m: uint8 = 0, near: 0..9 = 0, a: "uint8[3] = 0", b: "uint8[3] = 1"}
operations: ["act(x uint8)", "ask() -> bool"]
events:
  in: [go, back, "tell(n 0..9)", "more(k bool, n 0..9)", "query() -> 0..9"]
  out: [gone]
"""
REGIONS = """\
initial: p
states:
  out: {}
  p:
    regions:
      left:
        initial: l1
        states:
          l1: {on: {go: LEFT}}
          l2: {}
      right:
        initial: r1
        states:
          r1: {on: {go: RIGHT}}
          r2: {}
"""


def chart_of(text: str) -> Chart:
    findings = Findings()
    document = read_document(Source("refused.yaml", HEAD + text), findings)
    assert document is not None, [d.message for d in findings]
    chart = elaborate((document,), findings)
    assert chart is not None, [d.message for d in findings]
    return chart


def refusals(text: str) -> list[tuple[str, str, str | None]]:
    """Return message, first line of the place, and help."""
    findings = Findings()
    made = PLUGIN.generate(chart_of(text), findings, {})
    assert (made is None) == findings.has_errors
    assert {d.rule.name for d in findings} <= {"transitions-limit"}
    found = []
    for one in findings:
        assert one.primary is not None
        span = one.primary.span
        found.append((one.message, span.source.text[span.start : span.end], one.help))
    return found


def simple(state: str, more: str = "") -> str:
    return f"initial: s\nstates:\n  s: {state}\n  t: {{}}\n{more}"


INSIDE = "  c: {initial: d, states: {d: {on: {go: h}}, e: {}, h: {history: deep, default: e}}}\n"
PARALLEL = (
    "  c: {regions: {x: {initial: d, states: {d: {}}}, y: {}, h: {history: deep, default: d}}}\n"
)
REFUSED = {
    "a way to a history from inside": (
        simple("{on: {go: c}}", INSIDE),
        "a history from inside",
        "h",
    ),
    "a history of regions": (simple("{on: {go: h}}", PARALLEL), "no history of regions", "h"),
    "a delay that is computed": (
        simple("{entry: send go after n * 1s}"),
        "this delay can be negative",
        "send go after",
    ),
    "an initial state below a child of a region": (
        REGIONS.replace("initial: l1", "initial: l3")
        .replace("l2: {}", "l2: {initial: l3, states: {l3: {}}}")
        .replace("LEFT", "l2")
        .replace("RIGHT", "r2"),
        "initial states of regions",
        "l3",
    ),
    "a deferred event": (simple("{defer: go, on: {back: t}}"), "no deferred", "s"),
    "an event to itself": (simple("{entry: send go}"), "no second queue", "send go"),
    "an answer": (simple("{on: {query: {do: reply 3}}}"), "no answer", "reply 3"),
    "a division": (simple("{entry: n = 5 / m}"), "this can fail", "5 / m"),
    "an index": (simple("{entry: 'a[n] = 5'}"), "this can fail", "a[n] = 5"),
    "a range": (simple("{entry: near += 1}"), "can leave 0..9", "near += 1"),
    "the configuration in content": (
        simple("{on: {go: {target: t, do: act(1 if In(s) else 2)}}}"),
        "during a step",
        "In(s)",
    ),
    "fields that stand elsewhere": (
        simple("{on: {tell more: {target: t, do: n = event.n}}}"),
        "by position",
        "event.n",
    ),
    "several targets": (
        REGIONS.replace("out: {}", "out: {on: {back: [{target: [l2, r2]}]}}")
        .replace("LEFT", "{target: l2}")
        .replace("RIGHT", "{target: out}"),
        "only one destination",
        "",
    ),
    "the way into a region": (
        REGIONS.replace("out: {}", "out: {on: {back: l2}}")
        .replace("LEFT", "l2")
        .replace("RIGHT", "r2"),
        "no transition into one region of `p`",
        "l2",
    ),
    "the way to another region": (
        REGIONS.replace("LEFT", "r2").replace("RIGHT", "{do: n = 1}"),
        "no transition from one region to another",
        "r2",
    ),
    "an exit on the way in": (
        simple("{on: {go: d}, initial: e, states: {d: {}, e: {}}}"),
        "no exit from a state on the way into it",
        "d",
    ),
    "a grandchild": (
        simple(
            "{on: {go: {target: f, type: internal}}, initial: e, "
            "states: {e: {initial: f, states: {f: {}, g: {}}}}}"
        ),
        "another meaning for this where `e` is active",
        "",
    ),
    "regions of regions": (
        REGIONS.replace("l2: {}", "l2: {regions: {a: {}, b: {}}}")
        .replace("LEFT", "l2")
        .replace("RIGHT", "{do: n = 1}"),
        "while regions have regions",
        "l2",
    ),
    "the end of all regions": (
        REGIONS.replace("  p:\n", "  p:\n    on: {done.state.p: out}\n")
        .replace("l2: {}", "l2: {final: true}")
        .replace("r2: {}", "r2: {final: true}")
        .replace("LEFT", "l2")
        .replace("RIGHT", "r2"),
        "the end of all regions",
        "p",
    ),
}


@pytest.mark.parametrize("name", REFUSED)
def test_is_refused_with_its_place(name: str) -> None:
    text, message, place = REFUSED[name]
    found = refusals(text)
    fitting = [one for one in found if message in one[0]]
    assert fitting, found
    assert all(one[2] for one in found)
    assert any(place in one[1] for one in fitting), fitting


ACCEPTED = {
    "an exit that sends what the transition cancels": simple(
        "{exit: 'send back after 1s as x', on: {go: {target: t, do: cancel x}}}"
    ),
    "a timeout": simple("{after: {1s: t}}"),
    "a period": simple("{every: {1s: t}}"),
    "an eventless transition": simple("{always: {target: t, if: n < 3}}"),
    "a choice": simple("{on: {go: c}}", "  c: {choice: [{if: n > 1, target: s}, {target: t}]}\n"),
    "a delayed event": simple("{entry: send go after 1s}"),
    "a cancelled event": simple('{entry: "send go after 1s as x", exit: cancel x}'),
    "content between exits and entries": simple(
        "{exit: act(1), on: {go: {target: u, do: act(2)}}}", "  u: {entry: act(3)}\n"
    ),
    "history": simple(
        "{on: {go: h}}", "  c: {initial: d, states: {d: {}, h: {history: deep, default: d}}}\n"
    ),
    "preemption between regions": REGIONS.replace("LEFT", "out").replace("RIGHT", "r2"),
    "what both regions tell": REGIONS.replace("LEFT", "{target: l2, do: n = m}").replace(
        "RIGHT", "{target: r2, if: n == 0}"
    ),
    "a state that reacts besides its region": REGIONS.replace(
        "  p:\n", "  p:\n    on: {go: {do: n = 1}}\n"
    )
    .replace("LEFT", "l2")
    .replace("RIGHT", "{target: r2, if: m == 0}"),
    "exits in two regions": REGIONS.replace("l1: {", "l1: {exit: act(1), ")
    .replace("r1: {", "r1: {exit: act(2), ")
    .replace("  p:\n", "  p:\n    on: {back: out}\n")
    .replace("LEFT", "l2")
    .replace("RIGHT", "r2"),
    "entries at several levels": REGIONS.replace("l1: {", "l1: {entry: act(1), ")
    .replace("      right:\n", "      right:\n        entry: act(2)\n")
    .replace("LEFT", "l2")
    .replace("RIGHT", "{do: n = 1}"),
    "content before entries": simple("{exit: n = 1, on: {go: {target: t, do: act(m)}}}"),
    "content after entries": simple(
        "{exit: n = 1, on: {go: {target: u, do: act(n)}}}", "  u: {entry: m = 3}\n"
    ),
    "bounded by min and max": simple("{entry: 'near = min(9, max(0, n))'}"),
    "regions that do not meet": REGIONS.replace("LEFT", "{target: l2, do: n = 1}").replace(
        "RIGHT", "{target: r2, do: m = 1}"
    ),
    "regions that tell in order": REGIONS.replace("LEFT", "{target: l2, do: act(1)}").replace(
        "RIGHT", "{target: r2, do: act(2)}"
    ),
    "an array assigned as a whole": simple("{entry: 'b = a; act(b[1])'}"),
    "an internal transition": simple(
        "{on: {go: {target: d, type: internal}}, initial: e, states: {d: {}, e: {}}}"
    ),
    "the end of a compound state": simple(
        "{on: {done.state.s: t}, initial: e, states: {e: {on: {go: f}}, f: {final: true}}}"
    ),
}


@pytest.mark.parametrize("name", ACCEPTED)
def test_is_accepted_and_means_the_same(name: str) -> None:
    text = ACCEPTED[name]
    assert refusals(text) == []
    chart = chart_of(text)
    assert check(chart, Findings())
    script = [
        "start 0",
        "post go",
        "run 1",
        "post back",
        "post go",
        "run 2",
        "run 1000",
        "run 3100",
    ]
    script += ["post go", "post go", "post back", "run 3100", "dump"]
    expected = INTERPRETER.run(chart, script)
    assert TransitionsHarness().run(chart, script) == expected
    assert any(line.startswith("t ") for line in expected) or "entry" in text
