"""Declare variables that nothing declares: those of loops, and those a script creates.

SCXML 4.6: ``foreach`` declares its item and index. 5.8: the script of the chart, executed when it
is loaded, may create variables by assigning them.
"""

from __future__ import annotations

from dataclasses import replace

from fsmkit.chart.chart import Data
from fsmkit.chart.passes.collect_names import UNTYPED, Names
from fsmkit.chart.passes.number_states import Tree
from fsmkit.chart.passes.walk_content import places
from fsmkit.diagnostics import Text
from fsmkit.document.document import Document
from fsmkit.language import ArrayType, IntType, Literal, Type, default_value
from fsmkit.language.statements.tree import Assign, ForEach, WrittenStatement, statements


def declare_loops(document: Document, tree: Tree, names: Names) -> Names:
    """Return the names with a variable for each item and index of a loop that has none.

    In a loose dialect too for each name that the chart's own script assigns.
    """
    if document.datamodel != "fsmkit":
        for statement in document.script:
            if isinstance(statement, Assign) and not statement.operator:
                names = _add(statement.location, UNTYPED, names)
    for place in places(document, tree):
        for loop in statements(place.block):
            if isinstance(loop, ForEach):
                names = _declare(loop, names)
    return names


def _declare(loop: ForEach[Text, WrittenStatement], names: Names) -> Names:
    array, _ = names.scope.variables.get(loop.array.value, (None, None))
    if not isinstance(array, ArrayType):
        return names
    names = _add(loop.item, array.element, names)
    if loop.index is not None:
        names = _add(loop.index, IntType(0, array.length - 1), names)
    return names


def _add(name: Text, type_: Type, names: Names) -> Names:
    scope = names.scope
    taken = (scope.variables, scope.constants, scope.operations, scope.types, names.untyped)
    if any(name.value in known for known in taken) or not name.value.isidentifier():
        return names
    if type_ == UNTYPED:
        data = Data(name.value, UNTYPED, Literal(0, UNTYPED, name.span), name.span)
        untyped = names.untyped | {name.value}
        return replace(names, data=(*names.data, data), untyped=untyped)
    init = Literal(default_value(type_), type_, name.span)
    return names.with_data((Data(name.value, type_, init, name.span),))
