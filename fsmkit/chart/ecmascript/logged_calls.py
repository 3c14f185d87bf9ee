"""Say ``console.log(...)`` and ``_trace(...)`` as ``log``, which every runtime has.

Strings that are joined in them are logged one by one: a label and values.
"""

from __future__ import annotations

from collections.abc import Iterator

from fsmkit.chart.ecmascript.rewrite import parsed
from fsmkit.diagnostics import Text
from fsmkit.document.survey import Survey
from fsmkit.document.walk import map_parts
from fsmkit.language.statements.tree import CallOperation, Log
from fsmkit.language.syntax import BinaryNode, CallNode, MemberNode, NameNode, Node, StringNode

CONSOLE = "console"
METHODS = frozenset({"debug", "error", "info", "log", "trace", "warn"})
"""Methods of the console that write their arguments (WHATWG Console Standard, 1.1)."""
FUNCTION = "_trace"


def log_calls(survey: Survey) -> Survey:
    """Return a document of a loose dialect whose calls that only write are logs.

    A name that the chart declares keeps its own meaning.
    """
    document = survey.document
    if document.datamodel == "fsmkit" or CallOperation not in survey.kinds:
        return survey
    taken = {data.name.value for data in survey.data}
    taken |= {operation.name.value for operation in document.operations}
    taken |= {function.name.value for function in document.functions}

    def change(part: object) -> object:
        return _log(part, taken) if isinstance(part, CallOperation) else None

    return survey.update(map_parts(document, change))


def _log(statement: CallOperation[Text], taken: set[str]) -> Log[Text | None, Text] | None:
    """Return a call of a logging function as a log, or None for another call."""
    node = parsed(statement.call)
    match node:
        case CallNode(
            callee=MemberNode(base=NameNode(name=name), name=method), arguments=arguments
        ) if name == CONSOLE and method in METHODS:
            pass
        case CallNode(callee=NameNode(name=name), arguments=arguments) if name == FUNCTION:
            pass
        case _:
            return None
    if name in taken:
        return None
    logged = [piece for argument in arguments for piece in _pieces(argument)]
    label = None
    if logged and isinstance(logged[0], StringNode):
        label = statement.call.with_value(logged[0].value)
        del logged[0]
    values = tuple(statement.call.part(piece.start, piece.end) for piece in logged)
    return Log(label, values, statement.span)


def _pieces(node: Node) -> Iterator[Node]:
    """Yield the pieces of a string that is joined; a sum of numbers is one piece."""
    if isinstance(node, BinaryNode) and node.op == "+" and _is_string(node):
        yield from _pieces(node.left)
        yield from _pieces(node.right)
    else:
        yield node


def _is_string(node: Node) -> bool:
    """Whether a literal in an expression makes it a string."""
    match node:
        case StringNode():
            return True
        case BinaryNode(op="+", left=left, right=right):
            return _is_string(left) or _is_string(right)
        case _:
            return False
