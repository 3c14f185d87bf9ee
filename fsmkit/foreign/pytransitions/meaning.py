"""From a machine of the library to a Document."""

from __future__ import annotations

from dataclasses import dataclass

from fsmkit.diagnostics import Findings, Span, Text
from fsmkit.document import document as doc
from fsmkit.foreign.pytransitions.callbacks import Placement, place
from fsmkit.foreign.pytransitions.moves import Moves
from fsmkit.foreign.pytransitions.names import Names, called_names, names_of
from fsmkit.foreign.pytransitions.report import report
from fsmkit.foreign.pytransitions.spec import Callbacks, Machine, Path, State, Step, milliseconds
from fsmkit.language.statements.tree import Block, CallOperation


def document_of(machine: Machine, findings: Findings) -> doc.Document | None:
    """Return the document of a machine; None, with findings, if a chart cannot express it."""
    moves = Moves(machine)
    if findings.has_errors or not machine.initial:
        return None
    placement = place(moves)
    if not report(moves, placement, findings):
        return None
    return _Writer(machine, moves, placement, names_of(moves)).document()


@dataclass(frozen=True, slots=True)
class _Writer:
    machine: Machine
    moves: Moves
    placement: Placement
    names: Names

    def document(self) -> doc.Document:
        machine = self.machine
        whole = Span(machine.source, 0, 0)
        initial = self._initial(machine.initial, whole)
        children = tuple(self._state(state) for state in machine.states)
        root = doc.DocState(None, doc.Kind.COMPOUND, whole, initial=initial, children=children)
        conditions = {t.value for s in machine.steps for t in (*s.conditions, *s.unless)}
        operations = [
            name for name in dict.fromkeys(called_names(machine)) if name not in machine.inputs
        ]
        triggers = {step.trigger.value: step.trigger for step in reversed(machine.steps)}
        return doc.Document(
            machine.source,
            _at(self.names.chart, machine.name),
            root,
            inputs=tuple(
                doc.DocData(Text(self.names.callables[name], whole), Text("bool", whole), None)
                for name in sorted(machine.inputs)
                if name in self.names.callables
            ),
            operations=tuple(
                doc.DocOperation(
                    Text(self.names.callables[name], whole),
                    (),
                    Text("bool", whole) if name in conditions else None,
                )
                for name in operations
            ),
            events=tuple(
                doc.DocEvent(_at(self.names.triggers[name], triggers[name]), (), doc.Direction.IN)
                for name in self.names.triggers
            ),
        )

    # --- states -----------------------------------------------------------------------------

    def _state(self, state: State) -> doc.DocState:
        path, span = state.path, state.span
        steps = [step for step in self._steps() if step.source == path]
        children = [self._state(child) for child in state.children]
        initial = None
        if path in self.names.resting:
            alone = Text(self.names.resting[path], span, ())
            children.insert(0, doc.DocState(alone, doc.Kind.ATOMIC, span))
        elif state.initial and not state.is_parallel:
            initial = self._initial(((*path, state.initial[0]),), span)
        on_exit = self.placement.on_exit(state)
        is_final = state.final and not (steps or children or on_exit or state.timeout)
        is_final = is_final and not self.moves.is_parallel(path[:-1])
        kind = (
            doc.Kind.PARALLEL
            if state.is_parallel
            else doc.Kind.FINAL
            if is_final
            else doc.Kind.ATOMIC
        )
        return doc.DocState(
            Text(self.names.states[path], span, ()),
            doc.Kind.COMPOUND if children and kind is doc.Kind.ATOMIC else kind,
            span,
            initial=initial,
            children=tuple(children),
            transitions=(*map(self._transition, steps), *self._timeout(state)),
            entry=self._handlers(self.placement.on_entry(state)),
            exit=self._handlers(on_exit),
            rest=state.final and not is_final,
        )

    def _steps(self) -> list[Step]:
        """Return the steps in the library's order: those of inner descriptions first."""
        return sorted(self.machine.steps, key=lambda step: -len(step.scope))

    def _initial(self, paths: tuple[Path, ...], span: Span) -> doc.DocTransition:
        targets = tuple(Text(self.names.states[path], span, ()) for path in paths)
        return doc.DocTransition(doc.Trigger.INITIAL, span, targets=targets)

    def _timeout(self, state: State) -> tuple[doc.DocTransition, ...]:
        if state.timeout is None:
            return ()
        delay = Text(f"{milliseconds(state.timeout)}ms", state.timeout.span, ())
        content = self._block(state.on_timeout)
        return (doc.DocTransition(doc.Trigger.AFTER, state.span, delay=delay, content=content),)

    # --- transitions --------------------------------------------------------------------------

    def _transition(self, step: Step) -> doc.DocTransition:
        dest = () if step.dest is None else (step.dest,)
        content = self._block(self.placement.content(step))
        return doc.DocTransition(
            doc.Trigger.EVENT,
            step.span,
            events=(_at(self.names.triggers[step.trigger.value], step.trigger),),
            guard=self._guard(step),
            targets=tuple(Text(self.names.states[path], step.span, ()) for path in dest),
            internal=step.dest is not None and self.moves.domain(step) == step.source,
            content=content or None,
            ordered=True,
        )

    def _guard(self, step: Step) -> Text | None:
        parts = [self._value(text) for text in step.conditions]
        parts += [f"not {self._value(text)}" for text in step.unless]
        first = (*step.conditions, *step.unless)[:1]
        return Text(" and ".join(parts), first[0].span, ()) if first else None

    def _value(self, text: Text) -> str:
        name = self.names.callables[text.value]
        return name if text.value in self.machine.inputs else f"{name}()"

    def _handlers(self, callbacks: Callbacks) -> tuple[Block, ...]:
        return (self._block(callbacks),) if callbacks else ()

    def _block(self, callbacks: Callbacks) -> Block:
        return tuple(
            CallOperation(_at(f"{self.names.callables[text.value]}()", text), text.span)
            for text in callbacks
            if text.value not in self.machine.inputs
        )


def _at(value: str, where: Text) -> Text:
    """Return a string with the location of another one."""
    return Text(value, where.span, ())
