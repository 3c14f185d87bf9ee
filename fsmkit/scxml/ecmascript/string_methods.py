"""Decide methods of strings when compiling, for each string that the variables in them can hold.

``s.slice(1)`` of an ``s`` that only ever is ``'up'`` or ``'down'`` becomes ``s == "up" ? "p" :
"own"``: strings have no storage at run time. What is no string, no finite number, or not known is
left as it is, which is told.
"""

from __future__ import annotations

import json
import re
from collections.abc import Mapping, Sequence

from fsmkit.diagnostics import Text
from fsmkit.document.document import Document
from fsmkit.document.invocation_context import InvocationContext
from fsmkit.document.walk import mapped, parts
from fsmkit.language.syntax import CallNode, ElementNode, MemberNode, Node
from fsmkit.scxml.ecmascript.known_strings import MOST_PAIRS, KnownStrings, find_strings
from fsmkit.scxml.ecmascript.rewrite import names, nodes, parsed, spelt
from fsmkit.scxml.ecmascript.string_values import FUNCTIONS, Unknown, Value, evaluate

LARGEST = 2**53
METHODS = (
    *("charAt", "concat", "endsWith", "includes", "indexOf", "lastIndexOf", "length", "replace"),
    *("slice", "split", "startsWith", "substr", "substring", "toLowerCase", "toUpperCase", "trim"),
)
WORDS = re.compile(
    rf"\.(?:{'|'.join(METHODS)})(?![\w$])|(?<![\w$.])(?:{'|'.join(FUNCTIONS)})\s*\(|\]"
)
"""What hints at an expression that may be decided."""


def decide_methods(document: Document, given: InvocationContext | None) -> Document:
    """Return a document of a loose dialect in which methods of known strings are values."""
    if document.datamodel == "fsmkit":
        return document
    whole = tuple(parts(document))
    if not any(isinstance(part, Text) and WORDS.search(part.value) for part in whole):
        return document
    known = find_strings(document, whole, given, {})

    def change(part: object) -> object:
        if not isinstance(part, Text) or not WORDS.search(part.value):
            return None
        node = parsed(part)
        if node is None:
            return part
        value = spelt(node, part.value, lambda node: _decided(node, known))
        return part if value == part.value else part.instead(value)

    found: Document = mapped(document, change)
    return found


def _decided(node: Node, known: KnownStrings) -> str | None:
    """Return what a node is for each value of its variables; None where it is left as it is."""
    inside = list(nodes(node))
    if not any(isinstance(n, CallNode | MemberNode | ElementNode) for n in inside):
        return None
    variables = sorted(names(node) - set(FUNCTIONS))
    sets = [known.of(name) for name in variables]
    if not variables or not all(sets) or known.unset.intersection(variables):
        return None
    count = 1
    for values in sets:
        count *= len(values or ())
    if count > MOST_PAIRS:
        return None
    try:
        return _chain(node, variables, [sorted(values or ()) for values in sets], {})
    except Unknown:
        return None


def _chain(
    node: Node, variables: Sequence[str], sets: Sequence[list[str]], held: Mapping[str, str]
) -> str:
    """Return the value of a node for each value of its variables, one variable after the other."""
    if not variables:
        return _literal(evaluate(node, held))
    name, results = variables[0], dict[str, list[str]]()
    for value in sets[0]:
        inner = _chain(node, variables[1:], sets[1:], {**held, name: value})
        results.setdefault(inner, []).append(f"{name} == {json.dumps(value)}")
    *others, (last, _) = sorted(results.items(), key=lambda item: len(item[1]))
    chain = "".join(f"{' || '.join(tests)} ? {value} : " for value, tests in others)
    return f"({chain}{last})" if others else last


def _literal(value: Value) -> str:
    if isinstance(value, float) and value == int(value) and abs(value) < LARGEST:
        value = int(value)
    if isinstance(value, int | float) and not -(2**63) <= value < 2**63:
        raise Unknown
    return json.dumps(value, ensure_ascii=False)
