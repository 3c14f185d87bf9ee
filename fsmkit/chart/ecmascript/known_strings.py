"""The strings that each variable can hold, if all are known at compile time.

A string has no storage of its own: what is joined at run time must be one of those known here.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from itertools import product

from fsmkit.chart.ecmascript.rewrite import names as names_in
from fsmkit.chart.ecmascript.rewrite import parsed
from fsmkit.chart.ecmascript.string_values import FUNCTIONS, Unknown, evaluate
from fsmkit.diagnostics import Text
from fsmkit.document.document import DocData, DocInvoke, Document, Trigger
from fsmkit.document.invocation_context import InvocationContext
from fsmkit.document.literal_content import string
from fsmkit.document.walk import states
from fsmkit.language import location_of_session, syntax
from fsmkit.language.binding.ecmascript import PROCESSORS, SESSION
from fsmkit.language.statements.tree import Assign, Block, DocSend, ForEach, If

MOST_VALUES = 256
"""The most known strings of a variable; with more, its value counts as unknown."""
MOST_PAIRS = 4096
"""Pairs of strings that one ``+`` may join, and values that one expression may take apart."""
MOST_LENGTH = 1000
"""The most characters of a joined string."""

Made = tuple[str, frozenset[int]]
"""A string, and the statements executed at most once that have taken part in joining it."""


@dataclass(frozen=True, slots=True)
class Choice:
    """A possible string of an expression; ``condition`` None: if no other condition holds."""

    condition: str | None
    value: str


@dataclass
class KnownStrings:
    """The strings that the variables of a document can hold, None for any other variable."""

    location: str
    """The location of this session, which is the origin of its events."""
    constants: Mapping[str, str]
    values: dict[str, set[Made] | None] = field(default_factory=dict)
    unset: set[str] = field(default_factory=set)
    """Variables that have no value at first."""
    once: frozenset[int] = frozenset()
    """Identities of the assignments that are executed at most once."""
    is_alone: bool = True
    """Whether this session is the origin of every event that has one."""

    def strings_of(self, name: str) -> set[str] | None:
        """Return the possible strings of a variable, or None if it may hold another value."""
        made = self.values.get(name)
        return None if made is None else {value for value, _ in made}

    def choices(
        self, text: Text, statement: Assign[Text, Text] | None = None
    ) -> tuple[Choice, ...]:
        """Return the possible strings of an expression with their conditions; none if unknown.

        The last one has no condition if the variables surely have a value. ``statement`` is the
        one that evaluates the expression.
        """
        node = parsed(text)
        names = sorted(_names(node) - self.constants.keys())
        known = [self._before(name, statement) for name in names]
        if node is None or not all(known) or not self._is_joined(node):
            return ()
        found = []
        asked = [n for n, v in zip(names, known, strict=True) if len(v) > 1 or n in self.unset]
        for values in product(*known):
            held = dict(zip(names, values, strict=True))
            made = self._strings(
                node, {name: {(value, frozenset())} for name, value in held.items()}
            )
            tests = [f"{name} == {string(held[name], text).value}" for name in asked]
            found += [Choice(" && ".join(tests) or None, value) for value, _ in made or ()]
        if len(found) > MOST_VALUES:
            return ()
        if found and not self.unset.intersection(asked):
            found[-1] = Choice(None, found[-1].value)
        return tuple(found)

    def joins(self, text: Text) -> bool:
        """Whether an expression joins strings of which at least one is a variable's."""
        node = parsed(text)
        if not isinstance(node, syntax.BinaryNode) or not self._is_joined(node):
            return False
        names = _names(node)
        return bool(names - self.constants.keys()) and all(
            name in self.constants or self.values.get(name) for name in names
        )

    def _before(self, name: str, statement: Assign[Text, Text] | None) -> list[str]:
        """Return the possible strings of a variable before a statement."""
        mark = None if statement is None else id(statement)
        made = self.values.get(name) or ()
        return sorted({value for value, marks in made if mark not in marks})

    def _is_joined(self, node: syntax.Node) -> bool:
        match node:
            case syntax.BinaryNode(op="+", left=left, right=right):
                return self._is_joined(left) and self._is_joined(right)
            case _:
                return isinstance(node, syntax.NameNode | syntax.StringNode) or self._is_location(
                    node
                )

    def _is_location(self, node: syntax.Node) -> bool:
        match node:
            case syntax.MemberNode(
                base=syntax.ElementNode(
                    base=syntax.NameNode(name="_ioprocessors"), index=syntax.StringNode(value=name)
                ),
                name="location",
            ):
                return name in PROCESSORS
            case _:
                return False

    # --- what is given to whom --------------------------------------------------------------------

    def learn(self, gifts: Iterable[tuple[str, syntax.Node | None, int]]) -> None:
        """Collect the strings assigned to variables, up to a fixed point."""
        listed = list(gifts)
        self.values = {name: set() for name, _, _ in listed}
        self.values |= {name: None for name, node, _ in listed if node is None}
        is_news = True
        while is_news:
            news = [self._give(name, node, mark) for name, node, mark in listed]
            is_news = any(news)

    def _give(self, name: str, node: syntax.Node | None, mark: int) -> bool:
        """Add the strings that one statement assigns; return whether any was new."""
        held = self.values[name]
        if node is None or held is None:
            return False
        made = self._strings(node, self.values)
        if made is not None and mark in self.once:
            made = {(value, marks | {mark}) for value, marks in made if mark not in marks}
        if made is not None and made <= held:
            return False
        self.values[name] = None if made is None or len(held | made) > MOST_VALUES else held | made
        return True

    def _strings(self, node: syntax.Node, held: Mapping[str, set[Made] | None]) -> set[Made] | None:
        """Return the possible strings of an expression if the variables hold ``held``."""
        match node:
            case syntax.StringNode(value=value):
                return {(value, frozenset())}
            case syntax.NameNode(name=name) if name in self.constants:
                return {(self.constants[name], frozenset())}
            case syntax.NameNode(name=name):
                return held.get(name)
            case syntax.BinaryNode(op="+", left=left, right=right):
                first, second = self._strings(left, held), self._strings(right, held)
                if first is None or second is None or len(first) * len(second) > MOST_PAIRS:
                    return None
                made = {(a + b, x | y) for a, x in first for b, y in second}
                too_long = any(len(value) > MOST_LENGTH for value, _ in made)
                return None if too_long or len(made) > MOST_VALUES else made
            case syntax.ConditionalNode(then=then, otherwise=otherwise):
                first, second = self._strings(then, held), self._strings(otherwise, held)
                return None if first is None or second is None else first | second
            case syntax.CallNode() | syntax.ElementNode() if not self._is_location(node):
                return self._applied(node, held)
            case syntax.MemberNode(base=syntax.NameNode(name="_event"), name="origin") if (
                self.is_alone
            ):
                return {(self.location, frozenset())}
            case _ if self._is_location(node):
                return {(self.location, frozenset())}
            case _:
                return None

    def _applied(self, node: syntax.Node, held: Mapping[str, set[Made] | None]) -> set[Made] | None:
        """Return the possible results of methods of strings (see `string_values`)."""
        names = sorted(names_in(node) - set(FUNCTIONS))
        sets = [held.get(name) for name in names]
        count = 1
        for values in sets:
            if values is None:
                return None
            count *= len(values)
        if not names or count > MOST_PAIRS:
            return None
        results: set[Made] = set()
        for chosen in product(*(values or () for values in sets)):
            given = {name: value for name, (value, _) in zip(names, chosen, strict=True)}
            try:
                result = evaluate(node, given)
            except Unknown:
                return None
            if not isinstance(result, str):
                return None
            results.add((result, frozenset().union(*(marks for _, marks in chosen))))
        return results if len(results) <= MOST_VALUES else None


