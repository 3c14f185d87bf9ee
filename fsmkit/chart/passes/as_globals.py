"""``var x = e`` in scripts of ECMAScript declares and assigns: data are global (SCXML 5.8)."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from fsmkit.document.document import DocData, Document
from fsmkit.document.survey import Survey
from fsmkit.document.walk import map_parts
from fsmkit.language.statements.tree import Assign, Fail, Local, Return


def as_globals(survey: Survey) -> Survey:
    """Return a document whose local variables are data, unless its language has local ones."""
    document = survey.document
    if document.datamodel == "fsmkit" or Local not in survey.kinds:
        return survey

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

    found: Document = map_parts(document, change)
    return Survey(replace(found, data=(*found.data, *_declared(survey))))


def _declared(survey: Survey) -> Iterator[DocData]:
    """Yield a variable without a value for each name that only scripts declare."""
    document = survey.document
    taken = {data.name.value for data in survey.data}
    taken |= {
        written.name.value
        for group in (document.constants, document.operations, document.functions)
        for written in group
    }
    for part in survey.parts:
        if isinstance(part, Local) and part.type is None:
            name = part.place.value.strip()
            if name.isidentifier() and name not in taken:
                taken.add(name)
                yield DocData(part.place.with_value(name), None, None)
