"""Why a text is no YAML, in terms of what was typed: indentation, tabs, quotes."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass

import yaml

from fsmkit.diagnostics import Edit, Findings, Fix, Source, Span
from fsmkit.yaml.layout import quoted

TAB = re.compile(r" *(\t+)")
TABS = re.compile(r"^ *(\t+)", re.MULTILINE)
MOST_LINES = 500
"""So many lines before a misplaced one are looked at."""


@dataclass(frozen=True, slots=True)
class _Line:
    """A line that holds something: where its text begins, and how far it is indented."""

    source: Source
    number: int
    indent: int

    @property
    def is_empty(self) -> bool:
        """Whether there is nothing but a comment."""
        return self.source.line(self.number).lstrip()[:1] in ("", "#")

    def text_before(self, column: int) -> str:
        """Return what stands before a column."""
        return self.source.line(self.number)[: column - 1]

    @property
    def span(self) -> Span:
        """The place of its first character."""
        start = self.source.offset(self.number, self.indent + 1)
        return Span(self.source, start, start + 1)


def _line(source: Source, number: int) -> _Line:
    text = source.line(number)
    return _Line(source, number, len(text) - len(text.lstrip(" ")))


def tell_broken(source: Source, error: yaml.MarkedYAMLError, findings: Findings) -> None:
    """Report why the parser gave up."""
    mark = error.problem_mark or error.context_mark
    offset = min(mark.index if mark else 0, len(source.text))
    number, column = source.position(offset)
    here = _line(source, number)
    if _is_tab(here, findings) or _is_misplaced(here, column, error, findings):
        return
    problem = error.problem or ""
    advice = "check indentation, quotes and brackets around this place"
    line = source.line(number)
    if "mapping values are not allowed" in problem and ": " in line:
        key, _, rest = line.strip().partition(": ")
        advice = f"a text with `: ` must be quoted: `{key}: {quoted(rest)}`"
    elif problem.startswith("expected ',' or"):
        advice = "inside `{}` and `[]` a text with one of `, [ ] { }` must be quoted"
    elif "cannot start any token" in problem and "\\t" not in problem:
        advice = "a text that begins with this character must be quoted"
    elif "\t" in line or "\\t" in problem:
        advice = "YAML is separated by blanks: write one for the tab"
    what = ", ".join(part for part in (error.context, problem) if part)
    findings.add("broken-yaml", what, Span(source, offset, offset + 1), help=advice)


def _is_tab(here: _Line, findings: Findings) -> bool:
    """Report a tab in the indentation of a line."""
    match = TAB.match(here.source.line(here.number))
    if match is None:
        return False
    start = here.source.offset(here.number, match.start(1) + 1)
    findings.add(
        "broken-yaml",
        "YAML is indented with blanks; here is a tab",
        Span(here.source, start, start + len(match[1])),
        help="fix: write two blanks for each tab",
        fixes=_untabbed(here.source),
    )
    return True


def _is_misplaced(
    here: _Line, column: int, error: yaml.MarkedYAMLError, findings: Findings
) -> bool:
    """Report a line whose indentation is that of no entry before it.

    Either it begins where the parser expected the end of a block, or it continues the value of
    the line before though it has a key of its own.
    """
    problem = error.problem or ""
    starts_here = column == here.indent + 1
    if problem.startswith("expected <block end>") and starts_here and error.context_mark:
        block = _Line(here.source, error.context_mark.line + 1, error.context_mark.column)
        candidates = [*_before(here, block.number), block]
    elif "mapping values are not allowed" in problem and ": " not in here.text_before(column):
        candidates = list(_before(here, 1))[:1]
    else:
        return False
    known = [line for line in candidates if line.indent != here.indent]
    if not known:
        return False
    near = min(known, key=lambda line: abs(line.indent - here.indent))
    findings.add(
        "broken-yaml",
        f"this line is indented by {here.indent}, the entries before it by {near.indent}",
        here.span,
        secondary=[(near.span, "an entry before it")],
        help=f"fix: indent it by {near.indent}, or as far as the entries it belongs to",
        fixes=_indented(here, near.indent),
    )
    return True


def _untabbed(source: Source) -> tuple[Fix, ...]:
    """Return the fix that writes blanks for all tabs in indentations."""
    edits = tuple(
        Edit(Span(source, match.start(1), match.end(1)), "  " * len(match[1]))
        for match in TABS.finditer(source.text)
    )
    return (Fix("Write two blanks for each tab", edits),)


def _indented(here: _Line, indent: int) -> tuple[Fix, ...]:
    """Return the fix that moves a line."""
    start = here.source.offset(here.number)
    edit = Edit(Span(here.source, start, start + here.indent), " " * indent)
    return (Fix(f"Indent it by {indent}", (edit,)),)


def _before(here: _Line, first: int) -> Iterator[_Line]:
    """Yield the lines before, nearest first, from that number on, that hold more than a comment."""
    for number in range(here.number - 1, max(first, here.number - MOST_LINES) - 1, -1):
        line = _line(here.source, number)
        if not line.is_empty:
            yield line
