"""Machines for tests in Python: sessions whose operations need no host, with recorded calls."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

from fsmkit.chart.chart import Chart, Operation, every_operation
from fsmkit.diagnostics import Findings
from fsmkit.language.values import to_python
from fsmkit.runtime.host_methods import find
from fsmkit.runtime.interpreter.snapshot import Called, InvokedMacrostep, Macrostep
from fsmkit.runtime.session import Session
from fsmkit.system.any_file import read_chart
from fsmkit.testing.coverage.record import Recorder


def make_machine(
    path: Path, operations: object = None, recorder: Recorder | None = None, **more: Any
) -> Session:
    """Return a session of a chart's file.

    Args:
        path: A chart.
        operations: See `Session`; missing ones return the first value of their ``from`` list, else
            the minimum of their type.
        recorder: Counts the coverage.
        more: Other arguments of `Session`.

    Raises:
        FsmkitError: If the chart cannot be read.

    """
    chart = read_chart(path, Findings())
    if recorder is not None:
        recorder.add(chart)
    if recorder is None:
        return Session(chart, _whole(chart, operations), **more)
    is_started = more.pop("start", True)
    session = Session(chart, _whole(chart, operations), start=False, watch=recorder.guard, **more)
    session.observers.append(recorder.observer(chart))
    if is_started:
        session.start()
    return session


def calls(session: Session) -> tuple[tuple[Any, ...], ...]:
    """Return the operations that a machine called so far: each its name, then its arguments."""
    return tuple(call for macrostep in session.trace for call in _calls(session.chart, macrostep))


def assert_in(session: Session, *states: str) -> None:
    """Assert that states are active; the message names those that are."""
    outside = [state for state in states if not session.is_in(state)]
    if outside:
        active = " ".join(session.active)
        raise AssertionError(f"not in {', '.join(outside)}: active is {active}")


def _whole(chart: Chart, operations: object) -> Mapping[str, Callable[..., object]]:
    """Return a function for each operation."""
    return {
        name: find(operations, name) or _stub(operation)
        for name, operation in every_operation(chart).items()
    }


def _stub(operation: Operation) -> Callable[..., object]:
    type_, value = operation.result, operation.default
    result = None if type_ is None or value is None else to_python(value, type_)
    return lambda *_: result


def _calls(chart: Chart, macrostep: Macrostep) -> Iterator[tuple[Any, ...]]:
    operations = every_operation(chart)
    for effect in macrostep.effects:
        match effect:
            case Called(name, arguments):
                typed = zip(arguments, operations[name].parameters, strict=True)
                yield name, *(to_python(value, parameter.type) for value, parameter in typed)
            case InvokedMacrostep(slot, within):
                yield from _calls(chart.invocations[slot].chart, within)
            case _:
                pass
