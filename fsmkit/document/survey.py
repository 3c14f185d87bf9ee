"""The parts of a document, collected once for all passes."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from fsmkit.diagnostics import Text
from fsmkit.document.document import DocData, Document
from fsmkit.document.walk import structure, texts


@dataclass(frozen=True)
class Survey:
    """A document with its parts: most passes find nothing to change and return it unchanged."""

    document: Document

    def update(self, document: Document) -> Survey:
        """Return the survey of a document; this one if a pass has not changed the document."""
        return self if document is self.document else Survey(document)

    @cached_property
    def parts(self) -> tuple[object, ...]:
        """The parts that can contain other parts, in order."""
        return tuple(structure(self.document))

    @cached_property
    def kinds(self) -> frozenset[type]:
        """The classes of the parts."""
        return frozenset(part.__class__ for part in self.parts)

    @cached_property
    def data(self) -> tuple[DocData, ...]:
        """The declared data, including those of states."""
        return tuple(part for part in self.parts if isinstance(part, DocData))

    @cached_property
    def texts(self) -> tuple[Text, ...]:
        """The texts, in order."""
        return tuple(texts(self.document))

    @cached_property
    def values(self) -> frozenset[str]:
        """The distinct values of the texts, which are far fewer than the texts."""
        return frozenset(text.value for text in self.texts)
