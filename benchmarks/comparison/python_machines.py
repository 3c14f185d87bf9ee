"""Machines in Python that run a chart: by hand and by fsmkit; how a machine is run and compared."""

from __future__ import annotations

import importlib.util
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Any

from benchmarks.comparison.c_machines import chart_of
from benchmarks.comparison.tools import UnavailableError
from benchmarks.yardstick.by_hand.chart_a import ChartA
from benchmarks.yardstick.by_hand.chart_b import ChartB
from benchmarks.yardstick.by_hand.chart_c import ChartC
from benchmarks.yardstick.model import FNV_OFFSET, Digests, digest, mix
from benchmarks.yardstick.streams import Stream
from fsmkit.codegen.target import Target
from fsmkit.diagnostics import Findings, FsmkitError
from fsmkit.plugins import plugin

BY_HAND: dict[str, Callable[[], ChartA | ChartB | ChartC]] = {"A": ChartA, "B": ChartB, "C": ChartC}


@dataclass(frozen=True, slots=True)
class Run:
    """A machine that has been started."""

    prepare: Callable[[bytes], Sequence[Any]]
    """Look up what a host would hold anyway: a bound method, a number or a name for each event."""
    send: Callable[[Any], object] | None
    """Takes one of what was prepared; None if that is called itself."""
    values: Callable[[], list[int]]
    """All variables in the order of the digest; the first is ``n``."""

    def feed(self, prepared: Sequence[Any]) -> None:
        """Process events; only this part is timed."""
        send = self.send
        if send is None:
            for call in prepared:
                call()
        else:
            for event in prepared:
                send(event)


@dataclass(frozen=True, slots=True)
class Contender:
    """A machine that can be started as often as needed."""

    name: str
    kind: str
    start: Callable[[], Run]
    has_history: bool = True
    """If not, its chart is entered by default where the history would be."""


def did(run: Run, events: bytes) -> tuple[str, str]:
    """Run events one by one; return the digests of the work and of the path."""
    path = FNV_OFFSET
    for event in run.prepare(events):
        run.feed((event,))
        path = mix(path, run.values()[0] & 0xFF)
    return digest(run.values()), f"{path:08x}"


def is_correct(contender: Contender, events: bytes, expected: Digests) -> bool:
    """Return whether a machine behaves like the model."""
    return did(contender.start(), events) == (expected.work, expected.path)


def import_file(path: Path, name: str) -> ModuleType:
    """Return a module of a file; `UnavailableError` if it is not there."""
    spec = importlib.util.spec_from_file_location(name, path)
    if spec is None or spec.loader is None or not path.is_file():
        raise UnavailableError(f"there is no module {path}")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def by_hand(stream: Stream, kind: str) -> Contender:
    """Return the hand-written match/case machine, which receives numbers of events."""

    def start() -> Run:
        machine = BY_HAND[stream.letter]()
        return Run(list, machine.send, machine.data.values)

    return Contender("match/case", kind, start)


def by_fsmkit(
    file: Path, stream: Stream, work: Path, kind: str, target: str = "python"
) -> Contender:
    """Return the generated machine of a chart file; each event calls a method.

    ``target``: ``python``, or ``pyext`` for the generated C as an extension module.
    """
    chart = chart_of(file)
    findings = Findings()
    try:
        made = plugin(Target, target).generate(chart, findings, {"build": "on"})
    except FsmkitError as error:  # no compiler, or no headers of Python
        raise UnavailableError(f"{target}: {error}") from error
    if made is None or findings.has_errors:
        raise UnavailableError("; ".join(finding.message for finding in findings))
    if made.built:
        ((module, content),) = made.built.items()
    else:
        ((module, text),) = made.files.items()
        content = text.encode()
    path = work / target / module
    path.parent.mkdir(exist_ok=True)
    path.unlink(missing_ok=True)  # a file that is loaded must not be written over
    path.write_bytes(content)
    # an extension module is known by its own name, a module of Python by any
    name = f"generated_{stream.letter}" if not made.built else module.partition(".")[0]
    machine_class = getattr(import_file(path, name), chart.name)

    def start() -> Run:
        machine = machine_class()
        machine.start(0)
        calls = [getattr(machine, f"dispatch_{name}") for name in stream.names]
        return Run(
            lambda events: [calls[event] for event in events],
            None,
            lambda: [getattr(machine, name) for name in stream.variables],
        )

    return Contender("fsmkit" if target == "python" else f"fsmkit, {target}", kind, start)
