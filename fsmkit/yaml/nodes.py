"""YAML as small frozen nodes: every scalar is text with its place, nothing is resolved.

``yaml.compose`` gives the structure and the marks; tags, anchors, aliases, ``<<`` and duplicate
keys are errors, so that ``on``, ``off``, ``null`` and ``1:30`` are what they say.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from difflib import get_close_matches

import yaml

from fsmkit.diagnostics import Findings, Source, Span, Text

DEEPEST = 100
"""Levels of nesting; the reader recurses, and no chart is deeper."""


@dataclass(frozen=True, slots=True)
class Scalar:
    """A text. ``quoted``: it stood in quotes or as a block."""

    text: Text
    quoted: bool = False

    @property
    def span(self) -> Span:
        """The place of the text."""
        return self.text.span


@dataclass(frozen=True, slots=True)
class Sequence:
    """A list."""

    items: tuple[Node, ...]
    span: Span = field(compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class Mapping:
    """Keys and values, in the order written; keys are unique."""

    entries: tuple[tuple[Text, Node], ...]
    span: Span = field(compare=False, repr=False)


Node = Scalar | Sequence | Mapping


def decode(content: bytes, name: str, findings: Findings) -> Source | None:
    """Return the text of a YAML file: UTF-8, or UTF-16 with a byte order mark (YAML 1.2, 5.2)."""
    encoding = "utf-16" if content[:2] in (b"\xff\xfe", b"\xfe\xff") else "utf-8-sig"
    try:
        return Source(name, content.decode(encoding).replace("\r\n", "\n"))
    except UnicodeDecodeError as error:
        before = content[: error.start].decode(encoding, errors="replace")
        source = Source(name, before)
        at = Span(source, max(0, len(before) - 1), len(before))
        findings.add(
            "invalid-encoding",
            f"`{name}` is not valid {encoding.removesuffix('-sig').upper()} after this place",
            at,
            help="save the file as UTF-8",
        )
        return None


def read_nodes(source: Source, findings: Findings) -> Node | None:
    """Return the root node of the only document of a text, or None after saying why not."""
    try:
        events = list(yaml.parse(source.text, Loader=yaml.SafeLoader))
        return _Composer(source, events, findings).document()
    except yaml.reader.ReaderError as error:
        at = Span(source, error.position, error.position + 1)
        findings.add(
            "broken-yaml", f"a character that YAML does not allow: {error.reason}", at,
            help="remove it",
        )  # fmt: skip
    except yaml.MarkedYAMLError as error:
        _broken(source, error, findings)
    except RecursionError:
        findings.add("too-deep", "the text is nested too deep", Span(source, 0, 1))
    except _Stop:
        pass
    return None


def _broken(source: Source, error: yaml.MarkedYAMLError, findings: Findings) -> None:
    mark = error.problem_mark or error.context_mark
    offset = mark.index if mark else 0
    advice = "check indentation, quotes and brackets around this place"
    line = source.line(source.position(min(offset, len(source.text)))[0])
    if error.problem and "mapping values are not allowed" in error.problem and ": " in line:
        key, _, rest = line.strip().partition(": ")
        shown = rest.replace("\\", "\\\\").replace('"', '\\"')
        advice = f'a text with `: ` must be quoted: `{key}: "{shown}"`'
    elif "\t" in line:
        advice = "YAML does not indent with tabs: use spaces"
    what = ", ".join(part for part in (error.context, error.problem) if part)
    findings.add("broken-yaml", what, Span(source, offset, offset + 1), help=advice)


class _Stop(Exception):  # noqa: N818  (control flow of this module)
    """An error was reported after which nothing can follow."""


class _Composer:
    """Makes nodes of parser events, as ``yaml.compose`` does, but with nothing resolved."""

    def __init__(self, source: Source, events: list[yaml.Event], findings: Findings) -> None:
        """Stand before the first event."""
        self._source = source
        self._events = iter(events)
        self._findings = findings

    def document(self) -> Node | None:
        next(self._events)  # the start of the stream
        if isinstance(next(self._events), yaml.StreamEndEvent):
            self._findings.add(
                "empty-file", f"`{self._source.name}` is empty", Span(self._source, 0, 0),
                help="begin with `chart: Name` or `system: Name`",
            )  # fmt: skip
            return None
        root = self._node(next(self._events), 0)
        next(self._events)  # the end of the document
        after = next(self._events)
        if not isinstance(after, yaml.StreamEndEvent):
            self._refuse(after, "a second document", "keep one chart in a file")
        return root

    def _node(self, event: yaml.Event, depth: int) -> Node:
        if depth > DEEPEST:
            self._findings.add(
                "too-deep", f"nested deeper than {DEEPEST} levels", self._span(event),
                help="split the chart",
            )  # fmt: skip
            raise _Stop
        if isinstance(event, yaml.AliasEvent):
            self._refuse(event, "an alias", "write the value out, or let a chart extend another")
        if getattr(event, "anchor", None) is not None:
            self._refuse(event, "an anchor", "write the value out where it is needed")
        if getattr(event, "tag", None) is not None:
            self._refuse(event, "a tag", "remove it, or quote a text that begins with `!`")
        match event:
            case yaml.ScalarEvent():
                return Scalar(self._text(event), event.style is not None)
            case yaml.SequenceStartEvent():
                items = []
                while not isinstance(item := next(self._events), yaml.SequenceEndEvent):
                    items.append(self._node(item, depth + 1))
                return Sequence(tuple(items), self._between(event, item))
            case _:
                return self._mapping(event, depth)

    def _mapping(self, event: yaml.Event, depth: int) -> Mapping:
        entries: dict[str, tuple[Text, Node]] = {}
        while not isinstance(item := next(self._events), yaml.MappingEndEvent):
            key = self._node(item, depth + 1)
            value = self._node(next(self._events), depth + 1)
            if not isinstance(key, Scalar):
                self._findings.add(
                    "unexpected-shape", "a key must be a text", key.span,
                    help="quote it if it begins with `[` or `{`",
                )  # fmt: skip
                continue
            name = key.text
            if name.value == "<<":
                self._refuse(item, "a merge key", "let a chart extend another instead")
            if name.value in entries:
                self._findings.add(
                    "duplicate-key", f"`{name.value}` is given twice", name,
                    secondary=[(entries[name.value][0], "first here")],
                    help="remove one of them, or make a list of both values",
                )  # fmt: skip
                continue
            entries[name.value] = (name, value)
        return Mapping(tuple(entries.values()), self._between(event, item))

    def _text(self, event: yaml.ScalarEvent) -> Text:
        span = self._span(event)
        return Text(event.value, span, _offsets(span, event.value, event.style))

    def _span(self, event: yaml.Event) -> Span:
        return Span(self._source, event.start_mark.index, event.end_mark.index)

    def _between(self, first: yaml.Event, last: yaml.Event) -> Span:
        return Span(self._source, first.start_mark.index, last.end_mark.index)

    def _refuse(self, event: yaml.Event, what: str, advice: str) -> None:
        self._findings.add(
            "yaml-beyond-charts", f"{what} is not used in charts", self._span(event), help=advice
        )
        raise _Stop


def _offsets(span: Span, value: str, style: str | None) -> tuple[int, ...] | None:
    """Map each character of a scalar's value to its offset in the source; None where parallel."""
    source = span.source.text
    if style is None and source[span.start : span.start + len(value)] == value:
        return None
    if source[span.start + 1 : span.start + 1 + len(value)] == value and style in ("'", '"'):
        return tuple(range(span.start + 1, span.start + 1 + len(value)))
    position = span.start + (1 if style in ("'", '"') else 0)
    if style in ("|", ">"):
        position = source.find("\n", position) + 1
    offsets = []
    for char in value:
        # Indentation, folding and escapes only ever insert: look ahead for the character.
        found = source.find(char, position, span.end)
        if char == " " and found < 0 or char == "\n":
            found = source.find("\n", position, span.end)
        if 0 <= found:
            position = found
        offsets.append(min(position, max(span.start, span.end - 1)))
        position = position + 1 if 0 <= found else position
    return tuple(offsets)


