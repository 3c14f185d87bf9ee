"""The shell: executes typed lines as commands of the hub, and prints the steps.

A shell is one client of its hub. It also prints the steps that other clients caused.
"""

from __future__ import annotations

import asyncio
import time
from collections import deque
from collections.abc import Awaitable, Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec
from rich.text import Text as Styled

from fsmkit.chart.chart import Chart
from fsmkit.diagnostics import Text, fail
from fsmkit.diagnostics.suggestions import suggest
from fsmkit.emit import plain
from fsmkit.inspector.breakpoints import KINDS
from fsmkit.inspector.hub import Hub
from fsmkit.inspector.questions.typed import (
    event_given,
    format_value,
    input_given,
    results_given,
)
from fsmkit.inspector.shell import names
from fsmkit.inspector.shell.names import Kind, Names, reject_extra_words, typed
from fsmkit.inspector.shell.outline import moment_of, outline
from fsmkit.inspector.simulation import SimulationStep
from fsmkit.language.units import duration_text
from fsmkit.language.values import show, tokens
from fsmkit.runtime.interpreter.snapshot import Snapshot
from fsmkit.runtime.interpreter.trace import trace_lines
from fsmkit.runtime.script import is_returns, read_wait, wrong_line
from fsmkit.runtime.session import variables
from fsmkit.runtime.trace_text import Printer, pretty

MOST_SHOWN = 200
"""Steps per command that are printed immediately; of further steps, only the last ones."""
LAST_SHOWN = 10
OTHERS_SHOWN = 20
"""Steps in a second that others caused and that are printed."""
BLOCKS = {"entered": names.states, "left": names.states, "event": names.every_event,
          "sent": names.every_event}  # fmt: skip
"""Breakpoints on something that has a name."""

COMMANDS = {
    "post": ("post EVENT a=1", "post an event whose name is a command, too"),
    "set": ("set INPUT VALUE", "change an input"),
    "wait": ("wait 500ms", "let time pass"),
    "go": ("go [until COND]", "run until COND becomes true, a breakpoint, a fault, or the end"),
    "step": ("step", "take the next macrostep, at its time"),
    "timer": ("timer", "run to the next timer"),
    "why": ("why EVENT [a=1]", "the effect of an event now, and the reasons"),
    "watch": ("watch EXPR", "the value of an expression"),
    "break": ("break if COND", "stop there; also `break entered STATE` and others; alone: a list"),
    "unbreak": ("unbreak N", "remove a breakpoint"),
    "undo": ("undo [N]", "take back commands that were typed here"),
    "redo": ("redo [N]", "repeat the steps that were taken back"),
    "fork": ("fork [N]", "go to the end of a branch that was left; alone: list them"),
    "save": ("save as test NAME", "write NAME_test.py; also `as script FILE`, `as messages FILE`"),
    "state": ("state", "the active states as an outline"),
    "data": ("data", "values of data, inputs and outputs"),
    "events": ("events", "the events there are; * marks those that would do something now"),
    "serve": ("serve", "serve a page of this session"),
    "help": ("help", "these lines"),
    "quit": ("quit", "leave; also control-D"),
}  # fmt: skip
"""Usage and help of each command."""
WITHOUT_A_COMMAND = (
    ("EVENT a=1 b=2", "post an event"),
    ("OPERATION returns 1, 2", "the next results of an operation, one per call"),
)
ALIASES = {"exit": "quit", "?": "help"}
CHANGING = {"post", "set", "returns", "wait", "go", "step", "timer", "fork"}
"""Commands that `undo` takes back."""
WOULD = {
    "yes": "would be taken",
    "no": "would do nothing",
    "deferred": "would be deferred",
    "?": "depends on its values, or on the host",
    "fault": "would end in a fault",
}
HOLDS = {True: "holds", False: "does not hold", "?": "not known before"}


@dataclass(frozen=True, slots=True)
class Place:
    """A position in a history: a branch, an entry, and the time in ticks."""

    branch: int
    n: int
    now: int


