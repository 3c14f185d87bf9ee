"""The concrete syntax of YAML: nodes with their style, comments and blank lines.

PyYAML provides the structure; comments lie between scalars. Each comment belongs to the entry
below it or before it, or to the end of a block.
"""

from __future__ import annotations

import re
from bisect import bisect_right
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any

import yaml

from fsmkit.diagnostics import Source
from fsmkit.yaml.nodes import LIBYAML_DIFFERS

REMARK = re.compile(r"(?:^|(?<=\s))#[^\n]*")
HEADER = re.compile(r"([|>])([-+0-9]*)[ \t]*(#[^\n]*)?")
BLANK_LINES = re.compile(r"(?:\n[ \t]*)+\Z")
LEAST_GAP = 2
"""Blanks between a line and the comment at its end, at least."""


@dataclass(slots=True)
class Scalar:
    """A scalar. ``raw``: its source, with quotes or block header."""

    value: str
    raw: str
    style: str
    """Empty of a plain text; else a quote, `|` or `>`."""
    start: int
    end: int
    in_flow: bool = False


@dataclass(slots=True)
class Entry:
    """An entry of a mapping, or with no ``key`` of a list, and the comments that are its own."""

    node: Node
    key: Scalar | None = None
    blank: bool = False
    """Whether a blank line precedes it and its comments."""
    above: list[str] = field(default_factory=list)
    """Comments above it; empty strings are blank lines."""
    behind: list[str] = field(default_factory=list)
    """Comments at the end of its line, with the blanks before them."""
    top: int | None = None
    """The offset of the first of the comments above it, if one is on a line of its own."""

    @property
    def start(self) -> int:
        """Return its start offset."""
        return self.node.start if self.key is None else self.key.start


@dataclass(slots=True)
class Block:
    """A mapping or a list."""

    is_mapping: bool
    is_flow: bool
    start: int
    end: int
    entries: list[Entry] = field(default_factory=list)
    tail: list[str] = field(default_factory=list)
    """Comments after the last entry; empty strings are blank lines."""
    opening: list[str] = field(default_factory=list)
    """Comments behind the opening bracket."""
    bottom: int | None = None
    """The offset of the last of the comments after the last entry."""


Node = Scalar | Block


def concrete(source: Source) -> Node:
    """Return the outermost node of a text that `fsmkit.yaml.nodes.read_nodes` reads.

    Raises:
        yaml.YAMLError: Where the text is no YAML.

    """
    root = _Builder(source).root()
    _Comments(source, root).place()
    return root


@lru_cache(maxsize=4)
def remarks(source: Source) -> tuple[str, ...]:
    """Return the comments of a text, in the order of the file."""
    found = _Comments(source, _Builder(source).root())
    return tuple(text for _, text in sorted([*found.in_headers(), *found.between()]))


class _Builder:
    """Makes nodes of the events of the parser."""

    def __init__(self, source: Source) -> None:
        self._text = source.text
        self._events: Iterator[Any] = iter(_events(source.text))

    def root(self) -> Node:
        next(self._events)  # the start of the stream
        next(self._events)  # the start of the document
        return self._node(next(self._events), in_flow=False)

    def _node(self, event: Any, *, in_flow: bool) -> Node:
        start, end = event.start_mark.index, event.end_mark.index
        if event.__class__ is yaml.ScalarEvent:
            raw = self._text[start:end]
            style = event.style or ""
            style = "" if style == "plain" else style
            if style in ("|", ">"):
                raw = BLANK_LINES.sub("", raw)  # blanks at the end of a line are part of the text
            elif not style:
                raw = raw.rstrip()
            return Scalar(event.value, raw, style, start, start + len(raw), in_flow)
        is_mapping = isinstance(event, yaml.MappingStartEvent)
        is_flow = bool(event.flow_style)
        found = Block(is_mapping, is_flow, start, end)
        stop = yaml.MappingEndEvent if is_mapping else yaml.SequenceEndEvent
        while not isinstance(event := next(self._events), stop):
            first = self._node(event, in_flow=is_flow)
            if is_mapping and isinstance(first, Scalar):
                node = self._node(next(self._events), in_flow=is_flow)
                found.entries.append(Entry(node, first))
            else:
                found.entries.append(Entry(first))
        last = found.entries[-1].node.end if found.entries else end
        found.end = _index(event.end_mark) if is_flow else last
        return found


