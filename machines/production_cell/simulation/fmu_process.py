"""The plant as a process, when it is an FMU: of this cell (`plant_fmu`), or another's.

An FMU for co-simulation, FMI 2.0 or 3.0, run by FMPy. Its variables have the names of the signals
(`signals.PLANT`), whole numbers, truth values or real numbers, which are rounded. All must be
there: boards, world and judgement read them.
"""

# mypy: disable-error-code="no-untyped-call, import-untyped"

from __future__ import annotations

import argparse
import json
import os
import shutil
import signal
import sys
import tempfile
import zipfile
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import fmpy
from fmpy.fmi1 import FMICallException
from fmpy.fmi2 import FMU2Slave
from fmpy.fmi3 import FMU3Slave

from .protocol import Json, Values, serve
from .signals import PLANT, STEP, Ports

INTEGERS = frozenset(
    {
        "Integer",
        "Enumeration",
        *(f"{sign}Int{bits}" for sign in ("", "U") for bits in (8, 16, 32, 64)),
    }
)
REALS = frozenset({"Real", "Float32", "Float64"})
TYPES = INTEGERS | REALS | {"Boolean"}
"""The types of variables that can be signals."""
EVENTS = "events"
"""The variable with what happened, as JSON, if there is one."""
LARGEST = 2**31 - 1
LARGEST_FMU = 2**30
"""Bytes of all files of an FMU."""
MOST_TEXT = 400
"""Characters of a reason that others give."""


class UnfitError(Exception):
    """An FMU is no plant of this cell; the text says why."""


class FmuServer:
    """An FMU behind the protocol."""

    name = "plant"

    def __init__(self, path: Path, folder: Path, seed: int) -> None:
        """Load an FMU that is unpacked into a folder. Raises `UnfitError`."""
        try:
            with zipfile.ZipFile(path) as archive:
                size = sum(part.file_size for part in archive.infolist())
            if size > LARGEST_FMU:
                raise UnfitError(f"it has {size} bytes, and {LARGEST_FMU} are the most")
            fmpy.extract(str(path), str(folder))
            description = fmpy.read_model_description(str(folder))
        except UnfitError:
            raise
        except Exception as error:
            raise UnfitError(f"it cannot be read: {_text(error)}") from error
        if not description.fmiVersion.startswith(("2.", "3.")):
            raise UnfitError(f"it is of FMI {description.fmiVersion}, not of 2.0 or 3.0")
        if description.coSimulation is None:
            raise UnfitError("it is not for co-simulation")
        self._is_2 = description.fmiVersion.startswith("2")
        self._variables = {v.name: v for v in description.modelVariables}
        self.ports = _ports(self._variables)
        self._inputs = [self._variables[name] for name in self.ports.inputs]
        self._time = 0.0
        kind = FMU2Slave if self._is_2 else FMU3Slave
        try:
            self._fmu: Any = kind(
                guid=description.guid,
                unzipDirectory=str(folder),
                modelIdentifier=description.coSimulation.modelIdentifier,
                instanceName="plant",
            )
            self._fmu.instantiate()
            if self._is_2:
                self._fmu.setupExperiment(startTime=0.0)
                if "seed" in self._variables:
                    self._set([self._variables["seed"]], [seed])
                self._fmu.enterInitializationMode()
            else:
                self._fmu.enterInitializationMode(startTime=0.0)
                if "seed" in self._variables:
                    self._set([self._variables["seed"]], [seed])
        except Exception as error:
            raise UnfitError(f"it cannot be instantiated: {_text(error)}") from error
        self._reads = _by_type([self._variables[name] for name in self.ports.outputs])

    def about(self) -> Json:
        """Return that there are no frames."""
        return {"peers": []}

    def initial(self, inputs: Values) -> Sequence[int]:
        """Take the first inputs, and return what the sensors say before anything moves."""
        self._set(self._inputs, inputs.tolist())
        found = self._outputs()
        self._fmu.exitInitializationMode()
        return found

    def step(self, number: int, inputs: Values) -> Sequence[int]:
        """Advance by a millisecond."""
        del number
        self._set(self._inputs, inputs.tolist())
        told = self._fmu.doStep(currentCommunicationPoint=self._time, communicationStepSize=STEP)
        if told is not None:  # of FMI 3.0; one of 2.0 that ends discards the step
            _, is_terminated, is_early, reached = told
            if is_terminated or is_early:
                what = "the simulation" if is_terminated else "the step"
                raise UnfitError(f"it ends {what} at {reached:g} s")
        self._time += STEP
        return self._outputs()

    def set_parameter(self, name: str, value: float) -> None:
        """Break or repair a part, if the FMU has an input of that name."""
        if name not in self._variables:
            raise KeyError(f"the FMU has no variable {name}")
        self._set([self._variables[name]], [value])

    def report(self) -> Json:
        """Return what happened, if the FMU keeps it."""
        if EVENTS not in self._variables or self._variables[EVENTS].type != "String":
            return {"events": []}
        text = self._fmu.getString([self._variables[EVENTS].valueReference])[0]
        return {"events": read_events(text if isinstance(text, str) else text.decode())}

    def _set(self, variables: Sequence[Any], values: Sequence[float]) -> None:
        wanted = dict(zip((v.name for v in variables), values, strict=True))
        for type_, group in _by_type(variables):
            convert: Callable[[float], Any] = float if type_ in REALS else int
            references = [v.valueReference for v in group]
            given = [convert(wanted[v.name]) for v in group]
            getattr(self._fmu, f"set{self._access(type_)}")(references, given)

    def _outputs(self) -> list[int]:
        found: dict[str, int] = {}
        for type_, group in self._reads:
            references = [v.valueReference for v in group]
            values = getattr(self._fmu, f"get{self._access(type_)}")(references)
            found |= {v.name: _whole(v.name, x) for v, x in zip(group, values, strict=True)}
        return [found[name] for name in self.ports.outputs]

    def _access(self, type_: str) -> str:
        """Return what the functions are called that access a type."""
        if type_ == "Enumeration":
            return "Integer" if self._is_2 else "Int64"
        return type_


