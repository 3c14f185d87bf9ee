"""Parse conditions over a system: ``feeder.In(pressing) and not plant.door_closed``.

A dotted name is a variable of a machine. ``machine.In(state)`` is whether a state of the machine is
active. Both become variables of the expression, and so do the variables that a function of a
machine reads, as in ``machine.share(2, 3)``.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import TypeVar

import fsmkit.language as lang
from fsmkit.chart.chart import Chart
from fsmkit.diagnostics import Findings, Text
from fsmkit.diagnostics.suggestions import suggest
from fsmkit.emit import legal
from fsmkit.language.copied_names import dotted
from fsmkit.system.indices import INDEXED, canonical_name
from fsmkit.system.inlined_functions import inline_function
from fsmkit.system.machine import Machine
from fsmkit.system.properties.condition import Atom, Condition

Binding = TypeVar("Binding")
OCCURS = rf"occurs\s*\(\s*(?P<taking>{INDEXED})\s*\.\s*(?P<event>[A-Za-z_][\w.]*)\s*\)"
TEST = rf"(?P<tested>{INDEXED})\s*\.\s*In\s*\(\s*(?P<state>[^()]*?)\s*\)"
DOTTED = (
    rf"(?P<machine>{INDEXED})\s*\.\s*(?P<name>[A-Za-z_]\w*(?:(?:\[\s*\d+\s*\])?\.[A-Za-z_]\w*)*)"
)
QUOTED = r'"[^"]*"|\'[^\']*\''
BARE = r"(?P<shared>[A-Za-z_]\w*)(?![\w.(])(?:\s*\[\s*(?P<element>\d+)\s*\])?"
NAMES = re.compile(
    rf"(?P<quoted>{QUOTED})|(?<![\w.]){OCCURS}|(?<![\w.]){TEST}|(?<![\w.]){DOTTED}|(?<![\w.]){BARE}"
)


@dataclass(slots=True)
class _Reader:
    machines: tuple[Machine, ...]
    findings: Findings
    others: Mapping[str, tuple[str, lang.Type]] = field(default_factory=dict)
    atoms: dict[str, Atom] = field(default_factory=dict)
    types: dict[str, tuple[lang.Type, lang.Storage]] = field(default_factory=dict)
    functions: dict[str, lang.FunctionBody] = field(default_factory=dict)
    called: dict[str, tuple[int, str]] = field(default_factory=dict)
    """By the name of a function in the condition: whose it is, and its own."""
    holders: dict[str, list[int]] = field(default_factory=dict)
    """The machines that hold shared data, by the names found so far."""
    places: dict[str, int] = field(default_factory=dict)
    """The machines by name, once one is looked for."""
    failed: bool = False

    def replacement(self, match: re.Match[str], text: Text) -> str | None:
        """Return the variable for a dotted name; None to leave the source as it is."""
        if match["quoted"] is not None:
            return None
        other = self.others.get(re.sub(r"\s", "", match[0]))
        if other is not None:
            self.types[other[0]] = (other[1], lang.Storage.DATA)
            return other[0]
        if match["shared"] is not None:
            return self._shared_variable(match, text)
        group = next(g for g in ("taking", "tested", "machine") if match[g] is not None)
        name = canonical_name(text.part(*match.span(group)), self.findings)
        index = None if name is None else self.place_of(name)
        if index is None:
            if name is None:
                self.failed = True
            elif group != "machine" or "[" in name:
                names = [machine.name for machine in self.machines]
                self.report_unknown(
                    "there is no machine", name, names, text.part(*match.span(group))
                )
            return None
        if match["taking"] is not None:
            return self._state_variable(index, match["event"], text.part(*match.span("event")))
        if match["tested"] is not None:
            return self._state_variable(
                index, match["state"], text.part(*match.span("state")), is_state=True
            )
        at = text.part(*match.span("name"))
        if text.value[match.end() :].lstrip().startswith("("):
            return self._function_name(index, match["name"], at)
        return self._variable(index, match["name"], at)

    def place_of(self, name: str) -> int | None:
        """Return the number of the first machine of a name."""
        if not self.places:
            for number, machine in enumerate(self.machines):
                self.places.setdefault(machine.name, number)
        return self.places.get(name)

    def _state_variable(
        self, index: int, name: str, at: Text, *, is_state: bool = False
    ) -> str | None:
        """Return the variable for whether a state is active, or an event occurs."""
        machine = self.machines[index]
        kind, word = ("state", "In") if is_state else ("event", "occurs")
        known = machine.chart.active_index if is_state else machine.chart.event_index
        name = dotted(name, {})
        if name not in known:
            self.report_unknown(f"`{machine.name}` has no {kind}", name, known, at)
            return None
        atom = Atom(index, known[name]) if is_state else Atom(index, event=known[name])
        safe = re.sub(r"\W", "_", name)
        return self._named(f"{legal(machine.name)}__{word}__{safe}", atom, lang.BOOL)

    def _function_name(self, index: int, name: str, at: Text) -> str | None:
        """Return the name of a function over variables of the condition."""
        machine = self.machines[index]
        functions = {function.name: function for function in machine.chart.functions}
        name = dotted(name, {})
        if any(operation.name == name for operation in machine.chart.operations):
            self.failed = True
            self.findings.add(
                "unknown-name",
                f"a property cannot call the operation `{name}`, which acts on the host",
                at,
                help="assign its result to a variable under `data`, and name that",
            )
            return None
        if name not in functions:
            self.report_unknown(f"`{machine.name}` has no function", name, functions, at)
            return None

        def read(part: lang.Variable | lang.InState) -> lang.Variable:
            # no local name has a dot
            if isinstance(part, lang.Variable):
                atom, type_ = Atom(index, variable=part.name), part.type
                wanted = f"{machine.name}.{part.name}"
            else:
                atom, type_ = Atom(index, part.state), lang.BOOL
                wanted = f"{machine.name}.In.{part.state}"
            return lang.Variable(
                self._named(wanted, atom, type_), type_, lang.Storage.DATA, part.span
            )

        safe = re.sub(r"\W", "_", name)
        called = f"{legal(machine.name)}__{safe}"
        while called in self.types or self.called.setdefault(called, (index, name)) != (
            index,
            name,
        ):
            called += "_"
        self.functions[called] = inline_function(functions[name], f"{machine.name}.{name}", read)
        return called

    def _variable(self, index: int, name: str, at: Text) -> str | None:
        machine = self.machines[index]
        types = variables_of(machine.chart)
        name, rest = _split(name, types)
        if name not in types:
            help_ = None
            if name in machine.chart.active_index:
                help_ = f"whether a state is active is written `{machine.name}.In({name})`"
            self.report_unknown(f"`{machine.name}` has no variable", name, types, at, help_)
            return None
        safe = re.sub(r"\W", "_", name)
        atom = Atom(index, variable=name)
        return self._named(f"{legal(machine.name)}__{safe}", atom, types[name]) + rest

    def _shared_variable(self, match: re.Match[str], text: Text) -> str | None:
        """Return the variable for a shared one: the copy in a machine that holds the element."""
        name = match["shared"]
        if name not in self.holders:
            self.holders[name] = [
                n for n, m in enumerate(self.machines) if any(s.name == name for s in m.shared)
            ]
            if not self.holders[name]:
                self._report_unqualified(text.part(*match.span("shared")))
        holders = self.holders[name]
        if not holders:
            return None
        type_ = variables_of(self.machines[holders[0]].chart)[name]
        wanted: set[int | None] = {None}
        if isinstance(type_, lang.ArrayType):
            wanted = set(range(type_.length))
            wanted = {int(match["element"])} if match["element"] is not None else wanted
        for number in holders:
            if wanted <= {s.element for s in self.machines[number].shared if s.name == name}:
                held = self._named(f"shared__{name}", Atom(number, variable=name), type_)
                return held if match["element"] is None else f"{held}[{match['element']}]"
        self.failed = True
        at = text.part(*match.span("shared"))
        what = (
            f"`{name}[{match['element']}]`" if match["element"] is not None else f"all of `{name}`"
        )
        self.findings.add(
            "unshared-data",
            f"no machine holds {what}",
            at,
            help="use an element that a chart names: `name[0]`",
        )
        return None

    def _report_unqualified(self, name: Text) -> None:
        """Report an unqualified name of a machine or of one of its members."""
        if name.value in constants_of(self.machines) or name.value in types_of(self.machines):
            return
        for machine in self.machines:
            chart, whole, what = machine.chart, machine.name, "no machine is named for"
            if name.value == whole:
                what, advice = "this is a machine:", f"`{whole}.In(state)` or `{whole}.variable`"
            elif name.value in chart.state_index and name.value != chart.name:
                advice = f"`{whole}.In({name})`"
            elif name.value in variables_of(chart):
                advice = f"`{whole}.{name}`"
            else:
                continue
            self.report_unknown(what, name.value, (), name, f"write {advice}")
            return

    def _named(self, name: str, atom: Atom, type_: lang.Type) -> str:
        while self.atoms.get(name, atom) != atom or name in self.functions:
            name += "_"
        self.atoms[name] = atom
        self.types[name] = (type_, lang.Storage.DATA)
        return name

    def report_unknown(
        self, what: str, name: str, known: Iterable[str], at: Text, help_: str | None = None
    ) -> None:
        """Report an unknown name."""
        self.failed = True
        names = list(known)
        some = f"use one of {', '.join(f'`{n}`' for n in names[:8])}"
        help_ = help_ or suggest(name, names, some if names else "remove it")
        self.findings.add("unknown-name", f"{what} `{name}`", at, help=help_)


def _split(name: str, known: Iterable[str]) -> tuple[str, str]:
    """Split a dotted name into its variable, perhaps one of a copied chart, and the rest."""
    names = frozenset(known)
    ends = [match.start() for match in re.finditer(r"[.\[]", name)]
    for end in (len(name), *reversed(ends)):
        variable = dotted(name[:end], {})
        if variable in names:
            return variable, name[end:]
    return name[: ends[0]] if ends else name, name[ends[0] :] if ends else ""


def read_condition(
    text: Text, machines: tuple[Machine, ...], findings: Findings
) -> Condition | None:
    """Parse a condition; None after a finding."""
    return read_expression(text, machines, findings, lang.BOOL)


def read_expression(
    text: Text,
    machines: tuple[Machine, ...],
    findings: Findings,
    expected: lang.Type | None = None,
    *,
    others: Mapping[str, tuple[str, lang.Type]] = MappingProxyType({}),
    chart: Chart | None = None,
) -> Condition | None:
    """Parse an expression over machines; None after a finding.

    ``others``: further names, such as ``feeder.encoder``, with the variable and the type of each;
    they take precedence. ``chart``: the chart whose constants and types are visible; by default
    those of all machines.
    """
    reader = _Reader(machines, findings, others)
    rewritten = _rewrite(text, reader)
    if reader.failed:
        return None
    scope = lang.Scope(
        variables=reader.types,
        constants=constants_of(machines) if chart is None else dict(chart.constants),
        types=types_of(machines) if chart is None else {str(t): t for t in chart.types},
        functions=reader.functions,
        tick=machines[0].chart.capacities.tick if machines else 1000,
    )
    expression = lang.type_expression(rewritten, scope, findings, expected)
    if expression is None:
        return None
    return Condition(expression, tuple(reader.atoms.items()))


def _rewrite(text: Text, reader: _Reader) -> Text:
    """Replace dotted names in a source by variables; each keeps the location of the name."""
    value, at = "", 0
    offsets: list[int] = []

    def copy(start: int, end: int) -> str:
        offsets.extend(text.span_of(n, n + 1).start for n in range(start, end))
        return text.value[start:end]

    for match in NAMES.finditer(text.value):
        variable = reader.replacement(match, text)
        if variable is None:
            continue
        value += copy(at, match.start())
        first = text.span_of(match.start(), match.start() + 1).start
        last = text.span_of(match.end() - 1, match.end()).start
        offsets.extend(min(first + n, last) for n in range(len(variable) - 1))
        offsets.append(last)
        value += variable
        at = match.end()
    value += copy(at, len(text.value))
    return Text(value, text.span, tuple(offsets))


def variables_of(chart: Chart) -> dict[str, lang.Type]:
    """Return the types of data, outputs and inputs by name."""
    return {d.name: d.type for d in (*chart.data, *chart.outputs, *chart.inputs)}


def types_of(machines: tuple[Machine, ...]) -> Mapping[str, lang.Type]:
    """Return the declared types of all machines, without names that have several definitions."""
    return _unambiguous((str(type_), type_) for m in machines for type_ in m.chart.types)


def constants_of(machines: tuple[Machine, ...]) -> Mapping[str, lang.Literal]:
    """Return the constants of all machines, without names that have several values."""
    return _unambiguous(pair for machine in machines for pair in machine.chart.constants)


def _unambiguous(pairs: Iterable[tuple[str, Binding]]) -> dict[str, Binding]:
    found: dict[str, Binding] = {}
    clashing = {name for name, meant in pairs if found.setdefault(name, meant) != meant}
    return {name: meant for name, meant in found.items() if name not in clashing}
