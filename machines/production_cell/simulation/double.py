"""A test double of all boards: the real charts in generated Python, over axes plainly controlled.

It needs no C compiler and no links: all machines run in one process, wired as ring.yaml says, in
the order of that file, once a step.
"""

from __future__ import annotations

import argparse
import math
import os
import signal
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import fsmkit
from fsmkit.chart.chart import Chart
from fsmkit.system.machine import OBSERVED, Machine

from .protocol import Json, Values, serve
from .signals import AXES, BUTTONS, COMMANDS, MEASUREMENTS, MODULES, PWM_FULL, Ports

CELL = Path(__file__).resolve().parents[1]
TOP, ACCELERATION = 2400.0, 12000.0
"""Of a motion at full speed, in counts a second, and that a second."""
FULL_SPEED, TIME_CONSTANT = 3000.0, 0.04
"""Of the axes, as cosim.md says: at full PWM, in counts a second, and in s."""
PROPORTIONAL, FRICTION = 100.0, 330.0
"""PWM for each count of error, and to overcome friction."""
DAMPING = 2.0
"""PWM for each count a second of error in speed."""
TOLERANCE = 12
"""In counts: closer is there."""
SETTLED = 10
"""In ms: as long it must be there to have arrived."""
STEP = 1e-3


class Drive:
    """A position control: a trapezoidal profile, followed with feed-forward."""

    def __init__(self, forward: bool) -> None:
        self._direction = 1 if forward else -1
        self._enabled = self._moving = self._seeking = False
        self._setpoint = self._speed = self._target = self._top = 0.0
        self._origin = self._raw = self._before = 0
        self._measured = 0.0
        self._settled = 0

    @property
    def position(self) -> int:
        """In counts from the origin."""
        return self._raw - self._origin

    def enable(self) -> None:
        """Hold where it is."""
        self._enabled = True
        self._place()

    def disable(self) -> None:
        """Do nothing from now on."""
        self._enabled = False
        self._place()

    def _place(self) -> None:
        self._moving = self._seeking = False
        self._setpoint, self._speed, self._target = float(self.position), 0.0, float(self.position)

    def hold(self) -> None:
        """Stop, and stay."""
        if self._moving or self._seeking:
            self._place()

    def seek(self, percent: int) -> None:
        """Move towards the switch, until it closes."""
        self._go(self.position + self._direction * 1e6, percent)
        self._seeking, self._moving = True, False

    def goto(self, position: int, percent: int) -> None:
        """Move to a position, in counts."""
        self._go(position, percent)
        self._seeking, self._moving = False, True

    def _go(self, target: float, percent: int) -> None:
        self._target, self._top, self._settled = float(target), TOP * percent / 100, 0

    def zero(self) -> None:
        """Count from the target from now on."""
        shift = round(self._target)
        self._origin += shift
        self._setpoint -= shift
        self._target -= shift

    def sense(self, encoder: int, limit: bool) -> str:
        """Take in what was measured; return what it means to the machine."""
        self._raw = encoder
        self._measured += 0.2 * ((encoder - self._before) / STEP - self._measured)
        self._before = encoder
        if self._seeking and limit:
            self._origin = encoder
            self._place()
            return "limit"
        if self._moving:
            near = abs(self.position - self._target) <= TOLERANCE and self._speed == 0.0
            self._settled = self._settled + 1 if near else 0
            if self._settled >= SETTLED:
                self._moving = False
                return "arrived"
        return ""

    def control(self) -> int:
        """Advance the setpoint; return the PWM."""
        if not self._enabled:
            return 0
        left = self._target - self._setpoint
        brake = ACCELERATION * STEP
        wanted = math.copysign(
            min(self._top, max(0.0, math.sqrt(2 * ACCELERATION * abs(left)) - brake)), left
        )
        was = self._speed
        self._speed = min(max(wanted, was - brake), was + brake) if left or was else 0.0
        if abs(left) < 1.0 and abs(was) <= 2 * brake:
            self._setpoint, self._speed = self._target, 0.0
        else:
            self._setpoint += self._speed * STEP
        torque = (self._speed + TIME_CONSTANT * (self._speed - was) / STEP) * PWM_FULL / FULL_SPEED
        error = self._setpoint - self.position
        push = math.copysign(FRICTION, self._speed) if self._speed else 0.0
        pwm = torque + push + PROPORTIONAL * error + DAMPING * (self._speed - self._measured)
        return round(min(max(pwm, -PWM_FULL), PWM_FULL))

    def place(self, places: Sequence[int]) -> int:
        """Return where it is, as the charts' `Place`: between, home, offset, far."""
        if self._moving or self._seeking:
            return 0
        close = [n for n, at in enumerate(places, 1) if abs(self.position - at) <= 2 * TOLERANCE]
        return close[0] if close else 0


