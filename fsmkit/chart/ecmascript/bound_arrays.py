"""Give an array that grows a capacity and a length, before anything is typed.

``x = [].concat(x, [e])``, ``x.push(e)`` and ``x[x.length] = e`` store an element behind the others
and count it. Beyond the capacity the index is out of range: ``error.execution``. Elements and
iterations end at the length. An array with any other use stays unchanged.

An array whose type has no length, ``int32[]``, grows by ``x[i] = e`` where ``i`` is its length.
``x.length = 0`` empties it. It may be assigned, sent and received whole. Then its length goes with
it, as a field ``name_length`` beside ``name``.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field, replace
from functools import cached_property

from fsmkit.chart.ecmascript.rewrite import (
    Unsuited,
    names,
    nodes,
    parsed,
    rewrite_node,
    rewrite_text,
)
from fsmkit.diagnostics import Findings, Text
from fsmkit.document.document import DocData, Document
from fsmkit.document.invocation_context import InvocationContext
from fsmkit.document.survey import Survey
from fsmkit.document.walk import map_parts, structure
from fsmkit.language import syntax
from fsmkit.language.constants import is_list, split_list
from fsmkit.language.statements import tree as stmt

LEAST_CAPACITY = 16
"""The least capacity of a growing array without a declared length; at least twice its start."""
LENGTH = re.compile(r"\[\s*(\d+)\s*\]\s*\Z")
OPEN = re.compile(r"\[\s*\]\s*\Z")
GROWTH = re.compile(r"\.(?:concat|push)\s*\(|\.length\s*\]")


def bound_arrays(survey: Survey, given: InvocationContext | None, findings: Findings) -> Survey:
    """Return a document of a loose dialect in which no array grows.

    Data that an invoker gives keep the lengths that they have there.
    """
    document = survey.document
    if document.datamodel == "fsmkit":
        return survey
    declared = survey.data
    opens = frozenset(data.name.value for data in declared if _is_open(data))
    if not opens and not any(map(GROWTH.search, survey.values)):
        return survey
    others = {data.name.value for data in (*document.inputs, *document.outputs)}
    others |= set() if given is None else {name for name, _ in given.data}
    for data in declared:
        array = _array(data, document, opens)
        if array is None:
            continue
        try:
            if array.name in others:
                raise Unsuited
            changed = array.lowered(document)
        except Unsuited:
            document = document if not array.is_open else _without_type(document, data)
            continue
        if array.grows:
            document = changed
            _report_growth(array, findings)
    return survey.update(document)


def _is_open(data: DocData) -> bool:
    return data.type is not None and OPEN.search(data.type.value) is not None


def _without_type(document: Document, data: DocData) -> Document:
    """Return the document without the declared type of an array, which holds its length."""

    def untyped(part: object) -> object:
        is_it = isinstance(part, DocData) and part.name == data.name
        return replace(data, type=None) if is_it else None

    found: Document = map_parts(document, untyped)
    return found


def _report_growth(array: _Array, findings: Findings) -> None:
    if array.data.type is None or array.is_open:
        findings.add(
            "growing-array",
            f"`{array.name}` grows: it has room for {array.capacity} elements",
            array.data.name,
            help=f"declare its type, for instance `{array.element}[{4 * array.capacity}]`",
        )


def _array(data: DocData, document: Document, opens: frozenset[str]) -> _Array | None:
    """Return a variable as a growing array, or None if it is not an array or does not grow."""
    items = None if data.init is None else split_list(data.init) if is_list(data.init) else None
    if _is_open(data):
        is_known = items is not None or data.init is None
        room = max(LEAST_CAPACITY, 2 * len(items or ()))
        return _Array(data, items or (), room, document, opens, grows=True) if is_known else None
    declared = None if data.type is None else LENGTH.search(data.type.value)
    if data.type is None and items is not None:
        return _Array(data, items, max(LEAST_CAPACITY, 2 * len(items)), document, opens)
    if declared is not None and (items is not None or data.init is None):
        return _Array(data, items or (), int(declared[1]), document, opens)
    return None


@dataclass
class _Array:
    data: DocData
    items: tuple[Text, ...]
    capacity: int
    document: Document
    opens: frozenset[str]
    """All arrays whose types have no length."""
    grows: bool = False
    example: Text | None = None
    """An element that is known at compile time, to fill unused places."""
    added: list[DocData] = field(default_factory=list)

    @property
    def name(self) -> str:
        return self.data.name.value

    @property
    def is_open(self) -> bool:
        """Whether its type has no length."""
        return self.name in self.opens

    @property
    def element(self) -> str:
        """The type of an element, as written."""
        return "int32" if self.data.type is None else OPEN.sub("", self.data.type.value)

    @cached_property
    def length(self) -> str:
        """The variable that holds how many elements there are."""
        return self._fresh(f"length_{self.name}")

    def lowered(self, document: Document) -> Document:
        """Return the document with this array bounded; raise `Unsuited` if that is impossible."""
        changed: Document = map_parts(document, self._changed)
        if not self.grows:
            return document
        filled = self._filled()

        def with_filled(part: object) -> object:
            return filled if isinstance(part, DocData) and part.name == self.data.name else None

        start = self._variable(self.length, str(len(self.items)))
        kept: Document = map_parts(changed, with_filled)
        return replace(kept, data=(*kept.data, start, *self.added))

    def _filled(self) -> DocData:
        """Return the declaration, its places all filled."""
        if self.is_open:
            type_ = self._text(f"{self.element}[{self.capacity}]")
            if not self.items:
                return replace(self.data, type=type_, init=None)
            whole = replace(self.data, type=type_)
        else:
            whole = self.data
        given = self.items or (() if self.example is None else (self.example,))
        if whole.type is not None and not self.items:
            return whole
        if not given or len(self.items) > self.capacity:
            raise Unsuited
        texts = [item.value for item in self.items]
        texts += [given[-1].value] * (self.capacity - len(texts))
        return replace(whole, init=self._text(f"[{', '.join(texts)}]"))

    def _text(self, value: str) -> Text:
        return self.data.name.with_value(value)

    def _variable(self, name: str, value: str) -> DocData:
        type_ = f"0..{self.capacity}"
        return DocData(self._text(name), self._text(type_), self._text(value), self.data.origin)

    def _fresh(self, name: str) -> str:
        taken = {part.name.value for part in structure(self.document) if isinstance(part, DocData)}
        while name in taken:
            name += "_"
        return name

    # --- what is said of it -----------------------------------------------------------------------

    def _changed(self, part: object) -> object:
        """Return the replacement of a part of the document, or None to visit its parts."""
        match part:
            case DocData(name=Text(value=value)) if value == self.name:
                return part
            case stmt.Assign() if self.is_open and (done := self._whole(part)) is not None:
                return done
            case stmt.DocArgument(name, value) if self.is_open and value.value.strip() == self.name:
                length = stmt.DocArgument(
                    name.with_value(f"{name}_length"), self._text(self.length)
                )
                return (part, length)
            case stmt.Assign() | stmt.CallOperation():
                return self._growth(part)
            case stmt.ForEach(array=array) if array.value.strip() == self.name:
                return self._iteration(part)
            case Text():
                return self._read(part)
            case _:
                return None

    def _whole(self, statement: stmt.Assign[Text, Text]) -> stmt.Block | None:
        """Return the statements for an open array that is emptied, assigned whole or extended."""
        place, value = parsed(statement.location), parsed(statement.value)
        length = self._text(self.length)
        if statement.operator:
            return None
        match place, value:
            case syntax.NameNode(name=name), syntax.NameNode(name=self.name) if name in self.opens:
                return (statement,)  # the pass for the other array assigns its length
            case syntax.NameNode(name=self.name), syntax.NameNode(name=other) if (
                other in self.opens
            ):
                return (
                    statement,
                    stmt.Assign(length, self._text(f"length_{other}"), statement.span),
                )
            case (
                syntax.NameNode(name=self.name),
                syntax.MemberNode(
                    base=syntax.MemberNode(base=syntax.NameNode(name="_event"), name="data"),
                    name=field,
                ),
            ):
                count = statement.value.with_value(f"_event.data.{field}_length")
                return (statement, stmt.Assign(length, count, statement.span))
            case syntax.MemberNode(
                base=syntax.NameNode(name=self.name), name="length"
            ), syntax.NumberNode(digits="0"):
                return (stmt.Assign(length, self._text("0"), statement.span),)
            case syntax.ElementNode(
                base=syntax.NameNode(name=self.name), index=index
            ), syntax.Node():
                return self._stored(statement, statement.location.part(index.start, index.end))
            case _:
                return None

    def _stored(self, statement: stmt.Assign[Text, Text], index: Text) -> stmt.Block | None:
        """Return an assignment of an element; there is one more if it is that behind the last."""
        parts_of_index = list(nodes(parsed(index)))
        if any(isinstance(part, syntax.CallNode) for part in parts_of_index):
            return None
        at = self._read(index).value
        if re.fullmatch(rf"{re.escape(self.name)}\s*\[.*", index.value.strip()):
            return None
        inside = self._text(f"{self.name}[({at}) <= {self.length} ? ({at}) : -1]")
        grown = stmt.Assign(
            self._text(self.length), self._text(f"{self.length} + 1"), statement.span
        )
        last = stmt.Branch(self._text(f"({at}) == {self.length}"), (grown,))
        stored = stmt.Assign(inside, self._read(statement.value), statement.span)
        return (stored, stmt.If((last,), statement.span))

    def _growth(
        self, statement: stmt.Assign[Text, Text] | stmt.CallOperation[Text]
    ) -> stmt.Block | None:
        """Return the statements that add elements, or None for any other statement."""
        written = statement.call if isinstance(statement, stmt.CallOperation) else statement.value
        node = parsed(written)
        added = None if node is None else self._added(statement, node)
        if added is None:
            return None
        first, items = added
        texts = [written.part(item.start, item.end) for item in items]
        if len(items) > 1 and any(self._mentions(item) for item in texts):
            raise Unsuited
        self.grows |= first != "0"
        self.example = self.example or next((t for t in texts if not names(parsed(t))), None)
        # the last one first: if the array is full, nothing has changed
        stores = [
            stmt.Assign(
                self._text(f"{self.name}[{first} + {place}]" if place else f"{self.name}[{first}]"),
                self._read(text),
                statement.span,
            )
            for place, text in enumerate(texts)
        ]
        count = stmt.Assign(
            self._text(self.length), self._text(f"{first} + {len(items)}"), statement.span
        )
        return (*reversed(stores), count)

    def _added(
        self, statement: stmt.Assign[Text, Text] | stmt.CallOperation[Text], node: syntax.Node
    ) -> tuple[str, tuple[syntax.Node, ...]] | None:
        """Return behind how many elements a statement stores which others."""
        if isinstance(statement, stmt.CallOperation):
            match node:
                case syntax.CallNode(
                    callee=syntax.MemberNode(base=syntax.NameNode(name=name), name="push")
                ):
                    return (self.length, node.arguments) if name == self.name else None
            return None
        place = parsed(statement.location)
        match place, node:
            case _ if statement.operator:
                return None
            case (
                syntax.ElementNode(
                    base=syntax.NameNode(name=name),
                    index=syntax.MemberNode(base=syntax.NameNode(name=other), name="length"),
                ),
                _,
            ) if name == other == self.name:
                return self.length, (node,)
            case syntax.NameNode(name=name), syntax.ArrayNode(items=items) if name == self.name:
                if any(self._mentions(statement.value.part(i.start, i.end)) for i in items):
                    raise Unsuited
                return "0", items
            case syntax.NameNode(name=name), syntax.CallNode(
                callee=syntax.MemberNode(name="concat")
            ) if name == self.name:
                return self.length, self._joined(node)
            case _:
                return None

    def _joined(self, call: syntax.CallNode) -> tuple[syntax.Node, ...]:
        """Return the elements that ``[].concat(x, [e], ...)`` has behind those of ``x``."""
        assert isinstance(call.callee, syntax.MemberNode)  # noqa: S101
        whole = (call.callee.base, *call.arguments)
        first = 1 if isinstance(whole[0], syntax.ArrayNode) and not whole[0].items else 0
        start, rest = whole[first : first + 1], whole[first + 1 :]
        if not start or not isinstance(start[0], syntax.NameNode) or start[0].name != self.name:
            raise Unsuited
        if not all(isinstance(each, syntax.ArrayNode) for each in rest):
            raise Unsuited
        return tuple(
            item for each in rest if isinstance(each, syntax.ArrayNode) for item in each.items
        )

    def _mentions(self, text: Text) -> bool:
        return self.name in names(parsed(text))

    def _iteration(self, loop: stmt.ForEach[Text, Text, stmt.WrittenStatement]) -> stmt.Block:
        """Return a loop over the elements that the array has at its start (SCXML 4.6)."""
        number = len(self.added)
        each, at, count = (
            self._text(self._fresh(f"{word}_{self.name}_{number}"))
            for word in ("each", "at", "count")
        )
        self.added.append(self._variable(count.value, "0"))
        known = {part.name.value for part in structure(self.document) if isinstance(part, DocData)}
        given = [(loop.item, each), *([] if loop.index is None else [(loop.index, at)])]
        self.added += [DocData(n, None, None) for n, _ in given if n.value.strip() not in known]
        body = (
            *(stmt.Assign(name, value, loop.span) for name, value in given),
            *map_parts(loop.body, self._changed),
        )
        inside = self._text(f"{at} < {count}")
        return (
            stmt.Assign(count, self._text(self.length), loop.span),
            stmt.ForEach(
                self._text(self.name),
                each,
                at,
                (stmt.If((stmt.Branch(inside, body),), loop.span),),
                loop.span,
            ),
        )

    # --- expressions ------------------------------------------------------------------------------

    def _read(self, text: Text) -> Text:
        """Return an expression in which the length is that of the elements there are."""

        def bounded(node: syntax.Node) -> str | None:
            match node:
                case syntax.NameNode(name=name) if name == self.name:
                    raise Unsuited
                case syntax.MemberNode(base=syntax.NameNode(name=name), name="length") if (
                    name == self.name
                ):
                    return self.length
                case syntax.ElementNode(base=syntax.NameNode(name=name), index=index) if (
                    name == self.name
                ):
                    at = rewrite_node(index, text.value, bounded)
                    return f"{name}[({at}) < {self.length} ? ({at}) : -1]"
                case (
                    syntax.BinaryNode(op="instanceof", left=syntax.NameNode())
                    | syntax.UnaryNode(op="typeof")
                ):
                    return text.value[node.start : node.end]
                case _:
                    return None

        return rewrite_text(text, self.name, bounded)
