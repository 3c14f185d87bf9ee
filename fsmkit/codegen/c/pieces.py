"""C pieces that machines share, adapted to the names and mechanisms of each machine.

The files of the folder ``pieces`` are C: a compiler reads them with the names of
``tests/codegen/c/pieces.h``. The generator preprocesses them, so its output contains only what this
machine needs:

* ``#if`` with mechanisms (`codegen.c.mechanisms`, in capitals) keeps or drops lines; ``#ifdef``
  and ``#ifndef`` belong to the host and stay;
* a leading ``self`` or ``SELF`` in a name is replaced by the prefix of the machine;
* a few names are replaced by a type, an expression or statements of the caller.

Empty lines separate definitions, which contain none.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

from fsmkit.codegen.c.header import event_type
from fsmkit.codegen.c.ir import OWN, OWN_UPPER, Unit
from fsmkit.codegen.c.names import Names
from fsmkit.codegen.conditional import selected

FOLDER = Path(__file__).parent / "pieces"
Parts = Mapping[str, str | Sequence[str]]
"""Replacements by name: the text of an expression or a type, or the lines of statements."""
_NAME = re.compile(r" ?\b(?:self|SELF|inside|SLOT)\w*")
_DEFINED = re.compile(r"\bself_(\w+)")


@dataclass(frozen=True, slots=True)
class Piece:
    """A definition of a file."""

    name: str
    is_private: bool
    """Whether only the source refers to it."""
    lines: tuple[str, ...]


def print_pieces(
    out: Unit,
    names: Names,
    file: str,
    *requested: str,
    parts: Parts | None = None,
    facts: Mapping[str, bool] | None = None,
) -> None:
    """Add definitions of a file to a unit.

    Args:
        out: The unit.
        names: The names of the machine.
        file: The name of a file of ``pieces``, without its suffix.
        requested: The definitions to add, without the prefix; none: all of them.
        parts: Replacements of names, beside the types of every machine.
        facts: Values of further conditions of ``#if``, beside the mechanisms.

    """
    found = _pieces(file, frozenset({**names.facts, **(facts or {})}.items()))
    replaced: Parts = {
        "self_taken": names.taken_type,
        "self_region": names.region_type,
        "self_event_number": event_type(names),
        **(parts or {}),
    }
    for name in requested or found:
        piece = found[name]
        number = replaced.get("N")
        own = f"{name.removesuffix('N')}{number}" if number and name.endswith("_N") else name
        out.define(own if piece.is_private else None)
        for line in piece.lines:
            out.lines(_filled(line, replaced))
        out.line()


def _filled(line: str, parts: Parts) -> Iterator[str]:
    """Yield the lines for a line of a piece: several, one or none where it is replaced."""
    word = line.strip().removesuffix(";")
    lines = parts.get(word)
    if lines is not None and not isinstance(lines, str):
        inset = line[: len(line) - len(line.lstrip())]
        yield from (inset + each if each else "" for each in lines)
        return

    def replacement(found: re.Match[str]) -> str:
        text = found.group()
        word = text.lstrip(" ")
        part = parts.get(word)
        if part is not None:
            assert isinstance(part, str)  # noqa: S101
            return part if not part or part[0] in ", " else text[: -len(word)] + part
        if word.endswith("_N") and "N" in parts:
            word = f"{word[:-1]}{parts['N']}"
        for mark, own in (("self", OWN), ("SELF", OWN_UPPER), ("inside", parts.get("inside", ""))):
            if word == mark or word.startswith(f"{mark}_"):
                word = f"{own}{word.removeprefix(mark)}"
                break
        return text[: len(text) - len(text.lstrip(" "))] + word

    yield _NAME.sub(replacement, line)


@lru_cache(maxsize=256)
def _pieces(file: str, facts: frozenset[tuple[str, bool]]) -> Mapping[str, Piece]:
    """Return the definitions of a file by name, given the facts of its conditions."""
    found: dict[str, Piece] = {}
    lines: list[str] = []
    for line in [*selected(_text(file), dict(facts)), ""]:
        if line:
            lines.append(line)
            continue
        code = [each for each in lines if not each.startswith(("/*", " *", "   "))]
        if code:
            piece = _piece(tuple(lines), code)
            found[piece.name] = piece
        lines = []
    return found


@lru_cache
def _text(file: str) -> tuple[str, ...]:
    return tuple((FOLDER / f"{file}.c").read_text(encoding="utf-8").split("\n"))


def _piece(lines: tuple[str, ...], code: Sequence[str]) -> Piece:
    head = code[0]
    is_type = head.startswith("typedef")
    named = code[-1] if is_type else re.split(r"[(=\[]", head, maxsplit=1)[0]
    return Piece(
        name=_DEFINED.findall(named)[-1],
        is_private=is_type or head.startswith("static "),
        lines=lines,
    )
