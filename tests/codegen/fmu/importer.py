"""A co-simulation algorithm over FMPy's functions, for FMUs of either version."""

from __future__ import annotations

import re
from pathlib import Path
from shutil import rmtree
from tempfile import mkdtemp
from typing import Any

from fmpy import extract, read_model_description
from fmpy.fmi2 import FMU2Slave
from fmpy.fmi3 import FMU3Slave

SENT = re.compile(r"([^.]+\.)?(send|call)\.[^.]+")
"""The name of the counter of an event or a call, in a system after that of the machine."""
Seen = tuple[str, tuple[object, ...]]


class Importer:
    """One instance, its time in seconds, and the events and calls that it has shown."""

    def __init__(self, file: Path, instance: str = "one") -> None:
        self.description = read_model_description(str(file))
        self.is_3 = self.description.fmiVersion.startswith("3")
        self.by_name = {v.name: v for v in self.description.modelVariables}
        self.seen: list[Seen] = []
        self.time = 0.0
        self._counts: dict[str, int] = {}
        self.fmu: Any = (FMU3Slave if self.is_3 else FMU2Slave)(
            guid=self.description.guid,
            unzipDirectory=extract(str(file), mkdtemp(prefix="fmu-")),
            modelIdentifier=self.description.coSimulation.modelIdentifier,
            instanceName=instance,
        )

    def start(self, inputs: dict[str, object]) -> None:
        """Instantiate and initialize with these inputs."""
        if self.is_3:
            self.fmu.instantiate(eventModeUsed=True, earlyReturnAllowed=True)
        else:
            self.fmu.instantiate()
            self.fmu.setupExperiment(startTime=0.0)
        self.fmu.enterInitializationMode()
        for name, value in inputs.items():
            self[name] = value
        self.fmu.exitInitializationMode()
        if self.is_3:
            self._iterate()
        else:
            self.fmu.doStep(0.0, 0.0)
            self._count()

    def post(self, event: str, fields: dict[str, object]) -> None:
        """Set the payload of an event, and its Clock or its counter."""
        self.tick(f"post.{event}", fields)

    def tick(self, clock_name: str, fields: dict[str, object]) -> None:
        """Do the same by the name of the Clock."""
        for name, value in fields.items():
            self[f"{clock_name}.{name}"] = value
        clock = self.by_name[clock_name].valueReference
        if self.is_3:
            self.fmu.enterEventMode()
            self.fmu.setClock([clock], [True])
            self._iterate(is_shown=False)
        else:
            (before,) = self.fmu.getInteger([clock])
            self.fmu.setInteger([clock], [before + 1])
            self.fmu.doStep(self.time, 0.0)
            self._count()

    def look(self) -> None:
        """Let it see inputs that have changed, at the same time."""
        if self.is_3:
            self.fmu.enterEventMode()
            self._iterate(is_shown=False)
        else:
            self.fmu.doStep(self.time, 0.0)
            self._count()

    def advance(self, seconds: float) -> None:
        """Let time pass."""
        end = self.time + seconds
        if not self.is_3:
            self.fmu.doStep(self.time, seconds)
            self.time = end
            self._count()
            return
        while True:
            needs, _, early, reached = self.fmu.doStep(self.time, end - self.time)
            self.time = reached
            if needs:
                self.fmu.enterEventMode()
                self._iterate()
            if not early:
                break
        self.time = end

    def _iterate(self, *, is_shown: bool = True) -> None:
        """Iterate in Event Mode until nothing is new; ``is_shown``: Clocks may tick already."""
        if is_shown:
            self._clocks()
        again = True
        while again:
            again = self.fmu.updateDiscreteStates()[0]
            if again:
                self._clocks()
        self.fmu.enterStepMode()

    def _clocks(self) -> None:
        for name, variable in self.by_name.items():
            if variable.type == "Clock" and variable.causality == "output":
                (is_ticking,) = self.fmu.getClock([variable.valueReference])
                if is_ticking:
                    self.seen.append((name, self._payload(name)))

    def _count(self) -> None:
        """Note the events and calls whose counters moved, each by how much."""
        for name in self.by_name:
            if SENT.fullmatch(name):
                count = int(str(self[name]))
                moved, self._counts[name] = count - self._counts.get(name, 0), count
                self.seen += [(name, ())] * moved

    def _payload(self, name: str) -> tuple[object, ...]:
        clock = self.by_name[name].valueReference
        return tuple(
            self[other]
            for other, variable in self.by_name.items()
            if clock in map(_reference, variable.clocks or ())
        )

    def __getitem__(self, name: str) -> object:
        variable = self.by_name[name]
        (value,) = getattr(self.fmu, f"get{_type(variable, self.is_3)}")([variable.valueReference])
        return value

    def __setitem__(self, name: str, value: object) -> None:
        variable = self.by_name[name]
        setter = getattr(self.fmu, f"set{_type(variable, self.is_3)}")
        setter([variable.valueReference], [value])

    def saved(self) -> bytes:
        """Return the state as bytes."""
        state = self.fmu.getFMUState()
        data: bytes = self.fmu.serializeFMUState(state)
        self.fmu.freeFMUState(state)
        return data

    def restore(self, data: bytes) -> None:
        """Take over a saved state."""
        state = self.fmu.deserializeFMUState(data)
        self.fmu.setFMUState(state)
        self.fmu.freeFMUState(state)

    def close(self) -> None:
        """Free the instance, and remove its files."""
        self.fmu.terminate()
        self.fmu.freeInstance()
        rmtree(self.fmu.unzipDirectory)


def _reference(clock: Any) -> int:
    return int(getattr(clock, "valueReference", clock))


def _type(variable: Any, is_3: bool) -> str:
    if variable.type == "Enumeration":
        return "Int64" if is_3 else "Integer"
    return str(variable.type)
