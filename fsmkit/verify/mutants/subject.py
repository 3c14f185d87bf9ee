"""The file whose mutants are evaluated: all its changes, and the system with each of them."""

from __future__ import annotations

import random
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from itertools import zip_longest
from pathlib import Path

from fsmkit.chart.chart import Chart
from fsmkit.chart.loading import elaborated, read_documents
from fsmkit.diagnostics import Findings, Span
from fsmkit.emit import guard, telling
from fsmkit.system.any_file import NONE, load_any
from fsmkit.system.machine import OBSERVED, EventLink, InputLink, Machine, port_name
from fsmkit.system.machines import Replacement
from fsmkit.system.of_one_chart import system_of_chart
from fsmkit.system.parameters import with_set_constants
from fsmkit.system.system import System
from fsmkit.verify.mutants.operators import Documents, mutations

CONNECTION = "connection dropped"
SEEN_BY_OTHERS = (
    "events", "data", "inputs", "outputs", "operations", "types", "constants", "functions",
    "properties", "environment",
)  # fmt: skip
"""The parts of a chart, beside its states, on which the meaning of a system file depends."""


@dataclass(frozen=True, slots=True)
class Mutant:
    """One change. ``documents``: of the chart of its machine; None for a connection, see ``link``.

    ``owner``: as for `operators.Mutation`.
    """

    machine: str
    operator: str
    what: str
    place: Span | None = field(default=None, compare=False, repr=False)
    documents: Documents | None = field(default=None, compare=False, repr=False)
    owner: Span | None = field(default=None, compare=False, repr=False)
    link: EventLink | InputLink | None = None

    def __post_init__(self) -> None:
        guard(self, "machine", "what")

    @property
    def identity(self) -> tuple[object, ...]:
        """The same for the same change of the same file, in every system that contains it."""
        if self.documents is None or self.place is None:
            return self.operator, self.what
        file = Path(self.place.source.name).resolve()
        return self.machine, self.operator, self.what, file, self.place.start


@dataclass(frozen=True)
class Subject:
    """A system, or a chart alone, and the options for reading it."""

    path: Path
    system: System
    replacing: Mapping[str, Replacement]
    strict: bool
    parameters: Mapping[str, str]
    charts: dict[str, Chart] = field(default_factory=dict, compare=False, repr=False)
    """By machine, its chart as its documents alone make it."""

    @staticmethod
    def read(
        path: Path,
        findings: Findings,
        replacing: Mapping[str, Replacement] | None = None,
        *,
        strict: bool = False,
        parameters: Mapping[str, str] = NONE,
    ) -> Subject:
        """Read as `fsmkit.system.any_file.load_any` does. Raises `FsmkitError` if that fails."""
        system = load_any(path, findings, replacing, strict=strict, parameters=parameters)
        return Subject(path, system, replacing or {}, strict, parameters)

    def changed(self, mutant: Mutant) -> System:
        """Return the system with one change. Raises `FsmkitError` if it cannot be elaborated."""
        if mutant.documents is None:
            return _without(self.system, mutant.link)
        findings = Findings()
        if self.system.of_chart:
            given = with_set_constants(mutant.documents, self.parameters, findings)
            return system_of_chart(elaborated(given, findings, strict=self.strict))
        chart = elaborated(mutant.documents, findings, strict=self.strict)
        return self._with(mutant.machine, chart) or load_any(
            self.path,
            findings,
            {**self.replacing, mutant.machine: mutant.documents},
            strict=self.strict,
            parameters=self.parameters,
        )

    def _with(self, name: str, chart: Chart) -> System | None:
        """Return the system with this chart for a machine, without reading all again.

        None if the system refers to more than the chart, or if another part of the system could
        change its meaning.
        """
        machines = self.system.machines
        own = {n for n, m in enumerate(machines) if name in (m.name, m.place and m.place[0])}
        if name not in self.charts:
            self.charts[name] = elaborated(self.documents()[name], Findings(), strict=self.strict)
        original = self.charts[name]
        if any(machines[n].chart != original for n in own):
            return None
        if any(getattr(original, part) != getattr(chart, part) for part in SEEN_BY_OTHERS):
            return None
        if [(s.id, s.parent) for s in original.states] != [(s.id, s.parent) for s in chart.states]:
            return None
        return replace(
            self.system,
            machines=tuple(
                replace(each, chart=chart) if n in own else each for n, each in enumerate(machines)
            ),
        )

    def machines(self) -> dict[str, Machine]:
        """Return the machines whose charts are changed, an array by its name.

        Those of the environment model the surroundings, which no property is about. They are
        changed only if there are no others.
        """
        own = [m for m in self.system.machines if not (m.is_channel or m.is_monitor)]
        of_interest = [m for m in own if not m.environment] or own
        return {(m.place[0] if m.place else m.name): m for m in reversed(of_interest)}

    def documents(self) -> dict[str, Documents]:
        """Return the source chart of each machine, and its bases."""
        found: dict[str, Documents] = {}
        for name, machine in reversed(self.machines().items()):
            given = self.replacing.get(name)
            if isinstance(given, tuple):
                found[name] = given
            else:
                found[name] = read_documents(Path(machine.chart.sources[0].name), Findings())
        return found

    def mutants(self, documents: Mapping[str, Documents], seed: int) -> list[Mutant]:
        """Return every change, in an order that alternates machines and operators."""
        groups: dict[tuple[str, str], list[Mutant]] = {}
        machines = self.machines()
        for name, own in documents.items():
            for m in mutations(own, machines[name].chart):
                mutant = Mutant(name, m.operator, m.what, m.place, m.documents, m.owner)
                groups.setdefault((name, m.operator), []).append(mutant)
        for mutant in _connections(self.system, machines):
            groups.setdefault((mutant.machine, mutant.operator), []).append(mutant)
        chance = random.Random(seed)  # noqa: S311  (a sample, no secret)
        shuffled = list(groups.values())
        chance.shuffle(shuffled)
        for group in shuffled:
            chance.shuffle(group)
        turns = zip_longest(*shuffled)
        return [mutant for turn in turns for mutant in turn if mutant is not None]


def _without(system: System, link: EventLink | InputLink | None) -> System:
    return replace(
        system,
        event_links=tuple(each for each in system.event_links if each is not link),
        input_links=tuple(each for each in system.input_links if each is not link),
    )


def _connections(system: System, machines: Mapping[str, Machine]) -> Iterator[Mutant]:
    """Yield the system without one connection, for the machine at its end that is changed."""
    known = {id(machine): name for name, machine in machines.items()}
    links: list[EventLink | InputLink] = [*system.event_links, *system.input_links]
    for link in links:
        ends = [system.machines[n] for n in (link.source, link.target)]
        if any(end.is_channel or end.is_monitor for end in ends):
            continue
        of = next((known[id(end)] for end in ends if id(end) in known), None)
        if of is not None and (not isinstance(link, EventLink) or link.port < OBSERVED):
            yield Mutant(of, CONNECTION, _named(link, *ends), ends[0].span, link=link)


@telling
def _named(link: EventLink | InputLink, source: Machine, target: Machine) -> str:
    if isinstance(link, EventLink):
        event = target.chart.events[link.event].name
        return f"`{source.name}.{port_name(source.chart, link.port)} -> {target.name}.{event}`"
    outputs = [variable.name for variable in source.chart.outputs]
    inputs = [variable.name for variable in target.chart.inputs]
    if link.output < len(outputs) and link.input < len(inputs):
        return f"`{source.name}.{outputs[link.output]} -> {target.name}.{inputs[link.input]}`"
    return f"what `{source.name}` and `{target.name}` share"
