"""Parameters of a system: names for numbers, durations and members, which ``--set`` replaces.

``parameters: {N: 3, T_HOLD: 10ms}``. A parameter may stand wherever the file has an expression, an
index, a delay or a capacity; it is replaced before anything else is read, each character of its
value having the place of the name. As constants of a chart, it may use those before it.
"""

from __future__ import annotations

import re
from collections.abc import Mapping as Table
from dataclasses import replace

from fsmkit.diagnostics import Findings, FsmkitError, Source, Span, Text
from fsmkit.diagnostics.suggest import suggest
from fsmkit.document.document import Document
from fsmkit.language import IntType, Literal, Scope, fold, type_expression
from fsmkit.system.indices import joined, placed
from fsmkit.system.machines import with_constant
from fsmkit.yaml.nodes import Mapping, Node, Scalar, Sequence, entries_of, require_text

NAME = re.compile(r"[A-Za-z_]\w*")
PLAIN = ("system", "doc", "parameters")
"""Keys of a system under which nothing is replaced."""
LINE = "<--set>"


def with_parameters(
    root: Mapping, given: Table[str, str], findings: Findings
) -> tuple[Mapping, tuple[tuple[str, str], ...]]:
    """Return a system without its parameters, and their values, as texts.

    Args:
        root: The outermost node.
        given: Values that count instead of those of the file, by name.
        findings: Where a value that is none, and a name that there is not, is reported.

    """
    node = next((value for key, value in root.entries if key.value == "parameters"), None)
    values: dict[str, Text] = {}
    for name, value in entries_of(node, "`parameters`", findings):
        text = require_text(value, f"the parameter `{name}`", findings)
        if NAME.fullmatch(name.value) is None:
            findings.add(
                "unexpected-shape", f"`{name}` is no name for a parameter", name,
                help="use letters, digits and `_`",
            )  # fmt: skip
        elif text is not None:
            text = _from_line(given[name.value]) if name.value in given else text
            values[name.value] = _known(_replaced(text, values))
    for unknown in sorted(given.keys() - values.keys()) if not findings.has_errors else ():
        known = ", ".join(values) or "none"
        findings.add(
            "unknown-name", f"the system has no parameter `{unknown}`", _from_line(unknown),
            help=suggest(unknown, list(values), f"it has {known}; declare it under `parameters`"),
        )  # fmt: skip
    entries = tuple(
        (key, value if key.value in PLAIN else _below(value, values))
        for key, value in root.entries
        if key.value != "parameters"
    )
    return replace(root, entries=entries), tuple((n, v.value) for n, v in values.items())


def with_set_constants(
    documents: tuple[Document, ...], given: Table[str, str], findings: Findings
) -> tuple[Document, ...]:
    """Return a chart whose constants have the values that are given; `FsmkitError` if not."""
    for name, value in given.items():
        documents = with_constant(documents, _from_line(name), _from_line(value), findings)
    if findings.has_errors:
        raise FsmkitError(findings)
    return documents


def _from_line(value: str) -> Text:
    """Return what was given on the command line, with a place."""
    return Text(value, Span(Source(LINE, value), 0, len(value)))


def _known(text: Text) -> Text:
    """Return the number that an expression is; anything else, for instance a duration, as it is."""
    tree = type_expression(text, Scope(), Findings())
    found = None if tree is None else fold(tree)
    if isinstance(found, Literal) and isinstance(found.type, IntType):
        return placed(str(found.value), text)
    return text


def _below(node: Node, values: Table[str, Text]) -> Node:
    """Return a node in whose texts parameters are replaced; of keys only in those with an index."""
    match node:
        case Scalar(text):
            return replace(node, text=_replaced(text, values))
        case Sequence(items):
            return replace(node, items=tuple(_below(item, values) for item in items))
        case Mapping(entries):
            return replace(
                node,
                entries=tuple(
                    (_replaced(key, values) if "[" in key.value else key, _below(value, values))
                    for key, value in entries
                ),
            )


def _replaced(text: Text, values: Table[str, Text]) -> Text:
    """Return a text with values for names of parameters, but in quotes, after a dot and in `In`."""
    if not values:
        return text
    names = "|".join(map(re.escape, values))
    pattern = re.compile(
        rf"\"[^\"]*\"|'[^']*'|\bIn\s*\([^()]*\)|(?<!\w)(?<!(?<!\.)\.)({names})(?!\w|\s*=(?!=)|\s*\()"
    )
    parts: list[Text] = []
    at = 0
    for match in pattern.finditer(text.value):
        if match[1] is not None:
            value = placed(values[match[1]].value, text.part(*match.span()))
            parts += [text.part(at, match.start()), value]
            at = match.end()
    return joined((*parts, text.part(at, len(text.value))), text.span) if parts else text
