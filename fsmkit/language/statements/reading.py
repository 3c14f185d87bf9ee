"""Reading of statements and declarations: the text under `do` in YAML and in `script` of SCXML.

The grammar is `grammar.lark`. The reader passes one piece of text after another to its parser. The
tokens that the parser accepts next decide the type of the piece. If none fits, there is a finding,
and reading continues after the statement and its blocks.
"""

from __future__ import annotations

import re
from collections.abc import Container, Mapping
from dataclasses import dataclass, field
from functools import cache
from itertools import islice
from typing import Any

from lark.parsers.lalr_analysis import Shift

from fsmkit.diagnostics import Findings, Span, Text
from fsmkit.diagnostics.fixes import replace_text
from fsmkit.language.relocation import detach, relocate
from fsmkit.language.statements import tree as stmt
from fsmkit.language.statements.building import Piece
from fsmkit.language.statements.tokens import (
    ASSIGNMENT,
    CALLABLE,
    DEEPEST,
    FOREIGN,
    LONGEST,
    NAME,
    NEW_LINES,
    NO_ZERO,
    WITHOUT_ZERO,
    Cursor,
    Lexeme,
    lexemes,
    unquoted,
    without_comments,
)
from fsmkit.language.syntax import parser

SUSPECT_COMMENT = re.compile(r"[\w)\]][ \t]*//[ \t]*[\w.]+[ \t]*(?=;|\n|\Z)")
EVENT_NAME = re.compile(r"[^\W\d][\w-]*(\.[\w-]+)*")
FUNCTION_WORDS = frozenset({"return", "var", "let", "const", "for", "if"})
"""Words that start statements of functions."""
FIELD_NAME = re.compile(r"[^\W\d]\w*")
MOST_FINDINGS = 50
"""At most this many findings are reported for one text of statements."""

KEYWORDS = {
    **dict.fromkeys(("var", "let", "const"), "VAR"),
    **dict.fromkeys(("to", "as", "type", "content"), "NAMED"),
    **dict.fromkeys(stmt.STATEMENT_KEYWORDS, "VALUED"),
    **{word: word.upper() for word in ("raise", "send", "cancel", "log", "super")},
    **{word: word.upper() for word in ("unreadable", "if", "for", "in", "after", "with")},
}
"""Words, and their token type where the parser accepts it."""
SIGNS = {
    **dict.fromkeys(ASSIGNMENT, ("ASSIGN",)),
    "=": ("_EQUAL", "EQUALS", "ASSIGN"),
    "++": ("COUNT",),
    "--": ("COUNT",),
    ",": ("_COMMA",),
    "(": ("_LPAR",),
    ")": ("_RPAR",),
    "{": ("_OPEN",),
    "->": ("ARROW",),
}
"""Signs, and their possible token types."""


SHORT, MOST_KEPT = 200, 20_000
"""The size in characters and the number of texts that are cached."""
KEPT: dict[str, stmt.Block] = {}
"""The statements of texts without a finding, located in the text itself."""
MISSING = {"EXPRESSION": "an expression", "ID": "a name", "QUOTED": "a text"}
"""Descriptions of missing tokens."""
BLOCKS = (
    ("IN", "in", "write `for x in array { ... }`"),
    ("_OPEN", "{", "write `if condition { ... }` or `for x in array { ... }`"),
)


def read_statements(text: Text, findings: Findings) -> stmt.Block:
    """Read statements; unreadable ones give a finding and a `Fail`."""
    if len(text.value) > LONGEST:
        findings.add(
            "statement-syntax",
            f"the statements are longer than {LONGEST} characters",
            text.span_of(0, 1),
            help="call operations of the host instead",
        )
        return (stmt.Fail("too long", text.span),)
    if "/" not in text.value and "#" not in text.value:  # as in nearly all texts
        return _read_bare(text, findings)
    for match in islice(SUSPECT_COMMENT.finditer(text.value), MOST_FINDINGS):
        findings.add(
            "comment-or-division",
            "what follows `//` is a comment",
            text.span_of(_slashes(text, match)[0], match.end()),
            help="write `/` to divide: the division of integers truncates",
            fixes=replace_text(text.span_of(*_slashes(text, match)), "/"),
        )
    return _read_bare(Text(without_comments(text.value), text.span, text.offsets), findings)


