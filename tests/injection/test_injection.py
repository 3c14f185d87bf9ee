"""No text of a chart is code, wherever it stands: a part of the grid of `make injection`."""

from __future__ import annotations

import ast
import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest
import yaml
from lxml import etree

from fsmkit.chart.loading import load
from fsmkit.cli import execute as command_line
from fsmkit.codegen.c.generate import generate_machine
from fsmkit.codegen.pyext.generate import generate
from fsmkit.emit import Identifier, RawText, Written, c, mermaid, printing, telling, written
from fsmkit.export.identifiers import word
from fsmkit.verify.engines.c.binding import prefix_of
from fsmkit.verify.engines.c.output import performed_steps
from tests.codegen.c.conftest import WARNINGS
from tests.injection.grid import texts_of_round, tried, write
from tests.injection.places import SHAPES

pytestmark = pytest.mark.usefixtures("own_cache", "quickly_compiled")
FINDINGS = Path(__file__).parent / "findings"
QUICK = {"yaml": 4, "scxml": 9, "plain": 14, "invoking": 19, "system": 24, "deployment": 24}
"""A round for each kind of files; all rounds with all outputs: `make injection`."""


@pytest.mark.slow
@pytest.mark.external
@pytest.mark.parametrize("shape", SHAPES)
def test_a_round_of_the_grid(shape: str, tmp_path: Path) -> None:
    is_quick = shape != "invoking"  # explorers and modules of one machine and of one in another
    count = tried(shape, texts_of_round(shape, QUICK[shape]), tmp_path, is_quick=is_quick)
    assert not count.wrong, "\n".join(count.wrong)
    assert count.right


@pytest.mark.parametrize("shape", SHAPES)
def test_nothing_is_executed_and_all_is_json_in_an_editor(shape: str, tmp_path: Path) -> None:
    texts = texts_of_round(shape, QUICK[shape])
    count = tried(shape, texts, tmp_path, is_quick=True, names=("dap",))
    assert not count.wrong, "\n".join(count.wrong)
    assert count.right


