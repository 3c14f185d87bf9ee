"""Format a comparison of two charts as text and as data."""

from __future__ import annotations

from collections.abc import Mapping

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from fsmkit.chart.chart import Chart
from fsmkit.diagnostics import Findings, Span
from fsmkit.language import Value
from fsmkit.language.values import show
from fsmkit.runtime.interpreter.snapshot import Occurrence, Start, Timeout
from fsmkit.verify.properties.refinement import Move, Refinement
from fsmkit.verify.properties.refinement_view import Shown
from fsmkit.verify.report.counterexample import leaves, occurrence_text
from fsmkit.verify.report.show import STYLES
from fsmkit.verify.report.verdict import Verdict


def verdict_of(found: Refinement) -> Verdict:
    """Return the verdict on "the chart refines its base"."""
    if found.violated:
        return Verdict.VIOLATED
    return Verdict.UNDECIDED if found.doubt else Verdict.HOLDS


def _claim(found: Refinement) -> str:
    return f"`{found.derived.name}` refines `{found.base.name}`"


def add_findings(found: Refinement, findings: Findings) -> None:
    """Add a violation, or the reason for an undecided verdict, to the findings."""
    span = _place(found)
    if found.violated:
        message = f"`{found.derived.name}` does what `{found.base.name}` cannot do"
        findings.add("no-refinement", message, span)
    elif found.doubt:
        findings.add("undecided", f"whether {_claim(found)} is undecided: {found.doubt}", span)


def _place(found: Refinement) -> Span:
    """Return the location of the first transition of the last step; without one, the chart's."""
    chart = found.derived
    steps = found.path[-1].done.microsteps if found.path else ()
    taken = [t for small in steps for t in small.transitions]
    return chart.transitions[taken[0]].span if taken else chart.states[0].span


def summary(found: Refinement) -> RenderableType:
    """Return the comparison for a terminal."""
    verdict = verdict_of(found)
    last = line(verdict, _claim(found), found.doubt)
    parts: list[RenderableType] = []
    if found.violated:
        parts += [_steps(found), Text(_why(found)), Text()]
    compared = (
        f"compared: {found.pairs:,} pairs of a state and the base's states, {found.steps:,} "
        f"steps; {found.seconds:.1f} s (interpreter, in Python)"
    )
    return Group(*parts, last, Text(compared, style="dim"), Text("untimed", style="dim"))


def line(verdict: Verdict, claim: str, doubt: str) -> Text:
    """Return the line of a verdict."""
    record = Text.assemble((verdict.value.upper(), STYLES[verdict]), f"  {claim}")
    return record.append(f": {doubt}") if doubt else record


def _steps(found: Refinement) -> Table:
    table = Table(box=None, pad_edge=False)
    for title in ("step", "what happens", "goes to", "the base sees"):
        table.add_column(title)
    for number, move in enumerate(found.path, 1):
        goes = ", ".join(leaves(found.derived, move.done.after))
        table.add_row(str(number), _cause(found.derived, move), goes, ", ".join(_seen(found, move)))
    return table


def _seen(found: Refinement, move: Move) -> list[str]:
    record = []
    for group in move.word:
        if group.stimulus is not None and move.done.event != group.stimulus.event:
            record.append(occurrence_text(found.base, group.stimulus.event))
        record += [_shown(found.base, shown) for shown in group.shown]
    before, after = move.done.before.data, move.done.after.data
    chart = found.derived
    for place, output in enumerate(chart.outputs, len(chart.data)):
        known = any(output.name == o.name for o in found.base.outputs)
        if known and before[place] != after[place]:
            tick = chart.capacities.tick
            record.append(f"{output.name} = {show(after[place], output.type, tick)}")
    return record


def _shown(base: Chart, shown: Shown) -> str:
    if not shown.is_operation:
        event = base.events[base.event_index[shown.name]]
        return occurrence_text(base, Occurrence(event.index, shown.values))
    (operation,) = [o for o in base.operations if o.name == shown.name]
    pairs = zip(operation.parameters, shown.values, strict=True)
    values: list[Value] = [value for _, value in pairs]
    tick = base.capacities.tick
    texts = [show(v, p.type, tick) for p, v in zip(operation.parameters, values, strict=True)]
    return f"{shown.name}({', '.join(texts)})"


def _cause(chart: Chart, move: Move) -> str:
    match move.done.event:
        case Start():
            return "start"
        case Timeout(transition):
            return f"timeout in {chart.states[chart.transitions[transition].source].id}"
        case Occurrence(event) if event >= len(chart.events):
            taken = move.done.microsteps[0].transitions[0]
            return f"spontaneously leaves {chart.states[chart.transitions[taken].source].id}"
        case Occurrence() as occurrence:
            return occurrence_text(chart, occurrence)
        case _:
            return "inputs changed"


def _why(found: Refinement) -> str:
    if not found.bases:
        return f"`{found.base.name}` does not start like that"
    places = {" and ".join(leaves(found.base, base)) for base in found.bases}
    return f"`{found.base.name}`, then in {' or in '.join(sorted(places))}, cannot do the last step"


def document(found: Refinement) -> Mapping[str, object]:
    """Return the comparison as data for JSON."""
    record: dict[str, object] = {
        "verdict": verdict_of(found).value,
        "derived": found.derived.name,
        "base": found.base.name,
        "time": "untimed",
        "pairs": found.pairs,
        "steps": found.steps,
        "seconds": round(found.seconds, 3),
    }
    if found.doubt:
        record["reason"] = found.doubt
    if found.violated:
        record["reason"] = _why(found)
        record["trace"] = [
            {
                "event": _cause(found.derived, move),
                "to": list(leaves(found.derived, move.done.after)),
                "seen": _seen(found, move),
            }
            for move in found.path
        ]
    return record
