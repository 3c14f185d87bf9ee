"""What of a generated source nothing calls is left out.

A chart pays only for the helpers that its content calls; which mechanisms it has, its Plan says
(`codegen.c.mechanisms`). The text is that of our own printers: a definition begins in the first
column, and ends with a line that begins with ``}`` or ends with ``;``.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass

WORD = re.compile(r"[A-Za-z_]\w*")
DEFINED = re.compile(r"(\w+)(?:\[[^\]]*\])*\s*(?:\(|=|;|$)")


@dataclass(frozen=True, slots=True)
class _Definition:
    """Lines of a file, and the name that they define if nobody outside can use it."""

    text: str
    name: str | None

    @property
    def words(self) -> frozenset[str]:
        return frozenset(WORD.findall(self.text))


def pruned(text: str) -> str:
    """Return a source without the static definitions that nothing refers to."""
    parts = list(_definitions(text))
    own = {part.name for part in parts if part.name is not None}
    words = {id(part): part.words & own for part in parts}
    kept = {id(part) for part in parts if part.name is None}
    open_ = set().union(*(words[id(part)] for part in parts if id(part) in kept))
    wanted: set[str] = set()
    by_name: dict[str, list[_Definition]] = {}
    for part in parts:
        if part.name is not None:
            by_name.setdefault(part.name, []).append(part)
    while open_:
        name = open_.pop()
        if name in wanted:
            continue
        wanted.add(name)
        for part in by_name[name]:
            kept.add(id(part))
            open_ |= words[id(part)] - wanted
    found = "\n".join(part.text for part in parts if id(part) in kept)
    return re.sub(r"\n{3,}", "\n\n", found).rstrip("\n") + "\n"


def _definitions(text: str) -> Iterator[_Definition]:
    """Yield the definitions of a file, each with the comment before it and the line after it."""
    lines: list[str] = []
    is_open = False
    for line in text.split("\n"):
        lines.append(line)
        if not is_open and (not line or line.startswith((" *", "/*", "#"))):
            is_own = line.startswith("#define") and not line.startswith("#define FSM_")
            if line.startswith("#") and not is_own:
                yield _Definition("\n".join(lines), None)
                lines = []
            elif is_own:
                yield _Definition("\n".join(lines), line.split()[1].partition("(")[0])
                lines = []
            continue
        is_open = True
        if line.startswith("}") or (line and not line.startswith((" ", "{")) and line[-1] == ";"):
            yield _Definition("\n".join(lines), _name(lines))
            lines, is_open = [], False
    if lines:
        yield _Definition("\n".join(lines), None)


def _name(lines: list[str]) -> str | None:
    """Return what a definition defines, None where others may refer to it."""
    first = next(line for line in lines if line and not line.startswith(("/*", " *", "#")))
    if first.startswith("typedef"):
        of_function = re.search(r"(\w+)\(", first)
        return of_function.group(1) if of_function else lines[-1].rstrip(";").split()[-1]
    if not first.startswith("static "):
        return None
    found = DEFINED.search(first)
    assert found is not None, first  # noqa: S101
    return found.group(1)
