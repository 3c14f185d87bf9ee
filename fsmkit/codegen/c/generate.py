"""A machine in C: a table of contents."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

from fsmkit.chart.chart import Chart
from fsmkit.codegen.c.binding.naming import report_chosen
from fsmkit.codegen.c.binding.reading import binding_of
from fsmkit.codegen.c.binding.source import bound_sources
from fsmkit.codegen.c.coverage import PART, require_names
from fsmkit.codegen.c.header import event_type, header, payload_storage
from fsmkit.codegen.c.info import info_source
from fsmkit.codegen.c.layout import Group, Needs, groups, reply_type, timers_needed
from fsmkit.codegen.c.limits import report_limits
from fsmkit.codegen.c.names import Names
from fsmkit.codegen.c.naming import name_everything, require_prefix
from fsmkit.codegen.c.options import Options, read_options, report_missing
from fsmkit.codegen.c.renamed import report_names
from fsmkit.codegen.c.source import SourcePrinter
from fsmkit.codegen.c.storage import storage
from fsmkit.codegen.c.tracing import tracing_source
from fsmkit.diagnostics import Findings
from fsmkit.emit import printing
from fsmkit.plan import lower
from fsmkit.plan.counting import counted
from fsmkit.plan.image import image_of
from fsmkit.runtime.library import C_LIBRARY


@dataclass(frozen=True, slots=True)
class Machine:
    """A generated machine: its names, its texts by file name, its figures."""

    names: Names
    files: dict[str, str]
    figures: dict[str, int]
    alignment: int = 1
    """The alignment of the struct, in bytes."""
    family: tuple[tuple[Names, frozenset[str]], ...] = ()
    """The machines in its slots, innermost first, then itself: names and paths of members."""


def machine_of(chart: Chart, findings: Findings, options: Mapping[str, str]) -> Machine | None:
    """Return the C of a chart for the options of a target, or None if findings reject it."""
    chosen = replace(read_options(options), binding=binding_of(chart, options, findings))
    require_prefix(options.get("prefix"))
    report_limits(chart, findings)
    report_missing(chart, chosen, findings)
    if findings.has_errors:
        return None
    machine = generate_machine(chart, options.get("prefix"), chosen)
    report_names(machine.names, findings, is_prefixed="prefix" in options)
    report_chosen(machine.names, findings)
    return None if findings.has_errors else machine


@printing
def generate_machine(
    chart: Chart, prefix: str | None = None, options: Options | None = None
) -> Machine:
    """Return the C of a chart: header, source, and the library they need.

    An invoked chart has a header and a source of its own, for each slot.
    """
    extras = frozenset() if options is None else options.extras
    names = name_everything(lower(counted(chart) if PART in extras else chart), prefix, options)
    if PART in extras:
        require_names(names)
    described = extras - {PART}
    machine = _generate(names, described)
    library = ["fsm.h", "fsm.c"]
    if PART in extras:
        library += ["fsm_coverage.h", "fsm_coverage.c"]
    if described:
        machine.files[f"{machine.names.prefix}_info.c"] = info_source(machine.family)
        library += ["fsm_info.h"]
    if described - {"info"}:
        library += ["fsm_bytes.h"]
    if "save" in extras:
        library += ["fsm_save.h", "fsm_save.c"]
    if "trace" in extras:
        machine.files[f"{machine.names.prefix}_trace.c"] = tracing_source(machine.family)
        library += ["fsm_trace.h", "fsm_traced.h", "fsm_trace.c"]
    if "records" in extras:
        from fsmkit.codegen.c.recording import recording_source  # and with it the interpreter

        machine.files[f"{machine.names.prefix}_records.c"] = recording_source(machine.family)
        library += ["fsm_records.h", "fsm_recorded.h", "fsm_records.c"]
    machine.files.update(bound_sources(machine.names))
    for name in library:
        machine.files[name] = (C_LIBRARY / name).read_text(encoding="utf-8")
    return machine


def _generate(names: Names, extras: frozenset[str]) -> Machine:
    """Return a machine after those in its slots; the outermost holds all strings."""
    inside = [_generate(inner, extras) for inner in names.invoked]
    chart = names.chart
    source = SourcePrinter(names)
    if extras:
        for symbol in image_of(chart).texts:
            names.symbol(symbol)
    text = source.text()
    payload, alignment = payload_storage(names)
    reply = reply_type(chart)
    width = {"uint8_t": 1, "uint16_t": 2, "uint32_t": 4, "uint64_t": 8}[event_type(names)]
    needs = Needs(
        remembered=len(source.selection.remembered),
        reply="" if reply is None else storage(reply, {}).text,
        event_size=payload + width,
        event_alignment=max(alignment, width),
        inside=tuple((machine.figures["struct_bytes"], machine.alignment) for machine in inside),
    )
    layout = groups(names, needs)
    figures = _figures(names, layout, needs)
    if "save" in extras and not names.is_invoked:
        figures["saved_bytes"] = image_of(chart).total
    texts = {
        f"{names.prefix}.h": header(names, layout, figures),
        f"{names.prefix}.c": text,
    }
    for machine in inside:
        texts |= machine.files
    paths = frozenset(member.path for group in layout for member in group.members)
    family = (*(each for machine in inside for each in machine.family), (names, paths))
    return Machine(names, texts, figures, max(m.alignment for m in layout), family)


def _figures(names: Names, layout: list[Group], needs: Needs) -> dict[str, int]:
    capacities = names.chart.capacities
    figures = {
        "queue": capacities.queue if names.does.queued else 0,
        "internal": capacities.internal,
        "microsteps": capacities.microsteps,
        "tick_us": capacities.tick,
        "timers": timers_needed(names),
        "struct_bytes": sum(member.size for member in layout),
    }
    if names.does.delays:
        figures["delayed"] = capacities.delayed
    for slot, (size, _) in zip(names.slots, needs.inside, strict=True):
        figures[f"slot_{slot}_bytes"] = size
    return figures
