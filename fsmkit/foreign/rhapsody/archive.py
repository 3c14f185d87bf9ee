"""The text format of Rhapsody's archives, as nodes with locations.

::

    archive = line object* ;
    object  = "{" name ("-" name "=" value)* "}" ;
    value   = (object | scalar ";")* ;
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import NoReturn

from fsmkit.diagnostics import Findings, Source, Span, Text

FIRST_LINE = re.compile(r"I-Logix-RPY-Archive version ([\d.]+)")
TOKEN = re.compile(
    r'\s+|(?P<string>"(?:[^"\\]|\\.)*")|(?P<sign>[{}=;])|(?P<word>[^\s{}=;"]+)', re.DOTALL
)
DEEPEST = 200
"""Levels of nested objects."""


@dataclass(frozen=True)
class Node:
    """An object: the name of its class, and its fields with their values in order."""

    kind: str
    fields: dict[str, list[Node | Text]]
    span: Span = field(compare=False, repr=False)

    def text(self, name: str) -> Text | None:
        """Return the first value of a field if it is a scalar; None for an empty one."""
        value = next(iter(self.fields.get(name, ())), None)
        return value if isinstance(value, Text) and value.value != "NULL" else None

    def word(self, name: str) -> str:
        """Return a scalar, or an empty string."""
        found = self.text(name)
        return "" if found is None else found.value

    def node(self, name: str) -> Node | None:
        """Return the first value of a field if it is an object."""
        value = next(iter(self.fields.get(name, ())), None)
        return value if isinstance(value, Node) else None

    def items(self, name: str) -> list[Node]:
        """Return the objects of a container, such as the ``States`` of a statechart."""
        container = self.node(name)
        found = [] if container is None else container.fields.get("value", [])
        return [one for one in found if isinstance(one, Node)]

    def below(self) -> Iterator[Node]:
        """Yield this object and all inside it."""
        left = [self]
        while left:
            node = left.pop()
            yield node
            inner = [v for values in node.fields.values() for v in values if isinstance(v, Node)]
            left += reversed(inner)


def decode(content: bytes, name: str, findings: Findings) -> Source | None:
    """Return the text of a file: UTF-8, or else Windows-1252, as Rhapsody writes it."""
    del findings
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError:
        text = content.decode("cp1252", errors="replace")
    return Source(name, text.replace("\r\n", "\n").replace("\r", "\n"))


def read_archive(source: Source, findings: Findings) -> list[Node]:
    """Return the objects of an archive; none, with a finding, if it is damaged or no archive."""
    first = source.line(1)
    if FIRST_LINE.match(first) is None:
        findings.add(
            "foreign-syntax",
            f"`{source.name}` is not an archive of Rhapsody",
            Span(source, 0, len(first)),
            help="save the model in the text format, whose first line is `I-Logix-RPY-Archive`",
        )
        return []
    reader = _Reader(source, findings, min(len(first) + 1, len(source.text)))
    try:
        return reader.objects()
    except _Damaged:
        return []


class _Damaged(Exception):  # noqa: N818  (control flow of this module)
    """An error was reported."""


@dataclass(frozen=True, slots=True)
class _Token:
    kind: str
    text: str
    start: int
    end: int


END = "end of the file"


class _Reader:
    """Reads tokens one by one, with one in advance."""

    def __init__(self, source: Source, findings: Findings, start: int) -> None:
        self.source, self.findings = source, findings
        self.at = start
        self.ahead: list[_Token] = []

    def objects(self) -> list[Node]:
        """Return the outermost objects."""
        found = []
        while self._peek(0).text != END:
            found.append(self._object(0))
        return found

    def _object(self, depth: int) -> Node:
        opening = self._expect("{")
        if depth > DEEPEST:
            self._fail(f"the objects are nested more than {DEEPEST} levels deep", opening)
        name = self._next()
        fields: dict[str, list[Node | Text]] = {}
        while self._peek(0).text == "-":
            self._next()
            key = self._next().text
            self._expect("=")
            fields.setdefault(key, []).extend(self._values(depth))
        self._expect("}")
        return Node(name.text, fields, Span(self.source, opening.start, name.end))

    def _values(self, depth: int) -> Iterator[Node | Text]:
        parts: list[_Token] = []
        while True:
            token = self._peek(0)
            is_field = token.text == "-" and self._peek(2).text == "="
            if token.text in ("}", END) or (is_field and not parts):
                break
            if token.text == "{" and not parts:
                yield self._object(depth + 1)
            elif self._next().text != ";":
                parts.append(token)
            else:
                if parts:
                    yield self._scalar(parts)
                parts = []
        if parts:
            yield self._scalar(parts)

    def _scalar(self, parts: list[_Token]) -> Text:
        if len(parts) == 1 and parts[0].kind == "string":
            return _unquoted(self.source, parts[0])
        start, end = parts[0].start, parts[-1].end
        return Text(self.source.text[start:end], Span(self.source, start, end))

    # --- tokens -----------------------------------------------------------------------------------

    def _peek(self, number: int) -> _Token:
        while len(self.ahead) <= number:
            self.ahead.append(self._token())
        return self.ahead[number]

    def _next(self) -> _Token:
        token = self._peek(0)
        if token.text == END:
            self._fail("the archive ends too early", token)
        return self.ahead.pop(0)

    def _expect(self, sign: str) -> _Token:
        token = self._next()
        if token.text != sign or token.kind == "string":
            self._fail(f"`{token.text[:40]}` is not expected here, but `{sign}`", token)
        return token

    def _token(self) -> _Token:
        text = self.source.text
        while self.at < len(text):
            found = TOKEN.match(text, self.at)
            if found is None:
                self._fail("a string has no end", _Token("", "", self.at, self.at + 1))
            self.at = found.end()
            if found.lastgroup is not None:
                return _Token(found.lastgroup, found[0], found.start(), found.end())
        return _Token("", END, len(text), len(text))

    def _fail(self, message: str, at: _Token) -> NoReturn:
        self.findings.add(
            "foreign-syntax",
            message,
            Span(self.source, at.start, at.end),
            help="save the unit in Rhapsody again",
        )
        raise _Damaged


def _unquoted(source: Source, token: _Token) -> Text:
    """Return a string without quotes; a backslash precedes a quote or a backslash."""
    raw = token.text[1:-1]
    if "\\" not in raw:
        return Text(raw, Span(source, token.start + 1, token.end - 1))
    kept = list(re.finditer(r"\\([\"\\])|.", raw, re.DOTALL))
    value = "".join(m[1] or m[0] for m in kept)
    offsets = tuple(token.start + m.end() for m in kept)
    return Text(value, Span(source, token.start + 1, token.end - 1), offsets)
