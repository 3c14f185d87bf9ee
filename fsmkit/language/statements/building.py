"""The actions of the parser for statements, one for each rule of the grammar."""

# ruff: noqa: D102  (the grammar documents each rule)
# mypy: disable-error-code="func-returns-value"
# (`return piece.reader.unreadable(...)` reports and returns None)

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from typing import Any, Protocol

from lark import Transformer, v_args

from fsmkit.diagnostics import Span, Text
from fsmkit.language.statements import tree as stmt
from fsmkit.language.statements.tokens import ASSIGNMENT, CLAUSES, LITERAL_DELAY, bracketed

EMITTED = re.compile(r"(emit|post|fire|trigger|dispatch|publish)[ \t]+\w")
"""A statement that other tools use for `send`."""
ARROW = re.compile(r"->|^(?:transition|become)\b")
NAMED = re.compile(r"(?:set\s+)?(\w+)(?:\s*:\s*|\s+)(\w+)")
LOCAL_NAME = re.compile(r"[^\W\d][\w$]*(?=\s|$)")


class Reader(Protocol):
    """The source of the pieces for the parser."""

    text: Text

    def report(
        self, message: str, start: int, end: int, advice: str | None, rule: str = ...
    ) -> None:
        """Add a finding at a location of the text."""

    def span(self, start: int) -> Span:
        """Return the location from an offset to the piece that was recognized last."""


@dataclass(slots=True)
class Piece:
    """A token of the grammar: its type, its location in the text, its reader, and its value."""

    type: str
    start: int
    end: int
    reader: Reader
    known: Text | None = None

    @property
    def text(self) -> Text:
        """The value of the token, or else its source text."""
        return self.known or self.reader.text.part(self.start, self.end)

    @property
    def span(self) -> Span:
        """The location from this token to the piece that was recognized last."""
        return self.reader.span(self.start)


