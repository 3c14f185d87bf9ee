"""YAML as small frozen nodes: every scalar is text with its location, nothing is resolved.

The parser of PyYAML gives the structure and the marks. Tags, anchors, aliases, ``<<`` and duplicate
keys are errors. ``on``, ``off``, ``null`` and ``1:30`` are plain texts.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Iterator
from collections.abc import Mapping as Table
from dataclasses import dataclass, field
from itertools import takewhile
from typing import Any, TypeVar

import yaml

from fsmkit.diagnostics import Findings, Severity, Source, Span, Text
from fsmkit.diagnostics.fast_init import fast_init
from fsmkit.diagnostics.fixes import remove_entry, replace_text
from fsmkit.diagnostics.suggestions import suggest_key
from fsmkit.yaml.broken import UNSPACED, report_broken
from fsmkit.yaml.layout import quoted
from fsmkit.yaml.places import offsets_of

DEEPEST = 200
"""Levels of nesting, two for each state: the readers recurse, and no chart is deeper."""
MOST_PIECES = 20
"""At most this many pieces of a text that YAML split at commas are joined again for a report."""
NOWHERE: Table[str, str] = {}
LIBYAML_DIFFERS = re.compile(r"[\t\ufeff]|[|>][-+0-9]*#|:\s+(?:#.*\n\s*)*[]},]")
"""Texts that libyaml accepts or locates differently from PyYAML's own parser."""
NO_TEXT = (
    (
        re.compile(r"[\ud800-\udfff]"),
        "half a character",
        "write the character itself, or its one code `\\U...`",
    ),
    (
        re.compile(r"\0"),
        "the character U+0000",
        "remove it: names and strings of C end there",
    ),
)
"""Characters that no text may contain: a pattern, a description, and advice."""
COMMENT = re.compile(r"[ \t]+#.*")
EXAMPLES = {
    "after": "{5s: target}",
    "cases": "{opens: [post go, wait 1s]}",
    "constants": "{LIMIT: 5}",
    "data": "{count: 0..9 = 0}",
    "environment": "{may: [gate.go]}",
    "events": "{in: [go], out: [ready]}",
    "every": "{5s: target}",
    "inputs": "{temp: 0..100}",
    "machines": "{gate: gate.yaml}",
    "on": "{event: target}",
    "outputs": "{lamp: bool}",
    "states": "{idle: {}, busy: {}}",
}
"""Examples of values, by key."""
APOSTROPHE = re.compile(r"(?<=\w)'(?=\w)")


@fast_init
@dataclass(frozen=True, slots=True)
class Scalar:
    """A text. ``quoted``: it is in quotes or in a block."""

    text: Text
    quoted: bool = False

    @property
    def span(self) -> Span:
        """The location of the text."""
        return self.text.span


@fast_init
@dataclass(frozen=True, slots=True)
class Sequence:
    """A list."""

    items: tuple[Node, ...]
    span: Span = field(compare=False, repr=False)


@fast_init
@dataclass(frozen=True, slots=True)
class Mapping:
    """Keys and values, in the order written; keys are unique."""

    entries: tuple[tuple[Text, Node], ...]
    span: Span = field(compare=False, repr=False)


Node = Scalar | Sequence | Mapping
Kind = TypeVar("Kind", Sequence, Mapping)


def read_nodes(source: Source, findings: Findings) -> Node | None:
    """Return the root node of a text with one document, or None after reporting an error."""
    return read_by_libyaml(source, findings) or read_by_pyyaml(source, findings)


def read_by_libyaml(source: Source, findings: Findings) -> Node | None:
    """Return the same ten times faster; None if the two parsers may differ or it fails."""
    if not yaml.__with_libyaml__ or LIBYAML_DIFFERS.search(source.text):
        return None
    if yaml.reader.Reader.NON_PRINTABLE.search(source.text):
        return None
    own = Findings()
    try:
        root = _Composer(source, yaml.CSafeLoader(source.text).get_event, own).root()
    except (yaml.YAMLError, ValueError, OverflowError, _TooDeep):
        return None
    if own.has_errors:
        return None
    findings.extend(own)
    return root


