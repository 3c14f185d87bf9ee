"""The declarations of a statechart: annotations, interfaces, and reactions of the whole machine."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

from fsmkit.diagnostics import Findings, Text
from fsmkit.document.document import DocConstant, DocData, DocOperation
from fsmkit.emit.identifiers import Namer
from fsmkit.foreign.imports import reject
from fsmkit.foreign.itemis.text import (
    TYPES,
    Parser,
    Reaction,
    Scope,
    Symbol,
    SyntaxFault,
    report,
    unbracketed,
)
from fsmkit.foreign.words import RESERVED
from fsmkit.language.statements.tree import DocField

DEFAULTS = {"int32": "0", "bool": "false", "float64": "0.0", "symbol": '""'}
EVENTS = ("in", "out", "local")


@dataclass
class Declarations:
    """The declarations of a statechart."""

    symbols: dict[str, Symbol] = field(default_factory=dict)
    annotations: dict[str, Text] = field(default_factory=dict)
    data: list[DocData] = field(default_factory=list)
    constants: list[DocConstant] = field(default_factory=list)
    operations: list[DocOperation] = field(default_factory=list)
    reactions: list[Reaction] = field(default_factory=list)
    aliases: dict[str, str] = field(default_factory=dict)

    def type(self, name: str) -> str | None:
        """Return the type of a chart for a type of itemis; an empty one for ``void``."""
        return "" if name == "void" else TYPES.get(self.aliases.get(name, name))


def declared(text: Text, namer: Namer) -> Declarations:
    """Return the names that a text declares; their values and the reactions are read later."""
    found, scope = Declarations(), Scope({}, lambda _: None, lambda *_: (), lambda: "")
    parser, prefix = Parser(text, scope), ""
    parser.found.append(parser.found[-1])
    while parser.token.kind != "end":
        start, word = parser.at, parser.token.text
        after = parser.found[parser.at + 1]
        parser.at += 1
        if word == "@" and after.kind == "name":
            found.annotations[parser.path()] = parser.place(start)
        elif word == "interface" and after.text == ":":
            prefix = ""
        elif word == "interface" and after.kind == "name":
            prefix = f"{parser.name()}."
        elif word == "internal" and after.text == ":":
            prefix = ""
        elif word in ("var", "const", "event", "operation", "alias") and after.kind == "name":
            parser.take("readonly")
            if parser.token.kind != "name":
                parser.at -= 1
            at = parser.at
            name = parser.name()
            before = parser.found[start - 1].text if start else ""
            kind = word if word != "event" else before if before in ("in", "out") else "local"
            own = namer.name(f"{prefix}{name}".replace(".", "_"), f"_{word}")
            place = text.part(parser.found[at].start, parser.found[at].end)
            found.symbols[f"{prefix}{name}"] = Symbol(kind, own, "", place)
    for key, one in found.symbols.items():
        if one.kind in EVENTS:
            for suffix in ("now", "value"):
                if namer.name(f"{one.name}_{suffix}") != f"{one.name}_{suffix}":
                    free = namer.name(f"{one.name}_event")
                    found.symbols[key] = replace(one, name=free)
    return found


def read_declarations(
    text: Text, found: Declarations, scope: Scope, findings: Findings
) -> Declarations:
    """Read types, start values and reactions; a fault is reported, and ends the reading."""
    parser, prefix = Parser(text, scope), ""
    try:
        while parser.token.kind != "end":
            if parser.take("namespace"):
                parser.path()
            elif parser.take("@"):
                parser.path()
                if parser.take("("):
                    while not parser.take(")"):
                        parser.expression()
                        parser.take(",")
            elif parser.take("import"):
                raise SyntaxFault("imports are not read", parser.at - 1,
                                  "declare the names here", is_syntax=False)  # fmt: skip
            elif parser.take("interface", "internal"):
                named = parser.token.kind == "name"
                prefix = f"{parser.name()}." if named else ""
                parser.need(":")
            elif not _declaration(parser, prefix, found, findings):
                found.reactions.append(parser.reaction())
    except SyntaxFault as fault:
        report(fault, parser, findings)
    return found


def _declaration(parser: Parser, prefix: str, found: Declarations, findings: Findings) -> bool:
    at, word = parser.at, parser.token.text
    after = parser.found[min(at + 1, len(parser.found) - 1)]
    if word in ("in", "out") and after.text == "event":
        parser.at += 1
        word = "event"
    elif after.kind != "name" or word not in ("var", "const", "event", "operation", "alias"):
        return False
    parser.at += 1
    if parser.found[min(parser.at + 1, len(parser.found) - 1)].kind == "name":
        parser.take("readonly")
    name = parser.name()
    key = f"{prefix}{name}"
    symbol = found.symbols.get(key)
    if symbol is None:
        raise SyntaxFault(f"`{key}` cannot be read", at)
    parameters = _parameters(parser, found) if word == "operation" else ()
    type_ = _type(parser, found) if parser.take(":") else ""
    found.symbols[key] = symbol = replace(symbol, type=type_)
    own = symbol.at.with_value(symbol.name)
    match word:
        case "operation":
            result = own.with_value(type_) if type_ else None
            found.operations.append(DocOperation(own, parameters, result))
        case "alias":
            found.aliases[name] = next(old for old, new in TYPES.items() if new == type_)
        case "var" | "const":
            value_at, value = parser.at, DEFAULTS.get(type_, "0")
            if parser.take("="):
                code = parser.expression()
                variables = {one.name for one in found.symbols.values() if one.kind != "const"}
                if not code.is_pure or code.reads & variables:
                    reject(findings, f"the start value of `{key}` is not a constant",
                           parser.place(value_at), "assign it in an entry action")  # fmt: skip
                else:
                    value = unbracketed(code.text)
            if type_ == "float64" and value.lstrip("-").isdigit():
                value += ".0"
            written = own.with_value(value)
            if word == "const" and type_ != "symbol":
                found.constants.append(DocConstant(own, written))
            else:
                found.data.append(DocData(own, own.with_value(type_), written))
    return True


def _parameters(parser: Parser, found: Declarations) -> tuple[DocField, ...]:
    parser.need("(")
    namer, result = Namer(RESERVED), []
    while not parser.take(")"):
        at = parser.at
        name = parser.name()
        if parser.take("..."):
            raise SyntaxFault("a variable number of parameters is not read", at,
                              "declare an operation for each number", is_syntax=False)  # fmt: skip
        parser.need(":")
        type_ = _type(parser, found)
        place = parser.place(at)
        result.append(DocField(place.with_value(namer.name(name, "_parameter")),
                               place.with_value(type_)))  # fmt: skip
        parser.take(",")
    return tuple(result)


def _type(parser: Parser, found: Declarations) -> str:
    at, name = parser.at, parser.path()
    type_ = found.type(name)
    if type_ is None:
        raise SyntaxFault(f"the type `{name}` is not read", at,
                          "use integer, real, boolean or string", is_syntax=False)  # fmt: skip
    return type_
