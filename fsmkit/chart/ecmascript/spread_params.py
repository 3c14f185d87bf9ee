"""Send the members of an object that is the value of a ``param``, before anything is typed.

``<param name="p" expr="_event.data"/>`` sends ``p_x`` for each ``_event.data.p.x`` that is read,
and so does ``expr="o"`` of a variable that is given objects. A ``p`` that is read as a whole, that
is no object elsewhere, or of a declared event is left as it is.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import replace

from fsmkit.chart.ecmascript.rewrite import nodes, parsed, rewrite_text
from fsmkit.chart.ecmascript.spread_objects import PAYLOAD, given_objects
from fsmkit.diagnostics import Text
from fsmkit.document import walk
from fsmkit.document.document import Document
from fsmkit.document.survey import Survey
from fsmkit.document.walk import map_parts
from fsmkit.language.statements.tree import DocArgument, DocSend
from fsmkit.language.syntax import MemberNode, NameNode, Node


def spread_params(survey: Survey) -> Survey:
    """Return a document of a loose dialect in which parameters are no objects, as far as known."""
    document = survey.document
    if document.datamodel == "fsmkit" or document.events or DocSend not in survey.kinds:
        return survey
    sent: dict[str, list[str]] = {}
    for part in survey.parts:
        for argument in part.arguments if isinstance(part, DocSend) else ():
            sent.setdefault(argument.name.value, []).append(argument.value.value.strip())
    objects = {PAYLOAD, *given_objects(survey)}
    wanted = {name for name, values in sent.items() if objects.issuperset(values)}
    for name in wanted:
        members = _members(document, name)
        if members and not _taken(document, name, members, sent):
            document = _spread(document, name, members)
    return survey.update(document)


def _members(document: Document, name: str) -> list[str]:
    """Return the members of a field that are read; none if it is also read as a whole."""
    read = list(_fields(document))
    whole = sum(field == (name,) for field in read)
    members = [field[1] for field in read if len(field) > 1 and field[0] == name]
    return list(dict.fromkeys(members)) if whole == len(members) else []


def _fields(document: Document) -> Iterator[tuple[str, ...]]:
    """Yield the fields of events that are read, and members of theirs behind them."""
    for text in walk.texts(document):
        if PAYLOAD in text.value:
            yield from (field for node in nodes(parsed(text)) if (field := _field(node)))


def _field(node: Node) -> tuple[str, ...]:
    """Return the names behind ``_event.data`` in a node that is such a chain; else none."""
    match node:
        case MemberNode(
            base=MemberNode(base=MemberNode(base=NameNode(name="_event"), name="data"), name=name),
            name=member,
        ):
            return name, member
        case MemberNode(base=MemberNode(base=NameNode(name="_event"), name="data"), name=name):
            return (name,)
        case _:
            return ()


def _taken(document: Document, name: str, members: Collection[str], sent: Collection[str]) -> bool:
    """Whether there is a field of a name that one of these members would have."""
    own = {f"{name}_{member}" for member in members}
    return not own.isdisjoint(sent) or any(field[0] in own for field in _fields(document))


def _spread(document: Document, name: str, members: Collection[str]) -> Document:
    def spread_name(node: Node) -> str | None:
        field = _field(node)
        return f"{PAYLOAD}.{name}_{field[1]}" if field[:1] == (name,) and len(field) > 1 else None

    def changed(part: object) -> object:
        match part:
            case DocArgument(name=at, value=value) if at.value == name:
                return tuple(
                    replace(
                        part,
                        name=at.with_value(f"{name}_{member}"),
                        value=value.with_value(f"{value.value.strip()}.{member}"),
                    )
                    for member in members
                )
            case Text():
                return rewrite_text(part, "_event", spread_name)
            case _:
                return None

    found: Document = map_parts(document, changed)
    return found
