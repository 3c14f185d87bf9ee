"""Statements as text: what YAML holds under `do`, `entry` and `exit`, and SCXML in a `script`.

Statements are separated by ``;`` or a new line. A keyword is one only where a statement begins,
and not before an assignment sign: so a variable may be called ``log``.
"""

# mypy: disable-error-code="func-returns-value"
# (`return self.report(...)` reports and gives up)

from __future__ import annotations

import re
from dataclasses import dataclass, field
from itertools import islice

from fsmkit.diagnostics import Findings, Source, Span, Text, fail
from fsmkit.document.document import (
    Block,
    DocAssign,
    DocBranch,
    DocCall,
    DocForEach,
    DocIf,
    DocLog,
    DocReply,
    DocStatement,
    DocSuper,
    DocUnreadable,
)
from fsmkit.document.statement_events import MOST_FINDINGS, EventReader
from fsmkit.document.statement_tokens import Cursor, Lexeme, lexemes, without_comments
from fsmkit.document.statement_words import (
    ASSIGNMENT,
    CALLABLE,
    DEEPEST,
    FOREIGN,
    LONGEST,
    unquoted,
)
from fsmkit.document.statement_writing import write_statements
from fsmkit.document.walk import parts

__all__ = ["read_statements", "statements_text", "write_statements"]

SUSPECT_COMMENT = re.compile(r"[\w)\]][ \t]*//[ \t]*[\w.]+[ \t]*(?=;|\n|\Z)")


def read_statements(text: Text, findings: Findings) -> Block:
    """Read statements; what cannot be read is a finding and a `DocUnreadable`."""
    if len(text.value) > LONGEST:
        findings.add(
            "statement-syntax",
            f"the statements are longer than {LONGEST} characters",
            text.span_of(0, 1),
            help="call operations of the host instead",
        )
        return (DocUnreadable("too long", text.span),)
    for match in islice(SUSPECT_COMMENT.finditer(text.value), MOST_FINDINGS):
        at = text.value.index("//", match.start())
        findings.add(
            "comment-or-division",
            "what follows `//` is a comment",
            text.span_of(at, match.end()),
            help="write `/` to divide: the division of integers truncates",
        )
    clean = without_comments(text.value)
    reader = _Reader(Text(clean, text.span, text.offsets), Cursor(clean, lexemes(clean)), findings)
    return reader.block(0, is_inner=False)


def statements_text(block: Block) -> str:
    """Return statements as text that reads back as them.

    `FsmkitError` (``not-expressible``) where it does not: what SCXML has in attributes may hold
    what ends a statement in a text.
    """
    written = write_statements(block)
    source = Source("statements", written)
    again = read_statements(Text(written, Span(source, 0, len(written))), Findings())
    for number, statement in enumerate(block):
        if number >= len(again) or _words(again[number]) != _words(statement):
            raise fail(
                "not-expressible",
                "as text this would be read as something else",
                statement.span,
                help="mend it: it cannot be evaluated as it is",
            )
    return written


def _words(statement: DocStatement) -> list[str]:
    """Return what a statement holds, without the layout of its expressions."""
    return [
        re.sub(r"\s", "", without_comments(part.value)).rstrip(";")
        if isinstance(part, Text)
        else str(part)
        if isinstance(part, str)
        else type(part).__name__
        for part in parts(statement)
    ]


