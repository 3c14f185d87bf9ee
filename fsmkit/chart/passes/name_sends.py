"""Give an id to what is sent where the id is to be made and stored (SCXML 6.2.4)."""

from __future__ import annotations

from dataclasses import replace

from fsmkit.diagnostics import Text
from fsmkit.document.document import Document
from fsmkit.document.walk import mapped, parts
from fsmkit.language.statements.tree import DocSend


def name_sends(document: Document) -> Document:
    """Return a document in which each ``send`` with a place for its id has one: a running number.

    The numbers are in document order, so that they do not depend on the notation or its layout,
    and no id that is written is among them.
    """
    sends = [part for part in parts(document) if isinstance(part, DocSend)]
    if all(send.id_location is None for send in sends):
        return document
    taken = {send.id.value for send in sends if send.id is not None}
    numbers = iter(range(1, len(sends) + len(taken) + 1))

    def named(part: object) -> object:
        if not isinstance(part, DocSend) or part.id_location is None:
            return None
        made = next(name for name in (f"send.{n}" for n in numbers) if name not in taken)
        return replace(part, id=Text(made, part.id_location.span, ()))

    changed: Document = mapped(document, named)
    return changed
