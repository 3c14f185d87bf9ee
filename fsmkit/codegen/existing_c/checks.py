"""Checks of a binding against its chart: every name exists, and its type can be bound."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from pathlib import Path as File

import fsmkit.language as lang
from fsmkit.chart.analysis.host_events import sent_events
from fsmkit.chart.chart import Chart
from fsmkit.codegen.existing_c.model import Binding, Bound, BoundType
from fsmkit.codegen.existing_c.reader import chart_of
from fsmkit.codegen.existing_c.tokens import CExpression
from fsmkit.diagnostics import Findings, Text
from fsmkit.diagnostics.suggestions import suggest
from fsmkit.emit import plain

CONTEXT = "ctx"
VALUE = "value"


def check_binding(binding: Binding, chart: Chart, findings: Findings) -> None:
    """Report the errors of a binding for a chart, and as a note the names that it omits."""
    _check_chart(binding, chart, findings)
    checker = _Checker(binding, chart, findings)
    checker.constants()
    checker.types()
    checker.calls()
    checker.variables()
    checker.names()
    if not findings.has_errors:
        checker.report_unbound()


def _check_chart(binding: Binding, chart: Chart, findings: Findings) -> None:
    if binding.name.value != plain(chart.name):
        findings.add(
            "broken-binding",
            f"this is the binding of `{binding.name}`, and the chart is `{chart.name}`",
            binding.name,
            help=f"write `binding: {chart.name}`, or name another binding",
        )
    named = chart_of(binding)
    files = [each.name for each in chart.sources[:1] if os.path.exists(each.name)]  # noqa: PTH110
    if not os.path.exists(named):  # noqa: PTH110
        findings.add(
            "broken-binding", f"there is no chart `{binding.chart}`", binding.chart,
            help="the path is relative to the folder of the binding",
        )  # fmt: skip
    elif files and os.path.realpath(named) != os.path.realpath(files[0]):
        findings.add(
            "broken-binding",
            f"this binding is for `{binding.chart}`, and the chart is `{File(files[0]).name}`",
            binding.chart,
            help="bind a chart that extends another with `extends: BINDING` of that one",
        )


class _Checker:
    """Checks a binding part by part."""

    def __init__(self, binding: Binding, chart: Chart, findings: Findings) -> None:
        self.binding = binding
        self.chart = chart
        self.findings = findings
        self.sent = {plain(chart.events[n].name): n for n in sent_events(chart)}

    def constants(self) -> None:
        known = {plain(name): literal.type for name, literal in self.chart.constants}
        for bound in self._known(self.binding.constants, known, "constant"):
            type_ = known[bound.name.value]
            if not isinstance(
                type_, lang.IntType | lang.DurationType | lang.BoolType | lang.EnumType
            ):
                self._unfit(
                    bound.name,
                    f"`{bound.name}` is of the type {type_}, which C cannot compare when it "
                    "compiles",
                    "bind whole numbers, durations, `bool` and members of enumerations",
                )
            self._expression(bound.expression, set())

    def types(self) -> None:
        known = {
            t.name: t for t in self.chart.types if isinstance(t, lang.EnumType | lang.RecordType)
        }
        names = {plain(name): type_ for name, type_ in known.items()}
        for name, bound in self.binding.types.items():
            type_ = names.get(name)
            if type_ is None:
                self._unknown(bound.name, "type", names)
            elif isinstance(type_, lang.EnumType):
                self._enumeration(bound, type_)
            else:
                self._record(bound, type_)

    def _enumeration(self, bound: BoundType, type_: lang.EnumType) -> None:
        if bound.fields:
            self._unfit(bound.name, f"`{bound.name}` is an enumeration", "write `members`")
        known = [plain(member) for member in type_.members]
        first: dict[str, Bound] = {}
        for each in self._known(bound.members, known, f"member of `{bound.name}`"):
            self._expression(each.expression, set())
            self._once(each.expression.text, each, first, "constant")
        self._complete(bound.name, known, bound.members, "members", "BMS_HOT")

    def _record(self, bound: BoundType, type_: lang.RecordType) -> None:
        if bound.members:
            self._unfit(bound.name, f"`{bound.name}` is a record", "write `fields`")
        fields = {plain(field.name): field for field in type_.fields}
        first: dict[str, Text] = {}
        for name, path in bound.fields.items():
            if name not in fields:
                self._unknown(path.name, f"field of `{bound.name}`", fields)
                continue
            if not is_flat(fields[name].type):
                self._unfit(
                    path.name,
                    f"the field `{name}` is of the type {fields[name].type}, which is not copied "
                    "to a type of C",
                    "leave the record unbound, or give it fields that are numbers",
                )
            other = first.setdefault(path.member.value, path.name)
            if other is not path.name:
                self._twice(path.name, other, f"the member `{path.member}`")
        self._complete(bound.name, list(fields), bound.fields, "fields", "temp_dc")

    def _complete(
        self, at: Text, known: list[str], bound: Iterable[str], key: str, example: str
    ) -> None:
        missing = [name for name in known if name not in set(bound)]
        if missing:
            self._unfit(
                at,
                f"`{at}` is bound, but not all of its {key}: {_listed(missing)}",
                f"add `{missing[0]}: {example}` under `{key}`, with its name in C",
            )

    def calls(self) -> None:
        operations = {plain(each.name): each for each in self.chart.operations}
        for bound in self._known(self.binding.operations, operations, "operation"):
            operation = operations[bound.name.value]
            if operation.result is not None and not is_scalar(operation.result):
                self._unfit(
                    bound.name,
                    f"the result of `{bound.name}` is of the type {operation.result}",
                    "bind operations whose results are numbers, `bool` or enumerations",
                )
            if operation.result is None and bound.is_trusted:
                self._unfit(bound.name, f"`{bound.name}` has no result to trust", "leave it out")
            self._expression(bound.expression, parameters(operation.parameters))
            self._records(bound, operation.parameters)
        events = {plain(event.name) for event in self.chart.events}
        for bound in self.binding.sends.values():
            name = bound.name.value
            if name in self.sent:
                fields = self.chart.events[self.sent[name]].fields
                self._expression(bound.expression, parameters(fields))
                self._records(bound, fields)
            elif name in events:
                self._unfit(
                    bound.name,
                    f"the event `{name}` does not leave the machine",
                    "`sends` are events that are declared `out`",
                )
            else:
                self._unknown(bound.name, "event that leaves the machine", self.sent)

    def _records(self, bound: Bound, fields: tuple[lang.Field, ...]) -> None:
        """Reject parameters that cannot be converted to a bound type."""
        for field in fields:
            if field.name in bound.expression.names and _is_table_of_bound(
                field.type, self.binding
            ):
                self._unfit(
                    bound.name,
                    f"`{field.name}` is an array of records, which are not copied one by one",
                    "give the operation one record",
                )

    def variables(self) -> None:
        inputs = {plain(each.name): each for each in self.chart.inputs}
        for bound in self._known(self.binding.inputs, inputs, "input"):
            self._variable(bound, inputs[bound.name.value].type)
            self._expression(bound.expression, set())
        outputs = {plain(each.name): each for each in self.chart.outputs}
        first: dict[str, Bound] = {}
        for bound in self._known(self.binding.outputs, outputs, "output"):
            self._variable(bound, outputs[bound.name.value].type)
            self._expression(bound.expression, {VALUE} if bound.is_setter else set())
            if not bound.is_setter:
                self._once(bound.expression.text, bound, first, "place")
                continue
            if VALUE not in bound.expression.names:
                self._unfit(
                    bound.expression.place,
                    f"`set` of `{bound.name}` does nothing with `value`",
                    "use `value`, the value of the output",
                )
            if isinstance(outputs[bound.name.value].type, lang.ArrayType):
                self._unfit(
                    bound.name,
                    f"`{bound.name}` is an array, which one `value` cannot hold",
                    "write the array in C that it is copied to",
                )

    def _variable(self, bound: Bound, type_: lang.Type) -> None:
        element = type_.element if isinstance(type_, lang.ArrayType) else type_
        flat = is_scalar(element)
        if isinstance(element, lang.RecordType) and not isinstance(type_, lang.ArrayType):
            flat = all(is_flat(field.type) for field in element.fields)
        if not flat:
            self._unfit(
                bound.name,
                f"`{bound.name}` is of the type {type_}, which is not copied",
                "bind numbers, `bool`, enumerations, arrays of them, and records of these",
            )

    def names(self) -> None:
        known = nameable(self.chart)
        for chosen in self.binding.names.values():
            there = known.get(chosen.kind, ())
            if chosen.name not in there:
                self._unknown(
                    chosen.place.with_value(chosen.name), chosen.kind, there, said=chosen.place
                )

    def report_unbound(self) -> None:
        binding, chart = self.binding, self.chart
        parts: tuple[tuple[str, Iterable[str], Mapping[str, Bound]], ...] = (
            ("operation", [each.name for each in chart.operations], binding.operations),
            ("event", self.sent, binding.sends),
            ("input", [each.name for each in chart.inputs], binding.inputs),
            ("output", [each.name for each in chart.outputs], binding.outputs),
        )
        missing = [
            f"{kind} `{name}`" for kind, names, bound in parts for name in names
            if plain(name) not in bound
        ]  # fmt: skip
        if missing:
            self.findings.add(
                "unbound-name",
                f"the host writes the rest itself: {', '.join(missing)}",
                binding.name,
                help="bind them, or write their functions and members in C",
            )

    # --- what is wrong --------------------------------------------------------------------------

    def _known(
        self, bound: Mapping[str, Bound], known: Iterable[str], kind: str
    ) -> Iterable[Bound]:
        names = set(known)
        for name, each in bound.items():
            if name in names:
                yield each
            else:
                self._unknown(each.name, kind, names)

    def _unknown(
        self, name: Text, kind: str, known: Iterable[str], said: Text | None = None
    ) -> None:
        names = sorted(known)
        otherwise = f"there are {_listed(names)}" if names else "it has none"
        self.findings.add(
            "unknown-name", f"the chart has no {kind} `{name}`", said or name,
            help=suggest(name.value, names, otherwise),
        )  # fmt: skip

    def _unfit(self, at: Text, message: str, advice: str) -> None:
        self.findings.add("unfit-binding", message, at, help=advice)

    def _once(self, text: str, bound: Bound, first: dict[str, Bound], what: str) -> None:
        other = first.setdefault("".join(text.split()), bound)
        if other is not bound:
            self._twice(bound.name, other.name, f"the {what} `{text}`")

    def _twice(self, name: Text, other: Text, what: str) -> None:
        self.findings.add(
            "bound-twice", f"`{other}` and `{name}` are both {what}", name,
            secondary=[(other, "the first")], help="give each its own",
        )  # fmt: skip

    def _expression(self, expression: CExpression, own: set[str]) -> None:
        if CONTEXT in expression.names - own and self.binding.context is None:
            self._unfit(
                expression.place,
                "`ctx` needs a `context`, which the binding does not declare",
                "write `context: {type: struct board, member: machine}`",
            )


def parameters(fields: tuple[lang.Field, ...]) -> set[str]:
    """Return the names of the values of fields in an expression."""
    return {plain(field.name) for field in fields}


def nameable(chart: Chart) -> dict[str, frozenset[str]]:
    """Return the names of a chart that a binding can choose, by kind."""
    enumerations = [t for t in chart.types if isinstance(t, lang.EnumType)]
    records = [t for t in chart.types if isinstance(t, lang.RecordType)]
    fields = [field for record in records for field in record.fields]
    fields += [field for event in chart.events for field in event.fields]
    fields += [field for operation in chart.operations for field in operation.parameters]
    types: list[lang.EnumType | lang.RecordType] = [*enumerations, *records]
    found: dict[str, Iterable[str]] = {
        "type": [each.name for each in types],
        "member": [f"{plain(t.name)}.{plain(m)}" for t in enumerations for m in t.members],
        "operation": [each.name for each in chart.operations],
        "event": [each.name for each in chart.events],
        "state": [each.id for each in chart.states[1:]],
        "data": [each.name for each in chart.data],
        "input": [each.name for each in chart.inputs],
        "output": [each.name for each in chart.outputs],
        "constant": [name for name, _ in chart.constants],
        "field": [each.name for each in fields],
    }
    return {kind: frozenset(map(plain, names)) for kind, names in found.items()}


def is_scalar(type_: lang.Type) -> bool:
    """Whether a value is a single number on both sides, no string, array or record."""
    return not isinstance(type_, lang.ArrayType | lang.RecordType | lang.SymbolType)


def is_flat(type_: lang.Type) -> bool:
    """Whether a field can be copied to a C field: a number, or an array of numbers."""
    return is_scalar(type_.element if isinstance(type_, lang.ArrayType) else type_)


def _is_table_of_bound(type_: lang.Type, binding: Binding) -> bool:
    return (
        isinstance(type_, lang.ArrayType)
        and isinstance(type_.element, lang.RecordType)
        and plain(type_.element.name) in binding.types
    )


def _listed(names: list[str]) -> str:
    return ", ".join(f"`{name}`" for name in names)
