"""Reads system files: machines, connections, environment, properties, each with its place."""

from __future__ import annotations

from collections.abc import Iterable
from collections.abc import Mapping as Dictionary
from dataclasses import replace
from difflib import get_close_matches
from pathlib import Path
from types import MappingProxyType

from fsmkit.diagnostics import Findings, FsmkitError, Source, Text
from fsmkit.language import Scope, read_duration
from fsmkit.loading import read_bytes
from fsmkit.system.conditions import constants_of, read_condition, types_of
from fsmkit.system.connections import connect
from fsmkit.system.environment import read_environment
from fsmkit.system.indices import unquantified
from fsmkit.system.machines import read_machines
from fsmkit.system.monitors import read_monitor, require_few
from fsmkit.system.schedule import read_schedule, require_room
from fsmkit.system.shared import read_shared, shared_links
from fsmkit.system.system import (
    JUDGED_AT_STATES,
    TEMPORAL,
    Condition,
    Machine,
    Monitor,
    Property,
    PropertyKind,
    System,
    state_invariants,
)
from fsmkit.yaml import keys
from fsmkit.yaml.encoding import decode
from fsmkit.yaml.nodes import (
    Mapping,
    Node,
    Scalar,
    Sequence,
    check_keys,
    read_nodes,
    require_mapping,
    require_text,
)

KINDS = {kind.value: kind for kind in PropertyKind}
EXAMPLE = "leads_to: [plant.In(inserted), plant.In(out)]"
NEEDS_NOTHING = {PropertyKind.DEADLOCK_FREE, PropertyKind.LIVELOCK_FREE}


def is_system_file(path: Path) -> bool:
    """Whether a file is a system: YAML whose outermost keys hold ``system``."""
    if path.suffix.lower() not in (".yaml", ".yml"):
        return False
    content = read_bytes(path)
    return any(
        line.startswith((b"system:", b"\xef\xbb\xbfsystem:")) for line in content.split(b"\n")
    )


def load_system(
    path: Path,
    findings: Findings,
    replacing: Dictionary[str, Path] | None = None,
    *,
    strict: bool = False,
) -> System:
    """Return the system of a file; `FsmkitError` with every finding where it has an error.

    ``replacing``: charts that machines run in place of those the file names for them.
    ``strict``: as of `fsmkit.loading.load_with_findings`, of every chart.
    """
    source = decode(read_bytes(path), str(path), findings)
    findings.stop_on_errors()
    system = None
    if source is not None:
        system = read_system(source, path.parent, findings, replacing or {}, strict=strict)
    findings.stop_on_errors()
    if system is None:
        raise FsmkitError(findings)
    return system


def read_system(
    source: Source,
    folder: Path,
    findings: Findings,
    replacing: Dictionary[str, Path] = MappingProxyType({}),
    *,
    strict: bool = False,
) -> System | None:
    """Read a system; the paths of charts are relative to ``folder``. Mind the findings."""
    root = read_nodes(source, findings)
    top = None if root is None else require_mapping(root, "a system", findings)
    if top is None:
        return None
    check_keys(top, frozenset(keys.SYSTEM), "a system", findings, keys.BELONGS)
    parts = {key.value: node for key, node in top.entries}
    name = require_text(parts["system"], "the name of a system", findings)
    machines = read_machines(parts.get("machines"), folder, replacing, findings, strict=strict)
    if findings.has_errors or name is None:
        return None
    if not machines:
        findings.add(
            "empty-system",
            f"the system `{name}` has no machines",
            name,
            help="name charts under `machines`",
        )
        return None
    surroundings = read_environment(parts.get("environment"), machines, findings)
    machines = tuple(
        replace(m, environment=index in surroundings.machines) for index, m in enumerate(machines)
    )
    scope = Scope(constants=constants_of(machines), types=types_of(machines))
    machines = read_shared(parts.get("shared"), machines, scope, findings)
    _require_fixed_delays(machines, findings)
    schedule = read_schedule(parts.get("schedule"), machines, findings)
    links = connect(parts.get("connect"), machines, surroundings.possible, findings)
    monitors: list[Monitor] = []
    asked = parts.get("properties")
    properties = tuple(_properties(asked, machines, folder, monitors, findings, strict=strict))
    require_few(tuple(monitors), len(machines) + len(links.machines), findings)
    system = System(
        name.value,
        (*machines, *links.machines),
        links.events,
        (*links.inputs, *shared_links(machines)),
        surroundings.possible,
        (*properties, *state_invariants(machines)),
        replaced=tuple((name, str(file)) for name, file in replacing.items()),
        source=source,
        monitors=tuple(monitors),
        schedule=schedule,
    )
    require_room(system, findings)
    return system


def _require_fixed_delays(machines: tuple[Machine, ...], findings: Findings) -> None:
    """Report intervals of machines that are no environment: no machine can choose so."""
    for machine in machines:
        for transition in machine.chart.transitions:
            if transition.least is not None and not machine.environment:
                findings.add(
                    "interval-of-machine",
                    f"a delay of `{machine.name}` is an interval",
                    transition.span,
                    help=f"give it one delay, or name `{machine.name}` under `will`",
                )


