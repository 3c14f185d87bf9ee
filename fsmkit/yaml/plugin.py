"""The YAML notation as a plug-in."""

from __future__ import annotations

from fsmkit.diagnostics import Findings, Source
from fsmkit.model.document import Document
from fsmkit.yaml.encoding import decode
from fsmkit.yaml.reader import read_document
from fsmkit.yaml.writer import write_document


class Yaml:
    """Reads and writes YAML."""

    name = "yaml"
    suffixes = (".yaml", ".yml")

    def decode(self, content: bytes, name: str, findings: Findings) -> Source | None:
        """Return the text of a file."""
        return decode(content, name, findings)

    def read(self, source: Source, findings: Findings) -> Document | None:
        """Return the document of a text."""
        return read_document(source, findings)

    def write(self, document: Document) -> str:
        """Return a document as YAML."""
        return write_document(document)


PLUGIN = Yaml()