def read_by_pyyaml(source: Source, findings: Findings) -> Node | None:
    """Return the root node as `read_nodes` specifies, with every finding."""
    try:
        return _Composer(source, yaml.SafeLoader(source.text).get_event, findings).root()
    except yaml.reader.ReaderError as error:
        findings.add(
            "broken-yaml",
            f"the character U+{_code(error):04X} is not allowed in YAML",
            Span(source, error.position, error.position + 1),
            help="remove it; if the file is full of them, save it as UTF-8",
        )
    except yaml.MarkedYAMLError as error:
        report_broken(source, error, findings)
    except (ValueError, OverflowError) as error:  # errors of int() and chr() for an escape
        findings.add(
            "broken-yaml", f"an escape is not a character: {error}", Span(source, 0, 1),
            help="correct the escapes `\\x`, `\\u` and `\\U`",
        )  # fmt: skip
    except _TooDeep as error:
        findings.add(
            "too-deep", f"nested deeper than {DEEPEST} levels", error.span, help="split the chart"
        )
    return None


def _code(error: yaml.reader.ReaderError) -> int:
    character = error.character
    return character if isinstance(character, int) else ord(str(character)[:1] or "\0")


class _TooDeep(Exception):  # noqa: N818  (it never leaves this module)
    """Nested deeper than the readers recurse."""

    def __init__(self, span: Span) -> None:
        super().__init__(span)
        self.span = span


