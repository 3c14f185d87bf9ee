"""From a machine of python-statemachine 3 to a document.

The library follows the algorithm of SCXML. A transition calls ``before``, leaves states, calls
``on``, enters states and calls ``after``. A chart has content between leaving and entering only.
So ``before`` and ``after`` become part of it where nothing happens in between; in a machine without
nested states, what its states do on entry and exit moves into the transitions if necessary.
"""

from __future__ import annotations

import ast
import re
import sys
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from typing import Any

from fsmkit.diagnostics import Findings, Span, Text
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
from fsmkit.foreign.content import Operations
from fsmkit.foreign.imports import Import, Recorder, Role, counts, reject
from fsmkit.foreign.pystatemachine.listing import Listing
from fsmkit.foreign.words import RESERVED
from fsmkit.language.statements.tree import Block

MODULE = "statemachine.statemachine"
DONE = re.compile(r"done[._]state[._](.+)")
END = "end"
"""The rewriting of a completed top-level parallel state into a final state."""
DEEPEST = 60
"""Levels of states; charts have at most 100."""


def is_machine(found: object) -> bool:
    """Return whether an object is a machine of the library, or a class of machines."""
    module = sys.modules.get(MODULE)
    if module is None:
        return False
    kind = found if isinstance(found, type) else type(found)
    return issubclass(kind, module.StateChart)


def import_object(found: Any, name: str, findings: Findings) -> Import | None:
    """Return the import of a machine or class; None after reporting errors.

    A class is read as a machine that was not started: its own ``__init__`` is not called.
    """
    own = Findings()
    machine = _unstarted(found, name, own) if isinstance(found, type) else found
    imported = None
    if machine is not None:
        reader = _Reader(machine, Listing(machine, name), own)
        document = reader.document()
        opaque = reader.operations.opaque
        imported = reader.recorder.imported(name, document, counts(document), opaque)
    findings.extend(own)
    return None if own.has_errors else imported


def _unstarted(kind: Any, name: str, findings: Findings) -> Any | None:
    """Return a machine of a class, with its callbacks resolved, that was not started."""
    base = sys.modules[MODULE].StateChart
    machine = object.__new__(kind)
    object.__setattr__(machine, "_get_engine", _Stopped)
    try:
        base.__init__(machine)
    except Exception as error:  # noqa: BLE001  (whatever the class or the library raises)
        findings.add("foreign-construct", f"`{name}` cannot be read: {error}", None,
                     help="name an instance with its model and listeners")  # fmt: skip
        return None
    return machine


class _Stopped:
    """An engine that never starts."""

    def start(self, **_: object) -> None:
        """Do nothing."""


