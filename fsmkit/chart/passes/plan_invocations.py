"""Give every chart that a state can invoke a slot of its own (SCXML 6.4)."""

from __future__ import annotations

from dataclasses import dataclass, field

from fsmkit.chart.ecmascript.lower import lower_ecmascript
from fsmkit.chart.passes.number_states import Tree
from fsmkit.diagnostics import Findings, Source, Text
from fsmkit.document.document import DocInvoke, Document
from fsmkit.document.invocation_context import InvocationContext
from fsmkit.document.survey import Survey
from fsmkit.document.walk import states
from fsmkit.language import location_of_session

SERVICES = ("", "scxml", "http://www.w3.org/TR/scxml/", "http://www.w3.org/TR/scxml")
"""The supported values of the `type` of an `invoke`."""
DEEPEST = 6
"""Invocations within invocations: each level is elaborated several times."""


@dataclass(frozen=True, slots=True)
class Slot:
    """Where one chart of one ``invoke`` lives; ``source`` is its ``src``, empty if inline."""

    index: int
    state: int
    id: str
    session: str
    invoke: DocInvoke = field(compare=False)
    source: str
    documents: tuple[Document, ...] = field(compare=False)


def plan_invocations(
    document: Document, tree: Tree, given: InvocationContext | None, findings: Findings
) -> tuple[Slot, ...]:
    """Return the slots of a document, in document order; report unsupported invocations."""
    session = document.name.value if given is None else given.session
    depth = 0 if given is None else given.depth
    slots: list[Slot] = []
    taken = {i.id.value for node in tree.nodes for i in node.state.invokes if i.id is not None}
    for node in tree.nodes:
        for number, invoke in enumerate(node.state.invokes, 1):
            if reason := _why_not(invoke, depth, document.source):
                findings.add(
                    "unsupported-invoke",
                    f"what `{node.id}` invokes is not run: {reason}",
                    invoke.span,
                    help="at run time it is `error.execution`; name a chart by `src` or `content`",
                )
                continue
            name = invoke.id.value if invoke.id is not None else f"{node.id}.{number}"
            while invoke.id is None and name in taken:
                name += "_"
            taken.add(name)
            for source, documents in invoke.loaded:
                slots.append(
                    Slot(
                        len(slots),
                        node.index,
                        name,
                        f"{session}.{name}",
                        invoke,
                        source,
                        documents,
                    )
                )
    return tuple(slots)


def targets(slots: tuple[Slot, ...]) -> dict[str, tuple[int, ...]]:
    """Return the slots that are reached under a target: by id, or by session (SCXML C.1)."""
    found: dict[str, tuple[int, ...]] = {}
    for slot in slots:
        for target in (f"#_{slot.id}", location_of_session(slot.session)):
            found[target] = (*found.get(target, ()), slot.index)
    return found


def is_service(type_: Text | None) -> bool:
    """Whether a type is that of a state machine."""
    return type_ is None or type_.value.strip() in SERVICES


def _why_not(invoke: DocInvoke, depth: int, source: Source) -> str:
    """Return the reason why an ``invoke`` is unsupported, or an empty string."""
    if not is_service(invoke.type):
        return f"there is no service `{invoke.type}`"
    if invoke.type_expr is not None and not invoke.types:
        return "its type is computed at run time"
    if invoke.src_expr is not None and not invoke.sources:
        return "its `src` is computed at run time"
    if invoke.content_expr is not None and not invoke.loaded:
        return "its content is computed at run time"
    if not invoke.loaded and invoke.src is not None and source.beside(invoke.src.value) is None:
        return f"`{invoke.src}` leaves the folder of the chart"
    if not invoke.loaded:
        return "it names no chart" if invoke.src is None else f"`{invoke.src}` could not be read"
    if depth >= DEEPEST:
        return f"it lies in {depth} other invocations, which is as deep as they go"
    return ""


def has_invokes(document: Document) -> bool:
    """Whether a document invokes anything."""
    return any(state.invokes for state in states(document.root, *document.refine))


def invoked_sources(document: Document) -> dict[int, tuple[Text, ...]]:
    """Return the values that ``src`` can have, by the place of the ``invoke``."""
    if not has_invokes(document):
        return {}
    lowered = lower_ecmascript(Survey(document))
    return {
        invoke.span.start: (
            (invoke.src,) if invoke.src is not None else tuple(value for _, value in invoke.sources)
        )
        for state in states(lowered.root, *lowered.refine)
        for invoke in state.invokes
    }
