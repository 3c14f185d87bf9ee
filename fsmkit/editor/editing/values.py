"""Values of operations as parts of a Document.

The reader of YAML charts reads each value in a small chart, so that an operation accepts exactly
what a chart accepts.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from fsmkit.diagnostics import Findings, FsmkitError, Source, Text, fail
from fsmkit.document import document as doc
from fsmkit.document.keys import Form, Key
from fsmkit.yaml.layout import Tree, render
from fsmkit.yaml.nodes import read_nodes
from fsmkit.yaml.reader import document_of
from fsmkit.yaml.transition_writer import KEYS

VALUE = "the new value"
"""The name of the source that a value of an operation is read from."""
LISTS = (Form.NAMES, Form.TARGETS, Form.MARKS, Form.HANDLERS, Form.IDS)
PAIRS = (Form.ARGUMENTS, Form.DATA)


def new_text(value: str) -> Text:
    """Return a text that is in no file."""
    source = Source(VALUE, value)
    return Text(value, source_span(source))


def source_span(source: Source) -> Any:
    """Return the location of a whole source."""
    from fsmkit.diagnostics import Span

    return Span(source, 0, len(source.text))


def read_chart(document: doc.Document, parts: dict[str, Tree]) -> doc.Document:
    """Return a small chart with these keys, read with the data model of a document.

    Raises:
        FsmkitError: With the findings of the reader.

    """
    tree: dict[str, Tree] = {"chart": "Value", "datamodel": document.datamodel, **parts}
    source = Source(VALUE, render(tree))
    findings = Findings()
    root = read_nodes(source, findings)
    found = None if root is None else document_of(root, findings)
    if found is None:
        raise FsmkitError(findings)
    return found


def read_state(document: doc.Document, parts: dict[str, Tree]) -> doc.DocState:
    """Return a state with these keys."""
    return read_chart(document, {"states": {"state": parts}}).root.children[0]


def read_transition(
    document: doc.Document, trigger: doc.Trigger, label: str, parts: dict[str, Tree]
) -> doc.DocTransition:
    """Return a transition with a trigger, its events or delay, and these keys."""
    if trigger not in KEYS:
        raise rejected(
            "a transition of a state has no such trigger",
            help="use an event, `after`, `every`, `always` or `sometimes`",
        )
    key = KEYS[trigger]
    value: Tree = label if key in ("after", "every") else "true"
    if key == "on":
        value = list(label.replace(",", " ").split())
        if not value:
            raise rejected("an event is missing", help="name the event of the transition")
    if key in ("after", "every") and not label.strip():
        raise rejected("a delay is missing", help="write a duration, such as `5s`")
    state = read_state(document, {"transitions": [{key: value, **parts}]})
    return state.transitions[0]


def value_tree(row: Key, value: Iterable[str]) -> Tree:
    """Return the value of a key as it is written in YAML."""
    items = tuple(value)
    if row.form in LISTS:
        return list(items)
    if row.form in PAIRS:
        pairs = (item.partition(":") for item in items)
        return {name.strip(): text.strip() for name, _, text in pairs}
    return items[0]


def rejected(message: str, *, help: str, at: Any = None) -> FsmkitError:  # noqa: A002
    """Return the error of an operation that cannot be applied."""
    return fail("edit-rejected", message, at, help=help)
