"""JavaScript and TypeScript as values: literals and constants are resolved, nothing is executed."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property
from itertools import accumulate
from typing import Any

from fsmkit.diagnostics import Source, Span, Text, fail
from fsmkit.foreign.xstate.values import (
    Array,
    Call,
    Code,
    Constant,
    Number,
    Record,
    String,
    Value,
    in_order,
)

LARGEST = 2_000_000
"""Characters of a program; longer ones are data, not machines."""
MOST_VALUES = 50_000
"""Values of one machine, after constants were inserted."""
DEEPEST = 100
"""Levels of nesting of values and of constants that name constants."""
WRAPPERS = frozenset(
    {
        "as_expression",
        "satisfies_expression",
        "non_null_expression",
        "parenthesized_expression",
        "type_assertion",
    }
)
ESCAPES = {"n": "\n", "t": "\t", "r": "\r", "b": "\b", "f": "\f", "v": "\v", "0": "\0"}
LITERALS = {"true": True, "false": False, "null": None, "undefined": None}
CREATORS = frozenset({"createMachine", "createStateMachine"})
SCOPES = frozenset({"statement_block", "program", "class_body", "switch_body"})


@dataclass(frozen=True, slots=True)
class Creation:
    """A call of ``createMachine``, the name of its variable, and the call of ``setup``."""

    name: Text | None
    node: Any
    setup: Any | None


@dataclass
class Script:
    """A program and its tree."""

    source: Source
    _budget: int = field(default=MOST_VALUES)

    # --- the tree -----------------------------------------------------------------------------

    @cached_property
    def root(self) -> Any:
        """The root of the syntax tree; `FsmkitError` without the packages that build it."""
        if len(self.source.text) > LARGEST:
            raise fail(
                "too-large",
                f"the program is longer than {LARGEST} characters",
                Span(self.source, 0, 1),
                help="keep the machine in a file of its own",
            )
        try:
            import tree_sitter_typescript
            from tree_sitter import Language, Parser
        except ImportError as error:
            raise fail(
                "missing-package",
                "machines of XState in JavaScript are read with the packages `tree-sitter` and "
                "`tree-sitter-typescript`",
                Span(self.source, 0, 1),
                help="install the extra: `pip install 'fsmkit[migrate]'`, or write the machine as "
                "JSON",
            ) from error
        is_jsx = self.source.name.lower().endswith(("x", ".js", ".mjs", ".cjs"))
        dialect = (
            tree_sitter_typescript.language_tsx()
            if is_jsx
            else tree_sitter_typescript.language_typescript()
        )
        return Parser(Language(dialect)).parse(self._encoded).root_node

    @cached_property
    def _encoded(self) -> bytes:
        return self.source.text.encode("utf-8", "replace")

    @cached_property
    def _characters(self) -> list[int] | None:
        """The offset in characters of each byte; None if they are equal."""
        if len(self._encoded) == len(self.source.text):
            return None
        sizes = (len(char.encode("utf-8", "replace")) for char in self.source.text)
        starts = list(accumulate(sizes, initial=0))
        found = [0] * (len(self._encoded) + 1)
        for number, start in enumerate(starts):
            found[start] = number
        return found

    def span(self, node: Any) -> Span:
        """Return the location of a node."""
        start, end = node.start_byte, node.end_byte
        if self._characters is not None:
            start, end = self._characters[start], self._characters[end]
        return Span(self.source, start, end)

    def text(self, node: Any) -> str:
        """Return the source text of a node."""
        span = self.span(node)
        return self.source.text[span.start : span.end]

    # --- machines -----------------------------------------------------------------------------

    def creations(self) -> tuple[Creation, ...]:
        """Return the calls of ``createMachine`` in the order of the file."""
        return tuple(self._creations())

    def _creations(self) -> Iterator[Creation]:
        for node in walk(self.root):
            if node.type != "call_expression":
                continue
            function = unwrapped(node.child_by_field_name("function"))
            if function.type == "identifier" and self.text(function) in CREATORS:
                yield Creation(self._variable(node), node, None)
            elif function.type == "member_expression":
                of = self.resolve(unwrapped(function.child_by_field_name("object")))
                name = function.child_by_field_name("property")
                if self.text(name) in CREATORS and self._is_setup(of):
                    yield Creation(self._variable(node), node, of)

    def _is_setup(self, node: Any) -> bool:
        function = node.child_by_field_name("function") if node.type == "call_expression" else None
        return function is not None and self.text(function) == "setup"

    def _variable(self, node: Any) -> Text | None:
        while (parent := node.parent) is not None:
            if parent.type == "variable_declarator":
                name = parent.child_by_field_name("name")
                is_plain = name is not None and name.type == "identifier"
                return Text(self.text(name), self.span(name)) if is_plain else None
            if parent.type not in WRAPPERS | {"call_expression", "member_expression"}:
                return None
            node = parent
        return None

    def arguments(self, node: Any) -> tuple[Value, ...]:
        """Return the arguments of a call."""
        found = node.child_by_field_name("arguments")
        self._budget = MOST_VALUES
        return tuple(self.value(each) for each in arguments(found))

    @cached_property
    def types(self) -> dict[str, Any]:
        """The types that the program declares, by name."""
        found: dict[str, Any] = {}
        for node in walk(self.root):
            if node.type in ("type_alias_declaration", "interface_declaration"):
                name = self.text(node.child_by_field_name("name"))
                body = node.child_by_field_name("value") or node.child_by_field_name("body")
                found.setdefault(name, body)
        return found

    def error_in(self, node: Any) -> Span | None:
        """Return the location of the first syntax error in a node, if there is one."""
        if not node.has_error:
            return None
        broken = (each for each in walk(node) if each.is_error or each.is_missing)
        return self.span(next(broken, node))

    # --- values -------------------------------------------------------------------------------

    def value(self, node: Any, depth: int = 0) -> Value:
        """Return the value of an expression, with constants of the file in their place."""
        self._budget -= 1
        node = unwrapped(node)
        span = self.span(node)
        if depth > DEEPEST:
            raise fail(
                "nested-too-deep",
                f"values are nested more than {DEEPEST} levels",
                span,
                help="simplify the configuration",
            )
        if self._budget < 0:
            raise fail(
                "too-large",
                f"the machine has more than {MOST_VALUES} values after its constants are inserted",
                span,
                help="divide the machine",
            )
        match node.type:
            case "string":
                return String(Text(self._string(node), span, ()))
            case "template_string" if all(c.type != "template_substitution" for c in node.children):
                return String(Text(self._string(node), span, ()))
            case "number":
                return self._number(node, span)
            case "true" | "false" | "null" | "undefined":
                return Constant(LITERALS[node.type], span)
            case "unary_expression" if self.text(node).startswith("-"):
                inner = self.value(node.child_by_field_name("argument"), depth + 1)
                if isinstance(inner, Number):
                    return Number(-inner.value, span)
            case "array":
                return Array(self._items(node, depth), span)
            case "object":
                return Record(self._fields(node, depth), span)
            case "call_expression":
                function = node.child_by_field_name("function")
                if function.type == "identifier":
                    given = arguments(node.child_by_field_name("arguments"))
                    found = tuple(self.value(each, depth + 1) for each in given)
                    return Call(self.text(function), found, Code(span, self, node))
            case "identifier" | "member_expression":
                found_node = self.resolve(node)
                if found_node is not node:
                    return self.value(found_node, depth + 1)
                if self.text(node) == "undefined":
                    return Constant(None, span)
        return Code(span, self, node)

    def _items(self, node: Any, depth: int) -> tuple[Value, ...]:
        found: list[Value] = []
        for child in arguments(node):
            if child.type == "spread_element":
                inner = self.value(child.named_children[0], depth + 1)
                if isinstance(inner, Array):
                    found.extend(inner.items)
                    continue
            found.append(self.value(child, depth + 1))
        return tuple(found)

    def _fields(self, node: Any, depth: int) -> tuple[tuple[Text, Value], ...]:
        found: list[tuple[Text, Value]] = []
        for child in arguments(node):
            match child.type:
                case "pair":
                    key = self._key(child.child_by_field_name("key"))
                    value = self.value(child.child_by_field_name("value"), depth + 1)
                    found.append((key, value))
                case "shorthand_property_identifier":
                    name = self.text(child)
                    declared = self._declared(name, child)
                    code = Code(self.span(child), self, child)
                    value = code if declared is None else self.value(declared, depth + 1)
                    found.append((Text(name, self.span(child)), value))
                case "spread_element":
                    inner = self.value(child.named_children[0], depth + 1)
                    if not isinstance(inner, Record):
                        raise self._computed(child, "the object that is spread here")
                    found.extend(inner.fields)
                case "method_definition":
                    key = self._key(child.child_by_field_name("name"))
                    found.append((key, Code(self.span(child), self, child)))
                case _:
                    raise self._computed(child, "this entry")
        return in_order(found)

    def _key(self, node: Any) -> Text:
        span = self.span(node)
        match node.type:
            case "string":
                return Text(self._string(node), span, ())
            case "number":
                number = self._number(node, span)
                if isinstance(number, Number):
                    return Text(f"{number.value:g}", span, ())
            case "computed_property_name":
                inner = self.value(node.named_children[0])
                match inner:
                    case String(text):
                        return Text(text.value, span, ())
                    case Number(value):
                        return Text(f"{value:g}", span, ())
                raise self._computed(node, "this key")
        return Text(self.text(node), span)

    def _computed(self, node: Any, what: str) -> Exception:
        return fail(
            "foreign-construct",
            f"{what} is computed when the program runs, or comes from another file",
            self.span(node),
            help="write a literal, or a `const` with a literal in this file",
        )

    def _string(self, node: Any) -> str:
        raw = self.text(node)[1:-1]
        return re.sub(r"\\(u\{([0-9a-fA-F]+)\}|u([0-9a-fA-F]{4})|x([0-9a-fA-F]{2})|.|\n)",
                      _unescaped, raw, flags=re.DOTALL)  # fmt: skip

    def _number(self, node: Any, span: Span) -> Value:
        raw = self.text(node).replace("_", "")
        try:
            return Number(int(raw, 0), span)
        except ValueError:
            pass
        try:
            value = float(raw)
        except ValueError:
            return Code(span, self, node)
        if value in (float("inf"), float("-inf")):
            return Code(span, self, node)
        return Number(int(value) if value.is_integer() and abs(value) < 2**53 else value, span)

    # --- names --------------------------------------------------------------------------------

    def resolve(self, node: Any, depth: int = 0) -> Any:
        """Return the initial value of a constant, or of a member of one; else the node itself."""
        if depth > DEEPEST:
            return node
        node = unwrapped(node)
        if node.type == "identifier":
            declared = self._declared(self.text(node), node)
            return node if declared is None else self.resolve(declared, depth + 1)
        if node.type == "member_expression":
            base = self.resolve(node.child_by_field_name("object"), depth + 1)
            name = self.text(node.child_by_field_name("property"))
            if base.type in ("object", "enum_body"):
                for child in base.named_children:
                    key = child.child_by_field_name("key") or child.child_by_field_name("name")
                    if key is not None and self._name(key) == name:
                        return self.resolve(child.child_by_field_name("value"), depth + 1)
        return node

    def _name(self, key: Any) -> str:
        return self._string(key) if key.type == "string" else self.text(key)

    def _declared(self, name: str, node: Any) -> Any | None:
        """Return the initial value of the constant of that name in the scopes around a node."""
        scope = node.parent
        while scope is not None:
            if scope.type in SCOPES:
                found = self._scopes.get(scope.id)
                if found is None:
                    found = self._scopes[scope.id] = dict(self._constants(scope))
                if name in found:
                    return found[name]
            if name in self._parameters(scope):
                return None
            scope = scope.parent
        return None

    @cached_property
    def _scopes(self) -> dict[int, dict[str, Any | None]]:
        return {}

    def _parameters(self, node: Any) -> frozenset[str]:
        parameters = node.child_by_field_name("parameters") if node.type in FUNCTIONS else None
        single = node.child_by_field_name("parameter") if node.type in FUNCTIONS else None
        return frozenset(
            self.text(each)
            for one in (parameters, single)
            if one is not None
            for each in walk(one)
            if each.type in ("identifier", "shorthand_property_identifier_pattern")
        )

    def _constants(self, scope: Any) -> Iterator[tuple[str, Any | None]]:
        for child in scope.named_children:
            node = child
            if node.type == "export_statement":
                node = child.child_by_field_name("declaration") or child
            if node.type == "enum_declaration":
                name, body = node.child_by_field_name("name"), node.child_by_field_name("body")
                yield self.text(name), body
            elif node.type == "function_declaration":
                yield self.text(node.child_by_field_name("name")), node
            elif node.type in ("lexical_declaration", "variable_declaration"):
                is_fixed = self.text(node).startswith("const")
                for each in node.named_children:
                    name = each.child_by_field_name("name") if each.type == DECLARATOR else None
                    if name is not None and name.type == "identifier":
                        value = each.child_by_field_name("value")
                        yield self.text(name), value if is_fixed else None


DECLARATOR = "variable_declarator"
FUNCTIONS = frozenset(
    {
        "arrow_function",
        "function_expression",
        "function_declaration",
        "method_definition",
        "generator_function_declaration",
    }
)


def walk(node: Any) -> Iterator[Any]:
    """Yield a node and all below it, in the order of the text, however deep they are."""
    waiting = [node]
    while waiting:
        found = waiting.pop()
        yield found
        waiting.extend(reversed(found.named_children))


def arguments(node: Any) -> Iterator[Any]:
    """Yield the named children of a node without its comments."""
    return (child for child in node.named_children if child.type != "comment")


def unwrapped(node: Any) -> Any:
    """Return the expression inside of brackets and of assertions of types."""
    while node.type in WRAPPERS and node.named_children:
        children = list(arguments(node))
        node = children[-1] if node.type == "type_assertion" else children[0]
    return node


def _unescaped(match: re.Match[str]) -> str:
    code = match[2] or match[3] or match[4]
    if code is not None:
        number = int(code, 16)
        is_text = number < 0x110000 and not 0xD800 <= number < 0xE000
        return chr(number) if is_text else "\N{REPLACEMENT CHARACTER}"
    return "" if match[1] == "\n" else ESCAPES.get(match[1], match[1])
