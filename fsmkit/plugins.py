"""Plug-ins: found by looking, never listed.

A folder under ``fsmkit`` that holds a ``plugin.py`` is a plug-in; the module defines one constant,
``PLUGIN``. Packages outside this tree register theirs as entry points of the group
``fsmkit.plugins``. Such a module imports what does the work within the methods that do it, as all
plug-ins are imported to find one.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from functools import cache
from importlib import import_module
from importlib.machinery import PathFinder
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol, TypeVar, runtime_checkable

from fsmkit.diagnostics import Findings, Source, Text, fail

if TYPE_CHECKING:
    from fsmkit.chart.chart import Chart
    from fsmkit.document.document import Document

GROUP = "fsmkit.plugins"
"""The group of entry points that plug-ins of other packages are registered in."""
POINTS = "entry_points.txt"


@runtime_checkable
class Reader(Protocol):
    """Reads one notation."""

    name: str
    suffixes: tuple[str, ...]

    def decode(self, content: bytes, name: str, findings: Findings) -> Source | None:
        """Return the text of a file, by the notation's own rules of encoding."""
        ...

    def read(self, source: Source, findings: Findings) -> Document | None:
        """Return the document, or None where an error was found."""
        ...


@runtime_checkable
class FrontEnd(Reader, Protocol):
    """Reads and writes one notation."""

    def write(self, document: Document) -> str:
        """Return the text of a document, readable back to an equal Chart."""
        ...


@runtime_checkable
class ObjectReader(Protocol):
    """Reads objects of Python that are machines."""

    def read_object(self, found: object, name: str, findings: Findings) -> Document | None:
        """Return the document, or None after saying why not; ``name`` is how it was named."""
        ...


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
        self, system: Any, findings: Findings, options: Mapping[str, str]
    ) -> Generated | None:
        """Return the files of a `System`, or None after saying what cannot be expressed."""
        ...


@runtime_checkable
class Drawing(Protocol):
    """Draws a chart in one notation of text."""

    name: str
    suffixes: tuple[str, ...]

    def draw(self, chart: Chart, active: frozenset[int]) -> str:
        """Return the text of a diagram in which the given states stand out."""
        ...


@dataclass(frozen=True, slots=True)
class Notation:
    """A drawing that the module ``draw`` beside a plug-in makes, imported when it is needed."""

    name: str
    suffixes: tuple[str, ...]
    package: str

    def draw(self, chart: Chart, active: frozenset[int]) -> str:
        """Return a diagram in which the given states stand out."""
        text: str = import_module(f"{self.package}.draw").draw(chart, active)
        return text


Kind = TypeVar("Kind")


def plugin(kind: type[Kind], name: str) -> Kind:
    """Return the plug-in of that protocol and name; `FsmkitError` that lists those there are."""
    found = {candidate.name: candidate for candidate in plugins(kind)}  # type: ignore[attr-defined]
    if name not in found:
        known = ", ".join(sorted(found))
        raise fail(
            "unknown-plugin", f"there is no {kind.__name__.lower()} `{name}`", help=f"use {known}"
        )
    return found[name]


def plugins(kind: type[Kind]) -> tuple[Kind, ...]:
    """Return every plug-in of a protocol, in order of name."""
    return tuple(candidate for candidate in _all() if isinstance(candidate, kind))


def plugin_for(kind: type[Kind], path: Path, at: Text | None = None) -> Kind:
    """Return the plug-in of that protocol for the suffix of a file; ``at`` is what names it."""
    by_suffix = {s: p for p in plugins(kind) for s in p.suffixes}  # type: ignore[attr-defined]
    fitting = [suffix for suffix in by_suffix if path.name.lower().endswith(suffix)]
    if not fitting:
        known = ", ".join(sorted(by_suffix))
        raise fail(
            "unknown-suffix",
            f"the suffix `{path.suffix.lower()}` of `{path.name}` tells no notation",
            at,
            help=f"use one of {known}",
        )
    return by_suffix[max(fitting, key=len)]


@cache
def _all() -> tuple[Any, ...]:
    return tuple(sorted(_find(), key=lambda found: found.name))


def _find() -> Iterator[Any]:
    root = Path(__file__).parent
    for path in sorted(root.rglob("plugin.py")):
        module = ".".join((__package__ or "", *path.relative_to(root).with_suffix("").parts))
        yield import_module(module).PLUGIN
    if not _may_be_registered():
        return
    from importlib.metadata import entry_points  # and with it all of `email`

    for entry_point in entry_points(group=GROUP):
        yield entry_point.load()


def _may_be_registered() -> bool:
    """Whether a package may have registered a plug-in: whether an entry point names the group.

    Where packages are not all folders and files, as in archives, the answer is yes.
    """
    others = (finder for finder in sys.meta_path if finder is not PathFinder)
    if any(hasattr(finder, "find_distributions") for finder in others):
        return True
    for folder in dict.fromkeys(path or "." for path in sys.path):
        try:
            names = os.listdir(folder)  # noqa: PTH208  (in a fifth of the time of `Path`)
        except FileNotFoundError:
            continue
        except OSError:
            return True
        for name in names:
            if not name.endswith((".dist-info", ".egg-info", ".egg")):
                continue
            if name.endswith(".egg") or _names_group(os.path.join(folder, name, POINTS)):  # noqa: PTH118
                return True
    return False


def _names_group(file: str) -> bool:
    try:
        with open(file, "rb") as opened:  # noqa: PTH123
            return GROUP.encode() in opened.read()
    except OSError:  # most packages have none
        return False
