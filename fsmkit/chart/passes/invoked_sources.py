"""Find the files of all charts that a document may invoke, before anything is elaborated."""

from __future__ import annotations

from collections.abc import Iterator

from fsmkit.diagnostics import Text
from fsmkit.document.document import DocState, Document
from fsmkit.scxml.ecmascript.lower import lower_ecmascript


def has_invokes(document: Document) -> bool:
    """Whether a document invokes anything."""
    return any(state.invokes for state in _states(document))


def invoked_sources(document: Document) -> dict[int, tuple[Text, ...]]:
    """Return the values that ``src`` can have, by the place of the ``invoke``."""
    if not has_invokes(document):
        return {}
    return {
        invoke.span.start: (
            (invoke.src,) if invoke.src is not None else tuple(value for _, value in invoke.sources)
        )
        for state in _states(lower_ecmascript(document))
        for invoke in state.invokes
    }


def _states(document: Document) -> Iterator[DocState]:
    left = [document.root, *document.refine]
    while left:
        state = left.pop()
        yield state
        left.extend(state.children)
