"""The requests that look at a session: threads, stacks, variables, expressions."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from fsmkit.diagnostics import FsmkitError
from fsmkit.emit import plain
from fsmkit.inspector.breakpoints import machine_without_prefix
from fsmkit.inspector.commands import wrong
from fsmkit.inspector.dap import requests as ask
from fsmkit.inspector.dap.console import Console
from fsmkit.inspector.dap.face import Face
from fsmkit.inspector.dap.files import Files
from fsmkit.inspector.dap.view import Frame, Holder, Numbers, Shown, View
from fsmkit.language import ArrayType, Type, Value
from fsmkit.language.values import read_value, tokens
from fsmkit.runtime.live.values import to_json

Json = dict[str, Any]
SCOPE_NAMES = {
    "data": "Data",
    "inputs": "Inputs",
    "outputs": "Outputs",
    "event": "Event",
    "timers": "Timers",
    "queue": "Queue",
}
SCOPE_HINTS = {"data": "locals", "inputs": "arguments"}
FRAME_HINTS = {"region": "label", "invoked": "label", "transition": "subtle"}


class Inspection:
    """The requests for data of a session; `setVariable` and the console also change it."""

    def __init__(self, face: Face, view: View, files: Files, console: Console) -> None:
        self._face = face
        self._view = view
        self._files = files
        self._console = console
        self._frames: Numbers[Frame] = Numbers()
        self._holders: Numbers[Holder] = Numbers()

    # --- threads and frames ----------------------------------------------------------------------

    @property
    def names(self) -> list[str]:
        """The names of the machines."""
        return [machine.name for machine in self._face.hub.system.machines]

    def threads(self, given: ask.Nothing) -> Json:
        """Return the machines."""
        del given
        names = enumerate(self.names, start=1)
        return {"threads": [{"id": number, "name": plain(name)} for number, name in names]}

    def stack(self, given: ask.Stack) -> Json:
        """Return the active states of a machine, the innermost first."""
        if not 1 <= given.thread_id <= len(self.names):
            raise wrong(f"there is no thread {given.thread_id}")
        frames = list(self._view.frames(given.thread_id - 1))
        first, last = _part(given.start_frame, given.levels, len(frames))
        rows = [self._frame(frame) for frame in frames[first:last]]
        return {"stackFrames": rows, "totalFrames": len(frames)}

    def _frame(self, frame: Frame) -> Json:
        span = self._view.span(frame)
        return {
            "id": self._frames.number(frame),
            "name": plain(self._view.title(frame)),
            "source": self._files.source(span.source),
            **self._files.start(span),
            "presentationHint": FRAME_HINTS.get(frame.kind, "normal"),
            "canRestart": frame.kind in ("state", "region") and not frame.within,
        }

    def frame(self, number: int) -> Frame:
        """Return the frame of a number; `FsmkitError` for a number of none."""
        return self._frames.key(number)

    def machine(self, frame: int | None) -> int | None:
        """Return whose names an expression has: of a frame, or of the only machine."""
        if frame:
            return self._frames.key(frame).machine
        return machine_without_prefix(self._face.hub.system, "")

    def sources(self, given: ask.Nothing) -> Json:
        """Return the files of all machines."""
        del given
        return {"sources": self._files.all()}

    def source(self, given: ask.Source) -> Json:
        """Return the text of a source that is no file."""
        of_source = given.source.source_reference if given.source is not None else None
        return {"content": self._files.text(of_source or given.source_reference)}

    # --- variables -------------------------------------------------------------------------------

    def scopes(self, given: ask.OfFrame) -> Json:
        """Return the scopes of a frame."""
        rows = []
        for holder in self._view.scopes(self._frames.key(given.frame_id)):
            hint = SCOPE_HINTS.get(holder.scope)
            rows.append(
                {
                    "name": SCOPE_NAMES[holder.scope],
                    "variablesReference": self._holders.number(holder),
                    "namedVariables": len(self._view.held(holder)),
                    "expensive": False,
                    **({"presentationHint": hint} if hint else {}),
                }
            )
        return {"scopes": rows}

    def variables(self, given: ask.Variables) -> Json:
        """Return the members of a scope, an array or a record."""
        holder = self._holders.key(given.variables_reference)
        rows = self._view.held(holder)
        first, last = _part(given.start, given.count, len(rows))
        is_fixed = holder.scope not in ("data", "inputs") or bool(holder.within)
        return {"variables": [self._variable(row, is_fixed=is_fixed) for row in rows[first:last]]}

    def _variable(self, row: Shown, *, is_fixed: bool) -> Json:
        told: Json = {"name": plain(row.name), "value": plain(row.value), **self._parts(row)}
        if row.expression:
            told["evaluateName"] = plain(row.expression)
        if is_fixed:
            told["presentationHint"] = {"attributes": ["readOnly"]}
        return told

    def _parts(self, row: Shown) -> Json:
        """Return the type of a value, and the number under which its parts are to be had."""
        if row.type is None:
            return {"variablesReference": 0}
        told: Json = {"type": plain(str(row.type)), "variablesReference": 0}
        if row.holder is not None:
            told["variablesReference"] = self._holders.number(row.holder)
            is_array = isinstance(row.type, ArrayType)
            told["indexedVariables" if is_array else "namedVariables"] = row.size
        return told

    def set_variable(self, given: ask.SetVariable) -> Json:
        """Give an input another value; or a datum, by hand."""
        holder = self._holders.key(given.variables_reference)
        names = [row.name for row in self._view.held(holder)]
        if holder.scope not in ("data", "inputs") or holder.within or given.name not in names:
            raise wrong(f"`{given.name}` cannot be set", "inputs and data of the machines can")
        if self._view.is_within:
            raise wrong("within a macrostep nothing can be set", "step out of it first")
        part = replace(holder, parts=(*holder.parts, names.index(given.name)))
        _, type_, expression = self._view.value(part)
        value = self._read(given.value, type_, holder.machine, given.name)
        before, whole_type, name = self._view.value(replace(part, parts=part.parts[:1]))
        told = to_json(_with(before, part.parts[1:], value), whole_type)
        do, key = ("set", "input") if holder.scope == "inputs" else ("change", "data")
        self._face.do(do, m=self.names[holder.machine], **{key: name}, value=told)
        row = self._view.shown(part, given.name, value, type_, expression)
        return {"value": plain(row.value), **self._parts(row)}

    def _read(self, text: str, type_: Type, machine: int, name: str) -> Value:
        """Read a value as it is shown, or as an expression."""
        words = iter(tokens(text))
        try:
            value = read_value(words, type_, self._view.charts[machine].capacities.tick)
            if next(words, None) is None:
                return value
            reason = "has words behind its value"
        except ValueError as error:
            reason = str(error)
        try:
            return self._view.typed(machine, text, type_)
        except FsmkitError as error:
            raise wrong(f"`{name}` {reason}") from error

    def watched(self, given: ask.DataInfo) -> tuple[int | None, str]:
        """Return the machine and the expression of a variable; no expression if it has none."""
        if not given.variables_reference:
            return self.machine(given.frame_id), given.name
        holder = self._holders.key(given.variables_reference)
        rows = {row.name: row.expression for row in self._view.held(holder)}
        return holder.machine, "" if holder.within else rows.get(given.name, "")

    # --- expressions -----------------------------------------------------------------------------

    def evaluate(self, given: ask.Evaluate) -> Json:
        """Return the value of an expression; in the console, execute a line."""
        text = given.expression.strip()
        machine = self.machine(given.frame_id)
        if not text:
            raise wrong("there is no expression", "type `help` in the console")
        if given.context == "repl" and self._console.is_command(text, machine):
            return {"result": plain(self._console.obey(text, machine)), "variablesReference": 0}
        within = self._frames.key(given.frame_id).within if given.frame_id else ()
        value, type_ = self._view.evaluated(machine, within, text)
        holder = Holder(machine or 0, within, "watch", text=text)
        row = self._view.shown(holder, "", value, type_, text)
        return {"result": plain(row.value), **self._parts(row)}

    def completions(self, given: ask.Completions) -> Json:
        """Return how a line may go on."""
        text = self._files.before(given.text, given.line, given.column)
        begun, words = self._console.completions(text, self.machine(given.frame_id))
        rows = [{"label": word, "start": self._files.width(text) - self._files.width(begun),
                 "length": self._files.width(begun)} for word in words]  # fmt: skip
        return {"targets": rows}


def _part(first: int | None, count: int | None, size: int) -> tuple[int, int]:
    """Return the range of a page; without a count all."""
    begin = max(0, first or 0)
    return begin, begin + count if count is not None and count > 0 else size


def _with(value: Value, parts: tuple[int, ...], part: Value) -> Value:
    """Return a value in which a part is another one."""
    if not parts or not isinstance(value, tuple):
        return part
    first, *rest = parts
    inner = _with(value[first], tuple(rest), part)
    return (*value[:first], inner, *value[first + 1 :])
