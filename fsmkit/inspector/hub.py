"""The hub: commands in, messages out. It has no sockets and no clocks; others call it.

A client joins, is told all, and gives commands, each of which is answered once. While the session
runs, `Hub.advance` says how much real time passed.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from fsmkit.chart.chart import Chart
from fsmkit.diagnostics import FsmkitError, fail
from fsmkit.diagnostics.suggest import suggest
from fsmkit.inspector import breakpoints, commands, queries, saving
from fsmkit.inspector.breakpoints import Breakpoint, machine_of, own_names
from fsmkit.inspector.charts import chart_message
from fsmkit.inspector.commands import AnyCommand, read_command, wrong
from fsmkit.inspector.history import LIMIT, ClientAction, History
from fsmkit.inspector.simulation import FOR_EVER, Moment, Passed, Simulation, Stepped
from fsmkit.language import Value
from fsmkit.runtime.interpreter.snapshot import Macrostep, Occurrence
from fsmkit.runtime.interpreter.trace import trace_lines, value_text
from fsmkit.runtime.live import messages
from fsmkit.runtime.live.messages import (
    PROTOCOL,
    AnyMessage,
    Hello,
    Mode,
    Named,
    Pass,
    Post,
    Refused,
    Set,
    to_json,
)
from fsmkit.runtime.live.steps import hash_of, row_of_event, rows_of, state_of, step_of
from fsmkit.runtime.live.values import from_json as value_from
from fsmkit.runtime.live.values import to_json as value_json
from fsmkit.runtime.session import is_received
from fsmkit.system.system import System, port_name, system_of

MOST_STEPS = 1_000
"""Steps in one call of `advance`: whoever calls has other work, too."""
SLOWEST, FASTEST = 0.001, 1000.0
"""Speeds; 0 is as fast as can be."""
MOST_RESENT = 10_000
"""Entries that are sent again at once."""
STATE_EVERY = 1_000
"""Steps after which each machine is sent as a whole again."""
CLOCK_EVERY = 100_000
"""Microseconds of real time between two messages of nothing but the time."""
BY_HAND = "change"
"""The word for what a client did to data; no script has it."""
Send = Callable[[bytes], None]


@dataclass(slots=True)
class _Client:
    send: Send
    may_command: bool


class Hub:
    """A session of a simulated chart or system.

    Args:
        model: A chart, or a system.
        file: Where it was read from, which saved tests name.
        session: What the session is called.
        seed: Of the answers of operations and of delays that are intervals.
        limit: Bytes that the history keeps.

    """

    def __init__(
        self,
        model: Chart | System,
        *,
        file: Path | None = None,
        session: str = "",
        seed: int = 1,
        limit: int = LIMIT,
    ) -> None:
        self.system = system_of(model) if isinstance(model, Chart) else model
        self.simulation = Simulation(self.system, seed)
        self.session = session
        self._file = file
        self._clients: dict[int, _Client] = {}
        self._next_client = 1
        self._points: dict[int, Breakpoint] = {}
        self._hit: dict[int, int] = {}
        self._next_point = 1
        self._until: Breakpoint | None = None
        self._charts: dict[str, bytes] = {}
        self._is_running = False
        self._speed = 1.0
        self._due = 0.0
        self._since_clock = 0
        self._why: list[Any] = []
        self.moment: Moment = self.simulation.begin()
        """The system at the step in view."""
        self.n = 0
        """The step in view."""
        self._history = History(self.moment, limit)
        self._settle()

    # --- clients -------------------------------------------------------------------------------

    def join(self, send: Send, *, may_command: bool = True) -> int:
        """Take a client in, to whom messages are sent as JSON; return its number."""
        number, self._next_client = self._next_client, self._next_client + 1
        self._clients[number] = _Client(send, may_command)
        self.welcome(number)
        return number

    def welcome(self, client: int) -> None:
        """Send a client the whole state: at the beginning, and where it could not follow."""
        one = self._clients[client]
        for message in (self._hello(one), *self._states(), self._mode()):
            one.send(to_json(message))

    def leave(self, client: int) -> None:
        """Forget a client."""
        self._clients.pop(client, None)

    def receive(self, client: int, text: str | bytes) -> None:
        """Obey a command of a client, or refuse it; both are answered."""
        one = self._clients[client]
        number = commands.id_of(text)
        try:
            command = read_command(text)
            if isinstance(command, commands.CHANGING) and not one.may_command:
                raise wrong("this session is only looked at", "start it without `--read-only`")
            answer: AnyMessage = messages.Done(re=command.id, result=self._obey(one, command))
        except FsmkitError as error:
            first = error.diagnostics[0]
            answer = Refused(
                re=number, rule=first.rule.name, message=first.message, help=first.help or ""
            )
        one.send(to_json(answer))

    # --- time ----------------------------------------------------------------------------------

    @property
    def is_running(self) -> bool:
        """Whether `advance` would do something."""
        return self._is_running

    @property
    def wants_more(self) -> bool:
        """Whether there is more to do than `advance` did: it should be called again at once."""
        return self._is_running and (self._speed == 0 or self.moment.now < int(self._due))

    def advance(self, microseconds: int) -> None:
        """Go on by so much real time; nothing if the session stands still."""
        if not self._is_running:
            return
        self._due += microseconds * self._speed / self.simulation.tick
        until = FOR_EVER if self._speed == 0 else int(self._due)
        self._go(until, MOST_STEPS)
        self._since_clock += microseconds
        if self._is_running and self._since_clock >= CLOCK_EVERY:
            self._since_clock = 0
            self._broadcast(self._mode())

    def _go(self, until: int, most: int) -> None:
        """Step until a time, a breakpoint, a fault, or so many steps."""
        for _ in range(most):
            if not self._step(until):
                if until == FOR_EVER:
                    self._stop(["idle"])
                return
            if not self._is_running:
                return

    def _settle(self) -> None:
        """Start, and do what is to be done at the same time."""
        was_running, self._is_running = self._is_running, True
        self._go(self.moment.now, MOST_STEPS)
        if self._is_running:
            self._is_running = was_running

    def _step(self, until: int) -> bool:
        """Do a step; False if there is none until that time."""
        before = self.moment
        try:
            self.moment, done = self.simulation.step(before, until)
        except FsmkitError as error:
            self._stop(["fault", error.diagnostics[0].rule.name, error.diagnostics[0].message])
            return True
        if done is None:
            return False
        self.n = self._history.head + 1
        texts = [to_json(message) for message in self._messages(done)]
        self._history.add(self.moment, b",".join(texts))
        self._send(*texts)
        if self.n % STATE_EVERY == 0:
            self._send(*map(to_json, self._states()))
        self._look_at(before, done)
        return True

    def _messages(self, done: Stepped) -> list[AnyMessage]:
        """Return a step, then the events and inputs that it passed on."""
        charts, names = self.simulation.charts, self.simulation.names
        chart, name, at = charts[done.machine], names[done.machine], done.macrostep.at
        found: list[AnyMessage] = [step_of(chart, name, self.n, done.macrostep)]
        found += [self._pass(each, at) for each in done.passed]
        inputs: dict[int, dict[str, Any]] = {}
        for each in done.driven:
            target = charts[each.machine]
            if each.number < len(target.inputs):
                declared = target.inputs[each.number]
                told = inputs.setdefault(each.machine, {})
                told[declared.name] = value_json(each.value, declared.type)
            else:  # shared data are no inputs: the machine is sent as a whole
                snapshot = self.moment.snapshots[each.machine]
                found.append(state_of(target, names[each.machine], self.n, snapshot, at))
        found += [Set(m=names[m], n=self.n, at=at, inputs=told) for m, told in inputs.items()]
        return found

    def _pass(self, passed: Passed, at: int) -> Pass:
        link, names, charts = passed.link, self.simulation.names, self.simulation.charts
        event, *values = row_of_event(charts[link.target], passed.occurrence)
        return Pass(
            n=self.n,
            at=at,
            source=(names[link.source], port_name(charts[link.source], link.port)),
            target=(names[link.target], event),
            values=values,
            how="queued" if passed.has_room else "refused",
        )

    def _look_at(self, before: Moment, done: Stepped) -> None:
        """Stop where a breakpoint is hit or a machine has a fault."""
        hits = partial(breakpoints.hits, self.system, before=before, after=self.moment, done=done)
        for number, point in self._points.items():
            if hits(point):
                self._hit[number] = self._hit.get(number, 0) + 1
                if point.counts(self._hit[number]):
                    self._stop_or_log(number, point)
        if self._until is not None and hits(self._until):
            self._stop(["until", self._until.text])
        fault = done.macrostep.after.fault
        if fault is not None:
            self._stop(["fault", fault, self.simulation.names[done.machine]])

    def _stop_or_log(self, number: int, point: Breakpoint) -> None:
        if not point.log:
            self._stop(["breakpoint", number])
            return
        text = breakpoints.logged(self.system, point, self.moment.snapshots)
        self._broadcast(messages.Log(n=self.n, at=self.moment.now, number=number, text=text))

    def _stop(self, why: list[Any]) -> None:
        if self._is_running:
            self._is_running, self._until, self._why = False, None, why
            self._broadcast(self._mode())

    # --- commands ------------------------------------------------------------------------------

    def _obey(self, client: _Client, command: AnyCommand) -> Any:
        match command:
            case commands.Post():
                return self._post(command)
            case commands.SetInput():
                return self._set(command)
            case commands.Run():
                return self._run(command)
            case commands.Pause():
                self._stop(["asked"])
                return None
            case commands.StepOn(how=how):
                return self._step_on(how)
            case commands.Change():
                return self._change(command)
            case commands.Back():
                return self._back(command)
            case commands.Forward(count=count):
                return self._seek(self.n + count)
            case commands.Seek(n=n, at=at):
                return self._seek(n if n is not None else self._step_at(at or 0))
            case commands.Break():
                return self.add_breakpoint(command)
            case commands.Unbreak(number=number):
                return self._unbreak(number)
            case commands.Watch(expression=text, m=machine):
                expression = queries.read(self.system, text, own_names(self.system, machine), None)
                return queries.shown(expression, self.moment.snapshots)
            case commands.Why():
                return self._explain(command)
            case commands.Events(m=name):
                place = machine_of(self.system, name)
                return queries.events(self.simulation.charts[place], self.moment.snapshots[place])
            case commands.Micro(n=n):
                return self._micro(n)
            case commands.ChartWanted(chart=hash_):
                client.send(self._chart(hash_))
                return None
            case commands.History(first=first, last=last):
                return self._resend(client, first, last)
            case commands.Branches():
                return self._branches()
            case commands.Fork(branch=number):
                return self._fork(number)
            case commands.Save(kind=kind):
                return self._save(kind)

    def _post(self, command: commands.Post) -> str:
        machine = machine_of(self.system, command.m)
        chart = self.simulation.charts[machine]
        occurrence = occurrence_of(chart, command.event, command.payload)
        self._begin_branch()
        after = self.simulation.post(self.moment, machine, occurrence)
        how = "refused" if after is None else "queued"
        self.moment = self.moment if after is None else after
        row = row_of_event(chart, occurrence)
        name = self.simulation.names[machine]
        words = [command.event, *map(value_text, occurrence.payload)]
        place = "" if self._is_alone else f"{name}."
        self._note(
            Post(m=name, n=self.n + 1, at=self.moment.now, event=row, how=how),
            f"post {place}{' '.join(words)}",
            is_refused=after is None,
        )
        if not self._is_running:
            self._settle()
        return how

    def _set(self, command: commands.SetInput) -> None:
        machine = machine_of(self.system, command.m)
        chart, name = self.simulation.charts[machine], self.simulation.names[machine]
        place = _place_of(command.input, [each.name for each in chart.inputs], "input")
        declared = chart.inputs[place]
        value = _value(command.value, declared.type, f"the input `{command.input}`")
        self._begin_branch()
        self.moment = self.simulation.set_input(self.moment, machine, place, value)
        told = {declared.name: value_json(value, declared.type)}
        self._note(
            Set(m=name, n=self.n + 1, at=self.moment.now, inputs=told),
            f"input {'' if self._is_alone else name + '.'}{declared.name} {value_text(value)}",
        )
        if not self._is_running:
            self._settle()

    def _change(self, command: commands.Change) -> None:
        machine = machine_of(self.system, command.m)
        chart, name = self.simulation.charts[machine], self.simulation.names[machine]
        place = _place_of(command.data, [each.name for each in chart.data], "datum")
        declared = chart.data[place]
        value = _value(command.value, declared.type, f"`{command.data}`")
        self._begin_branch()
        self.moment = self.simulation.set_data(self.moment, machine, place, value)
        told = {declared.name: value_json(value, declared.type)}
        self._note(
            Set(m=name, n=self.n + 1, at=self.moment.now, inputs={}, data=told),
            f"{BY_HAND} {name}.{declared.name} {value_text(value)}",
        )
        self._send(*map(to_json, self._states()))
        if not self._is_running:
            self._settle()

    def _run(self, command: commands.Run) -> None:
        if command.speed != 0 and not SLOWEST <= command.speed <= FASTEST:
            raise wrong(f"there is no speed {command.speed}", f"use 0 or {SLOWEST} to {FASTEST}")
        until = None
        if command.until:
            condition = commands.Break(id=0, on="condition", what=command.until)
            until = breakpoints.read(self.system, condition)
        self._begin_branch()
        self._until, self._speed, self._is_running = until, command.speed, True
        self._due, self._why = float(self.moment.now), []
        self._broadcast(self._mode())

    def _step_on(self, how: str) -> int:
        """Go on by little; in the past what happened is looked at again. Return the steps done."""
        if how not in ("macro", "timer", "tick"):
            raise wrong(f"there is no step `{how}`", "use macro, timer or tick")
        self._stop(["asked"])
        if how == "macro" and self.n < self._history.head:
            self._seek(self.n + 1)
            return 1
        self._begin_branch()
        first, self._is_running, self._why = self.n, True, ["stepped"]
        due = self.simulation.next_deadline(self.moment)
        match how:
            case "macro":
                self._go(FOR_EVER, 1)
            case "tick":
                self._go(self.moment.now + 1, MOST_STEPS)
            case _:
                self._go(self.moment.now if due is None else due, MOST_STEPS)
        self._is_running = False
        self._broadcast(self._mode())
        return self.n - first

    def _seek(self, n: int) -> int:
        """Look at a step; what happens from there on is a branch of its own. Return the step."""
        self._is_running = False
        n = max(self._history.first, min(n, self._history.head))
        kept, moment = self._history.before(n)
        for _ in range(n - kept):
            moment, _ = self.simulation.step(moment)
        self.n, self.moment, self._why = n, moment, ["sought"]
        self._send(*map(to_json, (*self._states(), self._mode())))
        return n

    def _back(self, command: commands.Back) -> int:
        if not command.to:
            return self._seek(self.n - command.count)
        points, any_point = self._points, command.to == "breakpoint"
        if not any_point:
            wanted = commands.Break(id=0, on=command.to, m=command.m, what=command.what)
            points = {0: breakpoints.read(self.system, wanted)}
        for n, before, after, done in self._steps_back():
            hits = partial(breakpoints.hits, self.system, before=before, after=after, done=done)
            number = next((k for k, point in points.items() if not point.log and hits(point)), None)
            fault = done.macrostep.after.fault if any_point else None
            if number is not None or fault is not None:
                found = self._seek(n)
                if any_point:
                    name = self.simulation.names[done.machine]
                    self._why = ["fault", fault, name] if number is None else ["breakpoint", number]
                    self._broadcast(self._mode())
                return found
        return self._seek(self._history.first)

    def _steps_back(self) -> Iterator[tuple[int, Moment, Moment, Stepped]]:
        """Yield the steps before the one in view, the latest first, each made again."""
        last = self.n - 1
        while last > self._history.first:
            kept, moment = self._history.before(last - 1)
            made: list[tuple[int, Moment, Moment, Stepped]] = []
            for n in range(kept + 1, last + 1):
                if n in self._history.branch.actions:
                    moment = self._history.branch.moments[n]
                    continue
                before = moment
                moment, done = self.simulation.step(before)
                if done is not None:
                    made.append((n, before, moment, done))
            yield from reversed(made)
            last = kept

    def _step_at(self, at: int) -> int:
        """Return the last step up to a time."""
        low, high = self._history.first, self._history.head
        while low < high:
            middle = (low + high + 1) // 2
            kept, moment = self._history.before(middle)
            for _ in range(middle - kept):
                moment, _ = self.simulation.step(moment)
            low, high = (middle, high) if moment.now <= at else (low, middle - 1)
        return low

    def add_breakpoint(self, command: commands.Break) -> int:
        """Add a breakpoint; return its number. `FsmkitError` for names that there are not."""
        if len(self._points) >= breakpoints.MOST:
            raise wrong(f"there are {breakpoints.MOST} breakpoints", "remove one")
        point = breakpoints.read(self.system, command)
        number, self._next_point = self._next_point, self._next_point + 1
        self._points[number] = point
        return number

    def _unbreak(self, number: int) -> None:
        if self._points.pop(number, None) is None:
            raise wrong(f"there is no breakpoint {number}")
        self._hit.pop(number, None)

    def _explain(self, command: commands.Why) -> Any:
        machine = machine_of(self.system, command.m)
        chart = self.simulation.charts[machine]
        snapshot = self.moment.snapshots[machine]
        event = _received(chart, command.event)
        if command.payload is None and chart.events[event].fields:
            return queries.why(chart, snapshot, event, None)
        occurrence = occurrence_of(chart, command.event, command.payload or {})
        return queries.why(chart, snapshot, event, occurrence.payload)

    def _micro(self, n: int) -> Any:
        """Return the microsteps of a step, made again."""
        done = self.stepped(n)
        chart = self.simulation.charts[done.machine]
        return [
            {
                "transitions": list(small.transitions),
                "exited": [chart.states[state].id for state in small.exited],
                "entered": [chart.states[state].id for state in small.entered],
                "do": [row for effect in small.effects for row in rows_of(chart, effect)],
            }
            for small in done.macrostep.microsteps
        ]

    @property
    def head(self) -> int:
        """The last step of the branch in view."""
        return self._history.head

    @property
    def stepped_in_view(self) -> Stepped | None:
        """The macrostep that led to the step in view; None where a client did, or nothing."""
        is_known = self._history.first < self.n <= self._history.head
        is_step = is_known and self.n not in self._history.branch.actions
        return self.stepped(self.n) if is_step else None

    def stepped(self, n: int) -> Stepped:
        """Return a step, made again; `FsmkitError` for an entry that is none."""
        if not self._history.first < n <= self._history.head:
            raise wrong(f"there is no step {n}")
        kept, moment = self._history.before(n - 1)
        done: Stepped | None = None
        for _ in range(n - kept):
            moment, done = self.simulation.step(moment)
        if done is None or n in self._history.branch.actions:
            raise wrong(f"entry {n} is no step")
        return done

    def _chart(self, hash_: str) -> bytes:
        charts = {hash_of(chart): chart for chart in self.simulation.charts}
        if hash_ not in charts:
            raise wrong("this session has no chart of that hash", "use those of `hello`")
        if hash_ not in self._charts:
            self._charts[hash_] = to_json(chart_message(charts[hash_]))
        return self._charts[hash_]

    def _resend(self, client: _Client, first: int, last: int | None) -> dict[str, int]:
        first = max(first, self._history.first)
        last = min(self._history.head if last is None else last, first + MOST_RESENT - 1)
        last = min(last, self._history.head)
        texts = list(self._history.texts(first, last))
        if texts:
            client.send(b"[" + b",".join(texts) + b"]")
        return {"first": first, "last": last}

    def _branches(self) -> list[dict[str, int]]:
        return [
            {"branch": number, "first": branch.first, "head": branch.head}
            for number, branch in sorted(self._history.others.items())
        ]

    def _fork(self, number: int) -> int:
        if number not in self._history.others:
            raise wrong(f"there is no branch {number}")
        self._history.switch(number)
        return self._seek(self._history.head)

    def _save(self, kind: str) -> str:
        branch = self._history.branch
        if kind == "live":
            head = [to_json(self._hello(None)), *map(self._chart, self._hashes())]
            return b"\n".join(
                [*head, *(b"[" + text + b"]" for text in filter(None, branch.texts)), b""]
            ).decode()
        if kind not in ("script", "pytest"):
            raise wrong(f"nothing is saved as `{kind}`", "use script, pytest or live")
        if branch.first:
            raise wrong("the first steps are forgotten", "save as `live`")
        lines, trace = self._made_again()
        seed = self.simulation.seed
        lines = [*lines, f"run {self._now}"]
        script = saving.script_of(self.system, lines, trace, seed)
        if kind == "script":
            return "".join(f"{line}\n" for line in script)
        if self._file is None:
            raise wrong("no test can name the file of this session", "save as `script`")
        return saving.pytest_of(self._file, script, trace, seed)

    @property
    def _now(self) -> int:
        """The time at the end of the branch."""
        if self.n == self._history.head:
            return self.moment.now
        kept, moment = self._history.before(self._history.head)
        for _ in range(self._history.head - kept):
            moment, _ = self.simulation.step(moment)
        return moment.now

    def _made_again(self) -> tuple[list[str], list[str]]:
        """Return the branch as a script, and its trace, made again."""
        branch = self._history.branch
        seed = self.simulation.seed
        script = [f"seed {seed}"] if self._is_alone and seed != 1 else []
        lines: list[str] = []
        moment, is_started = branch.moments[0], False
        for n in range(1, branch.head + 1):
            if n in branch.actions:
                moment, by = branch.moments[n], branch.actions[n]
                run = [f"run {by.at}"] if is_started else []
                script += [*run, by.line, *run]
                machine = "" if self._is_alone else by.line.split()[1].partition(".")[0] + ": "
                lines += [f"{machine}full queue"] if by.is_refused else []
                continue
            if not is_started:
                script += ["start 0" if self._is_alone else "start", "run 0"]
                is_started = True
            moment, done = self.simulation.step(moment)
            if done is not None:
                lines += self._lines(done.machine, done.macrostep)
        return script, lines

    def _lines(self, machine: int, macrostep: Macrostep) -> Iterable[str]:
        lines = trace_lines(self.simulation.charts[machine], (macrostep,))
        name = self.simulation.names[machine]
        return lines if self._is_alone else (f"{name}: {line}" for line in lines)

    # --- inside --------------------------------------------------------------------------------

    @property
    def _is_alone(self) -> bool:
        return self.system.is_open and len(self.simulation.names) == 1

    def _begin_branch(self) -> None:
        """Let what comes follow the step in view; what followed it stays as another branch."""
        number = self._history.number
        self._history.cut(self.n, self.moment)
        if self._history.number != number:
            self._broadcast(self._mode())

    def _note(self, message: AnyMessage, line: str, *, is_refused: bool = False) -> None:
        """Keep that a client did something, and send it to all."""
        text = to_json(message)
        action = ClientAction(line, self.moment.now, is_refused)
        self.n = self._history.add(self.moment, text, action)
        self._send(text)

    def _hashes(self) -> list[str]:
        return list(dict.fromkeys(map(hash_of, self.simulation.charts)))

    def _hello(self, client: _Client | None) -> Hello:
        names = zip(self.simulation.names, self.simulation.charts, strict=True)
        return Hello(
            protocol=PROTOCOL,
            session=self.session,
            name=self.system.name,
            time="simulated",
            tick_us=self.simulation.tick,
            at=self.moment.now,
            n=self.n,
            can=commands.NAMES,
            machines=[Named(m=name, chart=hash_of(chart)) for name, chart in names],
            readonly=client is not None and not client.may_command,
        )

    def _states(self) -> list[AnyMessage]:
        each = zip(
            self.simulation.charts, self.simulation.names, self.moment.snapshots, strict=True
        )
        return [
            state_of(chart, name, self.n, snapshot, self.moment.now)
            for chart, name, snapshot in each
        ]

    def _mode(self) -> Mode:
        return Mode(
            mode="running" if self._is_running else "paused",
            n=self.n,
            head=self._history.head,
            at=self.moment.now,
            branch=self._history.number,
            first=self._history.first,
            speed=self._speed,
            why=self._why,
        )

    def _broadcast(self, message: AnyMessage) -> None:
        self._send(to_json(message))

    def _send(self, *texts: bytes) -> None:
        """Send messages to all, several as an array."""
        text = texts[0] if len(texts) == 1 else b"[" + b",".join(texts) + b"]"
        for client in self._clients.values():
            client.send(text)


def occurrence_of(chart: Chart, name: str, payload: dict[str, Any]) -> Occurrence:
    """Return an event with the payload that a client gave; `FsmkitError` for what does not fit."""
    event = chart.events[_received(chart, name)]
    names = [each.name for each in event.fields]
    if set(payload) != set(names):
        takes = ", ".join(f"`{each}`" for each in names) or "no values"
        raise fail("wrong-value", f"the event `{name}` takes {takes}", help="give each once")
    return Occurrence(
        event.index,
        tuple(
            _value(payload[each.name], each.type, f"`{each.name}` of `{name}`")
            for each in event.fields
        ),
    )


def _received(chart: Chart, name: str) -> int:
    known = [event.name for event in chart.events if is_received(event)]
    _place_of(name, known, "event")
    return chart.event_index[name]


def _place_of(name: str, known: list[str], kind: str) -> int:
    if name not in known:
        help_ = suggest(name, known, f"use one of {', '.join(known[:8])}" if known else "")
        raise fail("unknown-name", f"there is no {kind} `{name}`", help=help_ or None)
    return known.index(name)


def _value(given: Any, type_: Any, what: str) -> Value:
    try:
        return value_from(given, type_)
    except ValueError as error:
        raise fail("wrong-value", f"{what} {error}") from error
