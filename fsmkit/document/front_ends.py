"""The protocols of front ends: readers and writers of notations for charts."""

from __future__ import annotations

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