@v_args(inline=True)
class StatementBuilder(Transformer[Any, Any]):
    """Builds statements bottom up while the parser runs. Each rule returns a block."""

    def statements(self, *found: stmt.Block) -> stmt.Block:
        return tuple(statement for block in found for statement in block)

    braced = single = lone = statements

    def assign(self, location: Piece, sign: Piece, value: Piece) -> stmt.Block:
        operator = ASSIGNMENT[sign.text.value]
        if operator is not None:
            return (stmt.Assign(location.text, value.text, location.span, operator),)
        message = f"`{sign.text}` is outside the language"
        advice = "write the assignment out"
        location.reader.report(message, location.start, sign.end, advice, "outside-language")
        return (stmt.Fail(message, location.span),)

    def declarator(
        self, declared: Piece, sign: Piece | None = None, value: Piece | None = None
    ) -> stmt.Block:
        if sign is not None and value is not None and ASSIGNMENT[sign.text.value] != "":
            message = "a variable is declared with `=`"
            sign.reader.report(message, sign.start, sign.end, "write `=`")
            return (stmt.Fail(message, declared.span),)
        text = declared.text
        name = LOCAL_NAME.match(text.value)
        end = len(text.value) if name is None else name.end()
        type_ = text.part(end, len(text.value)).strip()
        return (
            stmt.Local(
                text.part(0, end),
                None if value is None else value.text,
                declared.span,
                type_ if type_.value else None,
            ),
        )

    def count(self, first: Piece, second: Piece) -> stmt.Block:
        sign, target = (first, second) if first.type == "COUNT" else (second, first)
        one = Text("1", sign.text.span)
        return (stmt.Assign(target.text, one, first.span, sign.text.value[0]),)

    def operation(self, call: Piece) -> stmt.Block:
        if call.text.value.endswith(")") and "(" in call.text.value[1:]:
            return (stmt.CallOperation(call.text, call.span),)
        message = "this is not a statement"
        advice = "assign it to something, or call an operation"
        written = call.text.value
        if "==" in written:
            advice = "assign with `=`: `==` compares"
        elif written.isidentifier():
            advice = f"call it: `{written}()`"
        elif (emitted := EMITTED.match(written)) is not None:
            advice = f"write `send` for `{emitted[1]}`"
        elif ARROW.search(written):
            advice = "a transition leads to a state: its `target`"
        elif (named := NAMED.fullmatch(written)) is not None:
            advice = f"write `{named[1]} = {named[2]}`"
        call.reader.report(message, call.start, call.end, advice)
        return (stmt.Fail(message, call.span, advice=advice),)

    def declare(self, word: Piece, *found: stmt.Block) -> stmt.Block:
        is_fixed = word.text.value != "var"
        return tuple(
            replace(each, is_fixed=is_fixed) if isinstance(each, stmt.Local) else each
            for each in self.statements(*found)
        )

    def raise_(
        self, word: Piece, event: Piece, arguments: tuple[stmt.DocArgument, ...] = ()
    ) -> stmt.Block:
        return (stmt.Raise(event.text, arguments, word.span),)

    def cancel(self, word: Piece, id_: Piece) -> stmt.Block:
        is_name = id_.type == "ID"
        return (
            stmt.DocCancel(id_.text if is_name else None, None if is_name else id_.text, word.span),
        )

    def valued(self, word: Piece, value: Piece) -> stmt.Block:
        return (stmt.STATEMENT_KEYWORDS[word.text.value](value.text, word.span),)

    def log(self, word: Piece, *parts: Piece) -> stmt.Block:
        label = parts[0].text if parts and parts[0].type == "LABEL" else None
        values = tuple(part.text for part in parts if part.type != "LABEL")
        return (stmt.Log(label, values, word.span),)

    def super_(self, word: Piece) -> stmt.Block:
        return (stmt.Super(word.span),)

    def unreadable(self, word: Piece, reason: Piece) -> stmt.Block:
        return (stmt.Fail(reason.text.value, word.span),)

    def broken(self, piece: Piece) -> stmt.Block:
        return (stmt.Fail(piece.text.value, piece.text.span),)

    # --- events ---------------------------------------------------------------------------------

    def arguments(self, *found: stmt.DocArgument) -> tuple[stmt.DocArgument, ...]:
        return found

    def argument(self, name: Piece, value: Piece) -> stmt.DocArgument:
        return stmt.DocArgument(name.text, value.text)

    def send(self, word: Piece, *parts: Any) -> stmt.Block:
        found: dict[str, Any] = {}
        for part in parts:
            match part:
                case Piece(type=type_, text=text):
                    found["event" if type_ == "ID" else "event_expr"] = text
                case (Piece() as clause, key, value):
                    if key in found:
                        message = f"a second `{clause.text}`"
                        word.reader.report(message, clause.start, clause.end, "remove one")
                    found[key] = value
                case _:
                    found["arguments"] = part
        return (stmt.DocSend(word.span, **found),)

    def clause(self, word: Piece, first: Piece, *rest: Piece) -> tuple[Piece, str, Any]:
        bare, computed = CLAUSES[word.text.value]
        text = first.text
        if word.type == "WITH":
            return word, bare, (text, *(piece.text for piece in rest))
        if word.type == "NAMED":
            return word, bare if first.type == "ID" else computed, text
        if first.type == "QUOTED" or LITERAL_DELAY.fullmatch(text.value):
            return word, bare, text
        inner = bracketed(text)
        return word, computed, text if inner is None else inner

    # --- blocks ---------------------------------------------------------------------------------

    def branching(self, word: Piece, condition: Piece, body: stmt.Block, *rest: Any) -> stmt.Block:
        branches = [stmt.Branch(condition.text, body)]
        for part in rest:
            if isinstance(part, stmt.Branch):
                branches.append(part)
            elif isinstance(part, tuple):
                branches.append(stmt.Branch(None, part))
        return (stmt.If(tuple(branches), word.span),)

    def else_if(
        self, _: Piece, condition: Piece, body: stmt.Block
    ) -> stmt.Branch[Text, stmt.WrittenStatement]:
        return stmt.Branch(condition.text, body)

    def loop(self, word: Piece, *parts: Any) -> stmt.Block:
        *names, body = (part for part in parts if getattr(part, "type", "") != "IN")
        item, *index, array = (piece.text for piece in names)
        return (stmt.ForEach(array, item, index[0] if index else None, body, word.span),)

    # --- declarations ---------------------------------------------------------------------------

    def signature(self, *parts: Any) -> tuple[Any, ...]:
        return parts

    typed = fields = result = initial = signature
