"""The types of a generated module for TypeScript, in both directions of the host's interface."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from typing import assert_never

import fsmkit.language as lang
from fsmkit.chart.chart import Chart, Data, Event, Operation, every_operation
from fsmkit.codegen.javascript.expressions import Printer
from fsmkit.document.document import Direction
from fsmkit.emit import Emitter, Namer, printing
from fsmkit.emit.javascript import comment, quoted

GLOBALS = ("Machine", "Readonly", "Uint8Array")
"""The names that the declarations use."""
_WORDS = """
    any arguments as asserts async await bigint boolean break case catch class const continue
    debugger default delete do else enum eval export extends false finally for function if
    implements import in infer instanceof interface is keyof let never new null number object
    package private protected public readonly return static string super switch symbol this throw
    true try type typeof undefined unique unknown var void while with yield
"""
WORDS = frozenset(_WORDS.split())
"""Words of ECMAScript and TypeScript that cannot name types, parameters or tuple elements."""


@printing
def declarations_text(chart: Chart, name: str, runtime: str, *, saved: bool) -> str:
    """Return the declarations of a module, given its class name: equal for equal charts."""
    out = Emitter("  ")
    DeclarationPrinter(chart, out, name, saved=saved).print(runtime)
    return out.finish()


@dataclass(slots=True)
class DeclarationPrinter:
    """Prints the types of one chart."""

    chart: Chart
    out: Emitter
    name: str
    saved: bool
    namer: Namer = field(init=False)
    printer: Printer = field(default_factory=lambda: Printer({}))
    enums: dict[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        own = (self.name, *(f"{self.name}{part}" for part in ("Host", "Shape")))
        self.namer = Namer((*GLOBALS, *WORDS, *own))

    def print(self, runtime: str) -> None:
        """Print the declarations."""
        chart, out, name = self.chart, self.out, self.name
        out.line("// The types of " + comment(chart.name) + ", for TypeScript. Made by fsmkit.")
        out.line()
        out.line(f'import {{ Machine }} from "./{runtime}";')
        for type_ in chart.types:
            if isinstance(type_, lang.EnumType):
                self._enumeration(type_)
        out.line()
        out.line("/** What the host does for the machine. */")
        with out.block(f"export interface {name}Host {{"):
            for operation in every_operation(chart).values():
                out.line(self._operation(operation))
        out.line()
        with out.block(f"export interface {name}Shape {{"):
            with out.block("events: {", "};"):
                out.lines(self._received())
            out.line(f"sent: {self._sent()};")
            for place, variables in self._variables():
                with out.block(f"{place}: {{", "};"):
                    out.lines(f"{quoted(v.name)}: {self.type(v.type)};" for v in variables)
            states = (quoted(state.id) for state in chart.states[1:] if not state.is_history)
            out.line(f"state: {' | '.join(states)};")
        out.line()
        with out.block(f"export class {name} extends Machine<{name}Shape> {{"):
            out.line(f"constructor(host: {name}Host);")
            if self.saved:
                out.line("/** The machine as bytes, at a time in ticks, by default the last. */")
                out.line("save(now?: number): Uint8Array;")
                out.line("/** Go on from what was saved, at a time in ticks. */")
                out.line("restore(saved: Uint8Array, now?: number): void;")

    def _enumeration(self, type_: lang.EnumType) -> None:
        name = self.enums[str(type_)] = self.namer.name(type_.name, "_")
        pairs = zip(type_.numbers, type_.members, strict=True)
        members = ", ".join(f"{n} {comment(each)}" for n, each in pairs)
        self.out.line()
        self.out.line(f"/** {members.replace('*/', '* /')} */")
        self.out.line(f"export type {name} = {' | '.join(map(str, type_.numbers))};")

    def _variables(self) -> Iterator[tuple[str, tuple[Data, ...]]]:
        yield "data", self.chart.data
        yield "outputs", self.chart.outputs
        yield "inputs", self.chart.inputs

    def _operation(self, operation: Operation) -> str:
        passed = ", ".join(self._labelled(operation.parameters))
        result = "void" if operation.result is None else self.type(operation.result)
        return f"{quoted(operation.name)}({passed}): {result};"

    def _received(self) -> Iterator[str]:
        for event in self.chart.events:
            if Direction.IN in event.directions and event.invocation is None:
                yield f"{quoted(event.name)}: {self._payload(event)};"

    def _sent(self) -> str:
        found = [
            f"[event: {quoted(event.name)}, payload: {self._payload(event)}, peer: string | null]"
            for event in self.chart.events
            if Direction.OUT in event.directions
        ]
        return " | ".join(found) or "never[]"

    def _payload(self, event: Event) -> str:
        return f"[{', '.join(self._labelled(event.fields))}]"

    def _labelled(self, fields: Iterable[lang.Field]) -> Iterator[str]:
        """Yield fields as parameters or as elements of a tuple."""
        names = Namer(WORDS)
        return (f"{names.name(each.name, '_')}: {self.type(each.type)}" for each in fields)

    def type(self, type_: lang.Type) -> str:
        """Return a type in TypeScript."""
        match type_:
            case lang.BoolType():
                return "boolean"
            case lang.IntType():
                return "bigint" if self.printer.is_big(type_) else "number"
            case lang.FloatType() | lang.DurationType():
                return "number"
            case lang.EnumType():
                return self.enums.get(str(type_), "number")
            case lang.SymbolType():
                return "string"
            case lang.ArrayType(element):
                return f"readonly ({self.type(element)})[]"
            case lang.RecordType(_, fields):
                return f"readonly [{', '.join(self._labelled(fields))}]"
            case _:
                assert_never(type_)
