"""The names of a used chart in one copy: its own, or the bound ones."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace

import fsmkit.language as lang
from fsmkit.chart.chart import Chart, Data, Event, Operation
from fsmkit.chart.copies.copy import Copy
from fsmkit.chart.copies.declarations import (
    END,
    bound_types,
    event_name,
    mapped_fields,
    own_names,
    unknown_binding,
)
from fsmkit.chart.copies.mapping import Mapper, mapped_type
from fsmkit.diagnostics import Findings, Span, Text
from fsmkit.diagnostics.suggestions import suggest
from fsmkit.document.document import Direction
from fsmkit.language.conversion import can_convert, convert, fits
from fsmkit.language.statements.tree import DocArgument
from fsmkit.language.walk import calls

NAME = re.compile(r"\s*[^\W\d][\w.]*\s*")
KINDS = ("event", "operation")
"""Words before a name that is an event and something else."""


@dataclass
class Binder:
    """Looks the bindings of one copy up."""

    copy: Copy
    scope: lang.Scope
    findings: Findings
    types: Mapping[lang.Type, lang.Type] = field(default_factory=dict)
    given: dict[tuple[str, str], DocArgument] = field(default_factory=dict)
    """By kind and name in the used chart."""

    def __post_init__(self) -> None:
        """Sort the bindings."""
        self.types = bound_types(self.copy, self.scope, Findings())
        for one in self.copy.use.bind:
            kind = self._kind(one)
            if kind is None:
                continue
            if kind in self.given:
                self.findings.add(
                    "duplicate-argument", f"`{one.name}` is bound twice", one.name,
                    help="remove one of the two",
                )  # fmt: skip
            self.given[kind] = one

    @property
    def chart(self) -> Chart:
        """The used chart."""
        return self.copy.used.chart

    def _kind(self, one: DocArgument) -> tuple[str, str] | None:
        """Return the kind and the name that a binding refers to in the used chart, or None."""
        name = one.name.value
        word, _, rest = name.partition(" ")
        chart = self.chart
        names = {
            "data": {d.name for d in chart.data},
            "input": {d.name for d in chart.inputs},
            "output": {d.name for d in chart.outputs},
            "operation": {o.name for o in chart.operations},
            "event": {e.name for e in chart.events if can_bind(e)},
            "type": {getattr(t, "name", "") for t in chart.types},
        }
        if rest and word in KINDS:
            kinds, name = [word] if rest.strip() in names[word] else [], rest.strip()
        else:
            kinds = [kind for kind, known in names.items() if name in known]
        if len(kinds) == 1:
            return kinds[0], name
        if kinds:
            self.findings.add(
                "ambiguous-binding",
                f"`{name}` is {' and '.join(_article(kind) for kind in kinds)} of `{chart.name}`",
                one.name,
                help=f"write `event {name}` or `operation {name}`",
            )
            return None
        if name in {constant for constant, _ in chart.constants}:
            advice = f"give the constant a value: `with: {{{name}: {one.value}}}`"
            self.findings.add(
                "unknown-binding", f"`{name}` of `{chart.name}` is a constant", one.name,
                help=advice,
            )  # fmt: skip
            return None
        known = [known for group in names.values() for known in group if known]
        unknown_binding(self.copy, "input, output, variable, operation or event", one, known,
                        self.findings)  # fmt: skip
        return None

    # --- events ---------------------------------------------------------------------------

    def event_names(self) -> Iterator[tuple[Event, str | None, DocArgument | None]]:
        """Yield each event of the used chart with its name here, and its binding if it has one."""
        for event in self.chart.events:
            one = self.given.get(("event", event.name)) if can_bind(event) else None
            if one is None:
                yield event, event_name(self.copy, event), None
            else:
                yield event, one.value.value.strip(), one

    def check_event(self, inner: Event, outer: Event, at: Text) -> None:
        """Report an event that an event of the used chart cannot be bound to."""
        types = self.types
        fields = {f.name: f.type for f in outer.fields}
        own = {f.name: mapped_type(f.type, types) for f in inner.fields}
        comes = Direction.IN in inner.directions
        goes = Direction.OUT in inner.directions
        for name, type_ in own.items():
            if comes and name not in fields:
                self._misfit(
                    f"`{outer.name}` has no field `{name}`, which the used chart reads", at
                )
            elif comes and not fits(fields[name], type_):
                self._misfit(f"`{name}` is {fields[name]} here and {type_} in the used chart", at)
        for name, type_ in fields.items():
            if goes and name not in own:
                self._misfit(f"nothing fills the field `{name}` of `{outer.name}`", at)
            elif goes and not fits(own[name], type_):
                self._misfit(f"`{name}` is {type_} here and {own[name]} in the used chart", at)
        reply = None if inner.reply is None else mapped_type(inner.reply, types)
        if reply != outer.reply:
            self._misfit(f"`{outer.name}` has another answer than `{inner.name}`", at)
        if goes and len(outer.directions) > 1:
            self.findings.add(
                "ambiguous-binding",
                f"`{outer.name}` goes more than one way: what is sent could leave the machine",
                at,
                help="bind an event that is only one of `in`, `out` and `internal`",
            )
        elif goes and not outer.directions:
            self._misfit(f"`{outer.name}` is raised by the platform alone", at)
        elif comes and outer.directions == {Direction.OUT}:
            self._misfit(f"`{outer.name}` only leaves the machine", at)

    def _misfit(self, message: str, at: Text | Span) -> None:
        self.findings.add(
            "binding-mismatch", message, at,
            help="bind something that fits, or leave it unbound",
        )  # fmt: skip

    # --- variables ------------------------------------------------------------------------

    def variables(self) -> dict[str, lang.Expr]:
        """Return the expression that replaces a read of each variable of the used chart."""
        own = own_names(self.copy, self.types)
        found: dict[str, lang.Expr] = {}
        for kind, group in (
            ("data", self.chart.data), ("input", self.chart.inputs), ("output", self.chart.outputs),
        ):  # fmt: skip
            for data in group:
                one = self.given.get((kind, data.name))
                if one is None:
                    found[data.name] = own.get(self.copy.name(data.name)) or _stand_in(
                        self.copy, data, self.types
                    )
                else:
                    found[data.name] = self._bound(kind, data, one) or _stand_in(
                        self.copy, data, self.types
                    )
        return found

    def _bound(self, kind: str, data: Data, one: DocArgument) -> lang.Expr | None:
        type_ = mapped_type(data.type, self.types)
        if kind == "input":
            return self._input(data, type_, one)
        location = lang.type_location(one.value, self.scope, self.findings)
        if location is None:
            return None
        if not isinstance(location, lang.Variable):
            self.findings.add(
                "not-a-variable", f"`{one.value}` is part of a variable", one.value,
                help="bind a whole one",
            )  # fmt: skip
            return None
        if kind == "data" and location.type != type_:
            self._misfit(f"`{one.value}` is {location.type}, and `{data.name}` is {type_}",
                         one.value)  # fmt: skip
            return None
        if location.type == type_:
            return location
        is_whole = isinstance(type_, lang.ArrayType | lang.RecordType)
        if is_whole or not (fits(type_, location.type) and can_convert(location.type, type_)):
            self._misfit(
                f"`{one.value}` is {location.type} and does not hold {type_}, which `{data.name}` "
                "is",
                one.value,
            )
            return None
        return lang.Convert(location, type_, one.value.span)

    def _input(self, data: Data, type_: lang.Type, one: DocArgument) -> lang.Expr | None:
        expr = lang.type_expression(one.value, self.scope, self.findings, type_)
        if expr is None:
            return None
        if calls(expr):
            self._misfit("an operation cannot be called wherever an input is read", one.value)
            return None
        if isinstance(type_, lang.ArrayType) and not isinstance(expr, lang.Variable):
            self._misfit(f"`{data.name}` is an array, and an array is bound as a whole", one.value)
            return None
        return expr

    # --- operations -----------------------------------------------------------------------

    def operations(
        self, declared: Mapping[str, Operation]
    ) -> dict[str, str | tuple[tuple[str, ...], lang.Call]]:
        """Return the call that replaces each operation; ``declared``: those of the using chart."""
        found: dict[str, str | tuple[tuple[str, ...], lang.Call]] = {}
        for operation in self.chart.operations:
            one = self.given.get(("operation", operation.name))
            found[operation.name] = self.copy.name(operation.name)
            if one is not None:
                pattern = self._pattern(operation, one, declared)
                if pattern is not None:
                    found[operation.name] = pattern
        return found

    def _pattern(
        self, operation: Operation, one: DocArgument, declared: Mapping[str, Operation]
    ) -> tuple[tuple[str, ...], lang.Call] | None:
        parameters = mapped_fields(operation.parameters, self.types)
        names = tuple(part.name for part in parameters)
        text = one.value
        if NAME.fullmatch(text.value):
            call = self._by_name(parameters, text, declared)
        else:
            own = {part.name: (part.type, lang.Storage.DATA) for part in parameters}
            scope = replace(self.scope, variables={**self.scope.variables, **own})
            call = lang.type_call(text, scope, self.findings)
        if call is None:
            return None
        wanted = None if operation.result is None else mapped_type(operation.result, self.types)
        if wanted is not None and (call.type is None or not fits(call.type, wanted)):
            self._misfit(
                f"`{call.operation}` returns {call.type or 'nothing'}, and `{operation.name}` "
                f"{wanted}",
                text,
            )
            return None
        return names, call

    def _by_name(
        self, parameters: tuple[lang.Field, ...], text: Text, declared: Mapping[str, Operation]
    ) -> lang.Call | None:
        name = text.value.strip()
        operation = declared.get(name)
        if operation is None:
            self.findings.add(
                "unknown-name", f"unknown operation `{name}`", text,
                help=suggest(name, declared, "declare it under `operations`"),
            )  # fmt: skip
            return None
        if len(operation.parameters) != len(parameters):
            self._misfit(
                f"`{name}` takes {len(operation.parameters)} arguments, not {len(parameters)}", text
            )
            return None
        arguments: list[lang.Expr] = []
        for inner, outer in zip(parameters, operation.parameters, strict=True):
            if not can_convert(inner.type, outer.type):
                self._misfit(f"`{inner.name}` is {inner.type} and not {outer.type}", text)
                return None
            given = lang.Variable(inner.name, inner.type, lang.Storage.DATA, text.span)
            arguments.append(given if inner.type == outer.type else convert(given, outer.type))
        return lang.Call(name, tuple(arguments), operation.result, text.span)


def can_bind(event: Event) -> bool:
    """Whether an event of a used chart may be one of the chart around it."""
    return event.invocation is None and bool(event.directions - {Direction.INTERNAL})


def _stand_in(copy: Copy, data: Data, types: Mapping[lang.Type, lang.Type]) -> lang.Variable:
    """Return a placeholder for a variable whose binding is wrong and already reported."""
    return lang.Variable(
        copy.name(data.name), mapped_type(data.type, types), lang.Storage.DATA, data.span
    )


def _article(kind: str) -> str:
    return f"{'an' if kind[0] in 'aeio' else 'a'} {kind}"


def mapper_of(
    binder: Binder,
    base: int,
    slot: int,
    events: tuple[Event, ...],
    operations: Mapping[str, Operation],
) -> Mapper:
    """Return the mapper from all names of a used chart to those in a copy.

    ``base`` is the index of the using state, ``slot`` of its first invocation.
    """
    copy, findings = binder.copy, binder.findings
    index: dict[tuple[str, int | None], int] = {}
    for event in sorted(events, key=lambda e: e.directions != {Direction.INTERNAL}, reverse=True):
        index.setdefault((event.name, event.invocation), event.index)
    found: dict[int, int] = {}
    bound: set[int] = set()
    for event, name, one in binder.event_names():
        if name is None:  # its own end is the done event of the using state
            continue
        invocation = None if event.invocation is None else event.invocation + slot
        here = index.get((name, invocation))
        if here is None:
            if one is not None:
                findings.add(
                    "unknown-name", f"there is no event `{name}`", one.value,
                    help=suggest(name, [e.name for e in events], f"declare `{name}` here"),
                )  # fmt: skip
            continue
        found[event.index] = here
        if one is not None:
            bound.add(event.index)
            binder.check_event(event, events[here], one.value)

    def report(message: str, span: Span) -> None:
        findings.add(
            "binding-mismatch", f"{message}: a binding of `{copy.prefix}`", copy.use.span,
            secondary=[(span, "where the used chart needs it")],
            help="give the events that are bound together the same fields",
        )  # fmt: skip

    return Mapper(
        prefix=copy.prefix,
        base=base,
        slot=slot,
        types=binder.types,
        variables=binder.variables(),
        operations=binder.operations(operations),
        events=found,
        bound=frozenset(bound),
        before=copy.used.chart.events,
        after=events,
        constants=frozenset(name for name, _ in copy.used.chart.constants),
        report=report,
    )


__all__ = ("END", "Binder", "can_bind", "mapper_of")
