"""A session for an editor: its breakpoints, its steps, and the events of its stops."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import msgspec

from fsmkit.diagnostics import FsmkitError
from fsmkit.emit import plain
from fsmkit.inspector.commands import wrong
from fsmkit.inspector.dap import requests as ask
from fsmkit.inspector.dap.console import Console
from fsmkit.inspector.dap.describing import describe_step
from fsmkit.inspector.dap.face import Face
from fsmkit.inspector.dap.files import Files
from fsmkit.inspector.dap.inspection import Inspection
from fsmkit.inspector.dap.places import Places
from fsmkit.inspector.dap.stops import Stops, data_id
from fsmkit.inspector.dap.view import View
from fsmkit.inspector.hub import Hub
from fsmkit.runtime.interpreter.snapshot import Entered
from fsmkit.runtime.interpreter.trace import active_leaves
from fsmkit.runtime.live.lines import lines_of
from fsmkit.runtime.live.messages import Step
from fsmkit.verify import questions

Json = dict[str, Any]
WHY = {
    "asked": ("pause", "paused"),
    "idle": ("pause", "no timer is armed: post an event"),
    "end": ("pause", "the record ends here"),
    "unknown": ("pause", "the data are not known from here on"),
    "until": ("breakpoint", "the condition became true"),
    "reloaded": ("goto", "the file was saved, and the same is done again"),
}
"""Reasons of the hub: in the protocol, and for people. Otherwise the step in view is described."""


class Session:
    """The hub of one editor.

    ``event`` receives events for the editor. `look` reports the steps since the last call. The
    owner calls it after each request, and whenever ``wakes`` was called.
    """

    def __init__(
        self,
        hub: Hub,
        given: ask.Launch,
        client: ask.Initialize,
        event: Callable[[str, Json], None],
        *,
        may_command: bool = True,
        wakes: Callable[[], None] = lambda: None,
    ) -> None:
        self.hub = hub
        self._names = [machine.name for machine in hub.system.machines]
        self._wakes = wakes
        self._event = event
        self._given = given
        self._has_begun = False
        self._asked = ""
        """The reason of a stop that the editor requested and still awaits."""
        self._was_running = self._is_running
        self._shown: tuple[int, int, int | None] | None = None
        """The step, branch and microstep that the editor knows."""
        self._branch = 0
        self._why: list[Any] = []
        self._last_why: list[Any] = []
        self._leaves: dict[str, list[str]] = {}
        self._view = View(hub)
        self._places = Places(hub.system)
        self._files = Files(self._places, client)
        self.face = Face(hub, self._told, may_command=may_command)
        self._stops = Stops(self.face, self._places)
        console = Console(self.face, self._view, given.speed)
        self.inspection = Inspection(self.face, self._view, self._files, console)

    # --- events of the hub --------------------------------------------------------------------

    def begin(self, given: ask.Nothing) -> Json:
        """Run, or pause at the step in view."""
        del given
        self._has_begun = True
        if self._given.stop_on_entry or self._was_running:
            self._asked = "entry"
        else:
            self._run()
        return {}

    def look(self) -> None:
        """Send the editor the steps since the last report."""
        if not self._has_begun:
            return
        if self._is_running:
            if not self._was_running:
                self._event("continued", {"threadId": 1, "allThreadsContinued": True})
            self._was_running, self._asked = True, ""
            return
        self._view.follow()
        now = (self.hub.n, self._branch, self._view.micro)
        if self._was_running or self._asked or now != self._shown:
            self._stopped()
            self._shown = now

    @property
    def _is_running(self) -> bool:
        """Return whether the view advances automatically: it runs, or follows a program."""
        view = self.hub.view
        return self.hub.is_running or (view.is_live and view.is_following)

    def _stopped(self) -> None:
        why, self._why = self._why, []
        word = str(why[0]) if why else ""
        was_running, self._was_running = self._was_running, False
        if word == "fault" and was_running and "fault" not in self._stops.filters:
            self._run()
            return
        asked, self._asked, self._last_why = self._asked, "", why
        done = self._view.stepped
        text = describe_step(self.hub, done, self._view.microstep)
        body: Json = {
            "reason": asked or "step",
            "description": text,
            "threadId": 1 if done is None else done.machine + 1,
            "allThreadsStopped": True,
        }
        match why:
            case ["fault", *words]:
                body |= {"reason": "exception", "text": f"{text}: fault {_words(words)}"}
            case ["property", name, *loop]:
                broken = f"{text}: {name} is violated"
                if loop:
                    broken += f"; from step {loop[-1]} on it repeats for ever"
                body |= {"reason": "exception", "text": plain(broken)}
            case ["breakpoint", number]:
                body |= self._of_breakpoint(number)
            case [str(word), *_] if word in WHY and (was_running or word != "asked"):
                reason, body["description"] = WHY[word]
                body["reason"] = asked or reason
            case _:
                pass
        self._event("stopped", body)

    def _of_breakpoint(self, number: int) -> Json:
        stop = self._stops.of(number)
        if stop is None:  # another client's
            return {"reason": "breakpoint"}
        told = {"text": stop.title} if stop.title else {}
        return {"reason": stop.reason, "hitBreakpointIds": [stop.number], **told}

    def _told(self, message: Json) -> None:
        """Take a message of the hub."""
        match message["k"]:
            case "hello" if self.hub.system is not self._places.system:
                self._reloaded()
            case "broken":
                for finding in message["findings"]:
                    self._output(f"{finding['rule']}: {finding['message']}", "stderr")
            case "mode":
                self._branch = message.get("branch", 0)
                stands = message["mode"] in ("paused", "frozen")
                self._why = message.get("why", []) if stands else []
            case "log":
                self._output(message["text"])
            case "step":
                self._step(message)
            case "state":
                self._note_leaves(message["m"])
            case _:
                pass
        self._wakes()

    def _step(self, message: Json) -> None:
        """Print the log output of a macrostep, or its trace."""
        if not self._given.trace:
            for word, *values in message["do"]:
                if word == "log":
                    self._output(" ".join(map(str, values)))
            return
        step = msgspec.convert(message, Step)
        chart = self.hub.system.machines[self._names.index(step.m)].chart
        prefix = f"{step.m}: " if len(self._names) > 1 else ""
        for line in lines_of(chart, step, self._leaves.get(step.m, ())):
            self._output(prefix + line)
        self._note_leaves(step.m)

    def _note_leaves(self, name: str) -> None:
        if self._given.trace and self.hub.moment is not None:
            place = self._names.index(name)
            chart = self.hub.system.machines[place].chart
            self._leaves[name] = active_leaves(chart, self.hub.moment.snapshots[place])

    def _output(self, text: str, category: str = "stdout") -> None:
        self._event("output", {"category": category, "output": f"{plain(text)}\n"})

    def _reloaded(self) -> None:
        """Take other charts: the file was saved anew, and the hub did the same with it again."""
        self._names = [machine.name for machine in self.hub.system.machines]
        self._places.read(self.hub.system)
        self._view.leave()
        self._shown = None

    # --- breakpoints -----------------------------------------------------------------------------

    def in_source(self, given: ask.SourceBreakpoints) -> Json:
        """Set the breakpoints of a file."""
        path = self._files.path(given.source)
        source = self._files.known(path)
        wanted = []
        for each in given.breakpoints or ():
            line = self._files.line(each.line)
            column = self._files.column(path, line, each.column)
            wanted.append(msgspec.structs.replace(each, line=line, column=column))
        rows = []
        for row in self._stops.in_source(path, wanted):
            if source is not None and "line" in row:
                at = self._files.position(source, row["line"], row["column"])
                row |= {**at, "source": self._files.source(source)}
            rows.append(row)
        return {"breakpoints": rows}

    def locations(self, given: ask.Lines) -> Json:
        """Return where breakpoints can be in a part of a file."""
        path = self._files.path(given.source)
        source = self._files.known(path)
        if source is None:
            return {"breakpoints": []}
        first = self._files.line(given.line)
        last = first if given.end_line is None else self._files.line(given.end_line)
        begin = (first, self._files.column(path, first, given.column) or 1)
        end = (last, self._files.column(path, last, given.end_column) or len(source.text) + 1)
        found = [p for p in self._places.of(path) if begin <= (p.line, p.column) <= end]
        return {"breakpoints": [self._files.position(source, p.line, p.column) for p in found]}

    def on_functions(self, given: ask.Breakpoints) -> Json:
        """Set the breakpoints on names of states and events."""
        return {"breakpoints": list(self._stops.on_functions(given.breakpoints))}

    def on_exceptions(self, given: ask.Filters) -> Json:
        """Set the exception filters."""
        return {"breakpoints": list(self._stops.on_exceptions(given.filters))}

    def on_data(self, given: ask.Breakpoints) -> Json:
        """Set the breakpoints on values that change."""
        return {"breakpoints": list(self._stops.on_data(given.breakpoints))}

    def data_info(self, given: ask.DataInfo) -> Json:
        """Return by which name a value can be watched for changes, if it can."""
        machine, expression = self.inspection.watched(given)
        try:
            questions.read(self.hub.system, expression, machine, None)
        except FsmkitError as error:
            return {"dataId": None, "description": plain(error.diagnostics[0].message)}
        name = "" if machine is None else self._names[machine]
        return {
            "dataId": data_id(name, expression),
            "description": plain(expression),
            "accessTypes": ["write"],
            "canPersist": True,
        }

    def exception_info(self, given: ask.Thread) -> Json:
        """Return the fault or the property at which it stopped."""
        del given
        match self._last_why:
            case ["fault", *words]:
                found = _words(words)
            case ["property", name, *_]:
                found = plain(str(name))
            case ["breakpoint", number] if (stop := self._stops.of(number)) is not None:
                found = stop.title
            case _:
                raise wrong("it did not stop at a fault or a property")
        text = describe_step(self.hub, self._view.stepped, self._view.microstep)
        return {"exceptionId": found, "description": text, "breakMode": "always"}

    # --- going on and back -----------------------------------------------------------------------

    def go_on(self, given: ask.Thread) -> Json:
        """Run; where nothing can happen any more, end."""
        del given
        self._view.leave()
        if self._is_over:
            self._event("terminated", {})
        else:
            self._run()
        return {"allThreadsContinued": True}

    @property
    def _is_over(self) -> bool:
        moment, view = self.hub.moment, self.hub.view
        if moment is None or moment.to_start or view.is_live or not view.is_at_head:
            return False
        return not any(snapshot.running for snapshot in moment.snapshots)

    def _run(self) -> None:
        self._was_running, self._asked = True, ""
        self.face.do("run", speed=self._given.speed)

    def pause(self, given: ask.Thread) -> Json:
        """Pause."""
        del given
        self.face.do("pause")
        return {}

    def next(self, given: ask.Stepping) -> Json:
        """Do a macrostep, or the rest of it."""
        if given.granularity == "instruction":
            return self.step_in(given)
        is_within = self._view.is_within
        self._view.leave()
        if not is_within:
            self.face.do("step")
        self._asked = "step"
        return {}

    def step_out(self, given: ask.Stepping) -> Json:
        """Go to the end of the macrostep; from there, do another one."""
        if self._view.micro is None:
            return self.next(given)
        self._view.leave()
        self._asked = "step"
        return {}

    def step_in(self, given: ask.Stepping) -> Json:
        """Do a microstep."""
        del given
        micro = self._view.micro
        if micro is None or not self._view.enter(micro + 1):
            self._view.leave()
            if self.face.do("step"):
                self._view.enter(1)
        self._asked = "step"
        return {}

    def step_back(self, given: ask.Stepping) -> Json:
        """Go back a macrostep; within one, a microstep."""
        micro = self._view.micro
        is_small = given.granularity == "instruction" and micro is None
        back = -1 if micro is None else micro - 1
        if not ((is_small or back > 0) and self._view.enter(back)):
            self._view.leave()
            self.face.do("back")
        self._asked = "step"
        return {}

    def reverse(self, given: ask.Thread) -> Json:
        """Go back to the last breakpoint, or to the first step that is known."""
        del given
        self._view.leave()
        self.face.do("back", to="breakpoint")
        self._asked = "step"
        return {}

    def restart_frame(self, given: ask.OfFrame) -> Json:
        """Go back to where a state was entered; of a chart to the first step that is known."""
        frame = self.inspection.frame(given.frame_id)
        if frame.kind not in ("state", "region") or frame.within:
            raise wrong("this frame is not a state of a machine", "restart one that is")
        self._view.leave()
        done = self.hub.stepped
        effects = done.macrostep.effects if done and done.machine == frame.machine else ()
        state = self.hub.system.machines[frame.machine].chart.states[frame.index]
        if frame.index == 0:
            self.face.do("seek", n=0)
        elif Entered(frame.index) not in effects:
            name = self._names[frame.machine]
            self.face.do("back", to="entered", m=name, what=state.id)
        self._asked = "restart"
        return {}

    def close(self) -> None:
        """Leave the hub, and take the breakpoints along."""
        self._stops.close()
        self.face.close()


def _words(values: list[Any]) -> str:
    return " ".join(plain(str(value)) for value in values if value)