class _Composer:
    """Builds nodes from parser events, like ``yaml.compose``, but without resolving scalars."""

    def __init__(self, source: Source, next_event: Callable[[], Any], findings: Findings) -> None:
        """Start before the first event."""
        self._source = source
        self._next = next_event
        self._findings = findings
        self._has_comments = "#" in source.text

    def root(self) -> Node | None:
        """Return the root node of the only document."""
        self._next()  # the start of the stream
        if isinstance(self._next(), yaml.StreamEndEvent):
            self._findings.add(
                "empty-file", f"`{self._source.name}` is empty", Span(self._source, 0, 0),
                help="start with `chart: Name` or `system: Name`",
            )  # fmt: skip
            return None
        root = self._node(self._next(), 0)
        self._next()  # the end of the document
        after = self._next()
        if not isinstance(after, yaml.StreamEndEvent):
            self._reject(after, "a second document", "keep one chart in a file")
        return root

    def _node(self, event: yaml.Event, depth: int) -> Node:
        span = self._span(event)
        if depth > DEEPEST:
            raise _TooDeep(span)
        if event.__class__ is yaml.ScalarEvent and event.anchor is event.tag is None:
            return self._scalar(event, span)
        if isinstance(event, yaml.AliasEvent):
            advice = "write the value out; a text that starts with `*` must be quoted"
            self._reject(event, "an alias", advice)
            return Scalar(Text("", span), quoted=True)
        if getattr(event, "anchor", None) is not None:
            advice = "write the value out where it is needed; quote a text that starts with `&`"
            self._reject(event, "an anchor", advice)
        if getattr(event, "tag", None) is not None:
            self._reject(event, "a tag", "remove it, or quote a text that starts with `!`")
        match event:
            case yaml.ScalarEvent():
                return self._scalar(event, span)
            case yaml.SequenceStartEvent():
                items = []
                while not isinstance(item := self._next(), yaml.SequenceEndEvent):
                    items.append(self._node(item, depth + 1))
                if event.flow_style:
                    items = self._rejoined(items)
                return Sequence(tuple(items), Span(self._source, span.start, self._span(item).end))
            case _:
                return self._mapping(event, depth)

    def _scalar(self, event: yaml.ScalarEvent, span: Span) -> Scalar:
        for pattern, message, advice in NO_TEXT if event.style == '"' else ():
            if pattern.search(event.value):
                self._findings.add("broken-yaml", f"an escape makes {message}", span, help=advice)
                return Scalar(Text("", span), quoted=True)
        if event.style == "" and "?" in event.value:
            raise yaml.YAMLError  # in flow style only libyaml lets it be part of a plain scalar
        style = event.style or None  # of a plain scalar libyaml says ""
        offsets = offsets_of(span, event.value, style)
        scalar = Scalar(Text(event.value, span, offsets), style is not None)
        if style is None and self._has_comments:
            self._check_comment(scalar)
        return scalar

    def _check_comment(self, scalar: Scalar) -> None:
        """Report a plain text that ends in a comment although a quote or bracket is open."""
        rest = COMMENT.match(self._source.text, scalar.span.end)
        if rest is not None and _is_open(scalar.text.value):
            self._findings.add(
                "lost-text",
                "in YAML a comment starts at ` #`",
                Span(self._source, *rest.span()),
                help=f"quote the text: {quoted(scalar.text.value + rest[0])}",
                severity=Severity.WARNING,  # it may be one, after a text of prose
            )

    def _mapping(self, event: yaml.Event, depth: int) -> Mapping:
        entries: list[tuple[Node, Node]] = []
        while not isinstance(item := self._next(), yaml.MappingEndEvent):
            key = self._node(item, depth + 1)
            entries.append((key, self._node(self._next(), depth + 1)))
        if getattr(event, "flow_style", False):
            entries = self._rejoined_entries(entries)
        found: dict[str, tuple[Text, Node]] = {}
        for key, value in entries:
            if not isinstance(key, Scalar):
                self._findings.add(
                    "unexpected-shape", "a key must be a text", key.span,
                    help="quote it if it starts with `[` or `{`",
                )  # fmt: skip
            elif key.text.value == "<<" and not key.quoted:
                advice = "let a chart extend another instead"
                self._findings.add(
                    "beyond-charts", "a merge key is not used here", key.span, help=advice
                )
            elif key.text.value in found:
                self._findings.add(
                    "duplicate-key", f"`{key.text}` is given twice", key.span,
                    secondary=[(found[key.text.value][0], "first here")],
                    help="remove one of them, or make a list of both values",
                    fixes=remove_entry(key.text),
                )  # fmt: skip
            else:
                found[key.text.value] = (key.text, value)
        span = Span(self._source, self._span(event).start, self._span(item).end)
        return Mapping(tuple(found.values()), span)

    def _rejoined(self, items: list[Node]) -> list[Node]:
        """Join the pieces of a text that YAML split at a comma inside parentheses."""
        found: list[Node] = []
        at = 0
        while at < len(items):
            count = _pieces(items[at : at + MOST_PIECES])
            found.append(self._joined(items[at], items[at + count]) if count else items[at])
            at += 1 + count
        return found

    def _rejoined_entries(self, entries: list[tuple[Node, Node]]) -> list[tuple[Node, Node]]:
        found: list[tuple[Node, Node]] = []
        at = 0
        while at < len(entries):
            key, value = entries[at]
            following = entries[at + 1 : at + MOST_PIECES]
            lonely = takewhile(
                lambda e: isinstance(e[1], Scalar) and not e[1].text.value, following
            )
            count = _pieces([value, *(name for name, _ in lonely)])
            found.append((key, self._joined(value, entries[at + count][0]) if count else value))
            at += 1 + count
        return found

    def _joined(self, first: Node, last: Node) -> Scalar:
        span = Span(self._source, first.span.start, last.span.end)
        whole = self._source.text[span.start : span.end]
        self._findings.add(
            "lost-text",
            "YAML split this text at a comma",
            span,
            help=f"quote it: {quoted(whole)}",
            fixes=replace_text(span, quoted(whole), sure=True),
        )
        return Scalar(Text(whole, span))

    def _span(self, event: Any) -> Span:
        return Span(self._source, event.start_mark.index, event.end_mark.index)

    def _reject(self, event: yaml.Event, what: str, advice: str) -> None:
        message = f"{what} is not used in charts"
        self._findings.add("beyond-charts", message, self._span(event), help=advice)


def _pieces(nodes: list[Node]) -> int:
    """Return how many texts after the first close the parentheses that it opens; 0 if none does."""
    text = ""
    for count, node in enumerate(nodes):
        if not isinstance(node, Scalar) or node.quoted:
            return 0
        text += node.text.value
        if text.count("(") == text.count(")"):
            return count
    return 0


def _is_open(text: str) -> bool:
    """Return whether a quote or parenthesis is unclosed; an apostrophe in a word does not count."""
    text = APOSTROPHE.sub("", text)
    return text.count("(") > text.count(")") or text.count('"') % 2 == 1 or text.count("'") % 2 == 1


# --- checked access to nodes -------------------------------------------------------------------


