"""Turn late binding into content: data of a state get their values when it is first entered."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

from fsmkit.diagnostics import Text
from fsmkit.document.document import DocData, DocState, Document
from fsmkit.language.statements.tree import Assign, Block, Branch, If


def bind_late(document: Document) -> Document:
    """Return a document with early binding only (SCXML 5.3.3).

    A flag for each state with data says whether they have been bound; they are before the state's
    own entry content.
    """
    if not document.late_binding:
        return document
    binder = _Binder()
    children = tuple(binder.bind(child) for child in document.root.children)
    root = replace(document.root, children=children)
    return replace(document, root=root, data=(*document.data, *binder.flags), late_binding=False)


@dataclass
class _Binder:
    flags: list[DocData] = field(default_factory=list)

    def bind(self, state: DocState) -> DocState:
        children = tuple(self.bind(child) for child in state.children)
        bound = [d for d in state.data if d.init is not None]
        if not bound:
            return replace(state, children=children)

        def made(text: str) -> Text:
            return Text(text, state.span, ())

        name = f"bound_{len(self.flags)}"
        self.flags.append(DocData(made(name), made("bool"), made("false"), state.origin))
        blocks: list[Block] = [
            (
                If(
                    (Branch(made(f"!{name}"), (Assign(d.name, d.init, d.name.span),)),),
                    state.span,
                ),
            )
            for d in bound
            if d.init is not None
        ]
        blocks.append((Assign(made(name), made("true"), state.span),))
        return replace(
            state,
            children=children,
            data=tuple(replace(d, init=None) for d in state.data),
            entry=(*blocks, *state.entry),
        )
