"""The language server over standard input and output: each feature, in YAML and in SCXML."""

from __future__ import annotations

import asyncio
from pathlib import Path
from typing import Any

import pytest
from lsprotocol import types
from pygls.exceptions import JsonRpcException

from fsmkit.diagnostics import Findings
from fsmkit.editor.context import uri_of
from fsmkit.editor.formatting import format_source
from fsmkit.system.any_file import read_with_boards
from tests.editor.client import Editor

pytestmark = pytest.mark.cc


def feeder(cell: Path) -> Path:
    return cell / "feeder.yaml"


def module(cell: Path) -> Path:
    return cell / "module.scxml"


def changed(path: Path, old: str, new: str) -> str:
    text = path.read_text(encoding="utf-8")
    assert old in text
    return text.replace(old, new, 1)


# --- findings -------------------------------------------------------------------------------------


def test_findings_are_those_of_the_command_line(editor: Editor, cell: Path) -> None:
    for name in ("feeder.yaml", "module.scxml", "cell.yaml", "boards/board_b.io.yaml"):
        path = cell / name
        editor.published.clear()
        editor.open(path)
        findings = Findings()
        read_with_boards(path, findings)
        told = [d for each in editor.published.values() for d in each]
        wanted = sorted((f.rule.code, f.message) for f in findings)
        assert sorted((str(d.code), d.message.partition("\nhelp:")[0]) for d in told) == wanted
        editor.shut(path)


def test_findings_have_places_codes_and_what_belongs_to_them(editor: Editor, cell: Path) -> None:
    path = feeder(cell)
    (found,) = editor.open(path, changed(path, "target: retracting", "target: retractin"))
    assert (found.code, found.severity) == ("FK0201", types.DiagnosticSeverity.Error)
    assert found.code_description is not None
    assert found.code_description.href.endswith("unknown-name.md")
    line = editor.lines(path).line(found.range.start.line)
    assert line[found.range.start.character : found.range.end.character] == "retractin"
    assert editor.open(path, path.read_text(encoding="utf-8")) == []


def test_findings_of_a_base_are_published_where_they_are(editor: Editor, cell: Path) -> None:
    editor.open(feeder(cell))
    text = changed(module(cell), 'target="operational"', 'target="operationel"')
    (found,) = editor.open(module(cell), text)
    assert "operationel" in found.message
    editor.open(module(cell), module(cell).read_text(encoding="utf-8"))


def test_yaml_that_is_not_ours_is_left_alone(editor: Editor, tmp_path: Path) -> None:
    path = tmp_path.resolve() / "compose.yaml"
    path.write_text("services:\n  web: {image: nginx}\n", encoding="utf-8")
    assert editor.open(path) == []
    assert editor.labels(path, "services:\n  ¦\n") == []


# --- completion -----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "old", "new", "first"),
    [
        ("feeder.yaml", "target: retracting", "target: ¦", ["at_home", "pressing"]),
        ("feeder.yaml", "    initial: at_home", "    initial: ¦", ["at_home", "pressing"]),
        ("feeder.yaml", "if: mold_finished", "if: at == ¦", ["Place.between", "Place.far"]),
        ("feeder.yaml", "if: mold_finished", "if: at == Place.¦", ["between", "far", "home"]),
        ("feeder.yaml", "send pushed", "send ¦", ["feeder_clear", "pocket_free", "pushed"]),
        ("feeder.yaml", "override: begin", "override: ¦", ["true", "begin"]),
        ("feeder.yaml", "extends: module.scxml", "extends: mod¦", ["belt.yaml"]),
        ("feeder.yaml", "pressed: bool", "pressed: ¦", ["Fault", "Place", "bool"]),
        ("feeder.yaml", "  inventory:\n", "  ¦:\n", ["emergency"]),
        ("module.scxml", 'target="operational"', 'target="¦"', ["emergency", "error"]),
        ("module.scxml", 'event="power_ok"', 'event="¦"', ["arrived", "estop"]),
        ("module.scxml", 'expr="event.code"', 'expr="event.¦"', ["code"]),
        ("module.scxml", 'cond="homed"', 'cond="at == ¦"', ["Place.between", "Place.far"]),
        ("module.scxml", 'target="running" fk:id="begin"', 'target="running" ¦', ["fk:after"]),
        ("module.scxml", "<script>hold()", "<script>¦", ["fault_code", "homed", "goto"]),
        ("cell.yaml", "-> feeder.mold_ready", "-> feeder.¦", ["arrived", "block_ready"]),
        ("cell.yaml", "- molder.mold_ready ->", "- molder.¦ ->", ["extract_ready", "has_fault"]),
        ("cell.yaml", "never: plant.feeder_forward", "never: plant.In(¦)", ["arm_in", "arm_out"]),
        ("cell.yaml", "may: [plant.press_estop", "may: [¦", ["feeder", "molder", "plant"]),
        ("tests/feeder.test.yaml", "{in: at_home", "{in: ¦", ["emergency", "error"]),
    ],
)  # fmt: skip
def test_completion(
    editor: Editor, cell: Path, name: str, old: str, new: str, first: list[str]
) -> None:
    path = cell / name
    editor.open(path)  # where a text does not parse, names are those of the last that did
    found = editor.labels(path, changed(path, old, new))
    assert found[: len(first)] == first