def _read_bare(at: Text, findings: Findings) -> stmt.Block:
    """Read statements that contain no comments."""
    block = KEPT.get(at.value)
    if block is None:
        reader = _Reader(at, findings, "statement-syntax", NAME)
        block = reader.read("statements")
        if not reader.reported and len(at.value) <= SHORT and len(KEPT) < MOST_KEPT:
            KEPT[at.value] = block
    return relocate(block, at)


def read_body(text: Text, findings: Findings) -> stmt.Block:
    """Read the body of a function: statements, or the expression that it returns."""
    stripped = text.strip()
    if is_value(stripped.value):
        return (stmt.Return(stripped, stripped.span),)
    return read_statements(text, findings)


def is_value(text: str) -> bool:
    """Return whether a text is one expression and not a statement, judged by its tokens."""
    found = lexemes(without_comments(text))
    first, after = found[0], found[min(1, len(found) - 1)]
    if first.kind == "end" or (first.text in FUNCTION_WORDS and not _is_name(first, after)):
        return False
    signs = (ASSIGNMENT.keys() | {";", "{"}) & {t.text for t in found if t.kind == "sign"}
    return not signs and not any(token.kind == "newline" for token in found)


def read_signature(
    text: Text, findings: Findings, *, is_loose: bool = False
) -> stmt.DocSignature | None:
    """Read the declaration of an operation or an event: ``goto(position 0..4000) -> bool``.

    ``is_loose``: parameters may lack types, like those of functions in ECMAScript.
    """
    reader = _Reader(text.strip(), findings, "declaration-syntax", EVENT_NAME, has_lines=False)
    found = reader.read("signature")
    if found is None:
        return None
    name, *rest = found
    fields: list[stmt.DocField | None] = []
    result = None
    for part in rest:
        if part and part[0].type == "ARROW":
            result = _required_text(
                reader, part, "the type of the result is missing", "write such as `bool`"
            )
        else:
            fields += [_field(piece, reader, is_loose=is_loose) for piece in part]
    sound = tuple(each for each in fields if each is not None)
    if reader.reported:
        return None
    return relocate(stmt.DocSignature(name.text, sound, result), reader.place)


def _required_text(
    reader: _Reader, parts: tuple[Piece, ...], message: str, advice: str
) -> Text | None:
    """Return the text after a sign; report a missing one."""
    sign, *rest = parts
    if not rest:
        reader.report(message, sign.start, sign.end, advice)
    return rest[0].text if rest else None


def _field(piece: Piece, reader: _Reader, *, is_loose: bool) -> stmt.DocField | None:
    text = piece.text
    name = FIELD_NAME.match(text.value)
    if is_loose and name is not None and not text.value[name.end() :].strip():
        return stmt.DocField(text.part(0, name.end()), None)
    type_ = None if name is None else text.part(name.end(), len(text.value)).strip()
    if name is not None and type_ is not None and type_.value and type_.value[0] not in ":=":
        return stmt.DocField(text.part(0, name.end()), type_)
    message = "a parameter has no name"
    if name is not None:
        message = f"`{name[0]}` has no type"
        if type_ is not None and type_.value:
            message = f"`{type_.value[0]}` is not expected between name and type"
    advice = "write name and type with a space between: `speed 0..100`"
    reader.report(message, piece.start, piece.end, advice)
    return None


def read_typed(text: Text, findings: Findings) -> tuple[Text | None, Text | None]:
    """Read ``type = start value``; return both, None for a missing one."""
    reader = _Reader(text.strip(), findings, "declaration-syntax", EVENT_NAME, has_lines=False)
    type_ = init = None
    for part in reader.read("typed") or ():
        if isinstance(part, Piece):
            type_ = part.text
        else:
            advice = "write it, or remove the `=`"
            init = _required_text(reader, part, "the start value is missing", advice)
    return relocate((type_, init), reader.place)


