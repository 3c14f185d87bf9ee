"""``properties:`` and ``environment:`` of a chart: alone, in a system, inherited, in both forms."""

from __future__ import annotations

from pathlib import Path

import pytest

from fsmkit.chart.loading import read_document, read_documents
from fsmkit.diagnostics import Findings, FsmkitError, Source
from fsmkit.document import keys
from fsmkit.scxml.reader import read_document as read_scxml
from fsmkit.scxml.writer import write_document as write_scxml
from fsmkit.system.any_file import load_any, read
from fsmkit.system.properties.kinds import kinds
from fsmkit.system.system import System
from fsmkit.verify.explore import ExplorationOptions, check
from fsmkit.verify.report.verdict import Report, Verdict
from fsmkit.yaml.reader import read_document as read_yaml
from fsmkit.yaml.writer import write_document as write_yaml

DOOR = """
chart: Door
inputs: {blocked: bool, temp: 0..1000}
events: {in: [open, "close(fast bool)"], out: [opened]}
data: {hot: bool = false}
PROPERTIES
initial: shut
states:
  shut: {rest: true, on: {open: asking}, entry: hot = temp > 700}
  asking: {on: {close: [{if: blocked, target: moving}, {target: shut}]}, entry: send opened}
  moving: {on: {close: shut}}
"""
PROPERTIES = """
properties:
  safe: {never: In(moving) and blocked}
  cold: {invariant: not hot}
  answered: {leads_to: [In(asking), "In(shut) or In(moving)"]}
  quick: {within: [In(asking), 50ms, In(moving)]}
  moves: {reachable: In(moving)}
  home: {recoverable: In(shut)}
  never_closed: {never: occurs(close) and In(moving)}
  calm: livelock_free
"""
ENVIRONMENT = """
environment: {may: [open, blocked, "temp in {0, 500, 1000}"], will: ["close(fast in {true})"]}
"""
UNTIMED = ExplorationOptions("python", time="untimed")


def write(folder: Path, **charts: str) -> Path:
    for name, text in charts.items():
        (folder / f"{name}.yaml").write_text(text)
    return folder / f"{next(iter(charts))}.yaml"


def door(more: str) -> str:
    return DOOR.replace("PROPERTIES", more)


def verdicts(report: Report) -> dict[str, Verdict]:
    return {result.name: result.verdict for result in report.results}


def size(report: Report) -> tuple[int, int]:
    return report.exploration.states, report.exploration.transitions


def explored(path: Path) -> tuple[System, Report]:
    system = load_any(path, Findings())
    return system, check(system, Findings(), options=UNTIMED)


def test_a_chart_is_the_only_machine_of_a_system(tmp_path: Path) -> None:
    """The same as a system file that says it of a machine."""
    own, alone = explored(write(tmp_path, door=door(PROPERTIES + ENVIRONMENT)))
    said = PROPERTIES.replace("In(", "m.In(").replace("not hot", "not m.hot")
    said = said.replace("and blocked", "and m.blocked").replace("occurs(", "occurs(m.")
    comes = ENVIRONMENT.replace("open, blocked", "m.open, m.blocked")
    comes = comes.replace('"temp', '"m.temp').replace('"close', '"m.close')
    text = f"system: S\nmachines: {{m: bare.yaml}}\n{said}{comes}"
    system, whole = explored(write(tmp_path, s=text, bare=door("")))
    assert verdicts(alone) == verdicts(whole)
    assert size(alone) == size(whole)
    assert own.possible == system.possible
    assert not own.is_open
    assert len(verdicts(alone)) > len(kinds()) - 1


def test_without_an_environment_everything_may_come(tmp_path: Path) -> None:
    system, report = explored(write(tmp_path, door=door(PROPERTIES)))
    assert system.is_open
    found = verdicts(report)
    assert found["safe"] is Verdict.VIOLATED  # an input counts, as a property reads it
    assert found["answered"] is Verdict.VIOLATED  # nothing is fair
    assert found["moves"] is Verdict.HOLDS


WATCH = """
chart: Watch
events: {in: [up, down]}
inputs: {warm: bool}
initial: calm
states: {calm: {on: {up: higher}}, higher: {on: {down: calm, up: error}}, error: {}}
"""
MONITORED = """
properties:
  safe: {never: In(moving) and blocked}
  order:
    monitor: watch.yaml
    watch: [opened -> up, occurs(close) -> down, hot -> warm]
  home: {recoverable: In(shut)}
"""


