"""The protocols of front ends: readers and writers of notations for charts."""

from __future__ import annotations

from contextvars import ContextVar
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Protocol, runtime_checkable

from fsmkit.diagnostics import Findings, Source, Text, fail
from fsmkit.plugins import plugin, plugin_for, plugins

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
class Recognizer(Protocol):
    """A reader that shares a suffix with others and recognizes its files by their content."""

    name: str

    def recognizes(self, content: bytes) -> bool:
        """Return whether the content of a file is in this notation."""
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


@dataclass(frozen=True, slots=True)
class Selection:
    """The notation that the user selects by name, and one of several machines of a file."""

    reader: str | None = None
    machine: str | None = None


SELECTED: ContextVar[Selection] = ContextVar("selected", default=Selection())  # noqa: B039
"""The selection of the command line."""


def reader_for(path: Path, content: bytes, at: Text | None = None) -> Reader:
    """Return the reader of a file, by its suffix and, if readers share it, by its content.

    A reader without ``recognizes`` has the files that no other reader recognizes. Raises
    `FsmkitError` if no reader has the suffix, or several recognize the content.
    """
    wanted = SELECTED.get().reader
    if wanted is not None and at is None:
        return plugin(Reader, wanted)
    first = plugin_for(Reader, path, at)
    suffix = max((s for s in first.suffixes if path.name.lower().endswith(s)), key=len)
    sharing = [reader for reader in plugins(Reader) if suffix in reader.suffixes]
    if len(sharing) == 1:
        return first
    recognizing = {r.name: r.recognizes(content) for r in plugins(Recognizer)}
    marked = [reader for reader in sharing if recognizing.get(reader.name)]
    found = marked or [r for r in sharing if r.name not in recognizing] or sharing
    if len(found) == 1:
        return found[0]
    names = ", ".join(f"`{reader.name}`" for reader in found)
    raise fail(
        "ambiguous-notation",
        f"`{path.name}` may be in several notations: {names}",
        at,
        help="name one with `fsmkit convert --from NAME`",
    )
