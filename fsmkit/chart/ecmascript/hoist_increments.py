"""Make a statement of ``++x`` in an expression that is evaluated once, unseen by others.

In content the statement comes before. In the guard of an eventless transition it becomes the first
content of each transition that may be taken once the guard has been evaluated: there must be one
without a guard, so that one of them is.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

from fsmkit.chart.ecmascript.rewrite import mentions, nodes, parsed
from fsmkit.diagnostics import Span, Text
from fsmkit.document.document import DocData, DocState, DocTransition, Document, Kind, Trigger
from fsmkit.document.survey import Survey
from fsmkit.document.walk import map_parts, structure, texts
from fsmkit.language.statements import tree as stmt
from fsmkit.language.syntax import BinaryNode, ConditionalNode, NameNode, Node, UnaryNode, children


@dataclass(frozen=True, slots=True)
class _Step:
    """``++name`` or ``--name`` in a text: the only one, and surely evaluated with it."""

    text: Text
    name: str
    operator: str
    start: int
    end: int

    def replaced(self, value: str) -> Text:
        """Return the text with something else in this place."""
        whole = self.text.value
        changed = f"{whole[: self.start]}{value}{whole[self.end :]}"
        return self.text.with_value(changed)

    def statement(self, span: Span) -> stmt.Assign[Text, Text]:
        """Return the step as a statement."""
        name, one = (self.text.with_value(v) for v in (self.name, "1"))
        return stmt.Assign(name, one, span, self.operator)


def hoist_increments(survey: Survey) -> Survey:
    """Return a document of a loose dialect, the steps in its expressions made statements."""
    document = survey.document
    if document.datamodel == "fsmkit":
        return survey
    if not any("++" in value or "--" in value for value in survey.values):
        return survey
    if not any(_step(text) for text in survey.texts):
        return survey
    changed: Document = map_parts(document, _statement)
    data = [part for part in structure(document) if isinstance(part, DocData)]
    typed = {part.name.value for part in data if part.type is not None}
    root = _state(changed.root, _texts_of_exits(changed), typed)
    return Survey(replace(changed, root=root))


def _step(text: Text) -> _Step | None:
    """Return the increment or decrement in an expression, or None unless there is exactly one."""
    if "++" not in text.value and "--" not in text.value:
        return None
    node = parsed(text)
    if node is None:
        return None
    found = [step for each in nodes(node) if (step := _as_step(each, text)) is not None]
    sure = [step for each in _surely(node) if (step := _as_step(each, text)) is not None]
    return found[0] if len(found) == 1 and found == sure else None


def _as_step(node: Node, text: Text) -> _Step | None:
    match node:
        case UnaryNode(op="+" | "-" as op, operand=UnaryNode(op=twice, operand=NameNode(name=n))):
            at = text.value.find(op * 2, node.start, node.end)
            if twice == op and at >= 0 and not text.value[node.start : at].strip("( \t\n"):
                return _Step(text, n, op, node.start, node.end)
    return None


def _surely(node: Node) -> Iterator[Node]:
    """Yield the parts of an expression that are evaluated whenever it is."""
    yield node
    match node:
        case BinaryNode(op="&&" | "||", left=left):
            yield from _surely(left)
        case ConditionalNode(test=test):
            yield from _surely(test)
        case _:
            for child in children(node):
                yield from _surely(child)


def _count(name: str, among: Sequence[Text]) -> int:
    return sum(mentions(name, text.value) for text in among)


# --- in content -----------------------------------------------------------------------------------


def _statement(part: object) -> object:
    """Return a statement after its step, or None to visit its parts."""
    match part:
        case stmt.If(branches, span):
            done = [replace(b, body=map_parts(b.body, _statement)) for b in branches]
            conditions = [b.condition for b in branches if b.condition is not None]
            step = _step(conditions[0]) if conditions else None
            if step is None or _count(step.name, conditions) > 1:
                return replace(part, branches=tuple(done))
            done[0] = replace(done[0], condition=step.replaced(step.name))
            return (step.statement(span), replace(part, branches=tuple(done)))
        case (
            stmt.Assign()
            | stmt.DocSend()
            | stmt.Raise()
            | stmt.Log()
            | stmt.CallOperation()
            | stmt.KeywordStatement()
        ):
            inside = tuple(texts(part))
            steps = [step for text in inside if (step := _step(text)) is not None]
            if len(steps) != 1 or _count(steps[0].name, inside) > 1:
                return part
            new = steps[0].replaced(steps[0].name)
            changed = map_parts(part, lambda inner: new if inner is steps[0].text else None)
            return (steps[0].statement(part.span), changed)
        case _:
            return None


# --- in guards ------------------------------------------------------------------------------------


def _texts_of_exits(document: Document) -> list[Text]:
    """Return the texts that are evaluated between a guard and its transition's content."""
    states = [part for part in structure(document) if isinstance(part, DocState)]
    return [text for state in states for text in texts(state.exit)]


def _state(state: DocState, exits: list[Text], typed: set[str]) -> DocState:
    """Return a state without steps in the guards of its eventless transitions, and in those below.

    In a region the transition that is selected may be given up for that of another one.
    """
    if state.kind is Kind.PARALLEL:
        return state
    if state.children:
        return replace(state, children=tuple(_state(c, exits, typed) for c in state.children))
    eventless = [t for t in state.transitions if t.trigger is Trigger.EVENTLESS]
    steps = [None if t.guard is None else _step(t.guard) for t in eventless]
    first = next((place for place, step in enumerate(steps) if step is not None), None)
    last = next((p for p, t in enumerate(eventless) if t.guard is None), None)
    step = None if first is None else steps[first]
    if first is None or last is None or last < first or step is None or step.name in typed:
        return state
    guards = [t.guard for t in eventless[first:last] if t.guard is not None]
    if _count(step.name, guards) > 1 or _count(step.name, exits):
        return state
    taken = eventless[first : last + 1]

    def with_step(transition: DocTransition) -> DocTransition:
        if not any(transition is other for other in taken):
            return transition
        content = (step.statement(transition.span), *(transition.content or ()))
        guard = transition.guard
        if transition is taken[0]:
            guard = step.replaced(f"({step.name} {step.operator} 1)")
        return replace(transition, guard=guard, content=content)

    return replace(state, transitions=tuple(with_step(t) for t in state.transitions))
