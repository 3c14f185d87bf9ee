"""Machines of the library python-statemachine as a plug-in: Python objects, read, not written."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from fsmkit.diagnostics import Findings
    from fsmkit.document.document import Document


class PythonStateMachine:
    """Reads classes and instances of ``StateChart`` and ``StateMachine``."""

    name = "python-statemachine"

    def read_object(self, found: object, name: str, findings: Findings) -> Document | None:
        """Return the document of a machine; None for other objects, or after reporting errors."""
        from fsmkit.foreign.pystatemachine.reader import import_object, is_machine

        if not is_machine(found):
            return None
        imported = import_object(found, name, findings)
        return None if imported is None else imported.document


PLUGIN = PythonStateMachine()
