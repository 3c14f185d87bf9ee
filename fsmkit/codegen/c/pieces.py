"""C that is the same for all machines, but for their names and for what they do at all.

It stands in the files of ``pieces``, which are C: a compiler reads them with the names of
``tests/codegen/c/pieces.h``. The generator does to them what a preprocessor would, so that the file
it writes has nothing in it that this machine does not need:

* ``#if`` and a mechanism (`codegen.c.mechanisms`, in capitals) takes or leaves lines; ``#ifdef``
  and ``#ifndef`` are the host's, and stay;
* ``self`` and ``SELF`` at the beginning of a name stand for the prefix of the machine;
* a few names stand for a type, an expression or statements, which the one who places a piece gives.

Definitions are set apart by empty lines, and have none inside.
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
"""By name: the text of an expression or a type, or the lines of statements."""
_NAME = re.compile(r" ?\b(?:self|SELF|inside|SLOT)\w*")
_DEFINED = re.compile(r"\bself_(\w+)")


@dataclass(frozen=True, slots=True)
class Piece:
    """A definition as it stands in a file."""

    name: str
    is_private: bool
    """Nothing outside the source refers to it."""
    lines: tuple[str, ...]


def print_pieces(
    out: Unit,
    names: Names,
    file: str,
    *wanted: str,
    parts: Parts | None = None,
    facts: Mapping[str, bool] | None = None,
) -> None:
    """Add definitions of a file, all of them if none is named.

    Args:
        out: What they are added to.
        names: Those of the machine.
        file: The name of a file of ``pieces``, without its suffix.
        wanted: Names of definitions, without the prefix.
        parts: What stands in for names, beside the types of every machine.
        facts: Whether what else ``#if`` asks for is so, beside the mechanisms.

    """
    found = _pieces(file, frozenset({**names.facts, **(facts or {})}.items()))
    spelt: Parts = {
        "self_taken": names.taken_type,
        "self_region": names.region_type,
        "self_event_number": event_type(names),
        **(parts or {}),
    }
    for name in wanted or found:
        piece = found[name]
        number = spelt.get("N")
        own = f"{name.removesuffix('N')}{number}" if number and name.endswith("_N") else name
        out.define(own if piece.is_private else None)
        for line in piece.lines:
            out.lines(_filled(line, spelt))
        out.line()


def _filled(line: str, parts: Parts) -> Iterator[str]:
    """Yield what a line becomes: several where it stands for statements, none for no statement."""
    word = line.strip().removesuffix(";")
    lines = parts.get(word)
    if lines is not None and not isinstance(lines, str):
        inset = line[: len(line) - len(line.lstrip())]
        yield from (inset + each if each else "" for each in lines)
        return

    def stand_in(found: re.Match[str]) -> str:
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

    yield _NAME.sub(stand_in, line)


@lru_cache(maxsize=256)
def _pieces(file: str, facts: frozenset[tuple[str, bool]]) -> Mapping[str, Piece]:
    """Return the definitions of a file that are there if facts are so, by name."""
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
