"""Find the files of all charts that a document may invoke, before anything is elaborated."""

from __future__ import annotations

from fsmkit.diagnostics import Text
from fsmkit.document.document import Document
from fsmkit.document.walk import states
from fsmkit.scxml.ecmascript.lower import lower_ecmascript


def has_invokes(document: Document) -> bool:
    """Whether a document invokes anything."""
    return any(state.invokes for state in states(document.root, *document.refine))


def invoked_sources(document: Document) -> dict[int, tuple[Text, ...]]:
    """Return the values that ``src`` can have, by the place of the ``invoke``."""
    if not has_invokes(document):
        return {}
    lowered = lower_ecmascript(document)
    return {
        invoke.span.start: (
            (invoke.src,) if invoke.src is not None else tuple(value for _, value in invoke.sources)
        )
        for state in states(lowered.root, *lowered.refine)
        for invoke in state.invokes
    }
