"""Decide methods of strings when compiling, for each string that the variables in them can hold.

``s.slice(1)`` of an ``s`` that only ever is ``'up'`` or ``'down'`` becomes ``s == "up" ? "p" :
"own"``: strings have no storage at run time. The name of the current event is such a variable, too.
Values that are unknown, or neither strings nor finite numbers, stay unchanged and are reported.
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterator, Mapping, Sequence

from fsmkit.chart.ecmascript.entered_states import EnteredStates
from fsmkit.chart.ecmascript.joined_names import (
    find_joined_names,
    matches,
    names_of_events,
    prefix,
)
from fsmkit.chart.ecmascript.joined_values import joined_texts
from fsmkit.chart.ecmascript.known_strings import MOST_PAIRS, find_strings
from fsmkit.chart.ecmascript.rewrite import names, nodes, parsed, rewrite_node
from fsmkit.chart.ecmascript.string_values import CURRENT_NAME, FUNCTIONS, Unknown, Value, evaluate
from fsmkit.diagnostics import Text
from fsmkit.document.document import Document, Trigger
from fsmkit.document.invocation_context import InvocationContext
from fsmkit.document.survey import Survey
from fsmkit.document.walk import map_parts, parts, states, texts
from fsmkit.language import syntax

LARGEST = 2**53
METHODS = (
    *("charAt", "concat", "endsWith", "includes", "indexOf", "lastIndexOf", "length", "replace"),
    *("slice", "split", "startsWith", "substr", "substring", "toLowerCase", "toUpperCase", "trim"),
)
WORDS = re.compile(
    rf"\.(?:{'|'.join(METHODS)})(?![\w$])|(?<![\w$.])(?:{'|'.join(FUNCTIONS)})\s*\(|\]"
)
"""Texts that occur in expressions that may be decided."""
JOINS = re.compile(r"_event\.name\s*\+|\+\s*_event\.name")
"""Texts that indicate that the name of the current event is part of a string."""


def decide_methods(survey: Survey, given: InvocationContext | None) -> Survey:
    """Return a document of a loose dialect in which methods of known strings are values."""
    document = survey.document
    hinting = [value for value in survey.values if WORDS.search(value) or JOINS.search(value)]
    if document.datamodel == "fsmkit" or not hinting:
        return survey
    whole = tuple(parts(document))
    if any(CURRENT_NAME in value for value in hinting):
        document = _decide_names(document, whole, given)
        whole = tuple(parts(document))
    known = find_strings(document, whole, given, {})

    def sets(name: str) -> set[str] | None:
        return None if name in known.unset else known.strings_of(name)

    return survey.update(_changed(document, lambda _: sets))


def _decide_names(
    document: Document, whole: tuple[object, ...], given: InvocationContext | None
) -> Document:
    """Decide methods of the name of the current event, if its possible names are known.

    They are known in transitions for events, and in states that only these enter.
    """
    known = find_strings(document, whole, given, {})
    names = find_joined_names(document, whole, given, known).names
    names = names or names_of_events(whole, given, known)
    names_by_text = {
        id(text): {name for name in names if matches(prefixes, name)}
        for prefixes, place in _with_event(document)
        for text in texts(place)
    }

    def of_variable(name: str) -> set[str] | None:
        return None if name in known.unset else known.strings_of(name)

    def held(text: Text) -> Sets:
        found = names_by_text.get(id(text))
        return lambda name: found if name == CURRENT_NAME else of_variable(name)

    joining = frozenset(id(text) for part in whole for text in joined_texts(part))
    return _changed(document, held, joining)


def _with_event(document: Document) -> Iterator[tuple[frozenset[str], object]]:
    """Yield each part executed with a current event, after the prefixes of its possible names."""
    entered = EnteredStates(document)
    each = list(states(document.root))
    leading = entered.descriptors(state for state in each if id(state) not in entered.at_start)
    for state in each:
        for transition in state.transitions:
            if transition.trigger is Trigger.EVENT:
                yield frozenset(prefix(event.value) for event in transition.events), transition
        if leading.get(id(state)):
            yield frozenset(map(prefix, leading[id(state)])), state.entry


Sets = Callable[[str], set[str] | None]
"""The possible values of a variable; None if unknown."""


def _changed(
    document: Document, held: Callable[[Text], Sets], joining: frozenset[int] = frozenset()
) -> Document:
    """Return the document with expressions of known strings replaced by choices of values.

    ``joining``: the identities of the expressions in which strings may also be joined.
    """

    def change(part: object) -> object:
        if not isinstance(part, Text):
            return None
        may_join = id(part) in joining and JOINS.search(part.value) is not None
        if not may_join and not WORDS.search(part.value):
            return None
        node = parsed(part)
        if node is None:
            return part
        sets = held(part)
        value = rewrite_node(node, part.value, lambda node: _decided(node, sets, may_join=may_join))
        return part if value == part.value else part.with_value(value)

    found: Document = map_parts(document, change)
    return found


def _decided(node: syntax.Node, sets: Sets, *, may_join: bool) -> str | None:
    """Return a choice of values of a node by its variables, or None to leave it unchanged."""
    inside = list(nodes(node))
    named = [n for n in inside if isinstance(n, syntax.MemberNode) and _is_current_name(n)]
    applied = [
        n for n in inside if isinstance(n, syntax.CallNode | syntax.MemberNode | syntax.ElementNode)
    ]
    is_join = may_join and isinstance(node, syntax.BinaryNode) and node.op == "+" and bool(named)
    if len(applied) == len(named) and not is_join:
        return None
    asked = names(node) - set(FUNCTIONS)
    if named and sum(isinstance(n, syntax.NameNode) and n.name == "_event" for n in inside) == len(
        named
    ):
        asked = asked - {"_event"} | {CURRENT_NAME}
    variables = sorted(asked)
    values = [sets(name) for name in variables]
    if not variables or not all(values):
        return None
    count = 1
    for each in values:
        count *= len(each or ())
    if count > MOST_PAIRS:
        return None
    try:
        return _chain(node, variables, [sorted(each or ()) for each in values], {})
    except Unknown:
        return None


def _is_current_name(node: syntax.MemberNode) -> bool:
    return (
        isinstance(node.base, syntax.NameNode) and f"{node.base.name}.{node.name}" == CURRENT_NAME
    )


def _chain(
    node: syntax.Node, variables: Sequence[str], sets: Sequence[list[str]], held: Mapping[str, str]
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
