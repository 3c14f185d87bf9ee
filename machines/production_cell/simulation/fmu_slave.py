"""The plant as a model of pythonfmu3, which `plant_fmu` packs into an FMU of FMI 3.0.

Signals are variables by their names, ``feeder.pwm``. ``seed`` is a parameter. What can be broken is
an input, by the names of `plant.with_fault`; ``events`` is what happened, as JSON.
"""

# mypy: disable-error-code="misc, no-untyped-call"

from __future__ import annotations

import json
from typing import Any

import numpy as np
from pythonfmu3 import (
    DefaultExperiment,
    Float64,
    Fmi3Causality,
    Fmi3Slave,
    Fmi3StepResult,
    Fmi3Variability,
    Int32,
    String,
)

from machines.production_cell.simulation.plant_process import PlantServer
from machines.production_cell.simulation.signals import AXES, MEASUREMENTS, PLANT, SLOTS, STEP

FAULTS = (
    *(f"jam.{axis}" for axis in AXES),
    *(f"sensor.{name}" for name in MEASUREMENTS),
    *(f"take.{slot}" for slot in SLOTS),
)
"""The value that repairs: 0; for sensors, whose stuck value may be 0, -1."""


class CellPlant(Fmi3Slave):
    """The plant of the Production Cell, a millisecond a step."""

    def __init__(self, **options: Any) -> None:
        super().__init__(**options)
        self.author = "fsmkit"
        self.description = "Belts, axes, magnets, blocks and sensors of the Production Cell"
        self.default_experiment = DefaultExperiment(step_size=STEP)
        self._number = 0
        self._broken = {name: -name.startswith("sensor.") for name in FAULTS}
        self._commands = dict.fromkeys(PLANT.inputs, 0)
        self._begin(1)
        time = Float64(
            "time",
            causality=Fmi3Causality.independent,
            variability=Fmi3Variability.continuous,
            getter=lambda: self._number * STEP,
        )
        self.register_variable(time, nested=False)
        self._variable("seed", Fmi3Causality.parameter, lambda: self._seed, self._begin)
        for name in PLANT.inputs:
            self._variable(name, Fmi3Causality.input, *self._command(name))
        for name in FAULTS:
            self._variable(name, Fmi3Causality.input, *self._fault(name))
        for place, name in enumerate(PLANT.outputs):
            self._variable(name, Fmi3Causality.output, self._output(place))
        events = String("events", causality=Fmi3Causality.local, getter=self._events)
        self.register_variable(events, nested=False)

    def do_step(self, current_time: float, step_size: float) -> Fmi3StepResult:
        """Advance by whole milliseconds."""
        del current_time
        inputs = np.array([self._commands[name] for name in PLANT.inputs])
        for _ in range(round(step_size / STEP)):
            self._number += 1
            self._outputs = self._server.step(self._number, inputs)
        return Fmi3StepResult()

    def _begin(self, seed: int) -> None:
        self._seed = int(seed)
        self._server = PlantServer(self._seed)
        self._outputs = self._server.initial(np.zeros(len(PLANT.inputs), np.int32))

    def _variable(self, name: str, causality: Any, getter: Any, setter: Any = None) -> None:
        is_fixed = causality is Fmi3Causality.parameter
        variability = Fmi3Variability.fixed if is_fixed else Fmi3Variability.discrete
        found = Int32(
            name, causality=causality, variability=variability, getter=getter, setter=setter
        )
        self.register_variable(found, nested=False)

    def _command(self, name: str) -> tuple[Any, Any]:
        return lambda: self._commands[name], lambda value: self._commands.update({name: value})

    def _output(self, place: int) -> Any:
        return lambda: self._outputs[place]

    def _fault(self, name: str) -> tuple[Any, Any]:
        def set_fault(value: int) -> None:
            self._broken[name] = value
            self._server.set_parameter(name, value)
            self._outputs = self._server.outputs

        return lambda: self._broken[name], set_fault

    def _events(self) -> str:
        return json.dumps(self._server.report()["events"])
