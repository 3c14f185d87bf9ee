"""Report states with children or content that their kind does not allow (SCXML 3.3 to 3.10)."""

from __future__ import annotations

from fsmkit.chart.passes.number_states import Node, Tree
from fsmkit.diagnostics import Findings, Severity
from fsmkit.diagnostics.fixes import remove_entry
from fsmkit.document.document import HISTORIES, Kind, Trigger

LEAVES = {
    Kind.FINAL: "a final state",
    Kind.SHALLOW_HISTORY: "a history",
    Kind.DEEP_HISTORY: "a history",
    Kind.CHOICE: "a choice",
}


def check_nesting(tree: Tree, findings: Findings, *, is_loose: bool) -> None:
    """Add a finding for each state that does not fit its kind or its parent.

    A loose dialect tolerates a history of the chart itself: it always means its default.
    """
    for node in tree.nodes[1:]:
        if node.state.copied is not None:  # checked where it is written
            if node.kind is Kind.CHOICE and node.state.transitions:
                _check_choice(node, findings)
            continue
        _check_content(tree, node, findings)
        _check_place(tree, node, findings, is_loose=is_loose)
        if node.kind is Kind.CHOICE:
            _check_choice(node, findings)
    _check_root(tree.nodes[0], findings)


def _check_content(tree: Tree, node: Node, findings: Findings) -> None:
    state = node.state
    if node.kind in LEAVES and node.children:
        findings.add(
            "state-not-allowed",
            f"`{node.id}` is {LEAVES[node.kind]} and holds no states",
            tree.nodes[node.children[0]].state.span,
            secondary=[(state.span, "the state")],
            help="move the inner states to an ordinary state",
        )
    if node.kind in (Kind.FINAL, *HISTORIES) and state.transitions:
        findings.add(
            "transition-not-allowed",
            f"`{node.id}` is {LEAVES[node.kind]} and is not left by transitions of its own",
            state.transitions[0].span,
            help="make it an ordinary state, or put the transition on its parent",
        )
    if node.kind in HISTORIES and (state.entry or state.exit):
        findings.add(
            "content-not-allowed",
            f"history `{node.id}` is never active and has no entry or exit content",
            state.span,
            help="put the content on its default transition or on its parent",
        )


def _check_place(tree: Tree, node: Node, findings: Findings, *, is_loose: bool) -> None:
    parent = tree.parent(node)
    if parent.kind is Kind.PARALLEL and node.kind in (Kind.FINAL, Kind.CHOICE):
        findings.add(
            "state-not-allowed",
            f"{LEAVES[node.kind]} cannot be a region of the parallel state `{parent.id}`",
            node.state.span,
            help="put it inside one of the regions",
        )
    if node.is_history and (parent.index == 0 or not tree.real_children(parent.index)):
        what = (
            "the chart itself has none" if parent.index == 0 else f"`{parent.id}` holds no states"
        )
        findings.add(
            "state-not-allowed",
            f"history `{node.id}` has nothing to remember: {what}",
            node.state.span,
            help="put it beside the states it is to remember",
            severity=Severity.WARNING if is_loose and parent.index == 0 else None,
        )
    if node.kind is Kind.PARALLEL and not tree.real_children(node.index):
        findings.add(
            "state-not-allowed",
            f"the parallel state `{node.id}` has no regions",
            node.state.span,
            help="add regions, or make it an ordinary state",
        )


def _check_choice(node: Node, findings: Findings) -> None:
    *guarded, last = node.state.transitions or (None,)
    if last is None:
        findings.add(
            "choice-without-default",
            f"choice `{node.id}` has no alternative",
            node.state.span,
            help="add alternatives, the last without a guard",
        )
        return
    for transition in node.state.transitions:
        if transition.trigger is not Trigger.EVENTLESS or not transition.targets:
            findings.add(
                "transition-not-allowed",
                f"an alternative of choice `{node.id}` has a target and no trigger",
                transition.span,
                help="give it a target and at most a guard",
            )
    if last.guard is not None:
        findings.add(
            "choice-without-default",
            f"the last alternative of choice `{node.id}` has a guard: the machine could stay in it",
            last.guard,
            help="remove that guard, or add an alternative without one",
            fixes=remove_entry(last.guard),
        )
    for transition in guarded:
        if transition is not None and transition.guard is None:
            findings.add(
                "choice-without-default",
                f"this alternative of choice `{node.id}` has no guard, so those after it are dead",
                transition.span,
                help="give it a guard, or move it to the end",
            )


def _check_root(root: Node, findings: Findings) -> None:
    state = root.state
    at = next((t.span for t in state.transitions), state.span)
    if state.transitions or state.entry or state.exit:
        findings.add(
            "content-not-allowed",
            "the chart itself has no transitions, entry or exit content",
            at,
            help="put them on a state that holds all others",
        )


def report_unsupported(tree: Tree, findings: Findings, *, strict: bool) -> None:
    """Add a finding for each done event whose payload has no type."""
    severity = Severity.ERROR if strict else None
    for node in tree.nodes:
        if node.state.done_content is not None:
            findings.add(
                "payload-dropped",
                f"the content of `{node.id}` has no type and does not go with its done event",
                node.state.span,
                help="name its parts, with `param`",
                severity=severity,
            )
