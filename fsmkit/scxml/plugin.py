"""The SCXML notation as a plug-in."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from fsmkit.diagnostics import Findings, Source
    from fsmkit.document.document import Document


class Scxml:
    """Reads and writes SCXML."""

    name = "scxml"
    suffixes = (".scxml", ".xml")

    def decode(self, content: bytes, name: str, findings: Findings) -> Source | None:
        """Return the text of a file."""
        from fsmkit.scxml.nodes import decode

        return decode(content, name, findings)

    def read(self, source: Source, findings: Findings) -> Document | None:
        """Return the document of a text."""
        from fsmkit.scxml.reader import read_document

        return read_document(source, findings)

    def write(self, document: Document) -> str:
        """Return a document as SCXML."""
        from fsmkit.scxml.writer import write_document

        return write_document(document)


PLUGIN = Scxml()
