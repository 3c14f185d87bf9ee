"""The hub: executes commands and sends messages, without sockets and clocks.

A client joins, receives the whole state, and gives commands; each gets one response. While the
session runs, `Hub.advance` passes real time. The session is simulated, or a source provides
entries: a recording is played back, a followed program is shown live. A branch started by a
command is always simulated.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any

from msgspec.structs import replace

from fsmkit.chart.chart import Chart, result_types
from fsmkit.diagnostics import Diagnostic, FsmkitError
from fsmkit.diagnostics.as_json import as_json
from fsmkit.inspector import breakpoints, commands, saving
from fsmkit.inspector.breakpoints import Breakpoints, Hit, machine_of
from fsmkit.inspector.clients import Client, Send
from fsmkit.inspector.commands import AnyCommand, read_command, wrong
from fsmkit.inspector.following import Follower
from fsmkit.inspector.history import LIMIT
from fsmkit.inspector.picture import Picture
from fsmkit.inspector.playing import Player
from fsmkit.inspector.questions import answering, finding
from fsmkit.inspector.questions.arguments import datum_of, input_of, occurrence_of, results_of
from fsmkit.inspector.recorder import Recorder, live_texts
from fsmkit.inspector.reloading import repeat_actions
from fsmkit.inspector.simulation import Moment, Simulation, SimulationStep
from fsmkit.inspector.sources import DrivenSource, Followed, Recorded
from fsmkit.inspector.system_at import Course
from fsmkit.inspector.view import View
from fsmkit.runtime.live import messages
from fsmkit.runtime.live.messages import (
    PROTOCOL,
    AnyMessage,
    Hello,
    Json,
    Post,
    Refused,
    Set,
    to_json,
)
from fsmkit.runtime.live.steps import row_of_event
from fsmkit.runtime.live.values import to_json as value_json
from fsmkit.system.of_one_chart import system_of
from fsmkit.system.system import System

SLOWEST, FASTEST = 0.001, 1000.0
"""Speeds; 0 is as fast as can be."""
Source = Chart | System | Recorded | Followed


class Hub:
    """A session of a simulated chart or system, or of a source.

    Args:
        source: A chart, a system, a recording or a followed program.
        file: The file it was read from; saved tests name it.
        session: Name of the session.
        seed: Seed of the results of operations and of interval delays, in the interpreter.
        limit: Maximum size of the history, in bytes.
        picture: Picture of the plant.
        observer: Function called with each macrostep of the interpreter, from the start on.
        editor: Opens a file at a line, on this computer.

    """

    def __init__(
        self,
        source: Source,
        *,
        file: Path | None = None,
        session: str = "",
        seed: int = 1,
        limit: int = LIMIT,
        picture: Picture | None = None,
        observer: Callable[[SimulationStep], None] | None = None,
        editor: Callable[[Path, int], None] | None = None,
    ) -> None:
        self._picture = picture
        self._editor = editor
        followed = source if isinstance(source, Followed) else None
        recorded = source if isinstance(source, Recorded) else None
        self._given = recorded or followed
        self._file = file
        self._recorder: Recorder | None = None
        self._broken: list[Json] = []
        """The present findings about a watched file."""
        self.system = system_within(source)
        self.simulation = Simulation(self.system, seed)
        self.session = session
        begin = self.simulation.begin() if self._given is None else self._given.begin
        course = Course(
            self.simulation,
            begin,
            limit,
            is_whole=recorded is not None,
            is_followed=followed is not None,
        )
        self.view = View(course, begin)
        self._points = Breakpoints(self.system)
        self._end = [] if recorded is None else recorded.why
        self._player = Player(self.view, self._points, self._end, observer)
        self._follower = None if followed is None else Follower(self.view, self._points, followed)
        if recorded is not None:
            self._load(recorded)
        elif followed is None:
            self._player.settle()

    def reload(self, model: Chart | System) -> None:
        """Replace a simulated chart or system by a new version, and repeat the commands.

        The branch in view is repeated up to the same time; other branches are dropped. The view
        moves to the end. The first differing entry is reported (``["reloaded", n]``).
        """
        old, system = self.view, system_within(model)
        simulation = Simulation(system, self.simulation.seed)
        begin = simulation.begin()
        course = Course(simulation, begin, old.history.limit)
        again = repeat_actions(
            old.course, course, begin, old.at if old.is_at_head else self._end_at
        )
        self._show(course, begin)
        view = self.view
        view.n, view.moment, view.at = course.history.head, again.moment, again.moment.now
        view.speed, view.is_running, view.why = old.speed, False, again.why
        self._welcome_all()
        if old.is_running:
            self._player.run(old.speed)

    def show(self, source: Chart | System | Recorded) -> None:
        """Show another source from its start instead of a simulated or recorded one.

        The present session is dropped; breakpoints stay.
        """
        recorded = source if isinstance(source, Recorded) else None
        system = system_within(source)
        simulation = Simulation(system, self.simulation.seed)
        begin = simulation.begin() if recorded is None else recorded.begin
        limit = self.view.history.limit
        course = Course(simulation, begin, limit, is_whole=recorded is not None)
        self._given = recorded
        self._show(course, begin, [] if recorded is None else recorded.why)
        if recorded is None:
            self._player.settle()
        else:
            for entry in recorded.entries:
                course.give(entry)
        self._welcome_all()

    def _show(self, course: Course, start: Moment | None, end: Sequence[Json] = ()) -> None:
        """Let the clients look at the start of another course; ``end``: why its source ends."""
        clients = self.view.clients
        self.system, self.simulation = course.simulation.system, course.simulation
        self.view = View(course, start)
        self.view.clients = clients
        self._points.set_system(self.system)
        self._end = list(end)
        self._player = Player(self.view, self._points, self._end)
        self._broken = []
        if self._recorder is not None:
            self._recorder.restart()
            self._record(self._recorder)

    def show_findings(self, findings: Iterable[Diagnostic]) -> None:
        """Report the present findings about the file to all clients; the session stays as it is."""
        self._broken = [as_json(finding) for finding in findings]
        self.view.send(messages.Broken(findings=self._broken))

    def _load(self, recorded: Recorded) -> None:
        for entry in recorded.entries:
            self.view.course.give(entry)
        if recorded.at_end:
            self.view.go(self.view.history.head)
            self.view.why = recorded.why

    @property
    def n(self) -> int:
        """The entry in view."""
        return self.view.n

    @property
    def at(self) -> int:
        """The time in view (ticks)."""
        return self.view.at

    @property
    def moment(self) -> Moment | None:
        """The system at the entry in view; None where it is not known."""
        return self.view.moment

    @property
    def messages(self) -> list[AnyMessage]:
        """The messages of the entry in view; empty before the first."""
        is_known = self.view.history.first < self.n
        return self.view.course.messages(self.n) if is_known else []

    @property
    def stepped(self) -> SimulationStep | None:
        """The macrostep of the entry in view; None for an action of a client or unknown data."""
        is_known = self.view.history.first < self.n
        return self.view.course.stepped(self.n) if is_known else None

    # --- clients -------------------------------------------------------------------------------

    def join(self, send: Send, *, may_command: bool = True) -> int:
        """Add a client that receives messages as JSON; return its number."""
        number = self.view.clients.join(send, may_command=may_command)
        self.welcome(number)
        return number

    def welcome(self, client: int) -> None:
        """Send a client the whole state, initially and after a loss of messages."""
        one = self.view.clients[client]
        broken = [messages.Broken(findings=self._broken)] if self._broken else []
        points = [self._points.message] if self._points.message.points else []
        states = self.view.states()
        for message in (self._hello(one), *states, self.view.mode(), *points, *broken):
            one.send(to_json(message))
        if self._live is not None and self._live.signals:
            one.send(to_json(self._live.sampled()))

    def leave(self, client: int) -> None:
        """Forget a client."""
        self.view.clients.leave(client)

    def receive(self, client: int, text: str | bytes) -> None:
        """Execute or reject a command of a client, and respond."""
        one = self.view.clients[client]
        number = commands.id_of(text)
        try:
            command = read_command(text)
            if isinstance(command, commands.CHANGING) and not one.may_command:
                raise wrong("this session is read-only", "start it without `--read-only`")
            answer: AnyMessage = messages.Done(re=command.id, result=self._obey(one, command))
        except FsmkitError as error:
            first = error.diagnostics[0]
            answer = Refused(
                re=number, rule=first.rule.name, message=first.message, help=first.help or ""
            )
        one.send(to_json(answer))

    def drawing(self, text: str | bytes) -> Callable[[], object] | None:
        """Return the slow part of a command, a drawing, as a function; None for other commands.

        It may be called in another thread; `receive` then uses the result.
        """
        try:
            command = read_command(text)
        except FsmkitError:
            return None
        if not isinstance(command, commands.ChartRequest):
            return None
        return self.view.course.encoder.drawing(
            command.chart, command.hide, command.fold, is_drawn=command.drawn
        )

    # --- time ----------------------------------------------------------------------------------

    @property
    def is_running(self) -> bool:
        """Whether time passes in `advance`."""
        return self.view.is_running

    @property
    def wants_more(self) -> bool:
        """Return whether `advance` left work, so that it should be called again immediately."""
        return self._player.wants_more

    def advance(self, microseconds: int) -> None:
        """Pass real time: advance a running session, and take the entries of a source."""
        if self._follower is not None:
            self._follower.advance(microseconds)
        self._player.advance(microseconds)
        if self._recorder is not None:
            self._recorder.advance(microseconds)

    # --- commands ------------------------------------------------------------------------------

    def _obey(self, client: Client, command: AnyCommand) -> Any:
        view = self.view
        match command:
            case commands.Post():
                return self._post(command, self._by(client))
            case commands.SetInput():
                return self._set(command, self._by(client))
            case commands.Run():
                return self._run(command)
            case commands.Pause():
                return self._pause()
            case commands.StepOn(how=how, at=at):
                return self._step(how, at)
            case commands.Change():
                return self._change(command, self._by(client))
            case commands.Returns():
                return self._returns(command, self._by(client))
            case commands.Back():
                return self._back(command)
            case commands.Forward(count=count):
                return self._seek(view.n + count)
            case commands.Seek(n=n, at=at):
                return self._seek(n if n is not None else view.course.last_at(at or 0))
            case commands.Break():
                return self.add_breakpoint(command)
            case commands.Unbreak(number=number):
                self._points.remove(number)
                return view.send(self._points.message)
            case commands.Watch():
                return answering.watched_value(view, command)
            case commands.Why():
                return answering.explain_event(view, command)
            case commands.Events(m=machine):
                return answering.events(view, machine)
            case commands.Micro(n=n):
                return answering.microsteps(view, n)
            case commands.Find():
                return finding.found(view, command)
            case commands.ChartRequest(chart=hash_, hide=hide, fold=fold, drawn=drawn):
                return client.send(view.course.encoder.chart(hash_, hide, fold, is_drawn=drawn))
            case commands.History(first=first, last=last):
                return answering.resend(client, view.history, first, last)
            case commands.Branches():
                return answering.branches(view.history)
            case commands.Fork(branch=number):
                return self._fork(number)
            case commands.Follow():
                return self._follow()
            case commands.Save(kind=kind):
                return self._save(kind)
            case commands.PictureRequest():
                return None if self._picture is None else self._picture.as_json()
            case commands.Open(file=name, line=line):
                return self._open(name, line)

    def _by(self, client: Client) -> int:
        """Return the number of the commanding client if there are several clients, else 0."""
        clients = self.view.clients
        return clients.number_of(client) if len(clients.numbers()) > 1 else 0

    def _post(self, command: commands.Post, by: int) -> str:
        machine = machine_of(self.system, command.m)
        chart = self.simulation.charts[machine]
        occurrence = occurrence_of(chart, command.event, command.payload)
        if self._live is not None:
            self._live.may("post").post(machine, occurrence)
            return "sent"
        before = self.view.begin_branch()
        after = self.simulation.post(before, machine, occurrence)
        how = "refused" if after is None else "queued"
        row, name = row_of_event(chart, occurrence), self.simulation.names[machine]
        self._note(
            Post(m=name, n=self.n + 1, at=before.now, event=row, how=how, by=by),
            before if after is None else after,
        )
        return how

    def _set(self, command: commands.SetInput, by: int) -> None:
        machine = machine_of(self.system, command.m)
        chart, name = self.simulation.charts[machine], self.simulation.names[machine]
        place, value = input_of(chart, command.input, command.value)
        if self._live is not None:
            self._live.may("set").set_input(machine, place, value)
            return
        before = self.view.begin_branch()
        told = {command.input: value_json(value, chart.inputs[place].type)}
        self._note(
            Set(m=name, n=self.n + 1, at=before.now, inputs=told, by=by),
            self.simulation.set_input(before, machine, place, value),
        )

    def _returns(self, command: commands.Returns, by: int) -> None:
        machine = machine_of(self.system, command.m)
        chart, name = self.simulation.charts[machine], self.simulation.names[machine]
        operation = command.operation
        results = results_of(chart, operation, command.results)
        if self._live is not None:
            raise wrong("the host of a running program returns the results", "`fork` first")
        type_ = result_types(chart)[operation]
        before = self.view.begin_branch()
        given = {operation: [value_json(value, type_) for value in results]}
        self._note(
            Set(m=name, n=self.n + 1, at=before.now, inputs={}, results=given, by=by),
            self.simulation.set_results(before, machine, operation, results),
        )

    def _change(self, command: commands.Change, by: int) -> None:
        machine = machine_of(self.system, command.m)
        chart, name = self.simulation.charts[machine], self.simulation.names[machine]
        place, value = datum_of(chart, command.data, command.value)
        if self._live is not None:
            raise wrong("the data of an external program cannot be changed", "`fork` first")
        before = self.view.begin_branch()
        told = {command.data: value_json(value, chart.data[place].type)}
        self._note(
            Set(m=name, n=self.n + 1, at=before.now, inputs={}, data=told, by=by),
            self.simulation.set_data(before, machine, place, value),
        )

    def _note(self, message: Post | Set, after: Moment) -> None:
        """Store an action of a client, send it to all, and process its consequences."""
        view = self.view
        view.n, view.moment = view.history.head + 1, after
        view.course.add(after, [message])
        view.clients.send([view.history.branch.text(view.n)])
        if isinstance(message, Set) and message.data:
            view.send(*view.states())
        self._player.settle()

    def _run(self, command: commands.Run) -> None:
        speed = self.view.speed if command.speed is None else command.speed
        if speed != 0 and not SLOWEST <= speed <= FASTEST:
            raise wrong(f"there is no speed {speed}", f"use 0 or {SLOWEST} to {FASTEST}")
        if self._live is not None:
            self._live.run(speed)
            self._follow()
            return
        until = None
        if command.until:
            condition = commands.Break(id=0, on="condition", what=command.until)
            until = breakpoints.read(self.system, condition)
        if not self.view.is_past:
            self.view.begin_branch()
        self._points.until = until
        self._player.run(speed)

    def _pause(self) -> None:
        if self._live is not None and self.view.is_following:
            self._live.pause()
        self._player.stop(["asked"])

    def _step(self, how: str, at: int) -> int:
        """Advance by one unit; in the past, replay entries. Return the number of steps."""
        if how not in ("macro", "timer", "tick", "time"):
            raise wrong(f"there is no step `{how}`", "use macro, timer, tick or time")
        view = self.view
        if self._live is not None and self._live.driven is not None and view.is_following:
            return self._live.step(how)
        self._pause()
        if not view.is_at_head and (how == "macro" or view.is_live):
            before = view.moment
            view.go(view.n + 1)
            view.why = self._why_at(view.n) or ["stepped"]
            view.send_entry(before)
            view.send(view.mode())
            return 1
        if view.is_live:
            return 0
        if not view.is_past:
            view.begin_branch()
        return self._player.step(how, at)

    def _seek(self, n: int, why: list[Json] | None = None) -> int:
        """Move the view to an entry; later actions start a branch. Return the entry."""
        view = self.view
        view.is_running = view.is_following = False
        view.go(max(view.history.first, min(n, view.history.head)))
        view.why = why or self._why_at(view.n) or ["sought"]
        view.send_all()
        return view.n

    def _back(self, command: commands.Back) -> int:
        """Look at an earlier entry: so many back, or the last one at which something happened."""
        if not command.to:
            return self._seek(self.n - command.count)
        hit: Hit = self._points.stop_reasons
        if command.to != "breakpoint":
            wanted = commands.Break(id=0, on=command.to, m=command.m, what=command.what)
            hit = breakpoints.hit_detector(self.system, breakpoints.read(self.system, wanted))
        course = self.view.course
        for n, before, after in course.back(self.n - 1):
            why = hit(before, after, course.messages(n))
            if why is not None:
                return self._seek(n, why)
        return self._seek(self.view.history.first)

    def _why_at(self, n: int) -> list[Json]:
        """Return the reason for an entry, if it is the end of something recorded."""
        history = self.view.history
        return self._end if history.number == 0 and n == history.branch.given else []

    def add_breakpoint(self, command: commands.Break) -> int:
        """Add a breakpoint; return its number. `FsmkitError` for names that there are not."""
        number = self._points.add(command)
        self.view.send(self._points.message)
        return number

    def _fork(self, number: int | None) -> int:
        """Move to the end of a branch, or start one here; return the entry in view."""
        view, was_live = self.view, self.view.is_live
        if number is None:
            view.begin_branch(always=True)
            view.is_running = view.is_following = False
            view.why = ["forked"]
            view.send_all()
        elif number in view.history.others:
            view.course.switch(number)
            self._seek(view.history.head)
        else:
            raise wrong(f"there is no branch {number}")
        if view.is_live != was_live:
            self._welcome_all()
        return view.n

    def _follow(self) -> None:
        """Follow the external program again."""
        if self._follower is None:
            raise wrong("nothing is followed in this session", "use `run`, or `fork` to a branch")
        if self._follower.follow():
            self._welcome_all()
        else:
            self.view.send_all()

    def _open(self, name: str, line: int) -> None:
        """Open a source in an editor; no other file is opened."""
        if self._editor is None:
            raise wrong("this session opens no editor", "start it with `--open-with`")
        known = {source.name for chart in self.simulation.charts for source in chart.sources}
        if name not in known:
            raise wrong(f"`{name}` is not a source of this session")
        self._editor(Path(name), line)

    def _save(self, kind: str) -> str:
        view = self.view
        source = None if self._live is None else self._live.source
        if isinstance(source, DrivenSource) and kind in ("script", "pytest"):
            return source.save(kind)
        now = view.at if view.is_at_head else self._end_at
        if kind == "live":
            texts = live_texts(self.hello_of_file(), view.course)
            return b"".join(line + b"\n" for line in texts).decode()
        return saving.saved(view.course, kind, self._file, now)

    def record(self, path: Path) -> Recorder:
        """Write the session to a file (``.live``, ``.live.gz``), including its past.

        Raises `FsmkitError` (``unwritable-output``).
        """
        self._recorder = Recorder(path)
        self._record(self._recorder)
        return self._recorder

    def _record(self, recorder: Recorder) -> None:
        course = self.view.course
        recorder.write(*live_texts(self.hello_of_file(recorder.path.parent), course))
        course.on_entry = recorder.entry

    def hello_of_file(self, folder: Path | None = None) -> Hello:
        """Return the first message of a file in a folder, from which it finds the chart."""
        file = "" if self._file is None else self._file.name
        if self._file is not None and folder is not None:
            file = os.path.relpath(self._file.resolve(), folder.resolve())
        return replace(self._hello(None), file=file, at=0, n=0)

    # --- inside --------------------------------------------------------------------------------

    @property
    def _end_at(self) -> int:
        """The time of the last entry of the branch in view."""
        return self.view.course.at(self.view.history.head)

    @property
    def _live(self) -> Follower | None:
        """The followed program, if its branch is in view."""
        return self._follower if self.view.is_live else None

    def _welcome_all(self) -> None:
        """Send all to all, as the commands that are obeyed are others now."""
        for number in self.view.clients.numbers():
            self.welcome(number)

    def _hello(self, client: Client | None) -> Hello:
        absent = {"follow"} if self._follower is None else set()
        absent |= {"open"} if self._editor is None else set()
        can = [name for name in commands.NAMES if name not in absent]
        if self._live is not None:
            obeyed = self._live.source.can
            asked = {"post", "set", "returns"}
            can = [name for name in can if name not in asked or name in obeyed]
        return Hello(
            protocol=PROTOCOL,
            session=self.session,
            name=self.system.name,
            time="simulated" if self._given is None else self._given.time,
            tick_us=self.simulation.tick,
            at=self.at,
            n=self.n,
            can=can,
            machines=self.view.course.encoder.machines,
            readonly=client is not None and not client.may_command,
            seed=self.simulation.seed,
            client=0 if client is None else self.view.clients.number_of(client),
            signals=[] if self._follower is None else list(self._follower.signals),
        )


def system_within(source: Source) -> System:
    """Return the system of a hub's source."""
    if isinstance(source, Chart):
        return system_of(source)
    return source if isinstance(source, System) else source.system
