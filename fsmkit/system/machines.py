"""Read the machines of a system file: charts, arrays of them, and constants of each.

``feeder: feeder.yaml``, ``"guard[i in 0..2]": {chart: guard.yaml, with: {id: i}}``, also with
``start: {tries: any}``.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

from fsmkit.chart.chart import Chart
from fsmkit.chart.elaborate import elaborate
from fsmkit.chart.loading import named_file, read_bytes, read_documents
from fsmkit.diagnostics import Findings, FsmkitError, Text
from fsmkit.diagnostics.suggestions import suggest
from fsmkit.document.document import Document
from fsmkit.document.keys import MACHINE
from fsmkit.system.indices import DECLARED, MOST_ELEMENTS, index_range, substitute_indices
from fsmkit.system.machine import Machine
from fsmkit.system.starts import with_start_values
from fsmkit.yaml.nodes import Mapping as MappingNode
from fsmkit.yaml.nodes import Node, entries_of, require_record, require_text

Replacement = Path | tuple[Document, ...]
"""A chart that a machine runs instead of the one its line names: a file, or what one holds."""


@dataclass(frozen=True, slots=True)
class _Declared:
    """A line under ``machines``: the chart, values of its constants and start values."""

    chart: Text
    given: tuple[tuple[Text, Text], ...] = ()
    start: tuple[tuple[Text, Text], ...] = ()


@dataclass(slots=True)
class _Reader:
    folder: Path
    replacing: Mapping[str, Replacement]
    findings: Findings
    strict: bool
    documents: dict[Path, tuple[Document, ...]] = field(default_factory=dict)
    charts: dict[tuple[Path | int, tuple[tuple[str, str], ...]], Chart] = field(
        default_factory=dict
    )

    def read(self, name: Text, node: Node) -> Iterator[Machine]:
        """Yield the machines of a line: one, or those of an array."""
        if name.value.isidentifier():
            declared = self.declared(node)
            machine = None if declared is None else self.machine(name, name.value, declared, {})
            if machine is not None:
                yield machine
            return
        match = DECLARED.fullmatch(name.value)
        if match is None:
            self.findings.add(
                "unexpected-shape",
                f"`{name}` is no name for a machine",
                name,
                help="use letters, digits and `_`; for several write "
                f"`{name.value.partition('[')[0]}[i in 0..2]`",
            )
            return
        run = index_range(name.part(*match.span(3)), name.part(*match.span(4)), self.findings)
        declared = self.declared(node)
        if declared is None or run is None:
            return
        for index in run:
            element = f"{match[1]}[{index}]"
            machine = self.machine(name, element, declared, {match[2]: index}, match[1])
            if machine is not None:
                yield replace(machine, place=(match[1], index))

    def declared(self, node: Node) -> _Declared | None:
        """Return the declaration of a line; None after a finding."""
        if not isinstance(node, MappingNode):
            chart = require_text(node, "the chart of a machine", self.findings)
            return None if chart is None else _Declared(chart)
        parts = require_record(node, MACHINE, "a machine", self.findings) or {}
        if "chart" not in parts:
            self.findings.add(
                "unexpected-shape", "a machine needs `chart`, the path of its chart", node.span,
                help="write `{chart: gate.yaml}`",
            )  # fmt: skip
            return None
        chart = require_text(parts["chart"], "the chart of a machine", self.findings)
        given, start = (
            tuple(
                (name, text)
                for name, value in entries_of(parts.get(key), f"`{key}`", self.findings)
                if (text := require_text(value, f"{what} `{name}`", self.findings)) is not None
            )
            for key, what in (("with", "the constant"), ("start", "the start value of"))
        )
        return None if chart is None else _Declared(chart, given, start)

    def machine(
        self,
        name: Text,
        full: str,
        declared: _Declared,
        indices: Mapping[str, int],
        array: str = "",
    ) -> Machine | None:
        """Return the machine of that full name; None after a finding."""
        file = self.replacing.get(full) or self.replacing.get(array)
        given = tuple((key, substitute_indices(value, indices)) for key, value in declared.given)
        own = named_file(self.folder / "system", declared.chart.value)
        chart = self._chart(file or own, declared, given, file is None)
        if chart is None:
            return None
        if chart.abstract:
            self.findings.add(
                "abstract-machine",
                f"the chart `{chart.name}` of `{full}` is abstract",
                declared.chart,
                help="name a chart that extends it",
            )
        machine = Machine(full, chart, span=name.span)
        start = tuple((key, substitute_indices(value, indices)) for key, value in declared.start)
        return with_start_values(machine, start, self.findings) if start else machine

    def _chart(
        self,
        file: Replacement,
        declared: _Declared,
        given: tuple[tuple[Text, Text], ...],
        is_named: bool,
    ) -> Chart | None:
        identity = file if isinstance(file, Path) else id(file)
        key = identity, tuple((name.value, value.value) for name, value in given)
        if key in self.charts:
            return self.charts[key]
        own = Findings()
        try:
            documents = self._documents(file, declared.chart if is_named else None, own)
            for name, value in given:
                documents = with_constant(documents, name, value, own)
            own.stop_on_errors()
            chart = elaborate(documents, own, strict=self.strict)
            own.stop_on_errors()
        except FsmkitError as error:
            self.findings.extend(error.diagnostics)
            return None
        if not given:  # warnings for these constants need not apply to the chart
            self.findings.extend(own)
        if chart is not None:
            self.charts[key] = chart
        return chart

    def _documents(
        self, file: Replacement, named: Text | None, findings: Findings
    ) -> tuple[Document, ...]:
        if isinstance(file, tuple):
            return file
        if file not in self.documents:
            read_bytes(file, named)
            self.documents[file] = read_documents(file, findings)
        return self.documents[file]


def with_constant(
    documents: tuple[Document, ...], name: Text, value: Text, findings: Findings
) -> tuple[Document, ...]:
    """Return a chart (its document, then its bases) in which a constant has another value."""
    for place, document in enumerate(documents):
        if any(constant.name == name for constant in document.constants):
            constants = tuple(
                replace(constant, value=value) if constant.name == name else constant
                for constant in document.constants
            )
            changed = replace(document, constants=constants)
            return (*documents[:place], changed, *documents[place + 1 :])
    known = [constant.name.value for d in documents for constant in d.constants]
    findings.add(
        "unknown-name",
        f"the chart `{documents[0].name}` has no constant `{name}`",
        name,
        help=suggest(name.value, known, "declare it under `constants` there"),
    )
    return documents


def read_machines(
    node: Node | None,
    folder: Path,
    replacing: Mapping[str, Replacement],
    findings: Findings,
    *,
    strict: bool = False,
) -> tuple[Machine, ...]:
    """Read all machines; the paths of charts are relative to ``folder``."""
    reader = _Reader(folder, replacing, findings, strict)
    found: list[Machine] = []
    first: dict[str, Machine] = {}
    for name, value in entries_of(node, "`machines`", findings):
        for machine in reader.read(name, value):
            _require_new(machine, name, first, findings)
            found.append(machine)
    if len(found) > MOST_ELEMENTS:
        findings.add(
            "not-explored-yet",
            f"{len(found)} machines in one system are too many to explore",
            None if node is None else node.span,
            help=f"keep to {MOST_ELEMENTS}",
        )
    _require_replaced(replacing, found, findings)
    return tuple(found)


def read_machine(
    name: Text, node: Node, folder: Path, findings: Findings, *, strict: bool = False
) -> Machine | None:
    """Read one machine, given as its chart or with constants for it."""
    reader = _Reader(folder, {}, findings, strict)
    declared = reader.declared(node)
    return None if declared is None else reader.machine(name, name.value, declared, {})


def _require_new(
    machine: Machine, name: Text, first: dict[str, Machine], findings: Findings
) -> None:
    """Report a repeated name; ``first``: the first machine of each name."""
    array = machine.name if machine.place is None else machine.place[0]
    other = first.setdefault(array, machine)
    if other.span != machine.span:
        findings.add(
            "duplicate-name",
            f"there are two machines `{array}`",
            name,
            secondary=[] if other.span is None else [(other.span, "the first")],
            help="rename one of them",
        )


def _require_replaced(
    replacing: Mapping[str, Replacement], machines: list[Machine], findings: Findings
) -> None:
    known = dict.fromkeys(machine.name for machine in machines)
    known |= dict.fromkeys(m.place[0] for m in machines if m.place is not None)
    for name in replacing if not findings.has_errors else ():
        if name not in known:
            hint = suggest(name, known)
            findings.add(
                "no-such-machine",
                f"there is no machine `{name}` to replace",
                None,
                help=f"{f'{hint} ' if hint else ''}there are {', '.join(known)}",
            )
