"""A machine of XState 5: its state nodes, transitions and targets, as the library resolves them."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field

from fsmkit.diagnostics import Findings, Source, Span, Text
from fsmkit.diagnostics.suggestions import suggest
from fsmkit.foreign.imports import reject
from fsmkit.foreign.xstate.values import (
    Array,
    Call,
    Code,
    Constant,
    Number,
    Record,
    String,
    Value,
    is_absent,
    items,
)

DEEPEST = 60
"""Levels of states; charts have at most 100, and rewritings add some."""
STATE_KEYS = frozenset(
    {"id", "initial", "type", "states", "on", "entry", "exit", "always", "after", "onDone"}
    | {"invoke", "history", "target", "output", "description", "meta", "tags", "key", "order"}
)
ROOT_KEYS = STATE_KEYS | {"context", "types", "version", "schemas", "options"}
STEP_KEYS = frozenset({"target", "guard", "actions", "reenter", "description", "meta"})
OLD = {
    "cond": "write `guard`",
    "internal": "write `reenter: true` where the state is to be left",
    "in": "write `guard: stateIn('#id')`",
    "activities": "write `invoke`",
    "delay": "write the delay as the key of `after`",
}
"""Keys of XState 4 that version 5 ignores."""
LOST = frozenset({"meta", "tags", "version", "schemas", "options", "key", "order"})
TYPES = frozenset({"atomic", "compound", "parallel", "final", "history"})


@dataclass(frozen=True, slots=True)
class Step:
    """A transition. ``targets`` are indices of states; None if there is no target."""

    source: int
    span: Span
    targets: tuple[int, ...] | None
    guard: Value | None
    actions: tuple[Value, ...]
    reenter: bool


@dataclass(frozen=True, slots=True)
class Invocation:
    """An actor that runs while its state is active."""

    id: str
    src: Value | None
    input: Value | None
    span: Span


@dataclass(slots=True)
class State:
    """A state node. ``on`` lists descriptors with their transitions, in the library's order."""

    index: int
    key: str
    path: tuple[str, ...]
    span: Span
    kind: str
    parent: int | None
    config: Record
    id: str = ""
    children: list[int] = field(default_factory=list)
    by_key: dict[str, int] = field(default_factory=dict)
    """The children by their keys."""
    initial: int | None = None
    initial_actions: tuple[Value, ...] = ()
    entry: tuple[Value, ...] = ()
    exit: tuple[Value, ...] = ()
    on: list[tuple[Text, tuple[Step, ...]]] = field(default_factory=list)
    always: tuple[Step, ...] = ()
    after: list[tuple[Text, tuple[Step, ...]]] = field(default_factory=list)
    on_done: tuple[Step, ...] = ()
    invocations: list[Invocation] = field(default_factory=list)
    answers: list[tuple[str, str, tuple[Step, ...]]] = field(default_factory=list)
    """Invocation, ``done`` or ``error``, and the transitions of that event."""
    is_deep: bool = False
    history_targets: tuple[int, ...] = ()
    doc: str = ""


@dataclass(slots=True)
class Machine:
    """A machine: its states in document order; the first is the root."""

    source: Source
    name: Text
    states: list[State]
    context: Value | None
    implementations: dict[str, Record]
    """``actions``, ``guards``, ``delays`` and ``actors``."""
    declared: dict[str, dict[str, str]]
    """The events that types declare, with the types of their fields."""
    lost: list[tuple[str, Span]]

    def ancestors(self, index: int) -> Iterator[int]:
        """Yield the proper ancestors of a state, nearest first."""
        parent = self.states[index].parent
        while parent is not None:
            yield parent
            parent = self.states[parent].parent

    def is_below(self, index: int, ancestor: int) -> bool:
        """Return whether a state is a proper descendant of another."""
        return ancestor in self.ancestors(index)

    def common_ancestor(self, first: int, *others: int) -> int | None:
        """Return the least proper ancestor of all, of any kind; None above the root."""
        for ancestor in self.ancestors(first):
            if all(self.is_below(other, ancestor) for other in others):
                return ancestor
        return None

    def steps(self) -> Iterator[Step]:
        """Yield all transitions."""
        for state in self.states:
            for _, steps in (*state.on, *state.after):
                yield from steps
            yield from state.always
            yield from state.on_done
            for _, _, steps in state.answers:
                yield from steps


def read_machine(
    source: Source,
    name: Text,
    config: Value,
    implementations: tuple[Value, ...],
    declared: dict[str, dict[str, str]],
    findings: Findings,
) -> Machine | None:
    """Return the machine of a configuration, or None after reporting errors."""
    return _Reader(source, findings).machine(name, config, implementations, declared)


