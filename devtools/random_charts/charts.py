"""Random statecharts, valid by construction: `random_document` and the strategy `documents`.

They hold whatever the two notations can say of a chart, in combinations nobody would write by hand;
`random_family` gives one with those it extends. `run` on them always ends: immediate sends to the
own queue are counted, and every delay is at least a tick.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from hypothesis import strategies as st

from devtools.random_charts.behaviour import Behaviour
from devtools.random_charts.choices import Choices, DrawnChoices
from devtools.random_charts.content import SENT, SOURCE, TURNS, Content, text
from devtools.random_charts.declarations import Declared, declare
from devtools.random_charts.derived import derive
from devtools.random_charts.functions import random_functions
from devtools.random_charts.terms import LEVEL
from devtools.random_charts.tree import Grower, Node
from devtools.random_charts.vocabulary import Names, Operation
from fsmkit.document import document as doc
from fsmkit.language import EnumType, Field, IntType, Type
from fsmkit.language.statements.tree import DocField

if TYPE_CHECKING:
    from hypothesis.strategies import DrawFn


@st.composite
def documents(draw: DrawFn, states: int = 16) -> doc.Document:
    """Draw a random document of about that many states at most."""
    return random_document(DrawnChoices(draw), states)


def random_document(
    choices: Choices,
    states: int = 16,
    *,
    has_functions: bool = False,
    declared: Declared | None = None,
) -> doc.Document:
    """Return a document of about that many states at most.

    ``has_functions``: with functions, conversions, local variables and numbered members, too.
    ``declared``: its declarations, instead of random ones.
    """
    return _random(choices, states, declared, has_functions=has_functions)[0]


def random_family(choices: Choices, states: int = 10) -> tuple[doc.Document, ...]:
    """Return a document after one or two that extend it, the most derived first."""
    base, content = _random(choices, states)
    documents, content = derive(choices, (base,), content)
    if choices.chance(30):
        documents, _ = derive(choices, documents, content)
    return documents


def _random(
    choices: Choices,
    states: int,
    declared: Declared | None = None,
    *,
    has_functions: bool = False,
) -> tuple[doc.Document, Content]:
    root = Grower(choices, choices.integer(1, states)).root()
    declared = declare(choices) if declared is None else declared
    if has_functions:
        return _with_functions(choices, root, declared)
    ids = tuple(node.id for node in root.below() if node.is_real)
    names = Names(declared.variables, ids, declared.operations, declared.constants)
    content = Content(choices, names, declared.events)
    state = Behaviour(choices, root, content).state(root)
    return _assemble(choices, declared, state), content


def _with_functions(
    choices: Choices, root: Node, declared: Declared
) -> tuple[doc.Document, Content]:
    """Return a document with functions, whose content calls them."""
    more = ("lv", LEVEL, f"Level.{choices.pick(LEVEL.members)}")
    declared = replace(declared, types=(*declared.types, LEVEL), data=(*declared.data, more))
    ids = tuple(node.id for node in root.below() if node.is_real)
    names = Names(declared.variables, ids, (), declared.constants)
    functions = random_functions(choices, names)
    called = tuple(Operation(f.name, f.parameters, f.result) for f in functions)
    names = replace(names, operations=declared.operations, functions=called)
    content = Content(choices, names, declared.events)
    document = _assemble(choices, declared, Behaviour(choices, root, content).state(root))
    percent = doc.DocType(text("Percent"), same=text("0..100"))
    return (
        replace(
            document,
            types=(*document.types, percent),
            functions=tuple(
                doc.DocFunction(text(f.name), _fields(f.parameters), text(str(f.result)), f.body)
                for f in functions
            ),
        ),
        content,
    )


def _assemble(choices: Choices, declared: Declared, root: doc.DocState) -> doc.Document:
    types = tuple(
        doc.DocType(text(type_.name), _members(type_))
        if isinstance(type_, EnumType)
        else doc.DocType(text(type_.name), fields=_fields(type_.fields))
        for type_ in declared.types
    )
    return doc.Document(
        SOURCE,
        text("Random"),
        root,
        types=types,
        constants=tuple(doc.DocConstant(text(n), text(str(v))) for n, v in declared.constants),
        data=(
            *(_data(name, type_, init) for name, type_, init in declared.data),
            doc.DocData(text(SENT), text("0..100"), text("0")),
            doc.DocData(text(TURNS), text("0..100"), text("0")),
        ),
        inputs=tuple(_data(name, type_, None) for name, type_, _ in declared.inputs),
        outputs=tuple(_data(name, type_, init) for name, type_, init in declared.outputs),
        operations=tuple(
            doc.DocOperation(
                text(o.name),
                _fields(o.parameters),
                None if o.result is None else text(_result(choices, o.result)),
            )
            for o in declared.operations
        ),
        events=tuple(
            doc.DocEvent(
                text(e.name),
                _fields(e.fields),
                direction,
                None if e.reply is None else text(str(e.reply)),
            )
            for e in declared.events
            for direction in sorted(e.directions, key=lambda d: d.value)
        ),
        capacities=_capacities(choices),
    )


def _result(choices: Choices, type_: Type) -> str:
    """Return the type of a result, in some a list of the values that a host returns."""
    match type_:
        case IntType(lo, hi) if choices.chance(40):
            known = sorted({lo, hi, max(lo, min(hi, 1)), max(lo, min(hi, 7))})
            return f"{type_} from {{{', '.join(map(str, known[: choices.integer(1, 4)]))}}}"
        case EnumType(name, members) if choices.chance(40):
            return f"{type_} from {{{name}.{choices.pick(members)}}}"
        case _:
            return str(type_)


def _members(type_: EnumType) -> tuple[doc.DocMember, ...]:
    if type_.is_counted:
        return tuple(doc.DocMember(text(m)) for m in type_.members)
    pairs = zip(type_.members, type_.numbers, strict=True)
    return tuple(doc.DocMember(text(m), text(str(n))) for m, n in pairs)


def _data(name: str, type_: object, init: str | None) -> doc.DocData:
    return doc.DocData(text(name), text(str(type_)), None if init is None else text(init))


def _fields(fields: tuple[Field, ...]) -> tuple[DocField, ...]:
    return tuple(DocField(text(f.name), text(str(f.type))) for f in fields)


def _capacities(choices: Choices) -> tuple[doc.DocCapacity, ...]:
    def maybe(name: str, percent: int, *values: int) -> list[doc.DocCapacity]:
        if not choices.chance(percent):
            return []
        return [doc.DocCapacity(text(name), text(str(choices.pick(values))))]

    return (
        *maybe("queue", 40, 8, 4, 2, 1),
        *maybe("internal", 85, 24, 16, 16, 12, 3),
        *maybe("delayed", 40, 4, 3, 1),
        *maybe("microsteps", 30, 100, 40, 12),
    )
