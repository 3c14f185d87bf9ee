"""The values that each variable can hold, if they are few and known at compile time.

Every assignment is evaluated for the values that its variables can hold, until no value is new.
A guard or condition that is false for some of them excludes these: a counter ends at its bound.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import product

from fsmkit.chart.ecmascript.known_numbers import find_numbers
from fsmkit.chart.ecmascript.known_strings import MOST_LENGTH, MOST_PAIRS, assigned
from fsmkit.chart.ecmascript.rewrite import names, parsed
from fsmkit.chart.ecmascript.string_values import FUNCTIONS, Unknown, Value, evaluate
from fsmkit.diagnostics import Text
from fsmkit.document import document as doc
from fsmkit.document.invocation_context import InvocationContext
from fsmkit.document.walk import states, structure
from fsmkit.language.binding.ecmascript import NOTHING
from fsmkit.language.statements.tree import Assign, Block, DocSend, ForEach, If
from fsmkit.language.syntax import ConditionalNode, Node

MOST_VALUES = 64
"""The most known values of a variable, unless its type has more."""
MOST_PASSES = 2 * MOST_VALUES
EXACT = ("int32", "symbol", "string")
"""Types that store each value of these kinds as it is."""
Known = Mapping[str, frozenset[Value] | None]
"""The possible values of each variable; None if unknown."""


@dataclass(frozen=True, slots=True)
class Condition:
    """A condition and whether it holds."""

    node: Node
    holds: bool


@dataclass(frozen=True, slots=True)
class Gift:
    """A value that a variable is given, None for an unknown one, and when."""

    name: str
    node: Node | None
    conditions: tuple[Condition, ...] = ()


def find_values(
    document: doc.Document, whole: tuple[object, ...], given: InvocationContext | None
) -> Mapping[str, frozenset[Value]]:
    """Return the values that variables can hold; ``whole`` are the parts of the document."""
    hosts = [data.name.value for data in (*document.inputs, *document.outputs)]
    outside = {*hosts, *(() if given is None else (name for name, _ in given.data))}
    declared = {name: frozenset(found) for name, found in find_numbers(whole, outside).items()}
    fixed: dict[str, frozenset[Value]] = {}
    gifts = [Gift(name, None) for name in outside]
    for part in whole:
        if isinstance(part, doc.DocData) and part.type is not None:
            if part.type.value.strip() == "bool":
                fixed[part.name.value] = frozenset((False, True))
            elif part.name.value in declared:
                fixed[part.name.value] = declared[part.name.value]
            elif part.type.value.strip() not in EXACT:
                gifts.append(Gift(part.name.value, None))
    gifts += _Walk(document, whole).gifts()
    known = _fixpoint(gifts, fixed)
    known |= {n: found for n, found in declared.items() if known.get(n) is None}
    return {name: found for name, found in known.items() if found}


def _fixpoint(
    gifts: Sequence[Gift], fixed: Mapping[str, frozenset[Value]]
) -> dict[str, frozenset[Value] | None]:
    """Return the possible values of variables; ``fixed`` ones have the values of their types."""
    known: dict[str, frozenset[Value] | None] = {gift.name: frozenset() for gift in gifts}
    known |= {gift.name: None for gift in gifts if gift.node is None}
    known |= fixed
    open_gifts = [gift for gift in gifts if gift.name not in fixed and gift.node is not None]
    reads = [_names(gift.node) | _read(gift.conditions) for gift in open_gifts]
    fresh: set[str] | None = None
    for _ in range(MOST_PASSES):
        news = set()
        for gift, read in zip(open_gifts, reads, strict=True):
            held = known[gift.name]
            if held is None or (fresh is not None and not read & fresh):
                continue
            found = _values(gift, known)
            if found is None or len(found | held) > MOST_VALUES:
                known[gift.name] = None
                news.add(gift.name)
            elif not found <= held:
                known[gift.name] = held | found
                news.add(gift.name)
        if not news:
            return known
        fresh = news
    return {name: fixed.get(name) for name in known}


def _read(conditions: Iterable[Condition]) -> frozenset[str]:
    return frozenset(name for condition in conditions for name in _names(condition.node))


def _names(node: Node | None) -> frozenset[str]:
    return frozenset(names(node) - set(FUNCTIONS))


def _values(gift: Gift, known: Known) -> frozenset[Value] | None:
    """Return the values that an assignment gives, or None if they are not known."""
    assert gift.node is not None  # noqa: S101  (those without are left aside)
    variables = {name for name in _names(gift.node) if known.get(name) is not None}
    conditions = [
        c for c in gift.conditions if all(known.get(name) is not None for name in _names(c.node))
    ]
    for condition in conditions:
        if variables & _names(condition.node):
            variables |= _names(condition.node)
    listed = sorted(variables)
    sets = [known[name] or () for name in listed]
    count = 1
    for values in sets:
        count *= len(values)
    if count > MOST_PAIRS:
        return None
    useful = [c for c in conditions if _names(c.node) <= variables]
    found: set[Value] = set()
    for chosen in product(*sets):
        held = dict(zip(listed, chosen, strict=True))
        if not all(_can_be(c, held) for c in useful):
            continue
        try:
            found |= _results(gift.node, held)
        except Unknown:
            return None
    return frozenset(found)


def _results(node: Node, held: Mapping[str, Value]) -> set[Value]:
    """Return the values that an expression can have; both of a choice whose test is not known."""
    if isinstance(node, ConditionalNode):
        try:
            chosen = node.then if evaluate(node.test, held) else node.otherwise
        except Unknown:
            return _results(node.then, held) | _results(node.otherwise, held)
        return _results(chosen, held)
    value = evaluate(node, held)
    if isinstance(value, float) or (isinstance(value, str) and len(value) > MOST_LENGTH):
        raise Unknown
    return {value}


def _can_be(condition: Condition, held: Mapping[str, Value]) -> bool:
    try:
        return bool(evaluate(condition.node, held)) is condition.holds
    except Unknown:
        return True


class _Walk:
    """A walk that collects the assignments to variables."""

    def __init__(self, document: doc.Document, whole: tuple[object, ...]) -> None:
        """Look into a document, whose parts are ``whole``."""
        self._document, self._whole = document, whole
        all_states = list(states(document.root))
        has_regions = any(state.kind is doc.Kind.PARALLEL for state in all_states)
        self._changed_before: frozenset[str] | None = (
            None if has_regions else _assigned(block for s in all_states for block in s.exit)
        )
        """Variables that may change between a guard and its content; None: any."""
        self._seen: set[int] = set()

    def gifts(self) -> Iterator[Gift]:
        """Yield all gifts; those outside of known content without a condition."""
        for part in self._whole:
            match part:
                case doc.DocData(name=name, init=init):
                    has_value = init is not None and init.value.strip() not in NOTHING
                    yield Gift(name.value, parsed(init) if init is not None and has_value else None)
                case doc.DocTransition(content=content, guard=guard) if content is not None:
                    yield from self._block(content, self._of_guard(guard))
                case doc.DocState(entry=entry, exit=exits):
                    for block in (*entry, *exits):
                        yield from self._block(block, ())
                case doc.DocInvoke(id_location=location, name_list=inside):
                    listed = (*inside, *([] if location is None else [location]))
                    yield from (Gift(name.value.strip(), None) for name in listed)
                case _:
                    pass
        for part in self._whole:
            if id(part) not in self._seen:
                yield from self._statement(part, ())

    def _of_guard(self, guard: Text | None) -> tuple[Condition, ...]:
        node = None if guard is None else parsed(guard)
        if node is None or self._changed_before is None or names(node) & self._changed_before:
            return ()
        return (Condition(node, holds=True),)

    def _block(self, block: Block, conditions: tuple[Condition, ...]) -> Iterator[Gift]:
        for statement in block:
            self._seen.add(id(statement))
            yield from self._statement(statement, conditions)
            if isinstance(statement, If):
                known = conditions
                for branch in statement.branches:
                    node = None if branch.condition is None else parsed(branch.condition)
                    held = () if node is None else (Condition(node, holds=True),)
                    yield from self._block(branch.body, (*known, *held))
                    if node is not None:
                        known = (*known, Condition(node, holds=False))
            elif isinstance(statement, ForEach):
                inside = _without(conditions, _assigned([(statement,)]))
                yield from self._block(statement.body, inside)
            conditions = _without(conditions, _assigned([(statement,)]))

    def _statement(self, part: object, conditions: tuple[Condition, ...]) -> Iterator[Gift]:
        match part:
            case Assign(location, value, operator=operator):
                name = location.value.strip()
                is_plain = name.replace("_", "a").replace("$", "a").isalnum()
                if not is_plain:
                    yield from (Gift(root, None) for root in names(parsed(location)))
                else:
                    yield Gift(name, parsed(assigned(location, value, operator)), conditions)
            case ForEach(item=item, index=index):
                yield from (Gift(each.value.strip(), None) for each in (item, index) if each)
            case DocSend(id_location=Text() as location):
                yield Gift(location.value.strip(), None)
            case _:
                pass


def _assigned(blocks: Iterable[Block]) -> frozenset[str]:
    """Return the names in all places that blocks assign."""
    found: set[str] = set()
    for part in structure(tuple(blocks)):
        match part:
            case Assign(location):
                found |= names(parsed(location))
            case ForEach(item=item, index=index):
                found |= {each.value.strip() for each in (item, index) if each}
            case DocSend(id_location=Text() as location):
                found.add(location.value.strip())
            case _:
                pass
    return frozenset(found)


def _without(
    conditions: tuple[Condition, ...], assigned_names: Collection[str]
) -> tuple[Condition, ...]:
    return tuple(c for c in conditions if not names(c.node) & set(assigned_names))
