"""Machines of the library `transitions` as a plug-in: read, not written."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from fsmkit.diagnostics import Findings, Source
    from fsmkit.document.document import Document


class Transitions:
    """Reads configurations, and objects in Python modules."""

    name = "transitions"
    suffixes = (".json", ".transitions.yaml", ".transitions.yml")

    def decode(self, content: bytes, name: str, findings: Findings) -> Source | None:
        """Return the text of a file."""
        from fsmkit.yaml.encoding import decode

        return decode(content, name, findings)

    def read(self, source: Source, findings: Findings) -> Document | None:
        """Return the document of a configuration."""
        from fsmkit.foreign.pytransitions.meaning import document_of
        from fsmkit.foreign.pytransitions.reader import read_machine
        from fsmkit.yaml.nodes import read_nodes

        root = read_nodes(source, findings)
        machine = None if root is None else read_machine(root, source, findings)
        return None if machine is None else document_of(machine, findings)

    def read_object(self, found: object, name: str, findings: Findings) -> Document | None:
        """Return the document of a machine or a dictionary; None for other objects."""
        from fsmkit.foreign.pytransitions.objects import source_of

        source = source_of(found, name, findings)
        return None if source is None else self.read(source, findings)


PLUGIN = Transitions()
