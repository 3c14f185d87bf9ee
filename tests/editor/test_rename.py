"""Renaming beyond one file: what is linked is renamed together, what would change is refused."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path

import pytest

from fsmkit.diagnostics import Findings
from fsmkit.editor.analysis import Analyses
from fsmkit.editor.context import Context
from fsmkit.editor.features.rename import RenameError, renaming
from fsmkit.editor.index.workspace import Workspace
from fsmkit.system.any_file import read_with_boards

SENDER = """\
chart: Sender
types: {Fault: [none, jam]}
events: {in: [go], out: ["failed(why Fault, slot 0..3)"]}
data: {turn: 0..1 = 0}
initial: a
states:
  a: {on: {go: {if: turn == 0, do: "turn = 1; send failed(why = jam, slot = 2)"}}}
"""
RECEIVER = """\
chart: Receiver
types: {Reason: [none, jam]}
events: {in: ["failed(slot 0..3, why Reason)", error_of.door, error_of.axis]}
data: {turn: 0..1 = 0, last: Reason = none, jammed: bool = false}
operations: [show(reason Reason)]
initial: a
states:
  a:
    on:
      failed: {if: event.why == jam, do: "last = event.why; turn = event.slot > 1 ? 1 : 0"}
      error_of.*: {if: turn == 1 and not jammed, do: show(last)}
"""
SYSTEM = """\
system: Two
machines: {s: sender.yaml, r: receiver.yaml}
shared: {turn: 0..1 = 0}
connect: [s.failed -> r.failed]
environment: {may: [s.go, r.error_of.door, r.error_of.axis]}
properties:
  jam: {reachable: r.last == Reason.jam and turn == 1}
"""
BINDING = """\
binding: Receiver
chart: receiver.yaml
operations: {show: "board_show(reason, 1)"}
"""
LOOSE = """\
<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" datamodel="ecmascript"
       name="L" initial="a">
  <datamodel><data id="n" expr="0"/></datamodel>
  <state id="a">
    <transition event="poke" cond="_event.data.many > 1" target="b">
      <raise event="told"/>
    </transition>
    <transition event="told" cond="_event.name == 'told'" target="a"/>
  </state>
  <state id="b">
    <onentry><send event="poke"><param name="many" expr="n"/></send></onentry>
    <transition event="done.state.a poke" cond="In('a')" target="a"/>
  </state>
</scxml>
"""
DOOR = """\
chart: Door
inputs: {blocked: bool, temp: 0..9}
events: {in: [open], out: [opened]}
properties:
  safe: {never: In(moving) and blocked}
  told: {invariant: not occurs(open) or temp >= 0}
  seen: {monitor: watch.yaml, watch: [opened -> up, occurs(open) -> up]}