def test_completion_of_keys_with_their_lines(editor: Editor, cell: Path) -> None:
    for path, old, new, wanted in (
        (feeder(cell), "    initial: at_home", "    in¦", "initial"),
        (module(cell), '<transition event="estop"', '<transition ¦ event="estop"', "cond"),
    ):
        params = types.CompletionParams(**editor.marked(path, changed(path, old, new)))
        found = editor.ask(editor.client.text_document_completion_async, params)
        docs = {item.label: item.documentation for item in found.items}
        assert docs[wanted]
        assert "states" not in docs or path == feeder(cell)


def test_completion_after_a_whole_operand_is_an_operator(editor: Editor, cell: Path) -> None:
    text = changed(feeder(cell), "if: mold_finished", "if: mold_finished ¦")
    assert editor.labels(feeder(cell), text) == ["and", "or"]


# --- hover and navigation -------------------------------------------------------------------------


def hover(editor: Editor, path: Path, piece: str, into: int = 0) -> str:
    editor.open(path)
    params = types.HoverParams(**editor.at(path, piece, into))
    found = editor.ask(editor.client.text_document_hover_async, params)
    return "" if found is None else found.contents.value


def test_hover(editor: Editor, cell: Path) -> None:
    assert "constant T_PRESS = 3s" in hover(editor, feeder(cell), "T_PRESS: {target")
    state = hover(editor, feeder(cell), "operational:")
    assert "feeder.yaml:30 overrides module.scxml:65" in state
    assert "overridden by belt.yaml" in state
    assert "input at: Place" in hover(editor, module(cell), "at == Place.offset")
    assert "field code of fault: Fault" in hover(editor, module(cell), "event.code", 6)
    assert "the initial child" in hover(editor, feeder(cell), "initial: at_home")
    assert "output feeder_forward: bool" in hover(editor, cell / "cell.yaml", "feeder_forward and")


def test_hover_of_a_finding_explains_its_rule(editor: Editor, cell: Path) -> None:
    path = feeder(cell)
    params = editor.marked(path, changed(path, "target: retracting", "target: retr¦actin"))
    found = editor.ask(editor.client.text_document_hover_async, types.HoverParams(**params))
    assert "FK0201 unknown-name" in found.contents.value


def go(editor: Editor, what: str, path: Path, piece: str, into: int = 0) -> list[tuple[str, int]]:
    editor.open(path)
    where = editor.at(path, piece, into)
    kinds: dict[str, Any] = {
        "definition": types.DefinitionParams,
        "declaration": types.DeclarationParams,
        "implementation": types.ImplementationParams,
    }
    request = getattr(editor.client, f"text_document_{what}_async")
    return editor.places(editor.ask(request, kinds[what](**where)))


def test_definition_declaration_implementation(editor: Editor, cell: Path) -> None:
    assert go(editor, "definition", feeder(cell), "stopping:") == [("feeder.yaml", 90)]
    assert go(editor, "declaration", feeder(cell), "stopping:") == [("module.scxml", 137)]
    assert ("molder.yaml", 111) in go(editor, "implementation", module(cell), '"stopping" fk', 1)
    assert go(editor, "definition", feeder(cell), "goto(HOME", 5) == [("module.scxml", 15)]
    assert go(editor, "definition", feeder(cell), "override: begin", 10) == [("module.scxml", 118)]
    assert go(editor, "definition", cell / "cell.yaml", "plant.yaml", 2) == [("plant.yaml", 1)]
    assert go(editor, "definition", cell / "cell.yaml", "mold_ready ->") == [("molder.yaml", 28)]
    tests = cell / "tests" / "feeder.test.yaml"
    assert go(editor, "definition", tests, "{in: pressing", 5) == [("feeder.yaml", 73)]


