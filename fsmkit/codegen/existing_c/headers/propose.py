"""Proposes a binding from a header: by similar names, and only where values agree.

Nothing is guessed. A constant of another value, a missing member, a pointer argument or two equal
candidates become a remark for the author of the binding.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

import fsmkit.language as lang
from fsmkit.chart.analysis.host_events import sent_events
from fsmkit.chart.chart import Chart
from fsmkit.codegen.existing_c.checks import is_scalar
from fsmkit.codegen.existing_c.headers.model import (
    Constant,
    CType,
    Enumeration,
    Function,
    Header,
    Member,
    Sort,
    Struct,
)
from fsmkit.codegen.existing_c.headers.words import alike, likeness
from fsmkit.emit import plain
from fsmkit.language.conversion import integer_bounds

MOST_NAMED = 5
"""The greatest number of candidates in a remark."""


@dataclass
class Proposal:
    """Entries of a binding by key and name, and remarks by key on missing entries."""

    constants: dict[str, str] = field(default_factory=dict)
    enumerations: dict[str, tuple[str, dict[str, str]]] = field(default_factory=dict)
    records: dict[str, tuple[str, dict[str, str]]] = field(default_factory=dict)
    operations: dict[str, str] = field(default_factory=dict)
    sends: dict[str, str] = field(default_factory=dict)
    inputs: dict[str, str] = field(default_factory=dict)
    outputs: dict[str, tuple[str, bool]] = field(default_factory=dict)
    """Each output with its expression, and whether the expression uses `value`."""
    remarks: dict[str, list[str]] = field(default_factory=dict)

    def remark(self, key: str, text: str) -> None:
        """Add a remark."""
        self.remarks.setdefault(key, []).append(text)

    def __len__(self) -> int:
        parts = (
            self.constants, self.enumerations, self.records, self.operations, self.sends,
            self.inputs, self.outputs,
        )  # fmt: skip
        return sum(len(part) for part in parts)


def proposed(chart: Chart, header: Header) -> Proposal:
    """Return the proposal for a chart from a header."""
    found = Proposal()
    for type_ in chart.types:
        if isinstance(type_, lang.EnumType):
            _enumeration(type_, header, found)
        elif isinstance(type_, lang.RecordType):
            _record(type_, header, found)
    for name, literal in chart.constants:
        if isinstance(literal.type, lang.IntType | lang.DurationType) and isinstance(
            literal.value, int
        ):
            _constant(plain(name), literal.value, header, found)
    for operation in chart.operations:
        call = _call(plain(operation.name), operation.parameters, header, found, "operations")
        if call is not None:
            function, text = call
            if operation.result is None or function.result.is_number:
                found.operations[plain(operation.name)] = text
            else:
                found.remark("operations", f"{operation.name}: `{function.name}` has no result")
    for index in sent_events(chart):
        event = chart.events[index]
        call = _call(plain(event.name), event.fields, header, found, "sends")
        if call is not None:
            found.sends[plain(event.name)] = call[1]
    for variable in chart.inputs:
        _input(plain(variable.name), variable.type, header, found)
    for variable in chart.outputs:
        _output(plain(variable.name), variable.type, header, found)
    return found


# --- constants and types --------------------------------------------------------------------------


def _constant(name: str, value: int, header: Header, found: Proposal) -> None:
    equal = [each for each in header.constants if each.value == value]
    best = alike(name, equal, _name)
    if len(best) == 1:
        found.constants[name] = best[0].name
        return
    if best:
        found.remark("constants", f"{name}: {_either(best)} are {value}")
        return
    others = alike(name, header.constants, _name)
    if others:
        values = " and ".join(f"`{each.name}` is {each.value}" for each in others[:MOST_NAMED])
        found.remark("constants", f"{name} is {value}, and {values}")


def _enumeration(type_: lang.EnumType, header: Header, found: Proposal) -> None:
    name = plain(type_.name)
    fitting: list[tuple[int, Enumeration, dict[str, str]]] = []
    for enumeration in header.enumerations:
        members = _members(type_, enumeration)
        if members:
            fitting.append((likeness(name, enumeration.name), enumeration, members))
    best = [each for each in fitting if each[0] == max(score for score, _, _ in fitting)]
    if len(best) == 1:
        found.enumerations[name] = best[0][1].name, best[0][2]
    elif best:
        found.remark("types", f"{name}: {_either([each[1] for each in best])} have its members")
    else:
        for enumeration in header.enumerations:
            different = _differences(type_, enumeration)
            if different:
                found.remark(
                    "types", f"{name} has members of `{enumeration.name}`, but {different}"
                )


def _members(type_: lang.EnumType, enumeration: Enumeration) -> dict[str, str] | None:
    """Return the constant of each member, if all have one with their number.

    At least half of them must have similar names; the others may differ, as `none` and `OK`.
    """
    members = {}
    unlike = 0
    for number, member in zip(type_.numbers, type_.members, strict=True):
        equal = [each for each in enumeration.constants if each.value == number]
        best = alike(plain(member), equal, _name)
        unlike += not best
        best = best or equal
        if len(best) != 1:
            return None
        members[plain(member)] = best[0].name
    return members if 2 * unlike <= len(members) else None


def _differences(type_: lang.EnumType, enumeration: Enumeration) -> str:
    """Return the differing numbers of an enumeration all of whose names exist, as a text."""
    different = []
    for number, member in zip(type_.numbers, type_.members, strict=True):
        best = alike(plain(member), enumeration.constants, _name)
        if len(best) != 1:
            return ""
        if best[0].value != number:
            different.append(f"`{best[0].name}` is {best[0].value}, not {number}")
    return ", ".join(different[:MOST_NAMED])


def _record(type_: lang.RecordType, header: Header, found: Proposal) -> None:
    name = plain(type_.name)
    fitting: list[tuple[int, Struct, dict[str, str]]] = []
    for struct in header.structs:
        fields = _fields(type_, struct)
        if not fields:
            continue
        if struct.rejection:
            found.remark("types", f"{name}: `{struct.name}` is not offered: {struct.rejection}")
            continue
        fitting.append((likeness(name, struct.name), struct, fields))
    best = [each for each in fitting if each[0] == max(score for score, _, _ in fitting)]
    if len(best) == 1:
        found.records[name] = best[0][1].name, best[0][2]
    elif best:
        found.remark("types", f"{name}: {_either([each[1] for each in best])} have its fields")


def _fields(type_: lang.RecordType, struct: Struct) -> dict[str, str] | None:
    """Return the member for each field, if all have one that holds their values."""
    fields: dict[str, str] = {}
    for part in type_.fields:
        fitting = [member for member in struct.members if _holds(member, part.type)]
        best = alike(plain(part.name), fitting, _name)
        if len(best) != 1 or best[0].name in fields.values():
            return None
        fields[plain(part.name)] = best[0].name
    return fields


def _holds(member: Member, type_: lang.Type) -> bool:
    """Whether a member holds all values of a field."""
    if isinstance(type_, lang.ArrayType):
        return member.count == type_.length and _takes(member.type, type_.element)
    return member.count == 0 and _takes(member.type, type_)


def _takes(ctype: CType, type_: lang.Type) -> bool:
    """Whether a C type holds all values of a type of a chart."""
    if isinstance(type_, lang.FloatType):
        return ctype.sort is Sort.FLOAT
    if not is_scalar(type_) or not ctype.is_number:
        return False
    if isinstance(type_, lang.BoolType) and ctype.sort in (Sort.BOOL, Sort.INTEGER, Sort.ENUM):
        return True
    interval = integer_bounds(type_)
    if interval is None or ctype.sort is Sort.FLOAT:
        return ctype.sort is Sort.FLOAT
    return ctype.lo <= interval[0] and interval[1] <= ctype.hi


# --- calls and variables --------------------------------------------------------------------------


def _call(
    name: str, fields: tuple[lang.Field, ...], header: Header, found: Proposal, key: str
) -> tuple[Function, str] | None:
    """Return the function for an item and its call, or None after a remark."""
    named = alike(name, (each for each in header.functions if not each.is_variable), _name)
    fitting = [each for each in named if _accepts(each, fields)]
    if len(fitting) == 1:
        function = fitting[0]
        return function, f"{function.name}({', '.join(plain(each.name) for each in fields)})"
    if fitting:
        found.remark(key, f"{name}: {_either(fitting)} take its arguments")
    elif named:
        prototypes = " or ".join(f"`{_prototype(each)}`" for each in named[:MOST_NAMED])
        found.remark(key, f"{name}: {prototypes} has other arguments")
    return None


def _accepts(function: Function, fields: tuple[lang.Field, ...]) -> bool:
    return len(function.parameters) == len(fields) and all(
        _takes(ctype, part.type) for ctype, part in zip(function.parameters, fields, strict=True)
    )


def _input(name: str, type_: lang.Type, header: Header, found: Proposal) -> None:
    if not is_scalar(type_):
        return
    fitting = [
        each
        for each in header.functions
        if each.result.is_number and not each.parameters
        and (each.result.sort is Sort.FLOAT) == isinstance(type_, lang.FloatType)
    ]  # fmt: skip
    best = alike(name, fitting, _name)
    if len(best) == 1:
        found.inputs[name] = best[0].name if best[0].is_variable else f"{best[0].name}()"
    elif best:
        found.remark("inputs", f"{name}: {_either(best)}")


def _output(name: str, type_: lang.Type, header: Header, found: Proposal) -> None:
    if not is_scalar(type_):
        return
    part = (lang.Field("value", type_),)
    variables = [
        each
        for each in header.functions
        if each.is_variable and not each.is_constant and _takes(each.result, type_)
    ]
    calls = [each for each in header.functions if not each.is_variable and _accepts(each, part)]
    best = alike(name, (*variables, *calls), _name)
    if len(best) == 1:
        function = best[0]
        text = function.name if function.is_variable else f"{function.name}(value)"
        found.outputs[name] = text, not function.is_variable
    elif best:
        found.remark("outputs", f"{name}: {_either(best)}")


# --- what the chart lacks -------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Offer:
    """A proposed declaration for the chart: a line of YAML under a key."""

    key: str
    line: str


def offers(chart: Chart, header: Header, proposal: Proposal) -> Iterator[Offer]:
    """Yield the header's own declarations that the chart lacks."""
    bound = {*proposal.constants.values()}
    for _, members in proposal.enumerations.values():
        bound |= {*members.values()}
    types = {type_ for type_, _ in (*proposal.enumerations.values(), *proposal.records.values())}
    declared = {plain(name) for name, _ in chart.constants}
    enumerators = {each.name for one in header.enumerations for each in one.constants}
    for constant in header.constants:
        name = constant.name
        if constant.is_own and name not in bound | declared | enumerators and name[0] != "_":
            yield Offer("constants", f"{name}: {constant.value}")
    for enumeration in header.enumerations:
        if enumeration.is_own and enumeration.name not in types:
            yield Offer("types", f"{_word(enumeration.name)}: [{_numbered(enumeration)}]")
    for struct in header.structs:
        if struct.is_own and struct.name not in types and not struct.rejection:
            fields = ", ".join(f"{each.name}: {_declared(each)}" for each in struct.members)
            yield Offer("types", f"{_word(struct.name)}: {{{fields}}}")


