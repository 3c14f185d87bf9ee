"""Keep the members of an object in variables of their own, before anything is typed.

``o = {a: 1, b: 'x'}`` assigns ``o_a`` and ``o_b``, which ``o.a`` and ``o['b']`` read and write. An
object that is used as a whole, or whose members are not always the same, is left as it is.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, replace

from fsmkit.diagnostics import Text
from fsmkit.document.document import DocData, Document
from fsmkit.document.invocation_context import InvocationContext
from fsmkit.document.walk import mapped, structure
from fsmkit.language.constants import split_list
from fsmkit.language.statements.tree import Assign
from fsmkit.language.syntax import ElementNode, MemberNode, NameNode, Node, StringNode
from fsmkit.scxml.ecmascript.rewrite import Unsuited, mentions, respelt

OBJECT = re.compile(r"\s*\{(.*)\}\s*", re.DOTALL)
MEMBER = re.compile(r"""(?:(\w+)|'(\w+)'|"(\w+)")\s*:\s*""")
DEEPEST = 8
"""Objects within objects."""


def spread_objects(document: Document, given: InvocationContext | None) -> Document:
    """Return a document of a loose dialect without objects whose members are known."""
    if document.datamodel == "fsmkit":
        return document
    others = {data.name.value for data in (*document.inputs, *document.outputs)}
    others |= set() if given is None else {name for name, _ in given.data}
    for _ in range(DEEPEST):
        before = document
        written = _written(document)
        for data in [part for part in structure(document) if isinstance(part, DocData)]:
            texts = written.get(data.name.value)
            if texts and data.type is None and data.name.value not in others:
                document = _spread(document, data, texts)
        if document is before:
            break
    return document


def _written(document: Document) -> dict[str, list[Text]]:
    """Return the objects that are written for each variable."""
    found: dict[str, list[Text]] = {}
    for part in structure(document):
        match part:
            case DocData(name, _, Text() as value) | Assign(name, value, operator=""):
                if OBJECT.fullmatch(value.value):
                    found.setdefault(name.value.strip(), []).append(value)
            case _:
                pass
    return found


def _spread(document: Document, data: DocData, texts: list[Text]) -> Document:
    members = _members(texts[0])
    if not members or any((_members(text) or {}).keys() != members.keys() for text in texts):
        return document
    taken = {part.name.value for part in structure(document) if isinstance(part, DocData)}
    names = {member: f"{data.name.value}_{member}" for member in members}
    if taken & set(names.values()):
        return document
    try:
        changed: Document = mapped(document, _Object(data.name.value, names).changed)
    except Unsuited:
        return document
    return changed


def _members(text: Text) -> dict[str, Text] | None:
    """Return the members of an object in the order they are written; None where it is none."""
    if not OBJECT.fullmatch(text.value):
        return None
    found: dict[str, Text] = {}
    for part in split_list(text):
        match = MEMBER.match(part.value)
        if match is None:
            return None
        name = next(group for group in match.groups() if group is not None)
        found[name] = part.part(match.end(), len(part.value))
    return found


@dataclass(frozen=True, slots=True)
class _Object:
    name: str
    members: dict[str, str]
    """The variable of each member."""

    def changed(self, part: object) -> object:
        """Return what becomes of a part of the document; None: its own parts are looked at."""
        match part:
            case DocData(name=Text(value=value)) if value == self.name:
                return self._declared(part)
            case Assign(location=Text(value=value), operator="") if value.strip() == self.name:
                return self._assigned(part)
            case Text():
                return respelt(part, self.name, self._spelt)
            case _:
                return None

    def _declared(self, data: DocData) -> tuple[DocData, ...]:
        known = {} if data.init is None else _members(data.init)
        if known is None:
            raise Unsuited
        return tuple(
            replace(data, name=data.name.instead(name), init=known.get(member))
            for member, name in self.members.items()
        )

    def _assigned(self, statement: Assign[Text, Text]) -> tuple[Assign[Text, Text], ...]:
        known = _members(statement.value)
        if known is None or any(mentions(self.name, value.value) for value in known.values()):
            raise Unsuited
        return tuple(
            Assign(
                statement.location.instead(self.members[member]),
                value,
                statement.span,
            )
            for member, value in known.items()
        )

    def _spelt(self, node: Node) -> str | None:
        """Return the variable of a member that is named."""
        match node:
            case (
                MemberNode(base=NameNode(name=name), name=member)
                | ElementNode(base=NameNode(name=name), index=StringNode(value=member))
            ) if name == self.name and member in self.members:
                return self.members[member]
            case NameNode(name=name) if name == self.name:
                raise Unsuited
            case _:
                return None
