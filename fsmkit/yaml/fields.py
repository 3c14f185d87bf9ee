"""The keys of one mapping, read by their forms: texts, flags, names, statements."""

from __future__ import annotations

import re
from collections.abc import Callable
from collections.abc import Mapping as Table
from typing import Any, TypeVar

from fsmkit.diagnostics import Findings, Fix, Span, Text
from fsmkit.diagnostics.fixes import replace_text
from fsmkit.diagnostics.suggestions import nearest_name
from fsmkit.document.document import DocData
from fsmkit.document.keys import BELONGS, Form, Key, Keys
from fsmkit.language.statements.reading import read_statements, read_typed
from fsmkit.language.statements.tree import Block, DocArgument
from fsmkit.yaml import nodes

Choice = TypeVar("Choice")
WORD = re.compile(r"[^\s,]+")


class Fields:
    """A mapping with known keys; absent and wrong values read as absent."""

    def __init__(self, mapping: nodes.Mapping, known: Keys, what: str, findings: Findings):
        """Report unknown keys."""
        nodes.check_keys(mapping, known, what, findings, BELONGS)
        self.known = known
        self.span: Span = mapping.span
        self.order = tuple(key.value for key, _ in mapping.entries)
        self.keys = {key.value: key for key, _ in mapping.entries}
        self._nodes = {key.value: node for key, node in mapping.entries}
        self._findings = findings

    def __contains__(self, key: str) -> bool:
        return key in self._nodes

    def read(self) -> dict[str, Any]:
        """Return the values of the given keys by field, except keys with a codec."""
        rows = (self.known[name] for name in self.order if name in self.known)
        return {row.field: READ[row.form](self, row) for row in rows if row.form in READ}

    def node(self, key: str) -> nodes.Node | None:
        """Return the node under a key."""
        return self._nodes.get(key)

    def text(self, key: str) -> Text | None:
        """Return the text under a key."""
        node = self.node(key)
        return None if node is None else nodes.require_text(node, f"`{key}`", self._findings)

    def name(self, key: str) -> Text | None:
        """Return the name under a key."""
        text = self.text(key)
        if text is not None and not text.value:
            self._findings.add(
                "unexpected-shape", f"`{key}` is a name, and not empty", text, help="remove it"
            )
        return text

    def prose(self, key: str) -> str:
        """Return the description under a key."""
        text = self.text(key)
        return "" if text is None else text.value

    def flag(self, key: str) -> bool:
        """Return the flag under a key; absent is false."""
        return self.one_of(key, {"false": False, "true": True})

    def one_of(self, key: str, choices: Table[str, Choice]) -> Choice:
        """Return the value of the word under a key; the first choice if it is absent."""
        default = next(iter(choices.values()))
        text = self.text(key)
        if text is None:
            return default
        if text.value not in choices:
            *some, last = choices
            self._findings.add(
                "unexpected-value",
                f"`{key}` cannot be `{text.value}`",
                text,
                help=f"write {', '.join(some)} or {last}",
                fixes=_choices(text, choices),
            )
        return choices.get(text.value, default)

    def marks(self, key: str, choices: Table[str, object]) -> frozenset[str]:
        """Return the words under a key; an unknown one is a finding."""
        found = self.names(key)
        for name in found:
            if name.value not in choices:
                self._findings.add(
                    "unexpected-value",
                    f"`{key}` of a state cannot name `{name}`",
                    name,
                    help=f"name {', '.join(choices)}; a transition has its own `{key}`",
                    fixes=_choices(name, choices),
                )
        return frozenset(name.value for name in found)

    def entries(self, key: str) -> tuple[tuple[Text, nodes.Node], ...]:
        """Return the entries of the mapping under a key."""
        entries = nodes.entries_of(self.node(key), f"`{key}`", self._findings)
        return tuple((name.strip(), value) for name, value in entries)

    def text_entries(self, key: str) -> tuple[tuple[Text, Text], ...]:
        """Return the entries of the mapping under a key, whose values are texts."""
        pairs = (
            (name, nodes.require_text(node, f"`{name.value}`", self._findings))
            for name, node in self.entries(key)
        )
        return tuple((name, text) for name, text in pairs if text is not None)

    def texts(self, key: str) -> tuple[Text, ...]:
        """Return the texts of the list under a key."""
        node, what = self.node(key), f"`{key}`"
        return tuple(nodes.texts_of(node, what, f"an entry of {what}", self._findings))

    def names(self, key: str) -> tuple[Text, ...]:
        """Return the names under a key: a list, or one text of words."""
        return names(self.node(key), f"`{key}`", self._findings)

    def ids(self, key: str) -> tuple[Text, ...]:
        """Return the ids under a key; an empty one is a finding."""
        found = self.names(key)
        for text in (one for one in found if not one.value):
            self._findings.add(
                "unexpected-shape", f"`{key}` has an empty id", text, help="remove it"
            )
        return tuple(one for one in found if one.value)

    def arguments(self, key: str) -> tuple[DocArgument, ...]:
        """Return the ``name: expression`` pairs under a key."""
        return tuple(DocArgument(name, text) for name, text in self.text_entries(key))

    def data(self, key: str) -> tuple[DocData, ...]:
        """Return the variables declared under a key."""
        pairs = self.text_entries(key)
        return tuple(DocData(name, *read_typed(text, self._findings)) for name, text in pairs)

    def blocks(self, key: str) -> tuple[Block, ...]:
        """Return the handlers under a key: one text is one handler, a list has one per text."""
        match self.node(key):
            case None:
                return ()
            case nodes.Sequence(items):
                return tuple(self._statements(item, key) for item in items)
            case node:
                block = self._statements(node, key)
                return (block,) if block else ()

    def block(self, key: str) -> Block | None:
        """Return the statements under a key; a list of texts is also one block."""
        if key not in self:
            return None
        return tuple(statement for block in self.blocks(key) for statement in block)

    def _statements(self, node: nodes.Node, key: str) -> Block:
        text = nodes.require_text(node, f"`{key}`", self._findings)
        return () if text is None else read_statements(text, self._findings)


