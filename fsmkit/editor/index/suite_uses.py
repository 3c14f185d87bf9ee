"""Find the names in a test file: events, inputs, operations and states of its charts."""

from __future__ import annotations

import re
from dataclasses import dataclass

from fsmkit.diagnostics import Text
from fsmkit.editor.index.chart_names import ChartNames
from fsmkit.editor.index.expressions import ExpressionReader
from fsmkit.editor.index.symbols import Symbol, SymbolKind, Uses
from fsmkit.editor.index.system_uses import (
    NAME,
    Scanner,
    SystemNames,
    any_event,
    entries,
    items,
    read_part,
    text_of,
    under,
)
from fsmkit.testing.reading import CALL, NAMED, RETURNS, split
from fsmkit.yaml.nodes import Node, Scalar

WORD = re.compile(r"[^\s,()]+")


def suite_uses(
    root: Node, scanner: Scanner, chart: ChartNames | None, system: SystemNames | None
) -> Uses:
    """Return the names in a test file of a chart or a system."""
    reader = _SuiteReader(scanner, chart, system)
    reader.steps(under(root, "before"))
    for _, case in entries(under(root, "cases")):
        reader.steps(under(case, "steps") if entries(case) else case)
    return scanner.uses


@dataclass(frozen=True, slots=True)
class _SuiteReader:
    scanner: Scanner
    chart: ChartNames | None
    system: SystemNames | None

    def steps(self, node: Node | None) -> None:
        for item in items(node):
            if isinstance(item, Scalar):
                for text in split(item.text, ";"):
                    self.step(text)
            else:
                for key, value in entries(under(item, "expect")):
                    for one in items(value):
                        self.expected(key.value, text_of(one))

    def step(self, text: Text) -> None:
        returns = RETURNS.fullmatch(text.value)
        if returns is not None and not text.value.startswith(("post ", "set ")):
            operation, chart = self.call(text.part(*returns.span("call")))
            for one in split(text.part(*returns.span("values")), ","):
                self.value(one, chart, operation)
            return
        word, _, rest = text.value.partition(" ")
        after = text.part(len(text.value) - len(rest), len(text.value)).strip()
        if word == "wait":
            return
        if word == "set":
            self.input(after)
        elif word == "start" and not rest and not self.has_event("start"):
            return
        else:
            self.event(after if word == "post" else text)

    def has_event(self, name: str) -> bool:
        return self.chart is not None and name in self.chart.events

    def of_machine(self, text: Text) -> tuple[ChartNames | None, Text]:
        """Return the chart that a name is of, and the name without its machine."""
        if self.chart is not None or self.system is None:
            return self.chart, text
        match = re.match(rf"({NAME}(?:\[[^\]]*\])?)\.", text.value)
        machine = None if match is None else self.scanner.machine(text.part(*match.span(1)))
        if match is None or machine is None:
            return None, text
        return machine.names, text.part(match.end(), len(text.value))

    def event(self, text: Text) -> None:
        chart, line = self.of_machine(text)
        match = WORD.match(line.value)
        if match is None or chart is None:
            return
        name = line.part(*match.span())
        symbol = any_event(chart, name.value)
        self.report(name, symbol)
        self.values(line, match.end(), chart, symbol)

    def values(self, line: Text, at: int, chart: ChartNames, symbol: Symbol | None) -> None:
        """Report the values after an event, by position or as ``name=value``."""
        fields = [] if symbol is None else [*chart.fields.get(symbol, {}).values()]
        place = 0
        for match in re.finditer(r"[^\s,()=]+(?:\s*=(?!=))?", line.value[at:]):
            start = at + match.start()
            word = match[0].rstrip("= \t")
            known = [f for f in fields if f.name == word]
            if known and match[0].endswith("="):
                self.scanner.use(line.part(start, start + len(word)), known[0])
                place = fields.index(known[0])
                continue
            self.value(
                line.part(start, start + len(word)),
                chart,
                fields[place] if place < len(fields) else None,
            )
            place += 1

    def input(self, text: Text) -> None:
        chart, line = self.of_machine(text)
        match = re.match(NAME, line.value)
        if match is None or chart is None:
            return
        symbol = chart.values.get(match[0])
        self.report(line.part(*match.span()), symbol)
        self.value(line.part(match.end(), len(line.value)).strip(), chart, symbol)

    def value(self, text: Text, chart: ChartNames | None, symbol: Symbol | None) -> None:
        """Report the names in a value of the type of `symbol`."""
        if chart is None:
            return
        reader = ExpressionReader(chart, self.scanner.found.append)
        hint = reader.hint_of_symbol(symbol)
        reader.read(text.strip(), hint)

    def call(self, text: Text) -> tuple[Symbol | None, ChartNames | None]:
        """Report a call of an operation, or an event that is sent, with its arguments."""
        chart, line = self.of_machine(text)
        match = CALL.fullmatch(line.value)
        if match is None or chart is None:
            return None, chart
        name = line.part(*match.span("name"))
        symbol = chart.values.get(name.value)
        if symbol is None or symbol.kind is not SymbolKind.OPERATION:
            symbol = any_event(chart, name.value)
        self.report(name, symbol)
        if match["arguments"] is not None and symbol is not None:
            self.arguments(line.part(*match.span("arguments")), chart, symbol)
        return symbol, chart

    def arguments(self, text: Text, chart: ChartNames, symbol: Symbol) -> None:
        fields = [*chart.fields.get(symbol, {}).values()]
        for place, one in enumerate(split(text, ",")):
            named = NAMED.fullmatch(one.value)
            known = [f for f in fields if named is not None and f.name == named["name"]]
            if named is not None and known:
                self.scanner.use(one.part(*named.span("name")), known[0])
                self.value(one.part(*named.span("value")), chart, known[0])
            elif one.value.strip() != "_":
                self.value(one, chart, fields[place] if place < len(fields) else None)

    def expected(self, key: str, text: Text | None) -> None:
        if text is None:
            return
        if key in ("in", "not in"):
            chart, name = self.of_machine(text)
            if chart is not None:
                self.scanner.state(name, chart)
        elif key in ("called", "not called", "sent", "not sent"):
            self.call(text)
        elif key == "that" and self.chart is not None:
            ExpressionReader(self.chart, self.scanner.found.append).read(text)
        elif key == "that":
            self.scanner.read(text, read_part)

    def report(self, name: Text, symbol: Symbol | None) -> None:
        if symbol is None:
            self.scanner.unknown(name)
        else:
            self.scanner.use(name, symbol)
