"""Readers of machines of other tools, as plug-ins."""

from __future__ import annotations

import re
from dataclasses import dataclass
from importlib import import_module
from types import ModuleType
from typing import TYPE_CHECKING

from fsmkit.diagnostics import Findings, Source, Span
from fsmkit.document.front_ends import SELECTED

if TYPE_CHECKING:
    from fsmkit.document.document import Document
    from fsmkit.foreign.imports import Import

SEARCHED = 1 << 16
"""Bytes at the start of a file that are searched for the marks of a notation."""


@dataclass(frozen=True, slots=True)
class ForeignNotation:
    """A reader that is a package: its module ``reader`` is imported when it is needed.

    The module defines ``machines(source, findings)``, which returns the names of the machines in a
    source, and ``import_machine(source, machine, findings)``, which returns an `Import` or None. A
    function ``decode(content, name, findings)`` is optional; by default a file is UTF-8 or UTF-16.
    """

    name: str
    suffixes: tuple[str, ...]
    package: str
    marks: str = ""
    """A regular expression that the start of a file contains, if other readers share a suffix."""

    def recognizes(self, content: bytes) -> bool:
        """Return whether the start of a file has the marks of this notation."""
        return re.search(self.marks.encode(), content[:SEARCHED]) is not None

    def decode(self, content: bytes, name: str, findings: Findings) -> Source | None:
        """Return the text of a file."""
        own = getattr(self._reader(), "decode", None)
        if own is None:
            from fsmkit.yaml.encoding import decode

            return decode(content, name, findings)
        source: Source | None = own(content, name, findings)
        return source

    def machines(self, source: Source, findings: Findings) -> tuple[str, ...]:
        """Return the names of the machines in a source, in their order."""
        found: tuple[str, ...] = self._reader().machines(source, findings)
        return found

    def import_machine(self, source: Source, machine: str, findings: Findings) -> Import | None:
        """Return a machine, or None where the whole of it is rejected."""
        found: Import | None = self._reader().import_machine(source, machine, findings)
        return found

    def import_selected(self, source: Source, findings: Findings) -> Import | None:
        """Return the only machine of a source, or the one that ``--machine`` names."""
        found = self.machines(source, findings)
        wanted = SELECTED.get().machine
        if findings.has_errors and not found:
            return None
        if wanted in found or (wanted is None and len(found) == 1):
            return self.import_machine(source, wanted or found[0], findings)
        whole = Span(source, 0, 0)
        if not found:
            findings.add("foreign-syntax", f"`{source.name}` holds no machine", whole,
                         help="draw a machine, or name another file")  # fmt: skip
        else:
            names = ", ".join(f"`{name}`" for name in found[:20])
            findings.add(
                "several-machines",
                f"`{source.name}` holds no machine `{wanted}`"
                if wanted is not None
                else f"`{source.name}` holds {len(found)} machines",
                whole,
                help=f"choose one with `--machine`: {names}",
            )
        return None

    def read(self, source: Source, findings: Findings) -> Document | None:
        """Return the document of the only machine, or of the one that ``--machine`` names."""
        found = self.import_selected(source, findings)
        return None if found is None else found.document

    def _reader(self) -> ModuleType:
        return import_module(f"{self.package}.reader")