def demand_mapping(node: Node, what: str, findings: Findings) -> Mapping | None:
    """Return a node that must be a mapping, or None after saying so."""
    if isinstance(node, Mapping):
        return node
    if isinstance(node, Scalar) and not node.text.value:
        return Mapping((), node.span)
    return _misshapen(node, what, "keys with values", findings)


def demand_sequence(node: Node, what: str, findings: Findings) -> Sequence | None:
    """Return a node that must be a list, or None after saying so."""
    if isinstance(node, Sequence):
        return node
    return _misshapen(node, what, "a list", findings)


def demand_text(node: Node, what: str, findings: Findings) -> Text | None:
    """Return the text of a node that must be one, or None after saying so."""
    if isinstance(node, Scalar):
        return node.text
    at = node.span
    quoted = at.source.text[at.start : at.end].split("\n")[0].strip()
    advice = f"quote it: `'{quoted}'`" if len(quoted) < 80 else "quote it"
    findings.add("unexpected-shape", f"{what} must be a text", at, help=advice)
    return None


def _misshapen(node: Node, what: str, wanted: str, findings: Findings) -> None:
    findings.add("unexpected-shape", f"{what} must be {wanted}", node.span)


def check_keys(mapping: Mapping, known: frozenset[str], what: str, findings: Findings) -> None:
    """Report each key that is not among those known, and which one may have been meant."""
    for key, _ in mapping.entries:
        if key.value not in known:
            close = get_close_matches(key.value, known, 1)
            advice = (
                f"did you mean `{close[0]}`?" if close else f"use one of {', '.join(sorted(known))}"
            )
            findings.add("unknown-key", f"{what} has no key `{key.value}`", key, help=advice)
