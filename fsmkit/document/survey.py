"""What is in a document, looked for once however many passes ask."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from fsmkit.diagnostics import Text
from fsmkit.document.document import DocData, Document
from fsmkit.document.walk import structure, texts


@dataclass(frozen=True)
class Survey:
    """A document, and what its passes look for: most find nothing and leave it as it is."""

    document: Document

    def of(self, document: Document) -> Survey:
        """Return the survey of a document, this one where a pass has changed nothing."""
        return self if document is self.document else Survey(document)

    @cached_property
    def parts(self) -> tuple[object, ...]:
        """All that can hold other parts, in order."""
        return tuple(structure(self.document))

    @cached_property
    def kinds(self) -> frozenset[type]:
        """The classes of the parts."""
        return frozenset(part.__class__ for part in self.parts)

    @cached_property
    def data(self) -> tuple[DocData, ...]:
        """All data that are declared, of states too."""
        return tuple(part for part in self.parts if isinstance(part, DocData))

    @cached_property
    def texts(self) -> tuple[Text, ...]:
        """All texts, in order."""
        return tuple(texts(self.document))

    @cached_property
    def values(self) -> frozenset[str]:
        """What the texts say, each once: far less than the texts."""
        return frozenset(text.value for text in self.texts)