def find_strings(
    document: Document,
    parts: tuple[object, ...],
    given: InvocationContext | None,
    placeholders: Mapping[str, str],
) -> KnownStrings:
    """Return the possible strings of a document's variables; its invoker sets ``given``.

    ``placeholders`` are start numbers of variables that later hold only strings.
    """
    name = document.name.value
    session = name if given is None else given.session
    is_alone = given is None and not any(isinstance(part, DocInvoke) for part in parts)
    known = KnownStrings(
        location_of_session(session),
        {"_name": name, SESSION: session},
        once=frozenset(_executed_once(document)),
        is_alone=is_alone,
    )
    set_outside = [written.name.value for written in (*document.inputs, *document.outputs)]
    set_outside += [] if given is None else [name for name, _ in given.data]
    gifts: list[tuple[str, syntax.Node | None, int]] = [(name, None, 0) for name in set_outside]
    for part in parts:
        match part:
            case DocData(name=written, init=None):
                known.unset.add(written.value)
            case DocData(name=written, init=Text() as init):
                stands = placeholders.get(written.value)
                gifts.append(
                    (written.value, parsed(init if stands is None else string(stands, init)), 0)
                )
            case Assign(location, value, operator=operator):
                gifts.append(
                    (location.value.strip(), parsed(assigned(location, value, operator)), id(part))
                )
            case ForEach(item=item, index=index):
                gifts += [(each.value.strip(), None, 0) for each in (item, index) if each]
            case DocSend(id=Text() as made, id_location=Text() as location):
                gifts.append((location.value.strip(), parsed(string(made.value, location)), 0))
            case DocInvoke(id_location=Text() as location):
                gifts.append((location.value.strip(), None, 0))
            case _:
                pass
    known.learn(gifts)
    return known


def assigned(location: Text, value: Text, operator: str) -> Text:
    """Return the expression that an assignment evaluates, for ``x += y`` too."""
    if not operator:
        return value
    text = f"{location.value.strip()} {operator} ({value.value})"
    return Text(text, value.span, ())


def _names(node: syntax.Node | None) -> set[str]:
    match node:
        case syntax.NameNode(name=name):
            return {name}
        case syntax.BinaryNode(left=left, right=right):
            return _names(left) | _names(right)
        case _:
            return set()


# --- what is executed at most once ----------------------------------------------------------------


def _executed_once(document: Document) -> Iterator[int]:
    """Yield the identities of the assignments that are executed at most once.

    Those of the script, and of the entry of states outside of every loop: no transition leads into
    the top-level state that they are in, so that it is entered when the machine starts or never.
    """
    targets = {
        target.value
        for state in states(document.root)
        for transition in state.transitions
        if transition.trigger is not Trigger.INITIAL
        for target in transition.targets
    }
    blocks = [document.script]
    for child in document.root.children:
        inside = list(states(child))
        if not any(state.id is not None and state.id.value in targets for state in inside):
            blocks += [block for state in inside for block in state.entry]
    found = Counter(mark for block in blocks for mark in _assignments(block))
    yield from (mark for mark, count in found.items() if count == 1)


def _assignments(block: Block) -> Iterator[int]:
    """Yield the identities of the assignments of a handler, those in its loops left aside."""
    for statement in block:
        match statement:
            case Assign():
                yield id(statement)
            case If(branches):
                for branch in branches:
                    yield from _assignments(branch.body)
            case _:
                pass
