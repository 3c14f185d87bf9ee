"""Convert a counterexample to a sequence diagram: machines are lifelines, messages arrows."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

from fsmkit.chart.analysis.delays import delays_of
from fsmkit.language.units import duration_text
from fsmkit.system.system import System
from fsmkit.verify.report.counterexample import Counterexample, Delivery, TraceStep
from fsmkit.verify.report.sequences.model import (
    Arrow,
    Block,
    Cause,
    Lifeline,
    Part,
    Repetition,
    Sequence,
    Transport,
    fold_repetitions,
)
from fsmkit.verify.report.verdict import Result, Verdict
from fsmkit.verify.statespace.actions import Action
from fsmkit.verify.statespace.closed_system import ClosedSystem

CAUSES = {
    Action.START: Cause.START,
    Action.TAKE: Cause.QUEUE,
    Action.FIRE: Cause.TIMEOUT,
    Action.EVENTLESS: Cause.ITSELF,
    Action.OCCUR: Cause.OUTSIDE,
}


def sequence(closed: ClosedSystem, result: Result, trace: Counterexample) -> Sequence:
    """Return the diagram of a trace, without machines that only start and get no message."""
    return _Writer(closed).write(result, trace)


@dataclass(frozen=True, slots=True)
class _Channel:
    """A connection that buffers or loses messages: its two ends, and the received event."""

    source: int
    target: int
    event: str
    transport: Transport


class _Writer:
    def __init__(self, closed: ClosedSystem) -> None:
        self._system = closed.system
        self._names = {m.name: n for n, m in enumerate(closed.system.machines)}
        self._channels = _channels(closed.system)

    def write(self, result: Result, trace: Counterexample) -> Sequence:
        blocks, idle = self._without_idle(list(join_messages(self._blocks(trace))))
        loop = trace.loop
        before = tuple(b for b in blocks if loop is None or b.number <= loop)
        parts = (*fold_repetitions(before[:-1]), *before[-1:])
        if loop is not None:
            cycle = tuple(block for block in blocks if block.number > loop)
            parts += (Repetition(cycle, None),) if cycle else ()
        violated = result.verdict is Verdict.VIOLATED
        word = "violated" if violated else "reached"
        claim = f": {result.claim}" if result.text not in ("", result.name) else ""
        end = [f"{word}: {result.name}{claim}"]
        if result.reason:
            end.append(result.reason)
        kept = [n for n in range(len(self._system.machines)) if n not in self._dropped]
        return Sequence(
            f"{self._system.name}: {result.name}",
            tuple(
                Lifeline(self._system.machines[n].name, self._system.machines[n].environment)
                for n in kept
            ),
            _renumbered(parts, {n: place for place, n in enumerate(kept)}),
            tuple(end),
            violated,
            tuple(idle),
        )

    # --- steps -----------------------------------------------------------------------------------

    def _blocks(self, trace: Counterexample) -> Iterator[Block]:
        told: Arrow | None = None
        for number, step in enumerate(trace.steps, 1):
            if step.action is Action.ELAPSE or step.machine not in self._names:
                continue
            machine = self._names[step.machine]
            if machine in self._channels:
                found = self._of_channel(number, step, self._channels[machine])
                if found is None:
                    continue
                told = found.arrows[-1] if found.arrows[-1].part is not Part.LOST else None
                yield found
                continue
            if (free := self._system.machines[machine].drives) is not None:
                if step.deliveries and step.action is Action.OCCUR:
                    yield Block(
                        number, _time(step), free.machine, Cause.OUTSIDE, step.deliveries[0].what,
                        is_shown=False, entered=(), active=(),
                    )  # fmt: skip
                continue
            block = self._of_machine(number, step, machine, told)
            told = block.arrows[-1] if block.arrows else None
            yield block

    def _of_machine(self, number: int, step: TraceStep, machine: int, told: Arrow | None) -> Block:
        entered = tuple(name for name in step.after if name not in step.before)
        cause = CAUSES[step.action]
        if step.cause.startswith("spontaneously"):
            cause = Cause.ITSELF
        is_told = (
            cause is Cause.QUEUE
            and told is not None
            and told.target == machine
            and told.text == step.cause
        )
        return Block(
            number, _time(step), machine, cause, step.cause, is_told, entered, step.after,
            step.chosen, tuple(self._arrows(step, machine)),
        )  # fmt: skip

    def _of_channel(self, number: int, step: TraceStep, channel: _Channel) -> Block | None:
        """Return the action of a connection on a message; nothing while it buffers."""
        lost = "loses() = true" in step.chosen
        if step.deliveries:
            text = step.deliveries[0].what
            arrow = Arrow(channel.source, channel.target, text, channel.transport, Part.ARRIVES)
        elif lost:
            text = _renamed(step.cause, channel.event)
            arrow = Arrow(channel.source, channel.target, text, channel.transport, Part.LOST)
        else:
            return None
        return Block(
            number, _time(step), None, Cause.ITSELF, "", is_shown=True, entered=(), active=(),
            arrows=(arrow,),
        )  # fmt: skip

    def _arrows(self, step: TraceStep, machine: int) -> Iterator[Arrow]:
        values: dict[int, list[str]] = {}
        for delivery in step.deliveries:
            if not delivery.is_event:
                values.setdefault(self._names[delivery.target], []).append(delivery.what)
        for target, texts in values.items():
            yield Arrow(machine, target, ", ".join(texts), Transport.VALUE)
        for delivery in step.deliveries:
            if delivery.is_event:
                yield self._event(machine, delivery)
        if self._system.is_open:
            yield from (Arrow(machine, None, text) for text in _leaving(step.lines))

    def _event(self, machine: int, delivery: Delivery) -> Arrow:
        target = self._names[delivery.target]
        channel = self._channels.get(target)
        if channel is None:
            return Arrow(machine, target, delivery.what)
        text = _renamed(delivery.what, channel.event)
        return Arrow(machine, channel.target, text, channel.transport, Part.SENT)

    # --- idle machines --------------------------------------------------------------------------

    _dropped: frozenset[int] = frozenset()

    def _without_idle(self, blocks: list[Block]) -> tuple[list[Block], list[str]]:
        """Omit machines that only start and neither send nor get an event."""
        busy = {block.lifeline for block in blocks if block.cause is not Cause.START}
        busy |= {
            end
            for block in blocks
            for arrow in block.arrows
            if arrow.transport is not Transport.VALUE
            for end in (arrow.source, arrow.target)
        }
        hidden = self._channels.keys() | {
            n for n, machine in enumerate(self._system.machines) if machine.drives is not None
        }
        machines = [n for n in range(len(self._system.machines)) if n not in hidden]
        idle = [n for n in machines if n not in busy] if len(machines) > 1 else []
        if len(idle) == len(machines):
            idle = []
        self._dropped = frozenset(idle) | hidden
        active = {b.lifeline: b.active for b in blocks if b.lifeline in idle}
        told = [f"{self._system.machines[n].name} ({', '.join(active.get(n, ()))})" for n in idle]
        kept = [
            replace(b, arrows=tuple(a for a in b.arrows if not {a.source, a.target} & set(idle)))
            for b in blocks
            if b.lifeline not in idle
        ]
        return kept, told


def join_messages(blocks: Iterator[Block]) -> Iterator[Block]:
    """Yield steps, with messages that arrive or are lost at once joined to their sending."""
    last: Block | None = None
    for block in blocks:
        sent = last.arrows[-1] if last is not None and last.arrows else None
        if last is not None and sent is not None and block.lifeline is None:
            came = block.arrows[0]
            if (
                sent.part is Part.SENT
                and (sent.source, sent.target, sent.text) == (came.source, came.target, came.text)
                and last.at == block.at
            ):
                part = Part.WHOLE if came.part is Part.ARRIVES else came.part
                arrows = (*last.arrows[:-1], replace(came, part=part))
                last = replace(last, arrows=arrows)
                continue
        if last is not None:
            yield last
        last = block
    if last is not None:
        yield last


def _time(step: TraceStep) -> str:
    return "" if step.at is None else duration_text(step.at)


def _channels(system: System) -> dict[int, _Channel]:
    found = {}
    for number, machine in enumerate(system.machines):
        if not machine.is_channel:
            continue
        source = next(link.source for link in system.event_links if link.target == number)
        out = next(link for link in system.event_links if link.source == number)
        event = system.machines[out.target].chart.events[out.event].name
        lossy = any(operation.name == "loses" for operation in machine.chart.operations)
        late = any(True for _ in delays_of(machine.chart))
        transport = Transport.LOSSY if lossy else Transport.DELAYED if late else Transport.QUEUED
        found[number] = _Channel(source, out.target, event, transport)
    return found


def _renamed(text: str, event: str) -> str:
    """Return the text of a message with the name of the event as which it is received."""
    _, bracket, rest = text.partition("(")
    return f"{event}{bracket}{rest}"


def _leaving(lines: tuple[str, ...]) -> Iterator[str]:
    """Yield the events and calls that leave a single chart, from the lines of its trace."""
    for line in lines:
        what, _, rest = line.partition(" ")
        if what not in ("out", "op"):
            continue
        name, *values = rest.partition(" = ")[0].split()
        brackets = f"({', '.join(values)})" if values or what == "op" else ""
        yield f"{name}{brackets}"


def _renumbered(
    parts: tuple[Block | Repetition, ...], places: dict[int, int]
) -> tuple[Block | Repetition, ...]:
    def block(found: Block) -> Block:
        line = found.lifeline
        arrows = tuple(
            replace(
                arrow,
                source=None if arrow.source is None else places[arrow.source],
                target=None if arrow.target is None else places[arrow.target],
            )
            for arrow in found.arrows
        )
        return replace(found, lifeline=None if line is None else places[line], arrows=arrows)

    return tuple(
        replace(part, blocks=tuple(map(block, part.blocks)))
        if isinstance(part, Repetition)
        else block(part)
        for part in parts
    )