def require_mapping(node: Node | None, what: str, findings: Findings) -> Mapping | None:
    """Return a node that must be a mapping, or None if it is absent or after reporting an error."""
    advice = "write `key: value` lines, or `{key: value}`"
    key = what.strip("`")
    if key in EXAMPLES:
        advice += f", for instance `{key}: {EXAMPLES[key]}`"
    unspaced = UNSPACED.fullmatch(node.text.value) if isinstance(node, Scalar) else None
    if unspaced is not None:
        advice = f"put a blank after the colon: `{unspaced[1]}: {unspaced[2]}`"
    return _required(node, Mapping, f"{what} must be keys with values", advice, findings)


def require_sequence(node: Node | None, what: str, findings: Findings) -> Sequence | None:
    """Return a node that must be a list, or None if it is absent or after reporting an error."""
    advice = "start each entry with `- `"
    return _required(node, Sequence, f"{what} must be a list", advice, findings)


def _required(
    node: Node | None, kind: type[Kind], message: str, advice: str, findings: Findings
) -> Kind | None:
    if node is None or isinstance(node, kind):
        return node
    if isinstance(node, Scalar) and not node.text.value:
        return kind((), node.span)
    findings.add("unexpected-shape", message, node.span, help=advice)
    return None


def require_text(node: Node | None, what: str, findings: Findings) -> Text | None:
    """Return the text of a node; None if it is absent or after reporting an error.

    White space around it is quoted or indented, and has no meaning.
    """
    if node is None or isinstance(node, Scalar):
        return None if node is None else node.text.strip()
    written = node.span.source.text[node.span.start : node.span.end].split("\n")[0].strip()
    if isinstance(node, Mapping) and not written.startswith("{"):
        findings.add(
            "lost-text", f"{what} must be a text; YAML split it at `: `", node.span,
            help=f"quote it: {quoted(written)}",
            fixes=replace_text(_line_of(node.span), quoted(written), sure=True),
        )  # fmt: skip
    else:
        kind = "keys with values" if isinstance(node, Mapping) else "a list"
        findings.add(
            "unexpected-shape", f"{what} must be a text, not {kind}", node.span,
            help=f"quote it: {quoted(written)}" if len(written) < 80 else "quote it",
        )  # fmt: skip
    return None


def _line_of(span: Span) -> Span:
    """Return the first line of a location, as far as its text extends."""
    text = span.source.text[span.start : span.end].split("\n")[0].rstrip()
    return Span(span.source, span.start, span.start + len(text))


def require_record(
    node: Node | None,
    known: Collection[str],
    what: str,
    findings: Findings,
    elsewhere: Table[str, str] = NOWHERE,
) -> dict[str, Node] | None:
    """Return the values of a mapping by key, after checking the keys.

    None if it is not a mapping.
    """
    mapping = require_mapping(node, what, findings)
    if mapping is None:
        return None
    check_keys(mapping, known, what, findings, elsewhere)
    return {key.value: value for key, value in mapping.entries}


def entries_of(node: Node | None, what: str, findings: Findings) -> tuple[tuple[Text, Node], ...]:
    """Return the entries of an optional mapping."""
    mapping = require_mapping(node, what, findings)
    return () if mapping is None else mapping.entries


def items_of(node: Node | None, what: str, findings: Findings) -> tuple[Node, ...]:
    """Return the items of an optional list."""
    sequence = require_sequence(node, what, findings)
    return () if sequence is None else sequence.items


def texts_of(node: Node | None, what: str, item_what: str, findings: Findings) -> Iterator[Text]:
    """Yield the texts of an optional list of texts."""
    for item in items_of(node, what, findings):
        if (text := require_text(item, item_what, findings)) is not None:
            yield text


def check_keys(
    mapping: Mapping,
    known: Collection[str],
    what: str,
    findings: Findings,
    elsewhere: Table[str, str] = NOWHERE,
) -> None:
    """Report each unknown key, with a similar one.

    ``elsewhere`` says where a key belongs that has a meaning in another object.
    """
    for key, _ in mapping.entries:
        if key.value in known:
            continue
        advice = suggest_key(key.value, known, f"use {_listed(known)}" if known else "remove it")
        advice = elsewhere.get(key.value, advice)
        findings.add("unknown-key", f"{what} has no key `{key.value}`", key, help=advice)


def _listed(known: Collection[str]) -> str:
    *first, last = sorted(known)
    return f"{', '.join(first)} or {last}" if first else last
