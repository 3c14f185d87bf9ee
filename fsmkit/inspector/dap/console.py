"""The console of an editor: commands, events and expressions, and how their words go on."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from typing import Any

from fsmkit.chart.chart import Chart
from fsmkit.diagnostics import Source, Span, Text
from fsmkit.emit import plain
from fsmkit.inspector.breakpoints import machine_of
from fsmkit.inspector.commands import wrong
from fsmkit.inspector.dap.face import Face
from fsmkit.inspector.dap.view import View
from fsmkit.inspector.questions.typed import (
    event_given,
    format_value,
    input_given,
    results_given,
)
from fsmkit.language import EnumType
from fsmkit.language.units import duration_text
from fsmkit.language.values import tokens
from fsmkit.runtime.interpreter.trace import active_leaves
from fsmkit.runtime.script import is_received, is_returns
from fsmkit.system.system import System

HELP = {
    "post": "post EVENT a=1    put an event in the queue; `EVENT a=1` alone does so, too",
    "set": "set INPUT VALUE   give an input another value",
    "why": "why EVENT a=1     the effect of the event now, and the guard that blocks it",
    "events": "events            the events, and which of them would do something now",
    "state": "state             the active states",
    "run": "run [SPEED]       go on; simulated seconds in a second, 0: as fast as can be",
    "go": "go [until COND]   go on as fast as can be, until COND becomes true",
    "step": "step              take the next macrostep, at its time",
    "timer": "timer             go on to the next deadline",
    "back": "back [N]          show an earlier step",
    "forward": "forward [N]       show a later step",
    "seek": "seek N            show step N",
    "fork": "fork [N]          go to the end of a branch that was left; alone: list them",
    "save": "save KIND         print the session as `script`, `pytest` or `live`",
    "help": "help              these lines; all else is an expression",
}  # fmt: skip
"""The commands."""
LINES = "\n".join((*HELP.values(), "OPERATION returns 1, 2: its next results, one per call"))


class Console:
    """Obeys lines; ``machine``: whose names they have, None: ``machine.name``."""

    def __init__(self, face: Face, view: View, speed: float) -> None:
        self._face = face
        self._view = view
        self._speed = speed

    @property
    def _system(self) -> System:
        return self._face.hub.system

    def is_command(self, line: str, machine: int | None) -> bool:
        """Whether a line is a command or an event, and no expression."""
        words = tokens(line) or [""]
        word = words[0]
        return word in HELP or is_returns(words) or self._event_at(word, machine) is not None

    def obey(self, line: str, machine: int | None) -> str:
        """Execute a line; return the output. Raises `FsmkitError` for an invalid line."""
        words = tokens(line)
        if is_returns(words) and self._event_at(words[0], machine) is None:
            return self._returns(line, words, machine)
        word, rest = words[0], line.strip()[len(words[0]) :].strip()
        found = None if word not in HELP else _COMMANDS[word](self, rest, machine)
        return self._post(line, machine) if found is None else found

    # --- commands --------------------------------------------------------------------------------

    def _post(self, text: str, machine: int | None) -> str:
        place, chart, line = self._event(text, machine)
        event, payload = event_given(chart, tokens(line.value), line)
        name = self._system.machines[place].name
        how = self._face.do("post", m=name, event=event, **{"with": payload})
        return f"{how}: there is no room" if how == "refused" else ""

    def _set(self, text: str, machine: int | None) -> str:
        name, _, rest = text.partition(" ")
        place, own = self._owner(name, machine)
        text = f"{own} {rest}"
        given, value = input_given(self._view.charts[place], tokens(text), _line(text))
        self._face.do("set", m=self._name(place), input=given, value=value)
        return ""

    def _returns(self, text: str, words: list[str], machine: int | None) -> str:
        place, own = self._owner(words[0], machine)
        chart = self._view.charts[place]
        operation, results = results_given(chart, [own, *words[1:]], _line(text))
        self._face.do("returns", m=self._name(place), operation=operation, results=results)
        return ""

    def _owner(self, name: str, machine: int | None) -> tuple[int, str]:
        """Return the machine of ``machine.name``, or the selected one, and the name."""
        first, dot, last = name.partition(".")
        names = [each.name for each in self._system.machines]
        if dot and first in names:
            return names.index(first), last
        return machine_of(self._system, "") if machine is None else machine, name

    def _why(self, text: str, machine: int | None) -> str:
        place, chart, line = self._event(text, machine)
        words = tokens(line.value)
        given: dict[str, Any] = {}
        if len(words) > 1:
            given = {"with": event_given(chart, words, line)[1]}
        event_name = words[0] if words else ""
        told = self._face.do("why", m=self._system.machines[place].name, event=event_name, **given)
        rows = [f"{event_name}: {told['would']}{_because(told)}"]
        for row in told["looked"]:
            read = row.get("values", {}).items()
            values = ", ".join(f"{name} = {format_value(value)}" for name, value in read)
            guard = f" if {row['guard']}" if "guard" in row else ""
            error = f" ({row['error']})" if "error" in row else ""
            holds = {True: "holds", False: "does not hold"}.get(row["holds"], "depends")
            told_values = f" [{values}]" if values else ""
            rows.append(
                f"  {row['state']}, transition {row['t']}{guard}: {holds}{error}{told_values}"
            )
        return "\n".join(rows)

    def _events(self, text: str, machine: int | None) -> str:
        del text
        rows = []
        for place, name, _ in self._machines(machine):
            rows += [
                f"{each['would']:8} {self._prefix(place)}{each['event']}"
                for each in self._face.do("events", m=name)
            ]
        return "\n".join(rows)

    def _state(self, text: str, machine: int | None) -> str:
        del text
        tick = self._view.charts[0].capacities.tick
        rows = [f"at {duration_text(self._face.hub.at * tick)}, step {self._face.hub.n}"]
        for place, name, chart in self._machines(machine):
            leaves = " ".join(active_leaves(chart, self._view.snapshots[place])) or "not started"
            rows.append(f"{name}: {leaves}")
        return "\n".join(rows)

    def _run(self, text: str, machine: int | None) -> str:
        del machine
        try:
            speed = float(text) if text else self._speed
        except ValueError as error:
            raise wrong(f"`{text}` is not a speed", "write `run 10`, or `run`") from error
        self._face.do("run", speed=speed)
        return ""

    def _go(self, text: str, machine: int | None) -> str:
        del machine
        word, _, condition = text.partition(" ")
        if text and (word != "until" or not condition.strip()):
            raise wrong("a condition is wanted", "write `go until count == 3`, or `go`")
        self._face.do("run", speed=0, until=condition.strip())
        return ""

    def _step(self, text: str, machine: int | None) -> str:
        del text, machine
        self._face.do("step")
        return ""

    def _timer(self, text: str, machine: int | None) -> str:
        del text, machine
        self._face.do("step", how="timer")
        return ""

    def _move(self, do: str, text: str) -> str:
        self._face.do(do, count=_number(text or "1"))
        return ""

    def _back(self, text: str, machine: int | None) -> str:
        del machine
        return self._move("back", text)

    def _forward(self, text: str, machine: int | None) -> str:
        del machine
        return self._move("forward", text)

    def _seek(self, text: str, machine: int | None) -> str:
        del machine
        self._face.do("seek", n=_number(text))
        return ""

    def _fork(self, text: str, machine: int | None) -> str:
        del machine
        if not text:
            rows = self._face.do("branches")
            told = [f"{row['branch']}: steps {row['first']} to {row['head']}" for row in rows]
            return "\n".join(told) or "there are no others"
        self._face.do("fork", branch=_number(text))
        return ""

    def _save(self, text: str, machine: int | None) -> str:
        del machine
        return str(self._face.do("save", **{"as": text}))

    def _help(self, text: str, machine: int | None) -> str:
        del text, machine
        return LINES

    # --- completions -----------------------------------------------------------------------------

    def completions(self, text: str, machine: int | None) -> tuple[str, list[str]]:
        """Return the last word of a text up to the cursor, and its completions."""
        begun = re.split(r"[\s(\[\]!=<>&|+*/,-]", text)[-1]
        first, _, behind = text.lstrip().partition(" ")
        is_first = " " not in text.lstrip()
        if is_first:
            known = [*HELP, *self._event_names(machine), *self._names(machine)]
        elif first in ("post", "why") and " " not in behind:
            known = list(self._event_names(machine))
        elif first == "set" and " " not in behind:
            known = [
                f"{self._prefix(place, machine)}{each.name}"
                for place, _, chart in self._machines(machine)
                for each in chart.inputs
            ]
        elif first == "save":
            known = ["script", "pytest", "live"]
        elif (event := self._event_at(self._posted(text), machine)) is not None:
            place, name = event
            fields = (
                self._view.charts[place].events[self._view.charts[place].event_index[name]].fields
            )
            known = [f"{field.name}=" for field in fields]
            known += [
                member
                for field in fields
                if isinstance(field.type, EnumType)
                for member in field.type.members
            ]
        else:
            known = list(self._names(machine))
        found = dict.fromkeys(plain(word) for word in known)
        return begun, [word for word in found if word.startswith(begun)]

    def _posted(self, text: str) -> str:
        words = tokens(text)
        return words[1] if words[0] in ("post", "why") and len(words) > 1 else words[0]

    def _names(self, machine: int | None) -> Iterator[str]:
        """Yield the names that an expression can have."""
        for place, _, chart in self._machines(machine):
            prefix = self._prefix(place, machine)
            for each in (*chart.data, *chart.inputs, *chart.outputs):
                yield f"{prefix}{each.name}"
            yield from (f"{prefix}In({state.id})" for state in chart.states[1:])
            for type_ in chart.types:
                if isinstance(type_, EnumType):
                    yield from (f"{type_.name}.{member}" for member in type_.members)

    def _event_names(self, machine: int | None) -> Iterator[str]:
        for place, _, chart in self._machines(machine):
            prefix = self._prefix(place, machine)
            yield from (f"{prefix}{event.name}" for event in chart.events if is_received(event))

    # --- names -----------------------------------------------------------------------------------

    def _machines(self, machine: int | None) -> list[tuple[int, str, Chart]]:
        found = [(n, each.name, each.chart) for n, each in enumerate(self._system.machines)]
        return found if machine is None else [found[machine]]

    def _prefix(self, place: int, machine: int | None = None) -> str:
        is_alone = machine is not None or len(self._system.machines) == 1
        return "" if is_alone else f"{self._system.machines[place].name}."

    def _event_at(self, word: str, machine: int | None) -> tuple[int, str] | None:
        """Return the machine and the event that a word names."""
        first, _, last = word.partition(".")
        for place, name, chart in self._machines(None):
            wanted = {last} if name == first else set()
            wanted |= {word} if machine in (None, place) else set()
            for event in wanted & set(chart.event_index):
                if machine is not None or event == last or len(self._system.machines) == 1:
                    return place, event
        return None

    def _event(self, text: str, machine: int | None) -> tuple[int, Chart, Text]:
        """Return the machine of a line with an event, and the line without its name."""
        word = (tokens(text) or [""])[0]
        found = self._event_at(word, machine)
        if found is None:
            place = machine_of(self._system, "" if machine is None else self._name(machine))
            return place, self._view.charts[place], _line(text)
        place, event = found
        return place, self._view.charts[place], _line(event + text.strip()[len(word) :])

    def _name(self, machine: int) -> str:
        return self._system.machines[machine].name


_COMMANDS: dict[str, Callable[[Console, str, int | None], str]] = {
    word: getattr(Console, f"_{word}") for word in HELP
}


def _line(text: str) -> Text:
    return Text(text, Span(Source("<console>", text), 0, len(text)))


def _number(text: str) -> int:
    if not text.isdecimal() or len(text) > 15:
        raise wrong(f"`{text}` is not a number of steps")
    return int(text)


def _because(told: dict[str, Any]) -> str:
    return f", {told['because']}" if "because" in told else ""
