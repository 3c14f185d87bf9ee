"""Methods for events and operations: posting, raising, sending, calling the host."""

from __future__ import annotations

from collections.abc import Collection

import fsmkit.language as lang
from fsmkit.chart.chart import Chart
from fsmkit.codegen.python.content import Needs, shown
from fsmkit.codegen.python.lines import Lines
from fsmkit.codegen.python.linking import LINK, ME
from fsmkit.codegen.python.names import Names
from fsmkit.document.document import Direction
from fsmkit.emit import Identifier
from fsmkit.emit.python import inside

Method = tuple[str, tuple[str, ...], str, str]
"""Name, arguments with types, result, description."""


def host_methods(chart: Chart, names: Names, needs: Needs) -> tuple[Method, ...]:
    """Return the methods that the host defines: operations, and one for each outgoing event."""
    found: list[Method] = []
    for operation in chart.operations:
        passed = tuple(f"{p.name}: {annotation(p.type)}" for p in _named(operation.parameters))
        result = "None" if operation.result is None else annotation(operation.result)
        found.append(
            (
                names.operations[operation.name],
                passed,
                result,
                "Operation `" + operation.name + "`.",
            )
        )
    for event in sorted(needs.emitted):
        fields = _named(chart.events[event].fields)
        passed = tuple(f"{f.name}: {annotation(f.type)}" for f in fields)
        peer = ("peer: str | None",) if has_peer(chart, event) else ()
        doc = "Event `" + chart.events[event].name + "` leaves the machine."
        found.append((f"send_{names.events[event]}", passed + peer, "None", doc))
    return tuple(found)


def has_peer(chart: Chart, event: int) -> bool:
    """Whether sending an event passes its target to the host, since it has both directions."""
    return len(chart.events[event].directions) > 1


def annotation(type_: lang.Type) -> str:
    """Return the Python type of a value."""
    match type_:
        case lang.BoolType():
            return "bool"
        case lang.IntType() | lang.EnumType() | lang.DurationType():
            return "int"
        case lang.FloatType():
            return "float"
        case lang.SymbolType():
            return "str"
        case lang.ArrayType() | lang.RecordType():
            return "Any"


def print_senders(
    out: Lines, chart: Chart, names: Names, needs: Needs, answered: Collection[int] | None
) -> None:
    """Print the methods for events and operations.

    ``answered``: the handled events, if a step is a single event.
    """
    for event in chart.events:
        if Direction.IN in event.directions and event.invocation is None:
            _post(out, chart, names, event.index)
            if answered is None:
                _dispatch(out, chart, names, event.index)
            else:
                _take(out, chart, names, event.index, is_answered=event.index in answered)
    for event in chart.events:
        if event.index in needs.raised:
            _queue(out, chart, names, event.index, "raise", "internal")
        if event.index in needs.sent:
            _queue(out, chart, names, event.index, "send", "own")
        if event.index in needs.emitted:
            _emit(out, chart, names, event.index)
        if event.index in needs.invoked:
            doc = "Send `" + event.name + "` to the first machine that runs in one of some slots."
            rest = "slots: tuple[int, ...], peer: str | None"
            _hand(out, chart, names, event.index, "pass", doc, rest)
        if event.index in needs.answered:
            doc = "Send `" + event.name + "` to the invoker."
            _hand(out, chart, names, event.index, "answer", doc)
        if event.index in needs.delayed:
            _delay(out, chart, names, event.index)
    with_result = [operation.name for operation in chart.operations if operation.result is not None]
    for operation in chart.operations:
        place = with_result.index(operation.name) if operation.name in with_result else -1
        _call(out, names, operation.name, operation.parameters, operation.result, place)
    with out.method("_log", "Log a label and values.", "label: str, *values: Any"):
        out.print_trace('" ".join(("log", label, *[' + LINK + "shown(value) for value in values]))")
        with out.suite(f"if {ME}log is not None:"):
            out.line(f"{ME}log(label, *values)")


def _named(fields: tuple[lang.Field, ...]) -> tuple[lang.Field, ...]:
    """Return fields whose names are valid arguments."""
    from fsmkit.codegen.python.names import distinct, identifier

    chosen = distinct([identifier(f.name) for f in fields], {"self", "peer"})
    return tuple(
        lang.Field(Identifier(name), f.type) for name, f in zip(chosen, fields, strict=True)
    )


def _arguments(fields: tuple[lang.Field, ...]) -> str:
    return ", ".join(f"{f.name}: {annotation(f.type)}" for f in fields)


def _post(out: Lines, chart: Chart, names: Names, index: int) -> None:
    event, name = chart.events[index], names.events[index]
    fields = _named(event.fields)
    doc = (
        "Put `"
        + event.name
        + "` into the queue; False if that is full or the machine does not run."
    )
    with out.method(f"post_{name}", doc, _arguments(fields), "bool"):
        if out.is_recorded:
            listed = "".join(f"{part.name}, " for part in fields)
            out.line(f"{ME}_record_posted({index}, ({listed.rstrip()}))")
        if not fields:
            out.line(f"return {ME}_enqueue({index}) >= 0")
        else:
            out.line(f"at = {ME}_enqueue({index})")
            with out.suite("if at < 0:"):
                out.line("return False")
            _store(out, "queue", fields)
            out.line("return True")


def _dispatch(out: Lines, chart: Chart, names: Names, index: int) -> None:
    event, name = chart.events[index], names.events[index]
    fields = _named(event.fields)
    doc = "Process `" + event.name + "` at once; whether it enabled a transition."
    with out.method(f"dispatch_{name}", doc, _arguments(fields), "bool"):
        out.line(f"{ME}_claim()")
        for place, part in enumerate(fields):
            out.line(f"{ME}_fields[{place}] = {part.name}")
        out.line(f"return {ME}_process({index})")


