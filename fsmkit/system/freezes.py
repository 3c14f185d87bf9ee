"""Model freezing nodes: ``freezes: {press_node: {machines: [press], silent: [robot.lost]}}``.

While a node is frozen its machines take no steps and send nothing. Time passes for them, and their
queues still receive messages. The explored system has one more machine that keeps the state of the
node. It freezes at any time, and each event under ``silent`` occurs ``within`` a time after that,
unless the node continues before. A node continues at any time until ``continues`` has elapsed, and
then no more; without that key it never does. It freezes again only after its machines have caught
up. `verify.statespace.closed_system` decides which machine may move.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from enum import IntEnum
from math import gcd

from fsmkit.chart.chart import Chart
from fsmkit.diagnostics import Findings, Text
from fsmkit.document.document import Direction
from fsmkit.document.keys import FREEZE
from fsmkit.language import Scope, read_duration
from fsmkit.language.units import duration_text
from fsmkit.system.channels import chart_of_text
from fsmkit.system.connections import END, find_machine, names_of_events, report_duplicate
from fsmkit.system.indices import expand_indices
from fsmkit.system.machine import EventLink, Machine, Monitor, Possible
from fsmkit.system.properties.condition import Atom
from fsmkit.system.properties.property import Property
from fsmkit.system.schedule import time_unit
from fsmkit.system.system import Freezer, System
from fsmkit.yaml.nodes import Node, entries_of, require_record, require_text, texts_of

EXAMPLE = "for instance `press_node: {machines: [press], silent: [robot.lost], within: 100ms}`"


class Hold(IntEnum):
    """How a node holds its machines; ``fsm_hold`` in core/system/system.h."""

    RUNS = 0
    FROZEN = 1
    STOPPED = 2
    """It never continues: nothing about its machines changes any more."""


# --- reading --------------------------------------------------------------------------------------


def read_freezers(
    node: Node | None, machines: tuple[Machine, ...], findings: Findings
) -> tuple[Freezer, ...]:
    """Read the nodes that may freeze; their machines have no numbers yet."""
    found: list[Freezer] = []
    holders: dict[int, Text] = {}
    for name, value in entries_of(node, "`freezes`", findings):
        if not name.value.isidentifier():
            findings.add(
                "unexpected-shape",
                f"`{name}` is not a valid node name",
                name,
                help="use letters, digits and `_`",
            )
        elif any(machine.name == name.value for machine in machines):
            findings.add(
                "duplicate-name",
                f"there is a machine `{name}`",
                name,
                help=f"give the node another name, such as `{name}_node`: properties test it by "
                f"`{name}_node.In(frozen)`",
            )
        freezer = _freezer(name, value, machines, holders, findings)
        if freezer is not None:
            found.append(freezer)
    return tuple(found)


def _freezer(
    name: Text,
    node: Node,
    machines: tuple[Machine, ...],
    holders: dict[int, Text],
    findings: Findings,
) -> Freezer | None:
    """Read a node. After a finding the result is partial, so that properties can name the node."""
    parts = require_record(node, FREEZE, f"the node `{name}`", findings)
    if parts is None:
        return None
    listed = tuple(texts_of(parts.get("machines"), "`machines`", "a machine of the node", findings))
    frozen: list[int] = []
    for text in listed:
        for one in expand_indices(text, machines):
            number = find_machine(one, machines, findings)
            if number is None:
                continue
            if number in holders:
                report_duplicate("frozen", text, holders[number], findings)
            holders.setdefault(number, text)
            frozen.append(number)
            _require_fixed_delays(machines[number], one, findings)
    missing = [] if listed else ["machines"]
    missing += [
        key
        for key, other in (("within", "silent"), ("silent", "within"))
        if other in parts and key not in parts
    ]
    for key in missing:
        findings.add("missing-key", f"the node `{name}` needs `{key}`", name, help=EXAMPLE)
    _require_whole_shares(name, frozen, machines, findings)
    tick = machines[0].chart.capacities.tick
    within = _ticks(parts.get("within"), "within", tick, findings, is_interval=True)
    continues = _ticks(parts.get("continues"), "continues", tick, findings)
    silent = _silent(parts.get("silent"), frozen, machines, findings)
    freezer = Freezer(
        Machine(name.value, machines[0].chart, environment=True, span=name.span),
        tuple(frozen),
        () if within is None else tuple(silent),
        within or (0, 0),
        continues[1] if continues is not None else None,
    )
    return replace(freezer, machine=_machine(freezer, tick, 1))


def _silent(
    node: Node | None, frozen: Sequence[int], machines: tuple[Machine, ...], findings: Findings
) -> list[tuple[int, int]]:
    """Read the events by which other machines notice that the node is silent."""
    found: dict[tuple[int, int], Text] = {}
    for text in texts_of(node, "`silent`", "an event of a machine", findings):
        for one in expand_indices(text, machines):
            match = END.fullmatch(one.value)
            if match is None:
                findings.add("broken-connection", "an event is `machine.name`", one, help=EXAMPLE)
                continue
            number = find_machine(one.part(*match.span(1)), machines, findings)
            if number is None:
                continue
            receiver, name = machines[number], one.part(*match.span(2))
            index = receiver.chart.event_index.get(name.value)
            known = names_of_events(receiver.chart, Direction.IN)
            if index is None or name.value not in known:
                findings.add(
                    "unknown-name",
                    f"no event `{name}` enters `{receiver.name}`",
                    name,
                    help=f"use one of {', '.join(known)}" if known else "declare it in the chart",
                )
            elif receiver.chart.events[index].fields:
                findings.add(
                    "connection-mismatch",
                    f"`{name}` carries values, but a timeout has none",
                    name,
                    help="declare an event without fields for the timeout",
                )
            elif number in frozen:
                findings.add(
                    "connection-mismatch",
                    f"`{receiver.name}` is frozen itself, so it notices nothing",
                    one,
                    help="name an event of a machine on another node",
                )
            elif (number, index) in found:
                report_duplicate("named", one, found[number, index], findings)
            else:
                found[number, index] = one
    return list(found)


def _ticks(
    node: Node | None, key: str, tick: int, findings: Findings, *, is_interval: bool = False
) -> tuple[int, int] | None:
    """Read a duration, or an interval of two, in ticks; None if it is missing, or after a finding.

    One duration is the maximum of an interval from 0.
    """
    text = require_text(node, f"`{key}`", findings) if node is not None else None
    if text is None:
        return None
    low, dots, _ = text.value.partition("..")
    parts = [text]
    if dots and is_interval:
        parts = [text.part(0, len(low)), text.part(len(low) + 2, len(text.value))]
    read = [read_duration(part.strip(), Scope(tick=tick), findings) for part in parts]
    ticks = [one for one in read if one is not None]
    if len(ticks) < len(parts):
        return None
    if ticks[-1] == 0 or ticks[0] > ticks[-1]:
        findings.add(
            "bad-delay",
            f"`{key}` must be positive, and its minimum must not exceed its maximum",
            text,
            help=f"write `{key}: 100ms`" + (" or `100ms..150ms`" if is_interval else ""),
        )
        return None
    return (ticks[0] if len(ticks) > 1 else 0), ticks[-1]


def _require_fixed_delays(machine: Machine, name: Text, findings: Findings) -> None:
    """Report an interval: a frozen timer would have to remember the delay it chose."""
    for transition in machine.chart.transitions:
        if transition.least is not None:
            findings.add(
                "interval-of-machine",
                f"`{machine.name}` may freeze, and a delay of it is an interval",
                name,
                secondary=[(transition.span, "this delay")],
                help="give it one delay, or model the freeze by a `sometimes` transition of it",
            )
            return


def _require_whole_shares(
    name: Text, frozen: Sequence[int], machines: tuple[Machine, ...], findings: Findings
) -> None:
    """Report data shared by machines inside and outside of the node: no link carries them."""
    here = {slot.name for number in frozen for slot in machines[number].shared}
    for number, machine in enumerate(machines):
        both = [slot.name for slot in machine.shared if slot.name in here]
        if number not in frozen and both:
            findings.add(
                "connection-mismatch",
                f"`{machine.name}` shares `{both[0]}` with a machine of the node `{name}`",
                name,
                help=f"name `{machine.name}` under `machines`, or connect an output to an input",
            )
            return


# --- in an exploration ----------------------------------------------------------------------------


def with_freezers(system: System) -> System:
    """Return a system in which each node that may freeze is a machine, after all others."""
    names = [machine.name for machine in system.machines]
    if all(freezer.machine.name in names for freezer in system.freezers):
        return system
    tick = system.machines[0].chart.capacities.tick
    pause = _pause(system)
    first = len(system.machines)
    machines, links, possible = list(system.machines), [], []
    for number, freezer in enumerate(system.freezers, first):
        machine = _machine(freezer, tick, pause)
        events = machine.chart.event_index
        machines.append(machine)
        possible.append(Possible(number, events["freezes"]))
        for place, receiver in enumerate(freezer.silent, 1):
            links.append(EventLink(number, events[f"silent_{place}"], *receiver))
    numbers = {freezer.number: n for n, freezer in enumerate(system.freezers, first)}
    return replace(
        system,
        machines=tuple(machines),
        event_links=(*system.event_links, *links),
        possible=(*system.possible, *possible),
        freezers=tuple(replace(f, number=numbers[f.number]) for f in system.freezers),
        properties=tuple(_renumber_property(one, numbers) for one in system.properties),
        monitors=tuple(
            _renumber_monitor(expand_indices, numbers) for expand_indices in system.monitors
        ),
    )


def _renumber_property(property_: Property, numbers: Mapping[int, int]) -> Property:
    """Return a property with the numbers of nodes replaced."""
    goal = property_.goal
    return replace(
        property_,
        atoms=_atoms(property_.atoms, numbers),
        goal=None if goal is None else replace(goal, atoms=_atoms(goal.atoms, numbers)),
    )


def _atoms(
    atoms: tuple[tuple[str, Atom], ...], numbers: Mapping[int, int]
) -> tuple[tuple[str, Atom], ...]:
    return tuple(
        (name, replace(atom, machine=numbers.get(atom.machine, atom.machine)))
        for name, atom in atoms
    )


def _renumber_monitor(monitor: Monitor, numbers: Mapping[int, int]) -> Monitor:
    """Return a monitor with the numbers of its nodes replaced."""
    return replace(
        monitor,
        event_links=tuple(
            replace(link, source=numbers.get(link.source, link.source))
            for link in monitor.event_links
        ),
    )


def _pause(system: System) -> int:
    """Return the ticks after which a node has caught up: a time unit, or a whole period.

    No time passes before all machines outside of a schedule have finished their work.
    """
    if system.schedule is not None:
        return 2 * system.schedule.period
    delays = [ticks for f in system.freezers for ticks in (*f.within, f.continues or 0)]
    return gcd(time_unit(system), *delays) or 1


def _machine(freezer: Freezer, tick: int, pause: int) -> Machine:
    return replace(freezer.machine, chart=_chart(freezer, tick, pause))


def _chart(freezer: Freezer, tick: int, pause: int) -> Chart:
    """Return the chart of a node that freezes; ``pause``: ticks until it may freeze again."""
    places = range(1, len(freezer.silent) + 1)
    sent = [f"silent_{place}" for place in places]
    least, most = (f"{ticks * tick}us" for ticks in freezer.within)
    lines = ["chart: Node", f"capacity: {{tick: {tick}us}}"]
    lines += [f"events: {{in: [freezes], out: [{', '.join(sent)}]}}"]
    lines += ["initial: running", "states:", "  running:", "    initial: ready", "    states:"]
    lines += ["      ready: {rest: true, on: {freezes: frozen}}"]
    if freezer.continues is not None:
        lines += [f"      resumed: {{rest: true, after: {{{pause * tick}us: ready}}}}"]
    lines += ["  frozen:", "    regions:"]
    if freezer.continues is None:
        lines += ["      node: {initial: stopped, states: {stopped: {rest: true}}}"]
    else:
        lines += ["      node:", "        initial: late", "        states:"]
        over = f"after: {{{freezer.continues * tick}us: stopped}}"
        lines += [f"          late: {{rest: true, sometimes: resumed, {over}}}"]
        lines += ["          stopped: {rest: true}"]
    for place in places:
        noticed = f"{{target: noticed_{place}, do: send silent_{place}}}"
        lines += [f"      silence_{place}:", f"        initial: unnoticed_{place}"]
        lines += ["        states:", f"          unnoticed_{place}:", "            rest: true"]
        lines += [f"            after: {{{least}..{most}: {noticed}}}"]
        lines += [f"          noticed_{place}: {{rest: true}}"]
    return chart_of_text("\n".join(lines) + "\n")


def cause_of(chart: Chart, transition: int) -> str:
    """Return the meaning of a transition of such a chart for the node."""
    taken = chart.transitions[transition]
    source = chart.states[taken.source].id
    if source == "late":
        return "continues" if taken.delay == 0 else "stays frozen"
    return {"ready": "freezes", "resumed": "may freeze again"}.get(source, "is found silent")


def hold_of(chart: Chart, configuration: frozenset[int]) -> Hold:
    """Return how a node holds its machines, by the active states of its chart."""
    for hold, state in ((Hold.STOPPED, "stopped"), (Hold.FROZEN, "frozen")):
        if chart.state_index[state] in configuration:
            return hold
    return Hold.RUNS


def freezer_text(freezer: Freezer, system: System) -> str:
    """Return the assumption of an exploration about a node, as a sentence."""
    tick = system.machines[0].chart.capacities.tick
    names = ", ".join(system.machines[machine].name for machine in freezer.frozen)
    if freezer.continues is None:
        after = "and never continues"
    else:
        after = f"and continues within {duration_text(freezer.continues * tick)} or never"
    return f"the node {freezer.machine.name} ({names}) may freeze at any time, {after}"
