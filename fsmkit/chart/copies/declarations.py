"""Declarations of copies in the chart around them: types, data, operations, events, capacities."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace

import fsmkit.language as lang
from fsmkit.chart.chart import Capacities, Data, Event, Operation
from fsmkit.chart.content import all_statements
from fsmkit.chart.copies.copy import Copy
from fsmkit.chart.copies.mapping import mapped_type
from fsmkit.chart.statements import Send
from fsmkit.diagnostics import Findings
from fsmkit.document.document import Document
from fsmkit.document.walk import structure
from fsmkit.language.constants import start_value
from fsmkit.language.statements.tree import DocArgument, DocSend

END = "done.session"
"""The event that a used chart would send at its end if it were invoked (`collect_events`)."""
GREATEST = ("queue", "internal", "microsteps")
"""Capacities of which the greatest is taken."""


def join_types(copies: Iterable[Copy], scope: lang.Scope, findings: Findings) -> lang.Scope:
    """Return the scope with the types of used charts; two of one name that differ are a finding."""
    types = dict(scope.types)
    places = dict.fromkeys(types, "this chart")
    for copy in copies:
        bound = {one.name.value for one in copy.use.bind}
        for type_ in _declared(copy):
            if type_.name in bound:
                continue
            if types.setdefault(type_.name, type_) != type_:
                findings.add(
                    "type-differs",
                    f"the type `{type_.name}` of `{copy.used.chart.name}` is another in "
                    f"{places[type_.name]}",
                    copy.use.span,
                    help=f"rename one of the two, or bind it: `bind: {{{type_.name}: ...}}`",
                )
            places.setdefault(type_.name, f"`{copy.used.chart.name}`")
    return replace(scope, types=types)


def _declared(copy: Copy) -> Iterator[lang.EnumType | lang.RecordType]:
    for type_ in copy.used.chart.types:
        if isinstance(type_, lang.EnumType | lang.RecordType):
            yield type_


def bound_types(copy: Copy, scope: lang.Scope, findings: Findings) -> dict[lang.Type, lang.Type]:
    """Return the types of a used chart that are others here."""
    found: dict[lang.Type, lang.Type] = {}
    given = {one.name.value: one for one in copy.use.bind}
    for type_ in _declared(copy):
        one = given.get(type_.name)
        if one is None:
            changed = mapped_type(type_, found)
            if changed != type_:
                found[type_] = changed
            continue
        here = scope.types.get(one.value.value.strip())
        if here is None:
            findings.add(
                "unknown-name", f"there is no type `{one.value}`", one.value,
                help="name a type of this chart",
            )  # fmt: skip
        elif _alike(mapped_type(type_, found), here):
            found[type_] = here
        else:
            findings.add(
                "type-differs",
                f"`{one.value}` is another type than `{type_.name}` of `{copy.used.chart.name}`",
                one.value,
                help="bind a type with the same members or fields, in the same order",
            )
    return found


def _alike(inner: lang.Type, outer: lang.Type) -> bool:
    match inner, outer:
        case lang.EnumType(), lang.EnumType():
            return replace(inner, name=outer.name) == outer
        case lang.RecordType(), lang.RecordType():
            return replace(inner, name=outer.name) == outer
        case _:
            return False


def own_names(copy: Copy, types: Mapping[lang.Type, lang.Type]) -> dict[str, lang.Expr]:
    """Return the unbound variables and constants of a copy, by dotted name.

    The using chart can read them by these names.
    """
    chart = copy.used.chart
    bound = {one.name.value for one in copy.use.bind}
    found: dict[str, lang.Expr] = {}
    for storage, group in (
        (lang.Storage.DATA, chart.data),
        (lang.Storage.INPUT, chart.inputs),
        (lang.Storage.OUTPUT, chart.outputs),
    ):
        for data in group:
            if data.name not in bound:
                name = copy.name(data.name)
                found[name] = lang.Variable(name, mapped_type(data.type, types), storage, data.span)
    for constant, value in chart.constants:
        type_ = mapped_type(value.type, types)
        found[copy.name(constant)] = replace(value, type=type_, name=copy.name(constant))
    return found


def own_data(
    copy: Copy,
    group: tuple[Data, ...],
    types: Mapping[lang.Type, lang.Type],
    starts: Mapping[str, lang.Literal],
) -> tuple[Data, ...]:
    """Return the variables of a copy that are its own, with the start values it is given."""
    bound = {one.name.value for one in copy.use.bind}
    found = []
    for data in group:
        if data.name not in bound:
            type_ = mapped_type(data.type, types)
            init = starts.get(data.name, replace(data.init, type=type_))
            found.append(replace(data, name=copy.name(data.name), type=type_, init=init))
    return tuple(found)


def start_values(
    copy: Copy, types: Mapping[lang.Type, lang.Type], scope: lang.Scope, findings: Findings
) -> dict[str, lang.Literal]:
    """Return the start values that a copy is given, by name in the used chart."""
    known = {data.name: data for data in copy.used.chart.data}
    bound = {one.name.value for one in copy.use.bind}
    scope = replace(scope, constants={**scope.constants, **copy.index}, variables={}, copies={})
    found: dict[str, lang.Literal] = {}
    for one in copy.use.start:
        name = one.name.value
        if name not in known:
            unknown_binding(copy, "variable", one, list(known), findings)
        elif name in bound:
            findings.add(
                "bad-use",
                f"`{name}` is bound, and starts as what it is bound to",
                one.name,
                help="remove it under `start`, or under `bind`",
            )
        else:
            type_ = mapped_type(known[name].type, types)
            value = start_value(one.value, type_, scope, findings)
            if value is not None:
                found[name] = value
    return found


def unknown_binding(
    copy: Copy, what: str, one: DocArgument, known: list[str], findings: Findings
) -> None:
    """Report a name under a using state that the used chart does not have."""
    from fsmkit.diagnostics.suggestions import suggest

    chart = copy.used.chart.name
    findings.add(
        "unknown-binding",
        f"`{chart}` has no {what} `{one.name}`",
        one.name,
        help=suggest(one.name.value, known, f"name what `{chart}` declares"),
    )


def own_operations(copy: Copy, types: Mapping[lang.Type, lang.Type]) -> tuple[Operation, ...]:
    """Return the operations of a copy that are not bound."""
    bound = {one.name.value for one in copy.use.bind}
    return tuple(
        replace(
            operation,
            name=copy.name(operation.name),
            parameters=mapped_fields(operation.parameters, types),
            result=None if operation.result is None else mapped_type(operation.result, types),
        )
        for operation in copy.used.chart.operations
        if operation.name not in bound and f"operation {operation.name}" not in bound
    )


def mapped_fields(
    fields: tuple[lang.Field, ...], types: Mapping[lang.Type, lang.Type]
) -> tuple[lang.Field, ...]:
    """Return fields in the types of the chart around."""
    return tuple(lang.Field(part.name, mapped_type(part.type, types)) for part in fields)


def event_name(copy: Copy, event: Event) -> str | None:
    """Return the name in this chart of an unbound event of a used chart.

    Return None for its end, which is the done event of the state that it fills.
    """
    if event.name == END:
        return None
    if event.invocation is None and event.name.startswith("error."):
        return event.name
    for platform in ("done.state.", "done.invoke."):
        if event.name.startswith(platform) and not event.directions:
            return platform + copy.name(event.name.removeprefix(platform))
    return copy.name(event.name)


def joined_capacities(
    document: Document, capacities: Capacities, copies: tuple[Copy, ...]
) -> Capacities:
    """Return the capacities of a chart with copies; it may declare its own.

    The capacities for pending sends are added up. For all others the maximum counts.
    """
    given = {one.name.value for one in document.capacities}
    inner = [copy.used.chart.capacities for copy in copies]
    if not inner:
        return capacities
    found = {}
    for name in GREATEST:
        if name not in given:
            found[name] = max(getattr(one, name) for one in (capacities, *inner))
    if "delayed" not in given:
        own = capacities.delayed if _delays(document) else 0
        waiting = [c.used.chart.capacities.delayed for c in copies if sends_later(c)]
        found["delayed"] = own + sum(waiting) or capacities.delayed
    return replace(capacities, **found)


def _delays(document: Document) -> bool:
    return any(
        isinstance(part, DocSend) and (part.delay is not None or part.delay_expr is not None)
        for part in structure(document)
    )


def sends_later(copy: Copy) -> bool:
    """Whether a used chart has delayed sends."""
    return any(
        isinstance(one, Send) and one.delay is not None for one in all_statements(copy.used.chart)
    )
