"""The rules by which FDR and ProB checker a CSPm script before they read any meaning into it."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Any

from fsmkit.export.cspm.identifiers import BUILT_IN, RESERVED
from tests.export.cspm_text import Parser, Script, tokens

PAIRS = {")": "(", "]": "[", "}": "{", "|}": "{|", "|]": "[|", "]]": "[["}
OFFERED = {
    "STOP", "SKIP", "CHAOS", "RUN", "Bool", "True", "False", "Events", "union", "diff", "inter",
    "member", "card", "null", "head", "tail", "length", "concat", "set", "seq", "Union", "elem",
    "true", "false",
}  # fmt: skip
"""What a script may use that it does not define."""


def broken_rules(text: str) -> Iterator[str]:
    """Yield the rules that a script breaks."""
    if not text.isascii() or re.search(r"[^\n -~]", text):
        yield "a character that is not printable ASCII"
    if re.search(r"(?m)^\s*(include|external|transparent)\b", text):
        yield "another file or a tool's function is needed"
    opened: list[str] = []
    for token in tokens(text):
        if token in PAIRS.values():
            opened.append(token)
        elif token in PAIRS and (not opened or opened.pop() != PAIRS[token]):
            yield f"{token} closes nothing"
    if opened:
        yield f"{opened[-1]} is not closed"
        return
    parser = Parser(text)
    script = parser.parse()
    taken = {*BUILT_IN.split(), *RESERVED.split()} - {"tock"}  # which every script declares itself
    yield from (f"{name} is built in and defined anew" for name in sorted(parser.names & taken))
    used = {name for part in _parts(script) for name in part}
    yield from (f"{name} is used and not defined" for name in sorted(used - parser.names - OFFERED))


def _parts(script: Script) -> Iterator[set[str]]:
    constructors = {name for names in script.constructors.values() for name in names}
    for fields in script.channels.values():
        for one in fields:
            yield _free(one)
    for equations in script.equations.values():
        for arguments, body in equations:
            bound = {name for one in arguments for name in _free(one)} - constructors
            yield _free(body) - bound
    for _, _, left, right in script.assertions:
        yield _free(left) | _free(right)


def _free(ast: Any) -> set[str]:
    """Return the names that an expression uses and does not bind."""
    match ast:
        case ("name", str(name)):
            return {name}
        case ("call", str(name), *arguments):
            return {name}.union(*map(_free, arguments))
        case (("each" | "parallel"), str(variable), over, *rest):
            return _free(over) | (set().union(*map(_free, rest)) - {variable})
        case tuple() | list():
            inner: set[str] = set()
            return inner.union(*(_free(part) for part in ast if not isinstance(part, str)))
        case _:
            return set()
