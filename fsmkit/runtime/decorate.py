"""Classes bound to charts: the methods of an object are the operations of its machine."""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from typing import Any, TypeVar

from fsmkit.chart.chart import Chart
from fsmkit.runtime.binding import every_operation, find, missing_operations
from fsmkit.runtime.clock import Clock, SimulatedClock
from fsmkit.runtime.session import Session

Class = TypeVar("Class", bound=type)


def bind(chart: Chart, clock: Callable[[], Clock] = SimulatedClock) -> Callable[[Class], Class]:
    """Return a class decorator: each object gets a running `Session` as its ``machine``.

    The machine starts when ``__init__`` has returned, on a clock made by ``clock``. Operations
    without a method are an error of the class, told when it is defined.
    """

    def decorate(cls: Class) -> Class:
        missing = [one for one in every_operation(chart).values() if find(cls, one.name) is None]
        if missing:
            raise missing_operations(chart, missing)
        initialise: Callable[..., None] = cls.__init__  # type: ignore[misc]

        @wraps(initialise)
        def with_machine(self: Any, *args: Any, **kwargs: Any) -> None:
            initialise(self, *args, **kwargs)
            if type(self).__init__ is with_machine:
                self.machine = Session(chart, self, clock(), start=False)
                self.machine.start()

        cls.__init__ = with_machine  # type: ignore[misc]
        return cls

    return decorate
