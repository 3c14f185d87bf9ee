"""An operation may post an event to the machine that called it, wherever in a step it is called."""

from __future__ import annotations

from pathlib import Path

import pytest

import fsmkit
from devtools.differential import Case, compare_all, target_names
from devtools.runtimes import harness
from fsmkit.testing.harness.harness import INTERPRETER

FLAT = """
chart: Post
operations: [entered(), left(), acted(), asked() -> bool]
events: {in: [go, x, end], out: [gone]}
capacity: {queue: 2}
initial: a
states:
  a:
    exit: left()
    on: {go: {target: b, do: acted()}, end: END}
  b: {entry: entered(), on: {x: {if: asked() || true, target: c}, go: a}}
  c: {exit: left(), on: {go: a, end: END, x: {do: acted()}}}
"""
"""A machine of one region: the number of its active state is 0 in the middle of a step."""
BACK = FLAT.replace("END", "a")
FORMS = {
    "flat": BACK,
    "ends": FLAT.replace("END", "over") + "  over: {final: true, entry: entered()}\n",
    "raises": BACK.replace("do: acted()}, end", "do: [raise own, acted()]}, end").replace(
        "out: [gone]", "internal: [own]"
    ),
    "sends to itself": BACK.replace("do: acted()}, end", "do: [send x, acted(), send x]}, end"),
    "timed": BACK.replace("c: {exit: left(),", "c: {exit: left(), after: {5ms: b},"),
    "nested": BACK
    + "  p: {regions: {q: {states: {r: {entry: entered()}}}, s: {states: {t: {exit: left()}}}}}\n",
    "defers": BACK.replace("b: {entry", "b: {defer: [x, go], entry")
    .replace(
        "on: {x: {if: asked() || true, target: c}, go: a}",
        "on: {x: {if: asked() && false, target: c}}",
    )
    .replace("after: {5ms: b},", "")
    .replace("c: {exit", "c: {defer: [x], exit"),
    "defers in regions": BACK
    + "  p: {regions: {q: {defer: [x], states: {r: {on: {go: {if: asked()}}}}},"
    " s: {defer: [go], states: {t: {on: {x: {if: asked()}}}}}}}\n",
    "enters at the start": BACK.replace("    exit: left()", "    entry: entered()"),
}
SCRIPTS = [
    [f"within {call} x", "start 0", "run 0", *(["post go", "run 1"] * 3), "dump"]
    for call in range(1, 6)
] + [
    # each operation posts until the queue is full, at the end of the machine, and before the start
    ["within 1 x", "start 0", "post go", "post go", "within 1 go", "run 0", "post end",
     "within 1 x", "run 1", "post x", "within 1 x", "run 2", "start 3", "post go", "within 2 x",
     "run 4", "within 1 end", "run 5", "post end", "within 1 x", "run 6", "dump"],
    ["start 0", "post x", "post x", "within 1 x", "dispatch go", "within 1 x", "run 0", "dump"],
    ["post x", "within 1 x", "run 0", "start 0", "within 3 end", "post go", "run 1", "run 20"],
    # guards post into the place of the event that is deferred then
    ["start 0", "post go", "run 0", "post x", "post x", "within 1 go", "within 2 x", "run 1",
     "within 1 x", "run 2", "dump"],
]  # fmt: skip


def cases(tmp_path: Path) -> list[Case]:
    found = []
    for form, text in FORMS.items():
        path = tmp_path / "post.yaml"
        path.write_text(text, encoding="utf-8")
        chart = fsmkit.read_chart(path)
        found += [Case((), chart, tuple(script), form) for script in SCRIPTS]
    return found


@pytest.mark.external
@pytest.mark.cc
@pytest.mark.parametrize("target", target_names())
def test_every_target_does_as_the_interpreter(target: str, tmp_path: Path) -> None:
    totals = compare_all(cases(tmp_path), [harness(target)])
    assert not totals.divergences, totals.divergences[0]
    assert totals.rejected == 0


@pytest.mark.parametrize("form", FORMS)
def test_events_are_posted_and_rejected(form: str, tmp_path: Path) -> None:
    traces = [
        line
        for case in cases(tmp_path)
        if case.name == form
        for line in INTERPRETER.run(case.chart, case.script)
    ]
    assert "post x" in traces
    assert "reject x" in traces


def test_posts_of_an_operation_keep_their_place_among_events_that_the_machine_sends(
    tmp_path: Path,
) -> None:
    answers: list[bool] = []
    path = tmp_path / "order.yaml"
    path.write_text(
        "chart: Order\noperations: [asked()]\nevents: {in: [x, y]}\ncapacity: {queue: 3}\n"
        "states: {a: {entry: [send y, asked(), send y]}}\n"
    )

    def post() -> None:
        answers.extend((session.post("x"), session.post("x"), session.post("x")))

    session = fsmkit.Session(fsmkit.read_chart(path), {"asked": post}, start=False)
    session.start()
    names = [session.chart.events[event.event].name for event in session.snapshot.queue]
    assert names == ["y", "x", "x"]
    assert answers == [True, True, False]
