"""One small chart, with and without the priced part."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory

from benchmarks.comparison.tools import UnavailableError
from fsmkit.chart.loading import load
from fsmkit.codegen.target import Target
from fsmkit.diagnostics import Findings
from fsmkit.plugins import plugin

PLAIN = """\
chart: Pump
events: {in: [start, stop, late, check]}
data: {starts: uint16 = 0}
initial: idle
states:
  idle:
    on: {start: {target: pumping, do: starts += 1}}
  pumping:
    on: {stop: idle, late: idle}
"""
TIMED = PLAIN.replace("late: idle}", "late: idle}\n    after: {10s: idle}")
CALLING = PLAIN.replace("data:", "operations: [motor(on bool)]\ndata:").replace(
    "  pumping:\n", "  pumping:\n    entry: motor(true)\n    exit: motor(false)\n"
)
MACHINE = ("init", "start", "dispatch")
"""What every host calls."""
ALONE = re.compile(r"^ *if \(m->fsm\.busy\) \{\n[^\n]*\n *\}\n", re.MULTILINE)
"""A test of the guard alone, with its body."""


@dataclass(frozen=True, slots=True)
class Program:
    """A machine in use: its files, the called functions, and the body of a cycle."""

    files: Mapping[str, str]
    sources: tuple[str, ...]
    calls: tuple[str, ...]
    """What the host calls, so that the linker keeps it."""
    turn: str
    """C that is done again and again, with the machine ``m``."""
    events: int = 1
    """In a turn."""
    macros: tuple[str, ...] = ()

    def doing(self, turn: str, events: int = 1) -> Program:
        """Return the same machine with another turn."""
        return replace(self, turn=turn, events=events)

    def calling(self, *calls: str) -> Program:
        """Return the same machine with a host that calls more functions."""
        return replace(self, calls=(*self.calls, *calls))


def dispatched(*events: str) -> str:
    """Return a turn that dispatches events."""
    return " ".join(f"give(PUMP_EVENT_{event.upper()});" for event in events)


TAKEN = dispatched("start", "stop")


def pump(text: str, *, without: Sequence[str] = (), extras: Sequence[str] = ()) -> Program:
    """Return the machine of a chart, built without some parts and with some others."""
    options = {"without": ",".join(without), "with": ",".join(extras)}
    with TemporaryDirectory(prefix="fsmkit-") as folder:
        path = Path(folder) / "pump.yaml"
        path.write_text(text, encoding="utf-8")
        chart = load(path)
    findings = Findings()
    made = plugin(Target, "c").generate(chart, findings, {k: v for k, v in options.items() if v})
    if made is None or findings.has_errors:
        raise UnavailableError("; ".join(finding.message for finding in findings))
    return Program(made.files, ("pump.c", "fsm.c"), MACHINE, TAKEN, 2)


def unguarded(program: Program) -> Program:
    """Return a machine without the guard against calls from within a step, cut out of its text.

    There is no such option: a host that breaks the rule would break the machine.
    """
    text = ALONE.sub("", program.files["pump.c"])
    for tested in ("m->fsm.busy || ", " || m->fsm.busy", " && !m->fsm.busy"):
        text = text.replace(tested, "")
    text = "\n".join(line for line in text.split("\n") if "m->fsm.busy = " not in line)
    if "busy" in text:
        raise UnavailableError("the guard of the generated code has another form than is known")
    header = "\n".join(line for line in program.files["pump.h"].split("\n") if "busy;" not in line)
    return replace(program, files={**program.files, "pump.c": text, "pump.h": header})
