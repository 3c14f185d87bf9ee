"""Make the states of a Chart: content typed, transitions and children as indices."""

from __future__ import annotations

from fsmkit.chart.chart import State
from fsmkit.chart.passes.collect_events import done_event
from fsmkit.chart.passes.context import Context, warn_not_evaluable
from fsmkit.chart.passes.number_states import Node, Tree
from fsmkit.chart.passes.resolve_targets import Arrows
from fsmkit.chart.passes.type_content import type_block, type_value
from fsmkit.chart.statements import Block, Fail
from fsmkit.diagnostics import Findings, Source
from fsmkit.diagnostics.fixes import set_chart_key
from fsmkit.diagnostics.suggestions import suggest
from fsmkit.document import keys
from fsmkit.document.document import Kind
from fsmkit.language import BOOL, Expr, Literal, default_value, type_expression

CARRIED = keys.kept_keys(keys.STATE, State)


def type_states(
    tree: Tree, arrows: Arrows, invokes: tuple[tuple[Block, ...], ...], context: Context
) -> tuple[State, ...]:
    """Return the states, in document order; ``invokes``: the invocations of each state."""
    return tuple(_state(tree, node, arrows, invokes, context) for node in tree.nodes)


def _state(
    tree: Tree,
    node: Node,
    arrows: Arrows,
    invokes: tuple[tuple[Block, ...], ...],
    context: Context,
) -> State:
    state = node.state
    context = context.at(node.index)
    invariant = None
    if state.invariant is not None:
        invariant = type_expression(state.invariant, context.scope, context.findings, BOOL)
    made = State(
        index=node.index,
        id=node.id,
        kind=node.kind,
        parent=node.parent,
        children=node.children,
        initial=arrows.initial[node.index],
        transitions=arrows.leaving[node.index],
        on_entry=(
            *(type_block(block, context) for block in state.entry),
            *_failing_done_data(tree, node, context),
        ),
        on_exit=tuple(type_block(block, context) for block in state.exit),
        depth=node.depth,
        last_descendant=node.last,
        span=state.span,
        defer=_deferred(node, context),
        invariant=invariant,
        origin=state.origin,
        done_data=_done_data(tree, node, context),
        invokes=invokes[node.index],
        **keys.values(state, CARRIED) | {"abstract": state.abstract and not node.children},
    )
    if state.copy is None or context.copies is None:
        return made
    if state.copied is None:
        return context.copies.filled_state(made, state.copy)
    return context.copies.state(made, state.copy, state.copied)


def _done_data(tree: Tree, node: Node, context: Context) -> tuple[Expr, ...]:
    """Return the payload of the parent's done event, one value for each field (SCXML 5.5)."""
    event = context.events.index.get(done_event(tree, node))
    if node.kind is not Kind.FINAL or event is None:
        return ()
    given = {argument.name.value: argument.value for argument in node.state.done_data}
    found: list[Expr] = []
    for part in context.events.all[event].fields:
        typed: Expr | None = None
        if part.name in given:
            typed = type_value(given[part.name], part.type, context)
        found.append(typed or Literal(default_value(part.type), part.type, node.state.span))
    return tuple(found)


def _failing_done_data(tree: Tree, node: Node, context: Context) -> tuple[Block, ...]:
    """Return ``error.execution`` for a param of no value: it is not sent (SCXML 5.5, 5.7)."""
    event = context.events.index.get(done_event(tree, node))
    if event is None or not context.lenient:
        return ()
    fields = {part.name for part in context.events.all[event].fields}
    found: list[Block] = []
    for argument in node.state.done_data:
        attempt = Findings()
        if argument.name.value in fields:
            continue
        type_expression(argument.value, context.scope, attempt)
        reason = next((d.message for d in attempt), "it has no meaning")
        warn_not_evaluable(reason, argument.value.span, context.findings)
        found.append((Fail(reason, argument.value.span),))
    return tuple(found)


def _deferred(node: Node, context: Context) -> tuple[int, ...]:
    found: set[int] = set()
    for descriptor in node.state.defer:
        matching = context.events.matching(descriptor.value)
        found.update(matching)
        if not matching:
            known = [event.name for event in context.events.all]
            context.findings.add(
                "unknown-name",
                f"there is no event `{descriptor}`",
                descriptor,
                help=suggest(descriptor.value, known, f"declare `{descriptor}` under `events`"),
            )
    return tuple(sorted(found))


def check_abstract(
    tree: Tree, source: Source, findings: Findings, *, is_abstract: bool, is_derived: bool
) -> bool:
    """Return whether the chart is abstract: marked so, or a base with abstract leaves."""
    left = [n for n in tree.nodes if n.state.abstract and not n.children]
    if is_derived and not is_abstract:
        for node in left:
            findings.add(
                "abstract-state-left",
                f"`{node.id}` is abstract in the base and not refined here",
                node.state.span,
                help=f"fill it under `refine: {{{node.id}: ...}}`, or mark the chart abstract",
                fixes=set_chart_key(source, "abstract", "true"),
            )
    return is_abstract or bool(left)


def exit_points(tree: Tree, context: Context) -> dict[str, tuple[int, dict[str, Expr]]]:
    """Return the top-level final states by id, with the values that go with their end."""
    found: dict[str, tuple[int, dict[str, Expr]]] = {}
    for child in tree.nodes[0].children:
        node = tree.nodes[child]
        if node.kind is Kind.FINAL:
            typed = {
                argument.name.value: type_expression(argument.value, context.scope, Findings())
                for argument in node.state.done_data
            }
            values = {name: value for name, value in typed.items() if value is not None}
            found[node.id] = (child, values)
    return found