@dataclass(slots=True)
class _Reader:
    """Passes the pieces of one text to the parser; the results have locations in the text."""

    place: Text
    findings: Findings
    rule: str
    name: re.Pattern[str]
    has_lines: bool = True
    text: Text = field(init=False)
    at: Cursor = field(init=False)
    reported: int = field(default=0, init=False)
    last: int = field(default=0, init=False)
    """The end of the piece that was recognized last."""

    def __post_init__(self) -> None:
        """Start before the first token."""
        self.text = detach(self.place.value)
        self.at = Cursor(self.text.value, lexemes(self.text.value), has_lines=self.has_lines)

    def report(
        self, message: str, start: int, end: int, advice: str | None, rule: str | None = None
    ) -> None:
        """Add a finding at a location of the text, unless there are already too many."""
        self.reported += 1
        if self.reported <= MOST_FINDINGS:
            span = self.place.span_of(start, end)
            self.findings.add(rule or self.rule, message, span, help=advice)

    def span(self, start: int) -> Span:
        """Return the location from an offset to the piece that was recognized last."""
        return self.text.span_of(start, max(start, self.last))

    def read(self, start: str) -> Any:
        """Return the parsed text; None for an unreadable declaration."""
        parsed: Any = parser().parse_interactive(start=start)
        state = parsed.parser_state
        while True:
            before = self.at.index
            piece = self._next(parsed.choices(), state)
            if piece is not None and _state_after(state, piece.type) is not None:
                found = parsed.feed_token(piece)
                self.last = piece.end
                if piece.type == "$END":
                    return found
                continue
            self.at.index = before
            if not self._recover(parsed):
                return None

    # --- pieces ---------------------------------------------------------------------------------

    def _piece(self, type_: str, start: int, end: int, text: Text | None = None) -> Piece:
        return Piece(type_, start, end, self, text)

    def _take(self, type_: str) -> Piece:
        token = self.at.take()
        text = unquoted(self.text, token) if token.kind == "string" else None
        if text is not None and "\0" in text.value:
            self.report(NO_ZERO, token.start, token.end, WITHOUT_ZERO)
        return self._piece(type_, token.start, token.end, text)

    def _next(self, choices: Mapping[str, Any], state: Any) -> Piece | None:
        """Return the current piece as one of the acceptable tokens; None if it does not fit."""
        at = self.at
        if "_RPAR" in choices or "_OPEN" in choices or not self.has_lines:
            at.skip_newlines()
        if "ELSE" in choices and (found := self._else()) is not None:
            return found
        if at.is_end_of_statement():
            return self._end(choices)
        at.skip_newlines()
        token, after = at.current, at.ahead()
        if "RAISE" in choices and self._outside_language(state) is not None:
            return None
        match token.kind:
            case "word":
                type_ = KEYWORDS.get(token.text, "")
                if type_ in choices and not ("RAISE" in choices and _is_name(token, after)):
                    return self._take(type_)
            case "string":
                is_last = after.kind in ("end", "newline") or after.text in (",", ";", "}")
                if "LABEL" in choices and is_last:
                    return self._take("LABEL")
                if "QUOTED" in choices or ("ID" in choices and self.has_lines):
                    return self._take("QUOTED" if "QUOTED" in choices else "ID")
            case "sign":
                for type_ in SIGNS.get(token.text, ()):
                    if type_ in choices:
                        return self._take(type_)
                for type_ in ("CONDITION", "BRACKETED"):
                    if type_ in choices and (found := self._bracketed(type_)) is not None:
                        return found
        if "ID" in choices and (match := self.name.match(self.text.value, token.start)) is not None:
            at.go_to(match.end())
            return self._piece("ID", match.start(), match.end())
        if "EXPRESSION" in choices:
            start, end = at.expression(*_expression_stops(state))
            if end > start:
                # a type name may contain line ends; in statements they have no meaning
                lines = self.has_lines and "\n" in self.text.value[start:end]
                text = self._on_one_line(start, end) if lines else None
                # as in C, a condition that ends with a parenthesis needs no braces after it
                is_closed = "CONDITION" in choices and self.text.value[end - 1] == ")"
                return self._piece("CONDITION" if is_closed else "EXPRESSION", start, end, text)
        return None

    def _end(self, choices: Container[str]) -> Piece | None:
        """Return the end of a line, of a statement, of a block or of the text."""
        token = self.at.current
        if token.text == "}" and "_CLOSE" in choices:
            return self._take("_CLOSE")
        if token.kind == "end" and "$END" in choices:
            return self._piece("$END", self.last, self.last)
        if "_END" not in choices or (token.text in ("}", "") and "BROKEN" in choices):
            return None
        while self.at.current.kind == "newline" or self.at.current.text == ";":
            self.at.take()
        return self._piece("_END", self.last, self.last)

    def _else(self) -> Piece | None:
        """Return ``else``, ``else if`` or ``elif``, on this line or a later one, after a ``;``."""
        before = self.at.index
        self.at.skip_newlines()
        if self.at.accept(";"):
            self.at.skip_newlines()
        token, after = self.at.current, self.at.ahead()
        if token.kind != "word" or token.text not in ("else", "elif"):
            self.at.index = before
            return None
        is_conditional = token.text == "elif" or (after.kind == "word" and after.text == "if")
        if token.text == "else" and is_conditional:
            self.at.take()
        return self._take("ELIF" if is_conditional else "ELSE")

    def _bracketed(self, type_: str) -> Piece | None:
        """Return the text in parentheses; a condition must end after it."""
        closing = self.at.closing() if self.at.current.text == "(" else None
        if closing is None:
            return None
        opening, end = self.at.current, self.at.tokens[closing]
        inner = self._on_one_line(opening.end, end.start).strip()
        if type_ == "CONDITION" and (self.at.continues_expression(closing + 1) or not inner.value):
            return None
        self.at.index = closing + 1
        return self._piece(type_, opening.start, end.end, inner)

    def _on_one_line(self, start: int, end: int) -> Text:
        """Return a piece of the text with its location; new lines in it have no meaning."""
        part = self.text.part(start, end)
        if "\n" not in part.value:
            return part
        value, offsets, last = [], [], 0
        places = part.offsets or range(part.span.start, part.span.start + len(part.value))
        for gap in NEW_LINES.finditer(part.value):
            if gap[1] is not None:
                continue  # a string, which contains no new line
            value += [part.value[last : gap.start()], " "]
            offsets += [*places[last : gap.start()], places[gap.start()]]
            last = gap.end()
        value.append(part.value[last:])
        offsets += places[last:]
        return Text("".join(value), part.span, tuple(offsets))

    # --- what is wrong --------------------------------------------------------------------------

    def _outside_language(self, state: Any) -> tuple[str, str, str] | None:
        """Return why the current statement is outside the language: message, advice, rule."""
        token, after = self.at.current, self.at.ahead()
        if token.kind != "word" or _is_name(token, after):
            return None
        if token.text in FOREIGN.keys() - stmt.STATEMENT_KEYWORDS and not (
            after.text == "(" and token.text in CALLABLE
        ):
            return (
                f"`{token.text}` is outside the language",
                FOREIGN[token.text],
                "outside-language",
            )
        if token.text not in ("if", "for"):
            return None
        if sum(getattr(v, "type", "") in ("IF", "FOR") for v in state.value_stack) >= DEEPEST:
            message = f"statements nest deeper than {DEEPEST} levels"
            return message, "call an operation instead", self.rule
        if token.text == "for" and after.text == "(":
            message = "a loop without a bound is outside the language"
            return message, "iterate over an array: `for x in array { ... }`", "outside-language"
        return None

    def _recover(self, parsed: Any) -> bool:
        """Report an unexpected token and skip the statement; return False for a declaration."""
        state, choices, token = parsed.parser_state, parsed.choices(), self.at.current
        if "BROKEN" in choices and token.text == "}":
            self._unexpected("`}` closes nothing", self.at.take(), "remove it")
            return True
        if "BROKEN" in choices and token.kind == "end":
            opening = _latest_piece(state, "_OPEN")
            self.report("`{` is not closed", opening.start, opening.end, "close it with `}`")
            parsed.feed_token(self._piece("_CLOSE", self.last, self.last))
            return True
        popped: list[Any] = []
        while state.value_stack and "BROKEN" not in parsed.choices():
            popped.append(state.value_stack.pop())
            state.state_stack.pop()
        start = popped[-1].start if popped and isinstance(popped[-1], Piece) else token.start
        if "RAISE" in choices:  # a statement starts here
            message = f"`{token.text}` does not start a statement"
            advice, rule = "write an assignment or a call", self.rule
            if (refused := self._outside_language(state)) is not None:
                message, advice, rule = refused
            self.report(message, *_place(token), advice, rule)
            self.last = self.at.take().end
        else:
            message = self._missing(choices, popped, start)
        if "BROKEN" not in parsed.choices():
            return False
        if self.at.current.kind != "end":
            self.at.skip_statement()
        self.last = self.at.previous_end
        broken = Text(message, self.span(start))
        parsed.feed_token(self._piece("BROKEN", start, self.last, broken))
        return True

    def _missing(self, choices: Container[str], popped: list[Any], start: int) -> str:
        """Report the missing part of a statement or a declaration that starts at an offset."""
        token = self.at.current
        if "_EQUAL" in choices and popped:
            advice = "write `name = value`, the name as the event declares it"
            self.report("an argument has no name", popped[0].start, popped[0].end, advice)
            return "an argument has no name"
        opening = next((p for p in popped if isinstance(p, Piece) and p.type == "_LPAR"), None)
        if opening is not None and (self.at.is_end_of_statement() or "_RPAR" in choices):
            return self._unexpected("`(` is not closed", opening, "close it with `)`")
        for type_, what in MISSING.items():
            if type_ in choices:
                return self._unexpected(f"{what} is missing", token, "write it here")
        for type_, sign, advice in BLOCKS:
            if type_ in choices:
                message = f"`{sign}` is missing"
                self.report(message, start, max(self.last, start + 1), advice)
                return message
        advice = "end the statement with `;` or a new line"
        if not self.has_lines:
            advice = "write such as `goto(position 0..4000) -> bool`"
        return self._unexpected(f"`{token.text}` is not expected here", token, advice)

    def _unexpected(self, message: str, token: Lexeme | Piece, advice: str) -> str:
        self.report(message, *_place(token), advice)
        return message


