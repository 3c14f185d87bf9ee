"""Queue, timer and microstep capacities that a check has proved to be sufficient."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

from fsmkit.chart.chart import Capacities, Chart
from fsmkit.chart.content import all_statements
from fsmkit.chart.statements import Destination, Send
from fsmkit.codegen.system.program import Program, program_of
from fsmkit.diagnostics import Findings, fail
from fsmkit.system.any_file import Model, explored_model
from fsmkit.system.deployment.deployment import Deployment
from fsmkit.system.system import System
from fsmkit.verify.explore import ExplorationOptions, check
from fsmkit.verify.report.figures import count_in_json, count_text
from fsmkit.verify.report.verdict import ENDS, Report
from fsmkit.verify.resources.time import Time
from fsmkit.verify.statespace.actions import FAULT, FULL
from fsmkit.verify.statespace.closed_system import UNLIMITED
from fsmkit.verify.statespace.exploration import End

MARKER = "/* Bounds and figures. */"


@dataclass(frozen=True, slots=True)
class BoundsProof:
    """The charts of a system with capacities that suffice for all machines that run them.

    ``assumed``: the assumptions of the proof, a line each.
    """

    charts: tuple[tuple[Chart, Chart], ...]
    assumed: tuple[str, ...]

    def of(self, chart: Chart) -> Chart | None:
        """Return a chart with its capacities; None if no machine runs it."""
        return next((small for own, small in self.charts if own == chart), None)


def with_bounds(model: Model, proof: BoundsProof) -> Model:
    """Return a model with the capacities that were proved for its charts.

    Raises `FsmkitError` (``bounds-not-proved``) for a chart that no machine of the proof runs.
    """
    match model:
        case Chart():
            found = proof.of(model)
            if found is None:
                raise fail(
                    "bounds-not-proved",
                    f"no machine of that system runs `{model.name}` as it is in this file",
                    help="name a system that does, or compile the system itself",
                )
            return found
        case System():
            machines = tuple(
                replace(machine, chart=proof.of(machine.chart) or machine.chart)
                for machine in model.machines
            )
            return replace(model, machines=machines)
        case Deployment():
            system = with_bounds(model.system, proof)
            return replace(model, system=system) if isinstance(system, System) else model


def prove_bounds(system: System, findings: Findings, options: ExplorationOptions) -> BoundsProof:
    """Explore a system and return the capacities that its machines need.

    Raises `FsmkitError` (``bounds-not-proved``) if the exploration is incomplete, or if a queue can
    overflow.
    """
    report = check(system, findings, options=options)
    _require_whole(report)
    found: dict[int, tuple[Chart, Capacities]] = {}
    charts = [machine.chart for machine in system.machines]
    for number, chart in enumerate(charts):
        first = charts.index(chart)
        needed = _needed_capacities(report, number)
        _, before = found.get(first, (chart, needed))
        found[first] = chart, _maximum(before, needed)
    return BoundsProof(
        tuple((own, replace(own, capacities=room)) for own, room in found.values()),
        tuple(_assumption(report)),
    )


def proved_program(
    model: Model,
    target: str,
    findings: Findings,
    options: Mapping[str, str],
    *,
    within: System | None = None,
    time: Time = "zones",
) -> Program:
    """Return the files of a model with bounds that a check proves (`program_of`).

    ``within``: the system in which a chart runs; without it the model is explored as it is. Raises
    `FsmkitError`: ``bounds-not-proved``; ``wrong-option`` for a target other than C.
    """
    if target != "c":
        raise fail(
            "wrong-option", "proved bounds are for the target `c`", help="compile without them"
        )
    checked = within or explored_model(model)
    proof = prove_bounds(checked, Findings(), ExplorationOptions(time=time))
    made = program_of(with_bounds(model, proof), target, findings, options)
    return replace(made, files=with_bounds_comment(made.files, proof.assumed))


def _require_whole(report: Report) -> None:
    found, closed = report.exploration, report.closed
    why = ""
    if found.end is not End.COMPLETE:
        why = f"{ENDS[found.end]} after {count_text(found.states)} states"
    elif found.table is not None:
        why = f"{found.table.storage.value} storage may miss states"
    elif closed.samples:
        why = f"only samples of {', '.join(closed.samples)} were tried"
    for number, machine in enumerate(closed.system.machines):
        first = closed.first_marks[number]
        if found.mark(first + FULL) is not None:
            why = why or f"a queue of `{machine.name}` can overflow"
        if found.mark(first + FAULT) is not None:
            why = why or f"`{machine.name}` can stop with a fault"
    if why:
        raise fail(
            "bounds-not-proved",
            f"the bounds of `{closed.system.name}` are not proved: {why}",
            help="run `fsmkit check` for the counterexample, or compile without `--bounds`",
        )


def _needed_capacities(report: Report, number: int) -> Capacities:
    """Return the capacities that a machine needs; never more than it has."""
    own_chart = report.closed.system.machines[number].chart
    own = own_chart.capacities
    if own_chart.invocations:
        return own  # invokers' queues are fullest during macrosteps; their rounds are bounded
    figures = report.exploration.machines[number]
    outside = any(
        possible.machine == number and not possible.spontaneous
        for possible in report.closed.possible
    )
    queue = figures.queue + (report.closed.max_pending + 1 if outside else 0)
    microsteps = own.microsteps if _sends_to_itself(own_chart) else figures.microsteps
    return replace(
        own,
        queue=min(own.queue, max(1, queue)),
        delayed=min(own.delayed, max(1, figures.timers)),
        microsteps=min(own.microsteps, max(1, microsteps)),
    )


def _sends_to_itself(chart: Chart) -> bool:
    """Whether one call of ``run`` may take more events than wait when it starts.

    The bound is then the number of microsteps, which must not be reduced.
    """
    return any(
        isinstance(statement, Send) and statement.destination is Destination.SELF
        for statement in all_statements(chart)
    )


def _maximum(one: Capacities, other: Capacities) -> Capacities:
    return replace(
        one,
        queue=max(one.queue, other.queue),
        delayed=max(one.delayed, other.delayed),
        microsteps=max(one.microsteps, other.microsteps),
    )


def _assumption(report: Report) -> Iterator[str]:
    closed, found = report.closed, report.exploration
    if closed.untimed:
        time = "timers fire at any time"
    elif closed.zones:
        time = "dense time"
    else:
        time = "discrete time" if closed.unit else "without delays"
    alone = "the chart alone, in an unrestricted environment" if closed.is_open else "this system"
    yield f"{closed.system.name}: {alone}; {time}; all {count_in_json(found.states)} states"
    if closed.max_pending != UNLIMITED:
        yield f"at most {closed.max_pending + 1} external events wait in a queue at once"
    yield from report.assumptions


def with_bounds_comment(
    files: Mapping[str, str | bytes], assumed: tuple[str, ...]
) -> dict[str, str | bytes]:
    """Return files whose headers say that their bounds are proved, and under which assumptions."""
    lines = "".join(f"\n *   {line.replace('*/', '* /')}" for line in assumed)
    told = "/* Bounds and figures. Proved to be enough are queue, delayed sends and microsteps, for"
    told += f"{lines} */"
    return {
        path: text.replace(MARKER, told, 1) if isinstance(text, str) else text
        for path, text in files.items()
    }
