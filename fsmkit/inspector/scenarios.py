"""Scripts of `fsmkit run`, and traces of `fsmkit check`, as scenarios of a page."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any, assert_never

from fsmkit.chart.chart import Chart, result_types
from fsmkit.chart.loading import read_bytes
from fsmkit.chart.statements import Destination
from fsmkit.diagnostics import Text, fail
from fsmkit.emit import plain
from fsmkit.inspector.bundle import Scenario
from fsmkit.inspector.sources.counterexample import read_trace
from fsmkit.language import Value
from fsmkit.runtime.interpreter.snapshot import Delayed, Occurrence, Snapshot, Timeout, Timer
from fsmkit.runtime.live.steps import hash_of
from fsmkit.runtime.live.values import to_json
from fsmkit.runtime.script import read_line, script_texts, wrong_line
from fsmkit.runtime.system_session import read_machine_results, read_post
from fsmkit.system.system import System

KNOWN = "a scenario has the lines `start`, `post`, `input` (of a chart alone), `returns` and `run`"
Json = dict[str, Any]


def read_scenario(system: System, path: Path) -> Scenario:
    """Read a script of a system or of its only chart, or a trace of ``check``.

    Raises `FsmkitError`: ``unreadable-file``, ``wrong-script-line`` for a line that a page cannot
    execute, ``replay-parts`` for a trace of another system or of changed charts.
    """
    text = read_bytes(path).decode("utf-8", errors="replace")
    if text.lstrip().startswith("{"):
        return _read_recorded(system, path)
    lines = [line for line in text.splitlines() if line.strip() and not line.startswith("#")]
    actions = tuple(_actions(system, list(script_texts(lines, str(path)))))
    if not actions:
        raise fail("wrong-script-line", f"there is nothing in `{path}`", help=KNOWN)
    return Scenario(path.stem, {"actions": actions})


def _actions(system: System, lines: list[Text]) -> Iterator[Json]:
    of_chart = system.is_open and len(system.machines) == 1
    for line in lines:
        found = _of_chart(system, line) if of_chart else _of_system(system, line)
        if found is not None:
            yield found


def _of_chart(system: System, line: Text) -> Json | None:
    """Return the action of a chart's script line, or None for a line that only prints."""
    machine = system.machines[0]
    read = read_line(machine.chart, line)
    match read.verb:
        case "start" if read.number == 0:
            return {"do": "start"}
        case "start":
            raise wrong_line(line, "the time of a page starts at 0", "write `start 0`")
        case "run":
            return {"do": "run", "at": read.number}
        case "post":
            return _post(system, machine.name, read.event)
        case "input":
            declared = machine.chart.inputs[read.number]
            value = to_json(read.value, declared.type)
            return {"do": "set", "m": plain(machine.name), "input": declared.name, "value": value}
        case "returns":
            return _returns(machine.name, machine.chart, read.name, read.results)
        case "dump":
            return None
        case "seed" if read.number == 1:
            return None
        case verb:
            raise wrong_line(line, f"a page has no line `{verb}`", KNOWN)


def _of_system(system: System, line: Text) -> Json:
    verb, _, rest = line.value.strip().partition(" ")
    charts = {machine.name: machine.chart for machine in system.machines}
    match verb:
        case "start":
            return {"do": "start"}
        case "post":
            return _post(system, *read_post(charts, line))
        case "returns":
            name, operation, results = read_machine_results(charts, line)
            return _returns(name, charts[name], operation, results)
        case "run" if rest.strip().isdecimal():
            return {"do": "run", "at": int(rest)}
        case _:
            raise wrong_line(line, f"a page has no line `{verb}`", KNOWN)


def _post(system: System, name: str, occurrence: Occurrence) -> Json:
    machine = next(each for each in system.machines if each.name == name)
    event = machine.chart.events[occurrence.event]
    pairs = zip(event.fields, occurrence.payload, strict=True)
    payload = {plain(field.name): to_json(value, field.type) for field, value in pairs}
    return {"do": "post", "m": plain(name), "event": event.name, "with": payload}


def _returns(machine: str, chart: Chart, operation: str, results: tuple[Value, ...]) -> Json:
    type_ = result_types(chart)[operation]
    values = [to_json(value, type_) for value in results]
    return {"do": "returns", "m": plain(machine), "operation": plain(operation), "results": values}


# --- paths of `check` ---------------------------------------------------------------------------


def _read_recorded(system: System, path: Path) -> Scenario:
    """Read a trace: its messages, and the machines after each entry."""
    recording, _ = read_trace(path)
    names = [(machine.name, hash_of(machine.chart)) for machine in system.machines]
    if names != [(each.name, hash_of(each.chart)) for each in recording.system.machines]:
        raise fail(
            "replay-parts",
            f"`{path}` is a trace of other machines than those of `{system.name}`",
            help="make the page of the system that was checked, with the same charts",
        )
    before = recording.begin
    entries = []
    for entry in recording.entries:
        moment = entry.moment
        assert before is not None  # noqa: S101  (the moments of a trace are all known)
        assert moment is not None  # noqa: S101
        entries.append(
            {
                "now": moment.now,
                "toStart": moment.to_start,
                "machines": [
                    [place, snapshot_json(machine.chart, snapshot)]
                    for place, machine in enumerate(system.machines)
                    for snapshot in [moment.snapshots[place]]
                    if snapshot is not before.snapshots[place]
                ],
                "messages": entry.messages,
            }
        )
        before = moment
    return Scenario(path.stem, {"entries": entries, "why": recording.why})


ROUTES = {
    Destination.SELF: 0,
    Destination.INTERNAL: 1,
    Destination.PORT: 2,
    Destination.INVOKER: 3,
    Destination.INVOKED: 4,
}
"""As fsmkit_runtime.mjs numbers them."""


def snapshot_json(chart: Chart, snapshot: Snapshot) -> Json:
    """Return a machine for `snapshotFrom` of live.mjs: all by number, values as they are held."""
    count = len(chart.data)
    return {
        "active": sorted(snapshot.configuration),
        "data": list(map(to_json, snapshot.data[:count])),
        "outputs": list(map(to_json, snapshot.data[count:])),
        "inputs": list(map(to_json, snapshot.inputs)),
        "history": [[state, sorted(held)] for state, held in snapshot.history],
        "queue": list(map(_occurrence, snapshot.queue)),
        "deferred": list(map(_occurrence, snapshot.deferred)),
        "timers": list(map(_timer, snapshot.timers)),
        "now": snapshot.now,
        "running": snapshot.running,
        "finished": snapshot.finished,
        "fault": snapshot.fault,
        "invoked": [
            None if child is None else snapshot_json(invocation.chart, child)
            for invocation, child in zip(chart.invocations, snapshot.invoked, strict=True)
        ],
    }


def _occurrence(occurrence: Occurrence) -> list[Any]:
    return [occurrence.event, *map(to_json, occurrence.payload)]


def _timer(timer: Timer) -> Json:
    match timer.what:
        case Timeout(transition):
            return {"transition": transition, "due": timer.deadline}
        case Delayed(occurrence, destination, mark, peer, slots):
            return {
                "sent": _occurrence(occurrence),
                "mark": mark,
                "peer": peer,
                "route": ROUTES[destination],
                "slots": slots,
                "due": timer.deadline,
            }
        case _:
            assert_never(timer.what)
