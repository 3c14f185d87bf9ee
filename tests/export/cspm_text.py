"""The subset of CSPm that is written: its tokens, and a parser that is strict in parentheses."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

from fsmkit.export.cspm.identifiers import RESERVED

TOKEN = re.compile(
    r"\s+|--[^\n]*|(?P<token>[A-Za-z]\w*'*|\d+|:\[[a-z ]+(?:\[FD?\])?\]|\[(?:T|FD)=|\[\[|\]\]"
    r"|\[\||\|\]|\[\]|\|\|\||\|\||\{\||\|\}|->|<-|\.\.|==|[{}()<>\[\]|,.:@\\&^=])"
)
KEYWORDS = set(RESERVED.split())
BINARY = {"[]", "[|", "|||", "\\", "->", "&", "==", "<", "^"}
Ast = tuple[Any, ...]


class NotOfSubset(Exception):  # noqa: N818  (no error of ours)
    """The text is not of the subset."""


def tokens(text: str) -> Iterator[str]:
    at = 0
    while at < len(text):
        match = TOKEN.match(text, at)
        if match is None:
            raise NotOfSubset(f"no token: {text[at : at + 40]!r}")
        at = match.end()
        if match["token"] is not None:
            yield match["token"]


@dataclass
class Script:
    """What is defined: channels (their fields), constructors, equations, assertions."""

    channels: dict[str, list[Ast]] = field(default_factory=dict)
    constructors: dict[str, list[str]] = field(default_factory=dict)
    equations: dict[str, list[tuple[list[Ast], Ast]]] = field(default_factory=dict)
    assertions: list[tuple[bool, str, Ast, Ast]] = field(default_factory=list)


class Parser:
    """Each operand is a name, a call or in parentheses: no precedence is relied on."""

    def __init__(self, text: str) -> None:
        self.tokens = list(tokens(text))
        self.at = 0
        self.script = Script()
        self.names: set[str] = set()

    def peek(self) -> str:
        return self.tokens[self.at] if self.at < len(self.tokens) else ""

    def next(self, wanted: str = "") -> str:
        token = self.peek()
        if wanted and token != wanted:
            raise NotOfSubset(
                f"{wanted} expected: {' '.join(self.tokens[self.at - 8 : self.at + 8])}"
            )
        self.at += 1
        return token

    def name(self, *, new: bool = False) -> str:
        token = self.next()
        if not re.fullmatch(r"[A-Za-z]\w*'*", token) or token in KEYWORDS:
            raise NotOfSubset(f"no name: {token}")
        if new:
            if token in self.names:
                raise NotOfSubset(f"defined twice: {token}")
            self.names.add(token)
        return token

    def parse(self) -> Script:
        last = ""
        while self.peek():
            if self.peek() == "channel":
                self.next()
                name = self.name(new=True)
                fields = []
                while self.peek() in (":", "."):
                    self.next()
                    fields.append(self.atom())
                self.script.channels[name] = fields
            elif self.peek() == "datatype":
                self.next()
                type_ = self.name(new=True)
                self.next("=")
                names = [self.name(new=True)]
                while self.peek() == "|":
                    self.next()
                    names.append(self.name(new=True))
                self.script.constructors[type_] = names
            elif self.peek() == "assert":
                self.assertion()
            else:
                last = self.equation(last)
        return self.script

    def equation(self, last: str) -> str:
        name = self.name()
        arguments = self.arguments() if self.peek() == "(" else []
        self.next("=")
        if name not in self.script.equations:
            if name in self.names:
                raise NotOfSubset(f"defined twice: {name}")
            self.names.add(name)
        elif last != name:
            raise NotOfSubset(f"the equations of {name} are not together")
        found = self.script.equations.setdefault(name, [])
        if found and found[0][0] == arguments:
            raise NotOfSubset(f"defined twice: {name}")
        found.append((arguments, self.expression()))
        return name

    def assertion(self) -> None:
        self.next()
        wanted = True
        if self.peek() == "not":
            self.next()
            wanted = False
        left = self.primary()
        kind = self.next()
        right: Ast = ("none",)
        if kind in ("[T=", "[FD="):
            right = self.primary()
        elif kind not in (":[divergence free [FD]]", ":[deadlock free [F]]"):
            raise NotOfSubset(kind)
        self.script.assertions.append((wanted, kind, left, right))

    def arguments(self) -> list[Ast]:
        self.next("(")
        found = [self.expression()]
        while self.peek() == ",":
            self.next()
            found.append(self.expression())
        self.next(")")
        return found

    def expression(self) -> Ast:
        token = self.peek()
        if token == "if":
            self.next()
            test = self.primary()
            self.next("then")
            yes = self.primary()
            self.next("else")
            return ("if", test, yes, self.primary())
        if token == "not":
            self.next()
            return ("not", self.primary())
        if token in ("[]", "||"):
            self.next()
            variable = self.name()
            self.next(":")
            over = self.primary()
            self.next("@")
            if token == "[]":
                return ("each", variable, over, self.primary())
            self.next("[")
            alphabet = self.expression()
            self.next("]")
            return ("parallel", variable, over, alphabet, self.primary())
        left = self.primary()
        operator = self.peek()
        if operator not in BINARY:
            return left
        if operator == "[|":
            self.next()
            shared = self.expression()
            self.next("|]")
            return ("share", left, shared, self.primary())
        self.next()
        found = (operator, left, self.primary())
        while operator == "[]" and self.peek() == "[]":
            self.next()
            found = ("[]", found, self.primary())
        if self.peek() in BINARY:
            raise NotOfSubset(f"parentheses: {' '.join(self.tokens[self.at - 8 : self.at + 8])}")
        return found

    def primary(self) -> Ast:
        found = self.atom()
        while self.peek() == ".":
            self.next()
            found = ("dot", found, self.atom())
        if self.peek() == "[[":
            self.next()
            pairs: list[tuple[Ast, Ast]] = []
            while not pairs or self.peek() == ",":
                if pairs:
                    self.next()
                old = self.primary()
                self.next("<-")
                pairs.append((old, self.primary()))
            self.next("]]")
            return ("rename", found, tuple(pairs))
        return found

    def atom(self) -> Ast:
        token = self.peek()
        if token == "(":
            self.next()
            found = self.expression()
            self.next(")")
            return found
        if token == "{|":
            return ("productions", *self.list_of("{|", "|}"))
        if token == "{":
            self.next()
            if self.peek() == "}":
                self.next()
                return ("set",)
            first = self.expression()
            if self.peek() == "..":
                self.next()
                last = self.expression()
                self.next("}")
                return ("range", first, last)
            rest = []
            while self.peek() == ",":
                self.next()
                rest.append(self.expression())
            self.next("}")
            return ("set", first, *rest)
        if token == "<":
            return ("sequence", *self.list_of("<", ">"))
        if token.isdigit():
            return ("number", int(self.next()))
        name = self.name()
        if self.peek() == "(":
            return ("call", name, *self.arguments())
        return ("name", name)

    def list_of(self, opening: str, closing: str) -> list[Ast]:
        self.next(opening)
        found: list[Ast] = []
        while self.peek() != closing:
            if found:
                self.next(",")
            found.append(self.primary())
        self.next(closing)
        return found
