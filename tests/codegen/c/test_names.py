"""Names of a chart in C: two never become one in silence (``c-name-taken``)."""

from __future__ import annotations

from pathlib import Path

import pytest

from fsmkit.diagnostics import Findings, Severity
from fsmkit.loading import load
from fsmkit.plugins import Target, plugin

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
HELP = "rename one of the two, or choose its name in C under `names` of a binding"
NAMES = {"NAME": "Press", "MEMBER": "down", "EVENT": "c", "STATE": "ready"}


def compiled(tmp_path: Path, options: dict[str, str], **names: str) -> tuple[bool, Findings]:
    """Return whether there is C, and what was found."""
    text = CHART
    for place, name in {**NAMES, **names}.items():
        text = text.replace(place, name)
    path = tmp_path / "press.yaml"
    path.write_text(text, encoding="utf-8")
    findings = Findings()
    made = plugin(Target, "c").generate(load(path), findings, options)
    return made is not None, findings


@pytest.mark.parametrize(
    ("place", "name", "both"),
    [
        ("EVENT", "a_b", "event `a_b` and event `a-b`"),
        ("EVENT", "A-B", "event `A-B` and event `a-b`"),
        ("STATE", "Idle", "state `Idle` and state `idle`"),
        ("MEMBER", "UP", "member `UP` and member `up`"),
    ],
)
def test_two_names_that_would_be_one_are_refused(
    place: str, name: str, both: str, tmp_path: Path
) -> None:
    is_made, findings = compiled(tmp_path, {}, **{place: name})
    errors = [found for found in findings if found.severity is Severity.ERROR]
    assert not is_made
    assert [(found.rule.name, found.help) for found in errors] == [("c-name-taken", HELP)]
    assert both in errors[0].message
    assert errors[0].secondary or place == "MEMBER"  # members have no place of their own


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
