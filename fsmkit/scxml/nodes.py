"""XML as small frozen nodes, in which each attribute and text has its exact location.

One parser, expat, provides both structure and locations, so that the two agree. It rejects every
reference to other texts: entities, external subsets, inclusions.
"""

from __future__ import annotations

import re
from bisect import bisect_right
from contextlib import suppress
from dataclasses import dataclass, field
from itertools import accumulate
from xml.parsers import expat

from fsmkit.diagnostics import Findings, Source, Span, Text
from fsmkit.diagnostics.fast_init import fast_init
from fsmkit.scxml.broken import report_broken
from fsmkit.scxml.names import XINCLUDE

DEEPEST = 100
"""Levels of nesting; the reader recurses, and no chart is deeper."""

ATTRIBUTE = re.compile(r"\s+([^\s=/>]+)\s*=\s*(?:\"([^\"]*)\"|'([^']*)')")
REFERENCE = re.compile(r"&[^;]*;|.", re.DOTALL)
DECLARATION = re.compile(rb"<\?xml[^>]*?encoding\s*=\s*[\"']([A-Za-z0-9._-]+)[\"']")


@fast_init
@dataclass(frozen=True, slots=True)
class Attribute:
    """An attribute: namespace (empty without a prefix), name, value, location of the name."""

    namespace: str
    name: str
    value: Text
    span: Span = field(compare=False, repr=False)


@fast_init
@dataclass(frozen=True, slots=True)
class Element:
    """An element. ``text`` joins the character data directly in it, as written."""

    namespace: str
    name: str
    attributes: tuple[Attribute, ...]
    children: tuple[Element, ...]
    text: Text
    span: Span = field(compare=False, repr=False)
    """The start tag, up to the end of its first line."""
    inner: Span = field(compare=False, repr=False)
    """The source between the start tag and the end tag."""

    def get(self, name: str, namespace: str = "") -> Text | None:
        """Return the value of an attribute, or None."""
        for attribute in self.attributes:
            if attribute.name == name and attribute.namespace == namespace:
                return attribute.value
        return None


def decode(content: bytes, name: str, findings: Findings) -> Source | None:
    """Return the text of a file, decoded by byte order mark, declaration, or as UTF-8."""
    encoding = _encoding(content)
    try:
        text = content.decode(encoding)
    except LookupError:
        source = Source(name, content[:1000].decode("ascii", errors="replace"))
        start = max(0, source.text.find(encoding))
        findings.add(
            "unknown-encoding",
            f"unknown encoding `{encoding}`",
            Span(source, start, start + len(encoding)),
            help="save the file as UTF-8",
        )
        return None
    except UnicodeError as error:
        source = Source(name, _readable(content, encoding, error))
        at = max(0, len(source.text) - 1)
        findings.add(
            "unknown-encoding",
            f"`{name}` is not valid {encoding.upper()} after this place",
            Span(source, at, at + 1),
            help="save the file as UTF-8, or name its encoding in the XML declaration",
        )
        return None
    return Source(name, text.removeprefix("\ufeff").replace("\r\n", "\n").replace("\r", "\n"))


def _readable(content: bytes, encoding: str, error: UnicodeError) -> str:
    """Return the text before the undecodable byte, if the codec reports its offset."""
    if isinstance(error, UnicodeDecodeError):
        with suppress(UnicodeError):
            return content[: error.start].decode(encoding, errors="replace")
    return content[:1000].decode("ascii", errors="replace")


def _encoding(content: bytes) -> str:
    """Return the name of the encoding (XML 1.0, appendix F)."""
    if content.startswith((b"\xff\xfe\0\0", b"\0\0\xfe\xff")):
        return "utf-32"
    if content.startswith((b"\xff\xfe", b"\xfe\xff")):
        return "utf-16"
    if content.startswith(b"<\0"):
        return "utf-16-le"
    if content.startswith(b"\0<"):
        return "utf-16-be"
    if content.startswith(b"\xef\xbb\xbf"):
        return "utf-8"
    declared = DECLARATION.match(content[:1000])
    return declared[1].decode("ascii").lower() if declared else "utf-8"


def read_nodes(source: Source, findings: Findings) -> Element | None:
    """Return the root element of a text, or None after reporting an error."""
    builder = _Builder(source, findings)
    try:
        return builder.build()
    except expat.ExpatError as error:
        byte = max(0, builder.parser.ErrorByteIndex)  # negative where nothing was read
        at = min(builder.place(byte), max(0, len(source.text) - 1))
        what = expat.ErrorString(error.code) or "it cannot be read"
        report_broken(source, at, what, builder.open[-1].name if builder.open else "", findings)
    except _Stop:
        pass
    return None


class _Stop(Exception):  # noqa: N818  (control flow of this module)
    """An error was reported, and parsing cannot continue."""


@dataclass
class _Open:
    """An element whose end tag has not been read yet."""

    namespace: str
    name: str
    attributes: tuple[Attribute, ...]
    span: Span
    content_start: int
    children: list[Element] = field(default_factory=list)
    pieces: list[tuple[str, int]] = field(default_factory=list)
    """Character data, and the offset of each piece."""


