"""From a QM model to a document.

A state of QP passes an event on to its parent if it has no transition for it, or no guard of its
choices is true. A transition does its action, leaves states, enters states, and takes initial
transitions. It never leaves a state that contains its source or its target. See the QP/C manual,
"State Machines", and M. Samek, "Practical UML Statecharts in C/C++", second edition, chapter 2.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field

from fsmkit.diagnostics import Findings, Source, Span, Text
from fsmkit.document.document import (
    Direction,
    DocData,
    DocEvent,
    DocState,
    DocTransition,
    Document,
    Kind,
    Trigger,
)
from fsmkit.emit.identifiers import Namer
from fsmkit.foreign.content import Content, Operations, uses
from fsmkit.foreign.imports import Import, Recorder, counts, reject
from fsmkit.foreign.qm.framework import Framework, Periodic, framework_of, unreadable
from fsmkit.foreign.rewriting.actions_first import actions_first
from fsmkit.foreign.rewriting.local_transitions import local_transitions
from fsmkit.foreign.rewriting.resting_composites import resting_composites
from fsmkit.foreign.rewriting.tree import initial_to
from fsmkit.foreign.words import RESERVED
from fsmkit.language.statements.tree import Block, DocSend, Raise
from fsmkit.scxml.nodes import Element, decode, read_nodes

__all__ = ["decode", "import_machine", "machines"]

TYPES = {
    **{f"{sign}int{bits}_t": f"{sign}int{bits}" for sign in ("", "u") for bits in (8, 16, 32, 64)},
    "int": "int32",
    "unsigned": "uint32",
    "bool": "bool",
    "float": "float32",
    "double": "float64",
}
"""Types of C whose width is known, with those of charts."""
UNCOUNTED = ("entry", "exit", "documentation")
"""Children of a state that have no number in the path of a target."""
HISTORIES = {"shallow": Kind.SHALLOW_HISTORY, "deep": Kind.DEEP_HISTORY}


def machines(source: Source, findings: Findings) -> tuple[str, ...]:
    """Return the names of the classes that have a state machine."""
    root = read_nodes(source, findings)
    return () if root is None else tuple(name_of(one).value for one in _classes(root, findings))


def import_machine(source: Source, machine: str, findings: Findings) -> Import | None:
    """Return the machine of a class; None if it cannot be read."""
    root = read_nodes(source, findings)
    if root is None:
        return None
    found = next((one for one in _classes(root, findings) if name_of(one).value == machine), None)
    if found is None:
        return None
    framework = framework_of(root, found)
    variables = _data(found)
    while True:
        own, recorder = Findings(), Recorder()
        reader = _Machine(found, framework, variables, own, recorder)
        document = reader.document()
        used = [
            name
            for name in variables
            if any(uses(reader.operations.opaque, f"{own}{name}") for own in framework.calls.selves)
        ]
        if not used:
            break
        variables = {name: data for name, data in variables.items() if name not in used}
    findings.extend(own)
    if document is None:
        return None
    for one in reader.operations.opaque:
        if (what := unreadable(one.text.value, framework)) is not None:
            reject(
                findings,
                f"{what} in a form that is not read",
                one.text,
                "write it as a statement of its own, as the documentation of the import shows",
            )
    read = counts(document)
    document = resting_composites(document, recorder)
    document = local_transitions(actions_first(document, recorder), recorder)
    return recorder.imported(machine, document, read, reader.operations.opaque)


def name_of(element: Element) -> Text:
    """Return the name of an element; a class or state without one is called after its tag."""
    found = element.get("name")
    return found if found is not None else Text(element.name, element.span, ())


def _classes(root: Element, findings: Findings) -> list[Element]:
    if root.name != "model":
        findings.add(
            "foreign-syntax",
            f"`<{root.name}>` is not a model of QM",
            root.span,
            help="save the model with QM 5 or newer",
        )
        return []
    return [one for one in _below(root, "class") if _child(one, "statechart") is not None]


def _below(element: Element, name: str) -> Iterable[Element]:
    for child in element.children:
        if child.name == name:
            yield child
        else:
            yield from _below(child, name)


def _child(element: Element, name: str) -> Element | None:
    return next((child for child in element.children if child.name == name), None)


def _children(element: Element, name: str) -> list[Element]:
    return [child for child in element.children if child.name == name]


def _content(element: Element, name: str) -> Text | None:
    found = _child(element, name)
    return None if found is None or not found.text.value.strip() else found.text.strip()


def _data(machine: Element) -> dict[str, DocData]:
    """Return the attributes of types with a known width, by name; C initializes them with zeros."""
    namer = Namer(RESERVED)
    found = {}
    for attribute in _children(machine, "attribute"):
        written, name = attribute.get("type"), name_of(attribute)
        type_ = None if written is None else TYPES.get(written.value.strip())
        if type_ is not None and written is not None and name.value.isidentifier():
            zero = "false" if type_ == "bool" else "0.0" if type_.startswith("float") else "0"
            named = name.with_value(namer.name(name.value, "_value"))
            found[name.value] = DocData(named, written.with_value(type_), written.with_value(zero))
    return found


@dataclass
class _Machine:
    """Reads one class."""

    element: Element
    framework: Framework
    data: dict[str, DocData]
    findings: Findings
    recorder: Recorder
    operations: Operations = field(default_factory=Operations)
    names: dict[int, Text] = field(default_factory=dict)
    """The name of each state, by the offset of its element."""
    parents: dict[int, Element] = field(default_factory=dict)
    events: dict[str, Text] = field(default_factory=dict)
    """The names of events, by signal without ``_SIG``."""
    internal: list[Text] = field(default_factory=list)
    """Events that divide a transition."""
    event_namer: Namer = field(default_factory=lambda: Namer(RESERVED))

    def document(self) -> Document | None:
        """Return the document before all rewritings."""
        chart = _child(self.element, "statechart")
        if chart is None:
            return None
        self._note(chart, Namer(RESERVED))
        start = _child(chart, "initial")
        armed = self._armed_for_ever(start)
        children = tuple(map(self._state, _children(chart, "state")))
        initial = None if start is None else self._initial(start, armed)
        if initial is None:
            self.findings.add(
                "foreign-syntax",
                f"the state machine `{name_of(self.element)}` has no initial transition",
                chart.span,
                help="draw one",
            )
            return None
        if armed:
            children, initial = self._wrapped(armed, children, initial)
        name = name_of(self.element)
        events = (
            *(DocEvent(event, (), Direction.IN) for event in self.events.values()),
            *(DocEvent(event, (), Direction.INTERNAL) for event in self.internal),
        )
        return Document(
            self.element.span.source,
            name.with_value(Namer(RESERVED).name(name.value, "_machine")),
            DocState(None, Kind.COMPOUND, chart.span, initial=initial, children=children),
            data=tuple(self.data.values()),
            operations=self.operations.declarations(),
            events=events,
        )

    # --- states -----------------------------------------------------------------------------------

    def _note(self, outer: Element, namer: Namer) -> None:
        """Record the names and parents of all states below an element."""
        for child in outer.children:
            self.parents[child.span.start] = outer
            if child.name in ("state", "history"):
                wanted = name_of(child).value if child.name == "state" else "history"
                if child.name == "history" and outer.name == "state":
                    wanted = f"{name_of(outer)}_history"
                self.names[child.span.start] = name_of(child).with_value(
                    namer.name(wanted, "_state")
                )
            self._note(child, namer)

    def _state(self, element: Element) -> DocState:
        for child in element.children:
            if child.name not in KNOWN:
                reject(self.findings, f"`<{child.name}>` is not read", child.span,
                       "replace it by states, transitions and choices")  # fmt: skip
        entry, exit_ = _content(element, "entry"), _content(element, "exit")
        armed = self.framework.periodic_of(entry, exit_)
        inner = [self._state(child) for child in _children(element, "state")]
        histories = [self._history(child) for child in _children(element, "history")]
        start = _child(element, "initial")
        moves = [part for tran in _children(element, "tran") for part in self._moves(tran)]
        children = (*inner, *histories)
        return DocState(
            self.names[element.span.start],
            Kind.COMPOUND if children else Kind.ATOMIC,
            element.span,
            initial=None if start is None else self._initial(start),
            children=children,
            transitions=(*moves, *(self._every(one) for one in armed)),
            entry=self._handler(entry, armed),
            exit=self._handler(exit_, armed),
        )

    def _history(self, element: Element) -> DocState:
        kind = element.get("type")
        found = HISTORIES.get("" if kind is None else kind.value)
        if found is None:
            reject(self.findings, "this history is neither shallow nor deep", element.span,
                   "write `type=\"shallow\"` or `type=\"deep\"`")  # fmt: skip
        return DocState(
            self.names[element.span.start],
            found or Kind.SHALLOW_HISTORY,
            element.span,
            initial=self._initial(element),
        )

    def _initial(self, element: Element, armed: tuple[Periodic, ...] = ()) -> DocTransition | None:
        target = self._target(element)
        if target is None:
            if element.get("target") is None:
                self.findings.add("foreign-syntax", "this initial transition has no target",
                                  element.span, help="connect it with a state")  # fmt: skip
            return None
        text = _content(element, "action")
        return initial_to(target, content=self._block(text, armed) or None)

    def _armed_for_ever(self, start: Element | None) -> tuple[Periodic, ...]:
        text = None if start is None else _content(start, "action")
        return self.framework.periodic_for_ever(text)

    def _wrapped(
        self, armed: tuple[Periodic, ...], children: tuple[DocState, ...], initial: DocTransition
    ) -> tuple[tuple[DocState, ...], DocTransition]:
        """Return one state around all, which posts the signals of periodic time events."""
        at = armed[0].at
        taken = {name.value for name in self.names.values()}
        name = at.with_value(Namer({*RESERVED, *taken}).name("active", "_state"))
        outer = DocState(
            name,
            Kind.COMPOUND,
            at.span,
            initial=initial,
            children=children,
            transitions=tuple(map(self._every, armed)),
        )
        return (outer,), initial_to(name)

    def _every(self, armed: Periodic) -> DocTransition:
        """Return the transition that posts the signal of a periodic time event."""
        event = self._event(armed.at.with_value(armed.signal))
        if armed.period is None:
            reject(
                self.findings,
                f"the period of `{armed.name}` is a number of ticks, whose length is unknown",
                armed.ticks,
                "write it as a part of `BSP_TICKS_PER_SEC`, such as `BSP_TICKS_PER_SEC/10U`",
            )
        send = DocSend(armed.at.span, event=event)
        return DocTransition(
            Trigger.EVERY,
            armed.at.span,
            delay=armed.period or armed.at.with_value("1s"),
            content=(send,),
        )

    # --- transitions ------------------------------------------------------------------------------

    def _moves(self, tran: Element) -> list[DocTransition]:
        """Return the transitions of a ``tran``, one for each choice, or itself."""
        triggers = tran.get("trig")
        names = [] if triggers is None else [part.strip() for part in _parts(triggers)]
        events = tuple(self._event(name) for name in names if name.value)
        if not events:
            reject(self.findings, "this transition has no trigger", tran.span, "name a signal")
            return []
        action = _content(tran, "action")
        choices = _children(tran, "choice")
        if not choices:
            return [self._move(tran, events, None, self._block(action, ()), tran.span)]
        found: list[DocTransition] = []
        content = self._block(action, ())
        if content:
            event = events[0].with_value(self.event_namer.name(f"{events[0]}_c"))
            found.append(self._divided(tran, events, event, content, choices))
            events = (event,)
        guards = [_content(choice, "guard") for choice in choices]
        ordered = sorted(zip(choices, guards, strict=True), key=lambda pair: _is_else(pair[1]))
        for choice, guard in ordered:
            text = None if guard is None or _is_else(guard) else guard
            block = self._block(_content(choice, "action"), ())
            found.append(self._move(choice, events, text, block, choice.span))
        return found

    def _divided(
        self,
        tran: Element,
        events: tuple[Text, ...],
        event: Text,
        content: Block,
        choices: list[Element],
    ) -> DocTransition:
        """Return the transition whose action precedes its choices, and then raises an event."""
        is_complete = any(_is_else(_content(choice, "guard")) for choice in choices)
        if not is_complete and self._has_outer_transition(tran):
            reject(
                self.findings,
                "this transition has an action before its choices, and may still pass the event on",
                tran.span,
                "add a choice `else`, or move the action into the choices",
            )
        self.recorder.rewrite("R3", tran.span, event.value)
        self.internal.append(event)
        raised = (*content, Raise(event, (), event.span))
        return DocTransition(Trigger.EVENT, tran.span, events=events, content=raised)

    def _has_outer_transition(self, tran: Element) -> bool:
        """Return whether an outer state has a transition for a trigger of this one."""
        wanted = {part.value.strip() for part in _parts(tran.get("trig") or tran.text)}
        outer = self.parents.get(self.parents[tran.span.start].span.start)
        while outer is not None:
            for other in _children(outer, "tran"):
                if wanted & {part.value.strip() for part in _parts(other.get("trig") or tran.text)}:
                    return True
            outer = self.parents.get(outer.span.start)
        return False

    def _move(
        self,
        element: Element,
        events: tuple[Text, ...],
        guard: Text | None,
        content: Block,
        span: Span,
    ) -> DocTransition:
        target = self._target(element)
        if target is not None and self._recalls_itself(element):
            reject(
                self.findings,
                f"this transition may leave the state of the history `{target}`",
                span,
                "QP then uses the older record, a chart the newer one; target a state instead",
            )
        return DocTransition(
            Trigger.EVENT,
            span,
            events=events,
            guard=None if guard is None else self._reader(()).guard(guard),
            targets=() if target is None else (target,),
            content=content or None,
        )

    def _recalls_itself(self, element: Element) -> bool:
        """Return whether the target is the history of a state that may be active before."""
        goal = self._at(element)
        if goal is None or goal.name != "history":
            return False
        owner = self._around(goal)[1:]
        source = [one for one in self._around(element)[1:] if one.name != "tran"]
        return owner[0].span.start in {one.span.start for one in source} or (
            source[0].span.start in {one.span.start for one in owner}
        )

    def _around(self, element: Element) -> list[Element]:
        """Return an element and those around it, the innermost first."""
        found = [element]
        while (outer := self.parents.get(found[-1].span.start)) is not None:
            found.append(outer)
        return found

    def _target(self, element: Element) -> Text | None:
        """Return the name of the target; None, with a finding, if its path names no state.

        None, too, for an element without a target.
        """
        path = element.get("target")
        if path is None:
            return None
        goal = self._at(element)
        found = None if goal is None else self.names.get(goal.span.start)
        if found is None:
            self.findings.add(
                "foreign-syntax",
                f"the target `{path}` names no state",
                path,
                help="open the model in QM, and connect the transition again",
            )
            return None
        return path.with_value(found.value)

    def _at(self, element: Element) -> Element | None:
        """Return the element at the path of a target: ``..`` and numbers of children."""
        path = element.get("target")
        at: Element | None = element if path is not None else None
        for step in () if path is None else path.value.split("/"):
            if at is None:
                break
            if step == "..":
                at = self.parents.get(at.span.start)
            else:
                counted = [child for child in at.children if child.name not in UNCOUNTED]
                is_number = step.isascii() and step.isdigit() and len(step) < 6
                number = int(step) if is_number else -1
                at = counted[number] if 0 <= number < len(counted) else None
        return at

    def _event(self, signal: Text) -> Text:
        name = signal.value
        if name not in self.events:
            self.events[name] = signal.with_value(self.event_namer.name(name, "_event"))
        return signal.with_value(self.events[name].value)

    # --- content ----------------------------------------------------------------------------------

    def _handler(self, text: Text | None, armed: tuple[Periodic, ...]) -> tuple[Block, ...]:
        block = self._block(text, armed)
        return (block,) if block else ()

    def _block(self, text: Text | None, armed: tuple[Periodic, ...]) -> Block:
        """Return content; ``armed`` are the time events that a transition of the state replaces."""
        if text is None:
            return ()
        start = self.framework.first_local(text.value)
        first = self._reader(armed).block(text.part(0, start)) if start else ()
        rest = text.part(start, len(text.value)).strip()
        return (*first, *(self.operations.action(rest) if rest.value else ()))

    def _reader(self, armed: tuple[Periodic, ...]) -> Content:
        variables = {
            f"{own}{name}": data.name.value
            for own in self.framework.calls.selves
            for name, data in self.data.items()
        }
        numbers = frozenset(
            f"{own}{name}"
            for own in self.framework.calls.selves
            for name, data in self.data.items()
            if str(data.type) != "bool"
        )

        def special(piece: Text) -> Block | None:
            return self.framework.statement(piece, armed, self._event, self.operations)

        return Content(self.operations, variables, special, numbers, variables.keys() - numbers)


KNOWN = frozenset(
    {"entry", "exit", "documentation", "initial", "tran", "history", "state", "state_glyph"}
)
"""The children of a state that are read, or have no meaning."""


def _is_else(guard: Text | None) -> bool:
    return guard is None or guard.value.strip() == "else"


def _parts(text: Text) -> list[Text]:
    found, start = [], 0
    for part in text.value.split(","):
        found.append(text.part(start, start + len(part)))
        start += len(part) + 1
    return found
