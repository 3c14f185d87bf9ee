"""Statements about events, `raise`, `send` and `cancel`, and what reading any statement needs."""

# mypy: disable-error-code="func-returns-value"
# (`return self.report(...)` reports and gives up)

from __future__ import annotations

from dataclasses import dataclass, field

from fsmkit.diagnostics import Findings, Span, Text
from fsmkit.document.document import Block, DocArgument, DocCancel, DocRaise, DocSend, DocUnreadable
from fsmkit.document.statement_tokens import Cursor, Lexeme
from fsmkit.document.statement_words import CLAUSES, LITERAL_DELAY, NAME, NEW_LINES, unquoted

MOST_FINDINGS = 50
"""Findings that one text of statements can give rise to."""


@dataclass(slots=True)
class EventReader:
    """Reads statements about events at a cursor."""

    text: Text
    at: Cursor
    findings: Findings
    reported: int = field(default=0, init=False)

    def report(
        self, message: str, start: int, end: int, advice: str | None, rule: str = "statement-syntax"
    ) -> None:
        """Add a finding at a place of the text; of very many, only the first are told."""
        self.reported += 1
        if self.reported <= MOST_FINDINGS:
            self.findings.add(rule, message, self.text.span_of(start, end), help=advice)

    def _place(self, token: Lexeme) -> tuple[int, int]:
        return token.start, max(token.end, token.start + 1)

    def span(self, start: int) -> Span:
        """Return the place from an offset to the token passed last."""
        return self.text.span_of(start, max(start, self.at.previous_end))

    def unreadable(self, start: int, message: str, advice: str | None, rule: str = "") -> Block:
        """Report a statement that cannot be read, and pass over it."""
        token = self.at.here
        end = max(self.at.previous_end, start + 1)
        self.report(message, start, end, advice, rule or "statement-syntax")
        if token.kind != "end":
            self.at.skip_statement()
        return (DocUnreadable(message, self.span(start)),)

    def _value(self, what: str, *stops: str) -> Text | None:
        """Read an expression, reporting where there is none."""
        start, end = self.at.expression(*stops)
        if end > start:
            return self.part(start, end)
        self.report(f"{what} is missing", start, max(end, start + 1), "write it here")
        return None

    def part(self, start: int, end: int) -> Text:
        """Return a piece of the text with its place, on one line: new lines mean nothing in it."""
        part = self.text.part(start, end)
        if "\n" not in part.value:
            return part
        value, offsets, last = [], [], 0
        places = part.offsets or range(part.span.start, part.span.start + len(part.value))
        for gap in NEW_LINES.finditer(part.value):
            if gap[1] is not None:
                continue  # a string, which has no new line in it
            value += [part.value[last : gap.start()], " "]
            offsets += [*places[last : gap.start()], places[gap.start()]]
            last = gap.end()
        value.append(part.value[last:])
        offsets += places[last:]
        return Text("".join(value), part.span, tuple(offsets))

    def _nameless(self, start: int) -> Block:
        """Pass over a statement whose name is missing, which has been reported."""
        self.at.skip_statement()
        return (DocUnreadable("a name is missing", self.span(start)),)

    # --- events -----------------------------------------------------------------------------

    def _name(self, what: str) -> Text | None:
        """Read a name that may hold ``.`` and ``-``, or stand in quotes; report where none is."""
        token = self.at.here
        if token.kind == "string":
            return unquoted(self.text, self.at.take())
        match = None if token.kind == "newline" else NAME.match(self.text.value, token.start)
        if match is None:
            self.report(f"{what} is missing", *self._place(token), f"write {what}, or quote it")
            return None
        self.at.go_to(match.end())
        return self.text.part(match.start(), match.end())

    def _bracketed(self) -> Text | None:
        """Read an expression in parentheses if it stands here; return what is in them."""
        if self.at.here.text != "(" or self.at.here.kind != "sign":
            return None
        closing = self.at.closing()
        if closing is None:
            return None
        inner = self.part(self.at.here.end, self.at.tokens[closing].start).stripped()
        self.at.index = closing + 1
        return inner

    def _arguments(self) -> tuple[DocArgument, ...]:
        """Read ``(name = value, ...)`` if it stands here."""
        if self.at.here.text != "(":
            return ()
        opening = self.at.take()
        found: list[DocArgument] = []
        self.at.skip_newlines()
        while not self.at.accept(")"):
            before = self.at.index
            argument = self._argument()
            if argument is not None:
                found.append(argument)
            self.at.skip_newlines()
            if self.at.accept(","):
                self.at.skip_newlines()
            elif self.at.here.text != ")":
                message = "the arguments are not closed"
                self.report(message, opening.start, opening.end, "close them with `)`")
                self.at.skip_statement()
                return tuple(found)
            elif self.at.index == before:
                self.at.take()
        return tuple(found)

    def _argument(self) -> DocArgument | None:
        token = self.at.here
        if token.kind == "string":
            name = unquoted(self.text, self.at.take())
        else:
            start, end = self.at.expression("=", ",")
            name = self.text.part(start, end)
        if not self.at.accept("="):
            self.report(
                "an argument has no name",
                *self._place(token),
                "write `name = value`, the name as the event declares it",
            )
            self.at.expression(",")
            return None
        self.at.skip_newlines()
        value = self._value(f"the value of `{name.value}`", ",")
        return None if value is None else DocArgument(name, value)

    def _raise(self) -> Block:
        start = self.at.take().start
        event = self._name("the name of an event")
        if event is None:
            return self._nameless(start)
        arguments = self._arguments()
        return (DocRaise(event, arguments, self.span(start)),)

    def _send(self) -> Block:
        start = self.at.take().start
        event_expr = self._bracketed()
        event = None
        if event_expr is None and self.at.here.text not in CLAUSES:
            event = self._name("the name of an event")
            if event is None:
                return self._nameless(start)
        parts: dict[str, Text | tuple[Text, ...] | None] = {}
        arguments = self._arguments()
        while self.at.here.kind == "word" and self.at.here.text in CLAUSES:
            clause = self.at.take()
            bare, computed = CLAUSES[clause.text]
            key, value = self._clause(clause.text, bare, computed)
            if key in parts:
                self.report(f"a second `{clause.text}`", *self._place(clause), "remove one")
            parts[key] = value
        return (self._sent(start, event, event_expr, arguments, parts),)

    def _clause(
        self, word: str, bare: str, computed: str
    ) -> tuple[str, Text | tuple[Text, ...] | None]:
        if word == "with":
            names = []
            while (name := self._value("a variable", ",", *CLAUSES)) is not None:
                names.append(name)
                if not self.at.accept(","):
                    break
            return bare, tuple(names)
        if word != "after":
            inner = self._bracketed()
            return (computed, inner) if inner is not None else (bare, self._name("a name"))
        if self.at.here.kind == "string":
            return bare, unquoted(self.text, self.at.take())
        closing = self.at.closing() if self.at.here.text == "(" else None
        value = self._value("a delay", *CLAUSES)
        if value is None or LITERAL_DELAY.fullmatch(value.value):
            return bare, value
        if closing is not None and self.at.tokens[closing].end == self.at.previous_end:
            return computed, value.part(1, len(value.value) - 1).stripped()
        return computed, value

    def _sent(
        self,
        start: int,
        event: Text | None,
        event_expr: Text | None,
        arguments: tuple[DocArgument, ...],
        parts: dict[str, Text | tuple[Text, ...] | None],
    ) -> DocSend:
        texts = {key: value for key, value in parts.items() if isinstance(value, Text)}
        names = parts.get("name_list")
        return DocSend(
            self.span(start),
            event,
            event_expr,
            target=texts.get("target"),
            target_expr=texts.get("target_expr"),
            delay=texts.get("delay"),
            delay_expr=texts.get("delay_expr"),
            id=texts.get("id"),
            id_location=texts.get("id_location"),
            type=texts.get("type"),
            type_expr=texts.get("type_expr"),
            arguments=arguments,
            name_list=names if isinstance(names, tuple) else (),
            content=texts.get("content"),
            content_expr=texts.get("content_expr"),
        )

    def _cancel(self) -> Block:
        start = self.at.take().start
        inner = self._bracketed()
        name = None if inner is not None else self._name("the id of a delayed send")
        if inner is None and name is None:
            return self._nameless(start)
        return (DocCancel(name, inner, self.span(start)),)
