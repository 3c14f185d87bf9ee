"""Find the names in a binding to existing C: declarations of the chart, and C parameters."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path

from fsmkit.diagnostics import Text
from fsmkit.editor.index.chart_names import ChartNames
from fsmkit.editor.index.symbols import Symbol, SymbolKind, Uses
from fsmkit.editor.index.system_uses import Scanner, SystemNames, entries, items, scalars, text_of
from fsmkit.editor.index.system_uses import under as of_key
from fsmkit.yaml.nodes import Node

PARAMETER = re.compile(r"(?<![\w.])(?<!->)[A-Za-z_]\w*")
"""A word of C that is not a member."""
VALUES = ("constants", "inputs", "outputs", "operations")
SPACES = {
    "state": "states",
    "event": "events",
    **dict.fromkeys(("type", "operation", "data", "input", "output", "constant"), "values"),
}
"""The lookup of each kind in `names`."""


def binding_uses(path: Path, root: Node, chart: ChartNames | None) -> Uses:
    """Return the names of its chart that a binding uses."""
    scanner = Scanner(path, SystemNames(path))
    if chart is None:
        return scanner.uses
    for key in VALUES:
        for name, value in entries(of_key(root, key)):
            _name(name, chart.values.get(name.value), scanner)
            _parameters(value, chart, chart.values.get(name.value), scanner)
    for name, value in entries(of_key(root, "sends")):
        _name(name, chart.events.get(name.value), scanner)
        _parameters(value, chart, chart.events.get(name.value), scanner)
    for name, value in entries(of_key(root, "types")):
        symbol = chart.values.get(name.value)
        _name(name, symbol, scanner)
        _parts(of_key(value, "members"), chart.members.get(name.value, {}), scanner)
        fields = {} if symbol is None else chart.fields.get(symbol, {})
        _parts(of_key(value, "fields"), fields, scanner)
    for item in items(of_key(root, "exports")):
        text = text_of(item)
        if text is not None:
            _name(text, chart.values.get(text.value), scanner)
    for name, _ in entries(of_key(root, "names")):
        _named(name, chart, scanner)
    return scanner.uses


def _name(text: Text, symbol: Symbol | None, scanner: Scanner) -> None:
    if symbol is None:
        scanner.unknown(text)
    else:
        scanner.use(text, symbol)


def _parts(node: Node | None, known: Mapping[str, Symbol], scanner: Scanner) -> None:
    for name, _ in entries(node):
        _name(name, known.get(name.value), scanner)


def _parameters(node: Node, chart: ChartNames, owner: Symbol | None, scanner: Scanner) -> None:
    """Report the parameters of an operation, or the fields of an event, in an expression of C."""
    known = {} if owner is None else chart.fields.get(owner, {})
    for text in scalars(node) if known else ():
        for match in PARAMETER.finditer(text.value):
            if match[0] in known:
                scanner.use(text.part(*match.span()), known[match[0]])


def _named(text: Text, chart: ChartNames, scanner: Scanner) -> None:
    """Report a key of `names`: a kind and a name, such as ``state idle``."""
    kind, space, name = text.value.partition(" ")
    if not space or kind not in SPACES:
        return
    at = text.part(len(kind) + 1, len(text.value)).strip()
    symbol = getattr(chart, SPACES[kind]).get(at.value)
    if isinstance(symbol, Symbol) and symbol.kind is not SymbolKind.CHART:
        scanner.use(at, symbol)
    del name
