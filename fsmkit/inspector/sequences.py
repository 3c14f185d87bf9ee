"""Draw a session as a sequence diagram with times, events and their receivers."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from msgspec import UnsetType

from fsmkit.inspector.system_at import Course
from fsmkit.language.units import duration_text
from fsmkit.runtime.live.messages import AnyMessage, Json, Pass, Post, Row, Set, Step
from fsmkit.verify.report.sequences import mermaid
from fsmkit.verify.report.sequences.model import (
    Arrow,
    Block,
    Cause,
    Lifeline,
    Part,
    Transport,
    fold_repetitions,
)
from fsmkit.verify.report.sequences.model import Sequence as Diagram

MOST_STEPS = 500
"""Steps of a diagram: the last ones, of which those that repeat alike are shown once."""
CAUSES = {
    "start": Cause.START,
    "timeout": Cause.TIMEOUT,
    "event": Cause.QUEUE,
    "delayed": Cause.TIMEOUT,
}


def as_mermaid(course: Course) -> str:
    """Return the last steps of the branch in view, for Mermaid."""
    system, history = course.simulation.system, course.history
    first = max(history.first + 1, 1)
    making = _Diagram(course)
    blocks = [
        block for n in range(first, history.head + 1) for block in making.blocks(course.messages(n))
    ]
    lifelines = tuple(Lifeline(each.name, each.environment) for each in system.machines)
    parts = fold_repetitions(tuple(blocks[-MOST_STEPS:]))
    at = duration_text(course.at(history.head) * course.simulation.tick)
    end = (f"up to entry {history.head} of a session, at {at}",)
    return mermaid.draw(Diagram(system.name, lifelines, parts, end, violated=False))


class _Diagram:
    def __init__(self, course: Course) -> None:
        simulation = course.simulation
        self._tick = simulation.tick
        self._names = simulation.names
        self._is_alone = course.encoder.is_alone
        self._active: dict[str, list[str]] = {}
        self._posted: dict[str, list[str]] = {}
        """External events in the queue of each machine."""
        self._told: Arrow | None = None

    def blocks(self, messages: Sequence[AnyMessage]) -> Iterator[Block]:
        """Yield the block of a step or of an external change."""
        first = messages[0]
        match first:
            case Post(how="queued"):
                self._posted.setdefault(first.m, []).append(_text(first.event))
            case Set():
                changes = [f"{k} = {_value(v)}" for k, v in {**first.inputs, **first.data}.items()]
                changes += [
                    f"{name} returns {', '.join(map(_value, values))}"
                    for name, values in first.results.items()
                ]
                yield self._block(first, Cause.OUTSIDE, ", ".join(changes), first.n)
            case Step():
                yield self._step(first, messages[1:])
            case _:
                pass

    def _step(self, step: Step, others: Sequence[AnyMessage]) -> Block:
        cause, text = CAUSES.get(step.cause[0], Cause.ITSELF), _text(step.cause[1:])
        if step.cause[0] == "timeout":
            left = [row[1] for row in step.do if row[0] == "-"]
            text = f"timeout in {left[0]}" if left else "timeout"
        posted = self._posted.get(step.m, [])
        if cause is Cause.QUEUE and posted and posted[0] == text:
            posted.pop(0)
            cause = Cause.OUTSIDE
        line = self._names.index(step.m)
        told = self._told
        is_shown = cause is Cause.QUEUE and told is not None and told.target == line
        arrows = tuple(self._arrows(line, step, others))
        self._told = arrows[-1] if arrows else None
        if not isinstance(step.on, UnsetType):
            self._active[step.m] = step.on
        entered = tuple(row[1] for row in step.do if row[0] == "+")
        active = self._active.get(step.m, [])
        return self._block(
            step,
            cause,
            text,
            step.n,
            is_shown=is_shown and told is not None and told.text == text,
            entered=tuple(name for name in entered if name in active),
            arrows=arrows,
        )

    def _block(
        self,
        message: Step | Set,
        cause: Cause,
        text: str,
        number: int,
        *,
        is_shown: bool = False,
        entered: tuple[str, ...] = (),
        arrows: tuple[Arrow, ...] = (),
    ) -> Block:
        at = duration_text(message.at * self._tick)
        line = self._names.index(message.m)
        active = tuple(self._active.get(message.m, ()))
        return Block(
            number, at, line, cause, text, is_shown=is_shown, entered=entered, active=active,
            arrows=arrows,
        )  # fmt: skip

    def _arrows(self, line: int, step: Step, others: Sequence[AnyMessage]) -> Iterator[Arrow]:
        for other in others:
            match other:
                case Set(m=name, inputs=inputs):
                    values = ", ".join(f"{k} = {_value(v)}" for k, v in inputs.items())
                    yield Arrow(line, self._names.index(name), values, Transport.VALUE)
                case Pass(target=(name, event), values=values, how=how):
                    part = Part.LOST if how in ("lost", "refused") else Part.WHOLE
                    target = self._names.index(name)
                    yield Arrow(line, target, _text([event, *values]), part=part)
                case _:
                    pass
        if self._is_alone:
            for row in step.do:
                if row[0] in ("out", "op"):
                    words = row[1 : row.index("=")] if "=" in row[2:] else row[1:]
                    yield Arrow(line, None, _text(words, is_call=row[0] == "op"))


def _text(row: Row, *, is_call: bool = False) -> str:
    """Return an event or a call with its values in brackets."""
    if not row:
        return "eventless"
    name, *values = row
    brackets = f"({', '.join(map(_value, values))})" if values or is_call else ""
    return f"{name}{brackets}"


def _value(value: Json) -> str:
    match value:
        case {"int": str(text)} | {"float": str(text)}:
            return text
        case dict():
            return "{" + ", ".join(f"{k} = {_value(v)}" for k, v in value.items()) + "}"
        case list():
            return "[" + ", ".join(map(_value, value)) + "]"
        case bool():
            return "true" if value else "false"
        case _:
            return str(value)