@pytest.mark.slow
@pytest.mark.cc
def test_the_name_of_a_chart_is_not_executed_by_the_explorer(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert command_line(["check", str(FINDINGS / "chart_name.yaml")]) == 0
    assert not (tmp_path / "owned").exists()


@pytest.mark.cc
def test_the_name_of_a_type_is_not_executed_by_an_extension_module(tmp_path: Path) -> None:
    given = [str(FINDINGS / "type_name.yaml"), "--target", "pyext", "--out", str(tmp_path)]
    assert command_line(["compile", *given]) == 0
    subprocess.run([sys.executable, "-c", "import poc"], check=True, cwd=tmp_path)
    assert not (tmp_path / "owned").exists()


@pytest.mark.external
@pytest.mark.parametrize("form", [[], ["--optimize", "size"]], ids=["default", "size"])
@pytest.mark.parametrize(
    "compiler", [("gcc", "-std=c99"), ("gcc", "-std=gnu2x"), ("clang", "-std=c11"), ("g++",)]
)
def test_words_of_c_are_names(form: list[str], compiler: tuple[str, ...], tmp_path: Path) -> None:
    """Keywords, macros of headers and members of ours, of C, C++ and Python."""
    given = [str(FINDINGS / "kw.scxml"), *form, "--out", str(tmp_path)]
    assert command_line(["compile", *given]) == 0
    kind = "*.h" if compiler == ("g++",) else "*.c"
    files = map(str, sorted(tmp_path.glob(kind)))
    more = ["-x", "c++"] if kind == "*.h" else WARNINGS
    subprocess.run([*compiler, "-fsyntax-only", *more, *files], check=True)


FILE_NAMES = {
    "not of UTF-8": b"\xff\xfe.yaml",
    "shell": b"$(touch owned).yaml",
    "lines": b"a\nint creat;\n.yaml",
    "docstring": b'a"""+x.yaml',
    "quote at the end": b'a.yaml"',
}


@pytest.mark.parametrize("name", FILE_NAMES.values(), ids=FILE_NAMES)
def test_the_name_of_the_file_is_no_code_of_an_extension_module(name: bytes) -> None:
    chart = load(FINDINGS / "type_name.yaml")
    source = replace(chart.sources[0], name=os.fsdecode(name))
    _, files = generate(replace(chart, sources=(source, *chart.sources[1:])))
    for file, text in files.items():
        text.encode()
        if file.endswith(".pyi"):
            assert isinstance(ast.parse(text).body[1], ast.ImportFrom)


@pytest.mark.cc
def test_a_machine_of_two_underscores_is_found_in_the_body_of_its_class(tmp_path: Path) -> None:
    texts = {"chart": "\"' x"}
    count = tried("plain", texts, tmp_path, is_quick=True)
    assert not count.wrong, "\n".join(count.wrong)
    assert count.right


# --- the guard ------------------------------------------------------------------------------------


@printing
def raw(text: str) -> str:
    return f"/* {text} */"


@printing
def through_the_door(text: str) -> str:
    return f"/* {c.comment(text)} */"


@telling
def told(text: str) -> str:
    return f"the state {text}"


def test_a_printer_takes_no_text_raw() -> None:
    with pytest.raises(RawText):
        raw(Written("x */ y"))
    assert through_the_door(Written("x */ y")) == "/* x * / y */"


def test_what_is_made_of_a_text_is_guarded_too() -> None:
    hostile = Written("x */ y")
    for made in ("of " + hostile, hostile + " is", told(hostile), hostile.upper(), str(hostile)):
        with pytest.raises(RawText):
            raw(made)


def test_a_chart_is_written_even_where_a_printer_forgot_a_harmless_name(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(written, "is_strict", False)
    assert raw(Written("idle")) == "/* idle */"
    monkeypatch.setattr(written, "is_strict", True)
    with pytest.raises(RawText):
        raw(Written("idle"))


@pytest.mark.parametrize("name", ["", " "])
def test_a_constant_without_a_name_stands_for_no_number(name: str, tmp_path: Path) -> None:
    """Numbers that were written as such have no name either."""
    (tmp_path / "c.yaml").write_text(
        f"chart: C\nconstants: {{'{name}': 3}}\ndata: {{n: 0..9 = 5}}\n"
        "states: {a: {entry: n = 7, after: {1s: b}}, b: {}}\n",
        encoding="utf-8",
    )
    source = generate_machine(load(tmp_path / "c.yaml")).files["c.c"]
    assert "m->data.n = 7u;" in source
    assert "1000u" in source


def test_findings_say_names_as_they_are() -> None:
    assert f"`{Written('x */ y')}`" == "`x */ y`"


@pytest.mark.parametrize("text", ["", "1a", "a b", "a;", "é"])
def test_an_identifier_is_one(text: str) -> None:
    with pytest.raises(RawText):
        Identifier(text)


# --- found by the grid and the fuzzer ------------------------------------------------------------


@pytest.mark.external
def test_an_entity_in_a_name_is_text_for_graphviz(tmp_path: Path) -> None:
    """Graphviz reads entities in quoted texts, too, and wrote ``&;`` into the title as it was."""
    (tmp_path / "c.yaml").write_text(
        'chart: "&;n &lt; &#65;"\ninitial: "&;x"\nstates: {"&;x": {}}\n', encoding="utf-8"
    )
    assert command_line(["draw", str(tmp_path / "c.yaml"), "--out", str(tmp_path / "c.svg")]) == 0
    texts = list(etree.fromstring((tmp_path / "c.svg").read_bytes()).itertext())
    assert "&;n &lt; &#65;" in texts


def test_the_title_of_mermaid_is_the_name() -> None:
    name = '%%{init: {}}%% <script> "x" \\ end'
    assert "%%" not in mermaid.title(name)
    assert "<" not in mermaid.title(name)
    assert yaml.safe_load(f"title: {mermaid.title(name)}")["title"] == name


@pytest.mark.parametrize("length", [81, 200, 5_000])
def test_long_names_stay_different_and_short_in_models(length: int) -> None:
    names = ["x" * length, "x" * length + "y", "x" * length + "z"]
    assert len({word(name) for name in names}) == 3
    assert all(len(word(name)) <= 80 for name in names)
    assert word("x" * 80) == "x" * 80


def test_a_long_name_makes_no_name_of_a_file_too_long(tmp_path: Path) -> None:
    chart = load(write("invoking", {"invocation": "m" * 900}, tmp_path / "source"))
    files = generate_machine(chart, prefix_of(0, "m" * 4_000)).files
    assert max(len(name) for name in files) < 200


def test_no_line_of_a_machine_is_taken_for_one_of_the_explorer() -> None:
    step = '\0{"step": {"action": "start", "machine": 0, "argument": 0, "choices": []}}\n'
    ((performed, lines),) = performed_steps(f'{step}log "a\x85{{"step"\u2028b\n{{,"\n+ c\n')
    assert performed.step.machine == 0
    assert lines == ('log "a\x85{"step"\u2028b', '{,"', "+ c")


@pytest.mark.cc
def test_any_name_of_a_node_is_an_identifier_in_c(tmp_path: Path) -> None:
    texts = {"node": "größe_ä"}
    count = tried("deployment", texts, tmp_path, is_quick=True)
    assert not count.wrong, "\n".join(count.wrong)
    assert count.right == 3


@pytest.mark.external
def test_a_property_may_be_called_as_a_word_of_promela(tmp_path: Path) -> None:
    texts = {"property": "int", "monitored": "started"}
    count = tried("system", texts, tmp_path, is_quick=True, names=("promela",))
    assert not count.wrong, "\n".join(count.wrong)
    assert count.right == 2
