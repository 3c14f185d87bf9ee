"""A trace as a stream of messages, and as lines for people."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Sequence
from contextlib import suppress
from pathlib import Path

from msgspec.structs import replace

from fsmkit.chart.chart import Chart
from fsmkit.inspector.charts import chart_message
from fsmkit.inspector.sources.traced import PARTED, TraceEncoder
from fsmkit.runtime.interpreter.snapshot import Entered, Exited, Taken
from fsmkit.runtime.interpreter.trace import active_leaves, trace_lines, value_text
from fsmkit.runtime.live.messages import PROTOCOL, AnyMessage, Hello, Named
from fsmkit.runtime.live.steps import hash_of
from fsmkit.runtime.tracing.following import (
    Changed,
    CompleteState,
    Divergence,
    Followed,
    HostNote,
    Missing,
    Posted,
    ReplayedStep,
)
from fsmkit.system.system import System


def messages_of(
    encoder: TraceEncoder, told: Iterable[Followed], name: str, folder: Path = Path()
) -> Iterator[AnyMessage]:
    """Yield the numbered messages of a trace, with `Hello` and the charts of new machines.

    ``folder``: of the written file; the path of a chart's file is relative to it.
    """
    n, known, charts = 0, 0, set[str]()
    for each in told:
        entry = encoder.entry(each)
        machines = encoder.system.machines
        if len(machines) > known:
            known = len(machines)
            hashes = [hash_of(machine.chart) for machine in machines]
            yield Hello(
                protocol=PROTOCOL,
                session="trace",
                name=name,
                time="live",
                tick_us=machines[0].chart.capacities.tick,
                at=each.at,
                n=n,
                can=[],
                machines=[Named(m=m.name, chart=h) for m, h in zip(machines, hashes, strict=True)],
                file=_file_of(machines[0].chart, folder) if known == 1 else "",
            )
            for machine, hash_ in zip(machines, hashes, strict=True):
                if hash_ not in charts:
                    charts.add(hash_)
                    yield chart_message(machine.chart)
        if entry is not None:
            n += 1
            yield from (replace(message, n=n) for message in entry.messages)


def _file_of(chart: Chart, folder: Path) -> str:
    """Return the path of a chart's file relative to a folder; empty if there is none."""
    with suppress(OSError, ValueError):
        return os.path.relpath(chart.sources[0].name, folder) if chart.sources else ""
    return ""


def lines_of(encoder: TraceEncoder, told: Followed) -> Iterator[str]:
    """Yield the lines of a replayed item, prefixed with the machine's name if there are several."""
    if isinstance(told, Missing):
        why = f": {told.why}" if told.why else ""
        what = {"ring": "records lost in the ring", "frame": "frames lost"}
        yield f"({told.count} {what.get(told.where, 'bytes that cannot be read')}{why})"
        return
    place = encoder.machine_of(told.instance)
    if place is None:
        return
    machines = encoder.system.machines
    prefix = f"{machines[place].name}: " if len(machines) > 1 else ""
    yield from (prefix + line for line in _lines(machines[place].chart, told))


def _lines(chart: Chart, told: Followed) -> Iterator[str]:
    match told:
        case ReplayedStep(_, _, done, True):
            yield from trace_lines(chart, (done,))
        case ReplayedStep(at, _, done, False, 0):
            taken = [each.transition for each in done.effects if isinstance(each, Taken)]
            moves = [
                f"{'-' if isinstance(each, Exited) else '+'} {chart.states[each.state].id}"
                for each in done.effects
                if isinstance(each, Exited | Entered)
            ]
            yield f"@{at} {f't {taken[0]}' if taken else 'start'}"
            yield from moves
            yield _states(chart, active_leaves(chart, done.after))
        case ReplayedStep(at, _, done, False, machine):
            yield f"@{at} machine {machine}: {len(done.effects)} effects"
        case CompleteState(at, _, snapshot, is_known):
            what = "all known" if is_known else "states known"
            yield f"@{at} ({what}) {_states(chart, active_leaves(chart, snapshot))}"
        case Posted(_, _, occurrence, fits):
            event = chart.events[occurrence.event].name
            values = " ".join(map(value_text, occurrence.payload))
            yield f"post {event}{' ' if values else ''}{values}{'' if fits else ': full queue'}"
        case Changed(_, _, place, value):
            yield f"input {chart.inputs[place].name} {value_text(value)}"
        case Divergence(at, _, message):
            yield f"@{at} ({PARTED}: {message})"
        case HostNote(at, _, number):
            yield f"@{at} note {number}"
        case Missing():
            pass


def _states(chart: Chart, leaves: Sequence[str]) -> str:
    del chart
    return " ".join(("=", *leaves))


def empty_system(name: str) -> System:
    """Return a system without machines; a trace adds them when their syncs arrive."""
    return System(name, ())