def _ports(variables: Mapping[str, Any]) -> Ports:
    """Return the signals that an FMU has. Raises `UnfitError` for one that is missing or unfit."""
    wrong = []
    for names, causality in ((PLANT.inputs, "input"), (PLANT.outputs, "output")):
        for name in names:
            variable = variables.get(name)
            if variable is None:
                wrong.append(f"the {causality} {name} is missing")
            elif variable.causality != causality:
                wrong.append(f"{name} is {variable.causality}, not {causality}")
            elif variable.type not in TYPES or variable.dimensions:
                wrong.append(f"{name} is {variable.type}, not a number")
    if wrong:
        more = f", and {len(wrong) - 3} more" if len(wrong) > 3 else ""
        raise UnfitError("; ".join(wrong[:3]) + more)
    return PLANT


def _whole(name: str, value: float) -> int:
    """Return a value as the protocol has it. Raises `UnfitError` for one beyond 32 bits."""
    if not abs(value) <= LARGEST:  # no number is not
        raise UnfitError(f"{name} is {value}, beyond 32 bits")
    return round(value)


def read_events(text: str) -> list[Json]:
    """Return what happened, by the text of an FMU. Raises `UnfitError`."""
    kinds: Mapping[str, type | tuple[type, ...]]
    kinds = {"time": (int, float), "kind": str, "block": int, "detail": str}
    try:
        events = json.loads(text)
    except ValueError:
        events = None
    if not isinstance(events, list) or not all(
        isinstance(event, dict)
        and event.keys() == kinds.keys()
        and all(isinstance(event[key], kind) for key, kind in kinds.items())
        for event in events
    ):
        raise UnfitError(f"its variable {EVENTS} is no list of events in JSON")
    return events


def _by_type(variables: Sequence[Any]) -> list[tuple[str, list[Any]]]:
    groups: dict[str, list[Any]] = {}
    for variable in variables:
        groups.setdefault(variable.type, []).append(variable)
    return list(groups.items())


def _text(error: Exception) -> str:
    text = " ".join(str(error).split()) or type(error).__name__
    return text if len(text) <= MOST_TEXT else f"{text[:MOST_TEXT]}..."


def main() -> None:
    """Serve until the request to quit, or until the parent process is gone."""
    parser = argparse.ArgumentParser(description="An FMU as plant of the Production Cell.")
    parser.add_argument("endpoint", help="its endpoint: tcp://127.0.0.1:PORT or ipc://PATH")
    parser.add_argument("fmu", type=Path)
    parser.add_argument("--seed", type=int, default=1, help="of an FMU with a parameter `seed`")
    options = parser.parse_args()
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the orchestrator says when it ends
    parent = os.getppid()
    folder = Path(tempfile.mkdtemp(prefix="plant"))
    try:
        server = FmuServer(options.fmu, folder, options.seed)
        serve(server, options.endpoint, lambda: os.getppid() == parent)
    except (UnfitError, FMICallException) as error:
        sys.exit(f"{options.fmu}: {error}")
    finally:
        shutil.rmtree(folder, ignore_errors=True)


if __name__ == "__main__":
    main()