def constant(chart: Chart, *names: str) -> int:
    """Return the value of the first constant that a chart has of these; 0 if it has none."""
    values = {name: literal.value for name, literal in chart.constants}
    return next((int(str(values[name])) for name in names if name in values), 0)


class Boards:
    """All machines of the boards behind the protocol."""

    name = "double"
    ports = Ports(
        (*MEASUREMENTS, "power", "estop", *(f"button.{b}" for b in BUTTONS),
         "camera.frame", "camera.id", "camera.verdict", "estimator.sighted", "estimator.reject"),
        (*COMMANDS, "lamp", "beacon", *(f"{m}.state" for m in MODULES),
         *(f"{m}.fault" for m in MODULES if m != "supervisor")),
    )  # fmt: skip

    def __init__(
        self, replaced: dict[str, str] | None = None, system_file: str = "ring.yaml"
    ) -> None:
        system = fsmkit.read_system(str(CELL / system_file), replace=replaced or {})
        self._system = system
        self._charts = {m.name: m.chart for m in system.machines if m.name in MODULES}
        self._names = {n: [s.id for s in c.states] for n, c in self._charts.items()}
        self._drives = {axis: Drive(forward="belt" in axis) for axis in AXES}
        self._places = {axis: _places(self._charts[axis]) for axis in AXES}
        self._switches = {"extractor.magnet": 0, "rotator.magnet": 0, "sorter.out": 0}
        self._refused = 0
        self._was: dict[str, int] = {}
        self._machines: dict[str, Any] = {}
        for name, chart in self._charts.items():
            self._machines[name] = _generated(chart)(_Host(self, name, chart))
        self._routes = self._routed(system.machines)
        self._wires = self._wired(system.machines)

    def _routed(
        self, machines: tuple[Machine, ...]
    ) -> dict[tuple[str, str], list[tuple[str, str]]]:
        """Return where the events of each machine go."""
        routes: dict[tuple[str, str], list[tuple[str, str]]] = {}
        for link in self._system.event_links:
            source, target = machines[link.source], machines[link.target]
            events = source.chart.events
            if (
                source.name in MODULES
                and target.name in MODULES
                and link.port < min(OBSERVED, len(events))
            ):
                key = (source.name, events[link.port].name)
                routes.setdefault(key, []).append(
                    (target.name, target.chart.events[link.event].name)
                )
        return routes

    def _wired(self, machines: tuple[Machine, ...]) -> list[tuple[str, str, str]]:
        """Return the inputs of each machine with the sensors that they are wired to."""
        wires = []
        for link in self._system.input_links:
            source, target = machines[link.source], machines[link.target]
            if target.name not in MODULES:
                continue
            output = source.chart.outputs[link.output].name
            if output in {"sighted", "reject"}:
                signal_name: str | None = f"estimator.{output}"
            else:
                sensors = {"blocks": f"B_{output.upper()}", "pusher": "sorter.retracted"}
                signal_name = sensors.get(source.name)
            if signal_name:
                wires.append((target.name, target.chart.inputs[link.input].name, signal_name))
        return wires

    def send(self, machine: str, event: str, *payload: object) -> None:
        """Hand an event of a machine to those that it is wired to."""
        for target, name in self._routes.get((machine, event), ()):
            self._post(target, name, *payload)

    def _post(self, machine: str, event: str, *payload: object) -> None:
        self._refused += not getattr(self._machines[machine], f"post_{event}")(*payload)

    def command(self, machine: str, operation: str, *values: int) -> None:
        """Do what a machine calls."""
        match operation:
            case "magnet" | "push":
                self._switches[f"{machine}.{'out' if operation == 'push' else operation}"] = int(
                    values[0]
                )
            case "motor_enable" | "motor_disable" if machine in self._drives:
                getattr(self._drives[machine], operation.removeprefix("motor_"))()
                self._switches[f"{machine}.enable"] = int(operation == "motor_enable")
            case "motor_disable" if machine == "sorter":
                self._switches["sorter.out"] = 0
            case "hold" | "zero" | "seek" | "goto" if machine in self._drives:
                getattr(self._drives[machine], operation)(*values)

    def about(self) -> Json:
        """Return the states; there are no frames."""
        return {"peers": [], "states": self._names, "machines": list(self._machines)}

    def initial(self, inputs: Values) -> Sequence[int]:
        """Start all machines."""
        told = dict(zip(self.ports.inputs, inputs.tolist(), strict=True))
        for axis, drive in self._drives.items():
            drive.sense(told[f"{axis}.encoder"], limit=False)
        self._was = told
        for machine in self._machines.values():
            machine.start(0)
        return self._outputs(dict.fromkeys(AXES, 0))

    def step(self, number: int, inputs: Values) -> Sequence[int]:
        """Advance by a millisecond."""
        now = dict(zip(self.ports.inputs, inputs.tolist(), strict=True))
        self._press(now)
        self._look(now)
        for axis, drive in self._drives.items():
            event = drive.sense(now[f"{axis}.encoder"], bool(now[f"{axis}.limit"]))
            self._machines[axis].at = drive.place(self._places[axis])
            if event:
                self._post(axis, event)
        for machine, name, signal_name in self._wires:
            setattr(self._machines[machine], name, bool(now[signal_name]))
        self._machines["camera"].in_view = bool(now["B_E0"])
        for machine in self._machines.values():
            machine.run(number)
        self._was = now
        return self._outputs({axis: drive.control() for axis, drive in self._drives.items()})

    def _rises(self, now: dict[str, int], name: str) -> bool:
        return bool(now[name]) and not self._was[name]

    def _press(self, now: dict[str, int]) -> None:
        """Send the buttons to the supervisor."""
        buttons = {
            "start": "start",
            "stop": "stop",
            "pause": "pause",
            "resume": "start",
            "reset": "reset",
        }
        for button, event in buttons.items():
            if self._rises(now, f"button.{button}"):
                self._post("supervisor", f"press_{event}")
        if self._rises(now, "estop"):
            self._post("supervisor", "press_estop")

    def _look(self, now: dict[str, int]) -> None:
        """Send pictures and blocks to the camera."""
        if now["camera.frame"] != self._was["camera.frame"]:
            self._post("camera", "frame")
        if now["B_E0"] != self._was["B_E0"]:
            self._post("camera", "entered_view" if now["B_E0"] else "left_view")
        if self._rises(now, "camera.verdict"):
            self._post("camera", "judged", {1: 1, 2: 2, 3: 0}[now["camera.verdict"]])

    def _outputs(self, pwm: dict[str, int]) -> list[int]:
        values: list[int] = []
        for axis in AXES:
            values += (pwm[axis], self._switches.get(f"{axis}.enable", 0))
        values += (self._switches[n] for n in ("extractor.magnet", "rotator.magnet", "sorter.out"))
        states = [self._names[n].index(m.active()[0]) for n, m in self._machines.items()]
        faulted = self._machines["supervisor"].is_in("faulted")
        values += (int(self._machines["feeder_belt"].lamp), int(faulted), *states)
        values += (int(m.fault_code) for n, m in self._machines.items() if n != "supervisor")
        return values

    def set_parameter(self, name: str, value: float) -> None:
        """Reject the parameter: there are no links that could fail."""
        del value
        raise KeyError(name)

    def report(self) -> Json:
        """Return the states of the machines."""
        states = {name: machine.active()[0] for name, machine in self._machines.items()}
        return {"overruns": 0, "losses": 0, "refused": self._refused, "states": states}