def test_references_cross_files_and_notations(editor: Editor, cell: Path) -> None:
    editor.open(module(cell))
    where = editor.at(module(cell), 'signature="limit"', 11)
    params = types.ReferenceParams(context=types.ReferenceContext(True), **where)
    request = editor.client.text_document_references_async
    found = editor.places(editor.ask(request, params))
    files = {name for name, _ in found}
    assert {"module.scxml", "cell.yaml", "ring.yaml", "board_a.io.yaml"} <= files
    assert "feeder.test.yaml" in files


# --- rename ---------------------------------------------------------------------------------------


def rename(editor: Editor, path: Path, piece: str, into: int, new: str) -> types.WorkspaceEdit:
    editor.open(path)
    params = types.RenameParams(new_name=new, **editor.at(path, piece, into))
    edit = editor.ask(editor.client.text_document_rename_async, params)
    assert isinstance(edit, types.WorkspaceEdit)
    return edit


def test_a_state_of_the_base_is_renamed_in_all_charts(editor: Editor, cell: Path) -> None:
    edit = rename(editor, module(cell), 'state id="operational"', 10, "powered")
    made = editor.applied(edit)
    assert {p.name for p in made} >= {"module.scxml", "feeder.yaml", "molder.yaml", "belt.yaml"}
    assert edit.change_annotations is not None
    before = {path: path.read_text(encoding="utf-8") for path in made}
    try:
        for path, text in made.items():
            path.write_text(text, encoding="utf-8")
        assert not any("operational" in text for text in made.values())
        for name in ("cell.yaml", "ring.yaml"):
            read_with_boards(cell / name, Findings())
        editor.open(module(cell), made[module(cell)])
        back = rename_open(editor, module(cell), 'state id="powered"', 10, "operational")
        assert editor.applied(back) == before
    finally:
        for path, text in before.items():
            path.write_text(text, encoding="utf-8")


def rename_open(editor: Editor, path: Path, piece: str, into: int, new: str) -> types.WorkspaceEdit:
    params = types.RenameParams(new_name=new, **editor.at(path, piece, into))
    edit = editor.ask(editor.client.text_document_rename_async, params)
    assert isinstance(edit, types.WorkspaceEdit)
    return edit


@pytest.mark.parametrize(
    ("piece", "into", "new", "why"),
    [
        ('state id="operational"', 10, "at_home", "there is a `at_home` already: .*feeder.yaml"),
        ('state id="operational"', 10, "two words", "is not a valid name for a state"),
        ('input id="at"', 10, "T_PRESS", "there is a `T_PRESS` already: .*feeder.yaml"),
        ('input id="at"', 10, "and", "is a word of the language"),
        ('signature="limit"', 11, "error.mine", "is an event of the platform"),
        ('name="Module"', 7, "Modul", "has no other uses"),
    ],
)
def test_a_rename_that_clashes_is_refused_with_places(
    editor: Editor, cell: Path, piece: str, into: int, new: str, why: str
) -> None:
    with pytest.raises(JsonRpcException, match=why):
        rename(editor, module(cell), piece, into, new)


def test_a_rename_is_refused_while_a_file_with_a_use_does_not_parse(
    editor: Editor, cell: Path
) -> None:
    path = feeder(cell)
    editor.open(path)
    broken = changed(path, "  operational:\n", "  operational: [\n")
    assert editor.open(path, broken)
    with pytest.raises(JsonRpcException, match=r"does not parse: feeder\.yaml:30"):
        rename(editor, module(cell), 'state id="operational"', 10, "powered")


def test_prepare_rename(editor: Editor, cell: Path) -> None:
    editor.open(feeder(cell))
    params = types.PrepareRenameParams(**editor.at(feeder(cell), "pressing:"))
    found = editor.ask(editor.client.text_document_prepare_rename_async, params)
    assert found.placeholder == "pressing"


# --- code actions, tokens, lenses -----------------------------------------------------------------


def test_code_actions_mend(editor: Editor, cell: Path) -> None:
    for path, old, new in (
        (feeder(cell), "target: retracting", "target: retractin"),
        (module(cell), 'target="emergency"', 'target="emergensy"'),
    ):
        text = changed(path, old, new)
        (found, *_) = editor.open(path, text)
        identifier = types.TextDocumentIdentifier(uri_of(path))
        context = types.CodeActionContext([found])
        actions = editor.ask(
            editor.client.text_document_code_action_async,
            types.CodeActionParams(identifier, found.range, context),
        )
        assert actions[0].title == f"Write `{old.split('=')[-1].split(': ')[-1].strip(chr(34))}`"
        assert editor.applied(actions[0].edit)[path] == path.read_text(encoding="utf-8")