@dataclass(slots=True)
class _Reader(EventReader):
    depth: int = field(default=0, init=False)

    # --- the frame --------------------------------------------------------------------------

    def block(self, start: int, *, is_inner: bool) -> Block:
        """Read statements up to the end, or up to the ``}`` of a block that began at ``start``."""
        found: list[DocStatement] = []
        while True:
            while self.at.here.kind == "newline" or self.at.here.text == ";":
                self.at.take()
            if self.at.here.kind == "end":
                if is_inner:
                    self.report("`{` is not closed", start, start + 1, "close it with `}`")
                return tuple(found)
            if self.at.here.text == "}":
                if is_inner:
                    self.at.take()
                    return tuple(found)
                self.report("`}` closes nothing", *self._place(self.at.take()), "remove it")
                continue
            found += self.statement()
            self._expect_end()

    def _expect_end(self) -> None:
        if self.at.is_end_of_statement():
            return
        if self.at.previous_end and self.at.tokens[self.at.index - 1].text == "}":
            return  # nothing needs to stand between `}` and the next statement
        token = self.at.here
        message = f"`{token.text}` is not expected here"
        self.report(message, *self._place(token), "end the statement with `;` or a new line")
        self.at.skip_statement()

    # --- statements -------------------------------------------------------------------------

    def statement(self) -> Block:
        """Read one statement; ``var`` of a script may hold several."""
        token, after = self.at.here, self.at.ahead()
        is_word = token.kind == "word"
        if not is_word or (after.kind == "sign" and after.text in (*ASSIGNMENT, ".", "[")):
            return self._assignment()
        if token.text in ("var", "let", "const") and after.kind == "word":
            return self._declarations()
        if token.text in FOREIGN and not (after.text == "(" and token.text in CALLABLE):
            self.at.take()
            message = f"`{token.text}` is outside the language"
            return self.unreadable(token.start, message, FOREIGN[token.text], "outside-language")
        match token.text:
            case "raise":
                return self._raise()
            case "send":
                return self._send()
            case "cancel":
                return self._cancel()
            case "reply":
                start = self.at.take().start
                value = self._value("a value to reply with")
                return () if value is None else (DocReply(value, self.span(start)),)
            case "log":
                return self._log()
            case "super":
                self.at.take()
                return (DocSuper(self.span(token.start)),)
            case "unreadable" if after.kind == "string":
                self.at.take()
                reason = unquoted(self.text, self.at.take()).value
                return (DocUnreadable(reason, self.span(token.start)),)
            case "if" | "for":
                return self._nested(token)
            case _:
                return self._assignment()

    def _nested(self, token: Lexeme) -> Block:
        if self.depth >= DEEPEST:
            self.at.take()
            message = f"statements nest deeper than {DEEPEST} levels"
            return self.unreadable(token.start, message, "call an operation instead")
        self.depth += 1
        found = self._if() if token.text == "if" else self._for()
        self.depth -= 1
        return found

    def _declarations(self) -> Block:
        """Read ``var x = e`` of a script as an assignment: declared or not, data are global."""
        self.at.take()
        found: list[DocStatement] = []
        while True:
            found += self._assignment(",")
            if not self.at.accept(","):
                return tuple(found)

    def _assignment(self, *stops: str) -> Block:
        """Read an assignment, or else a call."""
        first = self.at.here.start
        if self.at.here.kind == "sign" and self.at.here.text in ("++", "--"):
            operator = self.at.take()
            target = self._value("what to count", *stops)
            return () if target is None else (self._counted(target, operator, first),)
        start, end = self.at.expression(*ASSIGNMENT, *stops)
        target = self.part(start, end)
        sign = self.at.here
        if end <= start or sign.kind != "sign" or sign.text not in ASSIGNMENT:
            return self._called(target, start, end)
        self.at.take()
        if sign.text in ("++", "--"):
            return (self._counted(target, sign, first),)
        operator_text = ASSIGNMENT[sign.text]
        if operator_text is None:
            message = f"`{sign.text}` is outside the language"
            return self.unreadable(first, message, "write the assignment out", "outside-language")
        value = self._value("a value to assign", *stops)
        if value is None:
            return ()
        return (DocAssign(target, value, self.span(first), operator_text),)

    def _counted(self, target: Text, operator: Lexeme, start: int) -> DocAssign:
        one = Text("1", self.text.span_of(operator.start, operator.end))
        return DocAssign(target, one, self.span(start), operator.text[0])

    def _called(self, call: Text, start: int, end: int) -> Block:
        if call.value.endswith(")") and "(" in call.value[1:]:
            return (DocCall(call, self.span(start)),)
        if end <= start:
            token = self.at.take()
            message = f"`{token.text}` begins no statement"
            return self.unreadable(token.start, message, "write an assignment or a call")
        message = "this is no statement"
        return self.unreadable(start, message, "assign it to something, or call an operation")

    # --- log and blocks ----------------------------------------------------------------------

    def _log(self) -> Block:
        start = self.at.take().start
        label = None
        after = self.at.ahead()
        if self.at.here.kind == "string" and (
            after.kind in ("end", "newline") or after.text in (",", ";", "}")
        ):
            label = unquoted(self.text, self.at.take())
        values = []
        if not self.at.accept(",") and (label is not None or self.at.is_end_of_statement()):
            return (DocLog(label, (), self.span(start)),)
        while (value := self._value("a value to log", ",")) is not None:
            values.append(value)
            if not self.at.accept(","):
                break
        return (DocLog(label, tuple(values), self.span(start)),)

    # --- blocks -----------------------------------------------------------------------------

    def _if(self) -> Block:
        start = self.at.take().start
        branches: list[DocBranch] = []
        condition: Text | None = self._condition()
        while True:
            body = self._body()
            if body is None:
                return self.unreadable(start, "`{` is missing", "write `if condition { ... }`")
            branches.append(DocBranch(condition, body))
            if condition is None or not self._accept_else():
                return (DocIf(tuple(branches), self.span(start)),)
            is_conditional = self.at.tokens[self.at.index - 1].text == "elif"
            is_conditional = is_conditional or self.at.accept("if")
            condition = self._condition() if is_conditional else None

    def _accept_else(self) -> bool:
        distance = 0
        while self.at.ahead(distance).kind == "newline":
            distance += 1
        if self.at.ahead(distance).text == ";":  # `if (c) x = 1; else x = 2`
            distance += 1
            while self.at.ahead(distance).kind == "newline":
                distance += 1
        token = self.at.ahead(distance)
        if token.kind != "word" or token.text not in ("else", "elif"):
            return False
        self.at.index += distance + 1
        return True

    def _condition(self) -> Text:
        """Read a condition. In parentheses, as C has it, it is what is in them."""
        if self.at.here.text == "(":
            closing = self.at.closing()
            if closing is not None and not self.at.goes_on(closing + 1):
                inner = self._bracketed()
                if inner is not None and inner.value:
                    return inner
        value = self._value("a condition", "{")
        return value or Text("true", self.text.span_of(self.at.here.start, self.at.here.end))

    def _body(self) -> Block | None:
        """Read ``{ ... }``, or one statement, as C has it after a condition in parentheses."""
        distance = 0
        while self.at.ahead(distance).kind == "newline":
            distance += 1
        if self.at.ahead(distance).text == "{":
            self.at.index += distance
            return self.block(self.at.take().start, is_inner=True)
        before = self.at.tokens[self.at.index - 1]
        if before.text not in (")", "else") or self.at.ahead(distance).text in ("}", ";", ""):
            return None
        self.at.index += distance
        return self.statement()

    def _for(self) -> Block:
        start = self.at.take().start
        if self.at.here.text == "(":
            message = "a loop without a bound is outside the language"
            advice = "iterate over an array: `for x in array { ... }`"
            return self.unreadable(start, message, advice, "outside-language")
        item = self._value("a variable", ",", "in", "{")
        index = self._value("a variable", "in", "{") if self.at.accept(",") else None
        if item is None or not self.at.accept("in"):
            return self.unreadable(start, "`in` is missing", "write `for x in array { ... }`")
        array = self._value("an array", "{")
        body = self._body() if self.at.here.text == "{" else None
        if array is None or body is None:
            return self.unreadable(start, "`{` is missing", "write `for x in array { ... }`")
        return (DocForEach(array, item, index, body, self.span(start)),)
