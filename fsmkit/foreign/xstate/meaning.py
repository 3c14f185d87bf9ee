"""From a machine of XState to a Document that does the same.

XState follows the algorithm of SCXML, with these differences, which are rewritten:

* R1: a transition to its source, or to a descendant of it, does not leave the source.
* R8: the common ancestor of a transition may be a parallel state, which then stays active.
* R9: of several descriptors in one state, the exact one comes first, then longer prefixes.
* R12: timeouts are events: one that a `*` below can take, or whose delay the host computes.
* A transition in a region hides those of the states around the parallel state.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from functools import cached_property

from fsmkit.diagnostics import Findings, Span, Text
from fsmkit.document import document as doc
from fsmkit.foreign.imports import Import, Remark, counts
from fsmkit.foreign.xstate.content import Content, Guard, Names
from fsmkit.foreign.xstate.machine import Machine, State, Step
from fsmkit.foreign.xstate.values import String
from fsmkit.language.statements.reading import read_statements
from fsmkit.language.statements.tree import Block, DocField

MOST_ROUNDS = 1_000
"""Each round demotes a variable of the context or finds a raised event."""


@dataclass(frozen=True, slots=True)
class Options:
    """Choices of the user: whether timeouts wait in the queue."""

    queues_timeouts: bool = False


def import_document(
    machine: Machine, name: str, findings: Findings, options: Options | None = None
) -> Import | None:
    """Return the document of a machine with the report; None if a chart cannot express it."""
    demoted: set[str] = set()
    raised: dict[str, str] = {}
    for _ in range(MOST_ROUNDS):
        own = Findings()
        before = (len(demoted), len(raised))
        content = Content(machine, demoted, own)
        builder = _Builder(machine, content, own, options or Options(), dict(raised))
        document = builder.document()
        raised |= builder.raised_names()
        if (len(demoted), len(raised)) == before:
            break
    findings.extend(own)
    opaque = content.opaque.values()
    return content.recorder.imported(name, document, counts(document), opaque)


PENDING, MOST_PENDING = 16, 250
"""Pending events for each delayed ``raise``, and the most that a chart has."""
OTHER = "\0"
"""The last part of the name of an event that only wildcards match."""


@dataclass(frozen=True, slots=True)
class _Event:
    """An event of the library. ``name`` is that of the chart; states name it in ``source``."""

    source: str
    name: str
    is_posted: bool = True


@dataclass
class _Builder:
    machine: Machine
    content: Content
    findings: Findings
    options: Options
    raised: dict[str, str]
    """The raised events by their types, as far as known from the round before."""
    ids: dict[int, str] = field(default_factory=dict)
    regions: dict[int, str] = field(default_factory=dict)
    """The state that holds the regions of a parallel state which became compound (R8)."""

    def __post_init__(self) -> None:
        names = Names()
        states = self.machine.states
        keys = [state.key for state in states]
        for state in states[1:]:
            is_plain = keys.count(state.key) == 1
            base = state.key if is_plain else "_".join(state.path[-2:])
            self.ids[state.index] = names.fresh(base)
        self.names = names
        root = states[0]
        has_history = any(states[child].kind == "history" for child in root.children)
        self.has_root = root.kind != "compound" or bool(
            has_history
            or root.entry
            or root.exit
            or root.on
            or root.always
            or root.after
            or root.invocations
        )
        if self.has_root:
            self.ids[0] = names.fresh(root.id if root.config.get("id") else "machine")
        for event, fields in self.machine.declared.items():
            self.content.fields.setdefault(self.content.events.name(event), dict(fields))
        self.events = tuple(self._events())
        self.queued = frozenset(self._queued())
        self.events = (*self.events, *self._timeouts())
        for index in self._wrapped():
            self.regions[index] = names.fresh(f"{self.ids[index]}_regions")

    # --- events -------------------------------------------------------------------------------

    def raised_names(self) -> dict[str, str]:
        """Return the raised events by their types."""
        names = {name: kind for kind, name in self.content.events.given.items()}
        return {names[name]: name for name in self.content.raised if name in names}

    def _events(self) -> Iterator[_Event]:
        seen: set[str] = set()

        def new(source: str) -> Iterator[_Event]:
            if source not in seen and not source.startswith("xstate."):
                seen.add(source)
                yield _Event(source, self.content.events.name(source))

        for name in (*self.machine.declared, *self.raised):
            yield from new(name)
        for state in self.machine.states:
            for key, _ in state.on:
                if not key.value.endswith("*"):
                    yield from new(key.value)
            for invocation, kind, _ in state.answers:
                source = f"xstate.{kind}.actor.{invocation}"
                yield _Event(source, self.content.events.name(source, f"{kind}_{invocation}"))
        yield from self._others()
        for state in self.machine.states:
            if self._completes(state):
                yield _Event(f"xstate.done.state.{state.id}", f"done.state.{state.index}", False)

    def _others(self) -> Iterator[_Event]:
        """Yield an event for each wildcard, which represents the events that nothing declares."""
        if self.machine.declared:
            return
        wildcards = {k.value: k for s in self.machine.states for k, _ in s.on if "*" in k.value}
        for key in wildcards:
            base = f"{key[:-2]}_other" if key != "*" else "other"
            yield _Event(key.replace("*", OTHER), self.content.events.name(f"any {key}", base))

    def _completes(self, state: State) -> bool:
        """Return whether the library reports that a state is done."""
        return state.index != 0 and self._final_condition(state) is not None

    def _queued(self) -> Iterator[tuple[int, str]]:
        """Yield the timers, as state and delay, whose timeouts are events of the queue."""
        catching = [s.index for s in self.machine.states if any(_catches(k) for k, _ in s.on)]
        for state in self.machine.states:
            for key, _ in state.after:
                is_computed = not self.content.delay(_string(key), "delay").endswith("ms")
                is_caught = any(self._can_be_together(state.index, each) for each in catching)
                if is_computed or is_caught or self.options.queues_timeouts:
                    yield state.index, key.value

    def _can_be_together(self, one: int, other: int) -> bool:
        if one == other or self.machine.is_below(one, other) or self.machine.is_below(other, one):
            return True
        common = self.machine.common_ancestor(one, other)
        return common is not None and self.machine.states[common].kind == "parallel"

    def _timeouts(self) -> Iterator[_Event]:
        for index, delay in sorted(self.queued):
            state = self.machine.states[index]
            source = f"xstate.after.{delay}.{state.id}"
            name = self.content.events.name(source, f"t_{self.ids.get(index, 'root')}_{delay}")
            yield _Event(source, name, is_posted=False)

    @cached_property
    def _table(self) -> dict[str, dict[int, tuple[Step, ...]]]:
        """The transitions for each event by state; states without one are missing."""
        table: dict[str, dict[int, tuple[Step, ...]]] = {e.source: {} for e in self.events}
        for state in self.machine.states:
            own = {key.value for key, _ in state.on}
            own |= {f"xstate.after.{key}.{state.id}" for key, _ in state.after}
            own |= {f"xstate.{kind}.actor.{name}" for name, kind, _ in state.answers}
            own.add(f"xstate.done.state.{state.id}")
            has_pattern = any("*" in key.value for key, _ in state.on)
            for source in table if has_pattern else own & table.keys():
                steps = self._find_candidates(state, source)
                if steps:
                    table[source][state.index] = steps
        return table

    @cached_property
    def _events_of(self) -> dict[int, list[_Event]]:
        """The events that each state has a transition for, in the order of events."""
        found: dict[int, list[_Event]] = {}
        for event in self.events:
            for index in self._table[event.source]:
                found.setdefault(index, []).append(event)
        return found

    def _candidates(self, state: State, event: _Event) -> tuple[Step, ...]:
        """Return the transitions of a state for an event, in the library's order (R9)."""
        return self._table[event.source].get(state.index, ())

    def _find_candidates(self, state: State, source: str) -> tuple[Step, ...]:
        exact: list[Step] = []
        prefixes: list[tuple[int, tuple[Step, ...]]] = []
        for key, steps in state.on:
            if key.value == source:
                exact += steps
            elif _matches(source, key.value):
                prefixes.append((-len(key.value), steps))
        if source == f"xstate.done.state.{state.id}" and state.on_done:
            exact = list(state.on_done)
        for invocation, kind, steps in state.answers:
            if source == f"xstate.{kind}.actor.{invocation}":
                exact = list(steps)
        for key, steps in state.after:
            if source == f"xstate.after.{key}.{state.id}":
                exact += steps
        prefixes.sort(key=lambda found: found[0])
        return (*exact, *(step for _, steps in prefixes for step in steps))

    # --- targets ------------------------------------------------------------------------------

    def _domain(self, step: Step) -> int | None:
        """Return the state whose descendants a transition leaves; None above the root."""
        targets = step.targets or ()
        if not step.reenter and all(self._is_within(each, step.source) for each in targets):
            return step.source
        return self.machine.common_ancestor(*targets, step.source)

    def _is_within(self, target: int, source: int) -> bool:
        return target == source or self.machine.is_below(target, source)

    def _wrapped(self) -> Iterator[int]:
        """Yield the parallel states that a transition leaves the inside of, but not itself."""
        found = {self._domain(step) for step in self.machine.steps() if self._leaves(step)}
        for state in self.machine.states:
            if state.kind == "parallel":
                has_history = any(
                    self.machine.states[child].kind == "history" for child in state.children
                )
                if state.index in found or has_history:
                    at = state.span
                    self.content.recorder.rewrite("R8", at)
                    yield state.index

    def _leaves(self, step: Step) -> bool:
        """Return whether a transition leaves any state."""
        if not step.targets:
            return False
        kind = self.machine.states[step.source].kind
        is_self = step.targets == (step.source,) and not step.reenter
        return not (is_self and kind in ("atomic", "final"))

    def _arrow(self, step: Step) -> tuple[tuple[str, ...], bool, list[str]]:
        """Return the targets of a transition, whether it is internal, and content of its own."""
        targets = step.targets or ()
        if not self._leaves(step):
            return (), False, []
        source = self.machine.states[step.source]
        self._check_targets(step)
        if 0 in targets and not step.reenter:
            return self._to_root(step)
        if self._domain(step) == step.source:
            self.content.recorder.rewrite("R1", step.span)
            is_internal = self.has_root or step.source != 0
            if targets == (step.source,):
                inner = self._inside(source)
                return (inner,), is_internal, []
            return tuple(self.ids[each] for each in targets), is_internal, []
        return tuple(self.ids[each] for each in targets), False, []

    def _inside(self, state: State) -> str:
        """Return the state that entering a state by default enters below it."""
        if state.kind == "parallel":
            return self.regions[state.index]
        return self.ids[state.initial or 0]

    def _to_root(self, step: Step) -> tuple[tuple[str, ...], bool, list[str]]:
        root = self.machine.states[0]
        if (self.has_root and root.kind != "parallel") or root.entry or root.exit or root.after:
            self._reject("the library enters the root again without leaving it", step.span,
                         "add `reenter: true`, or name a state below the root")  # fmt: skip
            return (), False, []
        if root.index not in self.regions and root.kind == "parallel":
            self._reject("the target is the root, which is parallel", step.span,
                         "add `reenter: true`")  # fmt: skip
            return (), False, []
        actions = self.content.actions(root.initial_actions, None, "initial")
        return (self._inside(root),), False, actions

    def _check_targets(self, step: Step) -> None:
        targets = step.targets or ()
        if len(targets) > 1 and step.source in targets and not step.reenter:
            self._reject("one of several targets is the source itself", step.span,
                         "add `reenter: true`, or remove the source")  # fmt: skip
        for target in targets:
            state = self.machine.states[target]
            parent = state.parent
            if state.kind != "history" or parent is None:
                continue
            is_whole = self.machine.states[parent].kind == "parallel" and not state.history_targets
            is_default = is_whole or step.source in state.history_targets
            is_own = step.source == parent and is_default
            if is_own or self.machine.is_below(step.source, parent):
                self._reject("the history belongs to a state that is active: what the library "
                             "enters then depends on the past", step.span,
                             "put the transition on a state outside")  # fmt: skip

    def _reject(self, message: str, at: Span | Text, advice: str) -> None:
        self.content.reject(message, at, advice)

    # --- the document -------------------------------------------------------------------------

    def document(self) -> doc.Document:
        """Return the document; findings say why it is wrong."""
        machine = self.machine
        self._check_initial_actions()
        self._check_completion()
        root = machine.states[0]
        span = Span(machine.source, root.span.start, root.span.end)
        top = self._state(root)
        ends = self._has_end()
        if self.has_root:
            extra = (self._end(span),) if ends else ()
            initial = doc.DocTransition(
                doc.Trigger.INITIAL, span, targets=(_text(self.ids[0], span),)
            )
            whole = doc.DocState(None, doc.Kind.COMPOUND, span, initial=initial,
                                 children=(top, *extra))  # fmt: skip
        else:
            whole = top
        content = self.content
        for message, at in machine.lost:
            content.recorder.lose(message, at)
        queued = min(len(self.queued) + PENDING * content.delayed, MOST_PENDING)
        if content.delayed:
            message = f"at most {max(queued, 4)} delayed events are pending: `capacity: delayed`"
            content.recorder.differs.append(Remark(message, root.span))
        return doc.Document(
            machine.source,
            _text(Names().fresh(machine.name.value), machine.name.span),
            whole,
            data=tuple(
                doc.DocData(_text(typed.text, span), _text(typed.type, span), _text(start, span))
                for typed, start in content.variables.values()
            ),
            operations=tuple(self._operations()),
            events=tuple(self._declarations()),
            capacities=(
                (doc.DocCapacity(_text("delayed", span), _text(str(queued), span)),)
                if queued > 4
                else ()
            ),
            doc=root.doc,
        )

    def _operations(self) -> Iterator[doc.DocOperation]:
        for name, (parameters, result) in self.content.operations.items():
            at = self.content.opaque[name].text.span
            yield doc.DocOperation(
                _text(name, at),
                tuple(DocField(_text(each, at), _text(kind, at)) for each, kind in parameters),
                None if result is None else _text(result, at),
            )

    def _declarations(self) -> Iterator[doc.DocEvent]:
        root = self.machine.states[0].span
        spans = {k.value: k.span for s in self.machine.states for k, _ in s.on}
        for event in self.events:
            if event.name.startswith("done.state."):
                continue
            at = spans.get(event.source, root)
            direction = doc.Direction.IN if event.is_posted else doc.Direction.INTERNAL
            yield doc.DocEvent(_text(event.name, at), self._fields(event.name, at), direction)
        for name, at in self.content.out.items():
            yield doc.DocEvent(_text(name, at), self._fields(name, at), doc.Direction.OUT)

    def _fields(self, event: str, at: Span) -> tuple[DocField, ...]:
        fields = self.content.fields.get(event, {})
        return tuple(
            DocField(_text(name, at), _text(kind, at)) for name, kind in fields.items() if kind
        )

    # --- the end of the machine ---------------------------------------------------------------

    def _has_end(self) -> bool:
        root = self.machine.states[0]
        if root.kind == "parallel":
            return self._final_condition(root) is not None
        return any(self.machine.states[child].kind == "final" for child in root.children)

    def _final_condition(self, state: State) -> str | None:
        """Return when a state is done, as a condition; None if it never is."""
        children = [self.machine.states[child] for child in state.children]
        if state.kind == "parallel":
            parts = [self._final_condition(one) for one in children if one.kind != "history"]
            if not parts or None in parts:
                return None
            return " and ".join(f"({part})" for part in parts)
        finals = [self.ids[one.index] for one in children if one.kind == "final"]
        return " or ".join(f"In({name})" for name in finals) or None

    def _end(self, span: Span) -> doc.DocState:
        return doc.DocState(_text(self._end_name, span), doc.Kind.FINAL, span)

    @property
    def _end_name(self) -> str:
        if "the end" not in self.names.given:
            self.names.given["the end"] = self.names.fresh("ended")
        return self.names.given["the end"]

    def _to_end(self, state: State) -> tuple[doc.DocTransition, ...]:
        """Return the transition that ends the machine when a state of the wrapped root is done."""
        root = self.machine.states[0]
        guard = None
        if not self.has_root or not self._has_end():
            return ()
        if state.index == 0 and root.kind == "parallel":
            guard = _text(self._final_condition(root) or "", state.span)
        elif not (state.kind == "final" and state.parent == 0):
            return ()
        return (
            doc.DocTransition(
                doc.Trigger.EVENTLESS,
                state.span,
                guard=guard,
                targets=(_text(self._end_name, state.span),),
                ordered=True,
            ),
        )

    def _check_completion(self) -> None:
        states = self.machine.states
        for state in states:
            regions = [states[child] for child in state.children]
            if state.kind != "parallel":
                continue
            for region in regions:
                if region.kind == "final":
                    self._reject("a region is a final state", region.span,
                                 "put the final state into a region with states")  # fmt: skip
                is_nested = region.kind == "parallel" and state.on_done
                if is_nested:
                    self._reject("a region is parallel, and so done when its regions are: a chart "
                                 "reports only the inner state", state.on_done[0].span,
                                 "put the inner one into a region with states")  # fmt: skip
                if state.index == 0 and region.always and self._has_end():
                    self._reject("the machine ends before this eventless transition is tried",
                                 region.always[0].span, "put it on a state inside")  # fmt: skip

    def _check_initial_actions(self) -> None:
        """Report actions of ``initial`` where the library omits them."""
        states = self.machine.states
        histories = {each.parent for each in states if each.kind == "history"}
        defaults = {target for each in states for target in each.history_targets}
        for state in states:
            parent = None if state.parent is None else states[state.parent]
            if not state.initial_actions or parent is None:
                continue
            is_region = parent.kind == "parallel" and any(
                self.machine.is_below(target, parent.index)
                for step in self.machine.steps()
                for target in step.targets or ()
            )
            if is_region or parent.index in histories or state.index in defaults:
                self._reject("the library omits these actions when another region, or a history, "
                             "is the target", state.initial_actions[0].span,
                             "move them into `entry` of the initial state")  # fmt: skip

    # --- states -------------------------------------------------------------------------------

    def _state(self, state: State) -> doc.DocState:
        machine, span = self.machine, state.span
        if state.kind == "history":
            return self._history(state)
        children = [self._state(machine.states[child]) for child in state.children]
        where = self.ids.get(state.index, "root")
        entry = self.content.actions(state.entry, None, f"{where}_entry")
        leave = self.content.actions(state.exit, None, f"{where}_exit")
        for key, _ in state.after:
            if (state.index, key.value) in self.queued:
                name = self._timeout_name(state, key)
                delay = self.content.delay(_string(key), f"{where}_delay")
                entry.append(f"send {name} after {delay} as {name}")
                leave.append(f"cancel {name}")
                self.content.recorder.rewrite("R12", key.span, name)
        for invocation in state.invocations:
            self._invoke(invocation.id, invocation.span, entry, leave)
        transitions = (*self._to_end(state), *self._transitions(state))
        kind = {
            "atomic": doc.Kind.ATOMIC,
            "compound": doc.Kind.COMPOUND,
            "parallel": doc.Kind.PARALLEL,
            "final": doc.Kind.FINAL,
        }[state.kind]
        if kind is doc.Kind.FINAL and self.has_root and state.parent == 0:
            kind = doc.Kind.ATOMIC
        initial = None
        if state.kind == "compound" and state.initial is not None:
            actions = self.content.actions(state.initial_actions, None, f"{where}_initial")
            initial = self._initial(self.ids[state.initial], span, actions)
        if state.index in self.regions:
            name = self.regions[state.index]
            inside = [c for c in children if c.kind in doc.HISTORIES]
            regions = [c for c in children if c.kind not in doc.HISTORIES]
            held = doc.DocState(_text(name, span), doc.Kind.PARALLEL, span, children=tuple(regions))
            children, kind = [held, *inside], doc.Kind.COMPOUND
            initial = self._initial(name, span, [])
        is_top = state.index == 0 and not self.has_root
        return doc.DocState(
            None if is_top else _text(self.ids[state.index], span),
            kind,
            span,
            initial=initial,
            children=tuple(children),
            transitions=transitions,
            entry=self._handlers(entry, span),
            exit=self._handlers(leave, span),
            doc="" if state.index == 0 else state.doc,
        )

    def _history(self, state: State) -> doc.DocState:
        machine, span = self.machine, state.span
        kind = doc.Kind.DEEP_HISTORY if state.is_deep else doc.Kind.SHALLOW_HISTORY
        parent = machine.states[state.parent or 0]
        actions: list[str] = []
        if state.history_targets:
            targets = [self.ids[each] for each in state.history_targets]
        elif parent.kind == "parallel":
            targets = [self.regions[parent.index]]
        else:
            targets = [self._inside(parent)]
            actions = self.content.actions(parent.initial_actions, None, "initial")
        default = doc.DocTransition(
            doc.Trigger.INITIAL,
            span,
            targets=tuple(_text(each, span) for each in targets),
            content=self._block(actions, span),
        )
        return doc.DocState(_text(self.ids[state.index], span), kind, span, initial=default)

    def _invoke(self, name: str, span: Span, entry: list[str], leave: list[str]) -> None:
        for verb, handler in (("start", entry), ("stop", leave)):
            operation = self.content.names.name(f"{verb} actor {name}", f"{verb}_{name}")
            self.content.operations[operation] = ((), None)
            text = "invokes the actor" if verb == "start" else "stops the actor"
            self.content.note_opaque(operation, f"{text} `{name}`", span)
            handler.append(f"{operation}()")

    def _initial(self, target: str, span: Span, actions: list[str]) -> doc.DocTransition:
        return doc.DocTransition(
            doc.Trigger.INITIAL,
            span,
            targets=(_text(target, span),),
            content=self._block(actions, span),
        )

    def _timeout_name(self, state: State, key: Text) -> str:
        return self.content.events.given[f"xstate.after.{key}.{state.id}"]

    # --- transitions --------------------------------------------------------------------------

    def _transitions(self, state: State) -> Iterator[doc.DocTransition]:
        groups: dict[tuple[tuple[int, ...], str], tuple[list[_Event], tuple[Step, ...]]] = {}
        for event in self._events_of.get(state.index, ()):
            steps = self._candidates(state, event)
            if steps:
                same = (tuple(map(id, steps)), self._hidden(state, event))
                groups.setdefault(same, ([], steps))[0].append(event)
        for (_, hidden), (events, steps) in groups.items():
            yield from self._group(state, hidden, events, steps)
        for step in state.always:
            self._check_always(step)
            yield self._transition(step, doc.Trigger.EVENTLESS, (), "")
        for key, steps in state.after:
            if (state.index, key.value) not in self.queued:
                delay = _text(self.content.delay(_string(key), "delay"), key.span)
                for step in steps:
                    yield self._transition(step, doc.Trigger.AFTER, (), "", delay)

    def _group(
        self, state: State, hidden: str, events: list[_Event], steps: tuple[Step, ...]
    ) -> Iterator[doc.DocTransition]:
        if len(events) > 1 or any(_catches(key) for key, _ in state.on):
            self.content.recorder.rewrite("R9", steps[0].span)
        for step in steps:
            yield self._transition(step, doc.Trigger.EVENT, tuple(events), hidden)

    def _transition(
        self,
        step: Step,
        trigger: doc.Trigger,
        events: tuple[_Event, ...],
        hidden: str,
        delay: Text | None = None,
    ) -> doc.DocTransition:
        posted = tuple(event.name for event in events)
        names = posted if events and all(event.is_posted for event in events) else None
        where = f"{self.ids.get(step.source, 'root')}_{events[0].name if events else 'step'}"
        targets, is_internal, before = self._arrow(step)
        guard = self.content.guard(step.guard, names, where, self.ids)
        text = "" if guard is None else guard.text
        if hidden:
            text = f"({text}) and not ({hidden})" if text else f"not ({hidden})"
        actions = self.content.actions(step.actions, names, where)
        return doc.DocTransition(
            trigger,
            step.span,
            events=tuple(_text(self._event_name(each), step.span) for each in events),
            delay=delay,
            guard=_text(text, step.span) if text else None,
            targets=tuple(_text(each, step.span) for each in targets),
            internal=is_internal,
            content=self._block([*actions, *before], step.span),
            ordered=True,
        )

    def _event_name(self, event: _Event) -> str:
        if not event.name.startswith("done.state."):
            return event.name
        index = int(event.name.rpartition(".")[2])
        return f"done.state.{self.regions.get(index) or self.ids[index]}"

    def _check_always(self, step: Step) -> None:
        """Report an eventless transition that the library tries once and a chart for ever."""
        assigns = any("assign" in _source(value.span) for value in step.actions)
        known = self.machine.implementations.get("actions")
        for value in step.actions:
            name = _source(value.span).strip("'\"")
            given = None if known is None else known.get(name)
            assigns = assigns or (given is not None and "assign" in _source(given.span))
        if not self._leaves(step) and not assigns:
            self._reject("the library takes an eventless transition that changes nothing only once "
                         "for each event", step.span, "give it a target, or an assignment that "
                         "makes its guard false")  # fmt: skip

    @cached_property
    def _around_regions(self) -> frozenset[int]:
        """The parallel states, and the states around them."""
        found: set[int] = set()
        for state in self.machine.states:
            if state.kind == "parallel":
                found.update((state.index, *self.machine.ancestors(state.index)))
        return frozenset(found)

    def _hidden(self, state: State, event: _Event) -> str:
        """Return when transitions of regions below a state hide its own, as a condition.

        In a chart, a transition without a target in one region does not hide that of a state
        around the parallel state, because the two leave nothing in common.
        """
        if state.index not in self._around_regions:
            return ""
        inner = [
            self.machine.states[index]
            for index in self._table[event.source]
            if self._is_in_region(index, state.index)
        ]
        own = self._candidates(state, event)
        below = [step for each in inner for step in self._candidates(each, event)]
        if all(map(self._leaves, (*own, *below))) and self._excludes(state, below):
            return ""
        parts = []
        for each in inner:
            guards = [self._guard(step, event) for step in self._candidates(each, event)]
            names = [guard.text for guard in guards if guard is not None]
            is_pure = all(guard is None or guard.is_pure for guard in guards)
            if not is_pure:
                self.content.recorder.differ(
                    "the guards of a region are evaluated a second time for this transition, which "
                    "they hide: they must be pure, as XState requires", own[0].span,
                    self.findings,
                )  # fmt: skip
            test = f"In({self.ids[each.index]})"
            if None not in guards:
                test = f"{test} and ({' or '.join(f'({name})' for name in names)})"
            parts.append(f"({test})")
        if parts:
            self.content.recorder.rewrite("R4", own[0].span)
        return " or ".join(parts)

    def _excludes(self, state: State, below: list[Step]) -> bool:
        """Return whether a chart takes no transition of a state where a region has one.

        A region of a parallel state around both may preempt one that leaves more than the state.
        The library then takes neither, and a chart the outer one.
        """
        around = map(self.machine.states.__getitem__, self.machine.ancestors(state.index))
        if all(each.kind != "parallel" for each in around):
            return True
        domains = (self._domain(step) for step in below)
        return all(each is not None and self._is_within(each, state.index) for each in domains)

    def _guard(self, step: Step, event: _Event) -> Guard | None:
        names = (event.name,) if event.is_posted else None
        where = f"{self.ids.get(step.source, 'root')}_{event.name}"
        return self.content.guard(step.guard, names, where, self.ids)

    def _is_in_region(self, index: int, state: int) -> bool:
        """Return whether a state is below another one, and below a parallel state in between."""
        for ancestor in self.machine.ancestors(index):
            if self.machine.states[ancestor].kind == "parallel" and (
                ancestor == state or self.machine.is_below(ancestor, state)
            ):
                return True
            if ancestor == state:
                return False
        return False

    # --- content ------------------------------------------------------------------------------

    def _handlers(self, statements: list[str], span: Span) -> tuple[Block, ...]:
        block = self._block(statements, span)
        return () if block is None else (block,)

    def _block(self, statements: Iterable[str], span: Span) -> Block | None:
        text = "\n".join(statements)
        return read_statements(_text(text, span), self.findings) if text else None


def _matches(event: str, descriptor: str) -> bool:
    """Return whether a descriptor with a wildcard matches an event."""
    if descriptor == "*":
        return True
    if not descriptor.endswith(".*"):
        return False
    parts = descriptor.split(".")
    given = event.split(".")
    for number, part in enumerate(parts):
        if part == "*":
            return number == len(parts) - 1
        if number >= len(given) or given[number] != part:
            return False
    return True


def _catches(key: Text) -> bool:
    """Return whether a descriptor can match a timeout."""
    return key.value == "*" or key.value.startswith("xstate.")


def _string(key: Text) -> String:
    return String(key)


def _source(span: Span) -> str:
    return span.source.text[span.start : span.end]


def _text(value: str, span: Span) -> Text:
    return Text(value, span, ())