def test_a_system_judges_what_is_local_for_each_machine(tmp_path: Path) -> None:
    text = """
system: S
machines: {"door[i in 0..1]": door.yaml, left: door.yaml}
environment:
  may: ["door[0].open", left.open, "door[0].blocked", left.close, "door[0].close", left.blocked]
properties: {mine: {never: "door[1].In(moving)"}}
"""
    path = write(tmp_path, s=text, door=door(MONITORED + ENVIRONMENT), watch=WATCH)
    system, report = explored(path)
    judged = [p.name for p in system.properties]
    each = [f"{name}.{own}" for name in ("door[0]", "door[1]", "left") for own in ("safe", "order")]
    assert judged == ["mine", *each]
    found = verdicts(report)
    assert found["door[0].safe"] is found["left.safe"] is Verdict.VIOLATED
    assert found["door[1].safe"] is Verdict.HOLDS
    assert found["door[0].order"] is Verdict.HOLDS
    assert len(system.monitors) == 3
    _, alone = explored(tmp_path / "door.yaml")
    assert verdicts(alone)["order"] is Verdict.HOLDS


def test_a_name_of_the_system_is_not_taken_twice(tmp_path: Path) -> None:
    text = (
        'system: S\nmachines: {m: door.yaml}\nproperties: {"m.safe": {never: m.In(moving)}}\n'
        "environment: {may: [m.open]}\n"
    )
    with pytest.raises(FsmkitError) as caught:
        load_any(write(tmp_path, s=text, door=door(PROPERTIES)), Findings())
    assert [found.rule.name for found in caught.value.diagnostics].count("duplicate-name") == 1


def test_an_error_of_a_chart_is_told_once_at_its_line(tmp_path: Path) -> None:
    text = 'system: S\nmachines: {"m[i in 0..5]": door.yaml}\nenvironment: {may: []}\n'
    path = write(tmp_path, s=text, door=door("properties: {safe: {never: In(gone)}}"))
    with pytest.raises(FsmkitError) as caught:
        load_any(path, Findings())
    (found,) = (one for one in caught.value.diagnostics if one.rule.name == "unknown-name")
    assert found.primary is not None
    at = found.primary.span
    assert at.source.name.endswith("door.yaml")
    assert at.source.text[at.start : at.end] == "gone"


@pytest.mark.parametrize(
    ("more", "rule"),
    [
        ("properties: {p: {never: In(gone)}}", "unknown-name"),
        ("properties: {p: {never: missing}}", "unknown-name"),
        ("properties: {p: {never: plant.In(moving)}}", "unknown-name"),
        ("properties: {p: {never: temp}}", "type-mismatch"),
        ("properties: {p: {never: occurs(gone)}}", "unknown-name"),
        ("properties: {p: never}", "missing-condition"),
        ("properties: {p: nonsense}", "unknown-name"),
        ("properties: {p: {nonsense: true}}", "unknown-key"),
        ("properties: {p: {}}", "unexpected-shape"),
        ("properties: {p: []}", "unexpected-shape"),
        ("properties: [p]", "unexpected-shape"),
        ("properties: {p: {never: a, invariant: b}}", "unexpected-shape"),
        ("properties: {p: {within: [a, b, c, d]}}", "unexpected-shape"),
        ("properties: {p: {within: [In(shut), In(moving)]}}", "unexpected-shape"),
        ("properties: {p: {leads_to: In(shut)}}", "unexpected-shape"),
        ("properties: {p: {monitor: nowhere.yaml, watch: []}}", "unreadable-file"),
        ("environment: {may: [gone]}", "unknown-name"),
        ("environment: {may: [opened]}", "unknown-name"),
        ("environment: {will: [blocked]}", "input-that-will"),
        ("environment: {world: [plant]}", "unknown-key"),
        ('environment: {may: ["temp in {red}"]}', "unknown-name"),
        ('environment: {may: [""]}', "broken-connection"),
        ("environment: {may: [{a: b}]}", "unexpected-shape"),
        ("environment: []", "unexpected-shape"),
        ("override: [safe]", "override-of-nothing"),
    ],
)
def test_bad_input_is_a_finding(tmp_path: Path, more: str, rule: str) -> None:
    with pytest.raises(FsmkitError) as caught:
        read(write(tmp_path, door=door(more)), Findings())
    assert rule in {found.rule.name for found in caught.value.diagnostics}


def test_what_never_comes_is_reported_with_the_way_out(tmp_path: Path) -> None:
    findings = Findings()
    load_any(write(tmp_path, door=door("environment: {may: [open]}")), findings)
    told = {found.rule.name: found.help for found in findings}
    assert told["unconnected-input"] == "name it: `may: [blocked]`"
    assert told["unconnected-event"] == "name it under `environment`"


