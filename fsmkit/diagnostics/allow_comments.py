"""Comments that suppress a rule: ``# fsmkit: allow RULE``, in XML ``<!-- fsmkit: allow RULE -->``.

A comment at the end of a line covers that line. A comment alone on a line covers the whole entry or
element below it. ``allow-file`` covers the file: it comes before the first key, or before the first
element within the root. A reason may follow the rules, after any character but a comma.
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
class AllowComment:
    """A rule that a comment suppresses, and the lines that the comment covers."""

    name: str
    """The name or the code of the rule, as written."""
    span: Span = field(compare=False)
    lines: tuple[int, int]
    """The first and the last line, both included.

    The range is empty if the comment is misplaced.
    """
    place: int
    """The offset of the name in its source."""
    file: str

    def hides(self, rule: Rule, line: int) -> bool:
        """Return whether the comment suppresses a finding of `rule` on `line`."""
        return self.name in (rule.name, rule.code) and self.lines[0] <= line <= self.lines[1]


USED: ContextVar[set[AllowComment] | None] = ContextVar("used", default=None)
"""The comments that suppressed a finding, while `record_used` is active."""


@contextmanager
def record_used() -> Iterator[set[AllowComment]]:
    """Collect the comments that suppress a finding while the block runs."""
    used: set[AllowComment] = set()
    token = USED.set(used)
    try:
        yield used
    finally:
        USED.reset(token)


def is_hidden(rule: Rule, span: Span) -> bool:
    """Return whether a comment suppresses `rule` at `span`."""
    found = allow_comments(span.source)
    if not found:
        return False
    line, _ = span.source.position(span.start)
    hiding = [one for one in found if one.hides(rule, line)]
    used = USED.get()
    if used is not None:
        used.update(hiding)
    return bool(hiding)


@lru_cache(maxsize=64)
def allow_comments(source: Source) -> tuple[AllowComment, ...]:
    """Return the allow comments of a source, one item for each rule that they name."""
    text = source.text
    if MARK not in text:
        return ()
    is_xml = text.lstrip("\ufeff \t\r\n").startswith("<")
    found: list[AllowComment] = []
    for match in (XML if is_xml else YAML).finditer(text):
        line = source.position(match.start())[0]
        before = text[text.rfind("\n", 0, match.start()) + 1 : match.start()]
        if match["file"]:
            is_first = (
                _is_first_in_xml(text, match.start()) if is_xml else _is_first(text, match.start())
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
            found.append(AllowComment(name[0], span, lines, first, source.name))
    return tuple(found)


def _is_first(text: str, offset: int) -> bool:
    """Return whether only comments and document markers precede `offset`."""
    lines = (line.strip("\ufeff \t\r") for line in text[:offset].split("\n"))
    return all(not line or line.startswith("#") or line == "---" for line in lines)


def _is_first_in_xml(text: str, offset: int) -> bool:
    tags = (tag[0] for tag in TAG.finditer(text[:offset]))
    return sum(not tag.startswith(("<!", "<?")) for tag in tags) <= 1


def _entry(lines: list[str], number: int) -> tuple[int, int]:
    """Return the first and last line of the YAML entry below a comment on line `number`.

    All lines count from one. The entry ends before the first line that is indented no further,
    except for the items of its list and its closing bracket.
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
    """Return the first and last line of the XML element after a comment."""
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