def _place(token: Lexeme | Piece) -> tuple[int, int]:
    return token.start, max(token.end, token.start + 1)


def _is_name(token: Lexeme, after: Lexeme) -> bool:
    """Return whether the first token of a statement is a name, judged by the token after it."""
    if token.text in ("var", "let", "const"):
        return after.kind != "word"
    if token.text == "unreadable":
        return after.kind != "string"
    return after.kind == "sign" and after.text in (*ASSIGNMENT, ".", "[")


def _latest_piece(state: Any, type_: str) -> Piece:
    found: Piece = next(
        v for v in reversed(state.value_stack) if isinstance(v, Piece) and v.type == type_
    )
    return found


def _state_after(state: Any, type_: str) -> Any:
    """Return the parser state after a token; None if the parser rejects the token.

    The tables of an LALR parser reject a token only after some reductions.
    """
    states, last = state.parse_conf.states, state.parse_conf.end_state
    action, found = states[state.position].get(type_, (None, None))
    if action is Shift:
        return found
    stack = list(state.state_stack)
    while not (type_ == "$END" and stack[-1] == last):
        action, found = states[stack[-1]].get(type_, (None, None))
        if action is None or action is Shift:
            return found
        if found.expansion:
            del stack[-len(found.expansion) :]
        stack.append(states[stack[-1]][found.origin.name][1])
    return last


def _expression_stops(state: Any) -> frozenset[str]:
    """Return the signs and words that may follow an expression in this state."""
    return _token_texts(frozenset(state.parse_conf.states[_state_after(state, "EXPRESSION")]))


@cache
def _token_texts(types: frozenset[str]) -> frozenset[str]:
    """Return the texts of token types.

    The block of a loop also ends the expression before it, and a comma ends a name.
    """
    found = {word for word, type_ in KEYWORDS.items() if type_ in types}
    found |= {sign for sign, others in SIGNS.items() if not types.isdisjoint(others)}
    if "IN" in types:
        found.add("{")
    if "_EQUAL" in types or types == {"ASSIGN"}:
        found.add(",")
    return frozenset(found)


def _slashes(text: Text, match: re.Match[str]) -> tuple[int, int]:
    """Return the location of ``//`` in a match."""
    start = text.value.index("//", match.start())
    return start, start + len("//")
