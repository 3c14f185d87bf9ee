"""What was done in a session, as a script, a pytest, or a file of messages."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from fsmkit.diagnostics import FsmkitError, Source, Span, Text
from fsmkit.inspector.commands import wrong
from fsmkit.runtime.interpreter.snapshot import Macrostep
from fsmkit.runtime.interpreter.trace import trace_lines
from fsmkit.runtime.script import run_script
from fsmkit.runtime.system_session import SystemPlayer
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


def trace_of(file: str, script: Sequence[str], seed: int = 1) -> list[str]:
    """Return the trace of a chart or a system under a script; `FsmkitError` where it has none."""
    from fsmkit.diagnostics import Findings
    from fsmkit.system.reading import load_any

    return played(load_any(Path(file), Findings()), script, seed)


def played(system: System, script: Sequence[str], seed: int = 1) -> list[str]:
    """Return the trace of a system under a script; of one machine alone that of the machine."""
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
    """Return a script without what is written twice, if its trace is this one.

    `FsmkitError` (``wrong-command``) where no script does the same: an event came between two steps
    at one time, or an input of a system was set.
    """
    script = [line for n, line in enumerate(lines) if line != lines[n - 1] or not _is_time(line)]
    try:
        same = played(system, script, seed) == list(trace)
    except FsmkitError as error:
        raise _unscripted() from error
    if not same:
        raise _unscripted()
    return script


def _is_time(line: str) -> bool:
    return line.startswith("run ")


def _unscripted() -> FsmkitError:
    return wrong(
        "no script does what was done here",
        "a script posts when all is quiet, and sets inputs of a chart alone: save as `live`",
    )


def pytest_of(file: Path, script: Sequence[str], trace: Sequence[str], seed: int = 1) -> str:
    """Return a pytest that performs a script of a file again."""
    return PYTEST.format(
        file=repr(str(file.resolve())), seed=seed, script=_listed(script), trace=_listed(trace)
    )


def _listed(lines: Sequence[str]) -> str:
    return "[\n" + "".join(f"    {str.__str__(line)!r},\n" for line in lines) + "]"
