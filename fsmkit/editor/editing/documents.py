"""Operations on Documents: the meaning of each edit, whatever the notation of its file."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from typing import Any, assert_never

from fsmkit.diagnostics import Text
from fsmkit.document import document as doc
from fsmkit.document import keys
from fsmkit.document.document import HISTORIES, DocState, DocTransition, Document, Kind, Trigger
from fsmkit.document.keys import Form
from fsmkit.editor.editing import operations as op
from fsmkit.editor.editing.clipboard import read_parts
from fsmkit.editor.editing.values import (
    LISTS,
    new_text,
    read_chart,
    read_state,
    read_transition,
    rejected,
    value_tree,
)
from fsmkit.yaml.layout import Tree
from fsmkit.yaml.writing import WORD

NAME = re.compile(r"[A-Za-z_]\w*(?:\.\w+)*", re.ASCII)
PLAIN_NAME = re.compile(r"[A-Za-z_]\w*", re.ASCII)
CHILDLESS = (Kind.FINAL, Kind.CHOICE, *HISTORIES)
"""Kinds of states without children."""
ENUMERATION = re.compile(r"\[(.*)\]", re.DOTALL)
RECORD = re.compile(r"\{(.*)\}", re.DOTALL)
FIELDS = {
    "types": "types", "constants": "constants", "data": "data", "inputs": "inputs",
    "outputs": "outputs", "operations": "operations", "functions": "functions", "in": "events",
    "out": "events", "internal": "events", "capacity": "capacities", "entries": "entries",
    "properties": "properties",
}  # fmt: skip
"""The fields of a Document that hold the declarations of a section."""
_BEHAVIOUR = ("data", "defer", "entry", "exit", "rest", "invariant", "abstract")
UNFIT = {
    Kind.FINAL: ("data", "defer", "rest", "abstract"),
    Kind.CHOICE: _BEHAVIOUR,
    Kind.SHALLOW_HISTORY: _BEHAVIOUR,
    Kind.DEEP_HISTORY: _BEHAVIOUR,
}
"""Keys that have no meaning in states of a kind."""
INSIDE = ("transitions", "entry", "exit", "data", "defer", "invokes", "invariant", "done_data")
"""Fields of a state that are lost if its children replace it."""


def transformed(document: Document, operation: op.Operation) -> Document:
    """Return the document after an operation.

    Raises:
        FsmkitError: ``edit-rejected``, or findings of the reader, if it cannot be applied.

    """
    match operation:
        case op.AddState(parent, name, kind, before):
            return _add_state(document, parent, name, kind, before)
        case op.Paste(parent, text):
            return _paste(document, parent, text)
        case op.RemoveState(name):
            return _remove_state(document, name)
        case op.MoveState(name, parent, before):
            return _move_state(document, name, parent, before)
        case op.SetInitial(name, targets):
            return _set_initial(document, name, targets)
        case op.SetKind(name, kind):
            return _set_kind(document, name, kind)
        case op.AddTransition():
            return _add_transition(document, operation)
        case op.RemoveTransition(name, number):
            transition_of(document, name, number)
            return _update(document, name, lambda s: _with_transition(s, number))
        case op.SetSource(name, index, new):
            return _set_source(document, name, index, new)
        case op.SetTarget(name, index, targets):
            old = transition_of(document, name, index)
            given = _targets(document, targets)
            return _change(document, name, index, replace(old, targets=given))
        case op.SetTrigger(name, index, trigger, label):
            return _set_trigger(document, name, index, trigger, label)
        case op.SetDelay(name, index, delay):
            old = transition_of(document, name, index)
            if old.trigger not in (Trigger.AFTER, Trigger.EVERY):
                raise rejected("the transition has no delay", help="set its trigger instead")
            return _set_trigger(document, name, index, old.trigger, delay)
        case op.SetGuard(name, index, guard):
            return _set_key(document, name, "if", (guard,) if guard else (), index)
        case op.SetContent(name, index, content):
            return _set_key(document, name, "do", (content,) if content else (), index)
        case op.MoveTransition(name, index, to):
            return _move_transition(document, name, index, to)
        case op.SetHandler(name, key, handlers):
            if key not in ("entry", "exit"):
                raise rejected(f"a state has no handler `{key}`", help="use `entry` or `exit`")
            return _set_key(document, name, key, handlers, None)
        case op.SetKey(name, key, value, index):
            return _set_key(document, name, key, value, index)
        case op.Declare(section, name, value):
            return _declare(document, section, name, value)
        case op.RemoveDeclaration(section, name):
            return _remove_declaration(document, section, name)
        case op.OverrideState(name):
            return _override(document, name)
        case op.WrapInState(names, name):
            return _wrap(document, names, name)
        case op.UnwrapState(name):
            return _unwrap(document, name)
        case op.RenameSymbol():
            raise TypeError("a name is renamed in its text, by `editing.renaming`")
        case _:
            assert_never(operation)


# --- finding --------------------------------------------------------------------------------------


def all_states(document: Document) -> Iterator[DocState]:
    """Yield all states in the order of the document, those under `refine` last."""
    pending = [*reversed((*document.root.children, *document.refine))]
    while pending:
        state = pending.pop()
        yield state
        pending += reversed(state.children)


def state_of(document: Document, name: str) -> DocState:
    """Return a state by its id; `FsmkitError` if this file has none or several."""
    if name == op.CHART:
        return document.root
    found = [s for s in all_states(document) if s.id is not None and s.id.value == name]
    if len(found) == 1:
        return found[0]
    if found:
        raise rejected(f"there are {len(found)} states `{name}`", help="rename one of them")
    advice = "name a state of this file"
    if document.extends is not None:
        advice += "; override an inherited state first"
    raise rejected(f"this file has no state `{name}`", help=advice)


def transition_of(document: Document, name: str, index: int) -> DocTransition:
    """Return a transition by its source and index; `FsmkitError` if it does not exist."""
    state = state_of(document, name)
    if name == op.CHART or not 0 <= index < len(state.transitions):
        raise rejected(
            f"state `{name}` has no transition {index}", help="read the chart again and select it"
        )
    return state.transitions[index]


def parent_of(document: Document, state: DocState) -> DocState | None:
    """Return the parent of a state in this file, or None for a state under `refine`."""
    for parent in (document.root, *all_states(document)):
        if any(child is state for child in parent.children):
            return parent
    return None


def descendants(state: DocState) -> Iterator[DocState]:
    """Yield a state and all states inside it."""
    yield state
    for child in state.children:
        yield from descendants(child)


def _ids(states: Iterable[DocState]) -> frozenset[str]:
    return frozenset(s.id.value for s in states if s.id is not None)


# --- changing -------------------------------------------------------------------------------------


def _with_states(document: Document, change: Callable[[DocState], DocState]) -> Document:
    """Change every state, from the inside out; unchanged states stay the same objects."""

    def rebuilt(state: DocState) -> DocState:
        children = tuple(rebuilt(child) for child in state.children)
        if any(new is not old for new, old in zip(children, state.children, strict=True)):
            state = replace(state, children=children)
        return change(state)

    root = rebuilt(document.root)
    refine = tuple(rebuilt(state) for state in document.refine)
    if root is document.root and all(
        new is old for new, old in zip(refine, document.refine, strict=True)
    ):
        return document
    return replace(document, root=root, refine=refine)


def _update(document: Document, name: str, change: Callable[[DocState], DocState]) -> Document:
    """Change one state; the empty name is the outermost one."""
    wanted = state_of(document, name).span
    return _with_states(document, lambda state: change(state) if state.span is wanted else state)


def _change(document: Document, name: str, index: int, new: DocTransition) -> Document:
    return _update(document, name, lambda s: _with_transition(s, index, new))


def _with_transition(state: DocState, index: int, new: DocTransition | None = None) -> DocState:
    """Return a state with another transition at an index, or without it."""
    before, after = state.transitions[:index], state.transitions[index + 1 :]
    middle = () if new is None else (new,)
    return replace(state, transitions=(*before, *middle, *after))


def _require_name(name: str) -> None:
    if NAME.fullmatch(name) is None or name.endswith(".main"):
        raise rejected(
            f"`{name}` is not a name of a state",
            help="use letters, digits, `_` and dots, with a letter first",
        )


def _require_new(document: Document, name: str) -> None:
    _require_name(name)
    if name in _ids(all_states(document)):
        raise rejected(f"there is a state `{name}` already", help="use another name")


def _require_parent(document: Document, name: str) -> DocState:
    parent = state_of(document, name)
    if parent.kind in CHILDLESS or parent.use is not None:
        what = "uses a chart" if parent.use is not None else f"is a {parent.kind.value} state"
        raise rejected(f"state `{name}` {what} and has no children", help="choose another parent")
    if parent.id is None and parent is not document.root:
        raise rejected("the parent has no id", help="give it an id first")
    return parent


def _grown(parent: DocState, child: DocState, before: str | None) -> DocState:
    """Return a state with one more child."""
    ids = [None if s.id is None else s.id.value for s in parent.children]
    if before is not None and before not in ids:
        raise rejected(f"the parent has no child `{before}`", help="name one of its children")
    at = len(ids) if before is None else ids.index(before)
    children = (*parent.children[:at], child, *parent.children[at:])
    kind = Kind.COMPOUND if parent.kind is Kind.ATOMIC else parent.kind
    return replace(parent, children=children, kind=kind)


def _shrunk(parent: DocState, child: DocState, root: DocState) -> DocState:
    """Return a state without one of its children."""
    children = tuple(s for s in parent.children if s.span is not child.span)
    is_empty = not children and parent.kind is Kind.COMPOUND and parent.span is not root.span
    return replace(
        parent,
        children=children,
        kind=Kind.ATOMIC if is_empty else parent.kind,
        initial=None if not children and not is_history(parent) else parent.initial,
    )


def is_history(state: DocState) -> bool:
    """Return whether a state is a history pseudo-state."""
    return state.kind in HISTORIES


def _add_state(
    document: Document, parent: str, name: str, kind: Kind, before: str | None
) -> Document:
    _require_parent(document, parent)
    _require_new(document, name)
    text = new_text(name)
    child = DocState(text, kind, text.span)
    return _update(document, parent, lambda s: _grown(s, child, before))


def _paste(document: Document, parent: str, text: str) -> Document:
    states, transitions = read_parts(document, text, _ids(all_states(document)))
    if states:
        _require_parent(document, parent)
        for name in _ids(one for state in states for one in descendants(state)):
            _require_name(name)
    for one in transitions:
        _require_source(state_of(document, parent), one.trigger)

    def grown(state: DocState) -> DocState:
        for child in states:
            state = _grown(state, child, None)
        for one in transitions:
            state = replace(state, transitions=_placed(state.transitions, one))
        return state

    return _update(document, parent, grown)


def _remove_state(document: Document, name: str) -> Document:
    state = state_of(document, name)
    if name == op.CHART:
        raise rejected("a chart cannot be removed from itself", help="select a state")
    gone = _ids(descendants(state))
    parent = parent_of(document, state)
    if parent is None:  # a refinement: the inherited state remains
        return replace(
            document, refine=tuple(s for s in document.refine if s.span is not state.span)
        )
    document = _with_states(
        document,
        lambda s: _shrunk(s, state, document.root) if s.span is parent.span else s,
    )
    document = _with_states(document, lambda s: _without_targets(s, gone))
    entries = (
        replace(e, targets=left) if len(left) != len(e.targets) else e
        for e in document.entries
        if (left := _left(e.targets, gone)) or not e.targets
    )
    return replace(document, entries=tuple(entries))


def _left(targets: tuple[Text, ...], gone: frozenset[str]) -> tuple[Text, ...]:
    return tuple(target for target in targets if target.value not in gone)


def _without_targets(state: DocState, gone: frozenset[str]) -> DocState:
    """Return a state without references to removed states."""
    transitions = tuple(_retargeted(state.transitions, gone))
    if len(transitions) != len(state.transitions) or any(
        new is not old for new, old in zip(transitions, state.transitions, strict=True)
    ):
        state = replace(state, transitions=transitions)
    initial = state.initial
    if initial is not None and any(target.value in gone for target in initial.targets):
        left = _left(initial.targets, gone)
        state = replace(state, initial=replace(initial, targets=left) if left else None)
    if state.use is not None and any(
        target.value in gone for e in state.use.exits for t in e.transitions for target in t.targets
    ):
        exits = tuple(
            replace(e, transitions=kept)
            for e in state.use.exits
            if (kept := tuple(_retargeted(e.transitions, gone)))
        )
        state = replace(state, use=replace(state.use, exits=exits))
    return state


def _retargeted(
    transitions: tuple[DocTransition, ...], gone: frozenset[str]
) -> Iterator[DocTransition]:
    for one in transitions:
        left = _left(one.targets, gone)
        if len(left) == len(one.targets):
            yield one
        elif left:
            yield replace(one, targets=left)


def _move_state(document: Document, name: str, parent: str, before: str | None) -> Document:
    state = state_of(document, name)
    new = _require_parent(document, parent)
    old = parent_of(document, state)
    if name == op.CHART or old is None:
        raise rejected(
            f"state `{name}` is inherited and keeps its parent", help="move it in the base"
        )
    if any(inner is new for inner in descendants(state)):
        raise rejected("a state cannot be moved into itself", help="choose another parent")
    if before == name:
        raise rejected("a state cannot be moved before itself", help="name another sibling")
    gone = _ids(descendants(state))
    if old.span is not new.span:
        document = _with_states(
            document,
            lambda s: _shrunk(s, state, document.root) if s.span is old.span else s,
        )
        document = _with_states(document, lambda s: _without_initial(s, new, gone))
    else:
        rest = tuple(s for s in old.children if s is not state)
        document = _update(document, parent, lambda s: replace(s, children=rest))
    return _update(document, parent, lambda s: _grown(s, state, before))


def _without_initial(state: DocState, new: DocState, gone: frozenset[str]) -> DocState:
    """Return a state without an initial target that leaves it, unless it contains ``new``."""
    initial = state.initial
    if initial is None or is_history(state) or any(s.span is new.span for s in descendants(state)):
        return state
    left = _left(initial.targets, gone)
    if len(left) == len(initial.targets):
        return state
    return replace(state, initial=replace(initial, targets=left) if left else None)


def _targets(document: Document, names: Iterable[str]) -> tuple[Text, ...]:
    """Return targets; states of this file must exist unless the chart has a base."""
    given = tuple(names)
    known = _ids(all_states(document))
    for name in given:
        if WORD.fullmatch(name) is None:
            raise rejected(f"`{name}` is not a name of a state", help="name a state")
        is_local = document.extends is None and "." not in name
        if is_local and name not in known:
            raise rejected(f"there is no state `{name}`", help="add the state first")
    if len(set(given)) != len(given):
        raise rejected("a target is named twice", help="name each target once")
    return tuple(new_text(name) for name in given)


def _set_initial(document: Document, name: str, targets: tuple[str, ...]) -> Document:
    state = state_of(document, name)
    is_composite = state.kind is Kind.COMPOUND or state.use is not None or is_history(state)
    is_refined = any(s is state for s in document.refine)
    if not is_composite and not is_refined:
        raise rejected(
            f"state `{name}` is {state.kind.value} and has no initial state",
            help="select a composite state or a history",
        )
    given = _targets(document, targets)
    if not is_history(state) and document.extends is None and state.use is None:
        inside = _ids(descendants(state)) - _ids((state,))
        for target in given:
            if target.value not in inside:
                raise rejected(
                    f"`{target.value}` is not inside of `{name or document.name.value}`",
                    help="name a state inside of it",
                )
    if not given:
        return _update(document, name, lambda s: replace(s, initial=None))
    old = state.initial
    changed = (
        DocTransition(Trigger.INITIAL, given[0].span, targets=given)
        if old is None
        else replace(old, targets=given)
    )
    return _update(document, name, lambda s: replace(s, initial=changed))


def _set_kind(document: Document, name: str, kind: Kind) -> Document:
    state = state_of(document, name)
    if name == op.CHART:
        raise rejected("the kind of a chart cannot change", help="select a state")
    reasons = {
        "children": bool(state.children) and kind in (Kind.ATOMIC, *CHILDLESS),
        "a used chart": state.use is not None and kind is not Kind.ATOMIC,
        "transitions": bool(state.transitions) and kind in (Kind.FINAL, *HISTORIES),
        "transitions with triggers": kind is Kind.CHOICE
        and any(t.trigger is not Trigger.EVENTLESS for t in state.transitions),
        "handlers": bool(state.entry or state.exit) and kind in (Kind.CHOICE, *HISTORIES),
        "data": bool(state.data) and kind in CHILDLESS,
        "invoked charts": bool(state.invokes) and kind in CHILDLESS,
        "a payload": bool(state.done_data or state.done_content) and kind is not Kind.FINAL,
        "an invariant": state.invariant is not None and kind in (Kind.CHOICE, *HISTORIES),
        "marks": (state.rest or state.abstract) and kind in CHILDLESS,
        "deferred events": bool(state.defer) and kind in CHILDLESS,
    }
    for what, is_lost in reasons.items():
        if is_lost:
            raise rejected(
                f"state `{name}` has {what}, which a {kind.value} state cannot have",
                help="remove them first",
            )
    initial = state.initial
    keeps = kind is Kind.COMPOUND and state.kind is Kind.COMPOUND
    keeps = keeps or (kind in HISTORIES and is_history(state)) or state.use is not None
    return _update(
        document, name, lambda s: replace(s, kind=kind, initial=initial if keeps else None)
    )


# --- transitions ----------------------------------------------------------------------------------


def _require_source(state: DocState, trigger: Trigger) -> None:
    name = "" if state.id is None else state.id.value
    if state.id is None or state.kind in (Kind.FINAL, *HISTORIES):
        what = "the chart" if state.id is None else f"the {state.kind.value} state `{name}`"
        raise rejected(f"{what} has no transitions", help="choose another source")
    if state.kind is Kind.CHOICE and trigger is not Trigger.EVENTLESS:
        raise rejected(
            f"the choice `{name}` is left without an event", help="remove the event or the delay"
        )


def _placed(
    transitions: tuple[DocTransition, ...], new: DocTransition
) -> tuple[DocTransition, ...]:
    """Return transitions with one more, after the last one with the same label or trigger."""
    at = len(transitions)
    for number, one in enumerate(transitions, 1):
        if one.trigger is new.trigger:
            at = number
    same = [
        number
        for number, one in enumerate(transitions, 1)
        if (one.trigger, one.events, one.delay) == (new.trigger, new.events, new.delay)
    ]
    at = same[-1] if same else at
    return (*transitions[:at], new, *transitions[at:])


def _add_transition(document: Document, operation: op.AddTransition) -> Document:
    state = state_of(document, operation.source)
    _require_source(state, operation.trigger)
    parts: dict[str, Tree] = {}
    if operation.guard:
        parts["if"] = operation.guard
    if operation.content:
        parts["do"] = operation.content
    new = read_transition(document, operation.trigger, operation.label, parts)
    new = replace(new, targets=_targets(document, operation.targets))
    return _update(
        document, operation.source, lambda s: replace(s, transitions=_placed(s.transitions, new))
    )


def _set_source(document: Document, name: str, index: int, new: str) -> Document:
    one = transition_of(document, name, index)
    target = state_of(document, new)
    _require_source(target, one.trigger)
    if target is state_of(document, name):
        return document
    document = _update(document, name, lambda s: _with_transition(s, index))
    return _update(document, new, lambda s: replace(s, transitions=_placed(s.transitions, one)))


def _set_trigger(
    document: Document, name: str, index: int, trigger: Trigger, label: str
) -> Document:
    old = transition_of(document, name, index)
    _require_source(state_of(document, name), trigger)
    read = read_transition(document, trigger, label, {})
    new = replace(old, trigger=trigger, events=read.events, delay=read.delay)
    if (new.trigger, new.events, new.delay) == (old.trigger, old.events, old.delay):
        return document
    if new.trigger is old.trigger:
        return _change(document, name, index, new)
    return _update(
        document,
        name,
        lambda s: replace(s, transitions=_placed(_with_transition(s, index).transitions, new)),
    )


def _move_transition(document: Document, name: str, index: int, to: int) -> Document:
    one = transition_of(document, name, index)
    if not 0 <= to < len(state_of(document, name).transitions):
        raise rejected(f"state `{name}` has no transition {to}", help="choose another index")

    def moved(state: DocState) -> DocState:
        rest = _with_transition(state, index).transitions
        return replace(state, transitions=(*rest[:to], one, *rest[to:]))

    return document if to == index else _update(document, name, moved)


# --- keys -----------------------------------------------------------------------------------------


def _set_key(
    document: Document, name: str, key: str, value: tuple[str, ...], index: int | None
) -> Document:
    rows = keys.TRANSITION if index is not None else keys.STATE if name else keys.CHART
    if not name and index is None and key == "chart":
        if len(value) != 1 or PLAIN_NAME.fullmatch(value[0]) is None:
            raise rejected("a chart needs a name", help="use letters, digits and `_`")
        return replace(document, name=new_text(value[0]))
    row = rows.get(key)
    if row is None or row.form is Form.OWN or key == "target":
        raise rejected(f"`{key}` cannot be set by its text", help="use the operation for it")
    if name and index is None:
        _require_fit(state_of(document, name), key)
    if row.form is Form.HANDLERS:
        value = tuple(one for one in value if one.strip())
    is_text = row.form not in (*LISTS, Form.ARGUMENTS, Form.DATA)
    if is_text and len(value) > 1:
        raise rejected(f"`{key}` is one text", help="join the lines")
    if index is not None:
        old = transition_of(document, name, index)
        if key == "if" and old.trigger is Trigger.INITIAL:
            raise rejected("an initial transition has no guard", help="use a choice")
    part = old if index is not None else state_of(document, name) if name else document
    found: Any = keys.defaults(type(part))[row.field]  # type: ignore[arg-type]
    if value and not (is_text and not value[0].strip()):
        parts: dict[str, Tree] = {key: value_tree(row, value)}
        read: Any
        if index is not None:
            read = read_transition(document, old.trigger, _label(old), parts)
        else:
            read = read_state(document, parts) if name else read_chart(document, parts)
        found = getattr(read, row.field)
    if found == getattr(part, row.field):
        return document
    changed: dict[str, Any] = {row.field: found}
    if index is not None:
        return _change(document, name, index, replace(old, **changed))
    if name:
        return _update(document, name, lambda s: replace(s, **changed))
    return replace(document, **changed)


def _require_fit(state: DocState, key: str) -> None:
    """Reject a key that has no meaning in a state of this kind."""
    if state.kind in UNFIT and key in UNFIT[state.kind]:
        raise rejected(
            f"a {state.kind.value} state has no `{key}`", help="set it at the state around it"
        )


def _label(one: DocTransition) -> str:
    if one.trigger is Trigger.EVENT:
        return " ".join(event.value for event in one.events)
    return "" if one.delay is None else one.delay.value


# --- declarations ---------------------------------------------------------------------------------


def _section(section: str) -> str:
    if section not in FIELDS:
        raise rejected(f"a chart has no section `{section}`", help=f"use {', '.join(op.SECTIONS)}")
    return FIELDS[section]


def _declare(document: Document, section: str, name: str, value: str) -> Document:
    field = _section(section)
    tree: dict[str, Tree] = {}
    match section:
        case "in" | "out" | "internal":
            tree = {"events": {section: [name]}}
        case "operations":
            tree = {section: [name]}
        case "types":
            tree = {section: {name: _type(value)}}
        case "entries":
            tree = {section: {name: [target.strip() for target in value.split(",")]}}
        case "properties":
            kind, _, condition = value.partition(":")
            condition = condition.strip()
            tree = {section: {name: {kind.strip(): condition} if condition else kind.strip()}}
        case _:
            tree = {section: {name: value}}
    read = getattr(read_chart(document, tree), field)
    if len(read) != 1:
        raise rejected(f"`{name}` is not a declaration of `{section}`", help="check its value")
    if not read[0].name.value.strip():
        raise rejected("a declaration needs a name", help="write the name first")
    new = read[0]
    given = getattr(document, field)
    same = [n for n, old in enumerate(given) if _is_same(old, new)]
    if same:
        if len(same) > 1:
            raise rejected(f"`{name}` is declared twice", help="remove one of them")
        if getattr(new, "req", None) == ():
            new = replace(new, req=given[same[0]].req)
        items = tuple(new if n == same[0] else old for n, old in enumerate(given))
    else:
        taken = _names(document) - ({new.name.value} if field in _OWN_NAMES else frozenset())
        if new.name.value in taken:
            raise rejected(f"`{new.name.value}` is declared already", help="use another name")
        at = len(given)
        if field == "events":
            at = max(
                (n for n, old in enumerate(given, 1) if old.direction is new.direction), default=at
            )
        items = (*given[:at], new, *given[at:])
    if items == given:
        return document
    changed: dict[str, Any] = {field: items}
    return replace(document, **changed)


_OWN_NAMES = ("events", "capacities", "entries", "properties")
"""Sections whose names are in a space of their own."""


def _names(document: Document) -> frozenset[str]:
    fields = [field for field in FIELDS.values() if field not in _OWN_NAMES]
    return frozenset(one.name.value for field in fields for one in getattr(document, field))


def _is_same(old: Any, new: Any) -> bool:
    is_same = old.name.value == new.name.value
    return is_same and getattr(old, "direction", None) is getattr(new, "direction", None)


def _type(value: str) -> Tree:
    if (listed := ENUMERATION.fullmatch(value.strip())) is not None:
        return [member.strip() for member in listed[1].split(",") if member.strip()]
    if (record := RECORD.fullmatch(value.strip())) is not None:
        pairs = (item.partition(":") for item in record[1].split(",") if item.strip())
        return {name.strip(): type_.strip() for name, _, type_ in pairs}
    return value


def _remove_declaration(document: Document, section: str, name: str) -> Document:
    field = _section(section)
    given = getattr(document, field)
    direction = doc.Direction(section) if field == "events" else None
    left = tuple(
        one
        for one in given
        if one.name.value != name or getattr(one, "direction", None) is not direction
    )
    if len(left) == len(given):
        raise rejected(f"`{section}` has no `{name}`", help="name a declaration of this file")
    changed: dict[str, Any] = {field: left}
    return replace(document, **changed)


# --- larger operations ----------------------------------------------------------------------------


def _override(document: Document, name: str) -> Document:
    if document.extends is None:
        raise rejected("the chart has no base", help="edit the state itself")
    _require_new(document, name)
    text = new_text(name)
    new = DocState(text, Kind.ATOMIC, text.span)
    return replace(document, refine=(*document.refine, new))


def _wrap(document: Document, names: tuple[str, ...], name: str) -> Document:
    _require_new(document, name)
    states = [state_of(document, one) for one in names]
    if not states or op.CHART in names or len(set(names)) != len(names):
        raise rejected("no states are named", help="select one state or several siblings")
    parents = {id(parent_of(document, state)) for state in states}
    parent = parent_of(document, states[0])
    if len(parents) != 1 or parent is None:
        raise rejected("the states have different parents", help="select siblings")
    chosen = [child for child in parent.children if any(child is s for s in states)]
    text = new_text(name)
    new = DocState(text, Kind.COMPOUND, text.span, children=tuple(chosen))
    children = tuple(
        new if child is chosen[0] else child
        for child in parent.children
        if child is chosen[0] or not any(child is s for s in chosen)
    )
    return _with_states(
        document, lambda s: replace(s, children=children) if s.span is parent.span else s
    )


def _unwrap(document: Document, name: str) -> Document:
    state = state_of(document, name)
    parent = None if name == op.CHART else parent_of(document, state)
    if parent is None or state.kind is not Kind.COMPOUND or not state.children:
        raise rejected(f"`{name}` is not a composite state", help="select one with children")
    lost = [key for key in INSIDE if getattr(state, key)]
    if lost or (state.initial is not None and state.initial.content):
        lost = lost or ["initial"]
        raise rejected(
            f"state `{name}` has {', '.join(lost)}, which its children do not share",
            help="move or remove these first",
        )
    first = state.children[0].id
    if state.initial is None and first is None:
        raise rejected("its first child has no id", help="give it an id first")
    entered = state.initial.targets if state.initial is not None else (first,)
    targets = tuple(target for target in entered if target is not None)

    def retarget(given: tuple[Text, ...]) -> tuple[Text, ...]:
        if all(target.value != name for target in given):
            return given
        found = [t for target in given for t in (targets if target.value == name else (target,))]
        return tuple({t.value: t for t in found}.values())

    def changed(one: DocTransition) -> DocTransition:
        left = retarget(one.targets)
        return one if left is one.targets else replace(one, targets=left)

    def rebuilt(s: DocState) -> DocState:
        if s.span is parent.span:
            s = replace(
                s,
                children=tuple(
                    inner
                    for child in s.children
                    for inner in (child.children if child.span is state.span else (child,))
                ),
            )
        transitions = tuple(changed(one) for one in s.transitions)
        if any(new is not old for new, old in zip(transitions, s.transitions, strict=True)):
            s = replace(s, transitions=transitions)
        if s.initial is not None and (entered := changed(s.initial)) is not s.initial:
            s = replace(s, initial=entered)
        return s

    if any(target.value == name for entry in document.entries for target in entry.targets):
        entries = tuple(replace(e, targets=retarget(e.targets)) for e in document.entries)
        document = replace(document, entries=entries)
    return _with_states(document, rebuilt)
