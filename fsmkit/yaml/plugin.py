"""The YAML notation as a plug-in."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from fsmkit.diagnostics import Findings, Source
    from fsmkit.document.document import Document


class Yaml:
    """Reads and writes YAML."""

    name = "yaml"
    suffixes = (".yaml", ".yml")

    def decode(self, content: bytes, name: str, findings: Findings) -> Source | None:
        """Return the text of a file."""
        from fsmkit.yaml.encoding import decode

        return decode(content, name, findings)

    def read(self, source: Source, findings: Findings) -> Document | None:
        """Return the document of a text."""
        from fsmkit.yaml.reader import read_document

        return read_document(source, findings)

    def write(self, document: Document) -> str:
        """Return a document as YAML."""
        from fsmkit.yaml.writer import write_document

        return write_document(document)


PLUGIN = Yaml()
