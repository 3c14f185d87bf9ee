"""Reports of YAML syntax errors in terms of the typed text: indentation, tabs, quotes."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass

import yaml

from fsmkit.diagnostics import Edit, Findings, Fix, Source, Span
from fsmkit.yaml.layout import quoted

TAB = re.compile(r" *(\t+)")
TABS = re.compile(r"^ *(\t+)", re.MULTILINE)
UNSPACED = re.compile(r"([\w.*-]+):(?![\s:/])(.+)")
"""A key and its value without the blank that YAML requires between them."""
NEXT_KEY = re.compile(r",\s*[\w.-]+\s*:\s")
"""The end of a value within braces."""
UNDASHED = re.compile(r"-([^\s\->0-9].*)")
LAST_WORD = re.compile(r"\s(\w+)$")
LONGEST_KEY = 1024
"""Characters of a key before its colon (YAML 1.2, 7.4.3)."""
MOST_LINES = 500
"""At most this many lines before a misplaced line are searched."""


@dataclass(frozen=True, slots=True)
class _Line:
    """A line that is not blank: the column of its text, and its indentation."""

    source: Source
    number: int
    indent: int

    @property
    def is_empty(self) -> bool:
        """Return whether the line contains only a comment."""
        return self.source.line(self.number).lstrip()[:1] in ("", "#")

    def text_before(self, column: int) -> str:
        """Return the text before a column."""
        return self.source.line(self.number)[: column - 1]

    @property
    def span(self) -> Span:
        """The location of its first character."""
        start = self.source.offset(self.number, self.indent + 1)
        return Span(self.source, start, start + 1)


def _line(source: Source, number: int) -> _Line:
    text = source.line(number)
    return _Line(source, number, len(text) - len(text.lstrip(" ")))


def _position(source: Source, mark: yaml.Mark) -> tuple[int, int]:
    """Return line and column, from 1, of a mark; PyYAML counts more line ends than there are."""
    return source.position(min(mark.index, len(source.text)))


def report_broken(source: Source, error: yaml.MarkedYAMLError, findings: Findings) -> None:
    """Report a syntax error of the YAML parser."""
    mark = error.problem_mark or error.context_mark
    offset = min(mark.index if mark else 0, len(source.text))
    number, column = source.position(offset)
    line_at = _line(source, number)
    if _is_long_key(line_at, findings):
        return
    if _is_tab(line_at, findings) or _is_unspaced(line_at, error, findings):
        return
    if _is_misplaced(line_at, column, error, findings) or _is_open(source, error, offset, findings):
        return
    problem = error.problem or ""
    advice = "check indentation, quotes and brackets around this location"
    line = source.line(number)
    if "mapping values are not allowed" in problem and ": " in line:
        key, _, rest = line.strip().partition(": ")
        advice = f"a text with `: ` must be quoted: `{key}: {quoted(rest)}`"
    elif problem.startswith("expected ',' or"):
        text = _value_at(line, column - 1)
        advice = "inside `{}` and `[]` a text with one of `, [ ] { }` must be quoted"
        advice += f": `{quoted(text)}`" if text else ""
    elif problem.startswith("expected <block end>, but found"):
        advice = "do not mix items of a list, which start with `- `, and keys"
    elif "cannot start any token" in problem and "\\t" not in problem:
        advice = "a text that starts with this character must be quoted"
    elif "\t" in line or "\\t" in problem:
        advice = "YAML is separated by blanks: write one for the tab"
    what = ", ".join(part for part in (error.context, problem) if part)
    findings.add("broken-yaml", what, Span(source, offset, offset + 1), help=advice)


def _is_long_key(line_at: _Line, findings: Findings) -> bool:
    """Report a line whose key is longer than YAML allows."""
    text = line_at.source.line(line_at.number)
    length = text.find(":") - line_at.indent
    if length <= LONGEST_KEY:
        return False
    findings.add(
        "broken-yaml",
        f"a key has {length:,} characters; YAML allows {LONGEST_KEY:,}",
        line_at.span,
        help="choose a shorter name",
    )
    return True


def _is_tab(line_at: _Line, findings: Findings) -> bool:
    """Report a tab in the indentation of a line."""
    match = TAB.match(line_at.source.line(line_at.number))
    if match is None:
        return False
    start = line_at.source.offset(line_at.number, match.start(1) + 1)
    findings.add(
        "broken-yaml",
        "YAML is indented with blanks; here is a tab",
        Span(line_at.source, start, start + len(match[1])),
        help="fix: write two blanks for each tab",
        fixes=_untabbed(line_at.source),
    )
    return True


def _is_unspaced(line_at: _Line, error: yaml.MarkedYAMLError, findings: Findings) -> bool:
    """Report a line whose colon or dash has no blank after it, or is missing.

    YAML reads it as a text that continues in the next line, and rejects the colon there.
    """
    problem = error.problem or ""
    if "could not find expected ':'" in problem and error.context_mark:
        line = _line(line_at.source, _position(line_at.source, error.context_mark)[0])
    elif "mapping values are not allowed" in problem:
        above = next(_before(line_at, 1), None)
        if above is None or above.indent > line_at.indent:
            return False
        line = above
    else:
        return False
    text = line_at.source.line(line.number).strip()
    if (unspaced := UNSPACED.fullmatch(text)) is not None:
        message, wanted = "a blank is missing after the colon", f"{unspaced[1]}: {unspaced[2]}"
        advice = f"write `{wanted}`"
    elif (undashed := UNDASHED.fullmatch(text)) is not None:
        message, wanted = "a blank is missing after the dash", f"- {undashed[1]}"
        advice = f"write `{wanted}`"
    elif ":" not in text and not text.startswith("- "):
        message, advice = f"`{text}` is no entry", f"write `key: value`, such as `chart: {text}`"
        findings.add("broken-yaml", message, line.span, help=advice)
        return True
    else:
        return False
    start = line.span.start
    place = Span(line_at.source, start, start + len(text))
    fix = Fix(f"Write `{wanted}`", (Edit(place, wanted),), is_sure=True)
    findings.add("broken-yaml", message, place, help=advice, fixes=(fix,))
    return True


def _is_open(source: Source, error: yaml.MarkedYAMLError, offset: int, findings: Findings) -> bool:
    """Report an unclosed bracket or quote, a missing comma, or a connection in braces."""
    problem, start = error.problem or "", error.context_mark
    if "quoted scalar" in (error.context or "") and start:
        opening = Span(source, start.index, start.index + 1)
        findings.add(
            "broken-yaml", "this quote is not closed", opening,
            help=f"close it with `{source.text[start.index]}` at the end of the text",
        )  # fmt: skip
        return True
    if not problem.startswith("expected ',' or") or start is None:
        return False
    inside = source.text[start.index : offset]
    number, first = _position(source, start)
    line = source.line(number)
    if line.count('"') % 2:
        quote = source.offset(number, line.rindex('"') + 1)
        findings.add(
            "broken-yaml", "a quote is not closed, or one too many", Span(source, quote, quote + 1),
            help='each text has a `"` before and behind it',
        )  # fmt: skip
        return True
    opening = Span(source, start.index, start.index + 1)
    if "\n" in inside:
        closing = "}" if source.text[start.index] == "{" else "]"
        findings.add(
            "broken-yaml", f"this `{source.text[start.index]}` is not closed", opening,
            secondary=[(Span(source, offset, offset + 1), "another value starts here")],
            help=f"close it with `{closing}` at the end of its line",
        )  # fmt: skip
        return True
    if "->" in line and line.lstrip().startswith("- {") and ": " not in inside:
        wire = line[first - 1 :].strip().strip("{}")
        findings.add(
            "broken-yaml", "a connection is a text: write it without braces", opening,
            help=f"write `- {wire}`",
        )  # fmt: skip
        return True
    if (word := LAST_WORD.search(inside)) is not None and source.text[offset : offset + 1] == ":":
        at = start.index + word.start(1)
        findings.add(
            "broken-yaml", f"a comma is missing before `{word[1]}:`",
            Span(source, at, at + len(word[1])), help=f"write `, {word[1]}:`",
            fixes=(Fix("Put a comma", (Edit(Span(source, at - 1, at - 1), ","),)),),
        )  # fmt: skip
        return True
    return False


def _value_at(line: str, column: int) -> str:
    """Return the value within braces around a column, or an empty string."""
    start = line.rfind(": ", 0, column) + 2
    if start <= 1:
        return ""
    depth = 0
    for place in range(start, len(line)):
        depth += (line[place] in "[{(") - (line[place] in "]})")
        if depth < 0 or (depth == 0 and NEXT_KEY.match(line, place)):
            return line[start:place].strip()
    return line[start:].strip()


def _is_misplaced(
    line_at: _Line, column: int, error: yaml.MarkedYAMLError, findings: Findings
) -> bool:
    """Report a line with an indentation that no entry before it has.

    It starts where the parser expected the end of a block, or continues the value of the line
    before although it has a key.
    """
    problem = error.problem or ""
    starts_here = column == line_at.indent + 1
    if problem.startswith("expected <block end>") and starts_here and error.context_mark:
        number, start = _position(line_at.source, error.context_mark)
        block = _Line(line_at.source, number, start - 1)
        candidates = [*_before(line_at, block.number), block]
    elif "mapping values are not allowed" in problem and ": " not in line_at.text_before(column):
        candidates = list(_before(line_at, 1))[:1]
    else:
        return False
    known = [line for line in candidates if line.indent != line_at.indent]
    if not known:
        return False
    near = min(known, key=lambda line: abs(line.indent - line_at.indent))
    findings.add(
        "broken-yaml",
        f"this line is indented by {line_at.indent}, the entries before it by {near.indent}",
        line_at.span,
        secondary=[(near.span, "an entry before it")],
        help=f"fix: indent it by {near.indent}, or as far as the entries it belongs to",
        fixes=_indented(line_at, near.indent),
    )
    return True


def _untabbed(source: Source) -> tuple[Fix, ...]:
    """Return the fix that writes blanks for all tabs in indentations."""
    edits = tuple(
        Edit(Span(source, match.start(1), match.end(1)), "  " * len(match[1]))
        for match in TABS.finditer(source.text)
    )
    return (Fix("Write two blanks for each tab", edits),)


def _indented(line_at: _Line, indent: int) -> tuple[Fix, ...]:
    """Return the fix that changes the indentation of a line."""
    start = line_at.source.offset(line_at.number)
    edit = Edit(Span(line_at.source, start, start + line_at.indent), " " * indent)
    return (Fix(f"Indent it by {indent}", (edit,)),)


def _before(line_at: _Line, first: int) -> Iterator[_Line]:
    """Yield the lines before `line_at` down to line `first`, nearest first, without comments."""
    for number in range(line_at.number - 1, max(first, line_at.number - MOST_LINES) - 1, -1):
        line = _line(line_at.source, number)
        if not line.is_empty:
            yield line
