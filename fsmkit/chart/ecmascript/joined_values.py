"""Decide strings that are joined of variables with few values, for each of these values.

``'lamp ' + i`` of an ``i`` that only ever is 0 or 1 becomes ``i < 1 ? "lamp 0" : "lamp 1"``:
strings have no storage at run time. What a log shows stays in parts, and delays and names of events
have passes of their own.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping, Sequence
from itertools import groupby

from fsmkit.chart.ecmascript.known_values import find_values
from fsmkit.chart.ecmascript.rewrite import names, nodes, parsed, rewrite_node
from fsmkit.chart.ecmascript.string_values import FUNCTIONS, Unknown, Value, evaluate
from fsmkit.diagnostics import Text
from fsmkit.document.document import DocTransition, Document
from fsmkit.document.invocation_context import InvocationContext
from fsmkit.document.survey import Survey
from fsmkit.document.walk import map_parts
from fsmkit.language.statements.tree import Assign, DocArgument, DocSend, If
from fsmkit.language.syntax import BinaryNode, CallNode, ElementNode, MemberNode, Node

HINT = re.compile(r"\+")
QUOTE = re.compile(r"['\"]")
MOST_STRINGS = 256
"""An expression that joins more strings is left as it is."""
Sets = Mapping[str, frozenset[Value]]


def decide_joins(survey: Survey, given: InvocationContext | None) -> Survey:
    """Return a document of a loose dialect in which joins of known values are choices."""
    document = survey.document
    if document.datamodel == "fsmkit" or not _may_join(survey):
        return survey
    sets = find_values(document, survey.parts, given)
    if not sets:
        return survey
    grows = {id(part.value) for part in survey.parts if isinstance(part, Assign)}
    joining = {id(text) for part in survey.parts for text in joined_texts(part)}

    def change(part: object) -> object:
        if not isinstance(part, Text) or id(part) not in joining or not HINT.search(part.value):
            return None
        node = parsed(part)
        if node is None:
            return part
        value = rewrite_node(
            node, part.value, lambda each: _decided(each, sets, grows=id(part) in grows)
        )
        return part if value == part.value else part.with_value(value)

    found: Document = map_parts(document, change)
    return survey.update(found)


def _may_join(survey: Survey) -> bool:
    return any(map(HINT.search, survey.values)) and any(map(QUOTE.search, survey.values))


def joined_texts(part: object) -> Iterator[Text]:
    """Yield the expressions of a part whose value may be a string, or may depend on one."""
    match part:
        case DocTransition(guard=Text() as guard):
            yield guard
        case Assign(value=value) | DocArgument(value=value):
            yield value
        case If(branches):
            yield from (b.condition for b in branches if b.condition is not None)
        case DocSend(content_expr=content, target_expr=target):
            yield from (text for text in (content, target) if text is not None)
        case _:
            pass


def _decided(node: Node, sets: Sets, *, grows: bool) -> str | None:
    """Return a choice among the results of a join for the values of its variables, or None.

    ``grows``: it is assigned, so that another pass joins strings of variables (see `KnownStrings`).
    """
    if not isinstance(node, BinaryNode) or node.op != "+":
        return None
    variables = sorted(names(node) - set(FUNCTIONS))
    held = [sets.get(name) for name in variables]
    if not variables or any(each is None or len(set(map(type, each))) != 1 for each in held):
        return None
    listed = [sorted(each or ()) for each in held]
    if grows and all(isinstance(each[0], str) for each in listed) and _is_plain(node):
        return None
    count = 1
    for values in listed:
        count *= len(values)
    if count > MOST_STRINGS:
        return None
    try:
        return _chosen(node, variables, listed, {})
    except Unknown:
        return None


def _is_plain(node: Node) -> bool:
    return not any(isinstance(n, CallNode | ElementNode | MemberNode) for n in nodes(node))


def _chosen(
    node: Node, variables: Sequence[str], sets: Sequence[Sequence[Value]], held: Mapping[str, Value]
) -> str:
    """Return the string for each value of the variables, one variable after the other."""
    if not variables:
        value = evaluate(node, held)
        if not isinstance(value, str):
            raise Unknown
        return json.dumps(value, ensure_ascii=False)
    name = variables[0]
    pairs = [(v, _chosen(node, variables[1:], sets[1:], {**held, name: v})) for v in sets[0]]
    runs = [
        ([value for value, _ in group], text)
        for text, group in groupby(pairs, key=lambda pair: pair[1])
    ]
    return _among(name, runs)


def _among(name: str, runs: Sequence[tuple[Sequence[Value], str]]) -> str:
    """Return a choice among the results for values in order, which halves them at each test."""
    if len(runs) == 1:
        return runs[0][1]
    half = len(runs) // 2
    low, high = _among(name, runs[:half]), _among(name, runs[half:])
    match runs[half][0][0]:
        case bool():
            return f"({name} ? {high} : {low})"
        case str():
            tests = " || ".join(
                f"{name} == {json.dumps(value, ensure_ascii=False)}"
                for values, _ in runs[:half]
                for value in values
            )
            return f"(({tests}) ? {low} : {high})"
        case number:
            return f"({name} < {number} ? {low} : {high})"