class _Host:
    """The calls and sent events of a machine."""

    def __init__(self, boards: Boards, name: str, chart: Chart) -> None:
        for operation in chart.operations:
            setattr(self, operation.name, partial(boards.command, name, operation.name))
        for event in chart.events:
            setattr(self, f"send_{event.name}", partial(boards.send, name, event.name))


def _generated(chart: Chart) -> Callable[[object], Any]:
    """Return the class that is generated of a chart."""
    files = fsmkit.compile(chart, "python")
    names: dict[str, Any] = {"__name__": chart.name}
    exec(next(text for name, text in files.items() if name.endswith(".py")), names)  # noqa: S102
    made: Callable[[object], Any] = names[chart.name]
    return made


def _places(chart: Chart) -> tuple[int, int, int]:
    """Return home, offset and far of an axis, in counts."""
    home, offset = constant(chart, "HOME"), constant(chart, "OFFSET")
    return home, offset, constant(chart, "PICK", "PUSHED", "OPEN", "PITCH")


def main() -> None:
    """Serve until the request to quit."""
    parser = argparse.ArgumentParser(description="All boards of the Production Cell, in Python.")
    parser.add_argument("--cosim", metavar="ENDPOINT", required=True)
    parser.add_argument(
        "--by-position", action="store_true", help="an estimate switches the sorter"
    )
    options = parser.parse_args()
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    parent = os.getppid()
    system = "ring_by_position.yaml" if options.by_position else "ring.yaml"
    serve(Boards(system_file=system), options.cosim, lambda: os.getppid() == parent)


if __name__ == "__main__":
    main()