def test_semantic_tokens(editor: Editor, cell: Path) -> None:
    provider = editor.capabilities.semantic_tokens_provider
    for path, piece, kind in (
        (feeder(cell), "block_waiting and", "variable"),
        (feeder(cell), "super\n", "keyword"),
        (module(cell), 'Place.offset" ', "enum"),
        (module(cell), "goto(HOME", "function"),
    ):
        editor.open(path)
        identifier = types.TextDocumentIdentifier(uri_of(path))
        found = editor.ask(
            editor.client.text_document_semantic_tokens_full_async,
            types.SemanticTokensParams(identifier),
        )
        where = editor.at(path, piece)["position"]
        line = column = 0
        kinds = {}
        for place in range(0, len(found.data), 5):
            delta, shift, _, number, _ = found.data[place : place + 5]
            line, column = (line, column + shift) if delta == 0 else (line + delta, shift)
            kinds[line, column] = provider.legend.token_types[number]
        assert kinds[where.line, where.character] == kind


def test_lenses(editor: Editor, cell: Path) -> None:
    for path, wanted in (
        (feeder(cell), {"overrides module.scxml:65", "check", "run", "draw"}),
        (module(cell), {"8 overrides", "check", "run", "draw"}),
    ):
        editor.open(path)
        params = types.CodeLensParams(types.TextDocumentIdentifier(uri_of(path)))
        found = editor.ask(editor.client.text_document_code_lens_async, params)
        assert wanted <= {lens.command.title for lens in found}


def test_symbols_folding_selection_and_hints(editor: Editor, cell: Path) -> None:
    for path, state in ((feeder(cell), "working"), (module(cell), "operational")):
        editor.open(path)
        identifier = types.TextDocumentIdentifier(uri_of(path))
        symbols = editor.ask(
            editor.client.text_document_document_symbol_async,
            types.DocumentSymbolParams(identifier),
        )
        tree = {symbol.name: symbol for symbol in symbols}
        assert len(tree[state].children) > 3
        folds = editor.ask(
            editor.client.text_document_folding_range_async, types.FoldingRangeParams(identifier)
        )
        assert len(folds) > 10
        position = editor.at(path, "goto(HOME", 6)["position"]
        (selected,) = editor.ask(
            editor.client.text_document_selection_range_async,
            types.SelectionRangeParams(identifier, [position]),
        )
        depth = 0
        while selected is not None:
            depth, selected = depth + 1, selected.parent
        assert depth >= 3
        whole = types.Range(types.Position(0, 0), types.Position(200, 0))
        hints = editor.ask(
            editor.client.text_document_inlay_hint_async,
            types.InlayHintParams(identifier, whole),
        )
        assert any("ticks" in str(hint.label) for hint in hints)
    found = editor.ask(
        editor.client.workspace_symbol_async, types.WorkspaceSymbolParams("mold_fin")
    )
    assert [symbol.name for symbol in found][:1] == ["mold_finished"]


# --- checks in the background ---------------------------------------------------------------------

WRONG = """\
system: Two
machines: {a: gate.yaml}
environment: {may: [a.go]}
properties:
  never_open: {never: a.In(open)}
  never_shut: {reachable: a.In(open)}
"""
GATE = """\
chart: Gate
events: {in: [go]}
initial: shut
states:
  shut: {on: {go: open}}
  open: {on: {go: shut}}
"""


def command(editor: Editor, name: str, *arguments: object) -> Any:
    params = types.ExecuteCommandParams(name, list(arguments))
    return editor.ask(editor.client.workspace_execute_command_async, params)


def test_a_counterexample_opens_at_its_line(editor: Editor, tmp_path: Path) -> None:
    folder = tmp_path.resolve()
    path = folder / "two.yaml"
    path.write_text(WRONG, encoding="utf-8")
    (folder / "gate.yaml").write_text(GATE, encoding="utf-8")
    assert editor.open(path) == []
    assert command(editor, "fsmkit.check", uri_of(path))["verdict"] == "violated"
    (found,) = editor.published[path]
    assert (found.source, found.code, found.range.start.line) == ("fsmkit check", "never_open", 4)
    shown = command(editor, "fsmkit.counterexample", uri_of(path), "never_open")
    assert "sequenceDiagram" in shown["markdown"]
    assert shown["location"]["uri"] == uri_of(folder / "gate.yaml")
    assert shown["location"]["range"]["start"]["line"] == 4
    played = command(editor, "fsmkit.replay", uri_of(path), "never_open")
    assert [step["uri"] for step in played["steps"]] == 2 * [uri_of(folder / "gate.yaml")]
    assert [step["active"] for step in played["steps"]] == [["shut"], ["open"]]
    params = types.CodeLensParams(types.TextDocumentIdentifier(uri_of(path)))
    lenses = editor.ask(editor.client.text_document_code_lens_async, params)
    titles = [lens.command.title for lens in lenses]
    assert "never_open: violated in 2 steps: show" in titles
    assert "replay" in titles
    editor.open(path, WRONG.replace("never_shut", "comes"))
    assert all(d.source != "fsmkit check" for d in editor.published[path])


