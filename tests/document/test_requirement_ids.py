"""The key `req`: both notations, inheritance, copies, fingerprints, generated code, systems."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import pytest

from fsmkit.chart.chart import Chart
from fsmkit.chart.loading import load_with_findings
from fsmkit.codegen.c.generate import generate_machine
from fsmkit.diagnostics import Findings, FsmkitError, Source
from fsmkit.document.document import Document
from fsmkit.plan.fingerprint import fingerprint
from fsmkit.scxml.plugin import PLUGIN as SCXML
from fsmkit.system.any_file import read
from fsmkit.system.of_one_chart import system_of_chart
from fsmkit.system.system import System
from fsmkit.yaml.plugin import PLUGIN as YAML

CHART = """\
chart: Door
req: [SYS-1]
inputs: {open: bool}
operations:
  - stop(): {req: [SAFE-1, SAFE-2]}
  - read(n 0..3) -> 0..9: {req: SAFE-3}
  - plain
events: {in: [go, back, reset]}
properties:
  Live: {deadlock_free: true, req: SAFE-9}
  Never: {never: In(run) and open and not open, req: [SAFE-1, SAFE-1]}
  Both: {leads_to: [In(idle), In(run)], req: SAFE-4}
initial: idle
states:
  idle:
    req: A-1 A-2
    on: {go: {target: run, req: T-1}}
    after: {5s: {target: run, req: [T-3]}}
  run:
    on:
      back: {id: b, target: idle, do: stop(), req: [T-2]}
      reset: idle
"""
DERIVED = """\
chart: Lift
extends: door.yaml
req: SYS-2
override: [Never]
properties:
  Never: {never: In(run) and not In(run), req: SAFE-7}
refine:
  idle: {req: [A-3, A-1]}
  run:
    on:
      back: {override: b, req: [T-9], do: super}
      reset: {override: true, target: run}
"""


def loaded(path: Path) -> Chart:
    found = Findings()
    chart = load_with_findings(path, found)
    assert not found.has_errors
    assert chart is not None
    return chart


def ids(*parts: object) -> list[list[str]]:
    return [[text.value for text in part.req] for part in parts]  # type: ignore[attr-defined]


def every_id(chart: Chart) -> dict[str, list[str]]:
    items = {
        "chart": chart,
        **{one.name: one for one in chart.operations},
        **{one.name.value: one for one in chart.properties},
        **{one.id: one for one in chart.states},
        **{f"{chart.states[t.source].id} {t.index}": t for t in chart.transitions},
    }
    return {name: [text.value for text in one.req] for name, one in items.items() if one.req}  # type: ignore[attr-defined]


def without_ids(text: str) -> str:
    """Return a chart without its keys `req`."""
    text = re.sub(r"^ *req: .*$", "", text, flags=re.MULTILINE)
    text = re.sub(r": \{req: .*\}$", "", text, flags=re.MULTILINE)
    return re.sub(r", req: (\[[^]]*\]|[\w-]+)", "", text)


def files(folder: Path, **texts: str) -> Path:
    for name, text in texts.items():
        (folder / f"{name}.yaml").write_text(text)
    return folder


def test_every_place_has_its_ids_and_their_locations(tmp_path: Path) -> None:
    chart = loaded(files(tmp_path, door=CHART) / "door.yaml")
    assert every_id(chart) == {
        "chart": ["SYS-1"], "stop": ["SAFE-1", "SAFE-2"], "read": ["SAFE-3"],
        "Live": ["SAFE-9"], "Never": ["SAFE-1", "SAFE-1"], "Both": ["SAFE-4"],
        "idle": ["A-1", "A-2"], "idle 1": ["T-1"], "idle 2": ["T-3"], "run 3": ["T-2"],
    }  # fmt: skip
    for state in chart.states:
        for text in state.req:
            assert text.span.source.text[text.span.start : text.span.end] == text.value


def document_of(text: str, front: object, name: str) -> Document:
    found = Findings()
    read_one = front.read  # type: ignore[attr-defined]
    document = read_one(Source(name, text), found)
    assert not found.has_errors, [each.message for each in found]
    assert isinstance(document, Document)
    return document


def test_both_notations_write_and_read_all_ids() -> None:
    document = document_of(CHART, YAML, "door.yaml")
    for front, name in ((YAML, "door.yaml"), (SCXML, "door.scxml")):
        written = front.write(document)
        again = document_of(written, front, name)
        assert again == document
        assert ids(*again.properties) == ids(*document.properties)
        words = re.findall(r"\b(?:SYS|SAFE|A|T)-\d\b", written)
        assert sorted(words) == sorted(re.findall(r"\b(?:SYS|SAFE|A|T)-\d\b", CHART))


def test_a_derived_chart_inherits_the_ids_with_the_items(tmp_path: Path) -> None:
    chart = loaded(files(tmp_path, door=CHART, lift=DERIVED) / "lift.yaml")
    assert every_id(chart) == {
        "chart": ["SYS-1", "SYS-2"], "stop": ["SAFE-1", "SAFE-2"], "read": ["SAFE-3"],
        "Live": ["SAFE-9"], "Never": ["SAFE-7"], "Both": ["SAFE-4"],
        "idle": ["A-1", "A-2", "A-3"], "idle 1": ["T-1"], "idle 2": ["T-3"],
        "run 3": ["T-2", "T-9"],
    }  # fmt: skip


def test_a_state_that_uses_a_chart_also_has_the_ids_of_the_chart(tmp_path: Path) -> None:
    using = (
        "chart: House\nevents: {in: [go, back, reset]}\ninitial: front\nstates:\n"
        "  front: {use: door.yaml, req: H-1}\n"
    )
    chart = loaded(files(tmp_path, door=CHART, house=using) / "house.yaml")
    found = every_id(chart)
    assert found["front"] == ["H-1", "SYS-1"]
    assert found["front.idle"] == ["A-1", "A-2"]
    assert found["front.stop"] == ["SAFE-1", "SAFE-2"]
    assert ["T-2"] in found.values()


def test_ids_change_neither_fingerprint_nor_code(tmp_path: Path) -> None:
    plain = without_ids(CHART)
    assert "req" not in plain
    (tmp_path / "a").mkdir()
    (tmp_path / "b").mkdir()
    one = loaded(files(tmp_path / "a", door=CHART) / "door.yaml")
    two = loaded(files(tmp_path / "b", door=plain) / "door.yaml")
    assert fingerprint(one) == fingerprint(two)
    assert one == replace(two, sources=one.sources)
    first, second = (generate_machine(chart, "door") for chart in (one, two))
    assert first.files == second.files
    assert "SAFE-" not in repr(first.files)


SYSTEM = """\
system: House
req: [H-1, H-2]
machines: {door: door.yaml}
environment: {may: [door.go, door.back, door.reset, door.open]}
properties:
  Live: {deadlock_free: true, req: SAFE-9}
  Free: deadlock_free
  Shut: {never: door.In(run) and door.In(idle), req: [S-1]}
  Turn: {within: [door.In(idle), 1s, door.In(run)], req: S-2 S-3}
