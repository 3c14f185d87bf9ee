"""Formatting of parts of a Chart in one line: statements, triggers, declarations."""

from __future__ import annotations

import json
from collections.abc import Iterable
from typing import assert_never

import fsmkit.language as lang
from fsmkit.chart import statements as stmt
from fsmkit.chart.chart import Chart, Operation, Transition
from fsmkit.document.document import Trigger


def format_block(block: stmt.Block, chart: Chart) -> str:
    """Return the statements of a handler, separated by ``;``."""
    return "; ".join(format_statement(statement, chart) for statement in block)


def format_statement(statement: stmt.Statement, chart: Chart) -> str:
    """Return a statement; one that cannot be executed is formatted as an error."""

    def text(expr: lang.Expr) -> str:
        return lang.format_expression(expr, chart.capacities.tick)

    match statement:
        case stmt.Assign(location, value, sign=sign):
            operand = _operand(value, sign)
            if operand is not None:
                return f"{text(location)} {sign}= {text(operand)}"
            return f"{text(location)} = {text(value)}"
        case stmt.Raise(event, arguments):
            return f"raise {_event(event, arguments, chart)}"
        case stmt.Send():
            return _send(statement, chart)
        case stmt.Cancel(name):
            return f"cancel {name}"
        case stmt.Log(label, values):
            parts = [json.dumps(label, ensure_ascii=False)] if label else []
            return f"log {', '.join((*parts, *map(text, values)))}".rstrip()
        case stmt.If(branches):
            return " else ".join(
                (f"if {text(b.condition)} " if b.condition is not None else "")
                + f"{{ {format_block(b.body, chart)} }}"
                for b in branches
            )
        case stmt.Local(place, value, is_fixed=is_fixed):
            named = f"let {place.name}" if is_fixed else f"var {place.name} {place.type}"
            return named if value is None else f"{named} = {text(value)}"
        case stmt.ForEach(array, item, index, body):
            names = item.name if index is None else f"{item.name}, {index.name}"
            return f"for {names} in {array.name} {{ {format_block(body, chart)} }}"
        case stmt.KeywordStatement(value):
            return f"{statement.word} {text(value)}"
        case stmt.CallOperation(call):
            return text(call)
        case stmt.Invoke(slot, arguments):
            invocation = chart.invocations[slot]
            data = (invocation.chart.data[place] for place in invocation.given)
            pairs = zip((d.name for d in data), arguments, strict=True)
            listed = ", ".join(f"{name} = {text(value)}" for name, value in pairs)
            return f"invoke {invocation.id}({listed})"
        case stmt.Fail(reason, is_raised=is_raised):
            return f"end of the block: {reason}" if is_raised else f"error.execution: {reason}"
        case _:
            assert_never(statement)


def _operand(value: lang.Expr, sign: str) -> lang.Expr | None:
    """Return the right side of an assignment written with ``sign=``; None for other assignments."""
    while isinstance(value, lang.Convert):
        value = value.operand
    return value.right if isinstance(value, lang.Binary) and value.op.value == sign else None


def _event(event: int, arguments: Iterable[lang.Expr], chart: Chart) -> str:
    declared = chart.events[event]
    tick = chart.capacities.tick
    parts = [
        f"{f.name} = {lang.format_expression(a, tick)}"
        for f, a in zip(declared.fields, arguments, strict=True)
    ]
    return f"{declared.name}({', '.join(parts)})" if parts else declared.name


def _send(send: stmt.Send, chart: Chart) -> str:
    text = f"send {_event(send.event, send.arguments, chart)}"
    if send.peer is not None:
        text += f" to {send.peer}"
    elif send.destination is stmt.Destination.INTERNAL:
        text += ' to "#_internal"'
    if send.delay is not None:
        text += f" after {lang.format_expression(send.delay, chart.capacities.tick)}"
    return text if send.id is None else f"{text} as {send.id}"


def format_trigger(transition: Transition, chart: Chart) -> str:
    """Return the trigger of a transition: ``on arrived``, ``after 500ms``, ``always``."""
    tick = chart.capacities.tick
    delay = lang.format_value(transition.delay, lang.DURATION, tick)
    match transition.trigger:
        case Trigger.EVENT:
            return f"on {', '.join(transition.descriptors)}"
        case Trigger.EVENTLESS:
            return "always"
        case Trigger.AFTER:
            least = transition.least
            low = "" if least is None else lang.format_value(least, lang.DURATION, tick)
            high = "" if transition.is_open_ended else delay
            return f"after {low}..{high}" if low else f"after {delay}"
        case Trigger.EVERY:
            return f"every {delay}"
        case Trigger.SOMETIMES:
            return "sometimes"
        case Trigger.INITIAL:
            is_history = chart.states[transition.source].is_history
            return "default" if is_history else "initial"
        case _:
            assert_never(transition.trigger)


def format_operation(operation: Operation, chart: Chart) -> str:
    """Return the declaration of an operation, with the results that the explorer tries."""
    text = format_signature(operation.name, operation.parameters, operation.result)
    if not operation.tried or operation.result is None:
        return text
    type_, tick = operation.result, chart.capacities.tick
    tried = ", ".join(lang.format_value(v, type_, tick) for v in operation.tried)
    return f"{text} from {{{tried}}}"


def format_function(function: lang.FunctionBody, chart: Chart) -> str:
    """Return a function: its declaration and its body."""
    fields = (lang.Field(p.name, p.type) for p in function.parameters)
    head = format_signature(function.name, fields, function.result)
    match function.body:
        case (stmt.Return(value),):
            return f"{head}: {lang.format_expression(value, chart.capacities.tick)}"
        case body:
            return f"{head}: {format_block(body, chart)}"


def format_signature(name: str, fields: Iterable[lang.Field], result: lang.Type | None) -> str:
    """Return the declaration of an operation or an event."""
    parts = ", ".join(f"{f.name} {f.type}" for f in fields)
    return f"{name}({parts})" + ("" if result is None else f" -> {result}")
