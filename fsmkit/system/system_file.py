"""Read system files: machines, connections, environment and properties, each with its location."""

from __future__ import annotations

from collections.abc import Mapping as Dictionary
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType

from fsmkit.chart.loading import read_bytes
from fsmkit.diagnostics import Findings, FsmkitError
from fsmkit.document import keys
from fsmkit.language import Scope
from fsmkit.system.conditions import constants_of, types_of
from fsmkit.system.connections import connect
from fsmkit.system.environment import read_environment, with_environment
from fsmkit.system.freezes import read_freezers
from fsmkit.system.machine import Machine
from fsmkit.system.machines import Replacement, read_machines
from fsmkit.system.of_one_chart import properties_of_machines
from fsmkit.system.parameters import with_parameters
from fsmkit.system.properties.kinds.invariant import invariants_of
from fsmkit.system.properties.kinds.monitor import require_few
from fsmkit.system.properties.reading import Reading
from fsmkit.system.schedule import read_schedule, require_room
from fsmkit.system.shared import read_shared, shared_links
from fsmkit.system.starts import check_starts, started_inputs
from fsmkit.system.system import System
from fsmkit.yaml.encoding import decode
from fsmkit.yaml.fields import names
from fsmkit.yaml.nodes import Mapping, Node, read_nodes, require_record, require_text


def load_system(
    path: Path,
    findings: Findings,
    replacing: Dictionary[str, Replacement] | None = None,
    *,
    strict: bool = False,
    parameters: Dictionary[str, str] = MappingProxyType({}),
) -> System:
    """Return the system in a file.

    ``replacing``: charts that machines run instead of those named in the file. ``strict``: as for
    `fsmkit.chart.loading.load_with_findings`, for every chart. ``parameters``: as for
    `system_of_root`. Raises `FsmkitError` with all findings after an error.
    """
    source = decode(read_bytes(path), str(path), findings)
    findings.stop_on_errors()
    system = None
    if source is not None:
        root = read_nodes(source, findings)
        system = system_of_root(
            root, path.parent, findings, replacing or {}, strict=strict, parameters=parameters
        )
    findings.stop_on_errors()
    if system is None:
        raise FsmkitError(findings)
    return system


def system_of_root(
    root: Node | None,
    folder: Path,
    findings: Findings,
    replacing: Dictionary[str, Replacement] = MappingProxyType({}),
    *,
    strict: bool = False,
    parameters: Dictionary[str, str] = MappingProxyType({}),
) -> System | None:
    """Read a system from the outermost node of a file; mind the findings.

    The paths of charts are relative to ``folder``. ``parameters``: values that override those under
    ``parameters``.
    """
    given: tuple[tuple[str, str], ...] = ()
    if isinstance(root, Mapping):
        root, given = with_parameters(root, parameters, findings)
    parts = require_record(root, keys.SYSTEM, "a system", findings, keys.BELONGS)
    if root is None or parts is None:
        return None
    if "system" not in parts:
        findings.add(
            "not-a-system", "this is not a system", root.span, help="name it: `system: Cell`"
        )
        return None
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
    environment = read_environment(parts.get("environment"), machines, findings)
    machines = tuple(
        replace(m, environment=index in environment.machines) for index, m in enumerate(machines)
    )
    scope = Scope(constants=constants_of(machines), types=types_of(machines))
    machines = read_shared(parts.get("shared"), machines, scope, findings)
    _require_fixed_delays(machines, findings)
    schedule = read_schedule(parts.get("schedule"), machines, findings)
    freezers = read_freezers(environment.freezes, machines, findings)
    possible = [(named.machine, named.event) for named in environment.named]
    possible += [receiver for freezer in freezers for receiver in freezer.silent]
    free = (*environment.inputs, *started_inputs(machines))
    links = connect(parts.get("connect"), machines, possible, free, findings)
    first = len(machines) + len(links.machines)
    freezers = tuple(replace(freezer, number=n) for n, freezer in enumerate(freezers, first))
    nodes = (*links.machines, *(freezer.machine for freezer in freezers)) if freezers else ()
    reading = Reading((*machines, *nodes), folder, findings, strict)
    properties = tuple(reading.properties(parts.get("properties")))
    own = properties_of_machines(machines, reading.monitors, properties, findings, strict=strict)
    properties = (*properties, *own)
    require_few(tuple(reading.monitors), first + len(freezers), findings)
    invariants = [
        found
        for n, machine in enumerate(machines)
        for found in invariants_of(machine.chart, n, prefix=f"{machine.name}.")
    ]
    system = System(
        name.value,
        (*machines, *links.machines),
        links.events,
        (*links.inputs, *shared_links(machines)),
        properties=(*properties, *invariants),
        replaced=tuple((name, _file_of(chart)) for name, chart in replacing.items()),
        parameters=given,
        source=root.span.source,
        monitors=tuple(reading.monitors),
        schedule=schedule,
        freezers=freezers,
        req=names(parts.get("req"), "`req`", findings),
    )
    require_room(system, findings)
    check_starts(system, findings)
    return system if findings.has_errors else with_environment(system, environment, findings)


def _file_of(chart: Replacement) -> str:
    return str(chart) if isinstance(chart, Path) else chart[0].source.name


def _require_fixed_delays(machines: tuple[Machine, ...], findings: Findings) -> None:
    """Report intervals outside of the environment: generated code cannot choose a delay."""
    for machine in machines:
        for transition in machine.chart.transitions:
            if transition.least is not None and not machine.environment:
                findings.add(
                    "interval-of-machine",
                    f"a delay of `{machine.name}` is an interval",
                    transition.span,
                    help=f"give it one delay, or name `{machine.name}` under `will`",
                )
