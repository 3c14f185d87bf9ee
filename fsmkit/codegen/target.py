"""The protocols of targets: what writes machines in one language."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Protocol, runtime_checkable

from fsmkit.diagnostics import Findings

if TYPE_CHECKING:
    from fsmkit.chart.chart import Chart
    from fsmkit.system.system import System


@dataclass(frozen=True, slots=True)
class Generated:
    """What a target made: texts by relative path, and the figures it states of them."""

    files: Mapping[str, str]
    figures: Mapping[str, int]
    """For instance ``struct_bytes``, ``timers``; printed by ``compile`` and its JSON."""
    built: Mapping[str, bytes] = field(default_factory=dict)
    """What was built of the texts, by relative path, if requested."""


@runtime_checkable
class Target(Protocol):
    """Writes machines in one language."""

    name: str
    summary: str
    """One line for ``fsmkit targets``."""
    options: tuple[str, ...]
    """The names of the options that `generate` takes."""

    def generate(
        self, chart: Chart, findings: Findings, options: Mapping[str, str]
    ) -> Generated | None:
        """Return the files to write, or None after saying what the target cannot express."""
        ...


@runtime_checkable
class SystemTarget(Target, Protocol):
    """Writes the machines of a system with their connections, too."""

    def generate_system(
        self, system: System, findings: Findings, options: Mapping[str, str]
    ) -> Generated | None:
        """Return the files of a `System`, or None after saying what cannot be expressed."""
        ...