@dataclass
class _Reader:
    machine: Any
    listing: Listing
    findings: Findings
    operations: Operations = field(default_factory=Operations)
    recorder: Recorder = field(default_factory=Recorder)
    names: dict[int, str] = field(default_factory=dict)
    events: dict[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        namer = Namer(RESERVED)
        self.states = list(_below(self.machine.states))
        for state in self.states:
            self.names[id(state)] = namer.name(state.id, "_state")
        self.end = namer.name("ended", "_state")
        self.event_namer = Namer(RESERVED)
        self.is_flat = all(not state.states and not state.history for state in self.states)
        for state in self.states:
            for transition in state.transitions:
                for event in transition.events:
                    self._event(str(event), transition)
        self.is_inlined = self.is_flat and any(
            self._has_detour(transition)
            for state in self.states
            for transition in state.transitions
        )

    def _reject(self, message: str, at: object, advice: str) -> None:
        reject(self.findings, message, self.listing.span(at), advice)

    # --- the document -------------------------------------------------------------------------

    def document(self) -> Document:
        """Return the document; findings say what is missing in it."""
        machine, listing = self.machine, self.listing
        span = listing.span(machine)
        self._check()
        start = machine.initial_state
        values = machine.start_configuration_values
        if values:
            start = machine.states_map.get(values[0], start)
        initial = DocTransition(
            Trigger.INITIAL,
            span,
            targets=(listing.text(self.names[id(start)], start),),
            content=self._calls(start.enter) or None if self.is_inlined else None,
        )
        children = tuple(self._state(state, 0) for state in machine.states)
        if any(map(self._is_ending, machine.states)):
            self.recorder.rewrite(END, span, self.end)
            children += (DocState(listing.text(self.end, machine), Kind.FINAL, span),)
        root = DocState(None, Kind.COMPOUND, span, initial=initial, children=children)
        return Document(
            listing.source,
            listing.text(Namer(RESERVED).name(type(machine).__name__, "_chart"), machine),
            root,
            operations=self.operations.declarations(),
            events=tuple(
                DocEvent(Text(name, span, ()), (), Direction.IN) for name in self.events.values()
            ),
            doc=(type(machine).__doc__ or "").strip().partition("\n")[0],
        )

    def _check(self) -> None:
        machine = self.machine
        if not machine.allow_event_without_transition:
            self.recorder.differ(
                "an event without a transition raises `TransitionNotAllowed`; a chart discards it",
                self.listing.span(machine), self.findings,
            )  # fmt: skip
        for state in self.states:
            if list(machine._callbacks[state.invoke.key]):  # noqa: SLF001  (no public name)
                self._reject(f"`{state.id}` invokes", state, "start the work in `on_enter`, and "
                             "let it send an event")  # fmt: skip
            if state.parallel:
                self._check_order(state)
                self._check_ties(state)
                if self._is_ending(state):
                    self._check_end(state)

    def _check_ties(self, state: Any) -> None:
        """Report transitions of different regions whose order depends on the history of the run.

        The library tries active states in the order in which they were entered. That order decides
        if one event enables transitions of two regions, and both call something or one leaves its
        region.
        """
        around = (state, *state.ancestors())
        outer = [t for one in around for t in one.transitions if not t.targets]
        calling = {e for t in outer if self._is_calling(t) for e in _triggers(t)}
        targeted: set[str] = set()
        leaving: set[str] = set()
        for region in state.states:
            own: list[set[str]] = [set(), set(), set()]
            for transition in (
                t for one in (region, *_below(region.states)) for t in one.transitions
            ):
                if transition.initial:
                    continue
                events = {*_triggers(transition)}
                calls, leaves = self._is_calling(transition), self._is_leaving(transition, state)
                ties = (calling if calls else set()) | (targeted if leaves else set())
                if events & (ties | (leaving if transition.targets else set())):
                    self._reject("transitions of two regions are enabled together, and the order "
                                 "in which the library takes them depends on the run", transition,
                                 f"call something, or leave `{state.id}`, in one of them only",
                                 )  # fmt: skip
                    return
                for found, kind in zip(own, (calls, transition.targets, leaves), strict=True):
                    found.update(events if kind else ())
            calling, targeted, leaving = calling | own[0], targeted | own[1], leaving | own[2]

    def _is_calling(self, transition: Any) -> bool:
        return any(map(self._found, (transition.before, transition.on, transition.after)))

    def _is_leaving(self, transition: Any, parallel: Any) -> bool:
        """Return whether a transition in a region leaves the region or the parallel state."""
        around = self._around(transition)
        is_inside = around is not None and around.is_descendant(parallel)
        return bool(transition.targets) and not is_inside

    def _check_end(self, state: Any) -> None:
        """Report a top-level parallel state whose completion ends the machine in another way.

        The library stops without leaving the state; a chart leaves it for a final state.
        """
        if any(self._found(one.exit) for one in (state, *_ends(state))):
            self._reject("the machine ends in this parallel state, and the library does not call "
                         "`on_exit` then", state, "put it into a compound state")  # fmt: skip
        handlers = [t for one in self.states for t in one.transitions if _handles_done(t, state)]
        if any(one.source is not state or one.internal or not one.targets for one in handlers):
            self._reject("the machine ends when this parallel state is done, but a transition "
                         "handles that and stays", state, "let the transition leave the state",
                         )  # fmt: skip

    def _is_ending(self, state: Any) -> bool:
        """Return whether a top-level state ends the machine: a parallel one, when it is done.

        A transition without a condition that leaves it then prevents that.
        """
        return (
            state.parallel
            and state.parent is None
            and _can_complete(state)
            and not any(
                _handles_done(one, state)
                and not (self._found(one.cond) or one.internal)
                and one.targets
                for one in state.transitions
            )
        )

    def _end(self, state: Any) -> DocTransition:
        """Return the transition of a completed top-level parallel state to the end."""
        span = self.listing.span(state)
        return DocTransition(
            Trigger.EVENT,
            span,
            events=(Text(f"done.state.{self.names[id(state)]}", span, ()),),
            guard=Text(self._completed(state), span, ()),
            targets=(Text(self.end, span, ()),),
            ordered=True,
        )

    def _completed(self, state: Any) -> str:
        """Return the condition that each region of a parallel state is in a final state."""
        return " and ".join(
            self._completed(region)
            if region.parallel
            else "(" + " or ".join(
                f"In({self.names[id(one)]})" for one in region.states if one.final
            ) + ")"
            for region in state.states
        )  # fmt: skip

    def _check_order(self, state: Any) -> None:
        """Report regions that the library enters and leaves in no order of the document."""
        regions = [[region, *_below(region.states)] for region in state.states]
        busy = [[s.document_order for s in region if self._has_content(s)] for region in regions]
        for number, before in enumerate(busy):
            for after in busy[number + 1 :]:
                if before and after and max(before) >= min(after):
                    self._reject(
                        "the library enters and leaves states of different regions in an order "
                        "of its own", state, "call the callbacks of one region only",
                    )  # fmt: skip
                    return

    def _has_content(self, state: Any) -> bool:
        return bool(self._found(state.enter) or self._found(state.exit))

    def _found(self, group: Any) -> list[Any]:
        """Return the callbacks of a group, in the order of the library."""
        return list(self.machine._callbacks[group.key])  # noqa: SLF001  (no public name)

    # --- states -------------------------------------------------------------------------------

    def _state(self, state: Any, depth: int) -> DocState:
        span = self.listing.span(state)
        name = self.listing.text(self.names[id(state)], state)
        if depth > DEEPEST:
            self._reject(
                f"states are nested more than {DEEPEST} levels", state, "divide the machine"
            )
            return DocState(name, Kind.ATOMIC, span)
        if getattr(state, "is_history", False):
            return self._history(state, name)
        children = tuple(self._state(child, depth + 1) for child in (*state.states, *state.history))
        kind = Kind.ATOMIC
        if state.final:
            kind = Kind.FINAL
        elif state.states:
            kind = Kind.PARALLEL if state.parallel else Kind.COMPOUND
        initial = None
        if kind is Kind.COMPOUND:
            starts = [t for t in state.transitions if t.initial]
            initial = self._initial(starts[0], span) if starts else None
        is_end = state.final and state.parent is None
        transitions = tuple(
            step for t in state.transitions if not t.initial for step in self._steps(state, t)
        )
        if self._is_ending(state):
            transitions += (self._end(state),)
        entry = () if self.is_inlined else self._calls(state.enter)
        leave = () if self.is_inlined or is_end else self._calls(state.exit)
        return DocState(
            name,
            kind,
            span,
            initial=initial,
            children=children,
            transitions=transitions,
            entry=(entry,) if entry else (),
            exit=(leave,) if leave else (),
        )

    def _initial(self, transition: Any, span: Span) -> DocTransition:
        targets = tuple(self.listing.text(self.names[id(t)], t) for t in transition.targets)
        content = self._calls(transition.on) or None
        return DocTransition(Trigger.INITIAL, span, targets=targets, content=content)

    def _history(self, state: Any, name: Text) -> DocState:
        kind = Kind.DEEP_HISTORY if state.type.is_deep else Kind.SHALLOW_HISTORY
        span = self.listing.span(state)
        defaults = [t for t in state.transitions if t.targets]
        if defaults:
            return DocState(name, kind, span, initial=self._initial(defaults[0], span))
        starts = [t for t in state.parent.transitions if t.initial]
        if state.parent.parallel or not starts:
            self._reject("the history has no default", state, "add `history.to(state)`")
            return DocState(name, kind, span)
        return DocState(name, kind, span, initial=self._initial(starts[0], span))

    # --- transitions --------------------------------------------------------------------------

    def _event(self, event: str, at: object) -> str:
        """Return the name of an event in the chart."""
        done = DONE.fullmatch(event)
        if done is not None:
            found = [state for state in self.states if state.id == done[1]]
            return f"done.state.{self.names[id(found[0])]}" if found else ""
        if event.startswith(("error.", "error_", "done.", "done_")):
            return ""
        if event == "*" or "." in event:
            self._reject(f"`{event}` is a pattern of events", at, "name the events")
            return ""
        if event not in self.events:
            self.events[event] = self.event_namer.name(event, "_event")
        return self.events[event]

    def _steps(self, state: Any, transition: Any) -> Iterator[DocTransition]:
        """Yield a transition for each of its events: callbacks differ by event."""
        if transition.is_eventless:
            yield self._step(state, transition, None)
        names: set[str] = set()
        for event in transition.events:
            name = self._event(str(event), transition)
            if name and name not in names:
                names.add(name)
                yield self._step(state, transition, str(event), name)
            elif not name and str(event).startswith("error"):
                self.recorder.lose("a transition for errors of callbacks, which a chart does not "
                                   "have", self.listing.span(transition))  # fmt: skip

    def _step(
        self, state: Any, transition: Any, event: str | None, name: str = ""
    ) -> DocTransition:
        at = self.listing.span(transition)
        targets = tuple(
            self.listing.text(self.names[id(t)], transition) for t in transition.targets
        )
        before = self._calls(transition.before, event)
        on = self._calls(transition.on, event)
        after = self._calls(transition.after, event)
        leave: Block = ()
        enter: Block = ()
        is_internal = transition.internal
        if on and any(getattr(target, "is_history", False) for target in transition.targets):
            self._reject("the library calls `on` of a transition to a history twice", transition,
                         "call it in `on_enter` of the state")  # fmt: skip
        if transition.targets and is_internal and transition.is_self:
            targets, is_internal = self._stay(state, transition), False
        elif is_internal and not self.machine.enable_self_transition_entries:
            self._reject("the library does not enter the target of this internal transition",
                         transition, "set `enable_self_transition_entries = True`")  # fmt: skip
        elif self.is_inlined and transition.targets:
            leave, enter = self._calls(state.exit), self._calls(transition.target.enter)
        elif targets:
            self._check_detours(transition, before, after)
        return DocTransition(
            Trigger.EVENTLESS if event is None else Trigger.EVENT,
            at,
            events=() if event is None else (Text(name, at, ()),),
            guard=self._guard(transition, event),
            targets=targets,
            internal=is_internal,
            content=(*before, *leave, *on, *enter, *after) or None,
            ordered=True,
        )

    def _stay(self, state: Any, transition: Any) -> tuple[Text, ...]:
        """Return the targets of an internal transition to its own source."""
        is_entered = self.machine.enable_self_transition_entries
        around = list(state.ancestors())
        if any(one.parallel for one in around):
            self._reject("the library enters the other regions again", transition,
                         "remove `internal`, or the target")  # fmt: skip
        elif state.states or (is_entered and any(self._found(s.enter) for s in (state, *around))):
            self._reject("the library enters the state again without leaving it", transition,
                         "remove `internal`, or the callbacks on entry")  # fmt: skip
        return ()

    def _has_detour(self, transition: Any) -> bool:
        """Return whether ``before`` or ``after`` is apart from the content of a transition."""
        if not transition.targets or transition.internal:
            return False
        before, after = (
            self._found(transition.before),
            self._found(transition.after),
        )
        leaves = any(self._found(state.exit) for state in self._left(transition))
        enters = any(self._found(state.enter) for state in self._entered(transition))
        return bool((before and leaves) or (after and enters))

    def _check_detours(self, transition: Any, before: Block, after: Block) -> None:
        if before and any(self._found(s.exit) for s in self._left(transition)):
            self._reject("`before` is called before states are left", transition,
                         "call it in `on`")  # fmt: skip
        if after and any(self._found(s.enter) for s in self._entered(transition)):
            self._reject("`after` is called after states are entered", transition,
                         "call it in `on`, or in `on_enter`")  # fmt: skip

    def _left(self, transition: Any) -> Iterator[Any]:
        """Yield states that a transition may leave: all but those around source and targets."""
        around = self._around(transition)
        return (state for state in self.states if self._is_within(state, around, transition.source))

    def _entered(self, transition: Any) -> Iterator[Any]:
        around = self._around(transition)
        for target in transition.targets:
            yield from (s for s in self.states if self._is_within(s, around, target))

    def _around(self, transition: Any) -> Any | None:
        found = (transition.source, *transition.targets)
        for ancestor in transition.source.ancestors():
            is_common = all(one.is_descendant(ancestor) for one in found)
            if is_common and not ancestor.parallel:
                return ancestor
        return None

    def _is_within(self, state: Any, around: Any | None, end: Any) -> bool:
        """Return whether a state is below ``around``, and in the part of it that holds ``end``."""
        if around is not None and not state.is_descendant(around):
            return False
        if self.is_flat:
            return state is end
        top = end
        while top.parent is not None and top.parent is not around:
            top = top.parent
        return state is top or state.is_descendant(top)

    # --- content ------------------------------------------------------------------------------

    def _calls(self, group: Any, event: str | None = None) -> Block:
        """Return calls of the callbacks of a group, in the order of the library."""
        found: list[Any] = []
        for wrapper in self._found(group):
            spec = wrapper.meta
            if event is not None and spec.cond is not None and spec.cond.__self__ != event:
                continue
            if spec.is_event:
                self._reject(f"the callback `{spec.attr_name}` sends an event", self.machine,
                             "send it from a callback, which the host implements")  # fmt: skip
                continue
            found += self.operations.action(Text(_plain(spec.attr_name), self._at(), ()))
        return tuple(found)

    def _guard(self, transition: Any, event: str | None) -> Text | None:
        parts = self._validated(transition, event)
        for spec in transition.cond:
            text = self._condition(str(spec.attr_name), transition)
            parts.append(text if spec.expected_value is not False else f"not {text}")
        at = self.listing.span(transition)
        return Text(" and ".join(parts), at, ()) if parts else None

    def _validated(self, transition: Any, event: str | None) -> list[str]:
        """Return the conditions that no validator rejects an event before a transition is taken.

        A validator of a transition rejects the event for the transitions after it, too.
        """
        source = transition.source
        together = [one for one in source.transitions if event in [*map(str, one.events)]]
        tried = [*together[: together.index(transition)], transition] if event else [transition]
        validators = [(one, spec) for one in tried for spec in self._found(one.validators)]
        if not validators:
            return []
        around = list(source.ancestors())
        handlers = (one for outer in around for one in outer.transitions)
        if event is None or event.startswith(("done.", "done_", "error.", "error_")):
            self._reject("validators reject an event of the machine itself", transition,
                         "use `cond`")  # fmt: skip
        elif any(one.parallel for one in around) or any(
            event in [*map(str, one.events)] for one in handlers
        ):
            self._reject(f"validators reject `{event}` for regions or for outer states, too",
                         transition, "use `cond`")  # fmt: skip
        else:
            self.recorder.differ(
                "a validator that rejects an event raises an exception; in the chart its operation "
                "returns `false`, and the event has no effect",
                self.listing.span(transition), self.findings,
            )  # fmt: skip
        return [self._query(str(found.meta.attr_name), one) for one, found in validators]

    def _condition(self, text: str, transition: Any) -> str:
        """Return a condition: names are operations, and so is what is no Boolean expression."""
        written = re.sub(r"!(?!=)", " not ", text.replace("^", " and ")).strip()
        try:
            tree = ast.parse(re.sub(r"\bv\b", "or", written), mode="eval").body
        except (SyntaxError, ValueError, RecursionError, MemoryError):
            return self._query(text, transition)
        return self._boolean(tree, transition)

    def _boolean(self, tree: ast.expr, transition: Any) -> str:
        match tree:
            case ast.BoolOp(operator, values):
                word = " and " if isinstance(operator, ast.And) else " or "
                return f"({word.join(self._boolean(each, transition) for each in values)})"
            case ast.UnaryOp(ast.Not(), operand):
                return f"(not {self._boolean(operand, transition)})"
            case ast.Constant(bool(value)):
                return "true" if value else "false"
            case ast.Name(name):
                return self._query(name, transition)
            case _:
                return self._query(ast.unparse(tree), transition)

    def _query(self, text: str, transition: Any) -> str:
        at = Text(text, self.listing.span(transition), ())
        return f"{self.operations.operation(at, Role.GUARD, _plain(text))}()"

    def _at(self) -> Span:
        return self.listing.span(self.machine)


def _below(states: Iterable[Any]) -> Iterator[Any]:
    """Yield states, histories included, and all below them, in the order of the document."""
    waiting = list(reversed(list(states)))
    while waiting:
        state = waiting.pop()
        yield state
        waiting.extend(reversed([*state.states, *state.history]))


def _handles_done(transition: Any, state: Any) -> bool:
    """Return whether a transition has the event that a state is done."""
    found = (DONE.fullmatch(str(event)) for event in transition.events)
    return any(each is not None and each[1] == state.id for each in found)


def _triggers(transition: Any) -> Iterator[str]:
    """Yield the events of a transition; an empty one if it has none."""
    yield from ("",) if transition.is_eventless else map(str, transition.events)


def _can_complete(state: Any) -> bool:
    """Return whether each region of a parallel state can be in a final state."""
    return all(
        _can_complete(region) if region.parallel else any(one.final for one in region.states)
        for region in state.states
    )


def _ends(state: Any) -> Iterator[Any]:
    """Yield the states below a parallel state that are active when all its regions are done."""
    for region in state.states:
        yield region
        yield from _ends(region) if region.parallel else (s for s in region.states if s.final)


def _plain(name: str) -> str:
    """Return a name as an identifier."""
    found = re.sub(r"\W+", "_", name).strip("_")[:60] or "callback"
    return f"f_{found}" if found[0].isdigit() else found
