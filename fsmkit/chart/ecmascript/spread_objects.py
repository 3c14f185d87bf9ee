"""Keep the members of an object in variables of their own, before anything is typed.

``o = {a: 1, b: 'x'}`` assigns ``o_a`` and ``o_b``, which ``o.a`` and ``o['b']`` read and write. An
object that is written ``{}`` has the members that are named elsewhere, none of them with a value;
``o = _event.data`` takes each from the event. An object that is used as a whole, or whose members
are not always the same, is left as it is. To send it as ``content`` is to send its members.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, replace

from fsmkit.chart.ecmascript.rewrite import Unsuited, mentions, nodes, parsed, rewrite_text
from fsmkit.diagnostics import Text
from fsmkit.document import walk
from fsmkit.document.document import DocData, Document
from fsmkit.document.invocation_context import InvocationContext
from fsmkit.document.survey import Survey
from fsmkit.document.walk import map_parts, structure
from fsmkit.language import syntax
from fsmkit.language.constants import split_list
from fsmkit.language.statements import tree as stmt

OBJECT = re.compile(r"\s*\{(.*)\}\s*", re.DOTALL)
EMPTY = re.compile(r"\s*(?:\{\s*\}|new\s+Object\s*(?:\(\s*\))?)\s*")
MEMBER = re.compile(r"""(?:(\w+)|'(\w+)'|"(\w+)")\s*:\s*""")
PAYLOAD = "_event.data"
DEEPEST = 8
"""Objects within objects."""


def spread_objects(survey: Survey, given: InvocationContext | None) -> Survey:
    """Return a document of a loose dialect without objects whose members are known."""
    document = survey.document
    if document.datamodel == "fsmkit":
        return survey
    others = {data.name.value for data in (*document.inputs, *document.outputs)}
    others |= set() if given is None else {name for name, _ in given.data}
    for _ in range(DEEPEST):
        written = given_objects(survey)
        if not written:
            break
        for data in survey.data:
            texts = written.get(data.name.value)
            if texts and data.type is None and data.name.value not in others:
                document = _spread(document, data, texts)
        if document is survey.document:
            break
        survey = Survey(document)
    return survey


def given_objects(survey: Survey) -> dict[str, list[Text]]:
    """Return the objects that are written for each variable."""
    found: dict[str, list[Text]] = {}
    for part in survey.parts:
        match part:
            case DocData(name, _, Text() as value) | stmt.Assign(name, value, operator=""):
                if OBJECT.fullmatch(value.value) or EMPTY.fullmatch(value.value):
                    found.setdefault(name.value.strip(), []).append(value)
            case _:
                pass
    return found


def _spread(document: Document, data: DocData, texts: list[Text]) -> Document:
    name = data.name.value
    objects = [_members(text) for text in texts]
    if None in objects:
        return document
    full = [known for known in objects if known]
    if any(known.keys() != full[0].keys() for known in full[1:]):
        return document
    members = dict.fromkeys(full[0] if full else ())
    if len(full) < len(objects):  # some are empty: assignments add members
        members |= dict.fromkeys(_assigned_members(document, name))
        if not members.keys() >= set(_named(document, name)):
            return document
    taken = {part.name.value for part in structure(document) if isinstance(part, DocData)}
    names = {member: f"{name}_{member}" for member in members}
    if taken & set(names.values()):
        return document
    unknown = frozenset(_unknown_roots(document, taken))
    try:
        changed: Document = map_parts(document, _Object(name, names, unknown).changed)
    except Unsuited:
        return document
    return changed


def _members(text: Text) -> dict[str, Text] | None:
    """Return the members of an object literal in order, or None if the text is something else."""
    if EMPTY.fullmatch(text.value):
        return {}
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


def _named(document: Document, name: str) -> list[str]:
    """Return the members of a variable that expressions name."""
    texts = {text.value: text for text in walk.texts(document)}
    found = (n for text in texts.values() if name in text.value for n in nodes(parsed(text)))
    members = (_member(node, name) for node in found)
    return [member for member in members if member is not None]


def _assigned_members(document: Document, name: str) -> list[str]:
    """Return the assigned members of a variable; if a payload is assigned, the members read."""
    given = [part for part in structure(document) if isinstance(part, stmt.Assign)]
    wholes = (p for p in given if p.location.value.strip() == name and not p.operator)
    if any(part.value.value.strip() == PAYLOAD for part in wholes):
        return _named(document, name)
    places = (parsed(part.location) for part in given if name in part.location.value)
    members = (_member(place, name) for place in places if place is not None)
    return [member for member in members if member is not None]


def _member(node: syntax.Node, name: str) -> str | None:
    """Return the member of a variable that a node is, if it is one."""
    match node:
        case (
            syntax.MemberNode(base=syntax.NameNode(name=base), name=member)
            | syntax.ElementNode(
                base=syntax.NameNode(name=base), index=syntax.StringNode(value=member)
            )
        ) if base == name and re.fullmatch(r"\w+", member):
            return member
        case _:
            return None


def _unknown_roots(document: Document, data: set[str]) -> set[str]:
    """Return the names of objects that are called and that nothing in the chart declares."""
    declared = data | {o.name.value for o in document.operations}
    declared |= {f.name.value for f in document.functions} | {"_event", "Math"}
    calls = (part.call for part in structure(document) if isinstance(part, stmt.CallOperation))
    return {root for call in calls if (root := _root(parsed(call))) is not None} - declared


def _root(node: syntax.Node | None) -> str | None:
    """Return the name of the first object in a chain of calls: ``a`` of ``a.b(1).c(2)``."""
    while isinstance(node, syntax.CallNode | syntax.MemberNode):
        node = node.callee if isinstance(node, syntax.CallNode) else node.base
    return node.name if isinstance(node, syntax.NameNode) else None


@dataclass(frozen=True, slots=True)
class _Object:
    name: str
    members: dict[str, str]
    """The variable of each member."""
    unknown: frozenset[str]
    """Undefined objects: a call on one fails before its arguments are evaluated."""

    def changed(self, part: object) -> object:
        """Return the replacement of a part of the document, or None to visit its parts."""
        match part:
            case DocData(name=Text(value=value)) if value == self.name:
                return self._declared(part)
            case stmt.Assign(location=Text(value=value), operator="") if value.strip() == self.name:
                return self._assigned(part)
            case stmt.Assign(value=value) if _root(parsed(value)) in self.unknown:
                return part
            case stmt.CallOperation(call) if _root(parsed(call)) in self.unknown:
                return part
            case stmt.DocSend(content_expr=Text(value=value)) if value.strip() == self.name:
                return self._sent(part)
            case Text():
                return rewrite_text(part, self.name, self._variable_of)
            case _:
                return None

    def _declared(self, data: DocData) -> tuple[DocData, ...]:
        known = {} if data.init is None else _members(data.init)
        if known is None:
            raise Unsuited
        return tuple(
            replace(data, name=data.name.with_value(name), init=known.get(member))
            for member, name in self.members.items()
        )

    def _assigned(self, statement: stmt.Assign[Text, Text]) -> tuple[stmt.WrittenStatement, ...]:
        if statement.value.value.strip() == PAYLOAD:
            return tuple(
                self._set(statement, member, statement.value.with_value(f"{PAYLOAD}.{member}"))
                for member in self.members
            )
        known = _members(statement.value)
        if known is None or any(mentions(self.name, value.value) for value in known.values()):
            raise Unsuited
        if known.keys() != self.members.keys():  # a member would lose its value
            raise Unsuited
        return tuple(self._set(statement, member, value) for member, value in known.items())

    def _set(
        self, statement: stmt.Assign[Text, Text], member: str, value: Text
    ) -> stmt.Assign[Text, Text]:
        return stmt.Assign(
            statement.location.with_value(self.members[member]), value, statement.span
        )

    def _sent(self, send: stmt.DocSend) -> stmt.DocSend:
        """Return a send of the object as content, which sends its members (SCXML B.2.8.1)."""
        at = send.content_expr
        if at is None or send.arguments or send.name_list:
            raise Unsuited
        pairs = self.members.items()
        sent = tuple(stmt.DocArgument(at.with_value(m), at.with_value(name)) for m, name in pairs)
        return replace(send, content_expr=None, arguments=sent)

    def _variable_of(self, node: syntax.Node) -> str | None:
        """Return the variable that replaces a member, or None for another node."""
        member = _member(node, self.name)
        if member is not None and member in self.members:
            return self.members[member]
        if isinstance(node, syntax.NameNode) and node.name == self.name:
            raise Unsuited
        return None
