"""Functions of a chart: typed bodies that assign nothing but their own variables."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

from fsmkit.diagnostics import Findings, Severity, Span, Text
from fsmkit.language.binding.typing import type_expression, type_location, type_update
from fsmkit.language.conversion import can_convert, convert, fits
from fsmkit.language.evaluation import rounds_of
from fsmkit.language.folding import fold
from fsmkit.language.functions.local_variables import is_taken, type_head, type_local, with_local
from fsmkit.language.functions.narrowing import narrowed
from fsmkit.language.operators import described
from fsmkit.language.scope import Scope
from fsmkit.language.statements.tree import (
    Assign,
    Block,
    Branch,
    ForEach,
    If,
    Local,
    Return,
    WrittenStatement,
    bodies,
)
from fsmkit.language.tree import (
    Call,
    CallFunction,
    Convert,
    Expr,
    FunctionBody,
    InState,
    Literal,
    Storage,
    Variable,
)
from fsmkit.language.types import (
    BOOL,
    ArrayType,
    Field,
    IntType,
    Overflow,
    RecordType,
    Type,
)
from fsmkit.language.walk import nodes, root


def type_function(
    name: Text,
    parameters: tuple[tuple[Text, Field], ...],
    result: Type,
    block: Block,
    scope: Scope,
    findings: Findings,
) -> FunctionBody | None:
    """Return a function; None where something is wrong, with at least one finding.

    ``scope``: what its body can name, without its parameters.
    """
    before = _errors(findings)
    inner = scope
    for written, field in parameters:
        if not is_taken(written, inner, findings):
            inner = with_local(inner, field.name, field.type, is_fixed=True)
    if isinstance(result, ArrayType | RecordType):
        findings.add(
            "invalid-type",
            f"`{name}` returns one value, no array and no record",
            name,
            help="write a function for each part",
        )
    typer = _Typer(name.value, result, findings)
    body = typer.block(block, inner)
    if not _returns(body) and _errors(findings) == before:
        findings.add(
            "missing-return",
            f"`{name}` does not return on every way through it",
            name,
            help="end it with `return value`, or each branch of an `if` that has an `else`",
        )
    if _errors(findings) > before:
        return None
    return FunctionBody(
        name.value,
        tuple(Variable(f.name, f.type, Storage.LOCAL, written.span) for written, f in parameters),
        result,
        body,
        tuple(_reads(body)),
        _cost(body),
        name.span,
    )


def _errors(findings: Findings) -> int:
    return sum(d.severity is Severity.ERROR for d in findings)


def _returns(body: tuple[Any, ...]) -> bool:
    """Whether every way through statements returns."""
    if not body:
        return False
    last = body[-1]
    if isinstance(last, If):
        has_else = last.branches[-1].condition is None
        return has_else and all(_returns(branch.body) for branch in last.branches)
    return isinstance(last, Return)


def _reads(body: tuple[Any, ...]) -> Iterator[Expr]:
    """Yield a variable of the chart or a state test for each that is read."""
    seen: set[object] = set()
    for part in nodes(body):
        match part:
            case Variable(found) if part.storage is not Storage.LOCAL:
                key: object = found
            case InState(state):
                key = state
            case _:
                continue
        if key not in seen:
            seen.add(key)
            yield part


def _cost(body: tuple[Any, ...]) -> int:
    """Return how many statements are executed at most."""
    total = 0
    for statement in body:
        own = replace(statement, body=()) if isinstance(statement, ForEach) else statement
        if isinstance(statement, If):
            own = tuple(branch.condition for branch in statement.branches)
        total += 1 + sum(n.function.cost for n in nodes(own) if isinstance(n, CallFunction))
        inner = sum(_cost(each) for each in bodies(statement))
        is_loop = isinstance(statement, ForEach)
        total += inner * (rounds_of(statement) if is_loop else 1) + is_loop
    return total


@dataclass(frozen=True, slots=True)
class _Typer:
    """Types the statements of one function."""

    name: str
    result: Type
    findings: Findings

    def block(self, block: Block, scope: Scope) -> tuple[Any, ...]:
        found: list[Any] = []
        for written in block:
            if isinstance(written, Local):
                local, scope = type_local(written, scope, self.findings)
                found += [] if local is None else [local]
            else:
                typed = self._statement(written, scope)
                found += [] if typed is None else [typed]
        for part in nodes(tuple(found)):
            if isinstance(part, Call):
                self._impure(f"it calls the operation `{part.operation}`", part.span)
        return tuple(found)

    def _impure(self, why: str, at: Span | Text) -> None:
        if not any(d.primary is not None and d.primary.span == at for d in self.findings):
            self.findings.add(
                "impure-function",
                f"`{self.name}` is no function: {why}",
                at,
                help="do it where the function is called, or pass what it needs as an argument",
            )

    def _statement(self, written: WrittenStatement, scope: Scope) -> Any:
        match written:
            case Assign():
                return self._assign(written, scope)
            case If(branches):
                return If(
                    tuple(
                        Branch(self._condition(b.condition, scope), self.block(b.body, scope))
                        for b in branches
                    ),
                    written.span,
                )
            case ForEach():
                return self._loop(written, scope)
            case Return(value):
                return self._return(value, written.span, scope)
            case _:
                self._impure("it does something besides computing its result", written.span)
                return None

    def _condition(self, text: Text | None, scope: Scope) -> Expr | None:
        if text is None:
            return None
        found = type_expression(text, scope, self.findings, BOOL)
        return Literal(False, BOOL, text.span) if found is None else found

    def _assign(self, written: Assign[Text, Text], scope: Scope) -> Any:
        location = type_location(written.location, scope, self.findings)
        if location is None:
            return None
        if root(location).storage is not Storage.LOCAL:
            self._impure(f"it assigns `{root(location).name}`", written.location)
            return None
        if written.operator:
            operator, value = written.operator, written.value
            typed = type_update(location, operator, value, scope, self.findings)
        else:
            typed = type_expression(written.value, scope, self.findings, location.type)
        if typed is None:
            return None
        return Assign(location, typed, written.span, sign=written.operator)

    def _loop(self, written: ForEach[Text, Text, WrittenStatement], scope: Scope) -> Any:
        head = type_head(written, scope, self.findings)
        if head is None:
            return None
        for variable in (head.item, head.index):
            if variable is not None and variable.storage is not Storage.LOCAL:
                self._impure(f"it assigns `{variable.name}`", variable.span)
        body = self.block(written.body, head.scope)
        return ForEach(head.array, head.item, head.index, body, written.span)

    def _return(self, text: Text, span: Span, scope: Scope) -> Any:
        value = type_expression(text, scope, self.findings, hint=self.result)
        if value is None or value.type is None:
            return None
        fitted = self._fitted(fold(value))
        if fitted is not None:
            return Return(fitted, span)
        self.findings.add(
            "value-out-of-range" if can_convert(value.type, self.result) else "type-mismatch",
            f"{described(value.type)} where `{self.name}` returns {described(self.result)}",
            text,
            help="declare a wider result, or convert it: a type of a range is called as `T(x)`",
            severity=Severity.ERROR,
        )
        return None

    def _fitted(self, value: Expr) -> Expr | None:
        """Return a value as the result, which it must be without any change."""
        source, result = value.type, self.result
        if source is None:
            return None
        if fits(source, result):
            return value
        if isinstance(source, IntType) and not isinstance(result, IntType):
            return convert(value, result) if can_convert(source, result) else None
        if isinstance(value, Literal) and can_convert(source, result):
            found = convert(value, result)
            return found if isinstance(found, Literal) else None
        if isinstance(source, IntType) and isinstance(result, IntType):
            lo, hi = narrowed(value)
            if result.lo <= lo and hi <= result.hi:
                within = IntType(result.lo, result.hi, Overflow.NEAREST)
                return Convert(value, within, value.span)
        return None
