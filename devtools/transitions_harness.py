"""Run a machine of the library by a script, and return the trace of the interpreter.

The library does not report exits and entries, so a first callback marks each exit, transition and
entry. A chart executes all exits, all content, then all entries; the library does so transition by
transition. The marks are sorted into the order of the chart if that keeps the order of the calls
of the host.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Any

from fsmkit.chart.chart import Chart
from fsmkit.codegen.transitions.generate import module_text
from fsmkit.codegen.transitions.limits import check
from fsmkit.codegen.transitions.moves import moves_of
from fsmkit.diagnostics import Findings, FsmkitError, Text
from fsmkit.document.document import Kind
from fsmkit.language import Value
from fsmkit.runtime.interpreter.snapshot import Occurrence, Posted
from fsmkit.runtime.interpreter.trace import CLOCK, effect_line, value_text
from fsmkit.runtime.script import PostDuringCall, SeededHost, read_line, script_texts, wrong_line

LONGEST = 1000
"""Events in one macrostep, after which the library is not waited for."""


@dataclass(frozen=True, slots=True)
class TransitionsHarness:
    """Runs charts on the library; raises `FsmkitError` for charts that the target rejects."""

    name: str = "transitions"

    def run(self, chart: Chart, script: Sequence[str]) -> list[str]:
        """Run a script on the generated module, and return its trace."""
        findings = Findings()
        if not check(chart, findings):
            raise FsmkitError(findings)
        player = Player(chart)
        for line in script_texts(script):
            player.play(line)
        return player.told


@dataclass
class Mark:
    """An exit, a transition or an entry, and the calls of the host since the last mark."""

    order: tuple[int, int]
    """The round of the step, and the place in it."""
    line: str
    told: list[str] = field(default_factory=list)


class Player:
    """A machine under a script."""

    def __init__(self, chart: Chart) -> None:
        """Generate the module and load it."""
        self.chart = chart
        self.moves = moves_of(chart)
        self.names = self.moves.names
        self.facts = self.moves.facts
        self.host = SeededHost(chart)
        self.host.accept_posts(chart, self._post_within)
        self.told: list[str] = []
        self.inputs: dict[str, Value] = {}
        self.queue: list[tuple[str, tuple[Value, ...]]] = []
        self.now = 0
        """Ticks; not wrapped: the machine compares times as numbers."""
        self.sent: dict[object, int] = {}
        """Events, by the methods of the host that send them."""
        self._first = 0
        self._space: dict[str, Any] = {"__name__": f"fsmkit_generated_{self.names.names.machine}"}
        code = compile(module_text(chart), f"<{chart.name}>", "exec", dont_inherit=True)
        exec(code, self._space)  # noqa: S102  (the text is our own)
        self.machine: TracedMachine | None = None

    @property
    def is_running(self) -> bool:
        """Return whether the machine was started and has not ended."""
        return self.machine is not None and not self.machine.is_finished

    def play(self, line: Text) -> None:
        """Execute a line."""
        read = read_line(self.chart, line)
        event = self.chart.events[read.event.event].name, read.event.payload
        match read.verb:
            case "start":
                self.now = read.number
                self.queue.clear()
                self._start()
            case "run":
                self.now += (read.number - self.now) % CLOCK
                self._run()
            case "post":
                if not self._post(read.event):
                    self.told.append("full queue")
            case "within":
                self.host.within = PostDuringCall(read.number, read.event)
            case "returns":
                self.host.given = {**self.host.given, read.name: read.results}
            case "dispatch":
                if self.is_running:
                    self._take(self.now, *event)
            case "at":
                self.now += (read.number - self.now) % CLOCK
            case "input":
                self.inputs[self.chart.inputs[read.number].name] = read.value
                self._set_inputs()
            case "seed":
                self.host.state = read.number
            case "dump":
                self.told += self._dump()
            case verb:
                raise wrong_line(line, f"`{verb}` is not a script line")

    def _post(self, occurrence: Occurrence) -> bool:
        fits = self.is_running and len(self.queue) < self.chart.capacities.queue
        if fits:
            self.queue.append((self.chart.events[occurrence.event].name, occurrence.payload))
        return fits

    def _post_within(self, occurrence: Occurrence) -> bool:
        """Post in the middle of a step."""
        assert self.machine is not None  # noqa: S101  (it called an operation)
        fits = self._post(occurrence)
        self.machine.add_line(str(effect_line(self.chart, Posted(occurrence, fits))))
        return fits

    def _run(self) -> None:
        """Process enabled inputs, posted events and expired timers."""
        if self.machine is not None and self.is_running and "inputs" in self.facts:
            self.machine.set_time(self.now)
            self.start_macrostep("eventless")
            self.machine.settle()
            self.end(is_empty=True)
        self.take_posted(self.now)
        if self.machine is not None and "timers" in self.facts:
            self.machine.wait(self.now)

    def take_posted(self, now: int) -> None:
        """Take the events that wait, at a time in ticks."""
        while self.queue and self.is_running:
            self._take(now, *self.queue.pop(0))

    def start_macrostep(self, cause: str) -> None:
        """Write the cause of a macrostep."""
        self._first = len(self.told)
        self.told.append(f"@{self.time % CLOCK} > {cause}")

    def end(self, *, is_empty: bool = False) -> None:
        """Write the end of a macrostep; ``is_empty``: nothing if it had no effect."""
        if is_empty and len(self.told) == self._first + 1:
            del self.told[self._first :]
        else:
            self.told.append(self._configuration())

    @property
    def time(self) -> int:
        """Return the time of the machine, which is earlier while it processes expired timers."""
        is_timed = self.machine is not None and "timers" in self.facts
        return self.machine.now() if self.machine is not None and is_timed else self.now

    def _start(self) -> None:
        self.machine = traced_machine(self)
        self._set_inputs()
        self.told.append(f"@{self.now % CLOCK} > start")
        if self.moves.has_start:
            self.machine.send(self.names.start, ())
        else:
            active = sorted(self.machine.active())
            self.told += [f"+ {self.chart.states[state].id}" for state in active]
            self.machine.end_if_final()
        self.told.append(self._configuration())

    def _take(self, now: int, event: str, payload: tuple[Value, ...]) -> None:
        assert self.machine is not None  # noqa: S101  (it runs)
        self.machine.set_time(now)
        self.start_macrostep(" ".join(("event", event, *map(value_text, payload))))
        self.machine.send(event, payload)
        self.end()

    def _set_inputs(self) -> None:
        if self.machine is not None:
            for name, value in self.inputs.items():
                setattr(self.machine.model, self.names.names.variables[name], value)

    def _configuration(self) -> str:
        assert self.machine is not None  # noqa: S101  (it was started)
        states = self.chart.states
        active = [states[s].id for s in sorted(self.machine.active()) if states[s].is_leaf]
        return " ".join(("=", *active, *(("finished",) if self.machine.is_finished else ())))

    def _dump(self) -> Iterator[str]:
        model = None if self.machine is None else self.machine.model
        for variable in (*self.chart.data, *self.chart.outputs):
            value: Any = variable.init.value
            if model is not None:
                value = getattr(model, self.names.names.variables[variable.name])
            yield f"d {variable.name} {value_text(frozen(value))}"

    def library_classes(self) -> tuple[type[Any], type[Any]]:
        """Return the generated classes of the model and of the machine."""
        machine = self.names.names.machine
        return self._space[f"{machine}Model"], self._space[f"{machine}Machine"]


class TracedMachine:
    """A machine of the library that writes a trace."""

    def __init__(self, player: Player, model: Any, machine: Any) -> None:
        """Put a mark in front of all callbacks."""
        self.chart, self.names, self._told = player.chart, player.names, player.told
        self._player = player
        self.model, self._machine = model, machine
        self.is_finished = False
        self._is_firing = False
        self._before: list[str] = []
        self._marks: list[Mark] = []
        self._steps = 0
        self.send_inside = model.trigger
        model.trigger = self._raise
        for state in self.chart.states[1:]:
            if state.is_history:
                continue
            found = machine.get_state(self.names.paths[state.index])
            left = partial(self._mark, (0, -state.index), f"- {state.id}")
            entered = partial(self._mark, (2, state.index), f"+ {state.id}")
            found.on_exit.insert(0, left)
            found.on_enter.insert(0, entered)
        seen: dict[tuple[str, str], int] = defaultdict(int)
        for entry in player.moves.entries():
            key = entry.trigger, entry.source
            found = machine.events[entry.trigger].transitions[entry.source][seen[key]]
            seen[key] += 1
            if entry.index is not None:
                taken = partial(self._mark, (1, entry.index), f"t {entry.index}")
                (found.before if entry.place == "before" else found.after).insert(0, taken)

    def add_line(self, line: str) -> None:
        """Add a line about a call of the host."""
        (self._marks[-1].told if self._marks else self._before).append(line)

    def _mark(self, order: tuple[int, int], line: str, event: object) -> None:
        del event
        self._marks.append(Mark(order, line))

    # --- time ---------------------------------------------------------------------------------

    def now(self) -> int:
        """Return the time of the machine, which has timers."""
        return int(self._machine.now)

    def set_time(self, now: int) -> None:
        """Let the machine know the time, if it has timers."""
        if "timers" in self._player.facts:
            self._machine.now = now

    def settle(self) -> None:
        """Take the transitions that inputs have enabled."""
        self._machine.settle()

    def wait(self, now: int) -> None:
        """Fire the expired timers."""
        self._machine.wait(now)

    def fire(self, call: Callable[[], None]) -> None:
        """Fire the expired timers, then write them to the trace."""
        _, _, name, _, what, arguments = min(self._machine.deadlines)
        self.set_time(min(self._machine.deadlines)[0])
        if isinstance(name, int):
            self._player.start_macrostep(f"timeout {name}")
        elif what != self._raise:
            call()  # it leaves the machine
            self._told += self._before
            self._before = []
            return
        else:
            event, *values = arguments
            shown = (value_text(frozen(value)) for value in values)
            self._player.start_macrostep(" ".join(("event", event, *shown)))
        self._is_firing = True
        call()
        self._player.end()
        self._player.take_posted(self.now())

    def add_delay(self, name: object, delay: int, call: object, arguments: list[Any]) -> None:
        """Write the line of a delayed event; timers of states have none."""
        if isinstance(name, int):
            return
        if call == self._raise:
            event, *values = arguments
        else:
            index = self._player.sent[getattr(call, "__func__", call)]
            values = arguments[: len(self.chart.events[index].fields)]
            event = self.chart.events[index].name
        shown = (value_text(frozen(value)) for value in values)
        self.add_line(" ".join(("delay", event, *shown, f"in {delay}")))

    def add_cancel(self, names: tuple[object, ...]) -> None:
        """Write the line of a cancelled event."""
        for name in names:
            if isinstance(name, str):
                self.add_line(f"cancel {name}")

    # --- events -------------------------------------------------------------------------------

    def _raise(self, event: str, *arguments: object) -> bool:
        if self._is_firing:
            self._is_firing = False
            self._steps = 0
            return bool(self.send_inside(event, *arguments))
        if not event.startswith("done.state."):
            shown = [value_text(frozen(argument)) for argument in arguments]
            self.add_line(" ".join(("raise", event, *shown)))
        return bool(self.send_inside(event, *arguments))

    def send(self, event: str, payload: tuple[Value, ...]) -> None:
        """Take an event, and those that content raises."""
        self._steps = 0
        self.send_inside(event, *payload)

    def close_step(self, event: str) -> None:
        """Write the trace of one event; called when the library has finished it."""
        self._steps += 1
        if self._steps > LONGEST:
            raise RuntimeError(f"more than {LONGEST} events in one macrostep")
        if self.is_finished and not self._marks:
            return  # raised before the end: the library finds nothing that takes it
        is_exact = "order" in self._player.facts  # their order is that of the chart
        rounds = self._marks if is_exact else sorted(self._marks, key=lambda mark: mark.order)
        happened = [line for mark in self._marks for line in mark.told]
        ordered = rounds if [line for mark in rounds for line in mark.told] == happened else None
        self._told += self._before
        for mark in self._marks if ordered is None else ordered:
            self._told += [mark.line, *mark.told]
        own = (self.names.start, self.names.always, *self.names.timed.values())
        if not self._marks and event not in own:
            self._told.append(f"unhandled {event}")
        self._before, self._marks = [], []
        self.end_if_final()

    def add_guard_calls(self) -> None:
        """Write the calls of guards without a taken transition."""
        self._told += self._before
        self._before = []

    def end_if_final(self) -> None:
        """Note the end: a final state of the root is active."""
        for state in sorted(self.active()):
            is_top = self.chart.states[state].parent == 0
            if is_top and self.chart.states[state].kind is Kind.FINAL and not self.is_finished:
                self.is_finished = True
                self._told.append(f"- {self.chart.states[state].id}")

    def active(self) -> set[int]:
        """Return the active states."""
        by_path = {path: index for index, path in enumerate(self.names.paths)}
        found: set[int] = set()
        for path in flat(self.model.state):
            if path in by_path:
                leaf = by_path[path]
                found |= {leaf, *self.chart.ancestors(leaf)} - {0}
        return found


def traced_machine(player: Player) -> TracedMachine:
    """Return a new machine with the host of all harnesses."""
    model_class, machine_class = player.library_classes()
    here: list[TracedMachine] = []

    def add_line(line: str) -> None:
        here[0].add_line(line)

    methods = dict(_methods(player, add_line))
    model = type("Host", (model_class,), methods)()

    class FinishedReport(machine_class):  # type: ignore[misc, valid-type]
        """Reports when the library has finished an event."""

        trigger = ""

        def _trigger_event(self, event_data: Any, trigger: str) -> Any:
            self.trigger = trigger
            result = super()._trigger_event(event_data, trigger)
            self._close()
            return result

        def _close(self) -> None:
            if self.trigger:
                here[0].close_step(self.trigger)
            self.trigger = ""

        def settle(self) -> None:
            self._close()
            super().settle()

        def _take_always(self) -> bool:
            is_taken = bool(super()._take_always())
            if is_taken:
                here[0].close_step(player.names.always)
            else:
                here[0].add_guard_calls()
            return is_taken

        def fire(self) -> None:
            here[0].fire(super().fire)

        def arm(self, name: Any, delay: int, call: Any, *arguments: Any, **more: Any) -> None:
            here[0].add_delay(name, delay, call, list(arguments))
            super().arm(name, delay, call, *arguments, **more)

        def disarm(self, *names: Any) -> None:
            here[0].add_cancel(names)
            super().disarm(*names)

    time = {"now": player.now} if "timers" in player.facts else {}
    here.append(TracedMachine(player, model, FinishedReport(model, **time)))
    return here[0]


def _methods(
    player: Player, add_line: Callable[[str], None]
) -> Iterator[tuple[str, Callable[..., Any]]]:
    chart, names, host = player.chart, player.names, player.host

    def call(name: str, _: object, *arguments: object) -> Any:
        passed = tuple(frozen(argument) for argument in arguments)
        result = host.call(name, passed)
        tail = () if result is None else ("=", value_text(result))
        add_line(" ".join(("op", name, *map(value_text, passed), *tail)))
        return result

    def send(index: int, _: object, *arguments: object) -> None:
        event = chart.events[index]
        values = arguments[: len(event.fields)]
        peer = [one for one in arguments[len(event.fields) :] if one is not None]
        shown = [value_text(frozen(value)) for value in values]
        add_line(" ".join(("out", event.name, *shown, *(f"to {one}" for one in peer))))

    def log(_: object, label: str, *values: object) -> None:
        add_line(" ".join(("log", label, *(value_text(frozen(value)) for value in values))))

    sent = [_method(send, event.index) for event in chart.events]
    player.sent = {method: index for index, method in enumerate(sent)}
    for operation in chart.operations:
        yield names.names.operations[operation.name], _method(call, operation.name)
    for event in chart.events:
        yield f"send_{names.names.events[event.index]}", sent[event.index]
    yield "log", log


def _method(function: Callable[..., Any], first: object) -> Callable[..., Any]:
    """Return a function that a class makes a method of; a `partial` would not get ``self``."""
    return lambda self, *arguments: function(first, self, *arguments)


def frozen(value: Any) -> Value:
    """Return a value with tuples for lists."""
    return tuple(frozen(part) for part in value) if isinstance(value, list | tuple) else value


def flat(states: object) -> Iterator[str]:
    """Yield the names of active states from the nested lists of the library."""
    if isinstance(states, list):
        for state in states:
            yield from flat(state)
    else:
        yield str(states)
