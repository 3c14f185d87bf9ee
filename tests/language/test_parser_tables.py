"""The tables of the parser that come with the package are those of the grammar beside them."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from devtools.parser_tables import tables_of
from fsmkit.language import parser_tables
from fsmkit.language.parser_tables import (
    GRAMMAR,
    TABLES,
    build_parser,
    load_parser,
    parser_from_tables,
)
from fsmkit.language.statements.building import StatementBuilder

TEXT = GRAMMAR.read_text(encoding="utf-8")


def test_the_tables_in_the_package_are_those_that_the_grammar_gives() -> None:
    kept, new = (json.loads(text) for text in (TABLES.read_bytes(), tables_of(TEXT)))
    hint = "run `python -m devtools.parser_tables`"
    assert kept["made_by"][1] == new["made_by"][1], hint
    assert (kept["data"], kept["memo"]) == (new["data"], new["memo"]), hint


def test_loaded_tables_are_used_and_no_others_made(monkeypatch: pytest.MonkeyPatch) -> None:
    if json.loads(TABLES.read_bytes())["made_by"] != parser_tables.fingerprint(TEXT):
        pytest.skip("the tables are of another version of Lark, which are not used")
    monkeypatch.setattr(parser_tables, "build_parser", None)
    assert load_parser(StatementBuilder()).parse("", start="statements") == ()


@pytest.mark.parametrize("content", [None, "", "{", "[]", '{"made_by": 1}'])
def test_files_that_hold_no_tables_of_the_grammar_do_not_count(
    content: str | None, tmp_path: Path
) -> None:
    file = tmp_path / "grammar.json"
    if content is not None:
        file.write_text(content)
    assert parser_from_tables(TEXT, file, StatementBuilder()) is None


def test_tables_do_not_count_after_a_change_of_the_grammar() -> None:
    changed = TEXT + "\n// changed\n"
    assert parser_from_tables(changed, TABLES, StatementBuilder()) is None
    assert build_parser(changed, StatementBuilder()).parse("", start="statements") == ()
