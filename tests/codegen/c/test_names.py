"""Names of a chart in C: two never become one, and the header lists those that differ."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from fsmkit.chart.loading import load
from fsmkit.codegen.target import Target
from fsmkit.diagnostics import Findings, Severity
from fsmkit.emit import legal, snake
from fsmkit.plugins import plugin

CHART = """\
chart: NAME
types: {Way: [up, MEMBER]}
events: {in: [a-b, EVENT]}
data: {register: Way = up}
initial: idle
states:
  idle: {on: {a-b: STATE, EVENT: STATE}}
  STATE: {}
"""
NAMES = {"NAME": "Press", "MEMBER": "down", "EVENT": "c", "STATE": "ready"}


def compiled(tmp_path: Path, options: dict[str, str], **names: str) -> tuple[bool, Findings]:
    """Return whether C was generated, and the findings."""
    text = CHART
    for place, name in {**NAMES, **names}.items():
        text = text.replace(place, name)
    path = tmp_path / "press.yaml"
    path.write_text(text, encoding="utf-8")
    findings = Findings()
    made = plugin(Target, "c").generate(load(path), findings, options)
    return made is not None, findings


@pytest.mark.parametrize(
    ("place", "name", "chosen"),
    [
        ("EVENT", "a_b", "press_post_a_b_39ea"),
        ("EVENT", "A-B", "press_post_a_b_44b6"),
        ("STATE", "Idle", "PRESS_STATE_IDLE_1A2B"),
        ("MEMBER", "UP", "PRESS_WAY_UP_BB08"),
    ],
)
def test_the_second_of_two_names_has_a_checksum(
    place: str, name: str, chosen: str, tmp_path: Path
) -> None:
    is_made, findings = compiled(tmp_path, {}, **{place: name})
    assert is_made
    (note,) = findings
    assert note.severity is Severity.NOTE
    assert f"`{name}` is `{chosen}`" in note.message


def event_constants(folder: Path, *events: str) -> dict[str, int]:
    """Return the constants of events of a chart, with their numbers."""
    text = f"chart: M\nevents: {{in: [{', '.join(events)}]}}\ninitial: s\n"
    text += f"states: {{s: {{on: {{{', '.join(f'{event}: s' for event in events)}}}}}}}\n"
    (folder / "m.yaml").write_text(text, encoding="utf-8")
    made = plugin(Target, "c").generate(load(folder / "m.yaml"), Findings(), {})
    assert made is not None
    found = re.findall(r"M_MACHINE_EVENT_(\w+) = (\d+)", made.files["m_machine.h"])
    return {name: int(number) for name, number in found if name.startswith("HIGH")}


def test_an_event_that_is_added_renames_no_other(tmp_path: Path) -> None:
    before = event_constants(tmp_path, "highway", "highWay")
    after = event_constants(tmp_path, "highway", "highWay", "HIGHWAY", "Highway")
    assert len(after) == len(before) + 2
    assert after | before == after


def test_code_for_two_names_fails_to_compile_when_they_change_places(tmp_path: Path) -> None:
    names = "highway", "highWay", "high-way", "high.way", "high_way"
    before = set(event_constants(tmp_path, *names)) - {"HIGHWAY", "HIGH_WAY"}
    after = set(event_constants(tmp_path, *reversed(names))) - {"HIGHWAY", "HIGH_WAY"}
    assert {name for name in before & after if name.startswith("HIGHWAY_")} == set()
    assert len({name for name in before | after if name.startswith("HIGHWAY_")}) == 2


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("Tür", "tuer"),
        ("ÖffnenTür", "oeffnen_tuer"),
        ("пуск", "pusk"),
        ("Щит", "shchit"),
        ("ЩИТ", "shchit"),
        ("κλειστό", "kleisto"),
        ("état", "etat"),
        ("e\u0301tat", "etat"),
        ("łódź", "lodz"),
        ("電機", "u96fbu6a5f"),
        ("🚀", "u1f680"),
        ("a—b", "a_b"),
    ],
)
def test_letters_beyond_ascii_are_transliterated(name: str, expected: str) -> None:
    assert snake(name) == expected
    assert legal(name).isascii()


@pytest.mark.parametrize("name", ["öffnen", "пуск", "κλειστό", "電機"])
def test_names_in_other_letters_are_listed(name: str, tmp_path: Path) -> None:
    is_made, findings = compiled(tmp_path, {}, EVENT=name, STATE=f"{name}_")
    assert is_made
    assert any(f"event `{name}` is `press_post_{snake(name)}`" in f.message for f in findings)


def test_an_identifier_is_ascii_whatever_the_name() -> None:
    every = [chr(code) for code in range(0x20, 0x3000) if chr(code).isprintable()]
    assert all(re.fullmatch(r"\w+", legal(f"a{char}b"), re.ASCII) for char in every)


def test_names_that_others_have_in_c_are_one_note(tmp_path: Path) -> None:
    is_made, findings = compiled(tmp_path, {}, NAME="Event")
    assert is_made
    (note,) = findings
    assert note.severity is Severity.NOTE
    for told in ("machine `event` is `event_machine`", "`register` is `data.register_value`"):
        assert told in note.message


def test_a_prefix_is_the_name_that_was_chosen(tmp_path: Path) -> None:
    _, findings = compiled(tmp_path, {"prefix": "press"}, NAME="Event")
    assert all("machine `event`" not in note.message for note in findings)
