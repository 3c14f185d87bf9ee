"""Methods and tables for invoked machines (SCXML 6.4, 6.5)."""

from __future__ import annotations

from fsmkit.chart.chart import Chart, Invocation, Passage
from fsmkit.codegen.python.content import ContentPrinter, Needs
from fsmkit.codegen.python.expressions import Printer, spell
from fsmkit.codegen.python.family import Member
from fsmkit.codegen.python.lines import Lines
from fsmkit.codegen.python.linking import LINK, ME
from fsmkit.codegen.python.sending import annotation
from fsmkit.language import ArrayType, RecordType, default_value
from fsmkit.plan import Plan


def print_invocations(out: Lines, plan: Plan, member: Member, content: ContentPrinter) -> None:
    """Print the methods that invoke machines, precede their events, and conclude this machine."""
    chart, names = member.chart, member.names
    for state in chart.states:
        if state.invokes:
            doc = "Invoke the machines of " + state.id + "."
            with out.method(f"_invoke_{names.bare[state.index]}", doc):
                content.blocks(out, state.invokes, None)
    for invocation in chart.invocations:
        _start(out, member, invocation)
    for event in chart.events:
        if event.invocation is not None and event.finalize:
            doc = "Before transitions are selected for `" + event.name + "` (SCXML 6.5)."
            source = names.states[chart.invocations[event.invocation].state]
            payload = {part.name: place for place, part in enumerate(event.fields)}
            with (
                out.method(f"_finalize_{names.events[event.index]}", doc),
                out.suite(f"if {ME}_active & {source}:"),
            ):
                content.block(out, event.finalize, payload)
    if chart.done is not None:
        _conclude(out, plan, member, chart.done)


def _start(out: Lines, member: Member, invocation: Invocation) -> None:
    """Print the start of a machine in its slot, with its initial data."""
    slot = invocation.index
    child = member.invoked[slot]
    given = [invocation.chart.data[place] for place in invocation.given]
    arguments = ", ".join(f"v{n}: {annotation(data.type)}" for n, data in enumerate(given))
    with out.method(f"_start_{slot}", "Start `" + invocation.id + "` in its slot.", arguments):
        out.line(f"child: {child.names.machine} = {ME}_children[{slot}]")
        out.line("child._reset_data()")
        for number, data in enumerate(given):
            target = f"child.{child.names.variables[data.name]}"
            is_made_of_parts = isinstance(data.type, ArrayType | RecordType)
            store = (
                f"{LINK}replace({target}, v{number})"
                if is_made_of_parts
                else f"{target} = v{number}"
            )
            out.line(store)
        out.line(f"{ME}_commence(child)")


def _conclude(out: Lines, plan: Plan, member: Member, event: int) -> None:
    """Print the report of the end to the invoker, with the data of the final state (SCXML 5.5)."""
    chart, printer = member.chart, Printer(member.names)
    finals = [chart.states[ending] for ending in plan.endings]
    with out.method("_conclude", "Report the end to the invoker."):
        for place, part in enumerate(chart.events[event].fields):
            out.line(f"{ME}_passed[{place}] = {spell(default_value(part.type), part.type)}")
            for final in finals:
                if place >= len(final.done_data):
                    continue
                with out.suite(f"if {ME}_active & {member.names.states[final.index]}:"):
                    with out.suite("try:"):
                        text = printer.frozen(final.done_data[place])
                        out.line(f"{ME}_passed[{place}] = {text}")
                    with out.suite(f"except {LINK}ContentError:"):
                        out.line(f"{ME}_error_execution()")
                    with out.suite(f"except {LINK}RangeFault:"):
                        out.line(f'{ME}_stop("range")')
        out.line(f"{ME}_answer({event}, {ME}_passed)")


def constants(chart: Chart, needs: Needs) -> dict[str, object]:
    """Return the additional tables of a class whose chart invokes or is invoked."""
    return {
        "INVOCATIONS": tuple(invocation.id for invocation in chart.invocations),
        "FORWARDING": tuple(i.index for i in chart.invocations if i.autoforward),
        "ADDRESSES": tuple(needs.addresses),
        "PASSAGES": tuple(
            tuple(_passage(invocation, passage) for passage in invocation.passages)
            for invocation in chart.invocations
        ),
        "RETURNS": tuple(
            tuple(-1 if event is None else event for event in invocation.returns)
            for invocation in chart.invocations
        ),
        "ERROR_COMMUNICATION": chart.event_index.get("error.communication", -1),
    }


def _passage(invocation: Invocation, passage: Passage | None) -> object:
    """Return the event, and for each field the index of its value, or -1 and a constant."""
    if passage is None:
        return None
    fields = invocation.chart.events[passage.event].fields
    parts = zip(fields, passage.fields, strict=True)
    return passage.event, tuple(
        (-1, default_value(part.type)) if place is None else (place, 0) for part, place in parts
    )