"""


def test_a_system_and_its_properties_have_ids(tmp_path: Path) -> None:
    folder = files(tmp_path, door=CHART, house=SYSTEM)
    found = Findings()
    system = read(folder / "house.yaml", found)
    assert not found.has_errors
    assert isinstance(system, System)
    assert ids(system) == [["H-1", "H-2"]]
    named = {one.name: [text.value for text in one.req] for one in system.properties}
    assert named == {
        "Live": ["SAFE-9"], "Free": [], "Shut": ["S-1"], "Turn": ["S-2", "S-3"],
        "door.Never": ["SAFE-1", "SAFE-1"],
    }  # fmt: skip
    assert {one.text for one in system.properties if one.name in ("Live", "Free")} == {
        "deadlock_free"
    }
    alone = system_of_chart(loaded(folder / "door.yaml"))
    assert {one.name: len(one.req) for one in alone.properties} == {
        "Live": 1, "Never": 2, "Both": 1,
    }  # fmt: skip


@pytest.mark.parametrize(
    ("old", "new", "rule"),
    [
        ("req: A-1 A-2", "req: {a: b}", "unexpected-shape"),
        ("req: A-1 A-2", "req: ['']", "unexpected-shape"),
        ("req: [T-2]", "req: {T-2: }", "unexpected-shape"),
        ("{req: SAFE-3}", "{reqs: SAFE-3}", "unknown-key"),
        ("{req: SAFE-3}", "SAFE-3", "lost-text"),
        ("  - plain", "  - {plain: {}, other: {}}", "unexpected-shape"),
        ("true, req: SAFE-9", "true, reqs: SAFE-9", "unknown-key"),
        ("{deadlock_free: true, req: SAFE-9}", "{req: SAFE-9}", "unexpected-shape"),
    ],
)
def test_a_wrong_shape_is_a_finding(tmp_path: Path, old: str, new: str, rule: str) -> None:
    assert old in CHART
    files(tmp_path, door=CHART.replace(old, new))
    with pytest.raises(FsmkitError) as raised:
        loaded(tmp_path / "door.yaml")
    assert rule in {found.rule.name for found in raised.value.diagnostics}