def _index(mark: Any) -> int:
    return int(mark.index)


def _events(text: str) -> list[Any]:
    """Return the events of libyaml, unless PyYAML's own parser may see another place."""
    is_same = yaml.__with_libyaml__ and not LIBYAML_DIFFERS.search(text) and "?" not in text
    if is_same and not yaml.reader.Reader.NON_PRINTABLE.search(text):
        try:
            return list(yaml.parse(text, yaml.CSafeLoader))
        except yaml.YAMLError:
            pass
    return list(yaml.parse(text, yaml.SafeLoader))


class _Comments:
    """Gives each comment its place in the tree."""

    def __init__(self, source: Source, root: Node) -> None:
        self._source, self._text, self._root = source, source.text, root
        self._scalars: list[Scalar] = []
        self._collect(root)
        self._scalars.sort(key=lambda one: one.start)
        self._starts = [one.start for one in self._scalars]

    def _collect(self, node: Node) -> None:
        stack = [node]
        while stack:
            here = stack.pop()
            if isinstance(here, Scalar):
                self._scalars.append(here)
                continue
            for entry in here.entries:
                stack.append(entry.node)
                if entry.key is not None:
                    self._scalars.append(entry.key)

    def place(self) -> None:
        """Place blank lines and comments."""
        for block in _blocks(self._root):
            for entry in block.entries:
                entry.blank = self._is_blank_before(entry.start)
        if not isinstance(self._root, Block):
            return
        for start, text in self.in_headers():
            self._behind(start, text)
        scalar, least = -1, 0
        for start, text in self.between():
            if self._line_before(start).strip(" \t\ufeff"):
                self._behind(start, text)
                continue
            column = self._source.position(start)[1]
            if (before := bisect_right(self._starts, start)) == scalar:
                column = min(column, least)  # as deep as the comment before it, at most
            scalar, least = before, column
            self._alone(self._root, start, text, column)

    def _line_before(self, start: int) -> str:
        """Return the text before a comment in its line, without trailing white space."""
        return self._text[self._text.rfind("\n", 0, start) + 1 : start].rstrip()

    def in_headers(self) -> Iterator[tuple[int, str]]:
        """Yield the comments behind the signs `|` and `>`, with their places."""
        for scalar in self._scalars:
            header = HEADER.match(scalar.raw) if scalar.style in ("|", ">") else None
            if header is not None and header[3]:
                yield scalar.start + header.start(3), header[3].rstrip()

    def between(self) -> Iterator[tuple[int, str]]:
        """Yield all other comments, with their places."""
        at = 0
        for scalar in (*self._scalars, None):
            stop = len(self._text) if scalar is None else scalar.start
            for match in REMARK.finditer(self._text, at, stop):
                yield match.start(), match[0].rstrip()
            at = stop if scalar is None else max(at, scalar.end)

    def _is_blank_before(self, offset: int) -> bool:
        """Return whether a blank line precedes the line, if only indicators precede the offset."""
        line, column = self._source.position(offset)
        if self._source.line(line)[: column - 1].strip(" \t-?\ufeff") or line == 1:
            return False
        return not self._source.line(line - 1).strip()

    # --- comments at the end of a line ------------------------------------------------------------

    def _behind(self, start: int, text: str) -> None:
        """Give a comment to the innermost entry that its line belongs to."""
        line = self._line_before(start)
        last = self._text.rfind("\n", 0, start) + len(line)
        if not line.strip(" -?\ufeff"):  # its predecessor continues on the next lines
            self._alone(self._root, start, text, 0)
            return
        owner: Entry | None = None
        node: Node = self._root
        while isinstance(node, Block) and not (node.is_flow and last >= node.end - 1):
            found = _last_until(node, last)
            if found is None:
                break
            owner = found
            if last < found.node.start:
                break
            node = found.node
        gap = max(len(self._text[last + 1 : start].expandtabs()), LEAST_GAP)
        remark = " " * gap + text
        if isinstance(node, Block) and node.is_flow and node.start <= last < node.end - 1:
            node.opening.append(remark)
        elif owner is None:
            self._alone(self._root, start, text, 0)
        else:
            owner.behind.append(remark)

    # --- comments on lines of their own -----------------------------------------------------------

    def _alone(self, node: Node, start: int, text: str, column: int) -> None:
        block = _block(node)
        is_blank = self._is_blank_before(start)
        while True:
            entry = _last_until(block, start)
            following = _first_after(block, start)
            inner = None if entry is None else entry.node
            if entry is not None and start < entry.node.start and entry.key is not None:
                if isinstance(inner, Block) and not inner.is_flow and inner.entries:
                    return self._above(inner.entries[0], start, text, is_blank)
                return self._above(entry, start, text, is_blank)
            if isinstance(inner, Block) and inner.start <= start < inner.end:
                block = inner
                continue
            break
        if block.is_flow:
            if following is None:
                return self._end(block, start, text, is_blank)
            return self._above(following, start, text, is_blank)
        if following is not None and column <= self._column(following):
            return self._above(following, start, text, is_blank)
        deepest = _deepest(entry, column, self._column)
        if deepest is not None:
            return self._end(deepest, start, text, is_blank)
        if following is not None:
            return self._above(following, start, text, is_blank)
        return self._end(block, start, text, is_blank)

    def _column(self, entry: Entry) -> int:
        """Return the column of an entry: of its key, or of the sign before it."""
        line, column = self._source.position(entry.start)
        written = self._source.line(line)[: column - 1]
        if entry.key is None:
            return written.rfind("-") + 1 if "-" in written else column
        return column

    def _above(self, entry: Entry, start: int, text: str, is_blank: bool) -> None:
        if entry.top is None and not self._line_before(start).strip(" \t\ufeff"):
            entry.top = start
        if not entry.above:
            blank_behind = entry.blank
            entry.blank = is_blank
            entry.above += [text, ""] if blank_behind else [text]
            return
        closing = [""] if entry.above[-1] == "" else []
        above = entry.above[: len(entry.above) - len(closing)]
        entry.above = [*above, *([""] if is_blank else []), text, *closing]

    def _end(self, block: Block, start: int, text: str, is_blank: bool) -> None:
        block.bottom = start
        block.tail += ["", text] if is_blank else [text]


def _blocks(node: Node) -> Iterator[Block]:
    left = [node]
    while left:
        here = left.pop()
        if isinstance(here, Block):
            yield here
            left += [entry.node for entry in here.entries]


def _block(root: Node) -> Block:
    if not isinstance(root, Block):
        raise TypeError("a file of ours is a mapping")
    return root


def _last_until(block: Block, offset: int) -> Entry | None:
    """Return the last entry that starts at or before an offset."""
    at = bisect_right(block.entries, offset, key=lambda entry: entry.start)
    return block.entries[at - 1] if at else None


def _first_after(block: Block, offset: int) -> Entry | None:
    at = bisect_right(block.entries, offset, key=lambda entry: entry.start)
    return block.entries[at] if at < len(block.entries) else None


def _deepest(entry: Entry | None, column: int, column_of: Any) -> Block | None:
    """Return the innermost block at the end of an entry that a comment in a column belongs to."""
    found: Block | None = None
    node = None if entry is None or column == 1 else entry.node
    while isinstance(node, Block) and not node.is_flow and node.entries:
        if column_of(node.entries[0]) > column:
            break
        found, node = node, node.entries[-1].node
    return found