def _properties(
    node: Node | None,
    machines: tuple[Machine, ...],
    folder: Path,
    monitors: list[Monitor],
    findings: Findings,
    *,
    strict: bool,
) -> Iterable[Property]:
    """Yield the properties; those that are monitors also go to ``monitors``."""
    mapping = None if node is None else require_mapping(node, "`properties`", findings)
    for name, value in mapping.entries if mapping is not None else ():
        kind = PropertyKind.MONITOR
        if isinstance(value, Mapping) and any(key.value == kind.value for key, _ in value.entries):
            monitor = read_monitor(name, value, machines, folder, findings, strict=strict)
            if monitor is not None:
                monitors.append(monitor)
                text = f"`{monitor.machine.chart.name}` never comes to `error`"
                yield Property(name.value, kind, text, span=name.span)
            continue
        found = _property(name, value, machines, findings)
        if found is not None:
            yield found


def _property(
    name: Text, node: Node, machines: tuple[Machine, ...], findings: Findings
) -> Property | None:
    if isinstance(node, Scalar):
        kind = _kind(node.text, findings)
        if kind is not None and kind not in NEEDS_NOTHING:
            findings.add(
                "missing-condition",
                f"`{kind.value}` needs a condition",
                node.text,
                help=f"write `{name}: {{{kind.value}: ...}}`",
            )
            return None
        return None if kind is None else Property(name.value, kind, kind.value, span=name.span)
    mapping = require_mapping(node, f"the property `{name}`", findings)
    if mapping is None:
        return None
    if len(mapping.entries) != 1:
        findings.add(
            "unexpected-shape",
            f"the property `{name}` must be one kind with its condition",
            node.span,
            help="for instance `{never: feeder.In(pushing) and not plant.door_closed}`",
        )
        return None
    key, value = mapping.entries[0]
    kind = _kind(key, findings)
    if kind is None:
        return None
    if kind in (PropertyKind.LEADS_TO, PropertyKind.WITHIN):
        return _of_two(name, kind, value, machines, findings)
    if kind not in JUDGED_AT_STATES | TEMPORAL:
        text = _written(value)
        reason = "" if kind in NEEDS_NOTHING else f"`{kind.value}` is not explored yet"
        return Property(name.value, kind, text, span=name.span, unexplored=reason)
    condition = _condition(name, value, machines, findings)
    if condition is None:
        return None
    text, expression, atoms = _written(value), condition.expression, condition.atoms
    found = Property(name.value, kind, text, expression, atoms, span=name.span)
    if kind is PropertyKind.RECOVERABLE and found.is_of_steps:
        _refuse_occurs(name, kind, findings)
    return found


def _refuse_occurs(name: Text, kind: PropertyKind, findings: Findings) -> None:
    findings.add(
        "unexpected-value",
        f"`{kind.value}` is about states, `occurs` in `{name}` about a step",
        name,
        help="use `occurs` in `never`, `invariant` or `reachable`",
    )


def _condition(
    name: Text, node: Node, machines: tuple[Machine, ...], findings: Findings
) -> Condition | None:
    text = require_text(node, f"the condition of `{name}`", findings)
    written_out = None if text is None else unquantified(text, machines, findings)
    return None if written_out is None else read_condition(written_out, machines, findings)


def _of_two(
    name: Text, kind: PropertyKind, node: Node, machines: tuple[Machine, ...], findings: Findings
) -> Property | None:
    """Read ``[P, Q]`` of `leads_to`, ``[P, T, Q]`` of `within`."""
    timed = kind is PropertyKind.WITHIN
    if not isinstance(node, Sequence) or len(node.items) != 2 + timed:
        example = "within: [plant.In(hot), 500ms, plant.In(cold)]"
        findings.add(
            "unexpected-shape",
            f"`{name}` needs two conditions{', and a duration between them' if timed else ''}",
            node.span,
            help=f"for instance `{example if timed else EXAMPLE}`",
        )
        return None
    first, last = (_condition(name, node.items[place], machines, findings) for place in (0, -1))
    ticks: int | None = 0
    if timed:
        text = require_text(node.items[1], f"the time of `{name}`", findings)
        scope = Scope(constants=constants_of(machines), tick=machines[0].chart.capacities.tick)
        ticks = None if text is None else read_duration(text, scope, findings)
    if first is None or last is None or ticks is None:
        return None
    if any(atom.event is not None for _, atom in (*first.atoms, *last.atoms)):
        _refuse_occurs(name, kind, findings)
    return Property(
        name.value,
        kind,
        _written(node),
        first.expression,
        first.atoms,
        goal=last,
        ticks=ticks,
        span=name.span,
    )


def _kind(text: Text, findings: Findings) -> PropertyKind | None:
    kind = KINDS.get(text.value)
    if kind is None:
        close = get_close_matches(text.value, KINDS, 1)
        findings.add(
            "unknown-name",
            f"there is no kind of property `{text}`",
            text,
            help=f"did you mean `{close[0]}`?" if close else f"use one of {', '.join(KINDS)}",
        )
    return kind


def _written(node: Node) -> str:
    return " ".join(node.span.source.text[node.span.start : node.span.end].split())