def _take(out: Lines, chart: Chart, names: Names, index: int, *, is_answered: bool) -> None:
    """Print the processing of an event after which nothing follows and nothing is observed."""
    event, name = chart.events[index], names.events[index]
    fields = _named(event.fields)
    if is_answered and not fields:
        out.piece(f"dispatch_{name}")
        out.line()
        out.line(f"dispatch_{name} = {LINK}_on_{name}")
        return
    doc = "Process `" + event.name + "` at once; whether it enabled a transition."
    with out.method(f"dispatch_{name}", doc, _arguments(fields), "bool"):
        for place, part in enumerate(fields if is_answered else ()):
            out.line(f"{ME}_fields[{place}] = {part.name}")
        out.line(f"return {ME}_on_{name}()" if is_answered else "return False")


def _store(out: Lines, queue: str, fields: tuple[lang.Field, ...]) -> None:
    for place, part in enumerate(fields):
        plus = f" + {place}" if place else ""
        out.line(f"{ME}_{queue}_fields[at{plus}] = {part.name}")


def _trace_text(event: str, fields: tuple[lang.Field, ...]) -> str:
    """Return the content of an f-string that traces an event or a call."""
    name = inside(event).replace("{", "{{").replace("}", "}}")
    return " ".join([name, *[shown(f.name, f.type) for f in fields]])


def _print_trace(out: Lines, text: str, more: str = "") -> None:
    prefix = "f" if "{" in text or "}" in text else ""
    out.print_trace(f'{prefix}"{text}"{more}')


def _queue(out: Lines, chart: Chart, names: Names, index: int, verb: str, queue: str) -> None:
    event = chart.events[index]
    fields = _named(event.fields)
    what = "internal" if queue == "internal" else "own external"
    doc = "Put `" + event.name + f"` into the {what} queue."
    with out.method(f"_{verb}_{names.events[index]}", doc, _arguments(fields)):
        _print_trace(out, f"{verb} {_trace_text(event.name, fields)}")
        call = f"{ME}_enqueue_{queue}({index})"
        if not fields:
            out.line(call)
            return
        out.line(f"at = {call}")
        with out.suite("if at >= 0:"):
            _store(out, "internal" if queue == "internal" else "queue", fields)


def _emit(out: Lines, chart: Chart, names: Names, index: int) -> None:
    event, name = chart.events[index], names.events[index]
    fields = _named(event.fields)
    arguments = ", ".join(filter(None, (_arguments(fields), "peer: str | None")))
    with out.method(f"_emit_{name}", "Send `" + event.name + "` out of the machine.", arguments):
        _print_trace(
            out,
            "out " + _trace_text(event.name, fields),
            ' + ("" if peer is None else " to " + peer)',
        )
        peer = ["peer"] if has_peer(chart, index) else []
        out.line(f"{ME}_host.send_{name}({', '.join([*[f.name for f in fields], *peer])})")
    with out.method(f"_port_{name}", "Send it with the current payload.", "peer: str | None"):
        passed = ", ".join([*[f"{ME}_fields[{k}]" for k in range(len(fields))], "peer"])
        out.line(f"{ME}_emit_{name}({passed})")


def _hand(
    out: Lines, chart: Chart, names: Names, index: int, verb: str, doc: str, rest: str = ""
) -> None:
    fields = _named(chart.events[index].fields)
    arguments = ", ".join(filter(None, (_arguments(fields), rest)))
    with out.method(f"_{verb}_{names.events[index]}", doc, arguments):
        for place, part in enumerate(fields):
            out.line(f"{ME}_passed[{place}] = {part.name}")
        if rest:
            out.line(f"{ME}_hand(slots, {index}, {ME}_passed, peer)")
        else:
            out.line(f"{ME}_answer({index}, {ME}_passed)")


def _delay(out: Lines, chart: Chart, names: Names, index: int) -> None:
    event = chart.events[index]
    fields = _named(event.fields)
    rest = "delay: int, mark: int, route: int, to: str | None"
    arguments = ", ".join(filter(None, (_arguments(fields), rest)))
    with out.method(f"_delay_{names.events[index]}", "Send `" + event.name + "` later.", arguments):
        _print_trace(out, f"delay {_trace_text(event.name, fields)} in {{delay:d}}")
        call = f"{ME}_later({index}, delay, mark, route, to)"
        if not fields:
            out.line(call)
            return
        out.line(f"at = {call}")
        with out.suite("if at >= 0:"):
            _store(out, "timer", fields)


def _call(
    out: Lines,
    names: Names,
    name: str,
    parameters: tuple[lang.Field, ...],
    result: lang.Type | None,
    place: int,
) -> None:
    fields = _named(parameters)
    method = names.operations[name]
    returned = "None" if result is None else annotation(result)
    passed = ", ".join(f.name for f in fields)
    with out.method(
        f"_call_{method}", "Call `" + name + "` of the host.", _arguments(fields), returned
    ):
        told = f"op {_trace_text(name, fields)}"
        if result is None:
            out.line(f"{ME}_host.{method}({passed})")
            _print_trace(out, told)
        else:
            out.line(f"result: {returned} = {ME}_host.{method}({passed})")
            if out.is_recorded:
                out.line(f"{ME}_record_returned({place}, result)")
            _print_trace(out, f"{told} = {shown('result', result)}")
            out.line("return result")
