from __future__ import annotations

import json
import time
from collections.abc import Callable, Sequence
from pathlib import Path

import pytest

from fsmkit.chart.chart import Chart
from fsmkit.chart.loading import load
from fsmkit.cli import execute
from fsmkit.diagnostics import FsmkitError, fail
from fsmkit.testing.conformance.conformance import Case, Result, evaluate, reason_of
from fsmkit.testing.conformance.expectations import (
    configurations,
    ends_in,
    ends_in_pass,
    faults,
    follow_script,
    nearest_is_parallel,
)
from fsmkit.testing.conformance.suites import find_cases, w3c_cases
from fsmkit.testing.harness.harness import INTERPRETER, harness, harnesses

HEAD = '<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" datamodel="ecmascript"'
PASS = f'{HEAD} initial="s"><state id="s"><onentry><send event="e" delay="30s"/></onentry>'
PASS += '<transition event="e" target="pass"/></state><final id="pass"/></scxml>'
FAIL = f'{HEAD} initial="fail"><final id="pass"/><final id="fail"/></scxml>'
LEFT_OUT = f'{HEAD}><state id="s"><onentry><assign location="nothing" expr="f(1)"/></onentry>'
LEFT_OUT += '<transition target="fail"/></state><final id="fail"/></scxml>'
STUCK = f'{HEAD} initial="s"><state id="s"/><final id="pass"/></scxml>'
TOGGLE = f'{HEAD} initial="a"><state id="a"><transition event="t" target="b"/></state>'
TOGGLE += '<state id="b"><onentry><send event="u" delay="100ms"/></onentry>'
TOGGLE += '<transition event="u" target="a"/></state></scxml>'


class FakeHarness:
    name = "fake"

    def __init__(self, act: Callable[[], list[str]]) -> None:
        self._act = act

    def run(self, chart: Chart, script: Sequence[str]) -> list[str]:
        del chart, script
        return self._act()


def suite(tmp_path: Path, charts: dict[str, str], table: str = "") -> Path:
    (tmp_path / "ecma").mkdir()
    for name, text in charts.items():
        (tmp_path / "ecma" / f"{name}.scxml").write_text(text)
    if table:
        (tmp_path / "classification.tsv").write_text(table)
    return tmp_path


def results(folder: Path) -> dict[str, tuple[str, str]]:
    verdicts = [v for c in find_cases(folder) for v in evaluate(c, (INTERPRETER,), 20)]
    return {verdict.name: (verdict.result.value, verdict.reason) for verdict in verdicts}


def test_w3c_tests_must_end_in_pass(tmp_path: Path) -> None:
    table = "files\tmandatory\tmanual\tjudgement\tnote\n"
    table += "test4.txml\tyes\tyes\tstatic\tmanual; look at it\n"
    table += "test5.txml\tyes\tno\tdynamic\t\n"
    table += "test6.txml\tyes\tno\tstatic\tmust reject document\n"
    table += "test7.txml\tno\tno\tstatic\t\ntest8.txml\tyes\tno\tstatic\twhat it is about\n"
    charts = {"test1": PASS, "test2": FAIL, "test3": STUCK, "test4": FAIL, "test5": "<nonsense"}
    charts |= {"test6": "<nonsense", "test1sub1": FAIL, "test7": FAIL, "test8": FAIL}
    charts |= {"test9": LEFT_OUT}
    found = results(suite(tmp_path, charts, table))
    assert found["test1"] == ("passed", "")
    assert found["test2"] == ("failed", "ends in fail")
    assert found["test3"] == ("failed", "does not end: it stays in s")
    assert found["test4"] == ("skipped", "a person must assess it; ends in fail (look at it)")
    assert found["test5"][0] == "skipped"
    assert found["test6"] == ("passed", "")
    assert found["test7"] == ("skipped", "optional; ends in fail")
    assert found["test8"] == ("failed", "ends in fail (what it is about)")
    assert found["test9"][1].startswith("ends in fail (FK0226 content-not-evaluable: ")
    assert found["test9"][1].endswith(" at test9.scxml:1:126)")
    assert len(found) == 9


def test_scripted_charts_are_compared_after_each_event(tmp_path: Path) -> None:
    events = [
        {"event": {"name": "t"}, "nextConfiguration": ["b"]},
        {"after": 200, "event": {"name": "t"}, "nextConfiguration": ["b"]},
        {"event": {"name": "t"}, "nextConfiguration": ["a"]},
    ]
    for name, expected in (("right", events[:2]), ("wrong", events)):
        (tmp_path / f"{name}.scxml").write_text(TOGGLE)
        script = {"initialConfiguration": ["a"], "events": expected}
        (tmp_path / f"{name}.json").write_text(json.dumps(script))
    found = results(tmp_path)
    assert found["right"] == ("passed", "")
    assert found["wrong"] == ("failed", "after event 3 `t`: b instead of a")


REGIONS = f'{HEAD}><datamodel><data id="n" expr="0"/></datamodel>'
REGIONS += '<%s id="p"><onexit><assign location="n" expr="n + 1"/></onexit>'
REGIONS += '<state id="a"><transition event="t" target="a"/></state><state id="b"/></%s>'
REGIONS += '<state id="c"/></scxml>'
"""`t` leaves ``p`` if it is parallel: by Appendix D it is no domain then, though the nearest."""


