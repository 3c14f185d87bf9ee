"""Binding of expressions: from `syntax.Node` to `tree.Expr`."""

# mypy: disable-error-code="func-returns-value"
# (`return context.report(...)` reports and returns None)

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial

from fsmkit.diagnostics import Edit, Fix, Span, Text
from fsmkit.diagnostics.fixes import replace_text
from fsmkit.diagnostics.suggestions import suggest
from fsmkit.language import syntax, tree, types
from fsmkit.language.arithmetic import exact
from fsmkit.language.binding.calls import bind_call
from fsmkit.language.binding.ecmascript import (
    WHOLE_PAYLOAD,
    bind_comparison,
    bind_relation,
    bind_system,
    bind_truth,
    event_as_value,
    join,
    truth,
)
from fsmkit.language.binding.literals import bind_array, bind_number
from fsmkit.language.durations import duration_of
from fsmkit.language.folding import fold
from fsmkit.language.names import Context, report_unknown
from fsmkit.language.operators import (
    BITS,
    EQUALITY,
    LOGIC,
    ORDER,
    describe_type,
    integers,
    type_binary,
    type_conditional,
    type_unary,
    with_span,
)
from fsmkit.language.units import MICROSECONDS

FOREIGN_OPERATORS = {
    ">>>": "shift with `>>`; unsigned machine integers bring in zeros",
    "**": "multiply",
    "//": "write `/`: the division of integers truncates",
    "typeof": "the types of all data are known when compiling",
    "new": "declare the data with its type",
    "void": "remove it",
    "instanceof": "the types of all data are known when compiling",
    "in": "compare with each value, or declare an operation",
    "++": "assign in the content of a transition: an expression changes nothing",
    "--": "assign in the content of a transition: an expression changes nothing",
}
EQUIVALENTS = {">>>": ">>", "//": "/"}
"""Operators of other languages, and the operator with the same meaning here."""
FOREIGN_NAMES = {
    "undefined": "every variable has a value from the start: compare with a value of its type",
    "null": "every variable has a value from the start: compare with a value of its type",
    "None": "every variable has a value from the start: compare with a value of its type",
    "this": "name the data itself",
    "NaN": "compare a float with itself: only NaN differs",
    "JSON": "declare an operation",
    "Date": "declare an operation or an input",
}