def test_a_request_that_is_cancelled_ends_before_those_ahead_of_it(
    editor: Editor, cell: Path
) -> None:
    path = feeder(cell)
    editor.open(path)
    where = editor.at(path, "operational:")
    send = editor.client.protocol.send_request_async
    ended: list[str] = []

    async def both() -> None:
        async def first() -> None:
            await send("textDocument/rename", types.RenameParams(new_name="zz", **where))
            ended.append("rename")

        async def second() -> None:
            params = types.HoverParams(**where)
            with pytest.raises(JsonRpcException, match="cancel"):
                await send("textDocument/hover", params, msg_id="second")
            ended.append("hover")

        running = [asyncio.ensure_future(first()), asyncio.ensure_future(second())]
        await asyncio.sleep(0)
        editor.client.cancel_request(types.CancelParams("second"))
        await asyncio.gather(*running)

    editor.ask(lambda _: both(), None)
    assert ended == ["hover", "rename"]


# --- pictures -------------------------------------------------------------------------------------


@pytest.mark.external
def test_a_picture_names_lines(editor: Editor, cell: Path) -> None:
    editor.open(feeder(cell))

    def draw(params: Any) -> Any:
        return editor.client.protocol.send_request_async("fsmkit/draw", params)

    found = editor.ask(draw, {"uri": uri_of(feeder(cell)), "folded": ["homing"], "active": []})
    assert found.svg.startswith("<svg")
    assert "seeking" not in found.svg
    states = [item for item in found.items if item.kind == "state"]
    names = {item.name: item.line for item in states}
    assert names["pressing"] == 72


# --- places ---------------------------------------------------------------------------------------


def test_columns_are_those_that_were_agreed_on(tmp_path: Path) -> None:
    folder = tmp_path.resolve()
    path = folder / "a.yaml"
    path.write_text(
        "chart: A\ninitial: a\nevents: {in: [go]}\n"
        "states:\n  a: {doc: 'ä𝄞', on: {go: bb}}\n  b: {}\n",
        encoding="utf-8",
    )
    editor = Editor(folder, encoding="utf-8")
    try:
        assert editor.capabilities.position_encoding == "utf-8"
        found = next(d for d in editor.open(path) if d.code == "FK0201")
        lines = editor.lines(path)
        start, end = lines.offset(found.range.start), lines.offset(found.range.end)
        assert lines.text[start:end] == "bb"
    finally:
        editor.close()


def test_nothing_that_a_file_names_is_run(editor: Editor, tmp_path: Path) -> None:
    folder = tmp_path.resolve()
    trap = folder / "trap.py"
    trap.write_text(f"open({str(folder / 'ran')!r}, 'w')\n", encoding="utf-8")
    for number, text in enumerate(
        (
            "chart: A\nextends: trap:machine\n",
            "system: S\nmachines: {a: 'trap:machine'}\n",
            "tests: T\nchart: trap:machine\ncases: {a: [start]}\n",
        )
    ):
        assert editor.open(folder / f"a{number}.yaml", text)
    assert not (folder / "ran").exists()


def test_formatting_is_that_of_the_command_line(editor: Editor, cell: Path) -> None:
    for path, old, new in (
        (feeder(cell), "block_waiting and mold_waiting", "block_waiting  and   mold_waiting"),
        (module(cell), 'cond="homed"', 'cond=" homed "'),
    ):
        text = path.read_text(encoding="utf-8")
        wanted = format_source(text, str(path))
        editor.open(path, changed(path, old, new))
        identifier = types.TextDocumentIdentifier(uri_of(path))
        options = types.FormattingOptions(2, insert_spaces=True)
        edits = editor.ask(
            editor.client.text_document_formatting_async,
            types.DocumentFormattingParams(identifier, options),
        )
        assert [edit.new_text for edit in edits] == [wanted]