def test_a_variable_that_only_a_property_reads_is_read(tmp_path: Path) -> None:
    findings = Findings()
    read(write(tmp_path, door=door(PROPERTIES)), findings)
    assert "unread-data" not in {found.rule.name for found in findings}


# --- inheritance ----------------------------------------------------------------------------------


def derived(tmp_path: Path, more: str) -> Path:
    write(tmp_path, door=door(PROPERTIES + ENVIRONMENT), watch=WATCH)
    return write(tmp_path, fast=f"chart: Fast\nextends: door.yaml\nevents: {{in: [kick]}}\n{more}")


def test_a_derived_chart_inherits_both(tmp_path: Path) -> None:
    path = derived(tmp_path, "properties: {more: {never: hot}}\nenvironment: {may: [kick]}")
    system = load_any(path, Findings())
    names = [p.name for p in system.properties]
    assert names[0] == "safe"
    assert names[-1] == "more"
    chart = system.machines[0].chart
    assert {chart.events[p.event].name for p in system.possible} == {"open", "close", "kick"}


def test_a_property_is_replaced_only_where_that_is_marked(tmp_path: Path) -> None:
    with pytest.raises(FsmkitError) as caught:
        read(derived(tmp_path, "properties: {safe: {never: hot}}"), Findings())
    assert [f.rule.name for f in caught.value.diagnostics] == ["redefines-inherited"]
    more = "override: [safe, environment]\nproperties: {safe: {never: hot}}\n"
    system = load_any(derived(tmp_path, f"{more}environment: {{may: [kick]}}"), Findings())
    assert (system.properties[0].name, system.properties[0].text) == ("safe", "hot")
    assert len(system.possible) == 1


@pytest.mark.parametrize("mark", ["gone", "safe", "environment"])
def test_a_mark_that_replaces_nothing_is_a_finding(tmp_path: Path, mark: str) -> None:
    with pytest.raises(FsmkitError) as caught:
        read(derived(tmp_path, f"override: [{mark}]"), Findings())
    assert [f.rule.name for f in caught.value.diagnostics] == ["override-of-nothing"]


# --- notations ------------------------------------------------------------------------------------


def test_the_table_of_keys_has_the_kinds() -> None:
    assert set(keys.PROPERTY) == set(kinds())


@pytest.mark.parametrize("more", [PROPERTIES + ENVIRONMENT, MONITORED, "environment: {}"])
def test_both_notations_say_the_same(tmp_path: Path, more: str) -> None:
    path = write(tmp_path, door=door(more), watch=WATCH)
    document = read_document(path, Findings())
    yaml = write_yaml(document)
    scxml = write_scxml(document)
    assert read_yaml(Source("door.yaml", yaml), Findings()) == document
    again = read_scxml(Source("door.scxml", scxml), Findings())
    assert again == document
    assert write_yaml(again) == yaml
    (tmp_path / "door.scxml").write_text(scxml)
    first, second = explored(path)[1], explored(tmp_path / "door.scxml")[1]
    assert (size(first), verdicts(first)) == (size(second), verdicts(second))


@pytest.mark.parametrize(
    ("element", "rule"),
    [
        ('<fk:property name="p"/>', "incomplete-element"),
        ('<fk:property never="a"/>', "incomplete-element"),
        ('<fk:property name="p" never="a" invariant="b"/>', "conflicting-attributes"),
        ('<fk:property name="p" nonsense="a"/>', "unknown-attribute"),
        ('<fk:property name="p" never=""/>', "missing-condition"),
        ('<fk:environment may="a" will="b" world="c"/>', "unknown-attribute"),
        ("<fk:environment/><fk:environment/>", "conflicting-attributes"),
    ],
)
def test_bad_scxml_is_a_finding(tmp_path: Path, element: str, rule: str) -> None:
    path = tmp_path / "a.scxml"
    path.write_text(
        '<scxml xmlns="http://www.w3.org/2005/07/scxml" xmlns:fk="urn:fsmkit:scxml" version="1.0"'
        f' name="A" datamodel="fsmkit">{element}<state id="s"/></scxml>'
    )
    with pytest.raises(FsmkitError) as caught:
        read(path, Findings())
    assert rule in {found.rule.name for found in caught.value.diagnostics}


def test_a_chart_of_a_hostile_name_is_read(tmp_path: Path) -> None:
    text = door(PROPERTIES + ENVIRONMENT).replace("chart: Door", 'chart: "1 \\"a*/ b"')
    system, report = explored(write(tmp_path, door=text))
    assert system.machines[0].name == '1 "a*/ b'
    assert verdicts(report)["moves"] is Verdict.HOLDS
    assert read_documents(tmp_path / "door.yaml", Findings())[0].properties