@dataclass(frozen=True, slots=True)
class ExpressionBinder:
    """Types the nodes of one expression; implements `fsmkit.language.binding.binder.Binder`."""

    context: Context
    text: Text

    def span(self, node: syntax.Node) -> Span:
        """Return the location of a node."""
        return self.text.span_of(node.start, node.end)

    def bind(self, node: syntax.Node, hint: types.Type | None) -> tree.Expr | None:
        """Type a node. ``hint`` is the expected type, which only a bare enumeration member uses."""
        match node:
            case syntax.NameNode():
                return self._name(node, hint)
            case syntax.NumberNode():
                return bind_number(self.context, node, self.span(node))
            case syntax.TruthNode():
                return tree.Literal(node.value, types.BOOL, self.span(node))
            case syntax.DurationNode():
                ticks = duration_of(self.context, node.written, self.span(node))
                return (
                    None if ticks is None else tree.Literal(ticks, types.DURATION, self.span(node))
                )
            case syntax.StringNode():
                return tree.Literal(node.value, types.SYMBOL, self.span(node))
            case syntax.SuperNode():
                return self._super(node)
            case syntax.ArrayNode():
                return bind_array(self, node, hint)
            case syntax.UnaryNode():
                return self._unary(node)
            case syntax.BinaryNode():
                return self._binary(node)
            case syntax.ConditionalNode():
                test = bind_truth(self, node.test, types.BOOL)
                then, otherwise = self._pair(node.then, node.otherwise, hint)
                if test is None or then is None or otherwise is None:
                    return None
                if self.context.is_ecmascript:
                    test = truth(test)
                return type_conditional(self.context, test, then, otherwise, self.span(node))
            case syntax.ElementNode():
                return self._element(node)
            case syntax.MemberNode() if (path := self._copy_path(node)) is not None:
                return self._copy_member(path, node)
            case syntax.MemberNode():
                return self._member(node)
            case syntax.CallNode():
                return bind_call(self, node)
            case _:
                raise AssertionError(node)

    def value(self, node: syntax.Node, hint: types.Type | None = None) -> tree.Expr | None:
        """Type a node that must have a value."""
        expr = self.bind(node, hint)
        if expr is not None and expr.type is None:
            return self.context.report(
                "no-result",
                f"`{self.text.value[node.start : node.end]}` returns nothing",
                expr.span,
                "declare the result of the operation",
            )
        return expr

    def _name(self, node: syntax.NameNode, hint: types.Type | None) -> tree.Expr | None:
        scope, name, span = self.context.scope, node.name, self.span(node)
        if name in scope.variables:
            type_, storage = scope.variables[name]
            return tree.Variable(name, type_, storage, span)
        if name in scope.constants:
            known = None if name in scope.indices else name
            return replace(scope.constants[name], span=span, name=known)
        if isinstance(hint, types.EnumType) and name in hint.members:
            return tree.Literal(hint.number(name), hint, span)
        if name == "_event" and self.context.is_ecmascript:
            return event_as_value(self.context, span)
        if name in ("event", "_event"):
            advice = f"name a field: `{name}.field`"
            return self.context.report("type-mismatch", "an event is not a value", span, advice)
        system = bind_system(self, node) if self.context.is_ecmascript else None
        if system is not None:
            return system
        if name == "Infinity" and self.context.is_ecmascript:
            return tree.Literal(float("inf"), types.FLOAT64, span)
        if name in FOREIGN_NAMES:
            message = f"`{name}` is outside the language"
            return self.context.report("outside-language", message, span, FOREIGN_NAMES[name])
        return report_unknown(self.context, name, span, hint)

    def _copy_path(self, node: syntax.Node) -> str | None:
        """Return the dotted name of a possible part of a copy; None for other nodes."""
        scope = self.context.scope
        match node:
            case syntax.NameNode(name=name) if scope.copies and scope.is_copy(name):
                return name
            case syntax.MemberNode(base=base, name=name) if (
                path := self._copy_path(base)
            ) is not None:
                is_whole = path in scope.copies
                return None if is_whole else f"{path}.{name}"
            case syntax.ElementNode(base=base, index=index) if (
                path := self._copy_path(base)
            ) is not None:
                if path in scope.copies:
                    return None
                value = self.value(index)
                number = None if value is None else fold(value)
                return f"{path}.{number.value}" if isinstance(number, tree.Literal) else None
            case _:
                return None

    def _copy_member(self, path: str, node: syntax.Node) -> tree.Expr | None:
        """Type the variable or constant of a copy at a dotted name."""
        scope, span = self.context.scope, self.span(node)
        found = scope.copies.get(path)
        if found is not None:
            return with_span(found, span)
        known = tuple(scope.copies)
        otherwise = None
        if path in scope.states:
            otherwise = f"it is a state: test whether it is active: `In({path})`"
        advice = otherwise or suggest(
            path, known, "a chart reads only variables and constants of a copy"
        )
        return self.context.report("unknown-name", f"unknown name `{path}`", span, advice)

    def _super(self, node: syntax.SuperNode) -> tree.Expr | None:
        guard = self.context.scope.super_guard
        if guard is not None:
            return guard
        return self.context.report(
            "super-without-base",
            "there is no guard of a base chart here",
            self.span(node),
            "write `super` only in the guard of a transition that overrides an inherited one",
        )

    def _unary(self, node: syntax.UnaryNode) -> tree.Expr | None:
        if node.op in FOREIGN_OPERATORS:
            message = f"`{node.op}` is outside the language"
            advice = FOREIGN_OPERATORS[node.op]
            return self.context.report("outside-language", message, self.span(node), advice)
        twice = self.text.value[node.start : node.start + 2]
        is_step = twice in ("++", "--") and isinstance(node.operand, syntax.UnaryNode)
        if is_step and self.context.is_ecmascript:
            message = f"`{twice}` is outside the language"
            advice = FOREIGN_OPERATORS[twice]
            return self.context.report("outside-language", message, self.span(node), advice)
        operand = bind_truth(self, node.operand) if node.op == "!" else self.value(node.operand)
        if operand is None:
            return None
        if node.op == "!" and self.context.is_ecmascript:
            operand = truth(operand)
        if node.op != "+":
            return type_unary(self.context, tree.UnaryOp(node.op), operand, self.span(node))
        if isinstance(operand.type, types.IntType | types.FloatType):
            return with_span(operand, self.span(node))
        message = f"`+` does not apply to {describe_type(operand.type)}"
        return self.context.report("type-mismatch", message, self.span(node))

    def _pair(
        self, left: syntax.Node, right: syntax.Node, hint: types.Type | None
    ) -> tuple[tree.Expr | None, tree.Expr | None]:
        """Type two operands; each lends its type to a bare enumeration member in the other."""
        if isinstance(left, syntax.NameNode) and not isinstance(right, syntax.NameNode):
            second = self.value(right, hint)
            first = self.value(left, hint or (second.type if second is not None else None))
            return first, second
        if isinstance(left, syntax.NameNode) and hint is None and not self._is_known(left.name):
            second = self.value(right)
            return self.value(left, second.type if second is not None else None), second
        first = self.value(left, hint)
        return first, self.value(right, hint or (first.type if first is not None else None))

    def _is_known(self, name: str) -> bool:
        return name in self.context.scope.variables or name in self.context.scope.constants

    def _binary(self, node: syntax.BinaryNode) -> tree.Expr | None:
        span = self.span(node)
        if self.context.is_ecmascript:
            asked = bind_relation(self, node) or bind_comparison(self, node)
            if asked is not None:
                return asked
        if node.op in FOREIGN_OPERATORS:
            message = f"`{node.op}` is outside the language"
            at = self.text.span_of(node.op_start, node.op_end)
            advice = FOREIGN_OPERATORS[node.op]
            fixes = replace_text(at, EQUIVALENTS[node.op]) if node.op in EQUIVALENTS else ()
            return self.context.report("outside-language", message, at, advice, fixes=fixes)
        op = tree.BinaryOp(node.op)
        if op in EQUALITY or op in ORDER:
            if self._is_chained(node):
                return self.context.report(
                    "chained-comparison",
                    "a comparison of a comparison",
                    span,
                    "join two comparisons with `and`, or put parentheses",
                    fixes=self._join_comparisons(node),
                )
            left, right = self._pair(node.left, node.right, None)
        else:
            take = partial(bind_truth, self) if op in LOGIC else self.value
            left, right = take(node.left), take(node.right)
        if left is None or right is None:
            return None
        if self.context.is_ecmascript and op is tree.BinaryOp.ADD:
            joined = join(left, right, span)
            if joined is not None:
                return joined
        if self.context.is_ecmascript and op in LOGIC:
            left, right = truth(left), truth(right)
        if self.context.is_ecmascript and op in BITS:
            left = self._integer_quotient(node.left, left, right)
        return type_binary(self.context, op, left, right, span)

    def _integer_quotient(self, node: syntax.Node, left: tree.Expr, right: tree.Expr) -> tree.Expr:
        """Type ``a / b`` of ``(a / b) | 0`` as integer division."""
        if not isinstance(right, tree.Literal) or right.value != 0:
            return left
        return self.quotient(node) or left

    def quotient(self, node: syntax.Node) -> tree.Expr | None:
        """Type ``a / b`` of integers as truncating division; return None for other nodes."""
        if not isinstance(node, syntax.BinaryNode) or node.op != "/":
            return None
        a, b = self.value(node.left), self.value(node.right)
        if a is None or b is None:
            return None
        if not isinstance(a.type, types.IntType) or not isinstance(b.type, types.IntType):
            return None
        return integers(self.context, tree.BinaryOp.DIV, a, b, self.span(node))

    def _join_comparisons(self, node: syntax.BinaryNode) -> tuple[Fix, ...]:
        """Return the fix that writes ``a < b and b < c`` for ``a < b < c``."""
        if not isinstance(node.left, syntax.BinaryNode):
            return ()
        middle = self.text.value[node.left.right.start : node.left.right.end]
        at = self.text.span_of(node.left.end - 1, node.left.end).end
        edit = Edit(Span(self.text.span.source, at, at), f" and {middle}")
        return (Fix("Join two comparisons with `and`", (edit,)),)

    @staticmethod
    def _is_chained(node: syntax.BinaryNode) -> bool:
        """Return whether the node is ``a < b < c``, which C and Python read differently."""
        spellings = {op.value for op in (*EQUALITY, *ORDER)}
        return any(
            isinstance(side, syntax.BinaryNode)
            and side.op in spellings
            and side.left.start == side.start  # no bracket before it
            for side in (node.left, node.right)
        )

    def _element(self, node: syntax.ElementNode) -> tree.Expr | None:
        match node:
            case syntax.ElementNode(
                base=syntax.MemberNode(base=syntax.NameNode(name="_event"), name="data"),
                index=syntax.StringNode(value=name),
            ):
                return self._event_field(name, self.span(node), self.span(node.index))
        base, index = self.value(node.base), self.value(node.index)
        if base is None or index is None:
            return None
        if not isinstance(base, tree.Variable) or not isinstance(base.type, types.ArrayType):
            message = f"{describe_type(base.type)} has no elements"
            if isinstance(base.type, types.ArrayType):
                message = "only an array that is a variable has elements"
            advice = "declare an array: `uint8[4]`"
            return self.context.report("type-mismatch", message, base.span, advice)
        if not isinstance(index.type, types.IntType):
            message = f"an index must be a whole number, not {describe_type(index.type)}"
            return self.context.report("type-mismatch", message, index.span)
        length = base.type.length
        if index.type.hi < 0 or index.type.lo >= length:
            return self.context.report(
                "index-out-of-range",
                f"the index is never within 0..{length - 1}, the elements of `{base.name}`",
                index.span,
                f"keep it within 0..{length - 1}, or make the array longer",
            )
        return tree.Element(base, index, base.type.element, self.span(node))

    def _member(self, node: syntax.MemberNode) -> tree.Expr | None:
        name, span = node.name, self.span(node)
        at = self.text.span_of(node.name_start, node.name_start + len(name))
        system = bind_system(self, node) if self.context.is_ecmascript else None
        if system is not None:
            return system
        match node.base:
            case syntax.NameNode(name="event" | "_event") if not self._is_variable(node.base):
                return self._event_property(node, at)
            case syntax.MemberNode(base=syntax.NameNode(name="_event"), name="data"):
                return self._event_field(name, span, at)
            case syntax.NameNode(name=type_name) if not self._is_variable(node.base):
                type_ = self.context.scope.types.get(type_name)
                if isinstance(type_, types.EnumType):
                    if name in type_.members:
                        return tree.Literal(type_.number(name), type_, span)
                    advice = suggest(
                        name,
                        type_.members,
                        "its members are " + ", ".join(f"`{member}`" for member in type_.members),
                    )
                    message = f"`{type_name}` has no member `{name}`"
                    return self.context.report("unknown-name", message, at, advice)
        base = self.value(node.base)
        if base is None:
            return None
        if isinstance(base.type, types.RecordType):
            for field in base.type.fields:
                if field.name == name:
                    return tree.Member(base, name, field.type, span)
            names = [field.name for field in base.type.fields]
            message = f"`{base.type.name}` has no field `{name}`"
            known = "its fields are " + ", ".join(f"`{name}`" for name in names)
            return self.context.report("unknown-name", message, at, suggest(name, names, known))
        if isinstance(base.type, types.ArrayType) and name == "length":
            return tree.Literal(base.type.length, exact(base.type.length, base.type.length), span)
        message = f"{describe_type(base.type)} has no field `{name}`"
        advice = "declare a record type"
        if isinstance(base.type, types.FloatType) and name in MICROSECONDS:
            written = self.text.value[node.base.start : node.base.end].rstrip(".")
            advice = f"a unit follows its number: `{written}{name}`"
        return self.context.report("type-mismatch", message, at, advice)

    def _is_variable(self, node: syntax.NameNode) -> bool:
        return self._is_known(node.name)

    def _event_property(self, node: syntax.MemberNode, at: Span) -> tree.Expr | None:
        is_plain = isinstance(node.base, syntax.NameNode) and node.base.name == "event"
        fields = self.context.scope.event_fields
        if is_plain and (node.name != "name" or "name" in (fields or {})):
            return self._event_field(node.name, self.span(node), at)
        if node.name == "name":
            return tree.EventName(self.span(node))
        if node.name == WHOLE_PAYLOAD and WHOLE_PAYLOAD in (fields or {}):
            return self._event_field(node.name, self.span(node), at)
        advice = "read `_event.name`, or a field as in `_event.data.field`"
        message = f"`_event.{node.name}` is outside the language"
        return self.context.report("outside-language", message, self.span(node), advice)

    def _event_field(self, name: str, span: Span, at: Span) -> tree.Expr | None:
        fields = self.context.scope.event_fields
        if fields is None:
            return self.context.report(
                "no-event-at-hand",
                "there is no event here whose fields could be read",
                span,
                "read the payload in the transition that the event takes, and store it",
            )
        if name in fields:
            return tree.EventField(name, fields[name], span)
        known = "its fields are " + ", ".join(f"`{f}`" for f in fields)
        if not fields:
            known = f"declare it: `event({name} 0..100)` under `events`"
        message = f"the event has no field `{name}`"
        return self.context.report("unknown-name", message, at, suggest(name, fields, known))
