"""The log of a machine in C, done again by the interpreter, which must do the same."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

from fsmkit.chart.chart import Chart
from fsmkit.diagnostics import fail
from fsmkit.language import Value
from fsmkit.runtime.interpreter import Macrostep
from fsmkit.runtime.interpreter.snapshot import Called, Ran, Taken
from fsmkit.runtime.interpreter.trace import trace_lines
from fsmkit.runtime.recording import Call, Happened, calls, machines_of
from fsmkit.runtime.script import Player, script_texts


class PartedError(Exception):
    """The interpreter calls an operation that the machine in C did not call then."""


@dataclass
class LogHost:
    """Operations that return what the log says; they must be called in its order."""

    left: list[Happened] = field(default_factory=list)
    state: int = 0
    """For scripts; a log needs no random numbers."""

    def call(self, operation: str, arguments: tuple[Value, ...]) -> Value | None:
        """Return the result of the next call in the log."""
        del arguments
        if not self.left or self.left[0].operation != operation:
            raise PartedError(operation)
        return self.left.pop(0).result

    def delay(self, least: int, greatest: int) -> int:
        """Return the least delay: generated code has no other."""
        del greatest
        return least


def replay(chart: Chart, data: bytes, instance: int | None = None) -> Iterator[str]:
    """Yield the interpreter's trace of a log; `FsmkitError` where it does not do as the C did."""
    player = Player(chart)
    host = LogHost()
    player.host = host  # type: ignore[assignment]
    for call in calls(chart, data, instance):
        host.left = [each for each in call.happened if each.operation is not None]
        steps: list[Macrostep] = []
        refused = False
        try:
            for line in script_texts(call.lines, "<log>"):
                for result in player.play(line):
                    if isinstance(result, str):
                        refused = result == "full queue"
                        yield result
                    else:
                        steps.append(result)
                        yield from trace_lines(chart, (result,))
        except PartedError as parted:
            done = [each for each in call.happened if each.operation is not None]
            made = len(done) - len(host.left)
            then = str(host.left[0]) if host.left else "no operation"
            _part(call, f"calls `{parted}`", f"{then} as the {made + 1}. call")
        _compare(chart, call, steps, refused=refused)


def _compare(chart: Chart, call: Call, steps: Sequence[Macrostep], *, refused: bool) -> None:
    """Stop at the first thing that the machine in C did differently in one call of the host."""
    if refused != call.was_refused:
        reaction = ("took the event", "refused the event")
        _part(call, reaction[refused], reaction[call.was_refused])
    here = [each for step in steps for each in recorded_of(chart, step)]
    there = call.happened
    for place in range(max(len(here), len(there))):
        one = here[place] if place < len(here) else None
        other = there[place] if place < len(there) else None
        if one != other:
            _part(call, f"does: {one or 'nothing more'}", f"did: {other or 'nothing more'}")


def _part(call: Call, here: str, there: str) -> None:
    raise fail(
        "replay-parts",
        f"at byte {call.at} of the log, in `{call.lines[-1]}`, "
        f"the interpreter {here}; the C {there}",
        help="is the C made from this chart, and the memory of the machine its own?",
    )


def recorded_of(chart: Chart, step: Macrostep, first: int = 0) -> Iterator[Happened]:
    """Yield the items of a log for a macrostep; ``first``: the number of the machine."""
    numbers = []
    number = first + 1
    for invocation in chart.invocations:
        numbers.append(number)
        number += len(machines_of(invocation.chart))
    for effect in step.effects:
        match effect:
            case Taken(transition):
                yield Happened(first, transition=transition)
            case Called(operation, _, result):
                yield Happened(first, operation, result)
            case Ran(slot, within):
                yield from recorded_of(chart.invocations[slot].chart, within, numbers[slot])
            case _:
                pass
