"""Pieces of a Chart as people write them: statements, triggers, declarations, each in one line."""

from __future__ import annotations

import json
from collections.abc import Iterable
from typing import assert_never

import fsmkit.language as lang
from fsmkit.chart import statements as stmt
from fsmkit.chart.chart import Chart, Operation, Transition
from fsmkit.document.document import Trigger


def spell_block(block: stmt.Block, chart: Chart) -> str:
    """Return a handler: its statements, separated by ``;``."""
    return "; ".join(spell_statement(statement, chart) for statement in block)


def spell_statement(statement: stmt.Statement, chart: Chart) -> str:
    """Return a statement; what cannot be executed is spelt as an error."""
    tick = chart.capacities.tick
    match statement:
        case stmt.Assign(location, value, sign=sign):
            operand = _operand(value, sign)
            if operand is not None:
                return f"{lang.spell(location, tick)} {sign}= {lang.spell(operand, tick)}"
            return f"{lang.spell(location, tick)} = {lang.spell(value, tick)}"
        case stmt.Raise(event, arguments):
            return f"raise {_event(event, arguments, chart)}"
        case stmt.Send():
            return _send(statement, chart)
        case stmt.Cancel(name):
            return f"cancel {name}"
        case stmt.Log(label, values):
            parts = [json.dumps(label, ensure_ascii=False)] if label else []
            return f"log {', '.join((*parts, *(lang.spell(v, tick) for v in values)))}".rstrip()
        case stmt.If(branches):
            return " else ".join(
                (f"if {lang.spell(b.condition, tick)} " if b.condition is not None else "")
                + f"{{ {spell_block(b.body, chart)} }}"
                for b in branches
            )
        case stmt.Local(place, value, is_fixed=is_fixed):
            named = f"let {place.name}" if is_fixed else f"var {place.name} {place.type}"
            return named if value is None else f"{named} = {lang.spell(value, tick)}"
        case stmt.ForEach(array, item, index, body):
            names = item.name if index is None else f"{item.name}, {index.name}"
            return f"for {names} in {array.name} {{ {spell_block(body, chart)} }}"
        case stmt.Valued(value):
            return f"{statement.word} {lang.spell(value, tick)}"
        case stmt.CallOperation(call):
            return lang.spell(call, tick)
        case stmt.Invoke(slot, arguments):
            invocation = chart.invocations[slot]
            data = (invocation.chart.data[place] for place in invocation.given)
            pairs = zip((d.name for d in data), arguments, strict=True)
            listed = ", ".join(f"{name} = {lang.spell(value, tick)}" for name, value in pairs)
            return f"invoke {invocation.id}({listed})"
        case stmt.Fail(reason, is_raised=is_raised):
            return f"end of the block: {reason}" if is_raised else f"error.execution: {reason}"
        case _:
            assert_never(statement)


def _operand(value: lang.Expr, sign: str) -> lang.Expr | None:
    """Return what stands behind ``sign=`` in an assignment written so; None for any other one."""
    while isinstance(value, lang.Convert):
        value = value.operand
    return value.right if isinstance(value, lang.Binary) and value.op.value == sign else None


def _event(event: int, arguments: Iterable[lang.Expr], chart: Chart) -> str:
    declared = chart.events[event]
    tick = chart.capacities.tick
    parts = [
        f"{f.name} = {lang.spell(a, tick)}" for f, a in zip(declared.fields, arguments, strict=True)
    ]
    return f"{declared.name}({', '.join(parts)})" if parts else declared.name


def _send(send: stmt.Send, chart: Chart) -> str:
    told = f"send {_event(send.event, send.arguments, chart)}"
    if send.peer is not None:
        told += f" to {send.peer}"
    elif send.destination is stmt.Destination.INTERNAL:
        told += ' to "#_internal"'
    if send.delay is not None:
        told += f" after {lang.spell(send.delay, chart.capacities.tick)}"
    return told if send.id is None else f"{told} as {send.id}"


def spell_trigger(transition: Transition, chart: Chart) -> str:
    """Return what makes a transition be looked at: ``on arrived``, ``after 500ms``, ``always``."""
    delay = lang.spell_value(transition.delay, lang.DURATION, chart.capacities.tick)
    match transition.trigger:
        case Trigger.EVENT:
            return f"on {', '.join(transition.descriptors)}"
        case Trigger.EVENTLESS:
            return "always"
        case Trigger.AFTER:
            least = transition.least
            low = (
                ""
                if least is None
                else lang.spell_value(least, lang.DURATION, chart.capacities.tick)
            )
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


def spell_operation(operation: Operation, chart: Chart) -> str:
    """Return the declaration of an operation, with the results that are tried."""
    text = spell_signature(operation.name, operation.parameters, operation.result)
    if not operation.tried or operation.result is None:
        return text
    type_, tick = operation.result, chart.capacities.tick
    return f"{text} from {{{', '.join(lang.spell_value(v, type_, tick) for v in operation.tried)}}}"


def spell_function(function: lang.FunctionBody, chart: Chart) -> str:
    """Return a function: its declaration and its body."""
    fields = (lang.Field(p.name, p.type) for p in function.parameters)
    head = spell_signature(function.name, fields, function.result)
    match function.body:
        case (stmt.Return(value),):
            return f"{head}: {lang.spell(value, chart.capacities.tick)}"
        case body:
            return f"{head}: {spell_block(body, chart)}"


def spell_signature(name: str, fields: Iterable[lang.Field], result: lang.Type | None) -> str:
    """Return the declaration of an operation or an event."""
    parts = ", ".join(f"{f.name} {f.type}" for f in fields)
    return f"{name}({parts})" + ("" if result is None else f" -> {result}")
