"""Find the names in systems, deployments and boards: machines, and items of their charts."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

from fsmkit.diagnostics import Text
from fsmkit.document import keys
from fsmkit.editor.index.chart_names import ChartNames, line_of
from fsmkit.editor.index.symbols import (
    VARIABLES,
    Occurrence,
    Role,
    Symbol,
    SymbolKind,
    Uses,
)
from fsmkit.language.notation import NAMED
from fsmkit.system.conditions import QUOTED
from fsmkit.system.indices import INDEXED
from fsmkit.yaml.nodes import Mapping as Entries
from fsmkit.yaml.nodes import Node, Scalar, Sequence

NAME = r"[A-Za-z_]\w*"
TOKEN = re.compile(
    rf"(?P<quoted>{QUOTED})"
    rf"|(?<![\w.])occurs\s*\(\s*(?P<taking>{INDEXED})\s*\.\s*(?P<event>{NAME}(?:\.\w+)*)\s*\)"
    rf"|(?<![\w.])(?P<tested>{INDEXED})\s*\.\s*In\s*\(\s*(?P<state>[^()]*?)\s*\)"
    rf"|(?<![\w.])(?P<machine>{INDEXED})\s*\.(?!\.)\s*(?P<name>{NAME}(?:\.\w+)*)"
    rf"|(?<![\w.])(?P<bare>{NAME})"
)
"""The names in a text over machines, as in `fsmkit.system.conditions`."""
BRACKETS = re.compile(r"\[([^\[\]]*)\]")
BOUND_INDEX = re.compile(rf"[\[(]\s*({NAME})\s+in\b")
"""The name of an index in ``phil[i in 0..2]`` and ``all(i in phil: ...)``."""
PAYLOAD = re.compile(r"\s*\((.*)\)\s*", re.DOTALL)
KEYWORDS = frozenset(
    ("and", "or", "not", "true", "false", "in", "all", "any", "count", "if", "else", "min", "max")
) | frozenset(("abs", "int", "len", "occurs", "In"))
Port = Callable[[ChartNames, str], Symbol | None]


@dataclass(frozen=True, slots=True)
class Machine:
    """A machine of a system: its symbol, and the names of its chart if that is known."""

    symbol: Symbol
    names: ChartNames | None


@dataclass
class SystemNames:
    """The names of a system."""

    path: Path
    machines: dict[str, Machine] = field(default_factory=dict)
    settings: dict[str, Symbol] = field(default_factory=dict)
    properties: dict[str, Symbol] = field(default_factory=dict)
    shared: dict[str, tuple[Symbol, ...]] = field(default_factory=dict)
    nodes: dict[str, Symbol] = field(default_factory=dict)
    signals: dict[str, Symbol] = field(default_factory=dict)
    devices: dict[str, Symbol] = field(default_factory=dict)
    indices: set[str] = field(default_factory=set)
    """Names of the indices of arrays of machines."""
    name: Text | None = None

    def charts(self) -> Iterator[ChartNames]:
        """Yield the charts of the machines, each once."""
        found = {id(m.names): m.names for m in self.machines.values() if m.names is not None}
        yield from found.values()


def entries(node: Node | None) -> tuple[tuple[Text, Node], ...]:
    """Return the entries of a mapping; empty for other nodes."""
    return node.entries if isinstance(node, Entries) else ()


def under(node: Node | None, key: str) -> Node | None:
    """Return the value of a key in a mapping, or None."""
    return next((value for name, value in entries(node) if name.value == key), None)


def items(node: Node | None) -> tuple[Node, ...]:
    """Return the items of a list; another node is a single item."""
    if node is None:
        return ()
    return node.items if isinstance(node, Sequence) else (node,)


def text_of(node: Node | None) -> Text | None:
    """Return the text of a scalar."""
    return node.text.strip() if isinstance(node, Scalar) else None


def scalars(node: Node | None) -> Iterator[Text]:
    """Yield all texts in a node, keys among them."""
    match node:
        case Scalar(text):
            yield text
        case Sequence():
            for item in node.items:
                yield from scalars(item)
        case Entries():
            for key, value in node.entries:
                yield key
                yield from scalars(value)
        case _:
            pass


def system_names(
    path: Path, root: Node, chart_of: Callable[[Text], ChartNames | None]
) -> SystemNames:
    """Return the names of a system; ``chart_of`` gives the names of a chart by its path there."""
    names = SystemNames(path, name=text_of(under(root, "system")))
    for key, value in entries(under(root, "machines")):
        match = re.match(NAME, key.value)
        if match is None:
            continue
        chart = text_of(under(value, "chart") if isinstance(value, Entries) else value)
        names.indices.update(BOUND_INDEX.findall(key.value))
        symbol = Symbol(SymbolKind.MACHINE, path, match[0])
        found = None if chart is None else chart_of(chart)
        names.machines.setdefault(match[0], Machine(symbol, found))
    for key, _ in entries(under(under(root, "environment"), "freezes")):
        symbol = Symbol(SymbolKind.MACHINE, path, key.value)
        names.machines.setdefault(key.value, Machine(symbol, None))
    for key, _ in entries(under(root, "parameters")):
        names.settings[key.value] = Symbol(SymbolKind.SETTING, path, key.value)
    for key, _ in entries(under(root, "properties")):
        names.properties[key.value] = Symbol(SymbolKind.PROPERTY, path, key.value)
    for key, _ in entries(under(root, "shared")):
        having = [c.values[key.value] for c in names.charts() if key.value in c.values]
        names.shared[key.value] = tuple(s for s in having if s.kind is SymbolKind.DATA)
    return names


# --- names after a dot ----------------------------------------------------------------


def any_event(chart: ChartNames, name: str) -> Symbol | None:
    """Return the event of a name, declared or not."""
    found = chart.events.get(name)
    return chart.event(name) if found is None and chart.is_loose else found


def variable(chart: ChartNames, name: str) -> Symbol | None:
    """Return the symbol of a variable: data, an input or an output."""
    found = chart.values.get(name)
    return found if found is not None and found.kind in VARIABLES else None


def source(chart: ChartNames, name: str) -> Symbol | None:
    """Return the symbol of an outgoing port: an output, an operation or an event."""
    found = chart.values.get(name)
    if found is not None and found.kind in (SymbolKind.OUTPUT, SymbolKind.OPERATION):
        return found
    return any_event(chart, name) or found


def target(chart: ChartNames, name: str) -> Symbol | None:
    """Return the symbol of an incoming port: an event or an input."""
    return any_event(chart, name) or variable(chart, name)


def read_part(chart: ChartNames, name: str) -> Symbol | None:
    """Return the symbol that a condition reads."""
    return variable(chart, name) or chart.values.get(name) or any_event(chart, name)


# --- walking --------------------------------------------------------------------------------------


@dataclass(slots=True)
class Scanner:
    """Reports the names in texts over the machines of a system."""

    path: Path
    names: SystemNames
    found: list[Occurrence] = field(default_factory=list)
    links: list[tuple[Symbol, Symbol]] = field(default_factory=list)

    @property
    def uses(self) -> Uses:
        """The reported names."""
        return Uses(tuple(dict.fromkeys(self.found)), tuple(dict.fromkeys(self.links)))

    def use(self, text: Text, *symbols: Symbol, role: Role = Role.USE) -> None:
        """Report one name."""
        self.found.append(Occurrence(symbols, text.value, role, text.span))

    def declare(self, text: Text, symbol: Symbol) -> None:
        """Report a declaration."""
        whole = line_of(text.span)
        self.found.append(Occurrence((symbol,), text.value, Role.DECLARATION, text.span, whole))

    def unknown(self, text: Text) -> None:
        """Report a name of which nothing is known."""
        self.found.append(Occurrence((), text.value, Role.UNKNOWN, text.span))

    def machine(self, text: Text) -> Machine | None:
        """Report a machine with an optional index, which may contain parameters."""
        match = re.match(rf"\s*({NAME})", text.value)
        if match is None:
            return None
        self._indices(text)
        machine = self.names.machines.get(match[1])
        if machine is not None:
            self.use(text.part(*match.span(1)), machine.symbol)
        return machine

    def _indices(self, text: Text) -> None:
        for inner in BRACKETS.finditer(text.value):
            for word in re.finditer(NAME, inner[1]):
                symbol = self.names.settings.get(word[0])
                if symbol is not None:
                    start = inner.start(1) + word.start()
                    self.use(text.part(start, start + len(word[0])), symbol)

    def read(
        self, text: Text | None, port: Port = read_part, own: ChartNames | None = None
    ) -> tuple[Symbol, ...]:
        """Report the names in a source; return the symbols of the dotted ones.

        Args:
            text: The source.
            port: Resolves the name after a machine.
            own: The chart whose names need no machine.

        """
        if text is None:
            return ()
        dotted: list[Symbol] = []
        bare: list[Text] = []
        at = 0
        bound = {*self.names.indices, *BOUND_INDEX.findall(text.value), *NAMED}
        while (match := TOKEN.search(text.value, at)) is not None:
            at = match.end()
            if match["quoted"] is not None:
                continue
            if match["taking"] is not None:
                self._part(text, match, "taking", "event", any_event)
            elif match["tested"] is not None:
                self._state(text, match)
            elif match["machine"] is not None:
                word = text.part(match.start("machine"), match.end("name"))
                if self._signal(word):
                    continue
                if match["machine"].split("[")[0].strip() not in self.names.machines:
                    at = match.end("machine")
                    bare.append(text.part(*match.span("machine")))
                    following = re.match(rf"\s*\.\s*({NAME})", text.value[at:])
                    if following is not None:
                        at = match.end("name")
                        self._qualified(bare.pop(), text.part(*match.span("name")), own)
                    continue
                symbol = self._part(text, match, "machine", "name", port)
                if symbol is not None:
                    dotted.append(symbol)
                    at = self.payload(text, at, symbol)
            elif match["bare"] not in KEYWORDS and match["bare"] not in bound:
                bare.append(text.part(*match.span("bare")))
        for word in bare:
            self._bare(word, dotted, own)
        return tuple(dotted)

    def _part(
        self, text: Text, match: re.Match[str], machine: str, name: str, port: Port
    ) -> Symbol | None:
        found = self.machine(text.part(*match.span(machine)))
        at = text.part(*match.span(name))
        if found is None or found.names is None:
            self.unknown(at)
            return None
        symbol = port(found.names, at.value)
        if symbol is None and "." in at.value:
            at = at.part(0, at.value.index("."))
            symbol = port(found.names, at.value)
        if symbol is None:
            self.unknown(at)
        else:
            self.use(at, symbol)
        return symbol

    def _state(self, text: Text, match: re.Match[str]) -> None:
        found = self.machine(text.part(*match.span("tested")))
        at = text.part(*match.span("state"))
        if found is None or found.names is None:
            self.unknown(at)
            return
        self.state(at, found.names)

    def state(self, at: Text, chart: ChartNames) -> None:
        """Report the name of a state of a chart."""
        name = at.value.removesuffix(".main")
        if at.value in chart.states:
            self.use(at, chart.states[at.value])
        elif name in chart.states:
            self.use(at.part(0, len(name)), chart.states[name])
        else:
            self.unknown(at)

    def _signal(self, word: Text) -> bool:
        """Report a signal or a function of a device, whose names may hold a dot."""
        symbol = self.names.signals.get(word.value)
        if symbol is not None:
            self.use(word, symbol)
            return True
        device, dot, _ = word.value.partition(".")
        if dot and device in self.names.devices:
            self.use(word.part(0, len(device)), self.names.devices[device])
            return True
        return False

    def _qualified(self, type_: Text, member: Text, own: ChartNames | None) -> None:
        """Report ``Fault.lost``."""
        charts = [c for c in self._charts(own) if type_.value in c.members]
        types = [c.values[type_.value] for c in charts]
        members = [c.members[type_.value].get(member.value) for c in charts]
        known = tuple(dict.fromkeys(m for m in members if m is not None))
        if types:
            self.use(type_, *dict.fromkeys(types))
        else:
            self._bare(type_, (), own)
        if known:
            self.use(member, *known)
        else:
            self.unknown(member)

    def _charts(self, own: ChartNames | None) -> tuple[ChartNames, ...]:
        return (own,) if own is not None else tuple(self.names.charts())

    def payload(self, text: Text, at: int, event: Symbol, own: ChartNames | None = None) -> int:
        """Report the fields and values in ``fault(code in {jam, stall})``; return its end."""
        match = PAYLOAD.match(text.value, at)
        if match is None or event.kind is not SymbolKind.EVENT:
            return at
        inner = text.part(*match.span(1))
        charts = [c for c in self._charts(own) if event in c.fields]
        for word in re.finditer(rf"(?<![\w.\"']){NAME}", inner.value):
            one = inner.part(*word.span())
            if one.value in KEYWORDS:
                continue
            fields = [c.fields[event][one.value] for c in charts if one.value in c.fields[event]]
            if fields:
                self.use(one, *dict.fromkeys(fields))
            else:
                self._bare(one, tuple(s for c in charts for s in c.fields[event].values()), own)
        return match.end()

    def _bare(self, word: Text, dotted: Iterable[Symbol], own: ChartNames | None) -> None:
        name = word.value
        if name in self.names.signals:
            self.use(word, self.names.signals[name])
        elif name in self.names.devices:
            self.use(word, self.names.devices[name])
        elif name in self.names.settings:
            self.use(word, self.names.settings[name])
        elif name in self.names.machines:
            self.use(word, self.names.machines[name].symbol)
        elif self.names.shared.get(name):
            self.use(word, *self.names.shared[name])
        else:
            self._of_charts(word, tuple(dotted), own)

    def _of_charts(self, word: Text, dotted: tuple[Symbol, ...], own: ChartNames | None) -> None:
        """Report a constant, a type, or a member of the compared enumeration."""
        charts, name = self._charts(own), word.value
        values = [c.values[name] for c in charts if name in c.values]
        if values:
            self.use(word, *dict.fromkeys(values))
            return
        wanted = {c.enumeration(c.types.get(s)) for s in dotted for c in charts if s in c.types}
        members = [
            m[name] for c in charts for t, m in c.members.items() if t in wanted and name in m
        ] or [m[name] for c in charts for m in c.members.values() if name in m]
        if members:
            self.use(word, *dict.fromkeys(members))
        else:
            self.unknown(word)

    def link(self, one: Symbol, other: Symbol, a: ChartNames, b: ChartNames) -> None:
        """Link the names that connected ports share: fields, members of types."""
        sent = [*a.fields.get(one, {}).values()] if one in a.fields else [one]
        wanted = [*b.fields.get(other, {}).values()] if other in b.fields else [other]
        by_name = {s.name: s for s in sent}
        pairs = zip(sent, wanted, strict=False)
        if one in a.fields and all(w.name in by_name for w in wanted):
            pairs = zip([by_name[w.name] for w in wanted], wanted, strict=True)
            if [w.name for w in wanted] != [s.name for s in sent[: len(wanted)]] or len(
                wanted
            ) < len(sent):
                self.links += [(by_name[w.name], w) for w in wanted]
        for left, right in pairs:
            self.link_types(
                a.enumeration(a.types.get(left)), b.enumeration(b.types.get(right)), a, b
            )

    def link_types(self, one: str | None, other: str | None, a: ChartNames, b: ChartNames) -> None:
        """Give the members of two enumerations one name: only equal ones fit each other."""
        if one is None or other is None:
            return
        theirs = b.members[other]
        for name, member in a.members[one].items():
            if name in theirs and theirs[name] != member:
                self.links.append((member, theirs[name]))


def system_uses(
    path: Path, root: Node, names: SystemNames, chart_of: Callable[[Text], ChartNames | None]
) -> Uses:
    """Return the names in a system."""
    scanner = Scanner(path, names)
    if names.name is not None:
        scanner.declare(names.name, Symbol(SymbolKind.SYSTEM, path, names.name.value))
    for key, value in entries(under(root, "parameters")):
        if key.value in names.settings:
            scanner.declare(key, names.settings[key.value])
        scanner.read(text_of(value))
    for key, value in entries(under(root, "machines")):
        match = re.match(NAME, key.value)
        if match is None:
            continue
        machine = names.machines[match[0]]
        scanner.declare(key.part(*match.span()), machine.symbol)
        scanner._indices(key)  # noqa: SLF001  (the walk of this module)
        for name, given in entries(under(value, "with")):
            _constant(name, machine.names, scanner)
            scanner.read(text_of(given), own=machine.names)
        for name, given in entries(under(value, "start")):
            symbol = None if machine.names is None else variable(machine.names, name.value)
            if symbol is None:
                scanner.unknown(name)
            else:
                scanner.use(name, symbol)
            scanner.read(text_of(given), own=machine.names)
    for key, value in entries(under(root, "shared")):
        holders = names.shared[key.value]
        if holders:
            scanner.use(key, *holders)
        else:
            scanner.unknown(key)
        scanner.read(text_of(value))
    for item in items(under(root, "connect")):
        wire = item.entries[0][0] if isinstance(item, Entries) and item.entries else text_of(item)
        _wire(wire, scanner)
        for _, options in entries(item):
            for text in scalars(options):
                _settings(text, scanner)
    for part in ("may", "will", "world"):
        for item in items(under(under(root, "environment"), part)):
            scanner.read(text_of(item), target)
    for key, node in entries(under(under(root, "environment"), "freezes")):
        scanner.declare(key, names.machines[key.value].symbol)
        for part in keys.FREEZE:
            for text in scalars(under(node, part)):
                scanner.read(text)
    for part in ("cyclic", "period", "jitter"):
        for item in items(under(under(root, "schedule"), part)):
            scanner.read(text_of(item))
    for key, value in entries(under(root, "properties")):
        scanner.declare(key, names.properties[key.value])
        _property(value, scanner, chart_of)
    return scanner.uses


def _constant(name: Text, chart: ChartNames | None, scanner: Scanner) -> None:
    symbol = None if chart is None else chart.values.get(name.value)
    if symbol is None:
        scanner.unknown(name)
    else:
        scanner.use(name, symbol)


def _settings(text: Text, scanner: Scanner) -> None:
    for match in re.finditer(NAME, text.value):
        symbol = scanner.names.settings.get(match[0])
        if symbol is not None:
            scanner.use(text.part(*match.span()), symbol)


def _wire(text: Text | None, scanner: Scanner) -> None:
    if text is None:
        return
    left, arrow, _ = text.value.partition("->")
    sources = scanner.read(text.part(0, len(left)), source)
    targets = scanner.read(text.part(len(left) + len(arrow), len(text.value)), target)
    for one in sources[:1]:
        for other in targets[:1]:
            a = _holder(one, scanner.names)
            b = _holder(other, scanner.names)
            if a is not None and b is not None:
                scanner.link(one, other, a, b)


def _holder(symbol: Symbol, names: SystemNames) -> ChartNames | None:
    return next((c for c in names.charts() if symbol in c.declared), None)


def _property(node: Node, scanner: Scanner, chart_of: Callable[[Text], ChartNames | None]) -> None:
    chart = text_of(under(node, "monitor") if not isinstance(
        under(node, "monitor"), Entries
    ) else under(under(node, "monitor"), "chart"))  # fmt: skip
    if chart is not None:
        monitor = chart_of(chart)
        for name, given in entries(under(under(node, "monitor"), "with")):
            _constant(name, monitor, scanner)
            scanner.read(text_of(given), own=monitor)
        for item in items(under(node, "watch")):
            _watched(text_of(item), monitor, scanner)
        return
    for key, value in entries(node):
        if key.value == "req":
            continue
        for text in (value.text,) if isinstance(value, Scalar) else scalars(value):
            scanner.read(text)


def _watched(text: Text | None, monitor: ChartNames | None, scanner: Scanner) -> None:
    if text is None:
        return
    left, arrow, _ = text.value.partition("->")
    found = scanner.read(text.part(0, len(left)), _watchable)
    at = text.part(len(left) + len(arrow), len(text.value)).strip()
    symbol = None if monitor is None else target(monitor, at.value)
    if symbol is None or monitor is None:
        scanner.unknown(at)
        return
    scanner.use(at, symbol)
    for one in found[:1]:
        a = _holder(one, scanner.names)
        if a is not None:
            scanner.link(one, symbol, a, monitor)


def _watchable(chart: ChartNames, name: str) -> Symbol | None:
    return variable(chart, name) or source(chart, name)


# --- deployments and boards -----------------------------------------------------------------------


def deployment_names(path: Path, root: Node, system: SystemNames | None) -> SystemNames:
    """Return the names of a deployment: its nodes, and those of its system."""
    names = system or SystemNames(path)
    own = SystemNames(path, names.machines, names.settings, names.properties, names.shared)
    own.indices = names.indices
    for key, _ in entries(under(root, "nodes")):
        own.nodes[key.value] = Symbol(SymbolKind.NODE, path, key.value)
    return own


def deployment_uses(path: Path, root: Node, names: SystemNames) -> Uses:
    """Return the names in a deployment; external names are ignored."""
    scanner = Scanner(path, names)
    for key, value in entries(under(root, "nodes")):
        scanner.declare(key, names.nodes[key.value])
        machines = under(value, "machines") if isinstance(value, Entries) else value
        for item in items(machines):
            text = text_of(item)
            if text is not None:
                scanner.machine(text)
        foreign = [v for k, v in entries(value) if k.value != "machines"]
        for node in foreign:
            for text in scalars(node):
                _dotted(text, scanner)
    for table in (under(under(root, "links"), "endpoints"), under(root, "health")):
        for key, _ in entries(table):
            if key.value in names.nodes:
                scanner.use(key, names.nodes[key.value])
    return scanner.uses


def _dotted(text: Text, scanner: Scanner) -> None:
    """Report the names of machines and their ports in any source."""
    for match in re.finditer(rf"(?<![\w./])({INDEXED})\.({NAME})(?![\w./(])", text.value):
        machine = scanner.names.machines.get(match[1].split("[")[0].strip())
        if machine is None or machine.names is None:
            continue
        scanner.machine(text.part(*match.span(1)))
        symbol = source(machine.names, match[2]) or target(machine.names, match[2])
        if symbol is not None:
            scanner.use(text.part(*match.span(2)), symbol)


def board_names(path: Path, root: Node, deployment: SystemNames | None) -> SystemNames:
    """Return the names of a board: its signals and devices, and those of its deployment."""
    names = deployment or SystemNames(path)
    own = SystemNames(path, names.machines, names.settings, names.properties, names.shared)
    own.nodes, own.indices = names.nodes, names.indices
    for key, _ in entries(under(root, "signals")):
        own.signals[key.value] = Symbol(SymbolKind.SIGNAL, path, key.value)
    for key, _ in entries(under(root, "use")):
        own.devices[key.value] = Symbol(SymbolKind.DEVICE, path, key.value)
    return own


def board_uses(path: Path, root: Node, names: SystemNames) -> Uses:
    """Return the names in the wires of a board."""
    scanner = Scanner(path, names)
    board = text_of(under(root, "board"))
    if board is not None and board.value in names.nodes:
        scanner.use(board, names.nodes[board.value])
    for key, _ in entries(under(root, "signals")):
        scanner.declare(key, names.signals[key.value])
    for key, value in entries(under(root, "use")):
        scanner.declare(key, names.devices[key.value])
        for part in ("reads", "writes"):
            for item in items(under(value, part)):
                scanner.read(text_of(item))
    for key, value in entries(under(root, "set")):
        scanner.read(key)
        _formula(value, scanner, None, None)
    off = under(root, "off")
    _formula(under(off, "when") or off, scanner, None, None)
    for kept in items(under(off, "keep")):
        scanner.read(text_of(kept))
    for key, value in entries(under(root, "bind")):
        machine = scanner.machine(key)
        chart = None if machine is None else machine.names
        for name, formula in entries(value):
            _formula(formula, scanner, chart, _bound(name, chart, scanner))
    return scanner.uses


def _bound(text: Text, chart: ChartNames | None, scanner: Scanner) -> Symbol | None:
    """Report a bound port: an input, an operation, or an event with an optional payload."""
    match = re.match(rf"{NAME}(?:\.\w+)*", text.value)
    name = text if match is None else text.part(*match.span())
    symbol = None
    if chart is not None:
        symbol = source(chart, name.value) or target(chart, name.value)
    if symbol is None or chart is None:
        scanner.unknown(name)
        return None
    scanner.use(name, symbol)
    if match is not None and match.end() < len(text.value):
        scanner.payload(text, match.end(), symbol, chart)
    return symbol


def _formula(
    node: Node | None, scanner: Scanner, chart: ChartNames | None, bound: Symbol | None
) -> None:
    """Report the names in a formula of a board; ``bound`` is the port with its value."""
    match node:
        case Scalar(text):
            if text.value.strip() not in ("host", "nothing"):
                scanner.read(text, own=chart)
        case Sequence():
            for item in node.items:
                _formula(item, scanner, chart, bound)
        case Entries():
            for key, value in node.entries:
                if key.value == "when" and isinstance(value, Entries):
                    type_ = None if chart is None or bound is None else chart.types.get(bound)
                    hint = None if chart is None else chart.enumeration(type_)
                    for member, condition in value.entries:
                        if (
                            chart is not None
                            and hint is not None
                            and member.value in chart.members[hint]
                        ):
                            scanner.use(member, chart.members[hint][member.value])
                        _formula(condition, scanner, chart, None)
                elif key.value == "set" and isinstance(value, Entries):
                    for signal, formula in value.entries:
                        scanner.read(signal)
                        _formula(formula, scanner, chart, None)
                else:
                    _formula(value, scanner, chart, bound)
        case _:
            pass
