"""An FMU of a chart, and the interpreter beside it."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

from fsmkit.chart.chart import Chart
from fsmkit.codegen.target import SystemTarget
from fsmkit.diagnostics import Findings
from fsmkit.language import SymbolType, Type, Value, default_value
from fsmkit.language.values import from_python, to_python
from fsmkit.plan import lower
from fsmkit.plan.image import flat, scalars_by_path
from fsmkit.plan.plan import Plan
from fsmkit.plugins import plugin
from fsmkit.runtime.host_methods import Delivery
from fsmkit.runtime.interpreter.snapshot import Called, Emitted, Occurrence, Snapshot
from fsmkit.runtime.session import Session, variables
from fsmkit.runtime.system_session import Happening, SystemSession
from fsmkit.system.machine import operation_port
from fsmkit.system.system import System


def build_fmu(folder: Path, model: Chart | System, version: str, *, is_built: bool = True) -> Path:
    options = {"fmi": version} | ({"build": "on"} if is_built else {})
    target = plugin(SystemTarget, "fmu")
    make = target.generate_system if isinstance(model, System) else target.generate
    generated = make(model, Findings(), options)  # type: ignore[arg-type]
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
        self.plan = lower(chart)
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
        return states_of(self.chart, self.plan, self.session.snapshot)


class SystemBeside:
    """The interpreter of a system; only events of unconnected ports leave it."""

    def __init__(self, system: System) -> None:
        self.system = system
        self.plans = [lower(machine.chart) for machine in system.machines]
        self.seen: list[tuple[str, tuple[object, ...]]] = []
        self.session = SystemSession(system)
        self.joined = {(link.source, link.port) for link in system.event_links}

    def start(self) -> None:
        self._note(self.session.start())

    def run(self, now: int) -> None:
        self._note(self.session.run(now))

    @property
    def fault(self) -> str | None:
        """The fault of a machine that has one."""
        machines = (self.session.snapshot(machine.name) for machine in self.system.machines)
        return next((each.fault for each in machines if each.fault is not None), None)

    def states(self) -> dict[str, object]:
        return {
            f"{machine.name}.{name}": value
            for machine, plan in zip(self.system.machines, self.plans, strict=True)
            for name, value in states_of(
                machine.chart, plan, self.session.snapshot(machine.name)
            ).items()
        }

    def _note(self, happened: list[Happening]) -> None:
        numbers = {machine.name: n for n, machine in enumerate(self.system.machines)}
        for happening in happened:
            number = numbers[happening.machine]
            chart = self.system.machines[number].chart
            for effect in happening.macrostep.effects:
                match effect:
                    case Emitted(Occurrence(event, values)):
                        port, fields = event, chart.events[event].fields
                        name = f"send.{chart.events[event].name}"
                    case Called(operation, values):
                        port = operation_port(chart, operation)
                        fields = chart.operations[port - len(chart.events)].parameters
                        name = f"call.{operation}"
                    case _:
                        continue
                if (number, port) not in self.joined:
                    pairs = zip(fields, values, strict=True)
                    raw = tuple(v for f, value in pairs for _, v in named(f.type, value))
                    self.seen.append((f"{happening.machine}.{name}", raw))


def states_of(chart: Chart, plan: Plan, snapshot: Snapshot) -> dict[str, object]:
    """Return values of variables and deepest active states by the names of an FMU."""
    found: dict[str, object] = {}
    for declared, value in variables(chart, snapshot):
        for path, scalar in named(declared.type, value):
            found[f"{declared.name}{path}"] = scalar
    for region in plan.regions:
        inside = [s for s in chart.states[1:] if plan.region_of[s.index] == region.index]
        active = [s.index for s in inside if s.index in snapshot.configuration]
        name = "state" if region.index == 0 else f"state.{inside[0].id}"
        found[name] = max(active, default=0)
    return found


def _scalars(type_: Type, value: object) -> Iterator[object]:
    return (scalar for _, scalar in named(type_, from_python(value, type_)))


def named(type_: Type, value: Value) -> Iterator[tuple[str, Value]]:
    """Yield the names and values of an FMU's variables: all scalars but strings."""
    for (path, scalar_type), scalar in zip(scalars_by_path(type_), flat(value), strict=True):
        if not isinstance(scalar_type, SymbolType):
            yield path, scalar
