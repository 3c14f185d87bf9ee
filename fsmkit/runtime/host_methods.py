"""Operations and out-events bound to Python: methods of an object, or functions by name."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from random import Random
from typing import Any

from fsmkit.chart.chart import OPEN_ENDED, Chart, Operation, every_operation
from fsmkit.diagnostics import Findings, FsmkitError, fail
from fsmkit.language import Value
from fsmkit.language.values import from_python, to_python
from fsmkit.runtime.interpreter.globals import Guard
from fsmkit.runtime.interpreter.snapshot import Post


@dataclass(frozen=True, slots=True)
class Delivery:
    """An event that left the machine: its name, its payload by field, and the peer named in it."""

    event: str
    fields: Mapping[str, object]
    peer: str | None = None


class BoundHost:
    """Performs operations by calling Python; values go out and in as Python has them."""

    def __init__(
        self, chart: Chart, operations: object, seed: int = 0, watch: Guard | None = None
    ) -> None:
        self._operations = every_operation(chart)
        self._random = Random(seed)  # noqa: S311  (no secret)
        self._functions = bind_operations(chart, operations)
        self._chart = chart
        self.post: Post | None = None
        """Posts to the machine in the middle of a step; None between steps."""
        if watch is not None:
            self.guard = watch

    def accept_posts(self, chart: Chart, post: Post) -> None:
        """Store the function that posts to the machine; invoked machines have their own."""
        if chart is self._chart:
            self.post = post

    def delay(self, least: int, greatest: int) -> int:
        """Return how long a delay takes that a chart of an environment gives as an interval.

        One without an end takes at most twice as long as it must, or 1,000 ticks more.
        """
        if greatest == least + OPEN_ENDED:
            greatest = least + max(least, 1000)
        return self._random.randint(least, greatest)

    def call(self, operation: str, arguments: tuple[Value, ...]) -> Value | None:
        """Call the function of an operation. Its exceptions reach the caller."""
        declared = self._operations[operation]
        given = [
            to_python(value, parameter.type)
            for value, parameter in zip(arguments, declared.parameters, strict=True)
        ]
        result = self._functions[operation](*given)
        if declared.result is None:
            return None
        try:
            return from_python(result, declared.result)
        except ValueError as error:
            raise fail(
                "wrong-result",
                f"the result of the operation `{operation}` {error}",
                declared.span,
                help=f"return a value of `{declared.result}`",
            ) from error


def bind_operations(chart: Chart, operations: object) -> dict[str, Callable[..., Any]]:
    """Return the function of each operation; `FsmkitError` that lists those there are none for."""
    declared = every_operation(chart)
    found = {name: find(operations, name) for name in declared}
    missing = [operation for name, operation in declared.items() if found[name] is None]
    if missing:
        raise missing_operations(chart, missing)
    return {name: function for name, function in found.items() if function is not None}


def missing_operations(chart: Chart, missing: Iterable[Operation]) -> FsmkitError:
    """Return the error that names the operations without a function, each with its declaration."""
    findings = Findings()
    for operation in missing:
        parameters = "".join(f", {parameter.name}" for parameter in operation.parameters)
        findings.add(
            "missing-operation",
            f"nothing performs the operation `{operation.name}` of the chart `{chart.name}`",
            operation.span,
            help=f"define `def {_identifier(operation.name)}(self{parameters})` in the object that "
            "is bound",
        )
    return FsmkitError(findings)


def find(operations: object, name: str) -> Callable[..., Any] | None:
    """Return the attribute `name` of an object, or the item `name` of a mapping."""
    identifier = _identifier(name)
    if isinstance(operations, Mapping):
        found = operations.get(name, operations.get(identifier))
    else:
        found = getattr(operations, identifier, None)
    return found if callable(found) else None


def _identifier(name: str) -> str:
    """Return the Python identifier of a name. Names of copies contain dots."""
    return re.sub(r"\W", "_", name)


def deliver(operations: object, delivery: Delivery) -> None:
    """Call the method ``on_<event>`` with an out-event, if there is one."""
    handler = find(operations, f"on_{delivery.event}")
    if handler is not None:
        handler(**delivery.fields)
