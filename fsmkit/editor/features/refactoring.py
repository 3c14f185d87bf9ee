"""Refactorings, each verified in a copy of the workspace before it is offered.

Extracting a constant leaves the Plan equal. Extracting or inlining a function leaves it equal but
for the call. Any other change shows as a finding: a refactoring that causes an error, here or in a
dependent chart, is rejected.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from lsprotocol import types

from fsmkit.chart.chart import Chart
from fsmkit.diagnostics import Edit, Fix, Severity, Source, Span
from fsmkit.diagnostics.fixes import apply_edits, is_xml
from fsmkit.document.document import DocFunction
from fsmkit.editor.analysis import Analysis, analyse
from fsmkit.editor.context import Context
from fsmkit.editor.features.adding import declaration, escape_xml
from fsmkit.editor.index.chart_names import ChartNames
from fsmkit.editor.index.files import Kind
from fsmkit.language.statements.tree import Return

NUMBER = re.compile(r"(?<![\w.])\d+(?:\.\d+)?(us|ms|s|m|h|d)?(?![\w.]*\w)")
GUARD = re.compile(r"\b(?:if:[ \t]+|cond=)(?:\"([^\"]*)\"|'([^']*)'|([^\n,{}]*[^\s,{}]))")
CALL = re.compile(r"(?<![\w.])([A-Za-z_]\w*)\(([^()]*)\)")
WORD = re.compile(r"(?<![\w.])[A-Za-z_]\w*")
RANGE = re.compile(r"(-?\d+)\.\.(-?\d+)")
SIMPLE = re.compile(r"[A-Za-z_][\w.]*|-?\d+(?:\.\d+)?\w*")
MOVING = (
    "which of its data, events and operations stay, and which go with the states, "
    "is not written anywhere: declare the chart, and move them by hand"
)


@dataclass(frozen=True, slots=True)
class Refactoring:
    """A change with its edits, or why it cannot be."""

    title: str
    kind: types.CodeActionKind
    edits: tuple[Edit, ...] = ()
    refused: str = ""
    is_equal: bool = False
    """Whether the Plan must be the same."""

    def fix(self) -> Fix:
        """Return the edits as a fix."""
        return Fix(self.title, self.edits)


def refactorings(context: Context, path: Path, place: types.Range) -> Iterator[Refactoring]:
    """Yield the possible refactorings at a selection, and the impossible ones with the reason."""
    file, names = context.workspace.file(path), context.workspace.chart(path)
    lines = context.lines(path)
    if file is None or file.kind is not Kind.CHART or names is None or lines is None:
        return
    source = file.source
    start, end = lines.offset(place.start), lines.offset(place.end)
    for found in (
        _constant(source, names, start, end),
        _function(source, names, start, end),
        _inline(source, names, start, end),
    ):
        if found is not None:
            yield found if found.refused else _verify(context, path, found)
    if start < end and re.search(r"^\s*(?:<state|[\w\"']+:)", source.text[start:end], re.MULTILINE):
        for other in ("Move states to a used chart", "Move states to a base"):
            yield Refactoring(other, types.CodeActionKind.RefactorExtract, refused=MOVING)


def _verify(context: Context, path: Path, found: Refactoring) -> Refactoring:
    """Verify a refactoring; reject it if it causes an error or changes the Plan."""
    source = context.source(path)
    if source is None:
        return found
    trial = context.workspace.copy()
    trial.set_text(path, apply_edits(source.text, found.edits).encode())
    for one in (path, *context.workspace.dependents(path)):
        before, after = context.analyses.analysis(one), analyse(trial, one)
        known = {finding.message for finding in before.findings}
        for finding in after.findings:
            if finding.severity is Severity.ERROR and finding.message not in known:
                return Refactoring(found.title, found.kind, refused=finding.message)
    if found.is_equal and _plan(context.analyses.analysis(path)) != _plan(analyse(trial, path)):
        return Refactoring(found.title, found.kind, refused="the chart would mean something else")
    return found


def _plan(analysis: Analysis) -> str | None:
    from fsmkit.plan.lower import lower
    from fsmkit.plan.tree import plan_document

    if not isinstance(analysis.model, Chart):
        return None
    return json.dumps(plan_document(lower(analysis.model)), default=str)


def _unique(name: str, names: ChartNames) -> str:
    taken = {*names.values, *names.states, *names.events}
    numbered = (name if n == 1 else f"{name}_{n}" for n in range(1, len(taken) + 2))
    return next(one for one in numbered if one not in taken)


def _constant(source: Source, names: ChartNames, start: int, end: int) -> Refactoring | None:
    line = source.text.rfind("\n", 0, start) + 1
    for found in NUMBER.finditer(source.text, line, end + 40):
        if found.start() <= start and end <= found.end():
            name = _unique("DELAY" if found[1] else "CONSTANT", names)
            edits = declaration(source, "constants", name, found[0])
            title = f"Extract the constant `{name}`"
            if not edits:
                return None
            here = Edit(Span(source, *found.span()), name)
            kind = types.CodeActionKind.RefactorExtract
            return Refactoring(title, kind, (*edits, here), is_equal=True)
    return None


def _function(source: Source, names: ChartNames, start: int, end: int) -> Refactoring | None:
    line = source.text.rfind("\n", 0, start) + 1
    for found in GUARD.finditer(source.text, line, len(source.text)):
        if found.start() > end:
            break
        if not found.start() <= start <= end <= found.end():
            continue
        group = next(n for n in (1, 2, 3) if found[n] is not None)
        guard = found[group].strip()
        if is_xml(source):
            guard = guard.replace("&lt;", "<").replace("&gt;", ">").replace("&quot;", '"')
            guard = guard.replace("&amp;", "&")
        title = "Make the guard a function"
        if re.search(r"\b_?event\b", guard):
            reason = "it reads the event, which a function cannot do: pass the fields as arguments"
            return Refactoring(title, types.CodeActionKind.RefactorExtract, refused=reason)
        name = _unique("is_allowed", names)
        edits = declaration(source, "functions", f"{name}() -> bool", guard)
        here = Edit(Span(source, *found.span(group)), f"{name}()")
        return Refactoring(title, types.CodeActionKind.RefactorExtract, (*edits, here))
    return None


def _inline(source: Source, names: ChartNames, start: int, end: int) -> Refactoring | None:
    line = source.text.rfind("\n", 0, start) + 1
    for found in CALL.finditer(source.text, line, end + 200):
        if not found.start() <= start <= end <= found.end():
            continue
        symbol = names.values.get(found[1])
        declared = names.declared.get(symbol, []) if symbol is not None else []
        part = declared[-1].part if declared else None
        if not isinstance(part, DocFunction):
            return None
        title = f"Put the body of `{found[1]}` in place of the call"
        kind = types.CodeActionKind.RefactorInline
        given = [text.strip() for text in found[2].split(",")] if found[2].strip() else []
        body = part.body[0] if len(part.body) == 1 else None
        if not isinstance(body, Return):
            return Refactoring(title, kind, refused="its body is statements, and no expression")
        if (reason := _argument_mismatch(names, part, given)) is not None:
            return Refactoring(title, kind, refused=reason)
        values = dict(zip((one.name.value for one in part.parameters), given, strict=True))
        inner = _replaced(body.value.value, values)
        written = escape_xml(f"({inner})") if is_xml(source) else f"({inner})"
        return Refactoring(title, kind, (Edit(Span(source, *found.span()), written),))
    return None


def _replaced(text: str, values: Mapping[str, str]) -> str:
    return WORD.sub(lambda match: values.get(match[0], match[0]), text)


def _argument_mismatch(names: ChartNames, part: DocFunction, given: list[str]) -> str | None:
    """Return the reason why arguments cannot replace parameters, or None."""
    if len(given) != len(part.parameters):
        return "the call has another number of arguments"
    for text, parameter in zip(given, part.parameters, strict=True):
        if not SIMPLE.fullmatch(text):
            return f"the argument `{text}` is an expression, which the body may evaluate twice"
        symbol = names.values.get(text)
        type_ = None if symbol is None else names.types.get(symbol)
        wanted = "" if parameter.type is None else parameter.type.value.strip()
        bounds = RANGE.fullmatch(wanted)
        is_within = bounds is not None and text.lstrip("-").isdecimal()
        if is_within and bounds is not None and int(bounds[1]) <= int(text) <= int(bounds[2]):
            continue
        if type_ is None or type_.value.strip() != wanted:
            return f"`{text}` is not declared as `{wanted}`, so the call may change its value"
    return None
