"""Write the certificate of a system: its reachable states, each in a line of JSON."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from hashlib import sha256
from typing import Any

from fsmkit.chart.analysis.partition import COMBINED
from fsmkit.diagnostics import fail
from fsmkit.emit.version import VERSION
from fsmkit.plan.fingerprint import fingerprint
from fsmkit.system.any_file import sources_of
from fsmkit.system.system import System
from fsmkit.verify.explore import ExplorationOptions
from fsmkit.verify.report.verdict import Report
from fsmkit.verify.resources.deadline import Deadline, Stage, TimeUp
from fsmkit.verify.resources.time import Time
from fsmkit.verify.state_certificates.claims import claims_of
from fsmkit.verify.state_certificates.encoding import encode, json_line
from fsmkit.verify.statespace.closed_system import ClosedSystem
from fsmkit.verify.statespace.exploration import End
from fsmkit.verify.statespace.global_steps import GlobalSteps, State
from fsmkit.verify.statespace.storage import Storage
from fsmkit.verify.statespace.symbolic_search import Search

FORMAT = "fsmkit-states"
FORMAT_VERSION = 1
MOST_STATES = 1_000_000
"""The largest set that is written: the interpreter takes about a gigabyte for it."""
PAUSE = 256
"""States between two checks of the deadline."""


@dataclass(frozen=True, slots=True)
class Certificate:
    """The text of a certificate, and its numbers of states and of local states."""

    text: str
    states: int
    local_states: int


def closed_for(system: System, options: ExplorationOptions) -> ClosedSystem:
    """Return the closed system that a certificate is about.

    Every value of an input or a result is tried. Raises `FsmkitError` (``not-certified``) for a
    system with values that are only sampled.
    """
    closed = options.closed(system, zones=False)
    if closed.samples:
        closed = options.closed(system, zones=False, enumerated=COMBINED)
    for sample in closed.samples:
        raise fail(
            "not-certified",
            f"no certificate: not every value of {sample} is tried",
            help="narrow its range",
        )
    return closed


def options_of(header: Mapping[str, Any]) -> ExplorationOptions:
    """Return the options of a certificate. Raises `KeyError` or `FsmkitError` for other data."""
    time: Time = header["time"]
    return ExplorationOptions(
        time=time,
        assume_watchdogs_silent=header["assume_watchdogs_silent"],
        max_pending=header["max_pending"],
        reductions=frozenset(header["reductions"]),
    )


def header_of(closed: ClosedSystem, options: ExplorationOptions, system: System) -> dict[str, Any]:
    """Return the first line of the certificate of a system."""
    chosen = {
        "time": options.time,
        "max_pending": closed.max_pending if options.max_pending is None else options.max_pending,
        "assume_watchdogs_silent": options.assume_watchdogs_silent,
        "reductions": sorted(options.reductions),
        "parameters": dict(system.parameters),
    }
    claims = tuple(claims_of(closed))
    content = [
        [source.text for source in sources_of(system)],
        [fingerprint(machine.chart) for machine in system.machines],
        chosen,
    ]
    return {
        "format": FORMAT,
        "version": FORMAT_VERSION,
        "fsmkit": VERSION,
        "system": system.name,
        "fingerprint": sha256(json_line(content).encode()).hexdigest(),
        "options": chosen,
        "covered": [[c.name, c.text] for c in claims if c.decided is not None],
        "not_covered": [[c.name, c.text] for c in claims if c.decided is None],
        "machines": [
            [machine.name, *(state.id for state in chart.states)]
            for machine, chart in zip(closed.system.machines, closed.charts, strict=True)
        ],
    }


def require_options(options: ExplorationOptions) -> None:
    """Reject the options with which no certificate is written. Raises `FsmkitError`."""
    rejected = {
        "dense time": (options.time == "zones", "--time discrete` or `--time untimed"),
        "a decision diagram": (options.search is Search.SYMBOLIC, "--search explicit"),
        "lossy storage": (options.storage is not Storage.EXACT, "--storage exact"),
        "several processes": (options.ranks is not None, "--workers"),
    }
    for what, (is_chosen, instead) in rejected.items():
        if is_chosen:
            raise fail(
                "not-certified", f"no certificate is written for {what}", help=f"use `{instead}`"
            )


def certificate_of(
    report: Report, system: System, options: ExplorationOptions, deadline: Deadline
) -> Certificate:
    """Return the certificate of a system whose properties hold.

    The states are those of the reference interpreter, whichever engine decided the properties.
    Raises `FsmkitError` (``not-certified``) if there are too many states, if the engine found
    another number of states, or if time is up.
    """
    if report.exploration.states > MOST_STATES:
        raise fail("not-certified", f"no certificate: there are more than {MOST_STATES:,} states")
    closed = closed_for(system, options)
    steps = GlobalSteps(closed)
    try:
        states = _reachable(steps, deadline)
    except TimeUp:
        raise fail("not-certified", f"no certificate: {deadline.why()}") from None
    explored = report.exploration
    if explored.end is End.COMPLETE and explored.states != len(states):
        raise fail(
            "not-certified",
            f"no certificate: the engine found {explored.states:,} states, the interpreter "
            f"{len(states):,}",
            help="report this as a bug",
        )
    header = json_line(header_of(closed, options, system))
    text = "\n".join((header, *_lines(steps, states))) + "\n"
    tables = sum(len(set(each)) for each in zip(*states, strict=True))
    return Certificate(text + last_line(text, tables, len(states)), len(states), tables)


def last_line(text: str, tables: int, states: int) -> str:
    """Return the last line of a certificate with the given lines before it."""
    digest = sha256(text.encode()).hexdigest()
    return json_line({"local_states": tables, "states": states, "sha256": digest}) + "\n"


def _reachable(steps: GlobalSteps, deadline: Deadline) -> list[State]:
    """Return the reachable states, breadth first."""
    found = dict.fromkeys(edge.to for edge in steps.initial())
    waiting = deque(found)

    def expand() -> None:
        for _ in range(min(PAUSE, len(waiting))):
            for edge in steps.successors(waiting.popleft()):
                if edge.to not in found:
                    found[edge.to] = None
                    waiting.append(edge.to)

    while waiting:
        deadline.cut_off(Stage.EXPLORING, expand)
    return list(found)


def _lines(steps: GlobalSteps, states: Sequence[State]) -> Iterator[str]:
    """Yield the local states of each machine, numbered as they appear, then the states."""
    numbers: list[dict[int, int]] = [{} for _ in steps.local_states]
    for state in states:
        for known, local in zip(numbers, state, strict=True):
            known.setdefault(local, len(known))
    for machine, known in enumerate(numbers):
        for local in known:
            yield local_line(machine, steps, local)
    for state in states:
        yield json_line([known[local] for known, local in zip(numbers, state, strict=True)])


def local_line(machine: int, steps: GlobalSteps, number: int) -> str:
    """Return the line of a local state."""
    return json_line({"machine": machine, **encode(steps.local_states[machine][number].snapshot)})
