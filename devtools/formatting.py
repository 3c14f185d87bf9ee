"""The formatter on random charts: ``python -m devtools.formatting 1000``.

Each chart is written in YAML and SCXML, its layout is spoilt, and comments are put between its
lines. Formatted, it must read back as before, keep all comments, and stay as it is the next time.
"""

from __future__ import annotations

import re
import sys
from collections import Counter

import click

from devtools.random_charts.charts import random_document
from devtools.random_charts.choices import Choices, SeededChoices
from fsmkit.chart.elaborate import elaborate
from fsmkit.diagnostics import Findings, FsmkitError, Source
from fsmkit.document.document import Document
from fsmkit.editor.formatting import format_source
from fsmkit.plan.lower import lower
from fsmkit.plan.plan import Plan
from fsmkit.scxml.reader import read_document as read_scxml
from fsmkit.scxml.writer import write_document as write_scxml
from fsmkit.yaml.reader import read_document as read_yaml
from fsmkit.yaml.writer import write_document as write_yaml

BLOCK = re.compile(r"[|>][-+0-9]*$")
REMARK = re.compile(r"remark [0-9]+")
OPERATOR = re.compile(r" (==|<=|&&|\+|\*|=) ")


def spoilt_yaml(text: str, choices: Choices) -> str:
    """Return YAML with other blanks, blank lines and comments between its lines."""
    lines: list[str] = []
    literal = -1
    for number, written in enumerate(text.splitlines()):
        line = written
        margin = len(line) - len(line.lstrip())
        if literal >= 0 and line.strip() and margin <= literal:
            literal = -1
        if literal < 0 and choices.chance(15):
            lines += [""] * choices.integer(1, 2)
        if literal < 0 and choices.chance(20):
            lines.append(f"{' ' * choices.pick((margin, 0, margin + 2))}# remark {number}")
        if choices.chance(30) and literal < 0 and '"' not in line and "'" not in line:
            line = OPERATOR.sub(r"  \1   ", line)
        is_head = BLOCK.search(line) is not None
        if literal < 0 and choices.chance(10) and line.strip():
            line += f" # remark {number}000"
        lines.append(line)
        if literal < 0 and is_head:
            literal = margin
    return "\n".join(lines) + "\n"


def spoilt_xml(text: str, choices: Choices) -> str:
    """Return XML with blank lines and comments between its lines, and other margins."""
    lines: list[str] = []
    for number, line in enumerate(text.splitlines()):
        if number > 1 and line.lstrip().startswith("<") and lines[-1].endswith(">"):
            if choices.chance(20):
                lines.append(f"<!-- remark {number} -->")
            if choices.chance(20):
                lines += ["", ""]
        lines.append(line)
    return "\n".join(lines)


def problem(seed: int) -> str | None:
    """Return an error of the formatter on a random chart, or None."""
    choices = SeededChoices(f"format {seed}")
    document = random_document(choices, 16, has_functions=choices.chance(30))
    for name, write, read, spoil in (
        ("a.yaml", write_yaml, read_yaml, spoilt_yaml),
        ("a.scxml", write_scxml, read_scxml, spoilt_xml),
    ):
        try:
            written = write(document)
        except FsmkitError:  # one of the notations cannot express it
            continue
        text = spoil(written, choices)
        found = Findings()
        before = read(Source(name, text), found)
        if before is None:
            return f"{name} of {seed}: spoilt so that it cannot be read: {FsmkitError(found)}"
        try:
            made = format_source(text, name)
            again = format_source(made, name)
        except FsmkitError as error:
            return f"{name} of {seed}: {error}"
        if again != made:
            return f"{name} of {seed}: another layout the second time"
        if Counter(REMARK.findall(text)) != Counter(REMARK.findall(made)):
            return f"{name} of {seed}: a comment is lost"
        if _plan(before) != _plan(read(Source(name, made), Findings())):
            return f"{name} of {seed}: another plan"
    return None


def _plan(document: Document | None) -> Plan | None:
    if document is None:
        return None
    chart = elaborate((document,), Findings())
    return None if chart is None else lower(chart)


@click.command()
@click.argument("count", type=click.IntRange(min=1), default=1000)
def main(count: int) -> None:
    """Try so many charts."""
    problems = [found for seed in range(count) if (found := problem(seed)) is not None]
    sys.stdout.write("\n".join([*problems, f"{count} charts, {len(problems)} problems"]) + "\n")
    sys.exit(bool(problems))


if __name__ == "__main__":
    main()
