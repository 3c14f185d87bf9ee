"""Complete keys, states, events, names of the expected type, and files."""

from __future__ import annotations

import os
import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

from lsprotocol import types

from fsmkit.diagnostics import Source
from fsmkit.editor.context import Context
from fsmkit.editor.cursor.keys_at import kind_at, slot_at
from fsmkit.editor.cursor.slots import Slot, What
from fsmkit.editor.features.expected import after_expression, hint_before
from fsmkit.editor.index.chart_names import ChartNames
from fsmkit.editor.index.files import Kind, beside
from fsmkit.editor.index.symbols import VARIABLES, Symbol, SymbolKind
from fsmkit.editor.index.system_uses import Machine, SystemNames, text_of, under
from fsmkit.editor.positions import Lines, lines_of
from fsmkit.language.binding.calls import BUILT_IN
from fsmkit.language.notation import NAMED
from fsmkit.language.statements.tree import HANDLER_KEYWORDS

NAME = re.compile(r"[^\s,\[\]{}\"'()<>=!&|+*/%~^?:;]*$")
WORD = re.compile(r"[\w$]*$")
DOTTED = re.compile(r"([A-Za-z_]\w*(?:\[[^\[\]]*\])?)\s*\.\s*(\w*)$")
IN_STATE = re.compile(r"(?:([A-Za-z_]\w*)(?:\[[^\]]*\])?\s*\.\s*)?\bIn\s*\(\s*([^()]*)$")
EVENT_PLACE = re.compile(r"(?:^|[;\n{])\s*(?:send|raise)\s+([\w.]*)$")
WORDS = ("raise", "send", "cancel", "log", "if", "for", "super", *HANDLER_KEYWORDS)
"""The words that start statements."""
OPERATORS = ("and", "or")
KIND_OF = {
    SymbolKind.STATE: types.CompletionItemKind.Class,
    SymbolKind.EVENT: types.CompletionItemKind.Event,
    SymbolKind.DATA: types.CompletionItemKind.Variable,
    SymbolKind.INPUT: types.CompletionItemKind.Variable,
    SymbolKind.OUTPUT: types.CompletionItemKind.Variable,
    SymbolKind.CONSTANT: types.CompletionItemKind.Constant,
    SymbolKind.TYPE: types.CompletionItemKind.Enum,
    SymbolKind.MEMBER: types.CompletionItemKind.EnumMember,
    SymbolKind.FIELD: types.CompletionItemKind.Field,
    SymbolKind.OPERATION: types.CompletionItemKind.Function,
    SymbolKind.FUNCTION: types.CompletionItemKind.Function,
    SymbolKind.MACHINE: types.CompletionItemKind.Module,
}
MOST_LISTED = 2_000
"""Maximum number of files read per folder."""


@dataclass(slots=True)
class _Items:
    """Collects items that replace the word before the cursor."""

    lines: Lines
    offset: int
    snippets: bool
    path: Path
    found: dict[str, types.CompletionItem] = field(default_factory=dict)

    def add(
        self,
        label: str,
        kind: types.CompletionItemKind,
        word: str,
        *,
        rank: int = 5,
        detail: str | None = None,
        doc: str | None = None,
        insert: str | None = None,
        is_snippet: bool = False,
    ) -> None:
        """Add an item that replaces a word which ends at the cursor."""
        place = self.lines.range(self.offset - len(word), self.offset)
        if is_snippet and not self.snippets:
            insert, is_snippet = label, False
        item = types.CompletionItem(
            label,
            kind=kind,
            detail=detail,
            documentation=doc,
            sort_text=f"{rank}{label}",
            filter_text=label,
            insert_text_format=types.InsertTextFormat.Snippet if is_snippet else None,
            text_edit=types.TextEdit(place, insert or label),
        )
        known = self.found.get(label)
        if known is None or (known.sort_text or "") > (item.sort_text or ""):
            self.found[label] = item

    def symbol(
        self, symbol: Symbol, word: str, *, rank: int | None = None, detail: str | None = None
    ) -> None:
        """Add the name of a symbol: own ones before inherited ones, others last."""
        own = 1 if symbol.owner == self.path else 2
        kind = KIND_OF.get(symbol.kind, types.CompletionItemKind.Text)
        shown = detail or symbol.kind.value
        self.add(symbol.name, kind, word, rank=own if rank is None else rank, detail=shown)

    def words(self, words: Iterable[str], word: str, *, rank: int = 4) -> None:
        """Add words of the language."""
        for each in words:
            self.add(each, types.CompletionItemKind.Keyword, word, rank=rank)


