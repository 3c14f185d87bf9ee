"""Find every event: declared, implied by its use, or raised by the platform."""

from __future__ import annotations

import re
from bisect import bisect_left
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import islice, takewhile

from fsmkit.chart.chart import Event, for_the_host
from fsmkit.chart.passes.collect_names import read_fields
from fsmkit.chart.passes.number_states import Node, Tree, places
from fsmkit.diagnostics import Findings, Span, Text
from fsmkit.document.document import Direction, DocEvent, Document, Kind, Trigger
from fsmkit.document.invocation_context import InvocationContext
from fsmkit.document.walk import texts
from fsmkit.language import SYMBOL, Field, Scope, Type, location_of_session, read_type
from fsmkit.language.binding.ecmascript import PROCESSOR, SEND_ID
from fsmkit.language.statements.tree import DocSend, Raise, statements

DONE = "done.session"
"""The event that an invoked machine sends when it ends: ``done.invoke.id`` of its invoker."""
ASKED_TYPE = re.compile(r"_event\s*(\.\s*type\b|\[)")
ERRORS = ("error.execution", "error.range", "error.communication")


@dataclass(frozen=True)
class Events:
    """The events of a chart by name and by descriptor."""

    all: tuple[Event, ...]
    implied: frozenset[str] = frozenset()
    """Names of events nothing declares: their fields are read off their uses."""
    facts: Mapping[tuple[int | None, str], Mapping[str, str | None]] = field(default_factory=dict)
    """Facts about ``_event`` when an event is handled, in ECMAScript (SCXML 5.10.1).

    By the invocation that it comes from, if any, and name."""
    matched: frozenset[str] = frozenset()
    """Names of events of which nothing is known but that a transition matches them."""

    @cached_property
    def index(self) -> dict[str, int]:
        """Indices by name; of an event that comes from elsewhere too, the own one."""
        return {event.name: event.index for event in sorted(self.all, key=for_the_host)}

    def raised(self, event: Event) -> Event:
        """Return the event that `raise` raises: a separate one if the chart reads `_event.type`."""
        internal = {Direction.INTERNAL}
        having = [self.all[index] for index in self._by_name[event.name]]
        return next((e for e in having if e.invocation is None and e.directions == internal), event)

    def with_returned(self, returned: tuple[Returned, ...]) -> Events:
        """Return the same with events that invoked machines send.

        What transitions match is then taken to mean these, and not an event of the host.
        """
        if not returned:
            return self
        coming = sorted({event.name for event in returned})
        kept = [
            event
            for event in self.all
            if event.name not in self.matched
            or not (event.name in coming or names_below(event.name, coming))
        ]
        found = [
            *kept,
            *(Event(0, r.name, r.fields, frozenset(), invocation=r.slot) for r in returned),
        ]
        facts = dict(self.facts)
        if facts:
            facts |= {(r.slot, r.name): r.facts() for r in returned}
        numbered = tuple(replace(event, index=index) for index, event in enumerate(found))
        return Events(numbered, self.implied, facts, self.matched)

    def matching(self, descriptor: str) -> tuple[int, ...]:
        """Return the events a descriptor matches: by prefix of tokens (SCXML 3.12.1)."""
        if descriptor not in self._matching:
            self._matching[descriptor] = self._found(descriptor)
        return self._matching[descriptor]

    @cached_property
    def _matching(self) -> dict[str, tuple[int, ...]]:
        return {}

    def _found(self, descriptor: str) -> tuple[int, ...]:
        prefix = descriptor.removesuffix(".*").removesuffix(".")
        if prefix == "*":
            return tuple(event.index for event in self.all)
        names = [*names_below(prefix, self._sorted), prefix]
        return tuple(sorted(index for name in names for index in self._by_name.get(name, ())))

    @cached_property
    def _sorted(self) -> list[str]:
        return sorted(self._by_name)

    @cached_property
    def _by_name(self) -> dict[str, list[int]]:
        found: dict[str, list[int]] = {}
        for event in self.all:
            found.setdefault(event.name, []).append(event.index)
        return found

    def common_facts(self, indices: tuple[int, ...]) -> dict[str, str | None]:
        """Return the known attributes of ``_event`` that all these events share."""
        if not indices:
            return {}
        first, *rest = (
            self.facts.get((self.all[i].invocation, self.all[i].name), {}) for i in indices
        )
        return {k: v for k, v in first.items() if all(k in o and o[k] == v for o in rest)}

    def common_fields(self, indices: tuple[int, ...]) -> dict[str, Type]:
        """Return the fields that all these events have, with one type."""
        if not indices:
            return {}
        first, *rest = (self.all[i].fields for i in indices)
        return {f.name: f.type for f in first if all(f in other for other in rest)}


@dataclass(frozen=True, slots=True)
class Returned:
    """An event that an invoked machine sends to its invoker; ``event`` is its index there."""

    slot: int
    id: str
    session: str
    name: str
    fields: tuple[Field, ...]
    event: int
    has_id: bool = False

    def facts(self) -> dict[str, str | None]:
        """Return the known attributes of ``_event`` while this event is handled."""
        facts: dict[str, str | None] = {
            "type": "external",
            "origin": location_of_session(self.session),
            "origintype": PROCESSOR,
            "invokeid": self.id,
            "sendid": None,
        }
        if self.has_id:
            del facts["sendid"]
        return facts


def names_below(prefix: str, known: list[str]) -> list[str]:
    """Return the names, of a sorted list, that go on after a prefix of tokens."""
    start = prefix + "."
    first = bisect_left(known, start)
    return list(takewhile(lambda name: name.startswith(start), islice(known, first, None)))


