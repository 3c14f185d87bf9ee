"""Print the C of a closed system: its wires, its external events, and its properties."""

from __future__ import annotations

from collections.abc import Sequence

from fsmkit.diagnostics import fail
from fsmkit.emit import Emitter, printing
from fsmkit.emit.c import comment
from fsmkit.language import InState
from fsmkit.language import Variable as Named
from fsmkit.language.walk import nodes
from fsmkit.system.properties.condition import Atom
from fsmkit.system.properties.property import Property, evaluated
from fsmkit.verify.engines.c.binding import MOST_VALUES, BoundMachine, payload_of
from fsmkit.verify.engines.c.condition_functions import Helpers
from fsmkit.verify.engines.c.conditions import ConditionPrinter
from fsmkit.verify.engines.c.splitting import parts_of
from fsmkit.verify.statespace.closed_system import ClosedSystem


@printing
def system_file(closed: ClosedSystem, built: Sequence[BoundMachine]) -> str:
    """Return the file of a system."""
    out = Emitter()
    out.line(f"/* The system `{comment(closed.system.name)}`. */")
    out.lines(f'#include "{prefix}.h"' for prefix in dict.fromkeys(m.prefix for m in built))
    out.lines(['#include "system/system.h"', "", "#include <string.h>", ""])
    for machine in built:
        out.line(f"extern const fsm_machine fsm_machine_{machine.own};")
    out.line()
    _links(out, closed, built)
    _possible(out, closed, built)
    _evaluate(out, closed, built)
    _see(out, closed, built)
    _reads(out, closed)
    _machines(out, built)
    _turns(out, closed, built)
    _freezers(out, closed, built)
    _table(out, closed)
    return out.finish()


def _links(out: Emitter, closed: ClosedSystem, built: Sequence[BoundMachine]) -> None:
    with out.block("static const fsm_event_link event_links[] = {", "};"):
        for link in closed.system.event_links:
            _within_bounds(len(link.arguments))
            fields = ", ".join(f"{n}u" for n in link.arguments) or "0u"
            ends = f"{link.source}u, {link.port}u, {link.target}u, {link.event}u"
            out.line(f"{{{ends}, {len(link.arguments)}u, {{{fields}}}}},")
        out.line("{0}")
    out.line()
    with out.block("static const fsm_input_link input_links[] = {", "};"):
        for wire in closed.system.input_links:
            target = built[wire.target]
            is_shared = wire.input >= len(target.chart.inputs)  # after the constants there
            place = wire.input + is_shared * len(target.constants)
            out.line(f"{{{wire.source}u, {wire.output}u, {wire.target}u, {place}u}},")
        out.line("{0}")
    out.line()


def _possible(out: Emitter, closed: ClosedSystem, built: Sequence[BoundMachine]) -> None:
    with out.block("static const fsm_possible possible[] = {", "};"):
        for what in closed.possible:
            machine = built[what.machine]
            fields = machine.chart.events[what.event].fields
            values = payload_of(machine.names, fields, what.payload)
            _within_bounds(len(values))
            fair, spontaneous = str(what.fair).lower(), str(what.spontaneous).lower()
            texts = ", ".join(values) or "0"
            out.line(f"{{{what.machine}u, {what.event}u, {{{texts}}}, {fair}, {spontaneous}}},")
        out.line("{0}")
    out.line()


def _within_bounds(values: int) -> None:
    if values > MOST_VALUES:
        raise fail(
            "not-explored-yet",
            f"a message of {values} values is too large for the engine in C",
            help="use `--engine python`",
        )


# --- properties -----------------------------------------------------------------------------------


def _evaluate(out: Emitter, closed: ClosedSystem, built: Sequence[BoundMachine]) -> None:
    events = closed.observed_events
    all_evaluated = _with_parts(closed)
    for number, property_ in enumerate(all_evaluated):
        if property_.condition is not None:
            _evaluate_one(out, number, property_, built, events)
    for name, more, of_steps in (
        ("evaluate", "", False),
        ("evaluate_step", "const bool *occurs, ", True),
    ):
        parameters = f"const void *const *machines, {more}uint32_t property"
        with out.block(f"static bool {name}({parameters})\n{{"):
            out.lines(["(void)machines;", *(["(void)occurs;"] if of_steps else [])])
            with out.block("switch (property) {"):
                for number, property_ in enumerate(all_evaluated):
                    if property_.condition is None or property_.is_of_steps is not of_steps:
                        continue
                    arguments = "machines, occurs" if of_steps else "machines"
                    out.line(f"case {number}u:")
                    out.line(f"    return evaluate_{number}({arguments});")
                out.lines(["default:", "    return false;"])
        out.line()
    with out.block("static const fsm_observed_event observed[] = {", "};"):
        out.lines(f"{{{machine}u, {event}u}}," for machine, event in events)
        out.line("{0}")
    out.line()


