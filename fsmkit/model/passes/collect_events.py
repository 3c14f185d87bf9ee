"""Find every event: declared, implied by its use, or raised by the platform."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from itertools import islice, takewhile

from fsmkit.diagnostics import Findings, Span, Text
from fsmkit.expressions import Scope, Type, location_of_session, read_type
from fsmkit.expressions.ecmascript import PROCESSOR
from fsmkit.model.chart import Event
from fsmkit.model.document import (
    Direction,
    DocEvent,
    DocRaise,
    DocSend,
    Document,
    Kind,
    Trigger,
)
from fsmkit.model.passes.collect_names import read_fields
from fsmkit.model.passes.number_states import Node, Tree
from fsmkit.model.passes.walk_content import places, statements

ERRORS = ("error.execution", "error.range", "error.communication")


@dataclass(frozen=True)
class Events:
    """The events of a chart by name and by descriptor."""

    all: tuple[Event, ...]
    implied: frozenset[str] = frozenset()
    """Names of events nothing declares: their fields are read off their uses."""
    facts: Mapping[str, Mapping[str, str | None]] = field(default_factory=dict)
    """What is known of ``_event`` when an event is handled, in ECMAScript (SCXML 5.10.1)."""

    @cached_property
    def index(self) -> dict[str, int]:
        """Indices by name."""
        return {event.name: event.index for event in self.all}

    def matching(self, descriptor: str) -> tuple[int, ...]:
        """Return the events a descriptor matches: by prefix of tokens (SCXML 3.12.1)."""
        prefix = descriptor.removesuffix(".*").removesuffix(".")
        if prefix == "*":
            return tuple(event.index for event in self.all)
        found = [self.index[name] for name in names_below(prefix, self._sorted)]
        if prefix in self.index:
            found.append(self.index[prefix])
        return tuple(sorted(found))

    @cached_property
    def _sorted(self) -> list[str]:
        return sorted(self.index)

    def common_facts(self, indices: tuple[int, ...]) -> dict[str, str | None]:
        """Return what is known alike of all these events."""
        if not indices:
            return {}
        first, *rest = (self.facts.get(self.all[i].name, {}) for i in indices)
        return {k: v for k, v in first.items() if all(k in o and o[k] == v for o in rest)}

    def common_fields(self, indices: tuple[int, ...]) -> dict[str, Type]:
        """Return the fields that all these events have, with one type."""
        if not indices:
            return {}
        first, *rest = (self.all[i].fields for i in indices)
        return {f.name: f.type for f in first if all(f in other for other in rest)}


def names_below(prefix: str, known: list[str]) -> list[str]:
    """Return the names, of a sorted list, that go on after a prefix of tokens."""
    start = prefix + "."
    first = bisect_left(known, start)
    return list(takewhile(lambda name: name.startswith(start), islice(known, first, None)))


def collect_events(document: Document, tree: Tree, scope: Scope, findings: Findings) -> Events:
    """Return the events of a document: declared, then implied, then the platform's."""
    found = [_event(group, scope, findings) for group in _groups(document).values()]
    names = {event.name for event in found}
    platform = (*ERRORS, *_done_events(tree))
    implied: dict[str, _Use] = {}
    if document.datamodel != "fsmkit":
        implied = _implied(document, tree)
        known = {*names, *platform, "done.state."}
        in_order = sorted(known)
        for name in list(implied):
            is_prefix = bool(names_below(name, in_order))
            if name in known or (is_prefix and not implied[name].is_exact):
                del implied[name]
        found += [
            Event(0, name, (), frozenset(use.directions), span=use.span)
            for name, use in implied.items()
        ]
    for name in sorted(names & set(platform)):
        findings.add(
            "reserved-event",
            f"`{name}` is raised by the platform and cannot be declared",
            next(e.span for e in found if e.name == name),
            help="remove the declaration: the event can be matched without one",
        )
    found += [Event(0, name, (), frozenset()) for name in platform if name not in names]
    numbered = tuple(
        Event(i, e.name, e.fields, e.directions, e.reply, e.span, e.origin)
        for i, e in enumerate(found)
    )
    facts = _facts(document, tree, numbered) if document.datamodel == "ecmascript" else {}
    return Events(numbered, frozenset(implied), facts)


