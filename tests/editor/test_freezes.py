"""Nodes that freeze, in the editor: keys, values, names and layout."""

from __future__ import annotations

from pathlib import Path

import pytest

from fsmkit.editor.analysis import Analyses
from fsmkit.editor.context import Context
from fsmkit.editor.features import completion
from fsmkit.editor.features.rename import renaming
from fsmkit.editor.formatting import format_source
from fsmkit.editor.index.workspace import Workspace

PART = """\
chart: Part
events: {in: [lost], out: [beat]}
initial: on
states: {on: {rest: true, every: {10ms: {do: send beat}}, on: {lost: "off"}}, "off": {rest: true}}
"""
SYSTEM = """\
system: Two
machines: {a: part.yaml, b: part.yaml}
environment:
  freezes:
    hall: {machines: [a], silent: [b.lost], within: 50ms..90ms}
properties:
  reacts: {within: [hall.In(frozen) and b.In(on), 90ms, not b.In(on)]}
"""


def context_of(folder: Path, text: str) -> tuple[Context, Path]:
    folder = folder.resolve()
    (folder / "part.yaml").write_text(PART)
    path = folder / "two.yaml"
    path.write_text(text)
    workspace = Workspace((folder,))
    return Context(workspace, Analyses(workspace)), path


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ("  freezes:", "  ¦", {"freezes", "may", "will", "world"}),
        ("hall: {machines: [a]", "hall: {¦ machines: [a]", {"continues"}),
        ("silent: [b.lost]", "silent: [b.¦]", {"lost"}),
        ("machines: [a],", "machines: [¦],", {"a", "b"}),
    ],
)
def test_completion(tmp_path: Path, old: str, new: str, expected: set[str]) -> None:
    assert old in SYSTEM
    text = SYSTEM.replace(old, new)
    context, path = context_of(tmp_path, SYSTEM)
    context.workspace.set_text(path, text.replace("¦", "").encode())
    lines = context.lines(path)
    assert lines is not None
    found = completion.completion(context, path, lines.position(text.index("¦")))
    assert expected <= {item.label for item in found}


def test_a_node_is_renamed_where_properties_name_it(tmp_path: Path) -> None:
    context, path = context_of(tmp_path, SYSTEM)
    lines = context.lines(path)
    assert lines is not None
    made = renaming(context, path, lines.position(SYSTEM.index("hall:")), "board")
    assert made.text(path, SYSTEM) == SYSTEM.replace("hall", "board")
    made = renaming(context, path, lines.position(SYSTEM.index("b: part")), "c")
    text = made.text(path, SYSTEM)
    assert "silent: [c.lost]" in text
    assert "c.In(on)" in text


def test_keys_of_a_node_come_in_the_order_of_the_reference() -> None:
    messy = SYSTEM.replace("{machines: [a], silent", "{silent").replace(
        "within: 50ms..90ms}", "within:   50ms..90ms, machines: [ a ]}"
    )
    found = format_source(messy, "two.yaml")
    assert "    hall: {machines: [a], silent: [b.lost], within: 50ms..90ms}\n" in found
    assert format_source(found, "two.yaml") == found