def _with_parts(closed: ClosedSystem) -> list[Property]:
    """Return the evaluated conditions, followed by their parts."""
    whole = evaluated(closed.system.properties)
    return [*whole, *(part for property_ in whole for part in parts_of(property_))]


def _evaluate_one(
    out: Emitter,
    number: int,
    property_: Property,
    built: Sequence[BoundMachine],
    events: Sequence[tuple[int, int]],
) -> None:
    atoms = dict(property_.atoms)
    used = sorted({atom.machine for atom in atoms.values()} | _owner(property_))

    def atom_of(variable: Named) -> Atom:
        if property_.owner is not None:
            return Atom(property_.owner, variable=variable.name)
        return atoms[variable.name]

    def access(variable: Named) -> str:
        atom = atom_of(variable)
        machine = built[atom.machine]
        if atom.event is not None:
            return f"occurs[{events.index((atom.machine, atom.event))}]"
        if atom.state is not None:
            return _active(machine, atom.state)
        return f"m{atom.machine}->{machine.names.variables[atom.variable]}"

    def test(state: int) -> str:
        return _active(built[property_.owner or 0], state)

    machines = {f"m{index}": f"const {built[index].prefix} *" for index in used}
    helpers = Helpers(f"evaluate_{number}", machines, out)
    names = built[property_.owner or (used or [0])[0]].names
    printer = ConditionPrinter(names, access=access, test=test, helpers=helpers)
    condition = printer.condition(property_.condition)  # type: ignore[arg-type]
    sign = "!" if property_.is_negated else ""
    out.line(f"/* {comment(property_.name)}: {property_.kind.key} */")
    more = ", const bool *occurs" if property_.is_of_steps else ""
    with out.block(f"static bool evaluate_{number}(const void *const *machines{more})\n{{"):
        for index in used:
            out.line(f"const {built[index].prefix} *m{index} = machines[{index}];")
            out.line(f"(void)m{index};")
        out.line("uint8_t failed = FSM_FINE;")
        out.lines(f"{ctype} {name};" for ctype, name in printer.temporaries)
        out.line(f"bool holds = {condition};")
        out.line(f"return {sign}(holds && failed == FSM_FINE);")
    out.line()


def _see(out: Emitter, closed: ClosedSystem, built: Sequence[BoundMachine]) -> None:
    """Write the function that copies all data of a machine that properties read."""
    read: list[dict[str, str]] = [{} for _ in built]
    for property_ in evaluated(closed.system.properties):
        for atom in _atoms_of(property_):
            machine = built[atom.machine]
            if atom.event is not None:
                continue
            if atom.state is None:
                place = f"m{atom.machine}->{machine.names.variables[atom.variable]}"
                read[atom.machine][place] = (
                    f"sizeof(((const {machine.prefix} *)0)->{place.partition('->')[2]})"
                )
            else:
                read[atom.machine][f"(unsigned char){_active(machine, atom.state)}"] = "1u"
    with out.block("static void see(uint32_t machine, const void *state, unsigned char *seen)\n{"):
        out.lines(["(void)state;", "(void)seen;"])
        with out.block("switch (machine) {"):
            for number, places in enumerate(read):
                if not places:
                    continue
                with out.block(f"case {number}u: {{"):
                    out.line(f"const {built[number].prefix} *m{number} = state;")
                    out.line(f"(void)m{number};")
                    for place, size in places.items():
                        if size == "1u":
                            out.line(f"*seen++ = {place};")
                        else:
                            out.line(f"memcpy(seen, &{place}, sizeof {place});")
                            out.line(f"seen += sizeof {place};")
                    out.line("break;")
            out.lines(["default:", "    break;"])
    out.line()
    with out.block("static const size_t seen_sizes[] = {", "};"):
        out.lines(f"{' + '.join(places.values()) or '0u'}," for places in read)
    out.line()


def _reads(out: Emitter, closed: ClosedSystem) -> None:
    """Write the machines that each property reads, and the locations of its parts."""
    whole = evaluated(closed.system.properties)
    parts, rows = [], []
    first = len(whole)
    for property_ in whole:
        count = len(parts_of(property_))
        parts.append(f"{{{first}u, {count}u}},")
        first += count
    for number, property_ in enumerate(_with_parts(closed)):
        machines = sorted({atom.machine for atom in _atoms_of(property_)} | _owner(property_))
        if machines:
            listed = ", ".join(f"{machine}u" for machine in machines)
            out.line(f"static const uint32_t reads_{number}[] = {{{listed}}};")
        rows.append(f"{{{len(machines)}u, {f'reads_{number}' if machines else 'NULL'}}},")
    with out.block("static const fsm_reads reads[] = {", "};"):
        out.lines([*rows, "{0}"])
    with out.block("static const fsm_parts parts[] = {", "};"):
        out.lines([*parts, "{0}"])
    out.line()