def _facts(
    document: Document, tree: Tree, events: tuple[Event, ...]
) -> dict[str, dict[str, str | None]]:
    """Return what is known of each event: where it comes from is seen where it is sent.

    One that the chart never sends or raises itself comes from the host, and has no origin.
    """
    raised: set[str] = set()
    sent: dict[str, bool] = {}
    for place in places(document, tree):
        for statement in statements(place.block):
            match statement:
                case DocRaise(event):
                    raised.add(event.value)
                case DocSend(event=Text() as event, target=target):
                    if target is not None and target.value == "#_internal":
                        raised.add(event.value)
                    else:
                        has_id = statement.id is not None or statement.id_location is not None
                        sent[event.value] = sent.get(event.value, False) or has_id
    has_invoke = any(node.state.invokes for node in tree.nodes)
    found: dict[str, dict[str, str | None]] = {}
    for name in (event.name for event in events):
        facts: dict[str, str | None] = {"origin": None, "origintype": None, "sendid": None}
        if name.startswith(("error.", "done.")):
            facts["type"] = "platform"
            del facts["sendid"]
        elif name in raised:
            facts["type"] = "internal"
        else:
            facts["type"] = "external"
        if name in sent and name in raised:
            facts = {}
        elif name in sent:
            facts["origin"] = location_of_session(document.name.value)
            facts["origintype"] = PROCESSOR
            if sent[name]:
                del facts["sendid"]
        if not has_invoke:
            facts["invokeid"] = None
        found[name] = facts
    return found


def _groups(document: Document) -> dict[str, list[DocEvent]]:
    groups: dict[str, list[DocEvent]] = {}
    for declared in document.events:
        groups.setdefault(declared.name.value, []).append(declared)
    return groups


def _event(group: list[DocEvent], scope: Scope, findings: Findings) -> Event:
    """Return an event of all its declarations: one for each direction."""
    first = group[0]
    what = f"event `{first.name}`"
    fields = read_fields(first.fields, scope, findings, what)
    reply = None if first.reply is None else read_type(first.reply, scope, findings)
    origin = first.origin
    for number, other in enumerate(group[1:], 1):
        same = (other.fields, other.reply) == (first.fields, first.reply)
        if not same or any(other.direction is e.direction for e in group[:number]):
            findings.add(
                "duplicate-name",
                f"{what} is declared twice" if same else f"{what} is declared in two ways",
                other.name,
                label="the second",
                secondary=[(first.name, "the first")],
                help="declare it once for each direction, with the same fields",
            )
    _check_name(first.name, findings)
    directions = frozenset(e.direction for e in group)
    return Event(0, first.name.value, fields, directions, reply, first.name.span, origin)


def _check_name(name: Text, findings: Findings) -> None:
    if "*" in name.value or any(not token for token in name.value.split(".")):
        findings.add(
            "reserved-event",
            f"`{name}` is no name of an event",
            name,
            help="write words joined by dots; `*` only matches events",
        )


@dataclass
class _Use:
    span: Span
    directions: set[Direction] = field(default_factory=set)
    is_exact: bool = False
    """Whether it is raised or sent: a descriptor may be only the beginning of a name."""


def _implied(document: Document, tree: Tree) -> dict[str, _Use]:
    """Return every event that is matched, raised or sent by its name, in document order."""
    found: dict[str, _Use] = {}

    def use(name: Text, direction: Direction, *, is_exact: bool = True) -> None:
        plain = name.value if is_exact else name.value.removesuffix(".*").removesuffix(".")
        if plain and plain != "*":
            known = found.setdefault(plain, _Use(name.span))
            known.directions.add(direction)
            known.is_exact |= is_exact

    for place in places(document, tree):
        if place.transition is not None and place.transition.trigger is Trigger.EVENT:
            for descriptor in place.transition.events:
                use(descriptor, Direction.IN, is_exact=False)
        for statement in statements(place.block):
            match statement:
                case DocRaise(event):
                    use(event, Direction.INTERNAL)
                case DocSend(event=Text() as event):
                    use(event, Direction.IN)
                case _:
                    pass
    return found


def _done_events(tree: Tree) -> list[str]:
    """Return ``done.state.x`` of each state that can be done (SCXML 3.7.1, 3.4)."""
    return [f"done.state.{node.id}" for node in tree.nodes[1:] if can_be_final(tree, node.index)]


def done_event(tree: Tree, final: Node) -> str:
    """Return the event that tells of a final state that its parent is done."""
    return f"done.state.{tree.parent(final).id}"


def can_be_final(tree: Tree, state: int) -> bool:
    """Whether a state can be in a final configuration (Appendix D, isInFinalState)."""
    node = tree.nodes[state]
    if node.kind is Kind.COMPOUND:
        return any(tree.nodes[child].kind is Kind.FINAL for child in node.children)
    if node.kind is Kind.PARALLEL:
        regions = tree.real_children(state)
        return bool(regions) and all(can_be_final(tree, region) for region in regions)
    return False
