"""Read the declarations: types, constants, data, inputs, outputs, operations; and the scope."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace

import fsmkit.language as lang
from fsmkit.chart.chart import Data, Operation
from fsmkit.chart.copies.copy import NO_CONSTANTS, Copy
from fsmkit.chart.copies.declarations import bound_types, join_types, own_names
from fsmkit.chart.passes.number_states import Tree, places
from fsmkit.chart.statements import Block, Fail
from fsmkit.diagnostics import Findings, Span, Text
from fsmkit.document.document import DocData, DocFunction, DocOperation, DocType, Document
from fsmkit.document.invocation_context import InvocationContext
from fsmkit.language.binding.ecmascript import SESSION
from fsmkit.language.constants import constant_value, split_list, start_value
from fsmkit.language.functions.bodies import type_function
from fsmkit.language.statements.tree import Assign, DocField, ForEach, WrittenStatement, statements

NUMBER = re.compile(r"-? ?(0|[1-9]\d*|0[xX][0-9a-fA-F]+|0[bB][01]+|0[oO][0-7]+)", re.ASCII)
FROM = re.compile(r"(.*\S)\s+from\s*\{(.*)\}\s*", re.DOTALL)
"""The type of a result, and those results that are tried."""
UNTYPED = lang.EnumType("?", ())
"""Placeholder for the type of a variable until the type is inferred from its uses."""


@dataclass(frozen=True, slots=True)
class Names:
    """The declarations, and the scope of expressions."""

    scope: lang.Scope
    data: tuple[Data, ...] = ()
    inputs: tuple[Data, ...] = ()
    outputs: tuple[Data, ...] = ()
    operations: tuple[Operation, ...] = ()
    constants: tuple[tuple[str, lang.Literal], ...] = ()
    functions: tuple[lang.FunctionBody, ...] = ()
    types: tuple[lang.Type, ...] = ()
    """The enumerations and records; names of other types are already replaced."""
    untyped: frozenset[str] = frozenset()
    """Data without type and start value; `infer_types` derives their types from the uses."""
    inferred: frozenset[str] = frozenset()
    """Data whose type was read off the start value."""
    failures: Block = ()
    """Start values that could not be evaluated, in a lenient dialect."""

    def with_types(self, types: dict[str, lang.Type]) -> Names:
        """Return the same names, some data of other types."""
        data = tuple(
            replace(d, type=types[d.name], init=_brought(d.init, types[d.name]))
            if d.name in types
            else d
            for d in self.data
        )
        variables = dict(self.scope.variables)
        variables |= {d.name: (d.type, lang.Storage.DATA) for d in data if d.type != UNTYPED}
        scope = replace(self.scope, variables=variables)
        return replace(self, scope=scope, data=data, untyped=self.untyped - types.keys())

    def with_data(self, data: Iterable[Data]) -> Names:
        """Return the same names and more data."""
        more = {d.name: (d.type, lang.Storage.DATA) for d in data}
        scope = replace(self.scope, variables={**self.scope.variables, **more})
        return replace(self, scope=scope, data=(*self.data, *data))


def _brought(init: lang.Literal, type_: lang.Type) -> lang.Literal:
    """Return a start value in another type: an integer may become a float."""
    value = lang.default_value(type_) if init.type == UNTYPED else init.value
    if isinstance(lang.default_value(type_), float) and isinstance(value, int):
        value = float(value)
    return lang.Literal(value, type_, init.span)


def collect_names(
    document: Document,
    tree: Tree,
    tick: int,
    findings: Findings,
    given: InvocationContext | None = None,
    copies: tuple[Copy, ...] = (),
    constants: Mapping[str, lang.Literal] = NO_CONSTANTS,
) -> Names:
    """Return the names of a document; report duplicate and malformed declarations.

    ``constants``: the values that a using chart gives to constants.
    """
    check_unique(document, tree, findings)
    scope = constant_scope(document, tick, findings, given, constants)
    histories = frozenset(node.id for node in tree.nodes if node.is_history)
    states = {id_: index for id_, index in tree.index.items() if id_ not in histories}
    scope = replace(scope, states=states, histories=histories)
    scope = _with_records(document, scope, findings)
    scope = join_types(copies, scope, findings)
    scope = _with_copies(document, tree, copies, scope, findings)
    operations = tuple(_operation(o, scope, findings) for o in document.operations)
    scope = replace(
        scope, operations={o.name: lang.Signature(o.parameters, o.result) for o in operations}
    )
    reader = _Variables(Names(scope), findings)
    reader.read_all(document.inputs, lang.Storage.INPUT)
    reader.read_all(document.outputs, lang.Storage.OUTPUT)
    reader.read_all(all_data(document, tree), lang.Storage.DATA)
    known = tuple(
        (c.name.value, scope.constants[c.name.value])
        for c in document.constants
        if c.name.value in scope.constants
    )
    data = tuple(
        replace(d, init=lang.Literal(False, lang.BOOL, d.span)) if d.name in reader.failed else d
        for d in reader.names.data
    )
    names, functions = reader.names, Functions(document.functions)
    scope = functions.typed(names.scope, findings)
    names = replace(names, scope=scope, functions=functions.ordered(scope))
    others = {t.name.value for t in document.types if t.same is not None}
    return replace(
        names,
        data=data,
        operations=operations,
        constants=known,
        types=tuple(type_ for name, type_ in scope.types.items() if name not in others),
    )


def constant_scope(
    document: Document,
    tick: int,
    findings: Findings,
    given: InvocationContext | None = None,
    constants: Mapping[str, lang.Literal] = NO_CONSTANTS,
) -> lang.Scope:
    """Return the scope of constant expressions: enumerations and constants."""
    events = frozenset(event.name.value for event in document.events)
    scope = lang.Scope(tick=tick, dialect=document.datamodel, events=events)
    scope = _with_system_variables(document, scope, given)
    scope = _with_enumerations(document, scope, findings)
    return _with_constants(document, scope, findings, constants)


def _with_copies(
    document: Document, tree: Tree, copies: tuple[Copy, ...], scope: lang.Scope, findings: Findings
) -> lang.Scope:
    """Return the scope with the readable names of copies; report names that clash with a copy."""
    if not copies:
        return scope
    places = {copy.prefix.partition(".")[0]: copy for copy in copies}
    for name in _declared(document, tree):
        if name.value in places:
            findings.add(
                "duplicate-name",
                f"`{name}` is declared, and the name of a copy",
                name,
                secondary=[(places[name.value].state.span, "the copy")],
                help="rename one of them: names of the copy follow its dot",
            )
    readable: dict[str, lang.Expr] = {}
    for copy in copies:
        readable |= own_names(copy, bound_types(copy, scope, findings))
    return replace(scope, copies=readable, copied=frozenset(places))


def _with_system_variables(
    document: Document, scope: lang.Scope, given: InvocationContext | None
) -> lang.Scope:
    """Add ``_name`` and ``_sessionid`` (SCXML 5.10): a session is called as its chart is.

    That of an invoked chart is called after its place in the invoking one.
    """
    if document.datamodel != "ecmascript":
        return scope
    name = lang.Literal(document.name.value, lang.SYMBOL, document.name.span)
    session = (
        name if given is None else lang.Literal(given.session, lang.SYMBOL, document.name.span)
    )
    return replace(scope, constants={"_name": name, SESSION: session})


def all_data(document: Document, tree: Tree) -> tuple[DocData, ...]:
    """Return the data of the chart and of its states: all are global (SCXML 5.3)."""
    return (*document.data, *(d for node in tree.nodes for d in node.state.data))


def check_unique(document: Document, tree: Tree, findings: Findings) -> None:
    """Report two declarations of one name: an expression could mean either."""
    seen: dict[str, Span] = {}
    for name in _declared(document, tree):
        if name.value in seen:
            findings.add(
                "duplicate-name",
                f"`{name}` is declared twice",
                name,
                label="the second",
                secondary=[(seen[name.value], "the first")],
                help="rename one of them: types, constants, data and operations share one space",
            )
        seen.setdefault(name.value, name.span)


def _declared(document: Document, tree: Tree) -> list[Text]:
    """Return the names that expressions may hold."""
    return [
        *(t.name for t in document.types),
        *(c.name for c in document.constants),
        *(d.name for d in (*document.inputs, *document.outputs, *all_data(document, tree))),
        *(o.name for o in document.operations),
        *(f.name for f in document.functions),
    ]


def _with_enumerations(document: Document, scope: lang.Scope, findings: Findings) -> lang.Scope:
    """Add the enumerations, and those names of other types that need no constant."""
    for declared in document.types:
        name = declared.name.value
        type_: lang.Type | None = None
        if declared.members:
            members = tuple(m.name.value for m in declared.members)
            type_ = lang.EnumType(name, members, member_numbers(declared, findings))
        elif declared.same is not None:
            type_ = lang.read_type(declared.same, scope, Findings())
        if type_ is not None:
            scope = replace(scope, types={**scope.types, name: type_})
    return scope


def member_numbers(declared: DocType, findings: Findings) -> tuple[int, ...]:
    """Return the numbers of the members of an enumeration: as in C, one more than that before."""
    numbers: dict[int, Text] = {}
    following = 0
    for member in declared.members:
        number = following
        if member.number is not None:
            if NUMBER.fullmatch(member.number.value):
                number = int(member.number.value.replace(" ", ""), 0)
            else:
                findings.add(
                    "member-number",
                    f"the number of `{member.name}` is no whole number",
                    member.number,
                    help=f"write such as `{member.name} = {following}`",
                )
        if not lang.INT32.lo <= number <= lang.INT32.hi:
            findings.add(
                "member-number",
                f"the number of `{member.name}` does not fit 32 bits",
                member.number or member.name,
                help="keep it within -2147483648..2147483647, as enumerations of C do",
            )
            number = following = max(lang.INT32.lo, min(number, lang.INT32.hi))
        if number in numbers:
            findings.add(
                "member-number",
                f"`{member.name}` has the number {number}, as `{numbers[number]}` has",
                member.number or member.name,
                secondary=[(numbers[number].span, "the first")],
                help="give each member a number of its own",
            )
            number = max(numbers) + 1  # each value has one name from here on
        numbers[number] = member.name
        following = number + 1
    return tuple(numbers)


def _with_records(document: Document, scope: lang.Scope, findings: Findings) -> lang.Scope:
    for declared in document.types:
        if declared.same is not None:
            type_ = lang.read_type(declared.same, scope, findings)
            if type_ is not None:
                scope = replace(scope, types={**scope.types, declared.name.value: type_})
            continue
        if not declared.members:
            fields = read_fields(declared.fields, scope, findings, f"record `{declared.name}`")
            record = lang.RecordType(declared.name.value, fields)
            scope = replace(scope, types={**scope.types, declared.name.value: record})
        names = tuple(m.name for m in declared.members)
        names = names or tuple(f.name for f in declared.fields)
        for number, name in enumerate(names):
            if name in names[:number]:
                findings.add(
                    "duplicate-name",
                    f"`{declared.name}` has two members `{name}`",
                    name,
                    secondary=[(names[names.index(name)], "the first")],
                    help="rename one of them",
                )
    return scope


def _with_constants(
    document: Document, scope: lang.Scope, findings: Findings, given: Mapping[str, lang.Literal]
) -> lang.Scope:
    """Evaluate the constants in order: each may refer to those before it, and call functions."""
    functions = Functions(document.functions)
    for constant in document.constants:
        value = given.get(constant.name.value)
        if value is None:
            scope = functions.known(scope, constant.value)
            value = constant_value(constant.value, scope, findings)
        if value is not None:
            scope = replace(scope, constants={**scope.constants, constant.name.value: value})
    return scope


@dataclass(frozen=True, slots=True)
class Functions:
    """The functions of a chart, as declared; each may call those before it."""

    declared: tuple[DocFunction, ...]

    def known(self, scope: lang.Scope, text: Text) -> lang.Scope:
        """Return a scope with the functions that need no more, if a text may call one."""
        if not any(one.name.value in text.value for one in self.declared):
            return scope
        for one in self.declared:
            found = None
            if one.name.value not in scope.functions:
                found = _function(one, scope, Findings())
            if found is not None and not found.reads:
                scope = replace(scope, functions={**scope.functions, found.name: found})
        return scope

    def typed(self, scope: lang.Scope, findings: Findings) -> lang.Scope:
        """Return a scope with all functions."""
        if self.declared and scope.dialect != "fsmkit":
            findings.add(
                "outside-language",
                f"a chart of the data model `{scope.dialect}` has no functions",
                self.declared[0].name,
                help="write `datamodel: fsmkit`, or declare an operation",
            )
            return scope
        scope = replace(scope, functions={})
        for one in self.declared:
            found = _function(one, scope, findings)
            if found is not None:
                scope = replace(scope, functions={**scope.functions, found.name: found})
        return scope

    def ordered(self, scope: lang.Scope) -> tuple[lang.FunctionBody, ...]:
        """Return the functions of a scope, as declared."""
        names = (one.name.value for one in self.declared)
        return tuple(scope.functions[name] for name in names if name in scope.functions)


def _function(
    declared: DocFunction, scope: lang.Scope, findings: Findings
) -> lang.FunctionBody | None:
    fields = read_fields(declared.parameters, scope, findings, f"function `{declared.name}`")
    if declared.result is None:
        findings.add(
            "missing-type",
            f"the function `{declared.name}` has no result",
            declared.name,
            help=f"declare it, for instance `{declared.name}(...) -> 0..100`",
        )
        return None
    result = lang.read_type(declared.result, scope, findings)
    if result is None or len(fields) < len(declared.parameters):
        return None
    names = (parameter.name for parameter in declared.parameters)
    parameters = tuple(zip(names, fields, strict=True))
    return type_function(declared.name, parameters, result, declared.body, scope, findings)


def _operation(declared: DocOperation, scope: lang.Scope, findings: Findings) -> Operation:
    what = f"operation `{declared.name}`"
    parameters = read_fields(declared.parameters, scope, findings, what)
    result, tried = None, tuple[lang.Value, ...]()
    if declared.result is not None:
        given = FROM.fullmatch(declared.result.value)
        text = declared.result if given is None else declared.result.part(*given.span(1))
        result = lang.read_type(text, scope, findings)
        if given is not None and result is not None:
            listed = declared.result.part(given.start(2) - 1, given.end(2) + 1)
            tried = _tried(listed, result, scope, findings)
    return Operation(
        declared.name.value,
        parameters,
        result,
        declared.name.span,
        declared.origin,
        tried,
        declared.req,
    )


def _tried(
    listed: Text, type_: lang.Type, scope: lang.Scope, findings: Findings
) -> tuple[lang.Value, ...]:
    """Return the values of ``from {a, b}``, each once."""
    values = (start_value(part, type_, scope, findings) for part in split_list(listed))
    found = tuple(dict.fromkeys(value.value for value in values if value is not None))
    if not found:
        findings.add(
            "missing-argument",
            "`from` names no result",
            listed,
            help="list the results to try, such as `from {0, 500, 2000}`",
        )
    return found


def read_fields(
    fields: Iterable[DocField], scope: lang.Scope, findings: Findings, what: str
) -> tuple[lang.Field, ...]:
    """Return the typed fields of an operation, event or record; each has a type of its own."""
    found: list[lang.Field] = []
    for declared in fields:
        if any(f.name == declared.name.value for f in found):
            findings.add(
                "duplicate-name",
                f"{what} has two fields `{declared.name}`",
                declared.name,
                help="rename one of them",
            )
        elif declared.type is None:
            findings.add(
                "missing-type",
                f"`{declared.name}` of {what} has no type",
                declared.name,
                help=f"write a type after it, for instance `{declared.name} 0..255`",
            )
        else:
            type_ = lang.read_type(declared.type, scope, findings)
            if type_ is not None:
                found.append(lang.Field(declared.name.value, type_))
    return tuple(found)


@dataclass
class _Variables:
    """Reads variables in order: a start value may refer to the start values before it."""

    names: Names
    findings: Findings
    known: dict[str, lang.Literal] = field(default_factory=dict)
    failed: set[str] = field(default_factory=set)
    """Flags of the data that have no value since theirs could not be evaluated."""

    @property
    def _lenient(self) -> bool:
        return self.names.scope.dialect != "fsmkit"

    def read_all(self, declared: Iterable[DocData], storage: lang.Storage) -> None:
        for variable in declared:
            self._read(variable, storage)

    def _read(self, declared: DocData, storage: lang.Storage) -> None:
        name, scope = declared.name.value, self.names.scope
        if name in scope.variables or name in self.names.untyped:
            return
        type_ = None
        if declared.type is not None:
            type_ = lang.read_type(declared.type, scope, self.findings)
            if type_ is None:
                return
        init: lang.Literal | None = None
        if declared.init is not None:
            start_scope = replace(scope, constants={**self.known, **scope.constants}, variables={})
            scratch = Findings()
            init = start_value(declared.init, type_, start_scope, scratch)
            if init is None and self._lenient and scratch.has_errors:
                self._fail(declared.name, declared.init, next(iter(scratch)).message)
            else:
                self.findings.extend(scratch)
                if init is None:
                    return
        if type_ is None and init is None:
            self._untyped(declared, storage)
            return
        if type_ is None:
            self.names = replace(self.names, inferred=self.names.inferred | {name})
        elif init is None:
            init = lang.Literal(lang.default_value(type_), type_, declared.name.span)
        if init is None:
            return
        self.known[name] = init
        self._add(declared, init, storage)

    def _untyped(self, declared: DocData, storage: lang.Storage) -> None:
        if not self._lenient or storage is not lang.Storage.DATA:
            self.findings.add(
                "missing-type",
                f"`{declared.name}` has neither a type nor a start value",
                declared.name,
                help=f"declare it, for instance `{declared.name}: 0..255 = 0`",
            )
            return
        self.names = replace(self.names, untyped=self.names.untyped | {declared.name.value})
        self._add(declared, lang.Literal(0, UNTYPED, declared.name.span), storage)

    def _add(self, declared: DocData, init: lang.Literal, storage: lang.Storage) -> None:
        name = declared.name.value
        data = Data(name, init.type, init, declared.name.span, origin=declared.origin)
        names = self.names
        if init.type != UNTYPED:
            variables = {**names.scope.variables, name: (init.type, storage)}
            names = replace(names, scope=replace(names.scope, variables=variables))
        match storage:
            case lang.Storage.DATA:
                names = replace(names, data=(*names.data, data))
            case lang.Storage.INPUT:
                names = replace(names, inputs=(*names.inputs, data))
            case lang.Storage.OUTPUT:
                names = replace(names, outputs=(*names.outputs, data))
        self.names = names

    def _fail(self, name: Text, init: Text, reason: str) -> None:
        self.findings.add(
            "content-not-evaluable",
            f"the start value of `{name}` cannot be evaluated: {reason}",
            init,
            help="at run time this is `error.execution`; give a constant of one type",
        )
        self.failed.add(lang.flag_of(name.value))
        failure = Fail(reason, init.span)
        self.names = replace(self.names, failures=(*self.names.failures, failure))


def declare_loops(document: Document, tree: Tree, names: Names) -> Names:
    """Return the names with a variable for each item and index of a loop that has none.

    SCXML 4.6: ``foreach`` declares them; in charts of fsmkit they are local. In a loose dialect
    each name that the chart's own script assigns has one, too: executed when the chart is loaded,
    it may create variables (5.8).
    """
    if document.datamodel != "fsmkit":
        for statement in document.script:
            if isinstance(statement, Assign) and not statement.operator:
                names = _add(statement.location, UNTYPED, names)
    for place in places(document, tree):
        for loop in statements(place.block):
            if isinstance(loop, ForEach) and document.datamodel != "fsmkit":
                names = _declare(loop, names)
    return names


def _declare(loop: ForEach[Text, Text, WrittenStatement], names: Names) -> Names:
    array, _ = names.scope.variables.get(loop.array.value, (None, None))
    if loop.array.value in names.scope.copies:
        array = names.scope.copies[loop.array.value].type
    if not isinstance(array, lang.ArrayType):
        return names
    names = _add(loop.item, array.element, names)
    if loop.index is not None:
        names = _add(loop.index, lang.IntType(0, array.length - 1), names)
    return names


def _add(name: Text, type_: lang.Type, names: Names) -> Names:
    scope = names.scope
    taken = (scope.variables, scope.constants, scope.operations, scope.types, names.untyped)
    if any(name.value in known for known in taken) or not name.value.isidentifier():
        return names
    if type_ == UNTYPED:
        data = Data(name.value, UNTYPED, lang.Literal(0, UNTYPED, name.span), name.span)
        untyped = names.untyped | {name.value}
        return replace(names, data=(*names.data, data), untyped=untyped)
    init = lang.Literal(lang.default_value(type_), type_, name.span)
    return names.with_data((Data(name.value, type_, init, name.span),))
