"""The source offset of each character of a YAML scalar.

Quotes, escapes, folding and indentation make the value of a scalar differ from its source. These
functions follow the rules of YAML 1.2 (5.7, 6.5, 7.3, 8.1) and return the offset of each character,
so that a finding inside a guard or a statement points at the exact word.
"""

from __future__ import annotations

import re

from fsmkit.diagnostics import Span

QUOTES = ("'", '"')
FOLDED_BREAK = re.compile(r"[ \t]*(?:\r\n?|[\n\x85\u2028\u2029])[ \t]*")
ESCAPE = re.compile(r"\\(?:x[0-9a-fA-F]{2}|u[0-9a-fA-F]{4}|U[0-9a-fA-F]{8}|.)", re.DOTALL)
ESCAPED_BREAK = re.compile(r"\\(?:\r\n?|[\n\x85\u2028\u2029])[ \t]*")


def offsets_of(span: Span, value: str, style: str | None) -> tuple[int, ...] | None:
    """Return the offset of each character of a scalar's value; None if the source is literal.

    ``style`` is the scalar's: None (plain), ``'``, ``"``, ``

    `` or ``>``.
    """
    source = span.source.text
    if style is None and source.startswith(value, span.start):
        return None
    inner = span.start + 1
    if style in QUOTES and source.startswith(value, inner) and "\\" not in value:
        return tuple(range(inner, inner + len(value)))
    if style in ("|", ">"):
        found = _in_block(span, value)
    else:
        end = span.end - (style in QUOTES)
        found = _in_flow(source, span.start + (style in QUOTES), end, style)
    if len(found) == len(value):
        return tuple(found)
    return (span.start,) * len(value)  # the scalar as a whole: rough, but not wrong


def _in_flow(source: str, at: int, end: int, style: str | None) -> list[int]:
    """Scan a plain or quoted scalar: line breaks fold, escapes encode characters."""
    found: list[int] = []
    while at < end:
        if style == '"' and (match := ESCAPED_BREAK.match(source, at, end)):
            at = match.end()
            at = _breaks(source, at, end, found)
        elif style == '"' and (match := ESCAPE.match(source, at, end)):
            found.append(at)
            at = match.end()
        elif style == "'" and source.startswith("''", at):
            found.append(at)
            at += 2
        elif match := FOLDED_BREAK.match(source, at, end):
            more: list[int] = []
            at = _breaks(source, match.end(), end, more)
            found += more or [match.start()]
        else:
            found.append(at)
            at += 1
    return found


def _breaks(source: str, at: int, end: int, found: list[int]) -> int:
    """Scan further line breaks, each of which is a new line of the value."""
    while match := FOLDED_BREAK.match(source, at, end):
        found.append(at)
        at = match.end()
    return at


def _in_block(span: Span, value: str) -> list[int]:
    """Scan a block scalar: its lines in order, without indentation, perhaps folded."""
    source = span.source.text
    lines: list[tuple[int, str]] = []
    at = source.find("\n", span.start) + 1
    while 0 < at < span.end:
        end = source.find("\n", at)
        lines.append((at, source[at : len(source) if end < 0 else end].removesuffix("\r")))
        at = end + 1
    walk = _literal if source[span.start] == "|" else _folded
    found = walk(lines, value)
    return found + [max(span.start, span.end - 1)] * (len(value) - len(found))


def _literal(lines: list[tuple[int, str]], value: str) -> list[int]:
    found: list[int] = []
    for (at, line), wanted in zip(lines, value.split("\n"), strict=False):
        if not line.endswith(wanted):
            return []
        end = at + len(line)
        found += range(end - len(wanted), end + 1)
    return found[: len(value)]


def _folded(lines: list[tuple[int, str]], value: str) -> list[int]:
    found: list[int] = []
    filled = [line for _, line in lines if line.strip()]
    if not filled:
        return found
    first = value.lstrip("\n")
    margin = _indent(filled[0]) - _indent(first)
    for at, line in lines:
        content = line[margin:]
        if not content.strip():
            continue
        if found:
            found.append(at - 1)  # the line break before it, folded into a space or kept
        while not value.startswith(content, len(found)):
            if not value.startswith("\n", len(found)):
                return found
            found.append(at - 1)
        found += range(at + margin, at + len(line))
    return found


def _indent(line: str) -> int:
    return len(line) - len(line.lstrip(" "))
