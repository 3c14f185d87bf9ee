"""Harnesses run every runtime by the same script and return its trace.

The harness of a target is the module of its name beside this one.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Protocol, runtime_checkable

from fsmkit.chart.chart import Chart
from fsmkit.chart.content import all_statements
from fsmkit.chart.statements import Send
from fsmkit.codegen.target import Target
from fsmkit.diagnostics import fail
from fsmkit.language import Literal
from fsmkit.plugins import plugins
from fsmkit.runtime.script import run_script

Jobs = Sequence[tuple[Chart, Sequence[str]]]
"""Charts, each with its script."""


@runtime_checkable
class Harnessed(Protocol):
    """A target of another package that brings a harness: the differential test then covers it."""

    name: str

    def harness_run(self, chart: Chart, script_lines: Sequence[str]) -> list[str]:
        """Generate, build and run a machine by a script; return its trace."""
        ...


class Harness(Protocol):
    """A runtime that can be driven by a script (see `fsmkit.runtime.script`)."""

    @property
    def name(self) -> str:
        """``interpreter``, or the name of a target."""
        ...

    def run(self, chart: Chart, script: Sequence[str]) -> list[str]:
        """Return the trace; `FsmkitError` where the chart cannot be expressed or built."""
        ...


@dataclass(frozen=True, slots=True)
class Runtime:
    """A harness that runs one script, or several at once."""

    name: str
    run_many: Callable[[Jobs], list[list[str]]]
    """Returns the trace of each job; `FsmkitError` if a chart cannot be expressed or built."""

    def run(self, chart: Chart, script: Sequence[str]) -> list[str]:
        """Run the chart by the script.

        Some charts never leave a moment of time. Only the interpreter ends them (``livelock``), so
        it runs these first.
        """
        if can_stand_still(chart):
            run_script(chart, script)
        (trace,) = self.run_many([(chart, script)])
        return trace


@dataclass(frozen=True, slots=True)
class _Interpreter:
    name: str = "interpreter"

    def run(self, chart: Chart, script: Sequence[str]) -> list[str]:
        return run_script(chart, script)


INTERPRETER: Harness = _Interpreter()
"""The reference."""


def can_stand_still(chart: Chart) -> bool:
    """Return whether a transition or a sent event may have a delay of 0."""
    sent = (s.delay for s in all_statements(chart) if isinstance(s, Send) and s.delay is not None)
    return any(t.has_timer and not t.delay for t in chart.transitions) or any(
        not (isinstance(delay, Literal) and delay.value) for delay in sent
    )


def harnesses() -> tuple[Harness, ...]:
    """Return the reference and a harness for each target that has one."""
    return (INTERPRETER, *_of_targets())


def _of_targets() -> Iterator[Runtime]:
    for target in plugins(Target):
        if isinstance(target, Harnessed):
            yield Runtime(target.name, _results_by(target))
        elif (Path(__file__).parent / f"{target.name}.py").is_file():
            yield Runtime(target.name, _all_by(f"{__package__}.{target.name}"))


def _results_by(target: Harnessed) -> Callable[[Jobs], list[list[str]]]:
    return lambda jobs: [list(target.harness_run(chart, script)) for chart, script in jobs]


def _all_by(module: str) -> Callable[[Jobs], list[list[str]]]:
    """Return the function ``run_many`` of a module, which is imported when it is called."""

    def run_many(jobs: Jobs) -> list[list[str]]:
        traces: list[list[str]] = import_module(module).run_many(jobs)
        return traces

    return run_many


def harness(name: str) -> Harness:
    """Return the harness of that name; `FsmkitError` that lists those there are."""
    found = {candidate.name: candidate for candidate in harnesses()}
    if name in found:
        return found[name]
    known = ", ".join(found)
    raise fail("unknown-plugin", f"nothing runs a chart as `{name}`", help=f"use {known}")