def rejections(header: Header) -> Iterator[str]:
    """Yield the reasons why structs of the header are not offered."""
    for struct in header.structs:
        if struct.is_own and struct.rejection:
            yield f"{struct.name}: {struct.rejection}"


def _numbered(enumeration: Enumeration) -> str:
    """Return the members of an enumeration, with numbers unless they are consecutive."""
    texts, following = [], 0
    for constant in enumeration.constants:
        is_next = constant.value == following
        texts.append(constant.name if is_next else f"{constant.name} = {constant.value}")
        following = constant.value + 1
    return ", ".join(texts)


def _declared(member: Member) -> str:
    type_ = member.type
    if type_.sort is Sort.BOOL:
        text = "bool"
    elif type_.sort is Sort.FLOAT:
        text = "float64" if "double" in type_.spelling else "float32"
    else:
        text = f"{type_.lo}..{type_.hi}"
    return f"{text}[{member.count}]" if member.count else text


def _word(name: str) -> str:
    return name.rpartition(" ")[2]


def _name(found: Constant | Member | Function) -> str:
    return found.name


def _prototype(function: Function) -> str:
    taken = ", ".join(each.spelling for each in function.parameters) or "void"
    return f"{function.result.spelling} {function.name}({taken})"


def _either(found: list[Constant] | list[Function] | list[Enumeration] | list[Struct]) -> str:
    names = [f"`{each.name}`" for each in found[:MOST_NAMED]]
    more = f" and {len(found) - MOST_NAMED} more" if len(found) > MOST_NAMED else ""
    return f"{', '.join(names)}{more}"