def _atoms_of(property_: Property) -> list[Atom]:
    if property_.condition is None:
        return []
    found = [atom for _, atom in property_.atoms]
    if property_.owner is not None:
        for node in nodes(property_.condition):
            if isinstance(node, Named):
                found.append(Atom(property_.owner, variable=node.name))
            elif isinstance(node, InState):
                found.append(Atom(property_.owner, state=node.state))
    return found


def _owner(property_: Property) -> set[int]:
    return set() if property_.owner is None else {property_.owner}


def _active(machine: BoundMachine, state: int) -> str:
    if state == 0:
        return "true"
    return f"{machine.prefix}_in(m{machine.number}, {machine.names.states[state]})"


# --- the table ------------------------------------------------------------------------------------


def _machines(out: Emitter, built: Sequence[BoundMachine]) -> None:
    with out.block("static const fsm_machine *const machines[] = {", "};"):
        out.lines(f"&fsm_machine_{machine.own}," for machine in built)
    out.line()


def _turns(out: Emitter, closed: ClosedSystem, built: Sequence[BoundMachine]) -> None:
    """Write the turns of a cyclic schedule: ``turn`` of ``fsm_system``."""
    schedule = closed.system.schedule
    if schedule is None:
        return
    ordered = ("true" if n in schedule.order else "false" for n in range(len(built)))
    out.line(f"static const bool ordered[] = {{{', '.join(ordered)}}};")
    out.line()
    scheduler = built[-1]
    with out.block("static uint32_t turn(const void *state)\n{"):
        out.line(f"const {scheduler.prefix} *m{scheduler.number} = state;")
        for place, machine in closed.turns.items():
            out.lines([f"if ({_active(scheduler, place)})", f"    return {machine + 1}u;"])
        out.line("return 0u;")
    out.line()


def _freezers(out: Emitter, closed: ClosedSystem, built: Sequence[BoundMachine]) -> None:
    """Write the nodes that may freeze: ``freezers`` and ``hold`` of ``fsm_system``."""
    if not closed.freezers:
        return
    listed = (
        f"{closed.freezers[n]}u" if n in closed.freezers else "FSM_NONE" for n in range(len(built))
    )
    out.line(f"static const uint32_t freezers[] = {{{', '.join(listed)}}};")
    out.line()
    with out.block("static fsm_hold hold(uint32_t freezer, const void *state)\n{"):
        for number in dict.fromkeys(closed.freezers.values()):
            machine, states = built[number], closed.charts[number].state_index
            with out.block(f"if (freezer == {number}u) {{"):
                out.line(f"const {machine.prefix} *m{number} = state;")
                for hold, name in (("FSM_HOLD_STOPPED", "stopped"), ("FSM_HOLD_FROZEN", "frozen")):
                    out.lines([f"if ({_active(machine, states[name])})", f"    return {hold};"])
        out.line("return FSM_HOLD_NONE;")
    out.line()


def _table(out: Emitter, closed: ClosedSystem) -> None:
    system = closed.system
    with out.block("const fsm_system fsm_the_system = {", "};"):
        out.lines([".machines = machines,", ".event_links = event_links,"])
        out.lines([".input_links = input_links,", ".possible = possible,"])
        out.line(f".machine_count = {len(system.machines)}u,")
        out.line(f".event_link_count = {len(system.event_links)}u,")
        out.line(f".input_link_count = {len(system.input_links)}u,")
        out.line(f".possible_count = {len(closed.possible)}u,")
        out.line(f".property_count = {len(evaluated(system.properties))}u,")
        out.lines(
            [".evaluate = evaluate,", ".evaluate_step = evaluate_step,", ".observed = observed,"]
        )
        out.lines([".reads = reads,", ".parts = parts,"])
        out.line(f".observed_count = {len(closed.observed_events)}u,")
        out.lines([".seen_sizes = seen_sizes,", ".see = see,"])
        if system.schedule is not None:
            out.lines([".ordered = ordered,", ".turn = turn,"])
        if closed.freezers:
            out.lines([".freezers = freezers,", ".hold = hold,"])
        out.line(f".untimed = {str(closed.untimed).lower()},")
        out.line(f".zones = {str(closed.zones).lower()},")
        out.line(f".open = {str(closed.is_open).lower()},")
        out.line(f".unit = {closed.unit}u,")
        out.line(f".max_pending_before_input = {closed.max_pending}u,")
