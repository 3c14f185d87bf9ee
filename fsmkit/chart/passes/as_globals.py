"""``var x = e`` in scripts of ECMAScript: it assigns, as all data are global (SCXML 5.3, 5.8)."""

from __future__ import annotations

from fsmkit.document.document import Document
from fsmkit.document.walk import mapped
from fsmkit.language.statements.tree import Assign, Fail, Local, Return


def as_globals(document: Document) -> Document:
    """Return a document whose local variables are data, unless its language has local ones."""
    if document.datamodel == "fsmkit":
        return document

    def change(part: object) -> object:
        match part:
            case Local(place, value, span) if value is not None:
                return Assign(place, value, span)
            case Local(span=span, type=type_):
                return () if type_ is None else Fail("a variable of a script has no type", span)
            case Return():
                return part
            case _:
                return None

    found: Document = mapped(document, change)
    return found
