"""The textual language of itemis CREATE: tokens, declarations, reactions, expressions.

Expressions become text of the action language. Where itemis assigns within an expression, the
assignment becomes a statement before the one that uses the value; operands that are evaluated
before it are saved in `let`.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from fsmkit.diagnostics import Findings, Text
from fsmkit.foreign.imports import reject

TOKEN = re.compile(
    r"""(?P<space>\s+|//[^\n]*|/\*.*?\*/)
      | (?P<string>"(?:\\.|[^"\\])*"|'(?:\\.|[^'\\])*')
      | (?P<number>0[xX][0-9a-fA-F]+|0[bB][01]+|\d+\.\d+(?:e[-+]\d+)?[dDfF]?|\d+)
      | (?P<name>\^?[A-Za-z_]\w*)
      | (?P<sign><<=|>>=|\+\+|--|&&|\|\||[-+*/%&|^<>=!]=|<<|>>|\.\.\.|\S)
    """,
    re.VERBOSE | re.DOTALL,
)
LONGEST = 1 << 16
DEEPEST = 30
"""Nested brackets and operators of an expression."""
LEVELS = (("|",), ("^",), ("&",), ("<", "<=", ">", ">=", "==", "!="), ("<<", ">>"), ("+", "-"),
          ("*", "/", "%"))  # fmt: skip
"""Binary operators, the weakest first; `!` applies to all of them, and `&&` and `||` are weaker."""
ASSIGNING = ("=", "*=", "/=", "%=", "+=", "-=", "<<=", ">>=", "&=", "^=", "|=")
TYPES = {"integer": "int32", "boolean": "bool", "real": "float64", "string": "symbol"}
"""Types, with those of charts: `sc_integer` and `sc_real` of generated C are the same."""
UNITS = {"s": 1_000_000_000, "ms": 1_000_000, "us": 1_000, "ns": 1}


class SyntaxFault(Exception):  # noqa: N818
    """A text that cannot be read; ``is_syntax`` is False for a construct without a chart form."""

    def __init__(self, message: str, at: int, fix: str = "", *, is_syntax: bool = True) -> None:
        """Keep the message and the number of the token."""
        super().__init__(message)
        self.at, self.fix, self.is_syntax = at, fix, is_syntax


@dataclass(frozen=True, slots=True)
class Token:
    """A token and its range in the text."""

    kind: str
    text: str
    start: int
    end: int


def tokens(text: Text) -> list[Token]:
    """Return the tokens of a text without blanks and comments, and an end token."""
    found, value = [], text.value[:LONGEST]
    for match in TOKEN.finditer(value):
        if match.lastgroup != "space":
            kind = match.lastgroup or "sign"
            word = match[kind].removeprefix("^") if kind == "name" else match[kind]
            found.append(Token(kind, word, match.start(), match.end()))
    return [*found, Token("end", "the end", len(value), len(value))]


@dataclass(frozen=True, slots=True)
class Symbol:
    """A declaration: in, out, local, var, const, operation or alias; its name in the chart."""

    kind: str
    name: str
    type: str
    at: Text


@dataclass(frozen=True, slots=True)
class Code:
    """An expression: statements to do before, and its text in the action language."""

    text: str
    before: tuple[str, ...] = ()
    reads: frozenset[str] = frozenset()
    writes: frozenset[str] = frozenset()
    calls: bool = False

    @property
    def is_pure(self) -> bool:
        """Return whether the expression can be a guard, which may be evaluated several times."""
        return not self.before and not self.calls


@dataclass(frozen=True, slots=True)
class Timer:
    """``after`` or ``every``: its delay in nanoseconds."""

    word: str
    delay: int


@dataclass(frozen=True, slots=True)
class Reaction:
    """A reaction as read. ``triggers`` are names of events, timers, or built-in words."""

    triggers: tuple[Timer | Symbol | str, ...]
    guard: Code | None
    actions: tuple[str, ...]
    at: Text
    entry_points: tuple[str, ...] = ()
    exit_points: tuple[str, ...] = ()
    is_default: bool = False

    @property
    def has_trigger(self) -> bool:
        """Return whether a trigger or a guard is given."""
        return bool(self.triggers) or self.guard is not None or self.is_default


@dataclass
class Scope:
    """The context of expressions: declarations by name, and functions that print statements."""

    symbols: Mapping[str, Symbol]
    active: Callable[[str], str | None]
    """Returns the id of the state of a path."""
    raised: Callable[[Symbol, str | None], tuple[str, ...]]
    """Returns the statements that raise an event with a value."""
    temporary: Callable[[], str]
    used: set[str] = field(default_factory=set)
    """The names of the events that expressions and triggers read."""


@dataclass
class Parser:
    """Reads one text."""

    text: Text
    scope: Scope
    at: int = 0
    depth: int = 0
    found: list[Token] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.found = tokens(self.text)

    # --- tokens -----------------------------------------------------------------------------------

    @property
    def token(self) -> Token:
        """Return the current token."""
        return self.found[self.at]

    def take(self, *words: str) -> str | None:
        """Return the text of the current token and go on, if it is one of the words."""
        if self.token.kind in ("string", "end") or self.token.text not in words:
            return None
        self.at += 1
        return self.found[self.at - 1].text

    def need(self, word: str) -> None:
        """Go past a token, or raise a fault."""
        if self.take(word) is None:
            raise SyntaxFault(f"`{word}` is missing before `{self.token.text}`", self.at)

    def name(self) -> str:
        """Return a name and go on."""
        if self.token.kind != "name":
            raise SyntaxFault(f"a name is missing before `{self.token.text}`", self.at)
        self.at += 1
        return self.found[self.at - 1].text

    def path(self) -> str:
        """Return names joined by dots."""
        names = [self.name()]
        while self.take("."):
            names.append(self.name())
        return ".".join(names)

    def place(self, start: int) -> Text:
        """Return the text from a token to the current one."""
        last = max(start, self.at - 1)
        return self.text.part(self.found[start].start, self.found[last].end)

    # --- reactions --------------------------------------------------------------------------------

    def reactions(self) -> list[Reaction]:
        """Return the reactions of a state, up to the end or to a declaration."""
        found = []
        while self.token.kind != "end":
            found.append(self.reaction())
        return found

    def reaction(self) -> Reaction:
        """Return a reaction of a state: ``trigger [guard] / actions``."""
        start = self.at
        triggers, guard, _ = self._trigger()
        self.need("/")
        return Reaction(triggers, guard, self._actions(), self.place(start))

    def transition(self) -> Reaction:
        """Return the reaction of a transition, of which every part may be absent."""
        start = self.at
        triggers, guard, is_default = self._trigger()
        actions = self._actions() if self.take("/") else ()
        entries, exits = [], []
        if self.take("#"):
            while self.token.kind != "end":
                if self.take(">"):
                    entries.append(self.name())
                else:
                    exits.append(self.name())
                    self.need(">")
        if self.token.kind != "end":
            raise SyntaxFault(f"`{self.token.text}` is not expected", self.at)
        return Reaction(triggers, guard, actions, self.place(start), tuple(entries), tuple(exits),
                        is_default)  # fmt: skip

    def _trigger(self) -> tuple[tuple[Timer | Symbol | str, ...], Code | None, bool]:
        if self.take("default", "else"):
            return (), None, True
        triggers: list[Timer | Symbol | str] = []
        while self.token.kind == "name":
            triggers.append(self._event())
            if not self.take(","):
                break
        guard = None
        if self.take("["):
            guard = self.expression()
            self.need("]")
        return tuple(triggers), guard, False

    def _event(self) -> Timer | Symbol | str:
        word = self.take("entry", "exit", "always", "oncycle")
        if word:
            return "always" if word == "oncycle" else word
        timer = self.take("after", "every")
        if timer:
            at, value = self.at, self.expression()
            unit = self.take(*UNITS)
            number = value.text.strip("()")
            if not number.isdigit():
                raise SyntaxFault("this delay is not a constant", at,
                                  "write the number", is_syntax=False)  # fmt: skip
            return Timer(timer, int(number) * UNITS[unit or "ms"])
        at = self.at
        return self._used(self._symbol(at, self.path()))

    def _actions(self) -> tuple[str, ...]:
        found: list[str] = []
        while True:
            found += self._action()
            if not self.take(";"):
                return tuple(found)

    def _action(self) -> tuple[str, ...]:
        at = self.at
        if self.take("raise"):
            event = self._symbol(self.at, self.path())
            if event.kind not in ("in", "out", "local"):
                raise SyntaxFault(f"`{event.name}` is not an event", at)
            value = self.expression() if self.take(":") else None
            if value is None:
                return self.scope.raised(event, None)
            return (*value.before, *self.scope.raised(event, value.text))
        value = self.expression()
        return (*value.before, value.text) if value.text.endswith(")") and value.calls and (
            re.fullmatch(r"\w+\(.*\)", value.text, re.DOTALL)
        ) else value.before  # fmt: skip

    # --- expressions ------------------------------------------------------------------------------

    def expression(self) -> Code:
        """Return an expression; an assignment is one, too."""
        self.depth += 1
        if self.depth > DEEPEST:
            raise SyntaxFault("the expression is too deeply nested", self.at)
        start, left = self.at, self._conditional()
        while operator := self.take(*ASSIGNING):
            target = self._variable(start)
            value = self._conditional()
            text = unbracketed(value.text)
            before = (*value.before, f"{target} {operator} {text}")
            if operator not in ("=", "+=", "-=", "*=", "/=", "%="):
                before = (*value.before, f"{target} = {target} {operator[:-1]} ({text})")
            left = Code(target, before, frozenset({target}), value.writes | {target}, value.calls)
        self.depth -= 1
        return left

    def _variable(self, start: int) -> str:
        name = "".join(one.text for one in self.found[start : self.at - 1])
        found = self.scope.symbols.get(name.strip("()"))
        if found is None or found.kind != "var":
            raise SyntaxFault(f"`{name}` is not a variable", start)
        return found.name

    def _conditional(self) -> Code:
        test = self._logical("||")
        if not self.take("?"):
            return test
        yes = self._logical("||")
        self.need(":")
        no = self._logical("||")
        if yes.before or no.before:
            raise SyntaxFault("an assignment within `? :` is not read", self.at,
                              "assign before the expression", is_syntax=False)  # fmt: skip
        reads, calls = test.reads | yes.reads | no.reads, test.calls or yes.calls or no.calls
        text = f"({test.text} ? {yes.text} : {no.text})"
        return Code(text, test.before, reads, test.writes, calls)

    def _logical(self, operator: str) -> Code:
        def operand() -> Code:
            return self._logical("&&") if operator == "||" else self._not()

        left = operand()
        while self.take(operator):
            right = operand()
            if not right.before:
                left = self._joined(left, operator, right)
                continue
            name, sign = self.scope.temporary(), "" if operator == "&&" else "!"
            inner = "; ".join((*right.before, f"{name} = {unbracketed(right.text)}"))
            before = (*left.before, f"var {name} bool = {unbracketed(left.text)}",
                      f"if {sign}{name} {{ {inner} }}")  # fmt: skip
            left = Code(name, before, frozenset(), left.writes | right.writes,
                        left.calls or right.calls)  # fmt: skip
        return left

    def _not(self) -> Code:
        if self.take("!"):
            value = self._binary(0)
            return Code(f"!{_bracketed(value.text)}", value.before, value.reads, value.writes,
                        value.calls)  # fmt: skip
        return self._binary(0)

    def _binary(self, level: int) -> Code:
        if level == len(LEVELS):
            return self._unary()
        left = self._binary(level + 1)
        while operator := self.take(*LEVELS[level]):
            left = self._joined(left, operator, self._binary(level + 1))
        return left

    def _joined(self, left: Code, operator: str, right: Code) -> Code:
        before, text = left.before, left.text
        if right.before and (left.reads & right.writes or left.calls):
            name = self.scope.temporary()
            before, text = (*before, f"let {name} = {unbracketed(text)}"), name
        return Code(
            f"({text} {operator} {right.text})", before + right.before, left.reads | right.reads,
            left.writes | right.writes, left.calls or right.calls,
        )  # fmt: skip

    def _unary(self) -> Code:
        sign = self.take("-", "+", "~")
        start, value = self.at, self._primary()
        while step := self.take("++", "--"):
            target, name = self._variable(start), self.scope.temporary()
            before = (f"let {name} = {target}", f"{target} {step[0]}= 1")
            value = Code(name, before, frozenset(), frozenset({target}))
        if sign in ("-", "~"):
            value = Code(f"({sign}{_bracketed(value.text)})", value.before, value.reads,
                         value.writes, value.calls)  # fmt: skip
        if self.token.text == "as" and self.token.kind == "name":
            raise SyntaxFault("a cast with `as` is not read", self.at,
                              "assign to a variable of the type", is_syntax=False)  # fmt: skip
        return value

    def _primary(self) -> Code:
        token, at = self.token, self.at
        self.at += 1
        if token.kind == "number":
            return Code(_number(token.text))
        if token.kind == "string":
            return Code(_string(token.text))
        if token.text == "(":
            inner = self.expression()
            self.need(")")
            return inner
        if token.kind != "name":
            raise SyntaxFault(f"an expression is missing before `{token.text}`", at)
        match token.text:
            case "true" | "yes":
                return Code("true")
            case "false" | "no":
                return Code("false")
            case "null":
                raise SyntaxFault("`null` has no counterpart", at, "compare with a value",
                                  is_syntax=False)  # fmt: skip
            case "valueof" if self.take("("):
                event = self._used(self._symbol(self.at, self.path()))
                self.need(")")
                return Code(f"{event.name}_value", reads=frozenset({f"{event.name}_value"}))
            case "active" if self.take("("):
                path = self.path()
                self.need(")")
                state = self.scope.active(path)
                if state is None:
                    raise SyntaxFault(f"there is no state `{path}`", at)
                return Code(f"In({state})")
        self.at = at
        return self._reference(at, self.path())

    def _reference(self, at: int, path: str) -> Code:
        symbol = self._symbol(at, path)
        if self.token.text == "[" and self.token.start == self.found[self.at - 1].end:
            raise SyntaxFault("arrays are not read", self.at, "declare a variable for each element",
                              is_syntax=False)  # fmt: skip
        if symbol.kind in ("in", "out", "local"):
            self._used(symbol)
            return Code(f"{symbol.name}_now", reads=frozenset({f"{symbol.name}_now"}))
        if symbol.kind != "operation":
            return Code(symbol.name, reads=frozenset({symbol.name}))
        given: list[Code] = []
        if self.take("(") and not self.take(")"):
            given.append(self.expression())
            while self.take(","):
                given.append(self.expression())
            self.need(")")
        if any(one.before for one in given[1:]):
            raise SyntaxFault("an assignment within an argument is not read", at,
                              "assign before the call", is_syntax=False)  # fmt: skip
        return Code(
            f"{symbol.name}({', '.join(unbracketed(one.text) for one in given)})",
            given[0].before if given else (), frozenset().union(*(one.reads for one in given)),
            frozenset().union(*(one.writes for one in given)), calls=True,
        )  # fmt: skip

    def _symbol(self, at: int, path: str) -> Symbol:
        found = self.scope.symbols.get(path)
        if found is None:
            raise SyntaxFault(f"`{path}` is not declared", at)
        return found

    def _used(self, event: Symbol) -> Symbol:
        if event.kind not in ("in", "out", "local"):
            raise SyntaxFault(f"`{event.name}` is not an event", max(0, self.at - 1))
        self.scope.used.add(event.name)
        return event


def report(fault: SyntaxFault, parser: Parser, findings: Findings) -> None:
    """Report the text that a parser could not read."""
    token = parser.found[min(fault.at, len(parser.found) - 1)]
    at = parser.text.part(token.start, max(token.end, token.start + 1))
    if fault.is_syntax:
        findings.add("foreign-syntax", str(fault), at, help="check the text in itemis CREATE")
    else:
        reject(findings, str(fault), at, fault.fix)


def unbracketed(text: str) -> str:
    """Return an expression without the pair of brackets around it."""
    if not text.startswith("(") or not text.endswith(")"):
        return text
    depth = 0
    for place, sign in enumerate(text):
        depth += (sign == "(") - (sign == ")")
        if not depth:
            return text[1:-1] if place == len(text) - 1 and '"' not in text else text
    return text


def _bracketed(text: str) -> str:
    return text if re.fullmatch(r"\w+|\(.*\)|\w+\([^()]*\)", text) else f"({text})"


def _number(text: str) -> str:
    if "." in text:
        return text.rstrip("dDfF")
    lowered = text.lower()
    return text if lowered.startswith("0x") else str(int(lowered, 0 if "b" in lowered else 10))


def _string(text: str) -> str:
    inner = re.sub(r"\\(.)", r"\1", text[1:-1])
    return '"' + inner.replace("\\", "\\\\").replace('"', '\\"') + '"'
