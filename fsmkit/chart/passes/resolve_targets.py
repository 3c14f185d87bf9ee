"""Find the target states of every transition, written or implied, and number the transitions."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import combinations

from fsmkit.chart.chart import Chart
from fsmkit.chart.copies.copy import NO_CONSTANTS, Copy
from fsmkit.chart.passes.number_states import Node, Tree
from fsmkit.diagnostics import Edit, Findings, Fix, Severity, Span, Text
from fsmkit.diagnostics.fast_init import fast_init
from fsmkit.diagnostics.fixes import add_key, is_xml, remove_entry
from fsmkit.diagnostics.suggestions import suggest
from fsmkit.document.document import DocTransition, Document, Kind, Trigger
from fsmkit.language import Literal
from fsmkit.language.copied_names import dotted


@fast_init
@dataclass(frozen=True, slots=True)
class Arrow:
    """A numbered transition with its ends; the rest of it is still as written."""

    index: int
    source: int
    targets: tuple[int, ...]
    written: DocTransition
    copied: int | None = None
    """For a part of a copy: the index of its transition in the used chart."""


@dataclass(frozen=True, slots=True)
class Arrows:
    """All transitions in document order: of a state, the initial one comes first."""

    all: tuple[Arrow, ...]
    initial: tuple[int | None, ...]
    """By state: the transition of its default entry, or the default of a history."""
    leaving: tuple[tuple[int, ...], ...]
    """By state: its transitions, without the initial one."""


def resolve_targets(
    document: Document,
    tree: Tree,
    findings: Findings,
    copies: tuple[Copy, ...] = (),
    constants: Mapping[str, Literal] = NO_CONSTANTS,
) -> Arrows:
    """Return the transitions of a document; report targets that do not exist.

    ``constants`` may be indices of arrays of copies.
    """
    found: list[Arrow] = []
    initial: list[int | None] = []
    leaving: list[tuple[int, ...]] = []
    tree = replace(tree, points=entry_points(tree, copies), constants=constants)

    def number(
        source: int, written: DocTransition, targets: tuple[int, ...], copied: int | None = None
    ) -> int:
        found.append(Arrow(len(found), source, targets, written, copied))
        return found[-1].index

    def copy(node: Node, index: int, chart: Chart, base: int) -> int:
        transition = chart.transitions[index]
        targets = tuple(base + target for target in transition.targets)
        written = DocTransition(transition.trigger, transition.span)
        return number(node.index, written, targets, index)

    bases: dict[int, int] = {}
    for node in tree.nodes:
        if node.state.copy is not None and (chart := copies[node.state.copy].used.chart):
            if node.state.copied is None:
                bases[node.state.copy] = node.index
            base = bases[node.state.copy]
            inner = chart.states[node.state.copied or 0]
            if node.state.copied is not None or node.state.initial is None:
                first_ = inner.initial
                initial.append(None if first_ is None else copy(node, first_, chart, base))
            else:
                entry = _entered(node, copies[node.state.copy], findings)
                initial.append(number(node.index, node.state.initial, entry))
            if node.state.copied is not None and not node.state.transitions:
                leaving.append(tuple(copy(node, t, chart, base) for t in inner.transitions))
                continue
            leaving.append(
                tuple(
                    number(node.index, written, _targets(tree, written, findings))
                    for written in node.state.transitions
                )
            )
            continue
        first = _initial(document, tree, node, findings)
        initial.append(None if first is None else number(node.index, *first))
        leaving.append(
            tuple(
                number(node.index, written, _targets(tree, written, findings))
                for written in node.state.transitions
            )
        )
    arrows = Arrows(tuple(found), tuple(initial), tuple(leaving))
    for node in tree.nodes:
        if node.is_history and _is_endless(tree, arrows, node.index):
            findings.add(
                "history-default-outside",
                f"the default of history `{node.id}` leads back to the history",
                node.state.span if node.state.initial is None else node.state.initial.span,
                help=f"name a state of `{tree.parent(node).id}` that is no history",
            )
    return arrows


def entry_points(tree: Tree, copies: tuple[Copy, ...]) -> dict[str, tuple[int, ...]]:
    """Return the states that each entry point of a copy enters, by its dotted name."""
    found: dict[str, tuple[int, ...]] = {}
    for node in tree.nodes:
        if node.state.copy is not None and node.state.copied is None:
            copy = copies[node.state.copy]
            for name, targets in copy.used.chart.entries:
                found[copy.name(name)] = tuple(node.index + target for target in targets)
    return found


def resolve_entries(
    document: Document, tree: Tree, findings: Findings, copies: tuple[Copy, ...] = ()
) -> tuple[tuple[str, tuple[int, ...]], ...]:
    """Return the entry points of a document, with the states that they enter."""
    tree = replace(tree, points=entry_points(tree, copies))
    found: dict[str, tuple[int, ...]] = {}
    for entry in document.entries:
        if entry.name.value in tree.index or entry.name.value in found:
            findings.add(
                "duplicate-state",
                f"`{entry.name}` is an entry point, and the name of something else",
                entry.name,
                help="rename it: entry points and states share one space",
            )
            continue
        if not entry.targets:
            findings.add(
                "unexpected-shape", f"the entry point `{entry.name}` enters nothing", entry.name,
                help="name a state of this chart",
            )  # fmt: skip
        written = DocTransition(Trigger.INITIAL, entry.name.span, targets=entry.targets)
        found[entry.name.value] = _targets(tree, written, findings)
    return tuple(found.items())


def _entered(node: Node, copy: Copy, findings: Findings) -> tuple[int, ...]:
    """Return the states that the ``initial`` of a using state enters by entry points."""
    found: list[int] = []
    written = node.state.initial
    points = dict(copy.used.chart.entries)
    for name in () if written is None else written.targets:
        targets = points.get(name.value)
        if targets is None:
            chart = copy.used.chart.name
            findings.add(
                "unknown-binding",
                f"`{chart}` has no entry point `{name}`",
                name,
                help=suggest(name.value, points, f"declare it under `entries` of `{chart}`"),
            )
        else:
            found += [node.index + target for target in targets]
    return tuple(dict.fromkeys(found))


def _is_endless(tree: Tree, arrows: Arrows, history: int) -> bool:
    """Whether the default of a history enters, by defaults alone, the history again."""
    seen: set[int] = set()
    open_ = [history]
    while open_:
        for state in _by_default(tree, arrows, open_.pop()):
            if state == history:
                return True
            if state not in seen:
                seen.add(state)
                open_.append(state)
    return False


def _by_default(tree: Tree, arrows: Arrows, state: int) -> list[int]:
    """Return the states entered by default with a state (Appendix D, enterStates)."""
    node = tree.nodes[state]
    if node.kind is Kind.PARALLEL:
        return list(tree.real_children(state))
    first = arrows.initial[state]
    targets = () if first is None else arrows.all[first].targets
    found = list(targets)
    top = tree.parent(node).index if node.is_history else state
    for target in targets:
        end = tree.lca(target, top)
        above = tree.nodes[target]
        while above.index not in (0, end) and (above := tree.parent(above)).index != end:
            if above.kind is Kind.PARALLEL:
                others = tree.real_children(above.index)
                found += [o for o in others if not tree.is_descendant(target, o) and o != target]
    return found


def _targets(tree: Tree, written: DocTransition, findings: Findings) -> tuple[int, ...]:
    """Return the states named, in the order written, each once."""
    found: list[int] = []
    for name in written.targets:
        indices = _named(tree, name)
        if not indices:
            _report_unknown(tree, name, findings)
        for index in indices:
            if tree.nodes[index].state.copied is not None and not _is_point(tree, name):
                _report_inside(tree, name, index, findings)
            elif index not in found:
                found.append(index)
    _check_together(tree, written.targets, findings)
    return tuple(found)


def _named(tree: Tree, name: Text) -> tuple[int, ...]:
    """Return the states that a target means: one, or those of an entry point."""
    plain = dotted(name.value, tree.constants)
    index = tree.index.get(plain)
    return tree.points.get(plain, ()) if index is None else (index,)


def _is_point(tree: Tree, name: Text) -> bool:
    return dotted(name.value, tree.constants) in tree.points


def _report_inside(tree: Tree, name: Text, index: int, findings: Findings) -> None:
    """Report a target within a copy that is no entry point."""
    inner = tree.nodes[index].state
    using = next(
        tree.nodes[above]
        for above in tree.ancestors(index)
        if tree.nodes[above].state.copied is None
    )
    own = str(inner.id).removeprefix(f"{using.id}.")
    findings.add(
        "target-inside-copy",
        f"`{name}` lies in the copy `{using.id}`, which is entered at its entry points",
        name,
        secondary=[(inner.span, "the state")],
        help=f"add `entries: {{to_{own.replace('.', '_')}: {own}}}` to the used chart, and name "
        f"`{using.id}.to_{own.replace('.', '_')}`",
    )


def _report_unknown(tree: Tree, name: Text, findings: Findings) -> None:
    """Report a target that is no state, perhaps one word of an id that holds spaces."""
    message = f"there is no state `{name}`"
    known = (*tree.index, *tree.points)
    advice = suggest(name.value, known, "name a state of this chart")
    last = name.value.replace("/", ".").rpartition(".")[2]
    if last != name.value and last in tree.index:
        advice = f"ids are unique in a chart, at any depth: write `{last}`"
    for id_ in tree.index:
        if name.value in id_.split():
            message += f": the id `{id_}` holds a space, and targets are separated by spaces"
            advice = f"name the state `{'_'.join(id_.split())}`"
            break
    findings.add("unknown-name", message, name, help=advice)


def _check_together(tree: Tree, targets: tuple[Text, ...], findings: Findings) -> None:
    """Report targets that no configuration holds together (SCXML 3.11)."""
    known = [(name, index) for name in targets for index in _named(tree, name)]
    for (first, one), (second, other) in combinations(known, 2):
        if one == other:
            continue
        reason = _why_apart(tree, one, other)
        if reason is not None:
            findings.add(
                "targets-exclude-each-other",
                f"`{first}` and `{second}` cannot be entered together: {reason}",
                second,
                secondary=[(first, "the other target")],
                help="keep one target for each region of a parallel state",
                fixes=_without(second),
            )


def _without(target: Text) -> tuple[Fix, ...]:
    """Return the fix that takes one target out of a list of them, or out of words."""
    span = target.span
    text = span.source.text
    start = len(text[: span.start].rstrip())
    if text[start - 1 : start] in ",[{":
        return remove_entry(span)
    return (Fix("Remove it", (Edit(Span(span.source, start, span.end), ""),)),)


def _first_default(tree: Tree, history: Node) -> tuple[Fix, ...]:
    """Return the fix that lets a history lead to the first state beside it, in YAML."""
    children = tree.real_children(tree.parent(history).index)
    if is_xml(history.state.span.source) or not children:
        return ()
    return add_key(history.state.span, "default", str(tree.nodes[children[0]].id))


def _why_apart(tree: Tree, one: int, other: int) -> str | None:
    """Return why no configuration holds two targets, None if there may be one."""
    meet = tree.nodes[tree.lca(one, other)]
    if meet.index in (one, other):
        return "one holds the other"
    if meet.kind is not Kind.PARALLEL:
        return f"both lie in `{meet.id}`, of whose children one is active"
    for node in (tree.nodes[one], tree.nodes[other]):
        if node.is_history and node.parent == meet.index:
            return f"the history `{node.id}` stands for a state in each region of `{meet.id}`"
    return None


def _initial(
    document: Document, tree: Tree, node: Node, findings: Findings
) -> tuple[DocTransition, tuple[int, ...]] | None:
    if node.is_history:
        return _history_default(document, tree, node, findings)
    written = node.state.initial
    if node.kind is not Kind.COMPOUND:
        if written is not None:
            what = "parallel" if node.kind is Kind.PARALLEL else node.kind.value
            findings.add(
                "initial-not-allowed",
                f"`{node.id}` is {what} and takes no `initial`",
                written.span,
                help="remove it" if node.kind is not Kind.PARALLEL else "all regions are entered",
                fixes=remove_entry(written.span),
            )
        return None
    if written is None:
        children = tree.real_children(node.index)
        if not children:
            findings.add(
                "no-states", f"chart `{node.id}` has no state", node.state.span, help="add a state"
            )
            return None
        implied = DocTransition(Trigger.INITIAL, node.state.span, origin=node.state.origin)
        return implied, children[:1]
    targets = _targets(tree, written, findings)
    for name, index in ((n, i) for n in written.targets for i in _named(tree, n)):
        if not tree.is_descendant(index, node.index):
            findings.add(
                "initial-outside",
                f"the initial state `{name}` does not lie in `{node.id}`",
                name,
                help=f"name a state below `{node.id}`",
            )
    if not written.targets:
        findings.add(
            "initial-outside",
            f"the initial transition of `{node.id}` has no target",
            written.span,
            help=f"name a state below `{node.id}`",
        )
    return written, targets


def _history_default(
    document: Document, tree: Tree, node: Node, findings: Findings
) -> tuple[DocTransition, tuple[int, ...]] | None:
    parent = tree.parent(node)
    written = node.state.initial
    if written is not None and written.targets:
        targets = _targets(tree, written, findings)
        for name, index in ((n, i) for n in written.targets for i in _named(tree, n)):
            if not _may_default(tree, node, index):
                where = "is no child of" if index > parent.index else "does not lie in"
                findings.add(
                    "history-default-outside",
                    f"the default `{name}` of history `{node.id}` {where} `{parent.id}`",
                    name,
                    help=f"name a state of `{parent.id}`, or make the history deep",
                    severity=_tolerated(document),
                )
        return written, targets
    lenient = _tolerated(document) is not None
    findings.add(
        "history-without-default",
        f"history `{node.id}` does not say what is entered the first time"
        + (f": the default entry of `{parent.id}` is taken" if lenient else ""),
        node.state.span,
        help="give its default a target",
        severity=_tolerated(document),
        fixes=_first_default(tree, node),
    )
    if not lenient:
        return None
    implied = written or DocTransition(Trigger.INITIAL, node.state.span, origin=node.state.origin)
    if parent.state.initial is not None:
        return implied, _targets(tree, parent.state.initial, Findings())
    children = tree.real_children(parent.index)
    return implied, children if parent.kind is Kind.PARALLEL else children[:1]


def _may_default(tree: Tree, history: Node, target: int) -> bool:
    """Whether a history may enter that state by default (SCXML 3.10)."""
    if history.kind is Kind.DEEP_HISTORY:
        return tree.is_descendant(target, tree.parent(history).index)
    return tree.nodes[target].parent == history.parent and not tree.nodes[target].is_history


def _tolerated(document: Document) -> Severity | None:
    """Return how much a fault matters that real SCXML files have and that has one meaning."""
    return Severity.WARNING if document.datamodel != "fsmkit" else None