class _Reader:
    def __init__(self, source: Source, findings: Findings) -> None:
        self._source = source
        self._findings = findings
        self._states: list[State] = []
        self._ids: dict[str, int] = {}
        self._lost: list[tuple[str, Span]] = []

    def machine(
        self,
        name: Text,
        config: Value,
        implementations: tuple[Value, ...],
        declared: dict[str, dict[str, str]],
    ) -> Machine | None:
        if not isinstance(config, Record):
            self._reject("the configuration is not an object literal", config.span,
                         "pass an object literal, or a `const` with one in this file")  # fmt: skip
            return None
        self._state(config, None, "", 0)
        if not self._findings.has_errors:
            for state in self._states:
                self._complete(state)
        if self._findings.has_errors:
            return None
        root = self._states[0].config
        parts: dict[str, Record] = {}
        for given in implementations:
            for key, value in given.fields if isinstance(given, Record) else ():
                if isinstance(value, Record):
                    old = parts[key.value].fields if key.value in parts else ()
                    parts[key.value] = Record((*old, *value.fields), value.span)
        return Machine(
            self._source,
            name,
            self._states,
            root.get("context"),
            parts,
            declared,
            self._lost,
        )

    def _reject(self, message: str, at: Span | Text, advice: str | None) -> None:
        reject(self._findings, message, at, advice or "")

    # --- states -----------------------------------------------------------------------------

    def _state(self, config: Record, parent: State | None, key: str, depth: int) -> None:
        if depth > DEEPEST:
            self._reject(f"states are nested more than {DEEPEST} levels", config.span,
                         "divide the machine")  # fmt: skip
            return
        path = () if parent is None else (*parent.path, key)
        index = len(self._states)
        children = config.get("states")
        if children is not None and not isinstance(children, Record):
            self._reject("`states` is not an object literal", children.span,
                         "list the states as keys of an object")  # fmt: skip
            children = None
        state = State(index, key, path, config.span, self._kind(config, children),
                      None if parent is None else parent.index, config)  # fmt: skip
        self._states.append(state)
        given = self._text(config, "id")
        root_id = self._states[0].id
        state.id = given or ".".join([root_id or "(machine)", *path])
        if state.id in self._ids:
            self._reject(f"the id `{state.id}` is used by two states", config.span,
                         "give each state its own id")  # fmt: skip
        self._ids[state.id] = index
        self._check_keys(config, ROOT_KEYS if parent is None else STATE_KEYS, "a state")
        state.doc = self._text(config, "description") or ""
        for child, value in () if children is None else children.fields:
            if not isinstance(value, Record):
                self._reject(f"the state `{child}` is not an object literal", value.span,
                             "write the state as an object")  # fmt: skip
                continue
            state.by_key[child.value] = len(self._states)
            state.children.append(len(self._states))
            self._state(value, state, child.value, depth + 1)

    def _kind(self, config: Record, children: Record | None) -> str:
        kind = self._text(config, "type")
        if kind is not None:
            if kind not in TYPES:
                at = config.get("type")
                self._reject(f"`{kind}` is not a type", config.span if at is None else at.span,
                             suggest(kind, TYPES, "see the types of XState 5"))  # fmt: skip
            return kind
        if children is not None and children.fields:
            return "compound"
        return "history" if not _is_false(config.get("history")) else "atomic"

    def _check_keys(self, config: Record, known: frozenset[str], what: str) -> None:
        for key, _ in config.fields:
            if key.value in OLD and key.value not in known:
                self._reject(f"`{key}` of {what} is ignored by XState 5", key, OLD[key.value])
            elif key.value not in known or key.value in LOST:
                self._lost.append((f"`{key}` of {what}", key.span))

    def _complete(self, state: State) -> None:
        config = state.config
        state.entry = tuple(items(config.get("entry")))
        state.exit = tuple(items(config.get("exit")))
        if state.kind == "history":
            self._complete_history(state)
            return
        if state.kind in ("compound", "parallel"):
            self._complete_initial(state)
        on = config.get("on")
        if on is not None and not isinstance(on, Record):
            self._reject("`on` is not an object literal", on.span, "list the events as keys")
        for key, value in on.fields if isinstance(on, Record) else ():
            if not key.value:
                self._reject("the event has no name", key, "write `always` instead")
            state.on.append((key, self._steps(state, value)))
        after = config.get("after")
        if after is not None and not isinstance(after, Record):
            self._reject("`after` is not an object literal", after.span, "list delays as keys")
        for key, value in after.fields if isinstance(after, Record) else ():
            state.after.append((key, self._steps(state, value)))
        state.always = self._steps(state, config.get("always"))
        state.on_done = self._steps(state, config.get("onDone"))
        for number, value in enumerate(items(config.get("invoke"))):
            self._invocation(state, number, value)

    def _complete_history(self, state: State) -> None:
        given = state.config.get("history")
        state.is_deep = isinstance(given, String) and given.text.value == "deep"
        target = state.config.get("target")
        if target is not None:
            state.history_targets = self._targets(state, target)

    def _complete_initial(self, state: State) -> None:
        value = state.config.get("initial")
        if state.kind == "parallel":
            return
        if isinstance(value, Record):
            state.initial_actions = tuple(items(value.get("actions")))
            value = value.get("target")
        if not isinstance(value, String):
            self._reject("a state with children needs `initial`, the key of one of them",
                         state.span if value is None else value.span, "name a child")  # fmt: skip
            return
        names = state.by_key
        if value.text.value in names:
            state.initial = names[value.text.value]
        else:
            self._reject(f"the initial state `{value.text}` is not a child", value.text,
                         suggest(value.text.value, names, "name a child"))  # fmt: skip

    def _invocation(self, state: State, number: int, value: Value) -> None:
        if not isinstance(value, Record):
            self._reject("`invoke` is not an object literal", value.span, "write an object")
            return
        if (at := value.get("onSnapshot")) is not None:
            self._reject("`onSnapshot` reacts to each state of an actor", at.span,
                         "let the actor send events")  # fmt: skip
        name = self._text(value, "id") or f"{number}.{state.id}"
        state.invocations.append(Invocation(name, value.get("src"), value.get("input"), value.span))
        for key, event in (("onDone", "done"), ("onError", "error")):
            if (given := value.get(key)) is not None:
                state.answers.append((name, event, self._steps(state, given)))

    # --- transitions ------------------------------------------------------------------------

    def _steps(self, state: State, value: Value | None) -> tuple[Step, ...]:
        if value is None:
            return ()
        given = value.items if isinstance(value, Array) else (value,)
        return tuple(step for one in given if (step := self._step(state, one)) is not None)

    def _step(self, state: State, value: Value) -> Step | None:
        if is_absent(value):
            return Step(state.index, value.span, None, None, (), reenter=False)
        if isinstance(value, String):
            targets = self._targets(state, value)
            return Step(state.index, value.span, targets or None, None, (), reenter=False)
        if not isinstance(value, Record):
            self._reject("the transition is computed when the program runs", value.span,
                         "write a target, or an object literal")  # fmt: skip
            return None
        self._check_keys(value, STEP_KEYS, "a transition")
        target = value.get("target")
        reenter = value.get("reenter")
        if reenter is not None and not isinstance(reenter, Constant):
            self._reject("`reenter` is neither `true` nor `false`", reenter.span, "write one")
        targets = () if target is None else self._targets(state, target)
        if target is not None and not targets and not self._findings.has_errors:
            self._reject("the list of targets is empty", target.span, "remove `target`")
        return Step(state.index, value.span, targets or None, value.get("guard"),
                    tuple(items(value.get("actions"))), reenter=not _is_false(reenter))  # fmt: skip

    def _targets(self, state: State, value: Value) -> tuple[int, ...]:
        found = []
        for one in items(value):
            if not isinstance(one, String):
                self._reject("the target is computed when the program runs", one.span,
                             "name a state")  # fmt: skip
                continue
            target = self._target(state, one.text)
            if target is not None:
                found.append(target)
        return tuple(dict.fromkeys(found))

    def _target(self, state: State, text: Text) -> int | None:
        parts = _split_path(text.value)
        base: int | None
        if text.value.startswith("#"):
            base, parts = self._ids.get(parts[0][1:]), parts[1:]
        elif text.value.startswith("."):
            base, parts = state.index, parts[1:]
        elif state.parent is not None:
            base = state.parent
        else:
            self._reject(f"`{text}` is not a target of the root", text, f"write `.{text}`")
            return None
        for part in parts:
            if base is not None and part:
                base = self._states[base].by_key.get(part)
        if base is None:
            known = [*(f"#{one}" for one in self._ids), *(one.key for one in self._states)]
            self._reject(f"the target `{text}` is not a state", text,
                         suggest(text.value, known, "name a sibling, or `#id`"))  # fmt: skip
        return base

    def _text(self, config: Record, key: str) -> str | None:
        value = config.get(key)
        if value is None:
            return None
        if not isinstance(value, String):
            self._reject(f"`{key}` is not a string literal", value.span, "write a string")
            return None
        return value.text.value


def _split_path(text: str) -> list[str]:
    """Return the keys of a path: dots divide them, unless a backslash stands before the dot."""
    return [part.replace("\\.", ".") for part in re.split(r"(?<!\\)\.", text)]


def _is_false(value: Value | None) -> bool:
    match value:
        case None:
            return True
        case Constant(found):
            return not found
        case Number(found):
            return found == 0
        case String(text):
            return not text.value
        case Array() | Record() | Call() | Code():
            return False
