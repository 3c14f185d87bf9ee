"""Comments that allow a rule: ``# fsmkit: allow RULE``, in XML ``<!-- fsmkit: allow RULE -->``.

At the end of a line such a comment is about that line; alone on a line it is about the whole entry
or element below it. ``allow-file`` before the first key, or the first element within the root, is
about the file. Behind the rules, after another sign than a comma, there may be a reason.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field
from functools import lru_cache

from fsmkit.diagnostics.rules import Rule
from fsmkit.diagnostics.source import Source, Span

NAMES = r"(?P<file>-file)?[ \t]+(?P<names>[\w-]+(?:[ \t]*,[ \t]*[\w-]+)*)"
YAML = re.compile(rf"(?:^|(?<=[ \t]))#[ \t]*fsmkit:[ \t]*allow{NAMES}[^\n]*", re.MULTILINE)
XML = re.compile(rf"<!--[ \t]*fsmkit:[ \t]*allow{NAMES}[^\n]*?-->")
MARK = "fsmkit:"
NAME = re.compile(r"[\w-]+")
TAG = re.compile(
    r"""<!--.*?-->|<\?.*?\?>|<!\[CDATA\[.*?\]\]>|<(?:[^>"']|"[^"]*"|'[^']*')*>""", re.DOTALL
)
LAST_LINE = 1 << 60


@dataclass(frozen=True, slots=True)
class Allow:
    """A rule that a comment allows, and the lines that it is about."""

    name: str
    """A name or a code of a rule, as written."""
    span: Span = field(compare=False)
    lines: tuple[int, int]
    """The first and the last; none where the comment stands in a wrong place."""
    place: int
    """The offset of the name in its source."""
    file: str

    def hides(self, rule: Rule, line: int) -> bool:
        """Whether a finding of a rule on a line is hidden."""
        return self.name in (rule.name, rule.code) and self.lines[0] <= line <= self.lines[1]


USED: ContextVar[set[Allow] | None] = ContextVar("used", default=None)
"""The comments that have hidden something, while that is counted."""


@contextmanager
def counting() -> Iterator[set[Allow]]:
    """Collect the comments that hide something."""
    used: set[Allow] = set()
    token = USED.set(used)
    try:
        yield used
    finally:
        USED.reset(token)


def is_hidden(rule: Rule, span: Span) -> bool:
    """Whether a comment allows a rule at a place."""
    found = allows(span.source)
    if not found:
        return False
    line, _ = span.source.position(span.start)
    hiding = [one for one in found if one.hides(rule, line)]
    used = USED.get()
    if used is not None:
        used.update(hiding)
    return bool(hiding)


@lru_cache(maxsize=64)
def allows(source: Source) -> tuple[Allow, ...]:
    """Return the comments of a text that allow rules, one for each rule."""
    text = source.text
    if MARK not in text:
        return ()
    is_xml = text.lstrip("\ufeff \t\r\n").startswith("<")
    found: list[Allow] = []
    for match in (XML if is_xml else YAML).finditer(text):
        line = source.position(match.start())[0]
        before = text[text.rfind("\n", 0, match.start()) + 1 : match.start()]
        if match["file"]:
            is_first = (
                _is_first_of_xml(text, match.start()) if is_xml else _is_first(text, match.start())
            )
            lines = (1, LAST_LINE) if is_first else (0, -1)
        elif before.strip():
            lines = (line, line)
        elif is_xml:
            lines = _element(source, match.end())
        else:
            lines = _entry(text.split("\n"), line)
        start = match.start("names")
        for name in NAME.finditer(match["names"]):
            first = start + name.start()
            span = Span(source, first, first + len(name[0]))
            found.append(Allow(name[0], span, lines, first, source.name))
    return tuple(found)


def _is_first(text: str, offset: int) -> bool:
    """Whether only comments and marks of a document stand before an offset."""
    lines = (line.strip("\ufeff \t\r") for line in text[:offset].split("\n"))
    return all(not line or line.startswith("#") or line == "---" for line in lines)


def _is_first_of_xml(text: str, offset: int) -> bool:
    tags = (tag[0] for tag in TAG.finditer(text[:offset]))
    return sum(not tag.startswith(("<!", "<?")) for tag in tags) <= 1


def _entry(lines: list[str], number: int) -> tuple[int, int]:
    """Return the lines of the entry below a comment on a one-based line.

    It goes on as long as lines are further right, or are the list or the bracket that it ends in.
    """
    first = number
    while first < len(lines) and (not lines[first].strip() or lines[first].lstrip()[0] == "#"):
        first += 1
    if first == len(lines):
        return 0, -1
    margin, is_item = _margin(lines[first]), _is_item(lines[first])
    last = first
    for at in range(first + 1, len(lines)):
        line = lines[at]
        if not line.strip():
            continue
        is_end = line.lstrip()[0] in "]}" or (_is_item(line) and not is_item)
        if _margin(line) < margin or (_margin(line) == margin and not is_end):
            break
        last = at
    return first + 1, last + 1


def _margin(line: str) -> int:
    return len(line) - len(line.lstrip(" "))


def _is_item(line: str) -> bool:
    return line.lstrip() == "-" or line.lstrip().startswith("- ")


def _element(source: Source, offset: int) -> tuple[int, int]:
    """Return the lines of the element behind a comment."""
    depth, first = 0, 0
    for tag in TAG.finditer(source.text, offset):
        if tag[0].startswith(("<!", "<?")):
            continue
        is_end = tag[0].startswith("</")
        if is_end and not depth:
            return 0, -1
        first = first or source.position(tag.start())[0]
        depth += -1 if is_end else 0 if tag[0].endswith("/>") else 1
        if not depth:
            return first, source.position(tag.end())[0]
    return 0, -1
