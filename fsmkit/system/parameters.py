"""Parameters of a system: names for numbers, durations and members, which ``--set`` replaces.

``parameters: {N: 3, T_HOLD: 10ms}``. A parameter may occur in expressions, indices, delays and
capacities. It is replaced before anything else is read; each character of its value has the
location of the name. Like constants of a chart, a parameter may use earlier ones.
"""

from __future__ import annotations

import re
from collections.abc import Mapping as Table
from dataclasses import replace

from fsmkit.diagnostics import Findings, FsmkitError, Source, Span, Text
from fsmkit.diagnostics.suggestions import suggest
from fsmkit.document.document import Document
from fsmkit.language import IntType, Literal, Scope, fold, type_expression
from fsmkit.system.indices import join_texts, text_at
from fsmkit.system.machines import with_constant
from fsmkit.yaml.nodes import Mapping, Node, Scalar, Sequence, entries_of, require_text

NAME = re.compile(r"[A-Za-z_]\w*")
PLAIN = ("system", "doc", "parameters")
"""Keys of a system under which nothing is replaced."""
LINE = "<--set>"


def with_parameters(
    root: Mapping, given: Table[str, str], findings: Findings
) -> tuple[Mapping, tuple[tuple[str, str], ...]]:
    """Return a system without its parameters, and their values as strings.

    Args:
        root: The outermost node.
        given: Values that override those of the file, by name.
        findings: Receives invalid values and unknown names.

    """
    node = next((value for key, value in root.entries if key.value == "parameters"), None)
    values: dict[str, Text] = {}
    for name, value in entries_of(node, "`parameters`", findings):
        text = require_text(value, f"the parameter `{name}`", findings)
        if NAME.fullmatch(name.value) is None:
            findings.add(
                "unexpected-shape", f"`{name}` is not a valid parameter name", name,
                help="use letters, digits and `_`",
            )  # fmt: skip
        elif text is not None:
            text = _from_line(given[name.value]) if name.value in given else text
            values[name.value] = _constant_value(_replace_names(text, values))
    for unknown in sorted(given.keys() - values.keys()) if not findings.has_errors else ():
        known = ", ".join(values) or "none"
        findings.add(
            "unknown-name", f"the system has no parameter `{unknown}`", _from_line(unknown),
            help=suggest(unknown, list(values), f"it has {known}; declare it under `parameters`"),
        )  # fmt: skip
    entries = tuple(
        (key, value if key.value in PLAIN else _replace_below(value, values))
        for key, value in root.entries
        if key.value != "parameters"
    )
    return replace(root, entries=entries), tuple((n, v.value) for n, v in values.items())


def with_set_constants(
    documents: tuple[Document, ...], given: Table[str, str], findings: Findings
) -> tuple[Document, ...]:
    """Return a chart whose constants have the given values. Raises `FsmkitError` for others."""
    for name, value in given.items():
        documents = with_constant(documents, _from_line(name), _from_line(value), findings)
    if findings.has_errors:
        raise FsmkitError(findings)
    return documents


def _from_line(value: str) -> Text:
    """Return a value of the command line, with its location."""
    return Text(value, Span(Source(LINE, value), 0, len(value)))


def _constant_value(text: Text) -> Text:
    """Return the number of a constant expression; others, for instance durations, unchanged."""
    tree = type_expression(text, Scope(), Findings())
    found = None if tree is None else fold(tree)
    if isinstance(found, Literal) and isinstance(found.type, IntType):
        return text_at(str(found.value), text)
    return text


def _replace_below(node: Node, values: Table[str, Text]) -> Node:
    """Return a node with parameters replaced in its values, and in keys that have an index."""
    match node:
        case Scalar(text):
            return replace(node, text=_replace_names(text, values))
        case Sequence(items):
            return replace(node, items=tuple(_replace_below(item, values) for item in items))
        case Mapping(entries):
            return replace(
                node,
                entries=tuple(
                    (
                        _replace_names(key, values) if "[" in key.value else key,
                        _replace_below(value, values),
                    )
                    for key, value in entries
                ),
            )


def _replace_names(text: Text, values: Table[str, Text]) -> Text:
    """Replace names of parameters in a text, but not in quotes, after a dot or in `In`."""
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
            value = text_at(values[match[1]].value, text.part(*match.span()))
            parts += [text.part(at, match.start()), value]
            at = match.end()
    return join_texts((*parts, text.part(at, len(text.value))), text.span) if parts else text
