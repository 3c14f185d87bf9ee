"""Names of events that a `send` joins: of the name of the current event, strings and numbers.

SCXML joins them at run time. Here an event has a number, and the names that the current event can
have are a finite set; so the joined names are one, too. A name that no descriptor of the chart
matches is discarded when it is taken (SCXML 3.13): such an event need not exist in the chart.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from itertools import product

from fsmkit.chart.ecmascript.entered_states import EnteredStates
from fsmkit.chart.ecmascript.known_strings import MOST_LENGTH, Choice, KnownStrings
from fsmkit.chart.ecmascript.known_values import find_values
from fsmkit.chart.ecmascript.string_values import CURRENT_NAME
from fsmkit.diagnostics import Text
from fsmkit.document import document as doc
from fsmkit.document.invocation_context import InvocationContext
from fsmkit.document.literal_content import string
from fsmkit.document.walk import structure
from fsmkit.language import syntax
from fsmkit.language.statements.tree import DocSend, Raise

MOST_NAMES = 256
"""Names that joining may add to a chart, and events that one `send` may choose among."""
MOST_PAIRS = 65_536
"""Pairs of strings that one ``+`` may join."""
ERRORS = ("error.execution", "error.range", "error.communication")
OWN_TARGETS = ("#_internal", "self")
WHOLE = re.compile(r"0|[1-9]\d{0,14}")
"""A number that is written in a string as it is in an expression."""
HOLE = "\0"
"""Placeholder for the name of the current event if only the text around it matters."""

ConditionalString = tuple[dict[str, str], str]
"""By tested subject, its condition; and the resulting string if these conditions hold."""


@dataclass(frozen=True, slots=True)
class Join:
    """A `send` whose event is computed; ``at`` are prefixes of the possible current events."""

    send: DocSend
    expression: Text
    node: syntax.Node
    at: frozenset[str]
    may_lack_event: bool
    """Whether it may be executed before the first event."""


@dataclass
class JoinedNames:
    """The possible names of the current event, and the names that can be joined from them."""

    known: KnownStrings
    numbers: Mapping[str, tuple[int, ...]] = field(default_factory=dict)
    """The whole numbers that variables can hold, where they are few."""
    descriptors: frozenset[str] = frozenset()
    """Descriptors of the chart without their wildcard suffixes."""
    out: frozenset[str] = frozenset()
    forwards: bool = False
    """Whether an invoked machine also gets the events of this one."""
    may_derive: bool = False
    names: set[str] = field(default_factory=set)
    derived: dict[str, Text] = field(default_factory=dict)
    """Names that only the host can post, derived from names that are joined from them."""
    joins: dict[int, Join] = field(default_factory=dict)
    """By the identity of the expression, which outlives all changes of the `send` it is in."""
    endless: set[int] = field(default_factory=set)
    """Identities of expressions that join more names than `MOST_NAMES`."""

    def choices(self, send: DocSend, expression: Text) -> tuple[Choice, ...] | None:
        """Return each event that a `send` can send, or None if they are not known.

        If none of the conditions holds, nothing is sent.
        """
        join = self.joins.get(id(expression))
        if join is None or id(expression) in self.endless:
            return None
        current = sorted(name for name in self.names if matches(join.at, name))
        made = self._strings(join.node, expression, current)
        if made is None:
            return None
        kept = [(held, value) for held, value in made if self._is_kept(held, value, send)]
        if len(kept) > MOST_NAMES:
            self.endless.add(id(expression))
            return None
        return tuple(Choice(_condition(held), value) for held, value in kept)

    def may_lack_event(self, expression: Text) -> bool:
        """Whether an expression reads the current event and may be evaluated without one."""
        join = self.joins[id(expression)]
        if not join.may_lack_event:
            return False
        made = self._strings(join.node, expression, [HOLE]) or ()
        return any(CURRENT_NAME in held for held, _ in made)

    def _is_kept(self, held: dict[str, str], value: str, send: DocSend) -> bool:
        is_elsewhere = value in self.out or self.forwards or not _stays(send)
        return is_elsewhere or self._exists(held, value)

    def _exists(self, held: dict[str, str], value: str) -> bool:
        """Whether a raised event belongs to the chart: its name is written or matched there."""
        return CURRENT_NAME not in held or matches(self.descriptors, value)

    # --- a fixpoint: a joined name is a current event later ---------------------------------------

    def learn(self, base: Iterable[str]) -> None:
        """Find all names; joins that add more of them than allowed become `endless`."""
        start = set(base)
        while True:
            left = [join for place, join in self.joins.items() if place not in self.endless]
            self.names, self.derived = set(start), {}
            growing = self._grow(left)
            if not growing:
                return
            self.endless |= growing

    def _grow(self, joins: list[Join]) -> set[int]:
        """Add names until none is new; return the expressions that produced too many, if any."""
        most = len(self.names) + MOST_NAMES
        fresh = set(self.names)
        while fresh:
            new: dict[str, Text] = {}
            for join in joins:
                if not _may_stay(join.send):
                    continue
                current = sorted(name for name in fresh if matches(join.at, name))
                made = self._strings(join.node, join.expression, current) or ()
                if any(len(value) > MOST_LENGTH for _, value in made):
                    return {id(join.expression)}
                found = {value for held, value in made if self._exists(held, value)}
                new |= dict.fromkeys(found - self.names, join.expression)
                for name in self._derive(join, fresh):
                    new[name] = self.derived[name] = join.expression
            fresh = set(new) - self.names
            self.names |= fresh
            if len(self.names) > most:
                return {id(text) for text in new.values()}
        return set()

    def _derive(self, join: Join, known: Collection[str]) -> Iterator[str]:
        """Yield the names that known names are joined from, if the host may post them."""
        if not self.may_derive:
            return
        for held, value in self._strings(join.node, join.expression, [HOLE]) or ():
            if CURRENT_NAME not in held or value.count(HOLE) != 1:
                continue
            before, after = value.split(HOLE)
            for name in known:
                length = len(name) - len(after)
                if name.startswith(before) and name.endswith(after) and length > len(before):
                    found = name[len(before) : length]
                    if found not in self.names and _is_posted(found) and matches(join.at, found):
                        yield found

    def _strings(
        self, node: syntax.Node, text: Text, names: Collection[str]
    ) -> list[ConditionalString] | None:
        """Return each possible string of an expression, or None if they are not known."""
        match node:
            case syntax.StringNode(value=value):
                return [({}, value)]
            case syntax.NameNode(name=name) if name in self.known.constants:
                return [({}, self.known.constants[name])]
            case syntax.NameNode(name=name) if (
                name not in self.known.unset and self.known.strings_of(name)
            ):
                values = sorted(self.known.strings_of(name) or ())
                return [_equal(name, value, text) for value in values]
            case syntax.NameNode(name=name) if name in self.numbers:
                return [({name: f"{name} == {n}"}, str(n)) for n in self.numbers[name]]
            case syntax.NumberNode(digits=digits) if WHOLE.fullmatch(digits):
                return [({}, digits)]
            case syntax.MemberNode(base=syntax.NameNode(name="_event"), name="name"):
                return [_equal(CURRENT_NAME, name, text) for name in names]
            case syntax.ConditionalNode(test=test, then=then, otherwise=otherwise):
                return self._either(test, then, otherwise, text, names)
            case syntax.BinaryNode(op="+", left=left, right=right) if not self._is_sum(node):
                first, second = (self._strings(each, text, names) for each in (left, right))
                if first is None or second is None or len(first) * len(second) > MOST_PAIRS:
                    return None
                return [
                    (a | b, x + y)
                    for (a, x), (b, y) in product(first, second)
                    if all(b.get(subject, value) == value for subject, value in a.items())
                ]
            case _:
                return None

    def _is_sum(self, node: syntax.Node) -> bool:
        """Whether a value is a number or a sum of numbers, so that ``+`` does not join strings."""
        match node:
            case syntax.BinaryNode(op="+", left=left, right=right):
                return self._is_sum(left) and self._is_sum(right)
            case syntax.ConditionalNode(then=then, otherwise=otherwise):
                return self._is_sum(then) or self._is_sum(otherwise)
            case syntax.NameNode(name=name):
                return name in self.numbers
            case _:
                return isinstance(node, syntax.NumberNode)

    def _either(
        self,
        test: syntax.Node,
        then: syntax.Node,
        otherwise: syntax.Node,
        text: Text,
        names: Collection[str],
    ) -> list[ConditionalString] | None:
        asked = f"({text.value[test.start : test.end]})"
        if _read(asked) is None:
            return None
        first, second = (self._strings(each, text, names) for each in (then, otherwise))
        if first is None or second is None:
            return None
        return [
            ({asked: condition} | held, value)
            for strings, condition in ((first, asked), (second, f"!{asked}"))
            for held, value in strings
            if held.get(asked, condition) == condition
        ]


def find_joined_names(
    document: doc.Document,
    whole: tuple[object, ...],
    given: InvocationContext | None,
    known: KnownStrings,
) -> JoinedNames:
    """Return the joined names of a document with the parts ``whole``, invoked with ``given``."""
    sends = (part for part in whole if isinstance(part, DocSend))
    if not any(send.event is None and send.event_expr is not None for send in sends):
        return JoinedNames(known)
    descriptors = frozenset(_descriptors(whole))
    found = JoinedNames(
        known,
        _numbers(document, whole, given),
        descriptors,
        frozenset(e.name.value for e in document.events if e.direction is doc.Direction.OUT),
        any(isinstance(part, doc.DocInvoke) and part.autoforward for part in whole),
        given is None and not document.events,
        joins={id(join.expression): join for join in _joins(document, whole, descriptors)},
    )
    found.learn(names_of_events(whole, given, known))
    return found


def names_of_events(
    whole: tuple[object, ...], given: InvocationContext | None, known: KnownStrings
) -> set[str]:
    """Return the possible names of the current event, without those that are joined.

    A descriptor counts as the event of its name, unless it is a prefix of a platform event.
    """
    own = set(_named(whole, known))
    platform = {*ERRORS, *_done(whole)}
    coming = set() if given is None else {name for name, _ in given.events}
    matched = {
        name
        for name in _descriptors(whole) - {"*", ""}
        if not any(other.startswith(name + ".") for other in platform)
    }
    return own | platform | coming | matched


def _descriptors(whole: tuple[object, ...]) -> set[str]:
    """Return the event descriptors of all transitions without their wildcard suffixes."""
    return {
        prefix(descriptor.value)
        for part in whole
        if isinstance(part, doc.DocTransition) and part.trigger is doc.Trigger.EVENT
        for descriptor in part.events
    }


def _numbers(
    document: doc.Document, whole: tuple[object, ...], given: InvocationContext | None
) -> Mapping[str, tuple[int, ...]]:
    """Return the whole numbers that variables can hold, where they are few."""
    return {
        name: tuple(sorted(v for v in values if isinstance(v, int)))
        for name, values in find_values(document, whole, given).items()
        if all(type(value) is int for value in values)
    }


def prefix(descriptor: str) -> str:
    """Return the tokens that a matching name starts with; ``*`` alone matches any name."""
    return descriptor.removesuffix(".*").removesuffix(".")


def matches(prefixes: Collection[str], name: str) -> bool:
    """Whether a name starts with the tokens of one of the prefixes (SCXML 3.12.1)."""
    if "*" in prefixes:
        return True
    tokens = name.split(".")
    return any(".".join(tokens[:count]) in prefixes for count in range(1, len(tokens) + 1))


def _joins(
    document: doc.Document, whole: tuple[object, ...], descriptors: frozenset[str]
) -> Iterator[Join]:
    """Yield each join, with the possible current events at its location."""
    entered = EnteredStates(document)
    states = [part for part in whole if isinstance(part, doc.DocState)]
    entering = [state for state in states if list(_joined_in(state.entry, descriptors))]
    leading = entered.descriptors(entering)
    yield from _joined_in(document.script, frozenset(), may_lack_event=True)
    for state in states:
        is_early = id(state) in entered.at_start
        at = frozenset(map(prefix, leading.get(id(state), ())))
        yield from _joined_in(state.entry, at, may_lack_event=is_early)
        yield from _joined_in(state.exit, descriptors, may_lack_event=is_early)
        yield from _joined_in(state.initial, descriptors, may_lack_event=is_early)
        for transition in state.transitions:
            is_event = transition.trigger is doc.Trigger.EVENT
            at = frozenset(prefix(e.value) for e in transition.events) if is_event else descriptors
            yield from _joined_in(transition.content, at, may_lack_event=is_early and not is_event)
        for invoke in state.invokes:
            yield from _joined_in(invoke.finalize, frozenset("*"))


def _joined_in(
    whole: object, at: frozenset[str], *, may_lack_event: bool = False
) -> Iterator[Join]:
    for send in structure(whole):
        if isinstance(send, DocSend) and send.event is None and send.event_expr is not None:
            node = _read(send.event_expr.value)
            if node is not None:
                yield Join(send, send.event_expr, node, at, may_lack_event)


def _named(whole: Iterable[object], known: KnownStrings) -> Iterator[str]:
    """Yield the names of events that are declared, raised or sent, by invoked charts too."""
    for part in whole:
        match part:
            case doc.DocEvent(name=name):
                yield name.value
            case Raise(event=event) | DocSend(event=Text() as event):
                yield event.value
            case DocSend(event_expr=Text() as expression):
                yield from (choice.value for choice in known.choices(expression))
            case doc.DocInvoke():
                if part.id is not None:
                    yield f"done.invoke.{part.id}"
                inner = [part.content, *(charts[0] for _, charts in part.loaded)]
                for chart in inner:
                    if chart is not None:
                        yield from _named(tuple(structure(chart)), KnownStrings("", {}))
            case _:
                pass


def _done(whole: Iterable[object]) -> Iterator[str]:
    """Yield the events of states that can be done; some of them may never be."""
    for part in whole:
        if isinstance(part, doc.DocState) and part.id is not None:
            is_done = any(child.kind is doc.Kind.FINAL for child in part.children)
            if is_done or part.kind is doc.Kind.PARALLEL:
                yield f"done.state.{part.id}"


def _stays(send: DocSend) -> bool:
    """Whether a sent event goes to its own machine only."""
    if send.target is None:
        return send.target_expr is None
    return send.target.value in OWN_TARGETS


def _may_stay(send: DocSend) -> bool:
    is_elsewhere = send.target is not None and not send.target.value.startswith("#_scxml_")
    return _stays(send) or not is_elsewhere


def _is_posted(name: str) -> bool:
    return all(name.split(".")) and not name.startswith(("error.", "done."))


def _equal(subject: str, value: str, at: Text) -> ConditionalString:
    return {subject: f"{subject} == {string(value, at).value}"}, value


def _condition(held: dict[str, str]) -> str | None:
    return " && ".join(held.values()) or None


def _read(text: str) -> syntax.Node | None:
    try:
        return syntax.parse(text)
    except syntax.SyntaxFault:
        return None
