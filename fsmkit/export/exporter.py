"""The protocol of exporters: plug-ins that write a closed system in another notation."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from importlib import import_module
from typing import Protocol, runtime_checkable

from fsmkit.chart.chart import Chart
from fsmkit.diagnostics import Findings, fail
from fsmkit.emit import plain
from fsmkit.system.properties.property import Property
from fsmkit.system.system import System
from fsmkit.verify.resources.deadline import Deadline, TimeUp


@dataclass(frozen=True, slots=True)
class ExportOptions:
    """How to export: time and watchdogs as for `verify.explore`, and limits.

    ``most``: the maximum number of explored states. After the ``deadline``, `TimeUp` is raised.
    ``progress`` is called with states and transitions so far; ``findings`` receives omitted
    properties.
    """

    untimed: bool = False
    silent: bool = False
    most: int = 1_000_000
    deadline: Deadline = field(default_factory=Deadline)
    progress: Callable[[int, int], None] | None = None
    findings: Findings = field(default_factory=Findings)


def report_omitted(property_: Property, why: str, findings: Findings | None) -> None:
    """Report that a notation cannot express a property."""
    if findings is not None:
        findings.add(
            "property-not-exported",
            f"`{property_.name}` is omitted: {plain(why)}",
            property_.span,
            help=f"`fsmkit check --property {plain(property_.name)}` decides it",
        )


@contextmanager
def export_deadline(deadline: Deadline) -> Iterator[None]:
    """Report a deadline that passes in the body as an error (``export-too-large``)."""
    try:
        yield
    except TimeUp:
        raise fail(
            "export-too-large",
            f"nothing is exported: {deadline.why()}",
            help="increase `--timeout`, which includes compiling the explorer until "
            "it is cached, or export a smaller system",
        ) from None


@dataclass(frozen=True, slots=True)
class ExportedModel:
    """A text, and its figures by name: ``states``, ``transitions``."""

    text: str
    figures: Mapping[str, int]


@runtime_checkable
class Exporter(Protocol):
    """Writes systems in one notation."""

    name: str
    summary: str
    """For whom it is: a few words for ``--help``."""

    def export(self, system: System, options: ExportOptions) -> ExportedModel:
        """Return the text. Raises `FsmkitError` with location and fix for unsupported features."""
        ...


@dataclass(frozen=True, slots=True)
class Notation:
    """An exporter implemented by the module ``model`` beside its plug-in, imported on use."""

    name: str
    summary: str
    package: str

    def export(self, system: System, options: ExportOptions) -> ExportedModel:
        """Return the result of that module's ``export``."""
        exported: ExportedModel = import_module(f"{self.package}.model").export(system, options)
        return exported


@runtime_checkable
class RefinementExporter(Exporter, Protocol):
    """An exporter that also writes refinements (`verify.properties.refinement`)."""

    def export_refinement(
        self, derived: Chart, base: Chart, options: ExportOptions
    ) -> ExportedModel:
        """Return the text. Raises `FsmkitError` with location and fix for unsupported features."""
        ...