def completion(
    context: Context, path: Path, position: types.Position, *, snippets: bool = False
) -> list[types.CompletionItem]:
    """Return the completions at a position."""
    source = context.source(path)
    lines = context.lines(path)
    if source is None or lines is None or kind_at(path, source) is Kind.OTHER:
        return []
    offset = lines.offset(position)
    slot = slot_at(path, source, offset)
    items = _Items(lines, offset, snippets, path)
    with context.workspace.steady():
        _Completer(context, path, slot, items).run()
    return list(items.found.values())


def completion_of(context: Context, path: Path, slot: Slot) -> list[types.CompletionItem]:
    """Return the completions of the text of a slot that is not in the file yet, such as a label.

    The text of the slot ends at the cursor; ranges are columns in it.
    """
    source = Source("", slot.text)
    items = _Items(lines_of(source, context.encoding), len(slot.text), False, path)
    with context.workspace.steady():
        _Completer(context, path, slot, items).run()
    return list(items.found.values())


@dataclass(slots=True)
class _Completer:
    context: Context
    path: Path
    slot: Slot
    items: _Items

    @property
    def is_xml(self) -> bool:
        return not self.path.name.lower().endswith((".yaml", ".yml"))

    @property
    def chart(self) -> ChartNames | None:
        """The chart of the file; for a test file, the tested chart."""
        file = self.context.workspace.readable(self.path)
        if file is not None and file.kind is Kind.SUITE:
            text = text_of(under(file.root, "chart"))
            other = None if text is None else beside(self.path, text.value)
            return None if other is None else self.context.workspace.chart(other)
        return self.context.workspace.chart(self.path)

    @property
    def system(self) -> SystemNames | None:
        """The system of the file; for a test file, the tested system."""
        file = self.context.workspace.readable(self.path)
        if file is not None and file.kind is Kind.SUITE:
            text = text_of(under(file.root, "system"))
            other = None if text is None else beside(self.path, text.value)
            return None if other is None else self.context.workspace.system(other)
        return self.context.workspace.system(self.path)

    def run(self) -> None:
        """Add the completions of the slot."""
        match self.slot.what:
            case What.KEY:
                self.keys()
            case What.ELEMENT:
                self.elements()
            case What.WORD:
                self.items.words(self.slot.words, self.name)
            case What.STATE | What.INITIAL | What.INHERITED_STATE | What.TESTED_STATE:
                self.states()
            case What.EVENT | What.TESTED_EVENT:
                self.events()
            case What.OVERRIDE:
                self.overrides()
            case What.EXPRESSION | What.TESTED_CONDITION:
                self.expression(self.slot.text)
            case What.STATEMENTS:
                self.statements()
            case What.DELAY:
                self.constants()
            case What.TYPE | What.SIGNATURE:
                self.types()
            case What.FILE:
                self.files()
            case What.CONSTANT:
                self.given()
            case What.WIRE | What.POSSIBLE | What.CONDITION | What.MACHINE:
                self.over_machines()
            case What.PORT:
                self.ports(self.slot.machine, self.word, None)
            case What.STEP:
                self.step()
            case What.TESTED_CALL:
                self.calls()
            case What.NOTHING:
                pass

    @property
    def name(self) -> str:
        """The part of a name before the cursor, with dots and hyphens."""
        match = NAME.search(self.slot.text)
        return "" if match is None else match[0]

    @property
    def word(self) -> str:
        """The part of a word before the cursor."""
        match = WORD.search(self.slot.text)
        return "" if match is None else match[0]

    # --- keys -------------------------------------------------------------------------------------

    def keys(self) -> None:
        for place, (name, row) in enumerate(self.slot.table.items()):
            if name in self.slot.given:
                continue
            insert = f'{name}="$1"' if self.is_xml else f"{name}: "
            plain = f'{name}=""' if self.is_xml else f"{name}: "
            self.items.add(
                name,
                types.CompletionItemKind.Property,
                self.slot.text if self.is_xml else self.key_text,
                rank=1 + place // 10,
                doc=row.doc or None,
                insert=insert if self.items.snippets else plain,
                is_snippet=self.is_xml and self.items.snippets,
            )
        if "target" in self.slot.words:
            self.states()

    @property
    def key_text(self) -> str:
        return self.slot.text if re.fullmatch(r"[\w ]*", self.slot.text) else self.name

    def elements(self) -> None:
        written = re.search(r"<?[\w:.-]*$", self.slot.text)
        word = "" if written is None else written[0]
        has_bracket = self.items.lines.text[: self.items.offset - len(word)].endswith("<")
        for name in dict.fromkeys(self.slot.words):
            self.items.add(
                name,
                types.CompletionItemKind.Struct,
                word,
                insert=name if has_bracket else f"<{name}",
            )

    # --- charts -----------------------------------------------------------------------------------

    def states(self) -> None:
        if self.slot.what is What.TESTED_STATE and self.chart is None:
            self.over_machines()
            return
        chart = self.chart
        if chart is None:
            return
        for name, symbol in chart.states.items():
            is_below = self._is_below(chart, name, self.slot.state)
            if self.slot.what is What.INHERITED_STATE and (
                symbol.owner == self.path or name in self.slot.given
            ):
                continue
            if self.slot.what is What.INITIAL and self.slot.state and not is_below:
                continue
            near = chart.parents.get(name) == chart.parents.get(self.slot.state)
            rank = 1 if near or is_below else 2 if symbol.owner == self.path else 3
            parent = chart.parents.get(name)
            detail = f"state in {parent}" if parent else "state"
            self.items.symbol(symbol, self.name, rank=rank, detail=detail)

    @staticmethod
    def _is_below(chart: ChartNames, name: str, state: str) -> bool:
        seen = set()
        while name in chart.parents and name not in seen:
            seen.add(name)
            name = chart.parents[name]
            if name == state:
                return True
        return False

    def events(self, wanted: tuple[str, ...] = ("in", "internal")) -> None:
        chart = self.chart
        if chart is None:
            return
        if self.slot.what is What.TESTED_EVENT or "out" in self.slot.words:
            wanted = ("out", "internal")
        for symbol in chart.events.values():
            directions = [d.direction for d in chart.declared.get(symbol, ())]
            fits = any(direction in wanted for direction in directions)
            own = symbol.owner == self.path
            rank = (1 if own else 2) if fits else 6
            detail = f"event {'/'.join(dict.fromkeys(directions))}"
            self.items.symbol(symbol, self.name, rank=rank, detail=detail)
        if "in" in wanted:
            for name in chart.states:
                if name in chart.parents.values():
                    label = f"done.state.{name}"
                    self.items.add(label, types.CompletionItemKind.Event, self.name, rank=7)

    def overrides(self) -> None:
        chart = self.chart
        if chart is None:
            return
        self.items.words(("true",), self.name, rank=1)
        for (state, name), symbol in chart.transitions.items():
            if state == self.slot.state and symbol.owner != self.path:
                self.items.add(name, types.CompletionItemKind.Method, self.name, rank=2)

    def constants(self) -> None:
        chart = self.chart
        if chart is not None:
            for symbol in chart.values.values():
                if symbol.kind is SymbolKind.CONSTANT:
                    start = chart.starts.get(symbol)
                    is_time = start is not None and re.fullmatch(r"[\d.]+[a-z]+", start.value)
                    self.items.symbol(
                        symbol,
                        self.word,
                        rank=1 if is_time else 5,
                        detail=None if start is None else f"= {start}",
                    )

    def types(self) -> None:
        text = self.slot.text
        if "=" in text and self.slot.what is What.TYPE:
            hint = None
            chart = self.chart
            if chart is not None:
                written = text.partition("=")[0].strip()
                hint = written if written in chart.members else None
            self.expression(text.partition("=")[2], hint)
            return
        if self.slot.what is What.SIGNATURE and not re.search(r"[(,]\s*\w+\s+\w*$|->\s*\w*$", text):
            return
        self.items.words(NAMED, self.word)
        chart = self.chart
        if chart is not None:
            for symbol in chart.values.values():
                if symbol.kind is SymbolKind.TYPE:
                    self.items.symbol(symbol, self.word)

    def statements(self) -> None:
        text = self.slot.text
        sent = EVENT_PLACE.search(text)
        if sent is not None:
            self.events(("out", "internal"))
            return
        statement = re.split(r"[;\n{}]", text)[-1]
        if re.fullmatch(r"\s*\w*", statement):
            self.items.words(WORDS, self.word, rank=4)
            self.operations(rank=2)
            self.variables(writable=True)
            return
        assigned = re.fullmatch(r"\s*([\w.\[\]]+)\s*[-+*/]?=(?!=)(.*)", statement, re.DOTALL)
        if assigned is not None and self.chart is not None:
            hint = hint_before(self.chart, self.slot.events, f"{assigned[1]} == ")
            self.expression(assigned[2], hint)
            return
        argument = re.search(r"(?:send|raise)\s+([\w.]+)\s*\(([^()]*)$", statement)
        if argument is not None and self.chart is not None:
            self.arguments(argument[1], argument[2])
            return
        self.expression(statement)

    def arguments(self, event: str, text: str) -> None:
        chart = self.chart
        if chart is None:
            return
        last = text.rpartition(",")[2]
        fields = chart.fields.get(chart.event(event), {})
        named = re.match(r"\s*(\w+)\s*=(?!=)(.*)", last, re.DOTALL)
        if named is not None:
            symbol = fields.get(named[1])
            hint = None if symbol is None else chart.enumeration(chart.types.get(symbol))
            self.expression(named[2], hint)
            return
        for symbol in fields.values():
            self.items.add(
                symbol.name, types.CompletionItemKind.Field, self.word, insert=f"{symbol.name} = "
            )

    def expression(self, text: str, hint: str | None = None) -> None:
        chart = self.chart
        if chart is None:
            if self.system is not None:
                self.over_machines()
            return
        inside = IN_STATE.search(text)
        if inside is not None:
            for symbol in chart.states.values():
                self.items.symbol(symbol, inside[2])
            return
        dotted = DOTTED.search(text)
        if dotted is not None:
            self.dotted(dotted[1], dotted[2], text)
            return
        if after_expression(text):
            self.items.words(OPERATORS, self.word)
            return
        hint = hint or hint_before(chart, self.slot.events, text)
        for name in chart.members.get(hint or "", {}):
            label = f"{hint}.{name}"
            self.items.add(label, types.CompletionItemKind.EnumMember, self.word, rank=0)
        self.variables(writable=False)
        self.operations(rank=4)
        for name in chart.members:
            self.items.symbol(chart.values[name], self.word, rank=3)
        if self.slot.events is not None:
            self.items.add("event", types.CompletionItemKind.Keyword, self.word, rank=3)
        self.items.words(("not", "true", "false", *BUILT_IN), self.word, rank=6)

    def dotted(self, base: str, word: str, text: str) -> None:
        """Add the completions after a dot: fields of an event or a record, members."""
        chart = self.chart
        if chart is None:
            return
        is_event = base == "event" or (base == "data" and re.search(r"_event\.data\.\w*$", text))
        if is_event and "event" not in chart.values:
            events = [chart.event(name) for name in self.slot.events or ()]
            known = [chart.fields.get(event, {}) for event in events]
            for name, symbol in known[0].items() if known else ():
                if all(name in fields for fields in known):
                    written = chart.types.get(symbol)
                    self.items.symbol(symbol, word, detail=str(written) if written else None)
        elif base == "_event":
            self.items.words(("data", "name", "type"), word)
        elif base in chart.members:
            for symbol in chart.members[base].values():
                self.items.symbol(symbol, word)
        elif base in chart.values:
            record = chart.record(chart.types.get(chart.values[base]))
            for symbol in chart.fields.get(record, {}).values() if record is not None else ():
                self.items.symbol(symbol, word)

    def variables(self, *, writable: bool) -> None:
        chart = self.chart
        if chart is None:
            return
        for symbol in chart.values.values():
            if symbol.kind in VARIABLES or (not writable and symbol.kind is SymbolKind.CONSTANT):
                if writable and symbol.kind is SymbolKind.INPUT:
                    continue
                written = chart.types.get(symbol) or chart.starts.get(symbol)
                detail = symbol.kind.value if written is None else f"{symbol.kind.value}: {written}"
                rank = 1 if symbol.owner == self.path else 2
                self.items.symbol(symbol, self.word, rank=rank, detail=detail)

    def operations(self, *, rank: int) -> None:
        chart = self.chart
        if chart is None:
            return
        for symbol in chart.values.values():
            if symbol.kind not in (SymbolKind.OPERATION, SymbolKind.FUNCTION):
                continue
            fields = list(chart.fields.get(symbol, {}).values())
            places = ", ".join(f"${{{n}:{f.name}}}" for n, f in enumerate(fields, 1))
            shown = ", ".join(f"{f.name} {chart.types.get(f) or ''}".strip() for f in fields)
            self.items.add(
                symbol.name,
                types.CompletionItemKind.Function,
                self.word,
                rank=rank,
                detail=f"{symbol.kind.value}({shown})",
                insert=f"{symbol.name}({places})" if self.items.snippets else None,
                is_snippet=self.items.snippets,
            )

    # --- systems ----------------------------------------------------------------------------------

    def over_machines(self) -> None:
        system, text = self.system, self.slot.text
        if system is None:
            return
        inside = IN_STATE.search(text)
        if inside is not None and inside[1] in system.machines:
            names = system.machines[inside[1]].names
            for symbol in () if names is None else names.states.values():
                self.items.symbol(symbol, inside[2])
            return
        dotted = DOTTED.search(text)
        if dotted is not None and "->" not in dotted[0]:
            self.ports(dotted[1].split("[")[0], dotted[2], text)
            return
        if self.slot.what is What.TESTED_STATE or self.slot.what is not What.CONDITION:
            self.machines(system)
            return
        self.machines(system)
        self.items.words(("and", "or", "not", "occurs", "true", "false"), self.word)
        for symbol in (*system.settings.values(), *system.signals.values()):
            self.items.symbol(symbol, self.word)
        for name in system.shared:
            self.items.add(name, types.CompletionItemKind.Variable, self.word)

    def machines(self, system: SystemNames) -> None:
        for machine in system.machines.values():
            names = machine.names
            detail = None if names is None else f"machine: {names.document.name}"
            self.items.symbol(machine.symbol, self.word, rank=1, detail=detail)

    def ports(self, name: str, word: str, text: str | None) -> None:
        """Add the completions after the name of a machine and a dot."""
        system = self.system
        machine = None if system is None else system.machines.get(name)
        if machine is None or machine.names is None:
            if system is not None:
                for charts in system.charts():
                    for symbol in charts.members.get(name, {}).values():
                        self.items.symbol(symbol, word)
            return
        chart = machine.names
        for symbol in chart.values.values():
            if self._fits(symbol.kind, text):
                written = chart.types.get(symbol)
                detail = symbol.kind.value if written is None else f"{symbol.kind.value}: {written}"
                self.items.symbol(symbol, word, rank=2, detail=detail)
        for symbol in chart.events.values():
            directions = {d.direction for d in chart.declared.get(symbol, ())}
            wanted = self._direction(text)
            if wanted is not None and (wanted in directions or not directions):
                self.items.symbol(symbol, word, rank=1, detail=f"event of {machine.symbol.name}")
        if self.slot.what is What.CONDITION:
            self.items.add("In", types.CompletionItemKind.Function, word, rank=1, insert="In(")
        if self.slot.what is What.TESTED_STATE:
            for symbol in chart.states.values():
                self.items.symbol(symbol, word, rank=1)

    def _direction(self, text: str | None) -> str | None:
        """Return the permitted direction of events: outgoing or incoming."""
        match self.slot.what:
            case What.WIRE:
                return "in" if text is not None and "->" in text else "out"
            case What.POSSIBLE | What.PORT | What.STEP:
                return "in"
            case What.TESTED_EVENT:
                return "out"
            case What.CONDITION:
                is_occurring = text is not None and re.search(r"occurs\s*\(\s*[\w.\[\]]*$", text)
                return "in" if is_occurring else None
            case _:
                return None

    def _fits(self, kind: SymbolKind, text: str | None) -> bool:
        match self.slot.what:
            case What.WIRE if text is not None and "->" in text:
                return kind is SymbolKind.INPUT
            case What.WIRE:
                return kind in (SymbolKind.OUTPUT, SymbolKind.OPERATION)
            case What.POSSIBLE | What.STEP:
                return kind is SymbolKind.INPUT
            case What.PORT:
                return kind in (SymbolKind.INPUT, SymbolKind.OPERATION)
            case What.CONDITION | What.TESTED_CONDITION:
                return kind in VARIABLES
            case What.TESTED_CALL:
                return kind is SymbolKind.OPERATION
            case _:
                return False

    def given(self) -> None:
        system = self.system
        machine: Machine | None = None
        if system is not None:
            machine = system.machines.get(self.slot.machine.split("[")[0].strip())
        if machine is None or machine.names is None:
            return
        for symbol in machine.names.values.values():
            if symbol.kind is SymbolKind.CONSTANT and symbol.name not in self.slot.given:
                start = machine.names.starts.get(symbol)
                self.items.symbol(symbol, self.word, detail=None if start is None else f"= {start}")

    # --- tests ------------------------------------------------------------------------------------

    def step(self) -> None:
        text = re.split(r";", self.slot.text)[-1].lstrip()
        first, space, rest = text.partition(" ")
        chart = self.chart
        if not space:
            self.items.words(("post", "set", "wait", "start", "expect"), self.word)
            if chart is not None:
                self.events(("in",))
                self.operations(rank=6)
            elif self.system is not None:
                self.over_machines()
            return
        if chart is None:
            self.over_machines()
        elif first == "set" and " " not in rest:
            for symbol in chart.values.values():
                if symbol.kind is SymbolKind.INPUT:
                    self.items.symbol(symbol, self.word)
        elif first == "set":
            symbol_ = chart.values.get(rest.split(" ")[0])
            hint = None if symbol_ is None else chart.enumeration(chart.types.get(symbol_))
            for member in chart.members.get(hint or "", {}).values():
                self.items.symbol(member, self.word, rank=0)
            self.items.words(("true", "false"), self.word)
        elif first == "post":
            self.events(("in",))

    def calls(self) -> None:
        if self.chart is None:
            self.over_machines()
        else:
            self.operations(rank=1)

    # --- files ------------------------------------------------------------------------------------

    def files(self) -> None:
        written = self.slot.text.strip().strip("\"'")
        folder_text, _, word = written.rpartition("/")
        folder = self.path.parent / folder_text if folder_text else self.path.parent
        for name, is_folder in _entries(folder, self.slot.suffixes):
            if not is_folder and folder / name == self.path:
                continue
            kind = types.CompletionItemKind.Folder if is_folder else types.CompletionItemKind.File
            label = f"{name}/" if is_folder else name
            self.items.add(label, kind, word, rank=2 if is_folder else 1)


def _entries(folder: Path, suffixes: tuple[str, ...]) -> Iterator[tuple[str, bool]]:
    """Yield the files of a folder with one of some suffixes, and its folders."""
    try:
        with os.scandir(folder) as found:
            for place, entry in enumerate(found):
                if place >= MOST_LISTED:
                    return
                if entry.name.startswith("."):
                    continue
                if entry.is_dir():
                    yield entry.name, True
                elif entry.name.lower().endswith(suffixes):
                    yield entry.name, False
    except (OSError, ValueError):
        return
