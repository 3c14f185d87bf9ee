"""Harnesses: every runtime under the same script, giving the same trace."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

from fsmkit.chart.chart import Chart
from fsmkit.chart.content import all_statements
from fsmkit.chart.statements import Send
from fsmkit.codegen.target import Target
from fsmkit.diagnostics import fail
from fsmkit.language import Literal
from fsmkit.plugins import plugins
from fsmkit.runtime.script import run_script


@runtime_checkable
class Harnessed(Protocol):
    """A target that brings a harness: what makes the differential test cover it."""

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
    """The harness of the interpreter, or of a target."""

    name: str
    runner: Callable[[Chart, Sequence[str]], list[str]]
    target: object = None
    """The plug-in; None for the interpreter."""

    def run(self, chart: Chart, script: Sequence[str]) -> list[str]:
        """Run the chart by the script."""
        return self.runner(chart, script)


INTERPRETER = Runtime("interpreter", run_script)
"""The reference."""


def _of_target(target: Harnessed) -> Runtime:
    def run(chart: Chart, script: Sequence[str]) -> list[str]:
        # A circle of timers without delay ends in the interpreter (``livelock``) and nowhere else,
        # so a chart that can have one runs there first.
        if can_stand_still(chart):
            run_script(chart, script)
        return list(target.harness_run(chart, script))

    return Runtime(target.name, run, target)


def can_stand_still(chart: Chart) -> bool:
    """Whether a delay of 0 may be waited for: by a transition, or by what is sent."""
    sent = (s.delay for s in all_statements(chart) if isinstance(s, Send) and s.delay is not None)
    return any(t.has_timer and not t.delay for t in chart.transitions) or any(
        not (isinstance(delay, Literal) and delay.value) for delay in sent
    )


def harnesses() -> tuple[Harness, ...]:
    """Return the reference and a harness for each target that brings one."""
    return (INTERPRETER, *map(_of_target, plugins(Harnessed)))


def target_harnesses() -> tuple[Harness, ...]:
    """Return the reference and a harness for each target, not for each way it can write."""
    targets = {target.name for target in plugins(Target)}
    return tuple(h for h in harnesses() if h.name == "interpreter" or h.name in targets)


def harness(name: str) -> Harness:
    """Return the harness of that name; `FsmkitError` that lists those there are."""
    if name == INTERPRETER.name:
        return INTERPRETER
    found = {candidate.name: candidate for candidate in harnesses()}
    if name in found:
        return found[name]
    known = ", ".join(found)
    raise fail("unknown-plugin", f"nothing runs a chart as `{name}`", help=f"use {known}")
