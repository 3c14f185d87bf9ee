"""An FMU of a chart, and the interpreter beside it."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

from fsmkit.chart.chart import Chart
from fsmkit.codegen.fmu.variables import parts
from fsmkit.diagnostics import Findings
from fsmkit.language import SymbolType, Type, Value, default_value
from fsmkit.language.values import from_python, to_python
from fsmkit.plan import lower
from fsmkit.plan.image import flat
from fsmkit.plugins import Target, plugin
from fsmkit.runtime.binding import Delivery
from fsmkit.runtime.session import Session, variables


def made(folder: Path, chart: Chart, version: str, *, is_built: bool = True) -> Path:
    options = {"fmi": version} | ({"build": "on"} if is_built else {})
    generated = plugin(Target, "fmu").generate(chart, Findings(), options)
    assert generated is not None
    ((name, data),) = generated.built.items()
    file = folder / name
    file.write_bytes(data)
    return file


class Beside:
    """The interpreter, with the events and calls that left it."""

    def __init__(self, chart: Chart) -> None:
        self.seen: list[tuple[str, tuple[object, ...]]] = []
        self.chart = chart
        operations = {o.name: self._operation(o.name, o.result) for o in chart.operations}
        self.session = Session(chart, operations, on_event=self._left, start=False)

    def _operation(self, name: str, result: Type | None) -> Callable[..., object]:
        parameters = next(o for o in self.chart.operations if o.name == name).parameters

        def called(*values: object) -> object:
            raw = tuple(
                scalar
                for part, value in zip(parameters, values, strict=True)
                for scalar in _scalars(part.type, value)
            )
            self.seen.append((f"call.{name}", raw))
            return None if result is None else to_python(default_value(result), result)

        return called

    def _left(self, delivery: Delivery) -> None:
        event = next(e for e in self.chart.events if e.name == delivery.event)
        raw = tuple(
            scalar
            for part in event.fields
            for scalar in _scalars(part.type, delivery.fields[part.name])
        )
        self.seen.append((f"send.{event.name}", raw))

    def states(self) -> dict[str, object]:
        """Return values of variables and deepest active states by the names of an FMU."""
        chart, plan = self.chart, lower(self.chart)
        found: dict[str, object] = {}
        for declared, value in variables(chart, self.session.snapshot):
            for path, scalar in named(declared.type, value):
                found[f"{declared.name}{path}"] = scalar
        for region in plan.regions:
            inside = [s for s in chart.states[1:] if plan.region_of[s.index] == region.index]
            active = [s.index for s in inside if s.id in self.session.configuration]
            name = "state" if region.index == 0 else f"state.{inside[0].id}"
            found[name] = max(active, default=0)
        return found


def _scalars(type_: Type, value: object) -> Iterator[object]:
    return (scalar for _, scalar in named(type_, from_python(value, type_)))


def named(type_: Type, value: Value) -> Iterator[tuple[str, Value]]:
    """Yield what an FMU has variables for: all scalars but strings."""
    for (path, scalar_type), scalar in zip(parts(type_), flat(value), strict=True):
        if not isinstance(scalar_type, SymbolType):
            yield path, scalar
