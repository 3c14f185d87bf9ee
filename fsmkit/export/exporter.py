"""What writes a closed system in the notation of another tool, a plug-in (`fsmkit.plugins`)."""

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
    """How to export: time and watchdogs as `verify.explore` takes them, and where to give up.

    ``most``: states that are explored. Where the ``deadline`` passes, `TimeUp` is raised.
    ``progress`` gets states and transitions so far, ``findings`` the properties left out.
    """

    untimed: bool = False
    silent: bool = False
    most: int = 1_000_000
    deadline: Deadline = field(default_factory=Deadline)
    progress: Callable[[int, int], None] | None = None
    findings: Findings = field(default_factory=Findings)


def leave_out(property_: Property, why: str, findings: Findings | None) -> None:
    """Report that a notation does not say a property."""
    if findings is not None:
        findings.add(
            "property-not-exported",
            f"`{property_.name}` is left out: {plain(why)}",
            property_.span,
            help=f"`fsmkit check --property {plain(property_.name)}` decides it",
        )


@contextmanager
def given_up_at(deadline: Deadline) -> Iterator[None]:
    """Report a deadline that passes within as an error (``export-too-large``)."""
    try:
        yield
    except TimeUp:
        raise fail(
            "export-too-large",
            f"nothing is exported: {deadline.why()}",
            help="give more with `--timeout`, of which compiling the explorer takes its part until "
            "it is kept, or export a smaller system",
        ) from None


@dataclass(frozen=True, slots=True)
class Exported:
    """A text, and figures of it, by name: ``states``, ``transitions``."""

    text: str
    figures: Mapping[str, int]


@runtime_checkable
class Exporter(Protocol):
    """Writes systems in one notation."""

    name: str
    summary: str
    """For whom it is: a few words for ``--help``."""

    def export(self, system: System, options: ExportOptions) -> Exported:
        """Return the text; `FsmkitError`, with a place and a way out, for what it cannot say."""
        ...


@dataclass(frozen=True, slots=True)
class Notation:
    """An exporter whose work the module ``model`` beside a plug-in does, imported when it runs."""

    name: str
    summary: str
    package: str

    def export(self, system: System, options: ExportOptions) -> Exported:
        """Return what ``export`` of that module does."""
        exported: Exported = import_module(f"{self.package}.model").export(system, options)
        return exported


@runtime_checkable
class RefinementExporter(Exporter, Protocol):
    """Writes, too, whether a chart refines another (`verify.properties.refinement`)."""

    def export_refinement(self, derived: Chart, base: Chart, options: ExportOptions) -> Exported:
        """Return the text; `FsmkitError`, with a place and a way out, for what it cannot say."""
        ...