@pytest.mark.parametrize(
    ("kind", "found", "legacy", "expected"),
    [
        ("parallel", ["a", "b"], None, "passed"),
        ("parallel", ["c"], ["a", "b"], "skipped"),
        ("parallel", ["c"], ["c"], "failed"),
        ("parallel", ["c"], None, "failed"),
        ("state", ["c"], ["a"], "failed"),
    ],
)
def test_a_script_that_contradicts_appendix_d_is_not_counted(
    tmp_path: Path, kind: str, found: list[str], legacy: list[str] | None, expected: str
) -> None:
    def script(after: list[str]) -> dict[str, object]:
        first = ["a", "b"] if kind == "parallel" else ["a"]
        events = [{"event": {"name": "t"}, "nextConfiguration": after}]
        return {"initialConfiguration": first, "events": events}

    whole = script(found) | ({"legacySemantics": script(legacy)} if legacy else {})
    (tmp_path / "x.scxml").write_text(REGIONS % (kind, kind))
    (tmp_path / "x.json").write_text(json.dumps(whole))
    result, reason = results(tmp_path)["x"]
    assert result == expected, reason
    assert ("Appendix D" in reason) == (expected == "skipped")


def test_only_the_nearest_common_ancestor_of_source_and_targets_tells(tmp_path: Path) -> None:
    body = '<transition event="u" target="c"/><transition event="v"/></state><state id="b"/>'
    (tmp_path / "x.scxml").write_text(
        (REGIONS % ("parallel", "parallel")).replace('</state><state id="b"/>', body)
    )
    chart = load(tmp_path / "x.scxml")
    taken = [t for t in chart.transitions if t.descriptors]
    assert [nearest_is_parallel(chart, t) for t in taken] == [True, False, False]


def boom() -> list[str]:
    raise ZeroDivisionError("surprise")


def refuse() -> list[str]:
    raise fail("wrong-value", "the target cannot express it")


def dawdle() -> list[str]:
    time.sleep(5)
    return []


@pytest.mark.parametrize(
    ("act", "reason"),
    [
        (boom, "bug: ZeroDivisionError: surprise"),
        (refuse, "FK0584 wrong-value: the target cannot express it"),
        (dawdle, "takes too long"),
        (lambda: ["@0 > start", "= pass finished"], ""),
        (lambda: ["@0 > start", "fault range", "= s"], "after the fault range"),
    ],
)
def test_each_test_is_isolated(tmp_path: Path, act: Callable[[], list[str]], reason: str) -> None:
    (case,) = find_cases(suite(tmp_path, {"test1": PASS}))
    (verdict,) = evaluate(case, (FakeHarness(act),), 0.3 if act is dawdle else 20)
    assert reason in verdict.reason
    assert (verdict.result is Result.PASSED) == (reason == "")


def test_a_bug_in_loading_is_told_once_for_each_target(tmp_path: Path) -> None:
    case = Case("x", tmp_path, ends_in_pass)
    verdicts = list(evaluate(case, (FakeHarness(boom), FakeHarness(boom)), 20))
    assert [verdict.result for verdict in verdicts] == [Result.FAILED] * 2


def test_traces_are_read() -> None:
    trace = ["@5 > start", "+ a", "= a", "@7 > event x", "fault range", "= b c finished"]
    assert configurations(trace) == [(5, ("a",)), (7, ("b", "c"))]
    assert ends_in(trace) == ("b", "c")
    assert ends_in(trace[:3]) is None
    assert faults(trace) == ["range"]


def test_reasons_are_one_line() -> None:
    assert reason_of(ValueError("a\nb")) == "bug: ValueError: a"
    assert reason_of(ValueError()) == "bug: ValueError: "


def test_the_reference_is_first_and_unknown_ones_are_told() -> None:
    assert harnesses()[0].name == "interpreter"
    assert harness("interpreter") == INTERPRETER
    with pytest.raises(FsmkitError, match="cobol"):
        harness("cobol")


def test_the_verb_counts(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = suite(tmp_path, {"test1": PASS, "test2": FAIL})
    assert execute(["conformance", str(folder)]) == 1
    out = capsys.readouterr().out
    assert "failed  interpreter test2  ends in fail" in out
    assert "interpreter: 1 passed, 1 failed, 0 skipped" in out
    assert execute(["conformance", str(folder), "--json"]) == 1
    document = json.loads(capsys.readouterr().out)
    assert document["passed"] == document["failed"] == 1
    assert document["tests"][0] == {"name": "test1", "target": "interpreter", "result": "passed"}
    (folder / "ecma" / "test2.scxml").unlink()
    assert execute(["conformance", str(folder), "--quiet"]) == 0


def test_a_folder_without_tests_is_a_diagnostic(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert execute(["conformance", str(tmp_path)]) == 1
    assert execute(["conformance", str(tmp_path / "nowhere")]) == 1
    assert "FK0588" in capsys.readouterr().err
    assert not list(w3c_cases(tmp_path))
    assert callable(follow_script({"initialConfiguration": [], "events": []}))
