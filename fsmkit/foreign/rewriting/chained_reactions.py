"""R7 and R11: a state executes several reactions to an event, and may pass the event on.

The tool executes the enabled reactions of a state in their order, until one of them has a target.
If no reaction consumed the event, the next outer state receives it, too.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field, replace

from fsmkit.diagnostics import Text
from fsmkit.document.document import (
    Direction,
    DocEvent,
    DocState,
    DocTransition,
    Document,
    Kind,
    Trigger,
)
from fsmkit.emit.identifiers import Namer
from fsmkit.foreign.imports import Recorder
from fsmkit.foreign.rewriting.tree import Tree, map_states, name_of
from fsmkit.foreign.words import RESERVED
from fsmkit.language.statements.tree import (
    Assign,
    Block,
    Branch,
    DocArgument,
    If,
    Local,
    Raise,
    statements,
)

CONSUMED = "consume_event"
"""The variable that content assigns to pass an event on, or to keep it."""


def chained_reactions(
    document: Document, recorder: Recorder, passes: Callable[[str], bool] = lambda _: False
) -> Document:
    """Execute every enabled reaction of a state (R11), and pass on events (R7).

    Args:
        document: Transitions in the order of the tool; content may assign `CONSUMED`.
        recorder: Records the changes.
        passes: Whether reactions to an event leave it unconsumed, unless content says otherwise.

    Several reactions become one transition with ``if`` after ``if``. It raises an internal event
    for a transition with a target, and one for the outer state if the event is passed on.

    """
    return _Rewriter(Tree(document), recorder, passes).document()


@dataclass
class _Rewriter:
    tree: Tree
    recorder: Recorder
    passes: Callable[[str], bool]
    namer: Namer = field(init=False)
    raised: dict[tuple[str, str], str] = field(default_factory=dict)
    """The internal events that pass an event on, by the event and the receiving state."""
    internal: list[tuple[str, str]] = field(default_factory=list)
    """New internal events, each with the event that it continues."""

    def __post_init__(self) -> None:
        declared = {event.name.value for event in self.tree.document.events}
        self.namer = Namer({*declared, *RESERVED})

    def document(self) -> Document:
        """Return the rewritten document."""
        chained = map_states(self.tree.document, self._state)
        passed = map_states(chained, self._receive)
        declared = {event.name.value: event for event in passed.events}
        new = []
        for name, event in self.internal:
            known = declared.get(event)
            at = known.name if known is not None else passed.name
            fields = () if known is None else known.fields
            new.append(DocEvent(at.with_value(name), fields, Direction.INTERNAL))
        return replace(passed, events=(*passed.events, *new))

    def _state(self, state: DocState) -> DocState:
        if state.kind is Kind.CHOICE:
            return state
        by_event = _reactions(state)
        chained = {event for event in by_event if self._needs_chain(state, event, by_event[event])}
        if not chained:
            return state
        found: list[DocTransition] = []
        done: set[str] = set()
        for transition in state.transitions:
            kept = tuple(event for event in transition.events if event.value not in chained)
            if kept or transition.trigger is not Trigger.EVENT:
                found.append(replace(transition, events=kept))
            for event in transition.events:
                if event.value in chained and event.value not in done:
                    done.add(event.value)
                    found += self._chain(state, event, by_event[event.value])
        return replace(state, transitions=tuple(found))

    def _outer(self, state: DocState, event: str) -> str | None:
        """Return the nearest state around that reacts to an event."""
        for name in self.tree.ancestors(name_of(state)):
            if event in _reactions(self.tree.states[name]):
                return name
        return None

    def _needs_chain(self, state: DocState, event: str, found: list[DocTransition]) -> bool:
        if any(map(_assigns, found)):
            return True
        inner = [place for place, transition in enumerate(found) if not transition.targets]
        if inner and inner[0] != len(found) - 1:
            return True
        return bool(inner) and self.passes(event) and self._outer(state, event) is not None

    def _chain(
        self, state: DocState, event: Text, found: list[DocTransition]
    ) -> Iterator[DocTransition]:
        """Yield the transitions of one event: leading ones with a target, then the chain."""
        lead = next(place for place, each in enumerate(found) if not each.targets)
        for transition in found[:lead]:
            yield replace(transition, events=(event,))
        rest = found[lead:]
        outer = self._outer(state, event.value)
        always = not self.passes(event.value) and any(
            each.guard is None and not each.targets for each in rest
        )
        assigns = any(map(_assigns, rest))
        has_flag = assigns or (outer is not None and not always and not self.passes(event.value))
        targets: list[DocTransition] = []
        end: Block = ()
        if outer is not None and (has_flag or not always):
            end = self._pass_on(event, outer, rest[0], is_conditional=has_flag)
        body = self._body(state, event, rest, targets, end, has_flag=has_flag)
        span = rest[0].span
        if has_flag:
            flag, false, type_ = map(event.with_value, (CONSUMED, "false", "bool"))
            body = (Local(flag, false, span, type_), *body)
        rule = "R11" if len(rest) > 1 else "R7"
        names = [each.events[0].value for each in targets]
        passed = [self.raised[event.value, outer]] if end and outer is not None else []
        self.recorder.rewrite(rule, span, *names, *passed)
        yield DocTransition(Trigger.EVENT, span, events=(event,), content=body)
        yield from targets

    def _body(
        self,
        state: DocState,
        event: Text,
        rest: list[DocTransition],
        targets: list[DocTransition],
        end: Block,
        *,
        has_flag: bool,
    ) -> Block:
        """Return the reactions as statements; those after a transition with a target are inside."""
        if not rest:
            return end
        first, more = rest[0], rest[1:]
        if first.targets:
            name = self._new(f"{name_of(state)}_{event.value}", event.value)
            at = event.with_value(name)
            targets.append(replace(first, events=(at,), guard=None))
            leave: Block = (Raise(at, self._payload(event), first.span),)
            if first.guard is None:
                return leave
            others = self._body(state, event, more, targets, end, has_flag=has_flag)
            branches = (Branch(first.guard, leave), *((Branch(None, others),) if others else ()))
            return (If(branches, first.span),)
        body = first.content or ()
        if has_flag and not self.passes(event.value):
            flag = event.with_value(CONSUMED)
            body = (Assign(flag, event.with_value("true"), first.span), *body)
        others = self._body(state, event, more, targets, end, has_flag=has_flag)
        if first.guard is None:
            return (*body, *others)
        return (*((If((Branch(first.guard, body),), first.span),) if body else ()), *others)

    def _pass_on(
        self, event: Text, outer: str, at: DocTransition, *, is_conditional: bool
    ) -> Block:
        key = event.value, outer
        if key not in self.raised:
            self.raised[key] = self._new(f"{event.value}_at_{outer}", event.value)
        raising = Raise(event.with_value(self.raised[key]), self._payload(event), at.span)
        if not is_conditional:
            return (raising,)
        return (If((Branch(event.with_value(f"not {CONSUMED}"), (raising,)),), at.span),)

    def _new(self, wished: str, event: str) -> str:
        name = self.namer.name(wished, "_event")
        self.internal.append((name, event))
        return name

    def _payload(self, event: Text) -> tuple[DocArgument, ...]:
        """Return the fields of the current event as arguments."""
        declared = {each.name.value: each for each in self.tree.document.events}
        known = declared.get(event.value)
        return tuple(
            DocArgument(each.name, each.name.with_value(f"event.{each.name.value}"))
            for each in (() if known is None else known.fields)
        )

    def _receive(self, state: DocState) -> DocState:
        """Let the transitions of a state react to events that inner states pass on."""
        name = name_of(state)
        more = {
            new: event
            for (event, receiver), new in self.raised.items()
            if receiver == name or self.tree.is_below(receiver, name)
        }
        if not more:
            return state
        found = tuple(
            replace(
                transition,
                events=(
                    *transition.events,
                    *(
                        each.with_value(new)
                        for each in transition.events
                        for new, event in more.items()
                        if event == each.value
                    ),
                ),
            )
            for transition in state.transitions
        )
        return replace(state, transitions=found)


def _reactions(state: DocState) -> dict[str, list[DocTransition]]:
    """Return the transitions of a state by event, in their order."""
    found: dict[str, list[DocTransition]] = {}
    for transition in state.transitions:
        for event in transition.events:
            found.setdefault(event.value, []).append(transition)
    return found


def _assigns(transition: DocTransition) -> bool:
    """Return whether the content of a reaction without a target sets `CONSUMED`."""
    return not transition.targets and any(
        isinstance(each, Assign) and each.location.value == CONSUMED
        for each in _all(transition.content or ())
    )


def _all(block: Block) -> Iterable[object]:
    return statements(block)
