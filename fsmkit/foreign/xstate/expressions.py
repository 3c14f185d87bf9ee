"""Expressions of JavaScript as expressions of a chart, where both mean the same."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from fsmkit.foreign.xstate.script import FUNCTIONS, arguments, unwrapped
from fsmkit.foreign.xstate.values import Code, Constant, Number, Program, String, Value

INT, FLOAT, BOOL, SYMBOL = "int32", "float64", "bool", "symbol"
LARGEST_INT = 2**31 - 1
DEEPEST = 40
NUMBERS = (INT, FLOAT)
COMPARISONS = {"<": "<", "<=": "<=", ">": ">", ">=": ">="}
EQUALITIES = {"===": "==", "==": "==", "!==": "!=", "!=": "!="}
FUNCTIONS_OF_MATH = {"Math.min": "min", "Math.max": "max", "Math.abs": "abs"}
Roles = Mapping[str, tuple[str, ...]]
"""Names that parameters bind, each with its path below ``context``, ``event`` or ``params``."""


@dataclass(frozen=True, slots=True)
class Typed:
    """An expression of a chart and its type."""

    text: str
    type: str
    is_atom: bool = False

    @property
    def operand(self) -> str:
        """The text, in brackets unless it is one word."""
        return self.text if self.is_atom else f"({self.text})"


@dataclass(frozen=True, slots=True)
class Scope:
    """The names that an expression can read.

    ``context`` has the variables that the chart carries. ``fields`` is the type of each field of
    the current event, by name, which a translation extends; None if the event is not known.
    """

    context: Mapping[str, Typed]
    fields: dict[str, str] | None
    params: Mapping[str, Value] = field(default_factory=dict)


def literal(value: Value) -> Typed | None:
    """Return a number, Boolean or string as an expression; None for other values."""
    match value:
        case Number(found, _) if isinstance(found, int) and abs(found) <= LARGEST_INT:
            return Typed(str(found), INT, is_atom=found >= 0)
        case Number(found, _):
            text = repr(float(found))
            return None if "e" in text else Typed(text, FLOAT, is_atom=found >= 0)
        case Constant(found, _) if found is not None:
            return Typed("true" if found else "false", BOOL, is_atom=True)
        case String(text):
            return Typed(json.dumps(text.value, ensure_ascii=False), SYMBOL, is_atom=True)
        case _:
            return None


def function_of(script: Program, node: Any) -> tuple[Roles, Any] | None:
    """Return the parameters of a function of ``{context, event}`` and the expression it returns."""
    node = unwrapped(node)
    if node.type not in FUNCTIONS or node.type.startswith("generator"):
        return None
    if script.text(node).startswith("async"):
        return None
    body = node.child_by_field_name("body")
    if body is not None and body.type == "statement_block":
        statements = list(arguments(body))
        if len(statements) != 1 or statements[0].type != "return_statement":
            return None
        body = next(arguments(statements[0]), None)
    roles = _roles(script, node)
    return None if body is None or roles is None else (roles, unwrapped(body))


def _roles(script: Program, node: Any) -> Roles | None:
    single = node.child_by_field_name("parameter")
    if single is not None:
        return {script.text(single): ()}
    listed = node.child_by_field_name("parameters")
    found: dict[str, tuple[str, ...]] = {}
    for number, each in enumerate(() if listed is None else arguments(listed)):
        pattern = each.child_by_field_name("pattern") or each
        base = () if number == 0 else ("params",)
        if number > 1 or each.child_by_field_name("value") is not None:
            return None
        if not _bind(script, pattern, base, found):
            return None
    return found


def _bind(
    script: Program, pattern: Any, base: tuple[str, ...], found: dict[str, tuple[str, ...]]
) -> bool:
    match pattern.type:
        case "identifier":
            found[script.text(pattern)] = base
        case "object_pattern" if len(base) < DEEPEST:
            for each in arguments(pattern):
                if each.type == "shorthand_property_identifier_pattern":
                    found[script.text(each)] = (*base, script.text(each))
                elif each.type == "pair_pattern":
                    key = script.text(each.child_by_field_name("key"))
                    value = each.child_by_field_name("value")
                    if not _bind(script, value, (*base, key), found):
                        return False
                else:
                    return False
        case _:
            return False
    return True


@dataclass(frozen=True, slots=True)
class Translation:
    """Translates expressions of one function."""

    script: Program
    roles: Roles
    scope: Scope

    def expression(self, node: Any, expected: str | None = None, depth: int = 0) -> Typed | None:
        """Return an expression; None where the chart's language has no equal one.

        ``expected`` is the type of a field of the event that nothing else determines.
        """
        node = unwrapped(node)
        if depth > DEEPEST:
            return None
        match node.type:
            case "identifier" | "member_expression":
                return self._name(node, expected)
            case "true" | "false" | "number" | "string" | "template_string":
                return literal(self.script.value(node))
            case "unary_expression":
                return self._unary(node, depth)
            case "binary_expression":
                return self._binary(node, expected, depth)
            case "ternary_expression":
                return self._conditional(node, expected, depth)
            case "call_expression":
                return self._call(node, depth)
            case _:
                return None

    def condition(self, node: Any, depth: int = 0) -> Typed | None:
        """Return an expression as JavaScript tests it: a number that is not 0 is true."""
        found = self.expression(node, BOOL, depth)
        match found:
            case Typed(_, "int32"):
                return Typed(f"{found.operand} != 0", BOOL)
            case Typed(_, "symbol"):
                return Typed(f'{found.operand} != ""', BOOL)
            case Typed(_, "bool"):
                return found
            case _:
                return None

    def _name(self, node: Any, expected: str | None) -> Typed | None:
        path = self.path(node)
        match path:
            case ("context", name):
                return self.scope.context.get(name)
            case ("event", name) if name != "type" and name.isidentifier():
                fields = self.scope.fields
                if fields is None:
                    return None
                kind = fields.setdefault(name, expected or INT)
                return Typed(f"event.{name}", kind, is_atom=True)
            case ("params", name):
                value = self.scope.params.get(name)
                return None if value is None else literal(value)
            case None:
                resolved = self.script.resolve(node)
                return None if resolved is node else literal(self.script.value(resolved))
            case _:
                return None

    def path(self, node: Any) -> tuple[str, ...] | None:
        """Return the path of a name below the parameters; None if it is no parameter."""
        names: list[str] = []
        node = unwrapped(node)
        while node.type == "member_expression":
            names.insert(0, self.script.text(node.child_by_field_name("property")))
            node = unwrapped(node.child_by_field_name("object"))
        if node.type != "identifier" or self.script.text(node) not in self.roles:
            return None
        return (*self.roles[self.script.text(node)], *names)

    def _unary(self, node: Any, depth: int) -> Typed | None:
        inner = node.child_by_field_name("argument")
        match self.script.text(node.child_by_field_name("operator")):
            case "!":
                found = self.condition(inner, depth + 1)
                return None if found is None else Typed(f"not {found.operand}", BOOL)
            case "-":
                found = self.expression(inner, INT, depth + 1)
                if found is not None and found.type in NUMBERS:
                    return Typed(f"-{found.operand}", found.type)
        return None

    def _binary(self, node: Any, expected: str | None, depth: int) -> Typed | None:
        left, right = node.child_by_field_name("left"), node.child_by_field_name("right")
        sign = self.script.text(node.child_by_field_name("operator"))
        if sign in ("&&", "||"):
            first, second = self.condition(left, depth + 1), self.condition(right, depth + 1)
            if expected != BOOL or first is None or second is None:
                return None
            word = "and" if sign == "&&" else "or"
            return Typed(f"{first.operand} {word} {second.operand}", BOOL)
        first, second = self._operands(left, right, depth)
        if first is None or second is None:
            return None
        if sign in EQUALITIES:
            is_like = first.type == second.type or {first.type, second.type} <= set(NUMBERS)
            text = f"{first.operand} {EQUALITIES[sign]} {second.operand}"
            return Typed(text, BOOL) if is_like else None
        if not {first.type, second.type} <= set(NUMBERS):
            return None
        if sign in COMPARISONS:
            return Typed(f"{first.operand} {sign} {second.operand}", BOOL)
        kind = FLOAT if FLOAT in (first.type, second.type) else INT
        is_safe = second.is_atom and second.text.isdigit() and int(second.text) != 0
        if sign in "+-*" or (sign == "/" and kind == FLOAT and is_safe):
            return Typed(f"{first.operand} {sign} {second.operand}", kind)
        if sign == "%" and kind == INT and is_safe:
            return Typed(f"{first.operand} % {second.text}", INT)
        return None

    def _operands(self, left: Any, right: Any, depth: int) -> tuple[Typed | None, Typed | None]:
        """Return both operands; that without fields of the event decides the type of the other."""
        own = self.path(left)
        if own is not None and own[:1] == ("event",):
            second = self.expression(right, None, depth + 1)
            return self.expression(left, second.type if second else None, depth + 1), second
        first = self.expression(left, None, depth + 1)
        return first, self.expression(right, first.type if first else None, depth + 1)

    def _conditional(self, node: Any, expected: str | None, depth: int) -> Typed | None:
        test = self.condition(node.child_by_field_name("condition"), depth + 1)
        one = self.expression(node.child_by_field_name("consequence"), expected, depth + 1)
        other = self.expression(node.child_by_field_name("alternative"), expected, depth + 1)
        if test is None or one is None or other is None or one.type != other.type:
            return None
        return Typed(f"{one.operand} if {test.operand} else {other.operand}", one.type)

    def _call(self, node: Any, depth: int) -> Typed | None:
        name = FUNCTIONS_OF_MATH.get(self.script.text(node.child_by_field_name("function")))
        given = list(arguments(node.child_by_field_name("arguments")))
        found = [self.expression(each, INT, depth + 1) for each in given]
        values = [each for each in found if each is not None and each.type in NUMBERS]
        count = 1 if name == "abs" else 2
        if name is None or len(values) != len(given) or len(values) != count:
            return None
        kind = FLOAT if any(each.type == FLOAT for each in values) else INT
        return Typed(f"{name}({', '.join(each.text for each in values)})", kind, is_atom=True)


def translate(code: Code, scope: Scope, expected: str | None) -> Typed | None:
    """Return the expression that a function returns, of a type if one is expected."""
    found = function_of(code.script, code.node)
    if found is None:
        return None
    fields = None if scope.fields is None else dict(scope.fields)
    translation = Translation(code.script, found[0], replace(scope, fields=fields))
    is_test = expected == BOOL
    value = (
        translation.condition(found[1]) if is_test else translation.expression(found[1], expected)
    )
    if value is not None and fields is not None and scope.fields is not None:
        scope.fields.update(fields)
    return value
