"""The hub: commands in, messages out. It has no sockets and no clocks; others call it.

A client joins, is told all, and gives commands, each of which is answered once. While the session
runs, `Hub.advance` says how much real time passed. The session is simulated, or a source gives its
entries: something recorded is played back, something followed is shown as it comes. A branch that
a command begins is simulated, whatever it left.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from fsmkit.chart.chart import Chart
from fsmkit.diagnostics import FsmkitError
from fsmkit.inspector import breakpoints, commands, queries, saving
from fsmkit.inspector.arguments import input_of, occurrence_of, received
from fsmkit.inspector.breakpoints import Breakpoints, machine_of, own_names
from fsmkit.inspector.clients import Client, Clients, Send
from fsmkit.inspector.commands import AnyCommand, read_command, wrong
from fsmkit.inspector.course import Course, time_of
from fsmkit.inspector.history import LIMIT
from fsmkit.inspector.simulation import FOR_EVER, Moment, Simulation
from fsmkit.inspector.sources import Driven, Entry, Followed, Recorded
from fsmkit.inspector.picture import View
from fsmkit.runtime.live import messages
from fsmkit.runtime.live.messages import (
    PROTOCOL,
    AnyMessage,
    Hello,
    Json,
    Mode,
    Post,
    Refused,
    Set,
    Signals,
    Step,
    to_json,
)
from fsmkit.runtime.live.steps import row_of_event, rows_of
from fsmkit.runtime.live.values import to_json as value_json
from fsmkit.system.system import System, system_of

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
SIGNALS_EVERY = 16_600
"""Microseconds of real time between two messages of signals, at least."""
UNKNOWN = "the data are not known at this entry"
Source = Chart | System | Recorded | Followed


class Hub:
    """A session: of a simulated chart or system, or of what a source gives.

    Args:
        source: A chart, a system, or something recorded or followed.
        file: Where it was read from, which saved tests name.
        session: What the session is called.
        seed: Of the answers of operations and of delays that are intervals, in the interpreter.
        limit: Bytes that the history keeps.
        view: A picture of the plant.

    """

    def __init__(
        self,
        source: Source,
        *,
        file: Path | None = None,
        session: str = "",
        seed: int = 1,
        limit: int = LIMIT,
        view: View | None = None,
    ) -> None:
        self._view_of_plant = view
        self._followed = source if isinstance(source, Followed) else None
        self._recorded = source if isinstance(source, Recorded) else None
        self.system = system_within(source)
        self.simulation = Simulation(self.system, seed)
        self.session = session
        self._file = file
        self._clients = Clients()
        self._points = Breakpoints(self.system)
        self._is_running = False
        self._is_following = self._followed is not None
        self._gone: list[Json] | None = None
        """Why a followed source gives nothing more."""
        self._gathered: list[bytes] = []
        self._speed = 1.0
        self._due = 0.0
        self._since_clock = self._since_signals = self._head = 0
        self._why: list[Json] = []
        given = self._recorded or self._followed
        self.moment: Moment | None = self.simulation.begin() if given is None else given.begin
        """The system at the entry in view; None where it is not known."""
        self.n = 0
        """The entry in view."""
        self.at = 0 if self.moment is None else self.moment.now
        """The time in view (ticks)."""
        is_whole = self._recorded is not None
        self._course = Course(self.simulation, self.moment, limit, is_whole=is_whole)
        self._history = self._course.history
        self._sampled = dict(self._followed.signals()) if self._followed else {}
        if self._recorded is not None:
            self._load(self._recorded)
        elif self._followed is None:
            self._settle()

    def _load(self, recorded: Recorded) -> None:
        for entry in recorded.entries:
            self._course.give(entry)
        if recorded.at_end:
            self._view(self._history.head)
            self._why = recorded.why

    # --- clients -------------------------------------------------------------------------------

    def join(self, send: Send, *, may_command: bool = True) -> int:
        """Take a client in, to whom messages are sent as JSON; return its number."""
        number = self._clients.join(send, may_command=may_command)
        self.welcome(number)
        return number

    def welcome(self, client: int) -> None:
        """Send a client the whole state: at the beginning, and where it could not follow."""
        one = self._clients[client]
        for message in (self._hello(one), *self._states(), self._mode()):
            one.send(to_json(message))

    def leave(self, client: int) -> None:
        """Forget a client."""
        self._clients.leave(client)

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
        """Whether `advance` would go on."""
        return self._is_running

    @property
    def wants_more(self) -> bool:
        """Whether there is more to do than `advance` did: it should be called again at once."""
        return self._is_running and (self._speed == 0 or self.at < int(self._due))

    def advance(self, microseconds: int) -> None:
        """Let so much real time pass: go on if the session runs, take what a source has."""
        if self._followed is not None and self._gone is None:
            self._follow(self._followed, microseconds)
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
        self._go(self.at, MOST_STEPS)
        if self._is_running:
            self._is_running = was_running

    def _step(self, until: int) -> bool:
        """Do a step; False if there is none until that time."""
        return self._play(until) if self._is_past else self._simulate(until)

    def _simulate(self, until: int) -> bool:
        before = self.moment
        if before is None:
            self._stop(["unknown"])
            return True
        try:
            self.moment, done = self.simulation.step(before, until)
        except FsmkitError as error:
            self._stop(["fault", error.diagnostics[0].rule.name, error.diagnostics[0].message])
            return True
        self.at = self.moment.now
        if done is None:
            return False
        self.n = self._history.head + 1
        told = self._course.teller.step(self.n, self.moment, done)
        self._clients.send([self._course.add(self.moment, told)])
        self._tell_states_now_and_then()
        self._look_at(before, told)
        return True

    def _play(self, until: int) -> bool:
        """Show the next entry that a source gave; at the last one stop."""
        at = self._course.at(self.n + 1)
        if at > until:
            self.at = until
            return False
        before = self.moment
        self._view(self.n + 1)
        self._clients.send([self._history.branch.text(self.n)])
        self._tell_states_now_and_then(before)
        self._look_at(before, self._course.messages(self.n))
        if self.n == self._history.branch.given and self._recorded is not None:
            self._stop(self._recorded.why or ["end"])
        return True

    def _tell_states_now_and_then(self, before: Moment | None = None) -> None:
        """Send all machines every so many steps, and where data are known or unknown anew."""
        is_new = self.n <= self._history.branch.given and (self.moment is None) != (before is None)
        if is_new or self.n % STATE_EVERY == 0:
            self._broadcast(*self._states())

    def _look_at(self, before: Moment | None, told: Sequence[AnyMessage]) -> None:
        """Stop where a breakpoint is hit or a machine has a fault."""
        if self._points:
            why = self._points.hit(before, self.moment, told)
            if why is not None:
                self._stop(why)
        step = told[0]
        if isinstance(step, Step) and isinstance(step.fault, str):
            self._stop(["fault", step.fault, step.m])

    def _stop(self, why: list[Json]) -> None:
        if self._is_running:
            self._is_running, self._points.until, self._why = False, None, why
            self._broadcast(self._mode())

    # --- what is followed ----------------------------------------------------------------------

    def _follow(self, source: Followed, microseconds: int) -> None:
        """Take what has come; show it, unless the view is frozen or on a branch."""
        self._since_clock += microseconds
        self._since_signals += microseconds
        try:
            for entry in source.receive():
                text = self._course.give(entry)
                if self._is_following:
                    self._show(entry, text)
            signals = source.signals()
        except FsmkitError as error:
            first = error.diagnostics[0]
            self._gone = ["fault", first.rule.name, first.message]
            self._flush()
            self._freeze(self._gone)
            return
        self._flush()
        if self._is_following and self._since_signals >= SIGNALS_EVERY and signals != self._sampled:
            self._sample(signals)
        if self._is_live and self._since_clock >= CLOCK_EVERY and self._head != self._history.head:
            self._broadcast(self._mode())

    def _show(self, entry: Entry, text: bytes) -> None:
        """Go on with the view to an entry that came just now."""
        before = self.moment
        self.n, self.moment, self.at = self._history.head, entry.moment, time_of(entry.messages[0])
        self._gathered.append(text)
        if (entry.moment is None) != (before is None) or self.n % STATE_EVERY == 0:
            self._gathered += map(to_json, self._states())
        why = self._points.hit(before, self.moment, entry.messages) if self._points else None
        if why is not None:
            self._flush()
            self._freeze(why)

    def _flush(self) -> None:
        """Send what was gathered of several entries."""
        texts, self._gathered = self._gathered, []
        self._clients.send(texts)

    def _freeze(self, why: list[Json]) -> None:
        """Stay at the entry in view, whatever comes."""
        self._is_following, self._why = False, why
        self._broadcast(self._mode())

    def _sample(self, signals: Mapping[str, float]) -> None:
        is_new = list(signals) != list(self._sampled)
        self._sampled, self._since_signals = dict(signals), 0
        if is_new:
            self._welcome_all()
        self._broadcast(Signals(n=self.n, at=self.at, v=list(map(value_json, signals.values()))))

    def _go_on_following(self) -> None:
        """Look at the newest entry, whatever branch is in view, and go on with it."""
        if self._followed is None:
            raise wrong("nothing is followed in this session", "use `run`, or `fork` to a branch")
        was_live = self._is_live
        self._is_running = False
        if not was_live:
            self._history.switch(0)
        self._view(self._history.head)
        self._is_following, self._why = self._gone is None, self._gone or []
        if was_live:
            self._tell_view()
        else:
            self._welcome_all()

    # --- commands ------------------------------------------------------------------------------

    def _obey(self, client: Client, command: AnyCommand) -> Any:
        match command:
            case commands.Post():
                return self._post(command)
            case commands.SetInput():
                return self._set(command)
            case commands.Run():
                return self._run(command)
            case commands.Pause():
                return self._pause()
            case commands.StepOn(how=how):
                return self._step_on(how)
            case commands.Back(count=count):
                return self._seek(self.n - count)
            case commands.Forward(count=count):
                return self._seek(self.n + count)
            case commands.Seek(n=n, at=at):
                return self._seek(n if n is not None else self._course.last_at(at or 0))
            case commands.Break():
                return self.add_breakpoint(command)
            case commands.Unbreak(number=number):
                return self._points.remove(number)
            case commands.Watch() | commands.Why() | commands.Events():
                return self._answer(command)
            case commands.Micro(n=n):
                return self._micro(n)
            case commands.ChartWanted(chart=hash_):
                client.send(self._course.teller.chart(hash_))
                return None
            case commands.History(first=first, last=last):
                return self._resend(client, first, last)
            case commands.Branches():
                return self._branches()
            case commands.Fork(branch=number):
                return self._fork(number)
            case commands.Follow():
                return self._go_on_following()
            case commands.Save(kind=kind):
                return self._save(kind)
            case commands.ViewWanted():
                return None if self._view_of_plant is None else self._view_of_plant.as_json()

    def _post(self, command: commands.Post) -> str:
        machine = machine_of(self.system, command.m)
        chart = self.simulation.charts[machine]
        occurrence = occurrence_of(chart, command.event, command.payload)
        if self._is_live:
            self._may("post").post(machine, occurrence)
            return "sent"
        before = self._begin_branch()
        after = self.simulation.post(before, machine, occurrence)
        how = "refused" if after is None else "queued"
        row, name = row_of_event(chart, occurrence), self.simulation.names[machine]
        self._note(
            Post(m=name, n=self.n + 1, at=before.now, event=row, how=how),
            before if after is None else after,
        )
        return how

    def _set(self, command: commands.SetInput) -> None:
        machine = machine_of(self.system, command.m)
        chart, name = self.simulation.charts[machine], self.simulation.names[machine]
        place, value = input_of(chart, command.input, command.value)
        if self._is_live:
            self._may("set").set_input(machine, place, value)
            return
        before = self._begin_branch()
        told = {command.input: value_json(value, chart.inputs[place].type)}
        self._note(
            Set(m=name, n=self.n + 1, at=before.now, inputs=told),
            self.simulation.set_input(before, machine, place, value),
        )

    def _may(self, command: str) -> Followed:
        """Return what is followed, if it obeys a command."""
        if self._followed is None or self._gone is not None or command not in self._followed.can:
            raise wrong(
                f"what runs elsewhere takes no `{command}` from here",
                "`fork` begins a branch in the interpreter, where the data are known",
            )
        return self._followed

    def _run(self, command: commands.Run) -> None:
        if command.speed != 0 and not SLOWEST <= command.speed <= FASTEST:
            raise wrong(f"there is no speed {command.speed}", f"use 0 or {SLOWEST} to {FASTEST}")
        if self._is_live:
            if self._driven is not None:
                self._driven.run(command.speed)
            self._go_on_following()
            return
        until = None
        if command.until:
            condition = commands.Break(id=0, on="condition", what=command.until)
            until = breakpoints.read(self.system, condition)
        if not self._is_past:
            self._begin_branch()
        self._points.until, self._speed, self._is_running = until, command.speed, True
        self._due, self._why = float(self.at), []
        self._broadcast(self._mode())

    def _pause(self) -> None:
        if self._driven is not None and self._is_following:
            self._driven.pause()
            self._why = ["asked"]
            self._broadcast(self._mode())
        elif self._is_following:
            self._freeze(["asked"])
        self._stop(["asked"])

    def _step_on(self, how: str) -> int:
        """Go on by little; in the past what happened is looked at again. Return the steps done."""
        if how not in ("macro", "timer", "tick"):
            raise wrong(f"there is no step `{how}`", "use macro, timer or tick")
        if self._driven is not None and self._is_following:
            return self._step_driven(self._driven, how)
        self._pause()
        if self.n < self._history.head and (how == "macro" or self._is_live):
            return self._look_on()
        if self._is_live:
            return 0
        if not self._is_past:
            self._begin_branch()
        first, due = self.n, self._next_time
        self._is_running, self._why = True, ["stepped"]
        match how:
            case "macro":
                self._go(FOR_EVER, 1)
            case "tick":
                self._go(self.at + 1, MOST_STEPS)
            case _:
                self._go(self.at if due is None else due, MOST_STEPS)
        self._is_running = False
        self._broadcast(self._mode())
        return self.n - first

    def _step_driven(self, driven: Driven, how: str) -> int:
        """Let what is stepped go on by a tick, or until its next timer is due."""
        due = None if self.moment is None else self.simulation.next_deadline(self.moment)
        ticks = max(1, due - self.at) if how == "timer" and due is not None else 1
        driven.step(ticks)
        self._why = ["stepped"]
        self._broadcast(self._mode())
        return ticks

    @property
    def _next_time(self) -> int | None:
        """When something happens next (ticks)."""
        if self._is_past:
            return self._course.at(self.n + 1)
        return None if self.moment is None else self.simulation.next_deadline(self.moment)

    def _look_on(self) -> int:
        """Look at the next entry."""
        before = self.moment
        self._view(self.n + 1)
        self._why = ["stepped"]
        self._clients.send([self._history.branch.text(self.n)])
        self._tell_states_now_and_then(before)
        self._broadcast(self._mode())
        return 1

    def _seek(self, n: int) -> int:
        """Look at an entry; what happens from there on is a branch of its own. Return it."""
        self._is_running = self._is_following = False
        self._view(max(self._history.first, min(n, self._history.head)))
        self._why = ["sought"]
        recorded = self._recorded
        if (
            recorded is not None
            and self.n == self._history.branch.given
            and not self._history.number
        ):
            self._why = recorded.why or self._why
        self._tell_view()
        return self.n

    def add_breakpoint(self, command: commands.Break) -> int:
        """Add a breakpoint; return its number. `FsmkitError` for names that there are not."""
        return self._points.add(command)

    def _answer(self, command: commands.Watch | commands.Why | commands.Events) -> Any:
        """Return what is asked of the system in view."""
        snapshots = None if self.moment is None else self.moment.snapshots
        if isinstance(command, commands.Watch):
            own = own_names(self.system, command.m)
            expression = queries.read(self.system, command.expression, own, None)
            if snapshots is None:
                return {"error": UNKNOWN}
            return queries.shown(expression, snapshots)
        machine = machine_of(self.system, command.m)
        chart = self.simulation.charts[machine]
        if isinstance(command, commands.Events):
            return queries.events(chart, None if snapshots is None else snapshots[machine])
        event = received(chart, command.event)
        payload = None
        if command.payload is not None or not chart.events[event].fields:
            payload = occurrence_of(chart, command.event, command.payload or {}).payload
        if snapshots is None:
            return {"would": "?", "looked": [], "because": UNKNOWN}
        return queries.why(chart, snapshots[machine], event, payload)

    def _micro(self, n: int) -> Any:
        """Return the microsteps of a step, made again."""
        if not self._history.first < n <= self._history.head:
            raise wrong(f"there is no step {n}")
        done = self._course.stepped(n)
        if done is None:
            raise wrong(f"entry {n} is no step whose microsteps are known")
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

    def _resend(self, client: Client, first: int, last: int | None) -> dict[str, int]:
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

    def _fork(self, number: int | None) -> int:
        """Go to a branch, or begin one; return the entry in view."""
        was_live = self._is_live
        if number is not None and number not in self._history.others:
            raise wrong(f"there is no branch {number}")
        if number is None:
            self._course.cut(self.n, self.moment, always=True)
            self._is_running = self._is_following = False
            self._why = ["forked"]
            self._tell_view()
        else:
            self._history.switch(number)
            self._seek(self._history.head)
        if self._is_live != was_live:
            self._welcome_all()
        return self.n

    def _save(self, kind: str) -> str:
        if self._is_live and kind != "live" and isinstance(self._followed, Driven):
            return self._followed.save(kind)
        is_at_end = self.n == self._history.head and self.moment is not None
        now = self.at if is_at_end else self._course.at(self._history.head)
        return saving.saved(self._course, kind, self._file, now, self._hello(None))

    # --- inside --------------------------------------------------------------------------------

    @property
    def _is_live(self) -> bool:
        """Whether the branch in view is that of what runs elsewhere."""
        return self._followed is not None and self._history.number == 0

    @property
    def _driven(self) -> Driven | None:
        """What is in view and can be stopped from here."""
        if self._is_live and self._gone is None and isinstance(self._followed, Driven):
            return self._followed if "run" in self._followed.can else None
        return None

    @property
    def _is_past(self) -> bool:
        """Whether a source gave what follows the entry in view: it is played back."""
        return self.n < self._history.branch.given

    def _view(self, n: int) -> None:
        """Take an entry into view."""
        self.n, self.moment = n, self._course.moment(n)
        self.at = self._course.at(n) if self.moment is None else self.moment.now

    def _begin_branch(self) -> Moment:
        """Let what comes follow the entry in view; what followed it stays as another branch."""
        if self._course.cut(self.n, self.moment):
            self._broadcast(self._mode())
        assert self.moment is not None  # noqa: S101  (`cut` has refused it)
        return self.moment

    def _note(self, message: Post | Set, after: Moment) -> None:
        """Keep that a client did something, send it to all, and do what follows at once."""
        self.moment = after
        text = self._course.add(after, [message])
        self.n = self._history.head
        self._clients.send([text])
        if not self._is_running:
            self._settle()

    def _hello(self, client: Client | None) -> Hello:
        followed = self._followed if self._is_live else None
        given = self._recorded or self._followed
        can = [name for name in commands.NAMES if name != "follow" or self._followed]
        if followed is not None:
            can = [name for name in can if name not in ("post", "set") or name in followed.can]
        return Hello(
            protocol=PROTOCOL,
            session=self.session,
            name=self.system.name,
            time="simulated" if given is None else given.time,
            tick_us=self.simulation.tick,
            at=self.at,
            n=self.n,
            can=can,
            machines=self._course.teller.machines,
            readonly=client is not None and not client.may_command,
            signals=list(self._sampled),
        )

    def _states(self) -> list[AnyMessage]:
        """Return all machines as far as they are known, and what was lost since."""
        if self.moment is not None:
            return list(self._course.teller.states(self.n, self.moment))
        folded = self._course.states(self.n)
        return [*folded.states, *folded.lost]

    def _mode(self) -> Mode:
        mode = "running" if self._is_running else "paused"
        if self._is_live:
            mode = "following" if self._is_following else "frozen"
            if self._driven is not None:
                self._speed = self._driven.speed
                mode = "paused" if self._is_following and not self._driven.is_running else mode
        self._since_clock, self._head = 0, self._history.head
        return Mode(
            mode=mode,
            n=self.n,
            head=self._history.head,
            at=self.at,
            branch=self._history.number,
            first=self._history.first,
            speed=self._speed,
            why=self._why,
        )

    def _tell_view(self) -> None:
        self._broadcast(*self._states(), self._mode())

    def _welcome_all(self) -> None:
        for number in self._clients.numbers():
            self.welcome(number)

    def _broadcast(self, *told: AnyMessage) -> None:
        self._clients.send([to_json(message) for message in told])


def system_within(source: Source) -> System:
    """Return the system of whatever a hub shows."""
    if isinstance(source, Chart):
        return system_of(source)
    return source if isinstance(source, System) else source.system
