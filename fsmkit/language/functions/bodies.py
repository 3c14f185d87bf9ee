"""Functions of a chart: typed bodies that assign only their own variables."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

from fsmkit.diagnostics import Findings, Severity, Span, Text
from fsmkit.language import tree, types
from fsmkit.language.binding.typing import type_expression, type_location, type_update
from fsmkit.language.conversion import can_convert, convert, fits
from fsmkit.language.evaluation import iteration_count
from fsmkit.language.folding import fold
from fsmkit.language.functions.local_variables import (
    is_taken,
    type_local,
    type_loop_head,
    with_local,
)
from fsmkit.language.functions.narrowing import narrow_range
from fsmkit.language.operators import describe_type
from fsmkit.language.scope import Scope
from fsmkit.language.statements import tree as stmt
from fsmkit.language.walk import nodes, root


def type_function(
    name: Text,
    parameters: tuple[tuple[Text, types.Field], ...],
    result: types.Type,
    block: stmt.Block,
    scope: Scope,
    findings: Findings,
) -> tree.FunctionBody | None:
    """Type a function; return None after at least one finding.

    ``scope`` has the names that its body can use, without its parameters.
    """
    before = _errors(findings)
    inner = scope
    for written, field in parameters:
        if not is_taken(written, inner, findings):
            inner = with_local(inner, field.name, field.type, is_fixed=True)
    if isinstance(result, types.ArrayType | types.RecordType):
        findings.add(
            "invalid-type",
            f"`{name}` must return a single value, not an array or a record",
            name,
            help="write a function for each part",
        )
    typer = _Typer(name.value, result, findings)
    body = typer.block(block, inner)
    if not _returns(body) and _errors(findings) == before:
        findings.add(
            "missing-return",
            f"`{name}` does not return on every path",
            name,
            help="end it with `return value`, or each branch of an `if` that has an `else`",
        )
    if _errors(findings) > before:
        return None
    return tree.FunctionBody(
        name.value,
        tuple(
            tree.Variable(f.name, f.type, tree.Storage.LOCAL, written.span)
            for written, f in parameters
        ),
        result,
        body,
        tuple(_reads(body)),
        _cost(body),
        name.span,
    )


def _errors(findings: Findings) -> int:
    return sum(d.severity is Severity.ERROR for d in findings)


def _returns(body: tuple[Any, ...]) -> bool:
    """Return whether every path through the statements returns."""
    if not body:
        return False
    last = body[-1]
    if isinstance(last, stmt.If):
        has_else = last.branches[-1].condition is None
        return has_else and all(_returns(branch.body) for branch in last.branches)
    return isinstance(last, stmt.Return)


def _reads(body: tuple[Any, ...]) -> Iterator[tree.Expr]:
    """Yield each variable of the chart and each state test that the statements read."""
    seen: set[object] = set()
    for part in nodes(body):
        match part:
            case tree.Variable(found) if part.storage is not tree.Storage.LOCAL:
                key: object = found
            case tree.InState(state):
                key = state
            case _:
                continue
        if key not in seen:
            seen.add(key)
            yield part


def _cost(body: tuple[Any, ...]) -> int:
    """Return the greatest number of statements that are executed."""
    total = 0
    for statement in body:
        own = replace(statement, body=()) if isinstance(statement, stmt.ForEach) else statement
        if isinstance(statement, stmt.If):
            own = tuple(branch.condition for branch in statement.branches)
        total += 1 + sum(n.function.cost for n in nodes(own) if isinstance(n, tree.CallFunction))
        inner = sum(_cost(each) for each in stmt.bodies(statement))
        is_loop = isinstance(statement, stmt.ForEach)
        total += inner * (iteration_count(statement) if is_loop else 1) + is_loop
    return total


@dataclass(frozen=True, slots=True)
class _Typer:
    """Types the statements of one function."""

    name: str
    result: types.Type
    findings: Findings

    def block(self, block: stmt.Block, scope: Scope) -> tuple[Any, ...]:
        found: list[Any] = []
        for written in block:
            if isinstance(written, stmt.Local):
                local, scope = type_local(written, scope, self.findings)
                found += [] if local is None else [local]
            else:
                typed = self._statement(written, scope)
                found += [] if typed is None else [typed]
        for part in nodes(tuple(found)):
            if isinstance(part, tree.Call):
                self._impure(f"it calls the operation `{part.operation}`", part.span)
        return tuple(found)

    def _impure(self, why: str, at: Span | Text) -> None:
        if not any(d.primary is not None and d.primary.span == at for d in self.findings):
            self.findings.add(
                "impure-function",
                f"`{self.name}` is not a function: {why}",
                at,
                help="do it where the function is called, or pass what it needs as an argument",
            )

    def _statement(self, written: stmt.WrittenStatement, scope: Scope) -> Any:
        match written:
            case stmt.Assign():
                return self._assign(written, scope)
            case stmt.If(branches):
                return stmt.If(
                    tuple(
                        stmt.Branch(self._condition(b.condition, scope), self.block(b.body, scope))
                        for b in branches
                    ),
                    written.span,
                )
            case stmt.ForEach():
                return self._loop(written, scope)
            case stmt.Return(value):
                return self._return(value, written.span, scope)
            case _:
                self._impure("it does something besides computing its result", written.span)
                return None

    def _condition(self, text: Text | None, scope: Scope) -> tree.Expr | None:
        if text is None:
            return None
        found = type_expression(text, scope, self.findings, types.BOOL)
        return tree.Literal(False, types.BOOL, text.span) if found is None else found

    def _assign(self, written: stmt.Assign[Text, Text], scope: Scope) -> Any:
        location = type_location(written.location, scope, self.findings)
        if location is None:
            return None
        if root(location).storage is not tree.Storage.LOCAL:
            self._impure(f"it assigns `{root(location).name}`", written.location)
            return None
        if written.operator:
            operator, value = written.operator, written.value
            typed = type_update(location, operator, value, scope, self.findings)
        else:
            typed = type_expression(written.value, scope, self.findings, location.type)
        if typed is None:
            return None
        return stmt.Assign(location, typed, written.span, sign=written.operator)

    def _loop(self, written: stmt.ForEach[Text, Text, stmt.WrittenStatement], scope: Scope) -> Any:
        head = type_loop_head(written, scope, self.findings)
        if head is None:
            return None
        for variable in (head.item, head.index):
            if variable is not None and variable.storage is not tree.Storage.LOCAL:
                self._impure(f"it assigns `{variable.name}`", variable.span)
        body = self.block(written.body, head.scope)
        return stmt.ForEach(head.array, head.item, head.index, body, written.span)

    def _return(self, text: Text, span: Span, scope: Scope) -> Any:
        value = type_expression(text, scope, self.findings, hint=self.result)
        if value is None or value.type is None:
            return None
        fitted = self._fit_result(fold(value))
        if fitted is not None:
            return stmt.Return(fitted, span)
        self.findings.add(
            "value-out-of-range" if can_convert(value.type, self.result) else "type-mismatch",
            f"{describe_type(value.type)} where `{self.name}` returns {describe_type(self.result)}",
            text,
            help="declare a wider result, or convert it: a type of a range is called as `T(x)`",
            severity=Severity.ERROR,
        )
        return None

    def _fit_result(self, value: tree.Expr) -> tree.Expr | None:
        """Return a value as the result, whose type must contain it unchanged."""
        source, result = value.type, self.result
        if source is None:
            return None
        if fits(source, result):
            return value
        if isinstance(source, types.IntType) and not isinstance(result, types.IntType):
            return convert(value, result) if can_convert(source, result) else None
        if isinstance(value, tree.Literal) and can_convert(source, result):
            found = convert(value, result)
            return found if isinstance(found, tree.Literal) else None
        if isinstance(source, types.IntType) and isinstance(result, types.IntType):
            lo, hi = narrow_range(value)
            if result.lo <= lo and hi <= result.hi:
                within = types.IntType(result.lo, result.hi, types.Overflow.NEAREST)
                return tree.Convert(value, within, value.span)
        return None