class Shell:
    """Obeys lines.

    Args:
        show: Prints a line.
        write: Writes a new text file; `FsmkitError` where it cannot.
        serve: Serves the hub; returns the address of the page.
        lines_only: Whether steps are printed as traces.

    """

    def __init__(
        self,
        *,
        show: Callable[[Styled | str], None],
        write: Callable[[Path, str], None],
        serve: Callable[[Hub], Awaitable[str]],
        lines_only: bool = False,
    ) -> None:
        self._show, self._write, self._serve = show, write, serve
        self._lines_only = lines_only
        self._waiting: deque[SimulationStep] = deque()
        self._shown = self._kept_back = 0
        self._second = 0.0
        self._is_busy = self._is_starting = True
        self._past: list[Place] = []
        self._future: list[Place] = []
        self._answer: dict[str, Any] = {}
        self._mode: dict[str, Any] = {}
        self._points: dict[int, str] = {}
        self.is_done = False
        self.is_interrupted = False
        """Set by a signal: a running command stops after the current step."""
        self.on_change: Callable[[], None] = lambda: None
        """Called after something that others did."""

    def attach(self, hub: Hub) -> None:
        """Join a hub whose observer is `observe`; print its start."""
        self.hub = hub
        self.names = Names(hub.system)
        self._client = hub.join(self._take)
        self._flush()
        self._is_starting = self._is_busy = False

    @property
    def faults(self) -> dict[str, str]:
        """Why machines stopped, for those that stopped by a fault."""
        each = zip(self.hub.simulation.names, moment_of(self.hub).snapshots, strict=True)
        return {name: snapshot.fault for name, snapshot in each if snapshot.fault is not None}

    # --- messages --------------------------------------------------------------------------

    def observe(self, done: SimulationStep) -> None:
        """Take a step of the hub, caused here or by others."""
        self._waiting.append(done)
        if self._is_starting:
            return  # printed by `attach`
        most = MOST_SHOWN
        if not self._is_busy:
            most, now = OTHERS_SHOWN, time.monotonic()
            if now - self._second >= 1:
                self._second = now
                self._flush()
                return
        if self._shown < most:
            self._print(self._waiting.popleft())
        elif len(self._waiting) > LAST_SHOWN:
            self._waiting.popleft()
            self._kept_back += 1

    def _flush(self) -> None:
        """Print the collected lines, and how many were dropped."""
        if self._kept_back:
            self._show(Styled(f"          ... {self._kept_back} steps more ...", "dim"))
        while self._waiting:
            self._print(self._waiting.popleft())
        self._shown = self._kept_back = 0

    def _print(self, done: SimulationStep) -> None:
        self._shown += 1
        simulation = self.hub.simulation
        chart, name = simulation.charts[done.machine], simulation.names[done.machine]
        is_alone = len(simulation.names) == 1
        if self._lines_only:
            for line in trace_lines(chart, (done.macrostep,)):
                self._show(line if is_alone else f"{name}: {line}")
            return
        width = max(map(len, simulation.names)) + 1
        for styled in pretty(chart, done.macrostep):
            self._show(
                styled if is_alone else Styled.assemble((f"{name:<{width}}", "blue"), styled)
            )

    def _take(self, text: bytes) -> None:
        """Receive messages of the hub; steps arrive through `observe`."""
        found = msgspec.json.decode(text)
        for message in found if isinstance(found, list) else [found]:
            match message["k"]:
                case "done" | "refused":
                    self._answer = message
                case "mode":
                    self._mode = message
                    if not self._is_busy and message["mode"] == "paused":
                        self._stopped()
        if not self._is_busy:
            self.on_change()

    def _request(self, do: str, **fields: Any) -> Any:
        """Give a command; return its result. Raises `FsmkitError` if it is rejected."""
        command = {"id": 1, "do": do, **fields}
        self.hub.receive(self._client, msgspec.json.encode(command, enc_hook=plain))
        if self._answer["k"] == "refused":
            answer = self._answer
            raise fail(answer["rule"], answer["message"], help=answer.get("help"))
        return self._answer.get("result")

    # --- lines ---------------------------------------------------------------------------------

    async def obey(self, line: str) -> None:
        """Execute a line; raises `FsmkitError` if it is invalid."""
        words = tokens(line)
        if not words:
            return
        word = ALIASES.get(words[0], words[0])
        text = typed(line)
        before = self._place
        self._is_busy, self.is_interrupted = True, False
        self._mode = {**self._mode, "why": []}
        try:
            if word in COMMANDS:
                await self._command(word, words[1:], text)
            elif is_returns(words) and not self._is_event(words[0]):
                word = "returns"
                self._returns(words, text)
            else:
                word = "post"
                self._require_known_word(words[0], text)
                self._post(words, text)
        finally:
            self._flush()
            self._is_busy = False
        if word in CHANGING and self._place != before:
            self._past.append(before)
            self._future.clear()

    async def _command(self, word: str, rest: list[str], line: Text) -> None:
        usage = COMMANDS[word][0]
        match word:
            case "post":
                self._post(rest, line)
            case "set":
                self._set(rest, line)
            case "wait":
                self._wait(rest, line)
            case "go":
                await self._go(rest, line)
            case "why":
                self._why(rest, line)
            case "watch":
                self._watch(_after(line, word), line)
            case "break":
                self._break(rest, line)
            case "save":
                self._save(rest, line)
            case "undo" | "redo":
                self._back_or_forth(word, rest, line)
            case "unbreak":
                number = _number(rest, line, usage)
                self._request("unbreak", number=number)
                self._points.pop(number, None)
            case "fork":
                self._fork(rest, line)
            case _:
                reject_extra_words(rest, line, usage)
                await self._plain(word)

    async def _plain(self, word: str) -> None:
        """Do a command that has no arguments."""
        match word:
            case "step" | "timer":
                is_step = word == "step"
                count = self._request("step", how="macro" if is_step else "timer")
                if not count:
                    self._show(Styled("no timer is armed", "yellow"))
                elif not self.hub.n < self._mode["head"]:
                    self._stopped()
            case "state":
                self._each(outline)
            case "data":
                self._each(_values)
            case "events":
                self._events()
            case "serve":
                self._show(await self._serve(self.hub))
            case "help":
                for usage, help_ in (*WITHOUT_A_COMMAND, *COMMANDS.values()):
                    self._show(Styled.assemble("  ", (f"{usage:<20}", "bold"), f" {help_}"))
            case _:
                self.is_done = True

    # --- changes of the machines ----------------------------------------------------------

    def _post(self, words: Sequence[str], line: Text) -> None:
        machine, event, payload = self._event(words, line)
        how = self._request("post", m=machine, event=event, **{"with": payload})
        if how == "refused":
            self._show(Styled(f"{event} is lost: the queue is full, or the machine stopped", "red"))
        self._stopped()

    def _require_known_word(self, word: str, line: Text) -> None:
        """Reject a line whose first word is neither an event nor a command."""
        if not self._is_event(word) and "." not in word:
            known = [name for name, _, _ in self.names.names_of_kind(names.events)]
            help_ = suggest(
                word, [*known, *COMMANDS], "`help` lists the commands, `events` the events"
            )
            raise wrong_line(line, f"there is no event and no command `{word}`", help_)

    def _is_event(self, word: str) -> bool:
        return any(word == name for name, _, _ in self.names.names_of_kind(names.events))

    def _event(self, words: Sequence[str], line: Text) -> tuple[str, str, dict[str, Any]]:
        """Read an event with its payload: its machine, its name, the values for the protocol."""
        if not words:
            raise wrong_line(line, "no event is named", "write `post EVENT`")
        machine, chart, name = self.names.find(words[0], "event", names.events, line)
        return plain(machine), *event_given(chart, (name, *words[1:]), line)

    def _set(self, words: Sequence[str], line: Text) -> None:
        if len(words) < 2:
            raise wrong_line(line, "an input and its value are wanted", "write `set INPUT VALUE`")
        machine, chart, name = self.names.find(words[0], "input", names.inputs, line)
        given, value = input_given(chart, (name, *words[1:]), line)
        self._request("set", m=plain(machine), input=given, value=value)
        self._stopped()

    def _returns(self, words: Sequence[str], line: Text) -> None:
        machine, chart, name = self.names.find(words[0], "operation", names.operations, line)
        operation, results = results_given(chart, (name, *words[1:]), line)
        self._request("returns", m=plain(machine), operation=operation, results=results)
        self._stopped()

    def _wait(self, words: Sequence[str], line: Text) -> None:
        self._pass(read_wait(" ".join(words), line, self.hub.simulation.tick))
        self._stopped()

    def _pass(self, ticks: int) -> None:
        """Let so much time pass, or until the machines stop."""
        self._request("run", speed=1)
        self.hub.advance(ticks * self.hub.simulation.tick)
        while self.hub.wants_more and not self.is_interrupted:
            self.hub.advance(0)
        if self.hub.is_running:
            self._request("pause")

    async def _go(self, words: Sequence[str], line: Text) -> None:
        until = ""
        if words:
            until = _after(line, "until")
            if words[0] != "until" or not until:
                raise wrong_line(line, "a condition is wanted", "write `go until COND`, or `go`")
        self._request("run", speed=0, until=until)
        while self.hub.is_running and not self.is_interrupted:
            self.hub.advance(0)
            await asyncio.sleep(0)  # a served page continues
        if self.hub.is_running:
            self._request("pause")
            self._flush()
            self._show(Styled("interrupted", "yellow"))
        self._stopped(is_printed=True)

    def _stopped(self, *, is_printed: bool = False) -> None:
        """Print why the session stopped, if it did."""
        self._flush()
        match self._mode.get("why"):
            case ["breakpoint", number]:
                text = self._points.get(number, "of another client")
                self._show(Styled(f"breakpoint {number}: {text}", "bold yellow"))
            case ["until", text]:
                self._show(Styled(f"{text} holds", "bold yellow"))
            case ["idle"] if is_printed:
                self._show(Styled("no timer is armed", "yellow"))
            case ["fault", "livelock", message]:
                self._show(Styled(str(message), "bold red"))
        self._mode = {**self._mode, "why": []}

    # --- questions -----------------------------------------------------------------------------

    def _why(self, words: Sequence[str], line: Text) -> None:
        if not words:
            raise wrong_line(line, "no event is named", "write `why EVENT`")
        machine, chart, name = self.names.find(words[0], "event", names.events, line)
        fields: dict[str, Any] = {"m": plain(machine), "event": plain(name)}
        if len(words) > 1:
            fields["with"] = self._event(words, line)[2]
        found = self._request("why", **fields)
        self._show(Styled.assemble((words[0], "bold"), f" {WOULD[found['would']]}"))
        if "because" in found:
            self._show(f"  {found['because']}")
        for row in found["looked"]:
            guard = f" [{row['guard']}]" if "guard" in row else ""
            values = ", ".join(
                f"{k} is {format_value(v)}" for k, v in row.get("values", {}).items()
            )
            holds = f"{HOLDS[row['holds']]}{f': {values}' if values and guard else ''}"
            span = chart.transitions[row["t"]].span
            at, _ = span.source.position(span.start)
            self._show(f"  {row['state']}{guard} {holds}  {span.source.name}:{at}")

    def _watch(self, expression: str, line: Text) -> None:
        if not expression:
            raise wrong_line(line, "an expression is wanted", "write `watch EXPR`")
        found = self._request("watch", expression=expression)
        self._show(found["error"] if "error" in found else format_value(found["value"]))

    def _events(self) -> None:
        for machine, chart in self.names.machines.items():
            found = {e["event"]: e["would"] for e in self._request("events", m=plain(machine))}
            for name, owner, _ in self.names.names_of_kind(names.events):
                if owner == machine:
                    event = chart.events[chart.event_index[name.removeprefix(f"{machine}.")]]
                    mark = " " if found[event.name] == "no" else "*"
                    fields = ", ".join(f"{field.name} {field.type}" for field in event.fields)
                    self._show(f"  {mark} {name}{f'({fields})' if fields else ''}")

    def _where(self) -> None:
        """Print the time and the active states."""
        simulation, now = self.hub.simulation, self.hub.at
        each = zip(simulation.names, simulation.charts, moment_of(self.hub).snapshots, strict=True)
        for name, chart, snapshot in each:
            time_ = f"{duration_text(now * simulation.tick):>8}  "
            machine = f"{name}: " if len(simulation.names) > 1 else ""
            active = Printer(chart).active(snapshot)
            self._show(Styled.assemble((time_, "cyan"), (machine, "blue"), (active, "green")))

    def _each(self, lines: Callable[[Chart, Snapshot], Iterator[Styled]]) -> None:
        """Print lines of each machine, in a system below its name."""
        simulation = self.hub.simulation
        each = zip(simulation.names, simulation.charts, moment_of(self.hub).snapshots, strict=True)
        for name, chart, snapshot in each:
            if len(simulation.names) > 1:
                self._show(Styled(name, "blue"))
            for line in lines(chart, snapshot):
                self._show(Styled.assemble("  ", line))

    # --- breakpoints, history, files -----------------------------------------------------------

    def _break(self, words: Sequence[str], line: Text) -> None:
        if not words:
            for number, text in self._points.items():
                self._show(f"  {number}: {text}")
            return
        if words[0] == "if":
            fields: dict[str, Any] = {"on": "condition", "what": _after(line, "if")}
        else:
            fields = self._point(words, line)
        self._points[self._request("break", **fields)] = (
            line.value.strip().partition(" ")[2].strip()
        )

    def _point(self, words: Sequence[str], line: Text) -> dict[str, Any]:
        """Return the fields of a breakpoint that is no condition."""
        on, *rest = words
        fields: dict[str, Any] = {"on": on}
        if "if" in rest:
            fields["if"] = _after(line, "if")
            rest = rest[: rest.index("if")]
        if on in ("fault", "error", "lost"):
            reject_extra_words(rest, line, f"break {on}")
            return fields
        if on == "changed":
            return {**fields, "what": " ".join(rest)}
        kinds = [kind for kind in KINDS if kind != "condition"]
        if on not in kinds:
            help_ = suggest(on, [*kinds, "if"], f"write `if`, or one of {', '.join(kinds)}")
            raise wrong_line(line, f"there is no breakpoint on `{on}`", help_)
        if len(rest) != 1:
            raise wrong_line(line, "one name is wanted", f"write `break {on} NAME`")
        if on == "property":
            return {**fields, "what": rest[0]}
        if on == "taken":
            machine, dot, number = rest[0].rpartition(".")
            only = next(iter(self.names.machines))
            if not number.isdecimal() or (not dot and len(self.names.machines) > 1):
                raise wrong_line(line, f"`{rest[0]}` is not a transition", "write its number")
            return {**fields, "m": plain(machine or only), "what": int(number)}
        kind: Kind = BLOCKS[on]
        what = "event" if on in ("event", "sent") else "state"
        machine, _, name = self.names.find(rest[0], what, kind, line)
        return {**fields, "m": plain(machine), "what": plain(name)}

    @property
    def _place(self) -> Place:
        return Place(self._mode.get("branch", 0), self.hub.n, self.hub.at)

    def _back_or_forth(self, word: str, rest: Sequence[str], line: Text) -> None:
        source, target = self._past, self._future
        if word == "redo":
            source, target = target, source
        count = _number(rest, line, COMMANDS[word][0], 1)
        if not source or not count:
            self._show(Styled(f"nothing to {word}", "yellow"))
            return
        for _ in range(min(count, len(source))):
            target.append(self._place)
            self._go_to(source.pop())
        self._waiting.clear()
        self._where()

    def _go_to(self, place: Place) -> None:
        """Go to a place in the history; nothing happens between its entry and its time."""
        if place.branch != self._place.branch:
            self._request("fork", branch=place.branch)
        self._request("seek", n=place.n)
        if self.hub.at < place.now:
            self._pass(place.now - self.hub.at)

    def _fork(self, rest: Sequence[str], line: Text) -> None:
        if rest:
            self._request("fork", branch=_number(rest, line, "fork N"))
            self._where()
            return
        self._show(f"  {self._place.branch}: this one, to entry {self._mode['head']}")
        for each in self._request("branches"):
            self._show(f"  {each['branch']}: to entry {each['head']}")

    def _save(self, rest: Sequence[str], line: Text) -> None:
        kinds = {"test": "pytest", "script": "script", "messages": "live"}
        match rest:
            case ["as", kind, name] if kind in kinds:
                path = Path(f"{name.removesuffix('_test')}_test.py" if kind == "test" else name)
                self._write(path, self._request("save", **{"as": kinds[kind]}))
                self._show(f"{path} is written")
            case _:
                help_ = (
                    "write `save as test NAME`, `save as script FILE` or `save as messages FILE`"
                )
                raise wrong_line(line, "nothing is saved", help_)


def _values(chart: Chart, snapshot: Snapshot) -> Iterator[Styled]:
    tick = chart.capacities.tick
    for one, value in variables(chart, snapshot):
        yield Styled(f"{one.name} = {show(value, one.type, tick)}")


def _after(line: Text, word: str) -> str:
    """Return the rest of a line after a word."""
    _, _, rest = f" {line.value.strip()} ".partition(f" {word} ")
    return rest.strip()


def _number(rest: Sequence[str], line: Text, usage: str, default: int | None = None) -> int:
    if not rest and default is not None:
        return default
    if len(rest) != 1 or not rest[0].isdecimal() or len(rest[0]) > 9:
        raise wrong_line(line, "a number is wanted", f"write `{usage}`")
    return int(rest[0])
