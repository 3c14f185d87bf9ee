"""The protocols of front ends: readers and writers of notations for charts."""

from __future__ import annotations

from dataclasses import dataclass
from importlib import import_module
from types import ModuleType
from typing import TYPE_CHECKING, Protocol, runtime_checkable

from fsmkit.diagnostics import Findings, Source

if TYPE_CHECKING:
    from fsmkit.document.document import Document


@runtime_checkable
class Reader(Protocol):
    """Reads one notation."""

    name: str
    suffixes: tuple[str, ...]

    def decode(self, content: bytes, name: str, findings: Findings) -> Source | None:
        """Return the text of a file, decoded by the rules of the notation."""
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


@dataclass(frozen=True, slots=True)
class Notation:
    """A front end that is a package: ``reader``, ``writer`` and a module that decodes files.

    They are imported when they are needed.
    """

    name: str
    suffixes: tuple[str, ...]
    package: str
    decoder: str

    def decode(self, content: bytes, name: str, findings: Findings) -> Source | None:
        """Return the text of a file, decoded by the rules of the notation."""
        source: Source | None = self._module(self.decoder).decode(content, name, findings)
        return source

    def read(self, source: Source, findings: Findings) -> Document | None:
        """Return the document, or None where an error was found."""
        document: Document | None = self._module("reader").read_document(source, findings)
        return document

    def write(self, document: Document) -> str:
        """Return the text of a document, readable back to an equal Chart."""
        text: str = self._module("writer").write_document(document)
        return text

    def _module(self, name: str) -> ModuleType:
        return import_module(f"{self.package}.{name}")


@runtime_checkable
class ObjectReader(Protocol):
    """Reads Python objects that are machines."""

    def read_object(self, found: object, name: str, findings: Findings) -> Document | None:
        """Return the document, or None after reporting an error; ``name`` is the reference."""
        ...
