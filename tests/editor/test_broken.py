"""Texts that do not parse: they are answered from the last that did, and by what is before them."""

from __future__ import annotations

from pathlib import Path

import pytest

from fsmkit.editor.analysis import Analyses
from fsmkit.editor.context import Context
from fsmkit.editor.features import completion, navigation, outline
from fsmkit.editor.index.workspace import Workspace

YAML = "chart: A\ninitial: a\nevents: {in: [go]}\nstates:\n  a: {on: {go: b}}\n  b: {}\n"
SCXML = (
    '<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" datamodel="ecmascript">\n'
    '  <state id="a"><transition event="go" target="b"/></state>\n  <state id="b"/>\n</scxml>\n'
)


@pytest.mark.parametrize(
    ("name", "good", "broken"),
    [
        ("a.yaml", YAML, YAML.replace("go: b}}", "go: ¦")),
        ("a.scxml", SCXML, SCXML.replace('target="b"/>', 'target="¦')),
    ],
)
def test_names_come_from_the_last_text_that_parsed(
    name: str, good: str, broken: str, tmp_path: Path
) -> None:
    path = tmp_path.resolve() / name
    workspace = Workspace((path.parent,))
    context = Context(workspace, Analyses(workspace))
    workspace.set_text(path, good.encode())
    assert [s.name for s in outline.document_symbols(context, path)][-2:] == ["a", "b"]
    offset = broken.index("¦")
    workspace.set_text(path, broken.replace("¦", "").encode())
    assert context.analyses.analysis(path).findings
    lines = context.lines(path)
    assert lines is not None
    found = completion.completion(context, path, lines.position(offset))
    assert {"a", "b"} <= {item.label for item in found}
    assert [s.name for s in outline.document_symbols(context, path)][-2:] == ["a", "b"]


def test_charts_that_use_or_extend_themselves_are_answered(tmp_path: Path) -> None:
    path = tmp_path.resolve() / "a.yaml"
    workspace = Workspace((path.parent,))
    context = Context(workspace, Analyses(workspace))
    for text in (
        "chart: A\nextends: a.yaml\n",
        "chart: A\nstates: {a: {use: a.yaml}}\n",
        "chart: A\nstates: {a: {invoke: {src: a.yaml}}}\n",
    ):
        workspace.set_text(path, text.encode())
        assert context.analyses.analysis(path).findings
        lines = context.lines(path)
        assert lines is not None
        assert navigation.definition(context, path, lines.position(text.index("a.yaml")))
