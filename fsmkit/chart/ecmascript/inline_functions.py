"""Inline functions of ECMAScript at their calls, before anything is typed.

A function that only computes becomes an expression of its arguments, typed separately per call. A
function with effects becomes a block where it is called as a statement. Its parameters and
variables become data, one set per call. Recursion, closures, ``this`` and ``arguments`` are not
supported: such a call stays, and calls an undeclared operation.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

from fsmkit.chart.ecmascript.rewrite import mentions, nodes, parsed, rewrite_node
from fsmkit.diagnostics import Text
from fsmkit.document.document import DocData, DocFunction, Document
from fsmkit.document.walk import map_parts, parts
from fsmkit.language.statements import tree as stmt
from fsmkit.language.syntax import CallNode, NameNode, Node

DEEPEST = 8
"""Functions that call functions."""
LONGEST = 2000
"""Characters of an expression that a function may become."""
UNKNOWN = ("this", "arguments")


def inline_functions(document: Document) -> Document:
    """Return a document of a loose dialect without functions of scripts."""
    own = {f.name.value: f for f in document.functions if _is_untyped(f)}
    if document.datamodel == "fsmkit" or not own:
        return document
    kept = tuple(f for f in document.functions if f.name.value not in own)
    document = replace(document, functions=kept)
    taken = {part.name.value for part in parts(document) if isinstance(part, DocData)}
    inliner = _Inliner(own, taken)
    for _ in range(DEEPEST):
        changed: Document = map_parts(document, inliner.changed)
        if changed == document:
            break
        document = changed
    return document


def _is_untyped(function: DocFunction) -> bool:
    return function.result is None and all(p.type is None for p in function.parameters)


@dataclass
class _Inliner:
    functions: Mapping[str, DocFunction]
    taken: set[str]
    calls: int = 0
    names: dict[str, str] = field(default_factory=dict)

    def changed(self, part: object) -> object:
        """Return the replacement of a part of the document, or None to visit its parts."""
        match part:
            case stmt.CallOperation(call):
                return self._statement(part, parsed(call))
            case Text():
                node = parsed(part)
                if node is None or not any(name in part.value for name in self.functions):
                    return part
                value = rewrite_node(node, part.value, lambda node: self._call(node, part))
                return part if value == part.value else part.with_value(value)
            case _:
                return None

    # --- what only computes -------------------------------------------------------------------

    def _call(self, node: Node, text: Text) -> str | None:
        found = self._called(node)
        if found is None:
            return None
        function, arguments = found
        held = {}
        for parameter, argument in zip(function.parameters, arguments, strict=True):
            if any(
                isinstance(part, CallNode) and not self._called(part) for part in nodes(argument)
            ):
                return None  # it may be called more than once, or never
            written = rewrite_node(argument, text.value, lambda n: self._call(n, text))
            held[parameter.name.value] = f"({written})"
        value = _expression(function.body, held)
        return None if value is None or len(value) > LONGEST else f"({value})"

    def _called(self, node: Node | None) -> tuple[DocFunction, tuple[Node, ...]] | None:
        match node:
            case CallNode(callee=NameNode(name=name), arguments=arguments) if (
                name in self.functions and name not in self.taken
            ):
                function = self.functions[name]
                is_full = len(arguments) == len(function.parameters)
                return (function, arguments) if is_full else None
            case _:
                return None

    # --- what has effects ---------------------------------------------------------------------

    def _statement(self, statement: stmt.CallOperation[Text], node: Node | None) -> object:
        found = self._called(node)
        if found is None:
            return None
        function, arguments = found
        if _expression(function.body, {p.name.value: p.name.value for p in function.parameters}):
            return ()  # its result is not used
        *body, last = function.body or (None,)
        if isinstance(last, stmt.Return):
            last = None
        block = tuple(s for s in (*body, last) if s is not None)
        if any(isinstance(s, stmt.Return) for s in stmt.statements(block)) or _is_closed(block):
            return None
        self.calls += 1
        own = [p.name.value for p in function.parameters]
        own += [s.place.value.strip() for s in stmt.statements(block) if isinstance(s, stmt.Local)]
        renamed = {name: self._fresh(f"{function.name.value}_{name}") for name in own}
        given = tuple(
            stmt.Local(
                p.name.with_value(renamed[p.name.value]),
                statement.call.part(a.start, a.end),
                statement.span,
            )
            for p, a in zip(function.parameters, arguments, strict=True)
        )  # fmt: skip
        return (*given, *_renamed(block, renamed))

    def _fresh(self, name: str) -> str:
        found = f"{name}_{self.calls}"
        while found in self.taken:
            found += "_"
        self.taken.add(found)
        return found


def _expression(block: stmt.Block, held: Mapping[str, str]) -> str | None:
    """Return the result of a body as an expression, or None if the body has effects."""
    held = dict(held)
    for place, statement in enumerate(block):
        rest = block[place + 1 :]
        match statement:
            case stmt.Return(value):
                return _replaced(value, held)
            case stmt.Local(name, Text() as value) | stmt.Assign(name, value, operator="") if (
                isinstance(statement, stmt.Local) or name.value.strip() in held
            ):
                made = _replaced(value, held)
                if made is None or len(made) > LONGEST:
                    return None
                held[name.value.strip()] = f"({made})"
            case stmt.If(branches):
                return _chosen(branches, rest, held)
            case _:
                return None
    return None


def _chosen(branches: tuple[object, ...], rest: stmt.Block, held: Mapping[str, str]) -> str | None:
    """Return a conditional expression: the value of each branch followed by ``rest``."""
    text = ""
    for branch in branches:
        condition, body = branch.condition, branch.body  # type: ignore[attr-defined]
        value = _expression((*body, *rest), held)
        if value is None or len(text) > LONGEST:
            return None
        if condition is None:
            return f"{text}({value})"
        asked = _replaced(condition, held)
        if asked is None:
            return None
        text += f"({asked}) ? ({value}) : "
    value = _expression(rest, held)
    return None if value is None else f"{text}({value})"


def _replaced(text: Text, held: Mapping[str, str]) -> str | None:
    node = parsed(text)
    if node is None or any(mentions(word, text.value) for word in UNKNOWN):
        return None
    return rewrite_node(
        node, text.value, lambda n: held.get(n.name) if isinstance(n, NameNode) else None
    )


def _is_closed(block: stmt.Block) -> bool:
    """Whether a body uses a word of `UNKNOWN`, which only has a meaning within a call."""
    texts = (part for part in parts(block) if isinstance(part, Text))
    return any(mentions(word, text.value) for text in texts for word in UNKNOWN)


def _renamed(block: stmt.Block, names: Mapping[str, str]) -> tuple[stmt.WrittenStatement, ...]:
    def renamed(text: Text) -> Text:
        value = _replaced(text, names)
        return text if value is None or value == text.value else text.with_value(value)

    def change(part: object) -> object:
        match part:
            case stmt.Local(place, value):
                changed = None if value is None else renamed(value)
                return replace(part, place=renamed(place), value=changed)
            case Text():
                return renamed(part)
            case _:
                return None

    found: tuple[stmt.WrittenStatement, ...] = map_parts(block, change)
    return found