class _Builder:
    """Builds elements from the events of expat, in one pass."""

    def __init__(self, source: Source, findings: Findings) -> None:
        self.source = source
        self.open: list[_Open] = []
        self._findings = findings
        self._root: Element | None = None
        text = source.text
        self._bytes = text.encode("utf-8", errors="surrogatepass")
        self._starts = None if text.isascii() else list(accumulate(map(_width, text), initial=0))
        self.parser = expat.ParserCreate("utf-8", " ")
        self.parser.ordered_attributes = True
        self.parser.buffer_text = False
        self.parser.StartElementHandler = self._start
        self.parser.EndElementHandler = self._end
        self.parser.CharacterDataHandler = self._data
        self.parser.StartDoctypeDeclHandler = self._doctype
        self.parser.EntityDeclHandler = self._entity
        self.parser.SkippedEntityHandler = self._skipped

    def build(self) -> Element | None:
        self.parser.Parse(self._bytes, True)
        return self._root

    def place(self, byte: int) -> int:
        """Return the offset in characters of an offset in bytes."""
        return byte if self._starts is None else bisect_right(self._starts, byte) - 1

    def _offset(self) -> int:
        return self.place(self.parser.CurrentByteIndex)

    def _reject(self, what: str, advice: str) -> None:
        at = self._offset()
        end = self.source.text.find(">", at) + 1 or at + 1
        place = Span(self.source, at, end)
        self._findings.add("xml-beyond-charts", what, place, help=advice)
        raise _Stop

    def _doctype(
        self, name: str, system_id: str | None, public_id: str | None, has_internal_subset: bool
    ) -> None:
        del has_internal_subset
        if system_id is not None or public_id is not None:
            self._reject(
                f"the declaration of `{name}` names an external subset; it is not read",
                "remove `<!DOCTYPE ...>`: a chart does not need it",
            )

    def _entity(self, name: str, *rest: object) -> None:
        del rest
        self._reject(
            f"the entity `{name}` is declared; entities are not read",
            "write out its text, and remove the declaration",
        )

    def _skipped(self, name: str, is_parameter: bool) -> None:
        if not is_parameter:
            self._reject(f"the entity `{name}` is not known", "write out its text")

    def _start(self, name: str, pairs: list[str]) -> None:
        at = self._offset()
        if len(self.open) >= DEEPEST:
            self._findings.add(
                "nested-too-deep",
                f"elements are nested deeper than {DEEPEST} levels",
                Span(self.source, at, at + 1),
                help="split the chart",
            )
            raise _Stop
        namespace, local = _split(name)
        if namespace == XINCLUDE:
            self._reject("an inclusion is not read", "write its content here")
        attributes, end = self._attributes(at, pairs)
        text = self.source.text
        end = text.find(">", end) + 1 or len(text)
        line = text.find("\n", at, end)
        span = Span(self.source, at, end if line < 0 else line)
        self.open.append(_Open(namespace, local, attributes, span, end))

    def _attributes(self, at: int, pairs: list[str]) -> tuple[tuple[Attribute, ...], int]:
        """Return the attributes of the start tag at an offset, and the end of the last one."""
        text = self.source.text
        end = at + 1
        while end < len(text) and text[end] not in " \t\n/>":
            end += 1
        found: list[Attribute] = []
        while match := ATTRIBUTE.match(text, end):
            end = match.end()
            if match[1] == "xmlns" or match[1].startswith("xmlns:"):
                continue
            group = 2 if match[2] is not None else 3
            namespace, name = _split(pairs[2 * len(found)])
            value = self._value(match.start(group), match[group], pairs[2 * len(found) + 1])
            span = Span(self.source, match.start(1), match.end(1))
            found.append(Attribute(namespace, name, value, span))
        return tuple(found), end

    def _value(self, start: int, raw: str, value: str) -> Text:
        span = Span(self.source, start, start + len(raw))
        if "&" not in raw:
            return Text(value, span)
        offsets = tuple(start + match.start() for match in REFERENCE.finditer(raw))
        return Text(value, span, offsets if len(offsets) == len(value) else ())

    def _data(self, data: str) -> None:
        self.open[-1].pieces.append((data, self._offset()))

    def _end(self, name: str) -> None:
        del name
        done = self.open.pop()
        end = max(self._offset(), done.content_start)
        if self.source.text.startswith("/>", done.content_start - 2):
            end = done.content_start
        inner = Span(self.source, done.content_start, end)
        element = Element(
            done.namespace,
            done.name,
            done.attributes,
            tuple(done.children),
            _joined(done.pieces, inner),
            done.span,
            inner,
        )
        if self.open:
            self.open[-1].children.append(element)
        else:
            self._root = element


def _joined(pieces: list[tuple[str, int]], inner: Span) -> Text:
    """Return character data as one text, with offsets if it consists of several pieces."""
    if not pieces:
        return Text("", Span(inner.source, inner.start, inner.start))
    value = "".join(data for data, _ in pieces)
    start, end = pieces[0][1], pieces[-1][1] + len(pieces[-1][0])
    if end - start == len(value) and inner.source.text.startswith(value, start):
        return Text(value, Span(inner.source, start, end))
    offsets = tuple(at + i for data, at in pieces for i in range(len(data)))
    return Text(value, Span(inner.source, start, end), offsets)


def _split(name: str) -> tuple[str, str]:
    namespace, _, local = name.rpartition(" ")
    return namespace, local


def _width(char: str) -> int:
    """Return the number of bytes of a character in UTF-8."""
    code = ord(char)
    return 1 if code < 0x80 else 2 if code < 0x800 else 3 if code < 0x10000 else 4