def _choices(text: Text, choices: Table[str, object]) -> tuple[Fix, ...]:
    """Return the fixes that replace a word by one of a few choices, the nearest first."""
    near = nearest_name(text.value, choices)
    if near is None and set(choices) == {"true", "false"}:
        near = "true" if text.value.lower() in ("yes", "on", "1", "y") else "false"
    ordered = sorted(choices, key=lambda word: word != near)
    return tuple(fix for word in ordered for fix in replace_text(text, word))


READ: Table[Form, Callable[[Fields, Key], object]] = {
    Form.TEXT: lambda fields, key: fields.text(key.name),
    Form.NAME: lambda fields, key: fields.name(key.name),
    Form.PROSE: lambda fields, key: fields.prose(key.name),
    Form.FLAG: lambda fields, key: fields.flag(key.name),
    Form.CHOICE: lambda fields, key: fields.one_of(key.name, key.choices),
    Form.MARKS: lambda fields, key: fields.marks(key.name, key.choices),
    Form.NAMES: lambda fields, key: fields.names(key.name),
    Form.TARGETS: lambda fields, key: fields.names(key.name),
    Form.IDS: lambda fields, key: fields.ids(key.name),
    Form.STATEMENTS: lambda fields, key: fields.block(key.name),
    Form.HANDLERS: lambda fields, key: fields.blocks(key.name),
    Form.ARGUMENTS: lambda fields, key: fields.arguments(key.name),
    Form.DATA: lambda fields, key: fields.data(key.name),
}
"""The readers of the forms; `OWN` has none here."""


def names(node: nodes.Node | None, what: str, findings: Findings) -> tuple[Text, ...]:
    """Return the names in a node: the items of a list, or the words of a text."""
    match node:
        case None:
            return ()
        case nodes.Sequence(items):
            texts = (nodes.require_text(item, what, findings) for item in items)
            return tuple(text.strip() for text in texts if text is not None)
        case nodes.Scalar(text):
            return words(text)
        case _:
            nodes.require_text(node, what, findings)
            return ()


def words(text: Text) -> tuple[Text, ...]:
    """Split a text at white space and commas; each word keeps its location."""
    return tuple(text.part(*match.span()) for match in WORD.finditer(text.value))
