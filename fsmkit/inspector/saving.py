"""Save a session as a script, a pytest, a test in C, or a sequence diagram."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from fsmkit.diagnostics import FsmkitError, Source, Span, Text
from fsmkit.inspector.commands import wrong
from fsmkit.inspector.sequences import as_mermaid
from fsmkit.inspector.simulation import SimulationStep
from fsmkit.inspector.system_at import Course
from fsmkit.inspector.testing import c_test
from fsmkit.runtime.interpreter.snapshot import Macrostep
from fsmkit.runtime.interpreter.trace import CLOCK, trace_lines
from fsmkit.runtime.script import run_script
from fsmkit.runtime.system_session import SystemPlayer, machine_of
from fsmkit.system.system import System

PYTEST = '''"""Saved from a session: performs it again, and compares the trace."""

from fsmkit.inspector.saving import trace_of

FILE = {file}
SEED = {seed}
SCRIPT = {script}
TRACE = {trace}


def test_it_does_so_again() -> None:
    assert trace_of(FILE, SCRIPT, SEED) == TRACE
'''


KINDS = ("script", "pytest", "c", "sequence", "live")


@dataclass(frozen=True, slots=True)
class RecomputedSession:
    """A recomputed course: a client's actions as script lines, and the trace."""

    script: list[str]
    trace: list[str]


def recompute(course: Course) -> RecomputedSession:
    """Recompute the branch in view; raises `FsmkitError` if its steps are unknown.

    Time advances in the script before an action, and for the first step after it.
    """
    branch, simulation, teller = course.history.branch, course.simulation, course.encoder
    if branch.first:
        raise wrong("the first steps are forgotten", "save as `live`")
    seed = simulation.seed
    script = [f"seed {seed}"] if teller.is_alone and seed != 1 else []
    trace: list[str] = []
    moment, is_started, waits, last = course.moment(0), False, False, 0
    for n in range(1, branch.head + 1):
        if n in branch.actions:
            moment, by = branch.moments.get(n), branch.actions[n]
            if is_started and (not waits or by.at > last):
                script.append(f"run {by.at % CLOCK}")
            script += by.line.splitlines()
            waits, last = True, by.at
            name = machine_of(simulation.names, by.line.split()[1])
            machine = "" if teller.is_alone else f"{name}: "
            trace += [f"{machine}full queue"] if by.is_refused else []
            continue
        done: SimulationStep | None
        if n <= branch.given:
            moment, done = branch.moments.get(n), branch.steps.get(n)
        elif moment is not None:
            moment, done = simulation.step(moment)
        if moment is None or done is None:
            raise wrong(f"the step at entry {n} is not known", "save as `live`")
        at = done.macrostep.at
        if not is_started:
            script.append(f"start {at % CLOCK}" if teller.is_alone else "start")
        if waits or not is_started:
            script.append(f"run {at % CLOCK}")
        is_started, waits, last = True, False, at
        trace += _lines(course, done)
    return RecomputedSession(script, trace)


def _lines(course: Course, done: SimulationStep) -> Iterable[str]:
    lines = trace_lines(course.simulation.charts[done.machine], (done.macrostep,))
    name = course.simulation.names[done.machine]
    return lines if course.encoder.is_alone else (f"{name}: {line}" for line in lines)


def saved(course: Course, kind: str, file: Path | None, now: int) -> str:
    """Return the branch in view in a format; ``now``: the time at its end in ticks.

    Raises `FsmkitError` for an unknown format, and if the format cannot express the session.
    """
    if kind not in KINDS:
        raise wrong(f"nothing is saved as `{kind}`", f"use {', '.join(KINDS)}")
    if kind == "sequence":
        return as_mermaid(course)
    if kind != "script" and file is None:
        raise wrong("no test can name the file of this session", "save as `script`")
    if kind == "c" and file is not None:
        return c_test(course, file)
    system, seed = course.simulation.system, course.simulation.seed
    made = recompute(course)
    script = script_of(system, [*made.script, f"run {now % CLOCK}"], made.trace, seed)
    if kind == "script":
        return "".join(f"{line}\n" for line in script)
    assert file is not None  # noqa: S101  (for the type checker)
    return pytest_of(file, script, made.trace, seed)


def trace_of(file: str, script: Sequence[str], seed: int = 1) -> list[str]:
    """Return the trace of a chart or a system under a script; `FsmkitError` where it has none."""
    from fsmkit.diagnostics import Findings
    from fsmkit.system.any_file import read, system_within

    return script_trace(system_within(read(file, Findings())), script, seed)


def script_trace(system: System, script: Sequence[str], seed: int = 1) -> list[str]:
    """Return the trace of a system under a script; a single machine has no prefix."""
    if system.is_open and len(system.machines) == 1:
        return run_script(system.machines[0].chart, script)
    player = SystemPlayer(system, seed)
    charts = {machine.name: machine.chart for machine in system.machines}
    lines = []
    for text in script:
        at = Span(Source("<script>", text), 0, len(text))
        for name, done in player.play(Text(text, at)):
            told = trace_lines(charts[name], (done,)) if isinstance(done, Macrostep) else (done,)
            lines += [f"{name}: {line}" for line in told]
    return lines


def script_of(
    system: System, lines: Sequence[str], trace: Sequence[str], seed: int = 1
) -> list[str]:
    """Return a script without redundant lines, if it gives the same trace.

    Raises `FsmkitError` (``wrong-command``) if no script does: an event arrived between two steps
    at one time, or an input of a system was set.
    """
    script = [line for n, line in enumerate(lines) if line != lines[n - 1] or not _is_time(line)]
    try:
        same = script_trace(system, script, seed) == list(trace)
    except FsmkitError as error:
        raise _unscripted() from error
    if not same:
        raise _unscripted()
    return script


def _is_time(line: str) -> bool:
    return line.startswith("run ")


def _unscripted() -> FsmkitError:
    return wrong(
        "no script can express this session",
        "a script posts when all is quiet, and sets inputs of a chart alone: save as `live`",
    )


def pytest_of(file: Path, script: Sequence[str], trace: Sequence[str], seed: int = 1) -> str:
    """Return a pytest that performs a script of a file again."""
    return PYTEST.format(
        file=repr(str(file.resolve())),
        seed=seed,
        script=_python_list(script),
        trace=_python_list(trace),
    )


def _python_list(lines: Sequence[str]) -> str:
    return "[\n" + "".join(f"    {str.__str__(line)!r},\n" for line in lines) + "]"