environment: {may: [open, blocked, "temp in {0, 5}"]}
initial: moving
states: {moving: {rest: true, on: {open: {do: send opened}}}}
"""
WATCH = """\
chart: Watch
events: {in: [up]}
initial: calm
states: {calm: {rest: true, on: {up: calm}}, error: {}}
"""
FILES = {
    "door.yaml": DOOR,
    "watch.yaml": WATCH,
    "sender.yaml": SENDER,
    "receiver.yaml": RECEIVER,
    "two.yaml": SYSTEM,
    "receiver.c.yaml": BINDING,
    "loose.scxml": LOOSE,
}


@pytest.fixture
def context(tmp_path: Path) -> Context:
    for name, text in FILES.items():
        (tmp_path / name).write_text(text, encoding="utf-8")
    workspace = Workspace((tmp_path.resolve(),))
    return Context(workspace, Analyses(workspace))


def renamed(context: Context, name: str, piece: str, into: int, new: str) -> Mapping[str, str]:
    """Return the texts that change."""
    path = context.workspace.folders[0] / name
    lines = context.lines(path)
    assert lines is not None
    made = renaming(context, path, lines.position(lines.text.index(piece) + into), new)
    texts = {p: made.text(p, p.read_text(encoding="utf-8")) for p in made.places}
    for changed, text in texts.items():
        changed.write_text(text, encoding="utf-8")
    read_with_boards(context.workspace.folders[0] / "two.yaml", Findings())
    return {p.name: text for p, text in texts.items()}


def test_members_of_types_that_a_wire_joins_keep_one_name(context: Context) -> None:
    texts = renamed(context, "sender.yaml", "jam]}", 0, "stuck")
    assert texts.keys() == {"sender.yaml", "receiver.yaml", "two.yaml"}
    assert "[none, stuck]" in texts["receiver.yaml"]
    assert "event.why == stuck" in texts["receiver.yaml"]
    assert "Reason.stuck" in texts["two.yaml"]
    assert "  jam: {" in texts["two.yaml"]


def test_fields_that_are_matched_by_name_keep_one_name(context: Context) -> None:
    texts = renamed(context, "receiver.yaml", "why Reason", 0, "cause")
    assert "failed(cause Fault, slot 0..3)" in texts["sender.yaml"]
    assert "send failed(cause = jam" in texts["sender.yaml"]
    assert "event.cause == jam" in texts["receiver.yaml"]


def test_shared_data_are_renamed_in_all_that_share_them(context: Context) -> None:
    texts = renamed(context, "receiver.yaml", "turn: 0..1", 0, "whose")
    assert texts.keys() == {"sender.yaml", "receiver.yaml", "two.yaml"}
    assert "shared: {whose:" in texts["two.yaml"]


def test_parameters_are_renamed_in_the_c_of_a_binding(context: Context) -> None:
    texts = renamed(context, "receiver.yaml", "reason Reason", 0, "cause")
    assert 'show: "board_show(cause, 1)"' in texts["receiver.c.yaml"]


def test_an_event_that_a_pattern_fits_must_go_on_to_fit_it(context: Context) -> None:
    with pytest.raises(RenameError, match=r"would mean something else: receiver\.yaml"):
        renamed(context, "receiver.yaml", "error_of.door", 0, "door_error")
    texts = renamed(context, "receiver.yaml", "error_of.door", 0, "error_of.gate")
    assert "r.error_of.gate" in texts["two.yaml"]


def test_a_name_that_would_hide_a_member_is_refused(context: Context) -> None:
    with pytest.raises(RenameError, match=r"would mean something else: receiver\.yaml"):
        renamed(context, "receiver.yaml", "jammed: bool", 0, "jam")


def test_events_of_plain_scxml_need_no_declaration(context: Context) -> None:
    texts = renamed(context, "loose.scxml", 'event="told"', 7, "said")
    assert texts["loose.scxml"].count("said") == 3
    assert "_event.name == 'said'" in texts["loose.scxml"]
    texts = renamed(context, "loose.scxml", 'id="a"', 4, "first")
    assert "done.state.first poke" in texts["loose.scxml"]
    assert "In('first')" in texts["loose.scxml"]
    texts = renamed(context, "loose.scxml", "data.many", 5, "much")
    assert '<param name="much"' in texts["loose.scxml"]


def test_a_broken_file_that_names_it_stops_a_rename(context: Context) -> None:
    path = context.workspace.folders[0] / "two.yaml"
    assert context.workspace.uses(path).occurrences
    path.write_text(SYSTEM + "x: [\n", encoding="utf-8")
    with pytest.raises(RenameError, match=r"two\.yaml"):
        renamed(context, "sender.yaml", "failed(why", 0, "broke")


@pytest.mark.parametrize(
    ("piece", "into", "old", "places"),
    [
        ("moving: {rest", 0, "moving", 3),
        ("blocked: bool", 0, "blocked", 3),
        ("temp: 0..9", 0, "temp", 3),
        ("open], out", 0, "open", 5),
        ("opened]}", 0, "opened", 3),
    ],
)
def test_names_in_own_properties_and_environment(
    context: Context, piece: str, into: int, old: str, places: int
) -> None:
    texts = renamed(context, "door.yaml", piece, into, "anew")
    assert len(re.findall(r"\banew\b", texts["door.yaml"])) == places
    assert not re.search(rf"\b{old}\b", texts["door.yaml"])
    read_with_boards(context.workspace.folders[0] / "door.yaml", Findings())
