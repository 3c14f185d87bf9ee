"""The report of all evidence: its parts, what it must not claim, and hostile texts."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Any

import pytest

from fsmkit.cli import execute
from fsmkit.cli.proving import evidence as verb
from fsmkit.testing.evidence.eva import Proof
from fsmkit.testing.evidence.misra import Lint
from fsmkit.testing.evidence.report import TITLES, Evidence, MachineEvidence, page
from fsmkit.testing.evidence.standards import IEC, ISO
from fsmkit.testing.requirements.certificates import certificate_of
from tests.testing.requirements.test_matrix import HOSTILE, Page

GATE = """\
chart: Gate
inputs: {train: bool}
events: {in: [request]}
properties:
  shut: {never: In(open) and train and not train, req: SAFE-1}
initial: closed
states:
  closed: {rest: true, on: {request: {if: not train, target: open, req: FUN-1}}}
  open: {rest: true, on: {request: closed}}
"""
TESTS = """\
tests: Gate
chart: gate.yaml
before: [set train false]
cases:
  opens: {req: FUN-1, steps: [post request, {expect: {in: open}}]}
"""


@pytest.fixture
def gate(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "gate.yaml").write_text(GATE)
    (tmp_path / "gate.test.yaml").write_text(TESTS)
    (tmp_path / "r.csv").write_text("id,text\nSAFE-1,Shut.\nFUN-1,Opens.\n")
    monkeypatch.chdir(tmp_path)
    which = shutil.which
    absent = ("frama-c", "cppcheck", *verb.BROWSERS)
    monkeypatch.setattr(shutil, "which", lambda name, **_: None if name in absent else which(name))


def collected(capsys: pytest.CaptureFixture[str], *words: str) -> tuple[int, dict[str, Any]]:
    code = execute(["evidence", "gate.yaml", "--out", "ev", "--json", *words])
    found = json.loads(capsys.readouterr().out)
    assert isinstance(found, dict)
    return code, found


@pytest.mark.cc
@pytest.mark.slow
@pytest.mark.external
@pytest.mark.usefixtures("gate")
def test_the_report_has_all_parts(capsys: pytest.CaptureFixture[str]) -> None:
    words = ("-r", "r.csv", "--tests", ".", "--mutants", "2")
    code, found = collected(capsys, *words)
    assert (code, found["failures"]) == (0, [])
    assert found["verdict"] == "holds"
    assert found["requirements"]["counts"]["verified"] == 2
    (machine,) = found["machines"]
    assert machine["certificate"]["result"] == "complete"
    assert (machine["alarms"], machine["deviations"]) == (None, None)  # nothing was analysed
    assert len(found["mutants"]["mutants"]) == 2
    assert found["tests"]["coverage"]["conditions"] == {"covered": 0, "all": 1}
    assert found["files"] == ["ev/report.html", "ev/evidence.json"]
    text = Path("ev/report.html").read_text()
    read = Page()
    read.feed(text)
    assert not read.tags & {"script", "link", "iframe"}
    for part in TITLES:
        assert f'id="{part}"' in text
    assert "It is not a certification" in text
    assert "Frama-C is not installed" in text
    # rows of tables that need analyses are not claimed
    assert text.count("not in this report") == sum(one.part == "analyses" for one in (*IEC, *ISO))
    # the certificate of before is taken, and an edited one is not
    certificate = machine["certificate"]
    Path("c.json").write_text(json.dumps(certificate))
    code, found = collected(capsys, "--certificate", "c.json", "--mutants", "0")
    assert (code, found["machines"][0]["certificate"]) == (0, certificate)
    Path("c.json").write_text(json.dumps({**certificate, "result": "perfect"}))
    assert execute(["evidence", "gate.yaml", "--out", "ev", "--certificate", "c.json"]) == 1
    assert "broken-certificate" in capsys.readouterr().err


@pytest.mark.cc
@pytest.mark.external
@pytest.mark.usefixtures("gate")
def test_what_failed_is_named(capsys: pytest.CaptureFixture[str]) -> None:
    gate, tests = Path("gate.yaml"), Path("gate.test.yaml")
    gate.write_text(GATE.replace("In(open) and train and not train", "In(open)"))
    tests.write_text(TESTS.replace("in: open", "in: closed"))
    words = ("-r", "r.csv", "--tests", ".", "--mutants", "0", "--per-machine", "10s")
    code, found = collected(capsys, *words)
    assert code == 1
    assert found["failures"] == [
        "the check: violated", "the test `opens` failed", "2 requirements are failed",
    ]  # fmt: skip


def evidence_of(**more: Any) -> Evidence:
    checked: dict[str, Any] = {
        "verdict": "holds", "states": 1, "transitions": 1, "complete": True, "seconds": 0.1,
        "engine": "c", "time": "zones", "properties": [], "assumptions": [], "bounds": {},
    }  # fmt: skip
    given: dict[str, Any] = {
        "title": "T", "version": "1", "model": "t.yaml", "sources": (), "checked": checked,
        "mutants": None, "cases": (), "coverage": (), "machines": (), "matrix": None,
    }  # fmt: skip
    return Evidence(**given | more)


def test_an_empty_report_claims_no_technique_but_model_and_check() -> None:
    text = page(evidence_of())
    supported = [one for one in (*IEC, *ISO) if one.part in ("model", "check")]
    assert text.count("not in this report") == len(IEC) + len(ISO) - len(supported)


@pytest.mark.parametrize("failure", ["it did not end within 30 s", "it failed: <b>"])
def test_an_analysis_that_did_not_end_proves_nothing(failure: str) -> None:
    machine = MachineEvidence(
        "m", "m.yaml", None, "no", Proof((), 0, failure), Lint({}, (), failure)
    )
    evidence = evidence_of(machines=(machine,))
    assert "analyses" not in evidence.parts()
    text = page(evidence)
    assert "no alarm" not in text
    assert "undecided" in text
    assert "it failed: <b>" not in text


def test_an_alarm_and_a_difference_are_failures() -> None:
    certificate = {
        "chart": "m", "fingerprint": "0", "target": "t", "compiler": "c", "result": "different",
        "steps": 1, "states": 1, "differences": [{}],
    }  # fmt: skip
    assert certificate_of(certificate, Path("c.json")).differences == 1
    machine = MachineEvidence("m", "m.yaml", certificate, "", Proof(("overflow",), 90), None)
    assert evidence_of(machines=(machine,)).failures() == (
        "the executions of `m` differ", "EVA reports 1 alarms in `m`",
    )  # fmt: skip


@pytest.mark.parametrize("text", HOSTILE)
def test_hostile_texts_stay_texts(text: str) -> None:
    checked: dict[str, Any] = {
        **evidence_of().checked,
        "properties": [{"name": text, "kind": text, "verdict": text, "reason": text}],
        "assumptions": [text], "engine": text, "bounds": {text: dict.fromkeys(
            ("queue", "timers", "microsteps"), text)},
    }  # fmt: skip
    mutant = dict.fromkeys(("machine", "what", "place", "fate"), text) | {"by": [text]}
    certificate = {
        **dict.fromkeys(("result", "target", "compiler"), text), "states": 1, "steps": 1,
        "maxima": [{"step": text, "instructions": 1, "stack": 2}],
    }  # fmt: skip
    machine = MachineEvidence(
        text, text, certificate, text, Proof((text,), 1), Lint({text: 1}, (text,))
    )
    found = Page()
    found.feed(page(evidence_of(
        title=text, model=text, sources=((text, text),), checked=checked,
        mutants={"mutants": [mutant], "possible": 1}, machines=(machine,),
    )))  # fmt: skip
    assert not found.tags & {"script", "svg", "img", "iframe", "object"}
    assert not {name for name in found.attributes if name.startswith("on") or name == "src"}
    plain = "".join(c if c.isprintable() else " " for c in text)
    assert " ".join(found.text).count(plain) > 10
