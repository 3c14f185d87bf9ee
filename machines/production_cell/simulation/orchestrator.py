"""Step boards, plant and world together, a millisecond at a time, over ZeroMQ REQ/REP.

The phases: connect (each process reports its signals, which are connected by name), initial values,
check; then in each step controllers, plant, world. The same seed gives the same run: no process
reads a clock. In the pace of a clock (`Pace`) controllers run freely, and a cycle has several steps
of plant and world; the phases are the same.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt
import zmq

import fsmkit

from . import world
from .camera import CameraState, Estimate
from .fake_fpga import BoardBehindRegisters
from .faults import Action, Fault
from .kept import KeptBoard
from .markers import Bounded
from .nodes import CellError, Process, Program, answering, ping
from .pace import Pace, WallClock
from .panel import OperatorState
from .protocol import ProtocolError, read_step_reply, step_request
from .recording import Recorder
from .signals import SLOTS, WORLD_OUTPUTS
from .world import World, WorldState

CHARTS = Path(__file__).resolve().parents[1]
KEPT = ("extractor.magnet", "rotator.magnet")
"""Outputs that a board without power keeps: the magnets hold without current.

They let go when a board that switched them on switches them off. A restarted one did not;
the operator takes the block off when he resets the cell.
"""
ESTIMATOR = "estimator"
"""It is killed and restarted like a board."""
HANDS = 2
"""``operator.clear`` has this bit for the first of `KEPT` whose block is taken off, and so on."""
Places = npt.NDArray[np.intp]


@dataclass(frozen=True)
class Setup:
    """The processes of a run. ``timeout``: the maximum time for a reply, in s."""

    steps: int
    boards: tuple[Program, ...]
    plant: Program
    out: Path
    endpoints: Path
    """A folder for the sockets."""
    faults: tuple[Fault, ...] = ()
    about: Mapping[str, Any] = field(default_factory=dict)
    timeout: float = 10.0
    pings: int = 2000
    pace: Pace = field(default_factory=Pace)
    estimator: Callable[[], Estimating] | None = None
    """Starts an estimator that is a separate program."""


class Estimating(Protocol):
    """An estimator in another process, as the world calls it."""

    def __call__(self, state: CameraState, encoder: int) -> Estimate:
        """Return which block is before the sorter."""

    def begin(self) -> None:
        """Restart the process."""

    def kill(self) -> None:
        """Kill the process."""

    def report(self) -> Mapping[str, Any]:
        """Return the report."""

    def close(self) -> None:
        """End it."""


@dataclass
class Outcome:
    """The results of a run. Rates are per second of real time."""

    steps: int = 0
    seconds: float = 0.0
    ping_rate: float = 0.0
    reports: dict[str, Mapping[str, Any]] = field(default_factory=dict)
    lives: dict[str, list[Mapping[str, Any]]] = field(default_factory=dict)
    states: dict[str, tuple[str, ...]] = field(default_factory=dict)
    told: list[str] = field(default_factory=list)
    """The log of the schedule of faults."""
    begun: list[tuple[int, str]] = field(default_factory=list)
    """The steps at which faults began, and what they are."""
    not_begun: list[str] = field(default_factory=list)
    """Faults whose time did not come."""
    pace: Mapping[str, Any] = field(default_factory=dict)
    """Counts of the clock; empty without a clock."""
    back: dict[str, list[float]] = field(default_factory=dict)
    """After so many s of real time each board that was killed was connected again."""

    @property
    def step_rate(self) -> float:
        """Steps a second."""
        return self.steps / self.seconds if self.seconds else 0.0


@dataclass
class _Watch:
    """A fault that waits for its trigger. ``due``: the step at which it starts, once known."""

    fault: Fault
    numbers: frozenset[int] = frozenset()
    """The numbers of its state and its descendants."""
    entered: int = 0
    was_there: bool = False
    due: int | None = None


class Steering(Protocol):
    """The driver of a manual run: its actions are executed before a step."""

    def begin(self, run: Orchestrator) -> None:
        """Take over a run whose signals are connected."""

    def before(self, number: int) -> None:
        """Return when it is time for a step; what is done by hand is done here."""

    def after(self, number: int) -> None:
        """See what a step did."""

    def died(self, number: int, board: str, why: str) -> bool:
        """Handle the death of a board; return whether the run continues without it."""


class Orchestrator:
    """A run: all processes, and the values of all signals."""

    def __init__(
        self,
        setup: Setup,
        make_world: Callable[[tuple[str, ...]], World],
        steering: Steering | None = None,
    ) -> None:
        self._setup = setup
        self._make_world = make_world
        self.outcome = Outcome()
        self._context: zmq.Context[zmq.Socket[bytes]] = zmq.Context()
        self._boards = [self._process(p) for p in setup.boards]
        self._plant = self._process(setup.plant)
        self._names: list[str] = []
        self._values = np.zeros(0, np.int32)
        self._inputs: dict[str, Places] = {}
        self._outputs: dict[str, Places] = {}
        self._pending: list[Action] = []
        """The pending actions of started faults, by steps since the start of the run."""
        self._watched = [_Watch(fault) for fault in setup.faults]
        self._state = WorldState()
        self._is_stopped = False
        self._steering = steering
        self._set_on_boards: dict[str, float] = {}
        self._held: set[int] = set()
        """Places of magnets that hold since their board died."""
        self._killed: dict[str, float] = {}
        """The times at which dead boards were killed."""
        self._clock = WallClock(1 / setup.pace.hz) if setup.pace.hz else None
        self._estimator: Estimating | None = None

    def stop(self) -> None:
        """Let the run end after the present step, with its reports."""
        self._is_stopped = True

    def _process(self, program: Program) -> Process:
        endpoint = f"ipc://{self._setup.endpoints / program.name}"
        log = self._setup.out / f"{program.name}.log"
        log.unlink(missing_ok=True)
        kind: type[Process] = Process if program.window is None else BoardBehindRegisters
        if program.keeper is not None:
            kind = KeptBoard
        return kind(program, endpoint, log, self._setup.timeout, self._context)

    def run(self, progress: Callable[[int], None] = lambda _: None) -> Outcome:
        """Run to the end, or until interrupted; no process is left behind. Raises `CellError`."""
        try:
            if self._setup.estimator is not None:
                self._estimator = self._setup.estimator()
            self._connect()
            self._exchange_initial_values()
            self._check()
            self.outcome.ping_rate = ping(self._plant, self._setup.pings)
            self._go(progress)
            for process in (*self._boards, self._plant):
                if process.is_alive:
                    self._settle(process)
                    self.outcome.reports[process.program.name] = process.request_json(b"R")
            if isinstance(self._world.detect, Bounded):
                self.outcome.reports["camera"] = {"skipped": self._world.detect.skipped}
            if self._estimator is not None:
                self.outcome.reports["estimator"] = self._estimator.report()
            if self._clock is not None:
                self.outcome.pace = self._clock.as_json()
            self.outcome.not_begun = [watch.fault.text for watch in self._watched]
        finally:
            for process in (*self._boards, self._plant):
                process.end()
            if self._estimator is not None:
                self._estimator.close()
            self._context.destroy(linger=0)
        return self.outcome

    # --- the phases before the first step -----------------------------------------------------

    def _connect(self) -> None:
        """Read the signals of all processes, and assign an index to each signal."""
        writers: dict[str, str] = dict.fromkeys(WORLD_OUTPUTS, "world")
        for process in (*self._boards, self._plant):
            process.begin()
            for name in process.node.ports.outputs:
                if name in writers:
                    raise CellError(
                        f"`{name}` is written by {writers[name]} and {process.program.name}"
                    )
                writers[name] = process.program.name
        self._names = sorted(writers)
        place = {name: index for index, name in enumerate(self._names)}
        readers = [(p.program.name, p.node.ports.inputs) for p in (*self._boards, self._plant)]
        for reader, inputs in (*readers, ("world", world.SEEN)):
            for name in inputs:
                if name not in place:
                    raise CellError(f"{reader} reads `{name}`, which nobody writes")
            self._inputs[reader] = np.array([place[name] for name in inputs], np.intp)
        for process in (*self._boards, self._plant):
            outputs = [place[name] for name in process.node.ports.outputs]
            self._outputs[process.program.name] = np.array(outputs, np.intp)
            self.outcome.states |= process.node.states
        self._outputs["world"] = np.array([place[name] for name in WORLD_OUTPUTS], np.intp)
        self._values = np.zeros(len(place), np.int32)
        self._clear = place["operator.clear"]
        self._slots = {slot: place[f"slot.{slot}"] for slot in SLOTS}
        self._states = {name: place[f"{name}.state"] for name in self.outcome.states}
        for watch in self._watched:
            self._prepare(watch)
        self._world = self._make_world(self.outcome.states.get("supervisor", ()))
        if self._estimator is not None:
            self._world = replace(self._world, estimate=self._estimator)

    def _prepare(self, watch: _Watch) -> None:
        """Find the states that a fault waits for."""
        trigger = watch.fault.trigger
        if trigger.state:
            states = self.outcome.states.get(trigger.machine, ())
            watch.numbers = _numbers(trigger.machine, trigger.state, states)

    def _exchange_initial_values(self) -> None:
        """Initialise the plant first, as the boards need its initial positions."""
        for process in (self._plant, *self._boards):
            self._initial(process)

    def _initial(self, process: Process) -> None:
        name = process.program.name
        body = process.request(b"I", self._values[self._inputs[name]].astype("<i4").tobytes())
        if len(body) != 4 * len(self._outputs[name]):
            raise CellError(
                f"{name} has {len(self._outputs[name])} outputs, but sent {len(body) / 4:g}"
            )
        self._values[self._outputs[name]] = np.frombuffer(body, "<i4")
        self._hold(name)

    def _check(self) -> None:
        for process in (*self._boards, self._plant):
            self._check_one(process)

    def _check_one(self, process: Process) -> None:
        told = process.request_json(b"K")
        if not told.get("ok"):
            raise CellError(
                f"{process.program.name} is not ready: {told.get('why', 'no reason given')}"
            )

    # --- stepping -------------------------------------------------------------------------------

    def _go(self, progress: Callable[[int], None]) -> None:
        about = {**self._setup.about, "states": self.outcome.states}
        begin = time.perf_counter()
        if self._steering is not None:
            self._steering.begin(self)
        with Recorder(self._setup.out / "run.rec", self._names, about) as recorder:
            try:
                cycle = self._setup.pace.steps
                for begins in range(1, self._setup.steps + 1, cycle):
                    if self._steering is not None:
                        self._steering.before(begins)
                    if self._is_stopped:
                        break
                    self._step_boards(begins)
                    for number in range(begins, begins + cycle):
                        self._step_plant(number)
                        recorder.add(self._values)
                        self.outcome.steps = number
                        if self._steering is not None:
                            self._steering.after(number)
                        if number % 1000 == 0:
                            progress(number)
            finally:
                self.outcome.seconds = time.perf_counter() - begin

    def _step_boards(self, number: int) -> None:
        """Apply faults, send the inputs of the boards and receive their outputs."""
        if self._clock is not None:
            self._clock.wait()
        if self._watched:
            self._start_faults(number)
        if self._pending and self._pending[0].step <= number:
            self._apply_faults(number)
        frames = self._frames()
        alive = [board for board in self._boards if board.is_alive]
        for board in alive:
            if board.asked is None:
                self._request(board, number, frames)
        if self._clock is None:
            for board in alive:
                self._answer_or_die(board, number)
        else:
            self._take_answers(self._clock, alive)

    def _take_answers(self, clock: WallClock, boards: list[Process]) -> None:
        """Take what comes in time. Who is late is given no new inputs until its answer is here."""
        waiting = list(boards)
        while waiting:
            ready = answering(waiting, clock.time_to_answer())
            if not ready:
                break
            for board in ready:
                name = board.program.name
                self._answer(board)
                clock.exchanges.setdefault(name, []).append(clock.now() - board.asked_at)
                waiting.remove(board)
        for board in waiting:
            name = board.program.name
            if not board.is_running:
                self._answer_or_die(board, board.asked or 0)
                continue
            clock.unanswered[name] = clock.unanswered.get(name, 0) + 1

    def _answer_or_die(self, board: Process, number: int) -> None:
        """Take the answer of a board; raise `CellError` if it died, unless the run goes on."""
        try:
            self._answer(board)
        except CellError as error:
            steering = self._steering
            if steering is None or board.is_running:
                raise
            if not steering.died(number, board.program.name, str(error)):
                raise
            self.outcome.told.append(f"{number / 1000:.3f} s died {board.program.name} 0")
            self._bury(board)

    def _settle(self, process: Process) -> None:
        """Take an answer that is still to come: a connection carries one request at a time."""
        if process.asked is not None:
            self._answer(process)

    def _step_plant(self, number: int) -> None:
        """Step plant and world."""
        self._request(self._plant, number, self._frames())
        self._answer(self._plant)
        seen = self._values[self._inputs["world"]].tolist()
        self._state, told = world.step(self._world, self._state, number, seen)
        self._values[self._outputs["world"]] = told
        if self._held and self._values[self._clear]:
            self._take_off()

    def _hold(self, name: str) -> None:
        """Let magnets hold what they held, until their board has switched them on."""
        for place in self._held.intersection(self._outputs[name].tolist()):
            if self._values[place]:
                self._held.remove(place)
            self._values[place] = 1

    def _take_off(self) -> None:
        """Let the operator take blocks off the magnets that hold since their board died."""
        for bit, name in enumerate(KEPT):
            place = self._names.index(name)
            if place in self._held:
                self._values[self._clear] |= HANDS << bit
                self._values[place] = 0
        self._held.clear()

    def _frames(self) -> dict[str, int]:
        return {board.program.name: board.frames for board in self._boards}

    def _request(self, process: Process, number: int, frames: Mapping[str, int]) -> None:
        name, peers = process.program.name, process.node.peers
        if peers is None:
            peers = tuple(board for board in frames if board != name)
        expected = [frames.get(peer, 0) for peer in peers]
        process.send(b"S", step_request(number, expected, self._values[self._inputs[name]]))
        process.asked, process.asked_at = number, time.monotonic()

    def _answer(self, process: Process) -> None:
        """Receive the reply to the last step requested from a process."""
        places, number = self._outputs[process.program.name], process.asked or 0
        try:
            frames, values = read_step_reply(process.receive(b"S"), number, len(places))
        except ProtocolError as error:
            raise CellError(f"{process.program.name} {error}") from error
        process.asked, process.frames = None, frames
        self._values[places] = values
        if self._held:
            self._hold(process.program.name)

    # --- by hand -------------------------------------------------------------------------------

    @property
    def names(self) -> Sequence[str]:
        """The names of all signals."""
        return self._names

    @property
    def values(self) -> npt.NDArray[np.int32]:
        """Their values, in this order; each step writes them anew."""
        return self._values

    def report(self, name: str) -> Mapping[str, Any]:
        """Return the current report of a process; empty if it is dead."""
        for process in (*self._boards, self._plant):
            if process.program.name == name and process.is_alive:
                self._settle(process)
                return process.request_json(b"R")
        return {}

    @property
    def boards(self) -> tuple[str, ...]:
        """The names of the boards."""
        return tuple(board.program.name for board in self._boards)

    def is_alive(self, name: str) -> bool:
        """Whether a board runs."""
        return self._board(name).is_alive

    def restart(self, name: str) -> None:
        """Restart a dead board. Raises `CellError`."""
        board = self._board(name)
        if board.is_alive:
            raise CellError(f"board {name} runs")
        self._restart(board)

    def operate(self, change: Callable[[OperatorState], OperatorState]) -> None:
        """Let the operator know something."""
        self._state = replace(self._state, operator=change(self._state.operator))

    def open_chain(self, *, is_open: bool) -> None:
        """Open or close the emergency chain."""
        self._state = replace(self._state, estop=int(is_open))

    def watch_for(self, fault: Fault) -> None:
        """Start a fault when its trigger occurs. Raises `CellError`."""
        watch = _Watch(fault)
        self._prepare(watch)
        self._watched.append(watch)

    # --- faults ---------------------------------------------------------------------------------

    def _start_faults(self, number: int) -> None:
        """Start the faults whose triggers have occurred."""
        for watch in tuple(self._watched):
            if not self._has_come(watch, number):
                continue
            self._watched.remove(watch)
            self.outcome.begun.append((number, watch.fault.text))
            moved = (replace(a, step=number + a.step) for a in watch.fault.actions)
            self._pending = sorted((*self._pending, *moved))

    def _has_come(self, watch: _Watch, number: int) -> bool:
        """Return whether a fault starts now: state entries counted, slot occupied."""
        trigger = watch.fault.trigger
        if watch.due is None:
            if trigger.state:
                is_there = int(self._values[self._states[trigger.machine]]) in watch.numbers
                is_counted = is_there and not watch.was_there and number >= trigger.at
                watch.entered += is_counted
                watch.was_there = is_there
                if watch.entered < trigger.nth:
                    return False
            watch.due = max(number, trigger.at) + trigger.after
        is_full = not trigger.slot or bool(self._values[self._slots[trigger.slot]])
        return number >= watch.due and is_full

    def _apply_faults(self, number: int) -> None:
        """Execute the actions of faults at this step."""
        due = [a for a in self._pending if a.step <= number]
        self._pending = [a for a in self._pending if a.step > number]
        for action in due:
            self._act(action)
            text = " ".join(t for t in (action.target, action.name) if t)
            self.outcome.told.append(f"{number / 1000:.3f} s {text} {action.value:g}")

    def _act(self, action: Action) -> None:
        match action.target:
            case "plant":
                _set(self._plant, action.name, action.value)
            case "boards":
                self._set_on_boards[action.name] = action.value
                for board in self._boards:
                    if board.is_alive:
                        self._settle(board)
                        _set(board, action.name, action.value)
            case "estop":
                self.open_chain(is_open=bool(action.value))
            case "kill" if action.name == ESTIMATOR and self._estimator is not None:
                self._estimator.kill()
            case "restart" if action.name == ESTIMATOR and self._estimator is not None:
                self._estimator.begin()
            case "kill":
                self._kill(self._board(action.name))
            case _:
                self._restart(self._board(action.name))

    def _board(self, name: str) -> Process:
        found = [board for board in self._boards if board.program.name == name]
        if not found:
            known = ", ".join(board.program.name for board in self._boards)
            raise CellError(f"there is no board `{name}`; there are {known}")
        return found[0]

    def _kill(self, board: Process) -> None:
        """Kill a board: its motors are without power, its magnets stay as they are."""
        name = board.program.name
        self._settle(board)
        self.outcome.lives.setdefault(name, []).append(board.request_json(b"R"))
        self._bury(board)
        self._killed[name] = time.monotonic()

    def _bury(self, board: Process) -> None:
        board.kill()
        for place in self._outputs[board.program.name]:
            if self._names[place] not in KEPT:
                self._values[place] = 0
            elif self._values[place]:
                self._held.add(int(place))

    def _restart(self, board: Process) -> None:
        """Restart a killed board; it starts as from power-up, with the same faults."""
        board.begin()
        self._initial(board)
        self._check_one(board)
        for name, value in self._set_on_boards.items():
            _set(board, name, value)
        if (killed := self._killed.pop(board.program.name, None)) is not None:
            seconds = round(time.monotonic() - killed, 3)
            self.outcome.back.setdefault(board.program.name, []).append(seconds)


def _numbers(machine: str, state: str, states: tuple[str, ...]) -> frozenset[int]:
    """Return the numbers of a state and of those below it. Raises `CellError`."""
    machines = fsmkit.read_system(CHARTS / "ring.yaml").machines
    chart = next((found.chart for found in machines if found.name == machine), None)
    if chart is None:
        known = ", ".join(found.name for found in machines)
        raise CellError(f"the cell has no machine `{machine}`; it has {known}")
    found = next((s for s in chart.states[1:] if s.id == state), None)
    if found is None or not states:
        known = ", ".join(s.id for s in chart.states[1:]) if states else "none that a board reports"
        raise CellError(f"{machine} has no state `{state}`; it has {known}")
    below = chart.states[found.index : found.last_descendant + 1]
    return frozenset(states.index(s.id) for s in below if s.id in states)


def _set(process: Process, name: str, value: float) -> None:
    """Set a parameter of a process."""
    process.request_json(b"P", {"name": name, "value": value})
