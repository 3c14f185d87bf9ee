"""Write out late binding, and the ids that a ``send`` is to make and store (SCXML 6.2.4)."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

from fsmkit.diagnostics import Text
from fsmkit.document.document import DocData, DocState
from fsmkit.document.survey import Survey
from fsmkit.document.walk import map_parts
from fsmkit.language.statements.tree import Assign, Block, Branch, DocSend, If


def bind_late(survey: Survey) -> Survey:
    """Return a document with early binding only (SCXML 5.3.3).

    A flag for each state with data says whether they have been bound; they are before the state's
    own entry content.
    """
    document = survey.document
    if not document.late_binding:
        return survey
    binder = _Binder()
    children = tuple(binder.bind(child) for child in document.root.children)
    root = replace(document.root, children=children)
    data = (*document.data, *binder.flags)
    return Survey(replace(document, root=root, data=data, late_binding=False))


@dataclass
class _Binder:
    flags: list[DocData] = field(default_factory=list)

    def bind(self, state: DocState) -> DocState:
        children = tuple(self.bind(child) for child in state.children)
        bound = [d for d in state.data if d.init is not None]
        if not bound:
            return replace(state, children=children)

        def text_of(text: str) -> Text:
            return Text(text, state.span, ())

        name = f"bound_{len(self.flags)}"
        self.flags.append(DocData(text_of(name), text_of("bool"), text_of("false"), state.origin))
        blocks: list[Block] = [
            (
                If(
                    (Branch(text_of(f"!{name}"), (Assign(d.name, d.init, d.name.span),)),),
                    state.span,
                ),
            )
            for d in bound
            if d.init is not None
        ]
        blocks.append((Assign(text_of(name), text_of("true"), state.span),))
        return replace(
            state,
            children=children,
            data=tuple(replace(d, init=None) for d in state.data),
            entry=(*blocks, *state.entry),
        )


def name_sends(survey: Survey) -> Survey:
    """Return a document in which each ``send`` with an ``idlocation`` has an id: a running number.

    The numbers are in document order, so they do not depend on the notation or its layout. They
    differ from all declared ids.
    """
    if DocSend not in survey.kinds:
        return survey
    sends = [part for part in survey.parts if isinstance(part, DocSend)]
    if all(send.id_location is None for send in sends):
        return survey
    taken = {send.id.value for send in sends if send.id is not None}
    numbers = iter(range(1, len(sends) + len(taken) + 1))

    def named(part: object) -> object:
        if not isinstance(part, DocSend) or part.id_location is None:
            return None
        made = next(name for name in (f"send.{n}" for n in numbers) if name not in taken)
        return replace(part, id=Text(made, part.id_location.span, ()))

    return Survey(map_parts(survey.document, named))
