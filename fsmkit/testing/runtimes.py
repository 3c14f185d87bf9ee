"""Generated Python and C, as `running.Runtime`: the steps of a test, with its results."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, Protocol

from fsmkit.chart.chart import Chart, Operation
from fsmkit.codegen.python.family import Member
from fsmkit.codegen.python.loading import load_machine
from fsmkit.diagnostics import Source, Span, Text
from fsmkit.language import Value
from fsmkit.testing.coverage.counters import coverage_in_bytes
from fsmkit.testing.coverage.record import ChartCoverage
from fsmkit.testing.harness.python import HarnessMachine, MethodHost
from fsmkit.testing.running import Runtime

TARGETS = ("python", "c")


class Counted(Protocol):
    """A machine with counters, which it shares with all machines of its class."""

    chart: Chart

    def coverage(self) -> tuple[ChartCoverage, ...]:
        """Return its coverage."""


def coverage_of_machines(machines: Iterable[Counted]) -> list[ChartCoverage]:
    """Return the coverage of the machines that one call of `runtime` created."""
    by_class = {id(machine.chart): machine for machine in machines}
    return [each for machine in by_class.values() for each in machine.coverage()]


class _Host(MethodHost):
    """A host whose operations return the interpreter's results."""

    def __init__(self, family: Member) -> None:
        super().__init__(family)
        self.answers: dict[str, list[Value]] = {}

    def answer(self, operation: Operation, *_: object) -> Any:
        """Return the next result; the minimum for a call that the interpreter did not make."""
        left = self.answers.get(operation.name)
        return left.pop(0) if left else super().answer(operation)


class _Generated:
    """A generated machine that is driven from Python."""

    def __init__(
        self, name: str, driven: type[HarnessMachine], made: type[Any], chart: Chart
    ) -> None:
        self.name = name
        self._hosts: list[_Host] = []
        self.chart = chart
        self._driven = driven(chart, made, traced=True, host=self._host)

    def _host(self, family: Member) -> _Host:
        self._hosts.append(_Host(family))
        return self._hosts[-1]

    def coverage(self) -> tuple[ChartCoverage, ...]:
        """Return the counters of the machine, which was built with counting."""
        return coverage_in_bytes(self._driven.coverage(), self.name, (self.chart,))

    def do(self, line: str, answers: Mapping[str, Sequence[Value]]) -> list[str]:
        """Do a line of a script and return the lines of its trace."""
        if not line.startswith("dump"):
            self._hosts[-1].answers = {name: list(values) for name, values in answers.items()}
        self._driven.told.clear()
        self._driven.obey(Text(line, Span(Source("<test>", line), 0, len(line))))
        return list(self._driven.told)


def runtime(target: str, counted: list[Counted] | None = None) -> Callable[[Chart], Runtime]:
    """Return a constructor of machines of a target: ``python``, or ``c`` as an extension module.

    Each chart is generated and built once. Raises `FsmkitError` if the target cannot express it,
    or no compiler is available.

    Args:
        target: The target.
        counted: Collects the created machines, which then count coverage.

    """
    classes: dict[int, tuple[Chart, type[Any]]] = {}
    covered = counted is not None

    def kept(machine: _Generated) -> _Generated:
        if counted is not None:
            counted.append(machine)
        return machine

    def make(chart: Chart) -> Runtime:
        if target == "python":
            if id(chart) not in classes:
                classes[id(chart)] = chart, load_machine(chart, traced=True, covered=covered)
            return kept(
                _Generated("generated Python", HarnessMachine, classes[id(chart)][1], chart)
            )
        from fsmkit.testing.harness.pyext import HarnessExtension, load_class

        if id(chart) not in classes:
            classes[id(chart)] = chart, load_class(chart, traced=True, covered=covered)
        return kept(_Generated("generated C", HarnessExtension, classes[id(chart)][1], chart))

    return make
