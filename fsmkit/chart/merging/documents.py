"""Three-way merge of Documents: states, transitions and declarations are merged one by one.

States are the same if they have the same id, declarations if they have the same name. Transitions
are matched by what they have in common. The parts of the result are those of ours as far as they
did not change, with their locations, so the text of ours can be changed to it.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, fields, replace
from typing import Any

from fsmkit.chart.merging.transitions import (
    MergedTransition,
    Placed,
    can_compete,
    changed_and_removed,
    merged_transitions,
    title_of,
)
from fsmkit.chart.merging.versions import Conflict, Conflicts, Versions, merged_order
from fsmkit.diagnostics import Span, Text
from fsmkit.document.document import DocState, DocTransition, Document, Kind

Key = tuple[str, ...]
"""A state: its id; without an id, the key of its parent and its number there."""
ROOT: Key = ("",)
REFINE: Key = ("", "refine")
"""The parent of the states under `refine`."""
DECLARED = {
    "types": "type", "constants": "constant", "data": "variable", "inputs": "input",
    "outputs": "output", "operations": "operation", "functions": "function", "events": "event",
    "capacities": "capacity", "entries": "entry point", "properties": "property",
}  # fmt: skip
"""The lists of declarations, and what one of each is."""
SHARED = ("types", "constants", "data", "inputs", "outputs", "operations", "functions")
"""Lists whose names must differ."""
OF_STATE = tuple(
    one.name
    for one in fields(DocState)
    if one.name not in ("id", "kind", "span", "children", "transitions", "copy", "copied")
)
OF_CHART = tuple(
    one.name
    for one in fields(Document)
    if one.name not in ("source", "root", "refine", "posted", *DECLARED)
)
WORDS = {
    "initial": "initial state", "defer": "deferred events", "req": "requirements",
    "done_data": "result", "done_content": "result", "use": "used chart", "doc": "description",
    "late_binding": "binding", "extends": "base", "invokes": "invocations",
}  # fmt: skip


@dataclass(frozen=True, slots=True)
class Merge:
    """The merged document and the conflicts; where there is one, the document has ours."""

    document: Document
    conflicts: tuple[Conflict, ...]
    removes: bool
    """Whether items of ours are gone."""


@dataclass(frozen=True, slots=True)
class _State:
    state: DocState
    parent: Key


@dataclass(frozen=True, slots=True)
class _Version:
    """A document by the keys of its states."""

    document: Document
    states: dict[Key, _State]
    children: dict[Key, tuple[Key, ...]]
    transitions: tuple[Placed, ...]


def merged(base: Document, ours: Document, theirs: Document) -> Merge | None:
    """Return the merge of two versions of a chart; None if two states share an id."""
    found = [_version(one) for one in (base, ours, theirs)]
    versions = [one for one in found if one is not None]
    if len(versions) != len(found):
        return None
    return _Merger(Versions(*versions)).merge()


def _version(document: Document) -> _Version | None:
    """Return a document by keys, or None if two of its states share an id."""
    states: dict[Key, _State] = {ROOT: _State(document.root, ROOT)}
    children: dict[Key, tuple[Key, ...]] = {}
    transitions: list[Placed] = []

    def visit(parent: Key, inside: Sequence[DocState]) -> bool:
        keys: list[Key] = []
        for number, state in enumerate(inside):
            key = (*parent, str(number)) if state.id is None else (state.id.value,)
            if key in states:
                return False
            states[key] = _State(state, parent)
            keys.append(key)
            transitions.extend(Placed(key, one) for one in state.transitions)
        children[parent] = tuple(keys)
        return all(visit(key, state.children) for key, state in zip(keys, inside, strict=True))

    if not visit(ROOT, document.root.children) or not visit(REFINE, document.refine):
        return None
    return _Version(document, states, children, tuple(transitions))


def name_of(key: Key) -> str:
    """Return a state in the words of a message."""
    if key in (ROOT, REFINE):
        return "the chart"
    return f"state `{key[0]}`" if len(key) == 1 else f"a state without an id in `{key[0]}`"


class _Merger:
    """Merges three versions of a document."""

    def __init__(self, versions: Versions[_Version]) -> None:
        self.base, self.ours, self.theirs = versions.base, versions.ours, versions.theirs
        self.conflicts = Conflicts()
        self.parents: dict[Key, Key] = {}
        self.states: dict[Key, DocState] = {}

    def merge(self) -> Merge:
        self._choose_states()
        placed: Versions[Sequence[Placed]] = Versions(
            self.base.transitions, self.ours.transitions, self.theirs.transitions
        )
        transitions = merged_transitions(placed, name_of, self.conflicts)
        self._require_states(transitions)
        by_source: dict[Key, list[MergedTransition]] = {}
        for one in transitions:
            by_source.setdefault(one.source, []).append(one)
        by_parent: dict[Key, list[Key]] = {}
        for key, parent in self.parents.items():
            by_parent.setdefault(parent, []).append(key)

        def built(key: Key, seen: frozenset[Key]) -> DocState:
            children = tuple(
                built(child, seen | {key})
                for child in self._ordered(key, by_parent.get(key, []))
                if child not in seen
            )
            return self._state(key, children, self._in_order(key, by_source.get(key, [])))

        root = built(ROOT, frozenset())
        refined = self._ordered(REFINE, by_parent.get(REFINE, []))
        refine = tuple(built(key, frozenset()) for key in refined)
        document = self._chart(root, refine)
        self._require_targets(document)
        kept = {id(one.one.span) for one in transitions}
        removes = (
            any(key not in self.states for key in self.ours.states)
            or any(id(one.one.span) not in kept for one in self.ours.transitions)
            or any(
                len(getattr(document, field)) < len(getattr(self.ours.document, field))
                for field in DECLARED
            )
        )
        return Merge(document, tuple(self.conflicts.found), removes)

    # --- states -------------------------------------------------------------------------------

    def _choose_states(self) -> None:
        """Choose the states of the result, and their parents."""
        for key in dict.fromkeys((*self.ours.states, *self.theirs.states)):
            if key == ROOT:
                self.states[key] = self.ours.states[key].state
                continue
            base, ours, theirs = (
                version.states.get(key) for version in (self.base, self.ours, self.theirs)
            )
            chosen = self._chosen(key, base, ours, theirs)
            if chosen is not None:
                self.states[key], self.parents[key] = chosen.state, chosen.parent
        for key, parent in [*self.parents.items()]:
            if parent not in self.states and parent != REFINE:
                ours, theirs = self.ours.states.get(key), self.theirs.states.get(key)
                self.conflicts.add(
                    f"{name_of(key)} is in {name_of(parent)}, which the other version removed",
                    _span(ours),
                    _span(theirs),
                    _span(self.base.states.get(parent)),
                )
                self.parents[key] = ROOT
            elif self._is_inside_itself(key):
                self.conflicts.add(
                    f"{name_of(key)} would be inside itself, since both versions move states",
                    _span(self.ours.states.get(key)),
                    _span(self.theirs.states.get(key)),
                )
                self.parents[key] = ROOT

    def _chosen(
        self, key: Key, base: _State | None, ours: _State | None, theirs: _State | None
    ) -> _State | None:
        if base is None or (ours is not None and theirs is not None):
            if ours is None or theirs is None:
                return ours or theirs
            parents = Versions(ours.parent if base is None else base.parent, ours.parent,
                               theirs.parent)  # fmt: skip
            if base is None and not self._is_same(key):
                message = f"both versions added {name_of(key)} differently"
                self.conflicts.add(message, _span(ours), _span(theirs))
                return ours
            if parents.is_conflict:
                message = f"{name_of(key)} was moved to different states"
                self.conflicts.add(message, _span(ours), _span(theirs))
            return _State(ours.state, parents.merged)
        left, version = (theirs, self.theirs) if ours is None else (ours, self.ours)
        if left is None or self._is_as_in_base(key, version):
            return None
        self.conflicts.add(
            f"{name_of(key)} was {changed_and_removed(is_ours=ours is not None)}",
            _span(ours),
            _span(theirs),
            _span(base),
        )
        return left

    def _is_same(self, key: Key) -> bool:
        """Return whether a state that both versions added is the same in them."""
        ours, theirs = self.ours.states[key], self.theirs.states[key]
        return ours.parent == theirs.parent and _without_children(ours.state) == _without_children(
            theirs.state
        )

    def _is_as_in_base(self, key: Key, version: _Version) -> bool:
        """Return whether a version changed nothing in a state, or only removed transitions."""
        before, after = self.base.states[key], version.states[key]
        one, other = _without_children(before.state), _without_children(after.state)
        return (
            before.parent == after.parent
            and replace(one, transitions=()) == replace(other, transitions=())
            and all(left in one.transitions for left in other.transitions)
        )

    def _is_inside_itself(self, key: Key) -> bool:
        seen, at = {key}, self.parents.get(key)
        while at is not None:
            if at in seen:
                return at == key
            seen.add(at)
            at = self.parents.get(at)
        return False

    def _ordered(self, parent: Key, members: list[Key]) -> list[Key]:
        base, ours, theirs = (
            version.children.get(parent, ()) for version in (self.base, self.ours, self.theirs)
        )
        order, is_conflict = merged_order(base, ours, theirs, members)
        if is_conflict:
            self.conflicts.add(
                f"the states of {name_of(parent)} were reordered differently",
                _span(self.ours.states.get(parent)),
                _span(self.theirs.states.get(parent)),
            )
        return order + [key for key in members if key not in order]

    def _state(
        self, key: Key, children: tuple[DocState, ...], transitions: tuple[Any, ...]
    ) -> DocState:
        """Return a state of the result: the object of ours if nothing changed."""
        state = self.states[key]
        changes: dict[str, Any] = {}
        kind = state.kind
        three = [v.states.get(key) for v in (self.base, self.ours, self.theirs)]
        found = [one.state for one in three if one is not None]
        if len(found) == len(three):
            versions = Versions(*found)
            for field in OF_STATE:
                value = self._value(versions, field, name_of(key))
                if value != getattr(state, field):
                    changes[field] = value
            kind = self._kind(versions, key, has_children=bool(children))
        elif key != ROOT and bool(children) != bool(state.children):
            kind = _fitted(state, has_children=bool(children))
        if kind is not state.kind:
            changes["kind"] = kind
        for field, value in (("children", children), ("transitions", transitions)):
            old = getattr(state, field)
            if len(old) != len(value) or any(a is not b for a, b in zip(old, value, strict=True)):
                changes[field] = value
        return replace(state, **changes) if changes else state

    def _kind(self, versions: Versions[DocState], key: Key, *, has_children: bool) -> Kind:
        kinds = Versions(
            *(_plain(one.kind) for one in (versions.base, versions.ours, versions.theirs))
        )
        if kinds.is_conflict:
            self.conflicts.add(
                f"the kind of {name_of(key)} was changed differently",
                versions.ours.span,
                versions.theirs.span,
            )
            return versions.ours.kind
        if kinds.merged is not Kind.ATOMIC:
            return kinds.merged
        found = [one for one in (versions.ours, versions.theirs) if _plain(one.kind) is Kind.ATOMIC]
        changed = next((one for one in found if one.kind is not versions.base.kind), found[0])
        return changed.kind if key == ROOT else _fitted(changed, has_children=has_children)

    def _value(self, versions: Versions[Any], field: str, owner: str) -> Any:
        """Return the merged value of a field; report a conflict."""
        values = Versions(
            *(getattr(one, field) for one in (versions.base, versions.ours, versions.theirs))
        )
        if not values.is_conflict:
            return values.merged
        word = WORDS.get(field, field.replace("_", " "))
        places = (
            _span_of(getattr(one, field), getattr(one, "span", None))
            for one in (versions.ours, versions.theirs)
        )
        self.conflicts.add(f"the {word} of {owner} was changed differently", *places)
        return values.ours

    # --- transitions --------------------------------------------------------------------------

    def _require_states(self, transitions: Iterable[MergedTransition]) -> None:
        """Report transitions that leave a removed state."""
        for one in transitions:
            if one.source in self.states:
                continue
            base, ours, theirs = one.numbers
            title = title_of(Placed(one.source, one.one), name_of)
            if base is None or ours is not None:
                self.conflicts.add(
                    f"{title} is new, but the other version removed the state",
                    None if ours is None else self.ours.transitions[ours].one.span,
                    None if theirs is None else self.theirs.transitions[theirs].one.span,
                )

    def _in_order(self, key: Key, found: list[MergedTransition]) -> tuple[Any, ...]:
        """Return the transitions of a state in their merged order."""
        sequences: list[list[int]] = []
        for version, transitions in enumerate(
            (self.base.transitions, self.ours.transitions, self.theirs.transitions)
        ):
            here = [
                (one.numbers[version], number)
                for number, one in enumerate(found)
                if one.numbers[version] is not None
                and transitions[one.numbers[version] or 0].source == key
            ]
            sequences.append([number for _, number in sorted(here, key=lambda each: each[0] or 0)])
        members = range(len(found))
        base, ours, theirs = sequences
        order, is_conflict = merged_order(
            base, ours, theirs, members, lambda number: found[number].one.trigger
        )
        if is_conflict or _has_other_priorities(
            [found[number].one for number in order],
            [[order.index(number) for number in one if number in order] for one in sequences],
        ):
            self.conflicts.add(
                f"the transitions of {name_of(key)} were reordered differently",
                _span(self.ours.states.get(key)),
                _span(self.theirs.states.get(key)),
            )
        order += [number for number in members if number not in order]
        return tuple(found[number].one for number in order)

    # --- the chart ----------------------------------------------------------------------------

    def _chart(self, root: DocState, refine: tuple[DocState, ...]) -> Document:
        ours = self.ours.document
        versions = Versions(self.base.document, ours, self.theirs.document)
        changes: dict[str, Any] = {}
        for field in OF_CHART:
            value = self._value(versions, field, "the chart")
            if value != getattr(ours, field):
                changes[field] = value
        for field, what in DECLARED.items():
            found = self._declarations(versions, field, what)
            if found != getattr(ours, field):
                changes[field] = found
        self._require_names(versions)
        old = ours.refine
        if len(old) != len(refine) or any(a is not b for a, b in zip(old, refine, strict=True)):
            changes["refine"] = refine
        if root is not ours.root:
            changes["root"] = root
        return replace(ours, **changes) if changes else ours

    def _declarations(self, versions: Versions[Document], field: str, what: str) -> tuple[Any, ...]:
        tables = [
            _table(getattr(one, field)) for one in (versions.base, versions.ours, versions.theirs)
        ]
        base, ours, theirs = tables
        chosen: dict[object, Any] = {}
        for name in dict.fromkeys((*ours, *theirs)):
            values: Versions[Any] = Versions(base.get(name), ours.get(name), theirs.get(name))
            if values.is_conflict:
                label = f"{what} `{(values.ours or values.theirs).name.value}`"
                if values.base is None:
                    message = f"both versions added {label} differently"
                elif values.ours is None or values.theirs is None:
                    is_ours = values.ours is not None
                    message = f"{label} was {changed_and_removed(is_ours=is_ours)}"
                else:
                    message = f"{label} was changed differently"
                places = map(_name_span, (values.ours, values.theirs, values.base))
                self.conflicts.add(message, *places)
                chosen[name] = values.ours or values.theirs
            elif values.merged is not None:
                is_ours = values.ours == values.merged
                chosen[name] = values.ours if is_ours else values.merged
        order, is_conflict = merged_order([*base], [*ours], [*theirs], chosen)
        if is_conflict:
            self.conflicts.add(f"the declarations `{field}` were reordered differently")
        return tuple(chosen[name] for name in order)

    def _require_names(self, versions: Versions[Document]) -> None:
        """Report a name that both versions add to different sections."""
        added = [_names(one) - _names(versions.base) for one in (versions.ours, versions.theirs)]
        for section, name in sorted(added[0]):
            for other, same in sorted(added[1]):
                if name == same and section != other:
                    self.conflicts.add(
                        f"`{name}` is a new {DECLARED[section]} in ours "
                        f"and a new {DECLARED[other]} in theirs",
                        _name_span(_table(getattr(versions.ours, section)).get(name)),
                        _name_span(_table(getattr(versions.theirs, other)).get(name)),
                    )

    def _require_targets(self, document: Document) -> None:
        """Report names of states that one version uses and the other one removed."""
        ids = {key[0] for key in self.states if len(key) == 1}
        gone = {
            key[0]
            for key in (*self.ours.states, *self.theirs.states)
            if len(key) == 1 and key[0] not in ids
        }
        for version in (self.ours, self.theirs):  # those that were missing before are its own error
            gone -= {
                t.value for t in _targets(version.document) if (t.value,) not in version.states
            }
        if not gone:
            return
        for target in _targets(document):
            if target.value not in gone:
                continue
            is_ours = target.span.source is self.ours.document.source
            self.conflicts.add(
                f"state `{target.value}` is a target, and the other version removed it",
                target.span if is_ours else None,
                None if is_ours else target.span,
                _span(self.base.states.get((target.value,))),
            )


def _has_other_priorities(
    transitions: Sequence[DocTransition], orders: Sequence[Sequence[int]]
) -> bool:
    """Return whether competing transitions have an order that no version with both has.

    Args:
        transitions: The merged transitions of a state.
        orders: For each version, their positions in its order, as far as it has them.

    """
    for later in range(len(transitions)):
        for earlier in range(later):
            both = [order for order in orders if earlier in order and later in order]
            is_other = both and all(order.index(earlier) > order.index(later) for order in both)
            if is_other and can_compete(transitions[earlier], transitions[later]):
                return True
    return False


def _targets(document: Document) -> Iterator[Text]:
    """Yield the names of states that a document refers to."""
    pending = [document.root, *document.refine]
    while pending:
        state = pending.pop()
        for one in (*state.transitions, *(() if state.initial is None else (state.initial,))):
            yield from one.targets
        if state.use is not None:
            for exit_point in state.use.exits:
                for one in exit_point.transitions:
                    yield from one.targets
        pending += state.children
    for entry in document.entries:
        yield from entry.targets


def _table(declarations: Sequence[Any]) -> dict[object, Any]:
    """Return declarations by their names; an event may be in two directions."""
    found: dict[object, Any] = {}
    for one in declarations:
        direction = getattr(one, "direction", None)
        key: object = one.name.value if direction is None else (direction.value, one.name.value)
        while key in found:  # a name that is declared twice is wrong, but kept
            key = (key, "again")
        found[key] = one
    return found


def _names(document: Document) -> set[tuple[str, str]]:
    return {(field, one.name.value) for field in SHARED for one in getattr(document, field)}


def _plain(kind: Kind) -> Kind:
    """Return a kind that does not depend on having children."""
    return Kind.ATOMIC if kind is Kind.COMPOUND else kind


def _fitted(state: DocState, *, has_children: bool) -> Kind:
    """Return the kind of a state that may have lost its last child or got its first."""
    if state.kind is Kind.ATOMIC and has_children:
        return Kind.COMPOUND
    if state.kind is Kind.COMPOUND and not has_children and state.children:
        return Kind.ATOMIC
    return state.kind


def _without_children(state: DocState) -> DocState:
    return replace(state, children=(), kind=_plain(state.kind))


def _span(found: _State | None) -> Span | None:
    return None if found is None else found.state.span


def _name_span(declaration: Any) -> Span | None:
    return None if declaration is None else declaration.name.span


def _span_of(value: Any, default: Span | None) -> Span | None:
    """Return where a value is written, as far as it keeps that."""
    match value:
        case Text():
            return value.span
        case (first, *_):
            return _span_of(first, default)
        case _:
            span = getattr(value, "span", None)
            return span if isinstance(span, Span) else default
