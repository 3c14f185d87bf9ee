"""The protocols of targets, which generate machines in one language."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Protocol, runtime_checkable

from fsmkit.diagnostics import Findings, fail

if TYPE_CHECKING:
    from fsmkit.chart.chart import Chart
    from fsmkit.system.system import System

EXTRAS = {
    "save": "methods that save the machine to bytes and restore it",
    "records": "records of its steps for a live trace",
    "coverage": "coverage counters",
}
"""Parts that the option ``with`` adds to a machine, and what they are."""


def named_parts(
    options: Mapping[str, str], option: str, known: Mapping[str, str]
) -> frozenset[str]:
    """Return the parts that an option lists, separated by commas.

    Args:
        options: The options of a target, by name.
        option: The name of the option: ``with`` or ``without``.
        known: The parts that there are, with their meanings.

    Raises:
        FsmkitError: With `unknown-part` for a part that is not known.

    """
    listed = (name.strip() for name in options.get(option, "").split(","))
    found = frozenset(filter(None, listed))
    for name in sorted(found - known.keys()):
        verb = "omit" if option == "without" else "add"
        parts = "; ".join(f"`{each}`: {meaning}" for each, meaning in known.items())
        raise fail(
            "unknown-part", f"there is no part `{name}` to {verb}", help=f"known are {parts}"
        )
    return found


@dataclass(frozen=True, slots=True)
class Generated:
    """The output of a target: texts by relative path, and their figures."""

    files: Mapping[str, str]
    figures: Mapping[str, int]
    """For instance ``struct_bytes``, ``timers``; printed by ``compile`` and its JSON."""
    built: Mapping[str, bytes] = field(default_factory=dict)
    """Built files by relative path, if requested."""


@runtime_checkable
class Target(Protocol):
    """Generates machines in one language."""

    name: str
    summary: str
    """One line for ``fsmkit targets``."""
    options: tuple[str, ...]
    """The names of the options that `generate` takes."""

    def generate(
        self, chart: Chart, findings: Findings, options: Mapping[str, str]
    ) -> Generated | None:
        """Return the files, or None after reporting the unsupported parts of the chart."""
        ...


@runtime_checkable
class SystemTarget(Target, Protocol):
    """Generates the machines of a system together with their connections."""

    def generate_system(
        self, system: System, findings: Findings, options: Mapping[str, str]
    ) -> Generated | None:
        """Return the files of a `System`, or None after reporting its unsupported parts."""
        ...