def collect_events(
    document: Document,
    tree: Tree,
    scope: Scope,
    findings: Findings,
    given: InvocationContext | None = None,
    *,
    is_used: bool = False,
) -> Events:
    """Return the events of a document: declared, then implied, then the platform's.

    ``is_used``: the chart fills a state of another, which learns of its end as an invoker does.
    """
    found = [_event(group, scope, findings) for group in _groups(document).values()]
    names = {event.name for event in found}
    platform = (*ERRORS, *_done_events(tree, is_invoked=given is not None or is_used))
    implied: dict[str, _Use] = {}
    coming = () if given is None else given.events
    if document.datamodel != "fsmkit":
        implied = _implied(document, tree)
        for name, _ in coming:
            known_use = implied.setdefault(name, _Use(document.name.span))
            known_use.directions.add(Direction.IN)
            known_use.is_exact = True
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
    with_id = (Field(SEND_ID, SYMBOL),) if _sends_ids(document, tree) else ()
    found += [
        Event(0, name, with_id if name in ERRORS else (), frozenset())
        for name in platform
        if name not in names
    ]
    if document.datamodel == "ecmascript" and _reads_types(document):
        raised, sent = _senders(document, tree)
        senders = {*sent, *(name for name, _ in coming)}
        found = [each for e in found for each in _by_type(e, raised, senders)]
    numbered = tuple(
        Event(i, e.name, e.fields, e.directions, e.reply, e.span, e.origin)
        for i, e in enumerate(found)
    )
    facts = _facts(document, tree, numbered, given) if document.datamodel == "ecmascript" else {}
    matched = frozenset(name for name, use in implied.items() if not use.is_exact)
    by_place: dict[tuple[int | None, str], dict[str, str | None]] = {
        (None, name): known for name, known in facts.items()
    }
    return Events(numbered, frozenset(implied), by_place, matched)


def _sends_ids(document: Document, tree: Tree) -> bool:
    """Whether sent events carry the id of their `send`; then errors of sending carry it, too."""
    return any(
        isinstance(statement, DocSend) and any(a.name.value == SEND_ID for a in statement.arguments)
        for place in places(document, tree)
        for statement in statements(place.block)
    )


def _reads_types(document: Document) -> bool:
    """Whether ``_event.type`` stands anywhere in a document."""
    return any(ASKED_TYPE.search(text.value) for text in texts(document))


def _by_type(event: Event, raised: Collection[str], sent: Collection[str]) -> tuple[Event, ...]:
    """Return the event, or two events if its name is both raised and sent.

    The queues hold the number of an event, so the number determines ``_event.type``.
    """
    if event.name not in raised or event.name not in sent:
        return (event,)
    internal = frozenset({Direction.INTERNAL})
    return (
        replace(event, directions=(event.directions - internal) or frozenset({Direction.IN})),
        replace(event, directions=internal),
    )


def _senders(document: Document, tree: Tree) -> tuple[set[str], dict[str, bool]]:
    """Return the events that are raised, and those that are sent, with whether some have an id."""
    raised: set[str] = set()
    sent: dict[str, bool] = {}
    for place in places(document, tree):
        for statement in statements(place.block):
            match statement:
                case Raise(event):
                    raised.add(event.value)
                case DocSend(event=Text() as event, target=target):
                    if target is not None and target.value == "#_internal":
                        raised.add(event.value)
                    else:
                        has_id = statement.id is not None or statement.id_location is not None
                        sent[event.value] = sent.get(event.value, False) or has_id
    return raised, sent


def _facts(
    document: Document, tree: Tree, events: tuple[Event, ...], given: InvocationContext | None
) -> dict[str, dict[str, str | None]]:
    """Return the known attributes of ``_event`` by event, derived from its senders.

    An event that the chart never sends or raises comes from the host, and has no origin.
    """
    raised, sent = _senders(document, tree)
    session = document.name.value if given is None else given.session
    coming = set() if given is None else {name for name, _ in given.events}
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
            facts["origin"] = location_of_session(session)
            facts["origintype"] = PROCESSOR
            if sent[name]:
                facts.pop("sendid", None)
        facts["invokeid"] = None
        if given is not None and name in coming:
            is_own = name in sent or name in raised
            facts = {"type": "external", "origintype": PROCESSOR, "invokeid": None}
            if is_own:
                facts = {}
            else:
                facts["origin"] = location_of_session(given.invoker)
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
    """Whether it is raised or sent: a descriptor may be only the first tokens of a name."""


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
                case Raise(event):
                    use(event, Direction.INTERNAL)
                case DocSend(event=Text() as event):
                    use(event, Direction.IN)
                case _:
                    pass
    for name in document.posted:
        use(name, Direction.IN, is_exact=False)
    return found


def _done_events(tree: Tree, *, is_invoked: bool) -> list[str]:
    """Return ``done.state.x`` of each state that can be done (SCXML 3.7.1, 3.4).

    For an invoked machine, also return the event that its invoker receives when it ends.
    """
    found = [f"done.state.{node.id}" for node in tree.nodes[1:] if can_be_final(tree, node.index)]
    return [*found, *([DONE] if is_invoked and can_be_final(tree, 0) else [])]


def done_event(tree: Tree, final: Node) -> str:
    """Return the event that is raised when `final` is entered: its parent is done."""
    parent = tree.parent(final)
    return f"done.state.{parent.id}" if parent.index else DONE


def can_be_final(tree: Tree, state: int) -> bool:
    """Whether a state can be in a final configuration (Appendix D, isInFinalState)."""
    node = tree.nodes[state]
    if node.kind is Kind.COMPOUND:
        return any(tree.nodes[child].kind is Kind.FINAL for child in node.children)
    if node.kind is Kind.PARALLEL:
        regions = tree.real_children(state)
        return bool(regions) and all(can_be_final(tree, region) for region in regions)
    return False
