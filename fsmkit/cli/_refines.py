"""``fsmkit check DERIVED --refines BASE``: the comparison, and what is told of it."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from rich.console import Group, RenderableType
from rich.progress import Progress, SpinnerColumn, TextColumn
from rich.table import Table
from rich.text import Text

from fsmkit.chart.chart import Chart
from fsmkit.cli._options import Reading
from fsmkit.cli.console import err, print_json, report, result
from fsmkit.diagnostics import Findings, Span, fail
from fsmkit.language import Value
from fsmkit.language.values import show
from fsmkit.loading import load_with_findings
from fsmkit.runtime.interpreter.snapshot import Occurrence, Start, Timeout
from fsmkit.system.reader import is_system_file
from fsmkit.verify.properties.refinement import Move, Refinement, refines
from fsmkit.verify.properties.refinement_view import Shown
from fsmkit.verify.report.counterexample import leaves, occurrence_text
from fsmkit.verify.report.show import STYLES
from fsmkit.verify.report.verdict import Verdict
from fsmkit.verify.resources.deadline import Deadline, Stage, TimeUp


def compare(file: Path, base: Path, deadline: Deadline, reading: Reading, *, as_json: bool) -> int:
    """Compare two charts, tell what was found, and return the exit code."""
    findings = reading.findings()
    try:
        charts = deadline.cut_off(
            Stage.READING,
            lambda: [chart_alone(path, findings, strict=reading.strict) for path in (file, base)],
        )
    except TimeUp:
        claim, why = f"`{file.name}` refines `{base.name}`", deadline.why()
        findings.add("undecided", f"whether {claim} is undecided: {why}", None)
        report(findings)
        if as_json:
            print_json({"verdict": Verdict.UNDECIDED.value, "reason": why})
        else:
            result.print(_line(Verdict.UNDECIDED, claim, why))
        return 1
    columns = SpinnerColumn(), TextColumn("{task.description}")
    hidden = not err.is_terminal or as_json
    with Progress(*columns, console=err.console, transient=True, disable=hidden) as bar:
        task = bar.add_task(f"comparing {charts[0].name}")

        def progress(pairs: int, steps: int, _: int) -> None:
            told = f"comparing {charts[0].name}: {pairs:,} pairs, {steps:,} steps"
            bar.update(task, description=told)

        found = refines(*charts, deadline=deadline, progress=progress)
    _tell(found, findings)
    report(findings)
    if as_json:
        print_json(_document(found))
    else:
        result.print(_summary(found))
    return int(_verdict(found) is not Verdict.HOLDS or findings.has_errors)


def chart_alone(path: Path, findings: Findings, *, strict: bool = False) -> Chart:
    """Load a chart that is compared, which may be abstract."""
    if is_system_file(path):
        raise fail(
            "not-a-chart",
            f"`{path}` is a system: only charts are refined",
            help="name the chart of one of its machines",
        )
    own = Findings()
    chart = load_with_findings(path, own, strict=strict)
    findings.extend(d for d in own if d.rule.name != "abstract-chart")
    return chart


def _verdict(found: Refinement) -> Verdict:
    if found.violated:
        return Verdict.VIOLATED
    return Verdict.UNDECIDED if found.doubt else Verdict.HOLDS


def _claim(found: Refinement) -> str:
    return f"`{found.derived.name}` refines `{found.base.name}`"


def _tell(found: Refinement, findings: Findings) -> None:
    span = _place(found)
    if found.violated:
        message = f"`{found.derived.name}` does what `{found.base.name}` cannot do"
        findings.add("no-refinement", message, span)
    elif found.doubt:
        findings.add("undecided", f"whether {_claim(found)} is undecided: {found.doubt}", span)


def _place(found: Refinement) -> Span:
    """Return where the first transition of the last step stands; without one, the chart."""
    chart = found.derived
    steps = found.path[-1].done.microsteps if found.path else ()
    taken = [t for small in steps for t in small.transitions]
    return chart.transitions[taken[0]].span if taken else chart.states[0].span


def _summary(found: Refinement) -> RenderableType:
    verdict = _verdict(found)
    line = _line(verdict, _claim(found), found.doubt)
    parts: list[RenderableType] = []
    if found.violated:
        parts += [_steps(found), Text(_why(found)), Text()]
    compared = (
        f"compared: {found.pairs:,} pairs of a state and what the base may be in, {found.steps:,} "
        f"steps; {found.seconds:.1f} s (interpreter, in Python)"
    )
    return Group(*parts, line, Text(compared, style="dim"), Text("untimed", style="dim"))


def _line(verdict: Verdict, claim: str, doubt: str) -> Text:
    line = Text.assemble((verdict.value.upper(), STYLES[verdict]), f"  {claim}")
    return line.append(f": {doubt}") if doubt else line


def _steps(found: Refinement) -> Table:
    table = Table(box=None, pad_edge=False)
    for title in ("step", "what happens", "goes to", "the base sees"):
        table.add_column(title)
    for number, move in enumerate(found.path, 1):
        goes = ", ".join(leaves(found.derived, move.done.after))
        table.add_row(str(number), _cause(found.derived, move), goes, ", ".join(_seen(found, move)))
    return table


def _seen(found: Refinement, move: Move) -> list[str]:
    told = []
    for group in move.word:
        if group.stimulus is not None and move.done.event != group.stimulus.event:
            told.append(occurrence_text(found.base, group.stimulus.event))
        told += [_shown(found.base, shown) for shown in group.shown]
    before, after = move.done.before.data, move.done.after.data
    chart = found.derived
    for place, output in enumerate(chart.outputs, len(chart.data)):
        known = any(output.name == o.name for o in found.base.outputs)
        if known and before[place] != after[place]:
            tick = chart.capacities.tick
            told.append(f"{output.name} = {show(after[place], output.type, tick)}")
    return told


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
        case Occurrence() as occurrence:
            return occurrence_text(chart, occurrence)
        case _:
            return "inputs changed"


def _why(found: Refinement) -> str:
    if not found.bases:
        return f"`{found.base.name}` does not start like that"
    places = {" and ".join(leaves(found.base, base)) for base in found.bases}
    return f"`{found.base.name}`, then in {' or in '.join(sorted(places))}, cannot do the last step"


def _document(found: Refinement) -> Mapping[str, object]:
    told: dict[str, object] = {
        "verdict": _verdict(found).value,
        "derived": found.derived.name,
        "base": found.base.name,
        "time": "untimed",
        "pairs": found.pairs,
        "steps": found.steps,
        "seconds": round(found.seconds, 3),
    }
    if found.doubt:
        told["reason"] = found.doubt
    if found.violated:
        told["reason"] = _why(found)
        told["trace"] = [
            {
                "event": _cause(found.derived, move),
                "to": list(leaves(found.derived, move.done.after)),
                "seen": _seen(found, move),
            }
            for move in found.path
        ]
    return told
