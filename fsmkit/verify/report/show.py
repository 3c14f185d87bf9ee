"""Format verdicts and counterexamples as rich text."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import groupby

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from fsmkit.language.units import duration_text
from fsmkit.system.machine import Machine
from fsmkit.verify.report.counterexample import Counterexample, TraceStep
from fsmkit.verify.report.figures import count_text, quantity
from fsmkit.verify.report.sequence import sequence
from fsmkit.verify.report.sequences import terminal
from fsmkit.verify.report.verdict import Report, Result, Verdict
from fsmkit.verify.statespace.actions import Action
from fsmkit.verify.statespace.exploration import End, Exploration, Figures
from fsmkit.verify.statespace.storage import LossyTable, expected_omissions
from fsmkit.verify.statespace.symbolic_search import Diagram, explicit_only

STYLES = {
    Verdict.HOLDS: "bold green",
    Verdict.VIOLATED: "bold red",
    Verdict.UNDECIDED: "bold yellow",
}
MOST_COLUMNS = 160
MOST_STEPS = 400
"""More steps than that are not printed; the saved trace holds them all."""


def summary(report: Report, width: int = 0) -> RenderableType:
    """Return the report for a terminal of ``width`` columns (0: not a terminal)."""
    parts: list[RenderableType] = []
    for result in report.results:
        if result.trace is not None and result.verdict is Verdict.VIOLATED:
            drawn = diagram(report, result, width)
            parts += [drawn or counterexample(result), Text()]
    parts.append(verdicts(report))
    parts += figures(report)
    if report.exploration.end is End.TIME and report.spent:
        parts.append(Text(f"time: {', '.join(f'{k} {s:.1f} s' for k, s in report.spent.items())}"))
    return Group(*parts)


def verdicts(report: Report) -> Table:
    """Return a line for each property."""
    table = Table(box=None, show_header=False, pad_edge=False, padding=(0, 2, 0, 0))
    for result in report.results:
        word = Text(result.verdict.value.upper(), STYLES[result.verdict])
        claim = result.claim if result.text != result.name else ""
        if result.verdict is Verdict.HOLDS and result.trace is not None:
            claim += f" (in {quantity(len(result.trace.steps), 'step')})"
        if result.reason:
            claim += f": {result.reason}" if claim else result.reason
        table.add_row(word, Text(result.name, "bold"), Text(claim))
    return table


def figures(report: Report) -> Iterator[Text]:
    """Yield the size of the space, the used bounds, and the assumptions."""
    found = report.exploration
    if found.end is End.TIME and not found.states:
        return  # no exploration took place
    if found.diagram is not None:
        yield from _of_diagram(report, found, found.diagram)
        yield from _bounds(report)
        return
    spent = "less than 0.1 s"
    if found.seconds >= 0.1:
        spent = f"{found.seconds:.1f} s, {found.states / found.seconds:,.0f} states/s"
    whole = "all" if found.end is End.COMPLETE else "the first"
    whole = whole if found.table is None else "at least"
    engine = "generated C" if found.engine == "c" else "interpreter, in Python"
    engine += f", {found.cores} cores" if found.cores > 1 else ""
    engine += f", {found.traffic.ranks} ranks" if found.traffic is not None else ""
    states = quantity(found.states, "state")
    if report.closed.zones:
        states += f" ({quantity(found.zones, 'zone')})"
    yield Text(
        f"{whole} {states}, {quantity(found.transitions, 'transition')}, depth {found.depth}; "
        f"explored in {spent} ({engine})"
    )
    if found.traffic is not None and found.traffic.forwarded:
        traffic = found.traffic
        yield Text(
            f"{traffic.forwarded:,} states went to other ranks, in "
            f"{traffic.sent / traffic.forwarded:.1f} bytes each; "
            f"{traffic.filtered:,} had gone there recently",
            "dim",
        )
    if found.table is not None:
        yield _risk(found, found.table)
    yield from _bounds(report)


def _of_diagram(report: Report, found: Exploration, diagram: Diagram) -> Iterator[Text]:
    """Yield the size of a space that was stored as a diagram."""
    whole = "all" if found.end is End.COMPLETE else "the first"
    yield Text(
        f"{whole} {count_text(found.states)} states (saturation: {diagram.nodes:,} nodes, "
        f"{diagram.bytes / 1e6:,.0f} MB; order: {diagram.found_by}), "
        f"{count_text(found.transitions)} transitions, depth -; explored in {found.seconds:.1f} s"
    )
    for number, why in explicit_only(report.closed, [result.name for result in report.results]):
        name = report.closed.system.properties[number].name
        yield Text(f"{name}: explicit search, {count_text(found.explicit_states)} states ({why})")


def _bounds(report: Report) -> Iterator[Text]:
    """Yield the parameters, the used bounds, and the assumptions."""
    found = report.exploration
    if report.closed.system.parameters:
        given = (f"{name} = {value}" for name, value in report.closed.system.parameters)
        yield Text(f"with {', '.join(given)}")
    each = zip(report.closed.system.machines, found.machines, strict=True)
    for text, alike in groupby(each, lambda pair: _bounds_of(*pair)):
        machines = [machine for machine, _ in alike]
        yield Text(f"{_joint_name(machines)}: {text}", "dim")
    for assumption in report.assumptions:
        yield Text(f"assumed: {assumption}", "dim")


def _bounds_of(machine: Machine, bounds: Figures) -> str:
    capacities = machine.chart.capacities
    return (
        f"{quantity(bounds.locals, 'local state')}; at most {bounds.queue} of "
        f"{capacities.queue} events queued, {quantity(bounds.timers, 'timer')}, "
        f"{bounds.microsteps} of {capacities.microsteps} microsteps"
    )


def _joint_name(machines: Sequence[Machine]) -> str:
    """Return the names of consecutive machines: those of one array as a range."""
    names = []
    for array, of_array in groupby(machines, lambda m: m.place and m.place[0]):
        found = list(of_array)
        if array is None or len(found) == 1:
            names += [machine.name for machine in found]
        else:
            first, last = (machine.place[1] for machine in (found[0], found[-1]) if machine.place)
            names.append(f"{array}[{first}..{last}]")
    return ", ".join(names)


def _risk(found: Exploration, table: LossyTable) -> Text:
    match = table.match_probability
    omitted = expected_omissions(match, found.states)
    return Text(
        f"{table.storage.value} storage, a table of {table.bytes:,} bytes: a new state was taken "
        f"for a known one with probability at most {match:.2g}; at most {omitted:.2g} such states "
        "are to be expected, and besides what only they lead to"
    )


def diagram(report: Report, result: Result, width: int) -> RenderableType | None:
    """Return a counterexample as a sequence diagram; None if it is too wide or too long for one."""
    trace = result.trace
    if trace is None or not trace.steps or len(trace.steps) > MOST_STEPS:
        return None
    drawn = sequence(report.closed, result, trace)
    lines = terminal.draw(drawn, min(width, MOST_COLUMNS))
    if lines is None:
        return None
    parts: list[RenderableType] = [Text(_title(result), "bold red"), Text()]
    for line in lines:
        shown = Text(line.text, no_wrap=True, overflow="crop")
        for begin, end, style in line.styles:
            shown.stylize(style, begin, end)
        parts.append(shown)
    parts.append(Text())
    if drawn.idle:
        parts.append(Text(f"never move: {', '.join(drawn.idle)}", "dim"))
    parts += _how(trace)
    return Group(*parts)


def _how(trace: Counterexample) -> Iterator[Text]:
    if trace.replayed:
        shorter = "; there may be a shorter path" if trace.is_longer else ""
        yield Text(f"replayed in {' and in '.join(trace.replayed)}{shorter}", "dim")


def _title(result: Result) -> str:
    return f"{result.name}: {result.claim}" if result.text else result.name


def counterexample(result: Result) -> RenderableType:
    """Return a counterexample as a table: machine, cause, time, and sent messages."""
    trace = result.trace
    assert trace is not None  # noqa: S101  (asked for only where there is one)
    count = len(trace.steps)
    table = Table(
        title=Text(_title(result)), title_justify="left", title_style="bold red", box=None
    )
    for heading in ("step", "time", "machine", "what happens", "goes to", "sends"):
        table.add_column(heading, style="cyan" if heading == "time" else None)
    for number, end, step in _grouped(trace):
        if number > MOST_STEPS:
            break
        table.add_row(*_row(number, end, step))
        if trace.loop is not None and end == trace.loop:
            table.add_row("", "", "", Text("-- from here on, for ever --", "red"))
    lines: list[RenderableType] = [table]
    if count > MOST_STEPS:
        lines.append(Text(f"... and {count - MOST_STEPS} steps more (see --save-trace)"))
    lines += _how(trace)
    return Group(*lines)


def _grouped(trace: Counterexample) -> Iterator[tuple[int, int, TraceStep]]:
    """Yield each step with its first and last number; passing time is one row."""
    first = 0
    for number, step in enumerate(trace.steps, 1):
        following = trace.steps[number] if number < len(trace.steps) else None
        goes_on = (
            step.action is Action.ELAPSE
            and following is not None
            and following.action is Action.ELAPSE
            and number != trace.loop
        )
        first = first or number
        if not goes_on:
            yield first, number, step
            first = 0


def _row(number: int, end: int, step: TraceStep) -> list[str | Text]:
    span = str(number) if number == end else f"{number}-{end}"
    at = "" if step.at is None else duration_text(step.at)
    if step.action is Action.ELAPSE:
        return [span, at, "", Text(f"time passes, until {at}", "dim"), "", ""]
    left = [name for name in step.before if name not in step.after]
    entered = [name for name in step.after if name not in step.before]
    goes = ", ".join(entered) if entered or left else ""
    sent = "\n".join(f"{d.what} -> {d.target}" for d in step.deliveries)
    what = step.cause
    if step.chosen:
        what += f" [{', '.join(step.chosen)}]"
    style = "yellow" if step.action is Action.OCCUR else ""
    return [span, at, step.machine, Text(what, style), goes, sent]
