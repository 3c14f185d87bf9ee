"""The parser of the grammar, from tables that were made once, as to make them takes long.

`grammar.json` holds the tables that Lark makes of `grammar.lark`, as data: nothing in it is
executed. It counts for the version of Lark that wrote it and for that text of the grammar; else
Lark makes them again, which gives the same parser. `python -m devtools.parser_tables` writes it.
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


def parser_with(transformer: Transformer[Any, Any]) -> Lark:
    """Return the parser whose actions a transformer has, one for each rule."""
    grammar = GRAMMAR.read_text(encoding="utf-8")
    return loaded(grammar, TABLES, transformer) or made(grammar, transformer)


def made(grammar: str, transformer: Transformer[Any, Any] | None = None) -> Lark:
    """Return the parser with tables that are made of the text of a grammar."""
    return Lark(
        grammar,
        parser="lalr",
        start=list(STARTS),
        transformer=transformer,
        maybe_placeholders=False,
    )


def loaded(grammar: str, file: Path, transformer: Transformer[Any, Any]) -> Lark | None:
    """Return the parser with the tables of a file; None where they are of another grammar."""
    try:
        found = parse_json(file.read_bytes())
    except (OSError, ValueError):
        return None
    if not isinstance(found, dict) or found.get("made_by") != maker(grammar):
        return None
    data, memo = found["data"], numbered(found["memo"])
    tables = data["parser"]["parser"]
    tables["tokens"] = numbered(tables["tokens"])
    tables["states"] = numbered(tables["states"], numbered)
    # with what Lark's own tool makes a parser of such data; it has no public name
    parser: Lark = Lark._load_from_dict(data, memo, transformer=transformer)  # type: ignore[no-untyped-call]  # noqa: SLF001
    return parser


def maker(grammar: str) -> list[str]:
    """Return what tables depend on: the version of Lark and the text of the grammar."""
    return [lark.__version__, hashlib.sha256(grammar.encode()).hexdigest()]


def numbered(
    found: Mapping[str, Any], inner: Callable[[Any], Any] = lambda value: value
) -> dict[int, Any]:
    """Return a table by number; JSON has no keys but texts."""
    return {int(key): inner(value) for key, value in found.items()}
