"""The parser of the grammar, from precomputed tables, because computing them takes long.

`grammar.json` holds the tables that Lark computes from `grammar.lark`, as data: nothing in it is
executed. It is valid for one version of Lark and one text of the grammar. Otherwise Lark computes
the tables again, which gives the same parser. `python -m devtools.parser_tables` writes the file.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import lark
from lark import Lark, Transformer

from fsmkit.diagnostics.parsing import parse_json

GRAMMAR = Path(__file__).with_name("grammar.lark")
TABLES = Path(__file__).with_name("grammar.json")
STARTS = ("expression", "statements", "signature", "typed")


def load_parser(transformer: Transformer[Any, Any]) -> Lark:
    """Return the parser; `transformer` has one action for each rule."""
    grammar = GRAMMAR.read_text(encoding="utf-8")
    return parser_from_tables(grammar, TABLES, transformer) or build_parser(grammar, transformer)


def build_parser(grammar: str, transformer: Transformer[Any, Any] | None = None) -> Lark:
    """Return a parser whose tables are computed from a grammar."""
    return Lark(
        grammar,
        parser="lalr",
        start=list(STARTS),
        transformer=transformer,
        maybe_placeholders=False,
    )


def parser_from_tables(grammar: str, file: Path, transformer: Transformer[Any, Any]) -> Lark | None:
    """Return the parser with the tables of a file; None if they belong to another grammar."""
    try:
        found = parse_json(file.read_bytes())
    except (OSError, ValueError):
        return None
    if not isinstance(found, dict) or found.get("made_by") != fingerprint(grammar):
        return None
    data, memo = found["data"], by_number(found["memo"])
    tables = data["parser"]["parser"]
    tables["tokens"] = by_number(tables["tokens"])
    tables["states"] = by_number(tables["states"], by_number)
    # the function of Lark's standalone tool; it has no public name
    parser: Lark = Lark._load_from_dict(data, memo, transformer=transformer)  # type: ignore[no-untyped-call]  # noqa: SLF001
    return parser


def fingerprint(grammar: str) -> list[str]:
    """Return the inputs of the tables: the version of Lark and the text of the grammar."""
    return [lark.__version__, hashlib.sha256(grammar.encode()).hexdigest()]


def by_number(
    found: Mapping[str, Any], inner: Callable[[Any], Any] = lambda value: value
) -> dict[int, Any]:
    """Return a table with integer keys; JSON permits only strings."""
    return {int(key): inner(value) for key, value in found.items()}
