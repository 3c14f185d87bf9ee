"""Type the statements about events: raise, send, cancel."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import fsmkit.language as lang
from fsmkit.chart import statements as stmt
from fsmkit.chart.chart import Event
from fsmkit.chart.passes.context import Context
from fsmkit.chart.passes.type_delays import type_delay
from fsmkit.diagnostics import Fix, Span, Text
from fsmkit.diagnostics.fixes import remove_entry, replace_text
from fsmkit.diagnostics.suggestions import suggest
from fsmkit.document.document import Direction
from fsmkit.language.binding.ecmascript import SEND_ID, SESSION
from fsmkit.language.statements.tree import DocArgument, DocCancel, DocSend

PROCESSORS = (
    "",
    "scxml",
    "http://www.w3.org/TR/scxml/#SCXMLEventProcessor",
    "http://www.w3.org/TR/scxml",
)


def type_raise(
    written: stmt.Raise[Text, DocArgument], context: Context
) -> tuple[stmt.Statement, ...]:
    """Return a raised event; one that is only declared ``out`` cannot be raised."""
    event = find_event(written.event, context)
    if event is None:
        return ()
    if event.directions == {Direction.OUT}:
        context.findings.add(
            "wrong-direction",
            f"`{event.name}` is declared `out` and cannot be raised",
            written.event,
            help=f"write `send {event.name}`, or declare it under `internal` as well",
            fixes=_sent_instead(written),
        )
        return ()
    arguments = type_arguments(event, written.arguments, written.event, context)
    raised = context.events.raised(event).index
    return () if arguments is None else (stmt.Raise(raised, arguments, written.span),)


def _sent_instead(written: stmt.Raise[Text, DocArgument]) -> tuple[Fix, ...]:
    """Return the fix that replaces ``raise`` by ``send``."""
    span = written.span
    text = span.source.text
    start = span.start + (text[span.start : span.start + 1] == "<")
    if not text.startswith("raise", start) or (
        start > span.start and "/>" not in text[start : span.end]
    ):
        return ()
    return replace_text(Span(span.source, start, start + len("raise")), "send")


def find_event(name: Text, context: Context) -> Event | None:
    """Return the event of that exact name."""
    index = context.events.index.get(name.value)
    if index is not None:
        return context.events.all[index]
    known = [event.name for event in context.events.all]
    context.findings.add(
        "unknown-name",
        f"there is no event `{name}`",
        name,
        help=suggest(name.value, known, f"declare `{name}` under `events`"),
    )
    return None


def type_arguments(
    event: Event, written: Iterable[DocArgument], at: Text, context: Context
) -> tuple[lang.Expr, ...] | None:
    """Return one value for each field of an event, in the order of the declaration."""
    fields = {f.name: f.type for f in event.fields}
    values: dict[str, lang.Expr | None] = {}
    places: dict[str, Text] = {}
    sound = True
    for argument in written:
        name = argument.name.value
        if name in places:
            sound = False
            context.findings.add(
                "duplicate-argument",
                f"`{name}` is given twice",
                argument.name,
                secondary=[(places[name], "the first")],
                help="remove one of them",
                fixes=remove_entry(argument.name, whole=True),
            )
        elif name not in fields:
            sound = False
            context.findings.add(
                "unknown-name",
                f"event `{event.name}` has no field `{name}`",
                argument.name,
                secondary=[] if event.span is None else [(event.span, "declared here")],
                help=suggest(name, fields, f"declare it: `{event.name}({name} 0..255)`"),
            )
        else:
            values[name] = lang.type_expression(
                argument.value, context.scope, context.findings, fields[name]
            )
        places[name] = argument.name
    is_implied = event.name in context.events.implied
    found: list[lang.Expr] = []
    for field in event.fields:
        value = values.get(field.name)
        if field.name not in places and (is_implied or field.name == SEND_ID):
            value = lang.Literal(lang.default_value(field.type), field.type, at.span)
        elif field.name not in places:
            context.findings.add(
                "missing-argument",
                f"event `{event.name}` wants `{field.name}`",
                at,
                secondary=[] if event.span is None else [(event.span, "declared here")],
                help=f"write `{event.name}({field.name} = ...)`",
            )
        if value is None:
            sound = False
        else:
            found.append(value)
    return tuple(found) if sound else None


def type_send(written: DocSend, context: Context) -> tuple[stmt.Statement, ...]:
    """Return the statements for a send, which depend on its target."""
    name = _literal(written.event, written.event_expr, "event", written, context)
    if name is None:
        return ()
    event = find_event(name, context)
    target = _optional(written.target, written.target_expr, "target", written, context)
    kind = _optional(written.type, written.type_expr, "type", written, context)
    timed = type_delay(written, context)
    delay = timed.ticks
    if event is None or isinstance(target, _Unreadable) or isinstance(kind, _Unreadable):
        return ()
    if kind is not None and kind.value not in PROCESSORS:
        return _failure(f"there is no event processor `{kind}`", kind, written, context)
    where = _destination(event, target, delay, written, context)
    if not isinstance(where, _Destination):
        return where
    if where.destination is stmt.Destination.INTERNAL:
        event = context.events.raised(event)
    _warn_of_content(written, context)
    listed = tuple(DocArgument(name, name) for name in written.name_list)
    arguments = type_arguments(event, (*written.arguments, *listed), name, context)
    if arguments is None:
        return ()
    identity = None if written.id is None else written.id.value
    before: tuple[stmt.Statement, ...] = ()
    if written.id_location is not None:
        location = lang.type_location(written.id_location, context.scope, context.findings)
        if location is None:
            return ()
        value = lang.type_expression(
            written.id_location.with_value(f"'{identity}'"),
            context.scope,
            context.findings,
            location.type,
        )
        if value is None:
            return ()
        before = (stmt.Assign(location, value, written.span),)
    send = stmt.Send(
        event.index,
        arguments,
        where.destination,
        written.span,
        delay=delay,
        id=identity,
        peer=where.peer,
        invocations=where.invocations,
    )
    if timed.check is None:
        return (*before, send)
    late: stmt.Branch[lang.Expr, stmt.Statement] = stmt.Branch(timed.check, (send,))
    failed = failed_send(f"`{written.delay_expr}` is no delay", written, context)
    otherwise: stmt.Branch[lang.Expr, stmt.Statement] = stmt.Branch(None, failed)
    return (*before, stmt.If((late, otherwise), written.span))


@dataclass(frozen=True, slots=True)
class _Destination:
    """The destination of an event; ``peer`` is the text after ``to``."""

    destination: stmt.Destination
    peer: str | None = None
    invocations: tuple[int, ...] = ()


class _Unreadable:
    """The result for an attribute whose value is not known at compile time."""


def _optional(
    text: Text | None, expression: Text | None, what: str, written: DocSend, context: Context
) -> Text | _Unreadable | None:
    if text is None and expression is None:
        return None
    return _literal(text, expression, what, written, context) or _Unreadable()


def _literal(
    text: Text | None, expression: Text | None, what: str, written: DocSend, context: Context
) -> Text | None:
    """Return a literal name, or the compile-time value of an expression; None with a finding."""
    if text is not None:
        return text
    if expression is None:
        context.findings.add(
            "missing-argument",
            f"`send` names no {what}",
            written.span,
            help="name the event that is sent",
        )
        return None
    value = lang.type_expression(expression, context.scope, context.findings, lang.SYMBOL)
    if value is None:
        return None
    folded = lang.fold(value)
    if isinstance(folded, lang.Literal) and isinstance(folded.value, str):
        return Text(folded.value, expression.span, ())
    context.findings.add(
        "not-known-when-compiling",
        f"the {what} of `send` is computed at run time",
        expression,
        help="write one `send` for each value, in the branches of an `if`",
    )
    return None


def _destination(
    event: Event,
    target: Text | None,
    delay: lang.Expr | None,
    written: DocSend,
    context: Context,
) -> _Destination | tuple[stmt.Statement, ...]:
    """Return the destination of an event, or the failure that its target causes."""
    is_out = Direction.OUT in event.directions
    only_out = event.directions == {Direction.OUT}
    if target is None:
        if is_out and not only_out:
            context.findings.add(
                "ambiguous-destination",
                f"`{event.name}` is declared both ways: it could go out or to the own queue",
                written.event or written.span,
                help="write `to self`, or `to` and the name of a peer",
            )
            return ()
        return _Destination(stmt.Destination.PORT if is_out else stmt.Destination.SELF)
    if target.value == "#_internal":
        if delay is not None:
            return _failure("`#_internal` takes no delay", target, written, context)
        return _Destination(stmt.Destination.INTERNAL)
    if target.value in context.invoker:
        return _Destination(stmt.Destination.INVOKER, "#_parent")
    if target.value in context.invoked:
        return _Destination(stmt.Destination.INVOKED, target.value, context.invoked[target.value])
    session = context.scope.constants.get(SESSION)
    if session is not None and target.value == lang.location_of_session(str(session.value)):
        return _Destination(stmt.Destination.SELF)
    if target.value == "self" and not only_out:
        return _Destination(stmt.Destination.SELF)
    if is_out:
        return _Destination(stmt.Destination.PORT, target.value)
    if not context.is_loose:
        context.findings.add(
            "wrong-direction",
            f"`{event.name}` is not declared `out` and cannot go to `{target}`",
            target,
            secondary=[] if event.span is None else [(event.span, "declared here")],
            help="declare it under `events: out:`, or write `to self`",
        )
        return ()
    if target.value.startswith(("#_scxml_", "#_")):
        reason = f"nothing is reached under `{target}`"
        context.findings.add(
            "content-not-evaluable",
            f"this cannot be sent: {reason}",
            target,
            help="at run time it is `error.communication`; connect machines in a system",
        )
        return (_error("error.communication", written, context),)
    return _failure(f"`{target}` is no target", target, written, context)


def _failure(
    reason: str, at: Text, written: DocSend, context: Context
) -> tuple[stmt.Statement, ...]:
    if context.lenient:
        context.findings.add(
            "content-not-evaluable",
            f"this cannot be sent: {reason}",
            at,
            help="at run time it is `error.execution`; `--strict` makes it an error now",
        )
        return failed_send(reason, written, context)
    context.findings.add("bad-target", reason, at, help="remove it, or name what is reached")
    return ()


def failed_send(reason: str, written: DocSend, context: Context) -> tuple[stmt.Statement, ...]:
    """Return the error of a send that cannot be done; it carries the id (SCXML 5.10.1)."""
    error = _error("error.execution", written, context)
    if written.id is None or not error.arguments:
        return (stmt.Fail(reason, written.span),)
    return (error, stmt.Fail(reason, written.span, is_raised=True))


def _error(name: str, written: DocSend, context: Context) -> stmt.Raise[int, lang.Expr]:
    event = context.events.all[context.events.index[name]]
    id_ = "" if written.id is None else written.id.value
    return stmt.Raise(
        event.index,
        tuple(lang.Literal(id_, f.type, written.span) for f in event.fields),
        written.span,
    )


def _warn_of_content(written: DocSend, context: Context) -> None:
    content = written.content or written.content_expr
    if content is not None:
        context.findings.add(
            "payload-dropped",
            "the content of this event has no type and is not sent",
            content,
            help="send its parts by name, with `param`",
        )


def type_cancel(written: DocCancel, context: Context) -> tuple[stmt.Statement, ...]:
    """Return a cancelled send; its id is known when compiling."""
    if written.id is not None:
        return (stmt.Cancel(written.id.value, written.id.span),)
    if written.id_expr is None:
        return ()
    value = lang.type_expression(written.id_expr, context.scope, context.findings, lang.SYMBOL)
    folded = None if value is None else lang.fold(value)
    if isinstance(folded, lang.Literal) and isinstance(folded.value, str):
        return (stmt.Cancel(folded.value, written.id_expr.span),)
    if value is not None:
        context.findings.add(
            "not-known-when-compiling",
            "the id of the cancelled event is computed at run time",
            written.id_expr,
            help="give the `send` an `id`, and cancel that",
        )
    return ()
