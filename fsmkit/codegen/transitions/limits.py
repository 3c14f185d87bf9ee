"""Limits of the library: parts of a chart that it cannot express, reported before generating."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import fsmkit.language as lang
from fsmkit.chart import statements as stmt
from fsmkit.chart.analysis.effects import can_fail
from fsmkit.chart.analysis.leaving_ranges import Facts, facts_in_content, leaving, leaving_in
from fsmkit.chart.chart import Chart, State, Transition
from fsmkit.chart.content import values
from fsmkit.codegen.transitions.content import PRINTED
from fsmkit.codegen.transitions.order import Order
from fsmkit.diagnostics import Findings, Span
from fsmkit.document.document import Kind, Trigger
from fsmkit.language.statements.tree import statements
from fsmkit.language.walk import nodes, subexpressions
from fsmkit.plan import Plan, lower

RESERVED = ("add", "_func")
"""Names that nested states cannot have: they are attributes of a `FunctionWrapper`."""


def check(chart: Chart, findings: Findings) -> bool:
    """Return whether the library gives a chart the same meaning; report differences."""
    checker = Checker(chart, findings)
    checker.features()
    if checker.is_fine:  # the other checks need single targets
        checker.moves()
    return checker.is_fine


def reserved(plan: Plan) -> frozenset[str]:
    """Return the library's attributes of a model, whose names a trigger cannot have."""
    top = (*plan.substates[0], *plan.histories[0])
    return frozenset({"state", *(f"is_{plan.chart.states[child].id}" for child in top)})


@dataclass
class Checker:
    """Finds the parts of a chart without an equivalent in the library."""

    chart: Chart
    findings: Findings
    is_fine: bool = True

    @cached_property
    def order(self) -> Order:
        """The order of its steps."""
        return Order(lower(self.chart))

    @property
    def plan(self) -> Plan:
        """The plan of the chart."""
        return self.order.plan

    def _report(self, what: str, at: Span | None, advice: str, *others: tuple[Span, str]) -> None:
        self.is_fine = False
        message = f"`transitions` has {what}"
        self.findings.add("transitions-limit", message, at, secondary=others, help=advice)

    # --- features -----------------------------------------------------------------------------

    def features(self) -> None:
        """Report each single part without an equivalent."""
        for invocation in self.chart.invocations:
            advice = "make it a machine of its own"
            self._report("no invoked machines", invocation.span, advice)
        for event in self.chart.events:
            if event.name in reserved(self.plan):
                advice = "rename the event"
                what = f"an attribute `{event.name}` of its own for each model"
                self._report(what, event.span, advice)
        for state in self.chart.states:
            self._state(state)
        for transition in self.chart.transitions:
            self._transition(transition)
        self._content((self.chart.script,), with_event=False)

    def _state(self, state: State) -> None:
        if state.is_history:
            self._history(state)
        if state.id in RESERVED and self.plan.parents[state.index]:
            self._report("other uses for this name", state.span, "rename the state")
        if state.defer:
            advice = "store in a variable that it occurred, and `raise` it later"
            self._report("no deferred events", state.span, advice)
        if state.done_data:
            advice = "assign it to a variable when the final state is entered"
            self._report("no data of final states", state.span, advice)
        if state.index in self.plan.endings and any(state.on_exit):
            advice = "move it to the entry of the state"
            self._report("no exit from a final state", state.span, advice)
        around = [self.chart.states[each].kind for each in self.plan.chains[state.index][1:]]
        if state.kind is Kind.PARALLEL and Kind.PARALLEL in around:
            advice = "move its regions to the parallel state around it"
            what = "an exception for an unhandled event while regions have regions"
            self._report(what, state.span, advice)
        is_told = f"done.state.{state.id}" in self.chart.event_index
        if state.kind is Kind.PARALLEL and is_told:
            advice = "test the final states of its regions with `In`, in a guard"
            self._report("no event for the end of all regions", state.span, advice)
        self._content((*state.on_entry, *state.on_exit), with_event=False)

    def _history(self, history: State) -> None:
        """Report a history for which the library can enter no enclosing state."""
        assert history.initial is not None  # noqa: S101
        parent = self.plan.parents[history.index]
        if self.chart.states[parent].kind is Kind.PARALLEL or not parent:
            advice = "give each region a history, or name the state to return to"
            self._report("no history of regions, nor of the machine", history.span, advice)
        default = self.chart.transitions[history.initial]
        if any(self.chart.states[target].is_history for target in default.targets):
            advice = "name the initial state"
            self._report("no history as the default of another", default.span, advice)
        if history.kind is Kind.SHALLOW_HISTORY and self._has_deep_initial(parent):
            advice = "give each state between its own `initial`"
            self._report("only children as initial states, below a history", history.span, advice)

    def _has_deep_initial(self, index: int) -> bool:
        """Whether a strict descendant has an initial state that is not its child."""
        inside = (self.chart.states[state] for state in self.plan.descendants(index))
        return any(s.kind is Kind.COMPOUND and self._is_deep(s) for s in inside)

    def _is_deep(self, state: State) -> bool:
        initial = None if state.initial is None else self.chart.transitions[state.initial]
        if initial is None:
            return False
        return any(self.plan.parents[target] != state.index for target in initial.targets)

    def _initial(self, transition: Transition) -> None:
        """Report an initial transition that the library cannot express as a destination."""
        source, at = self.chart.states[transition.source], transition.span
        if transition.content:
            advice = "move it to the entry of the state that is entered"
            self._report("no content of initial transitions", at, advice)
        if source.is_history:
            return
        if any(self.chart.states[target].is_history for target in transition.targets):
            self._report("no history as an initial state", at, "name the initial state")
        elif self._is_deep(source):
            around = self.plan.chains[source.index]
            between = self.order.path(source.index, transition.targets[0])[:-1]
            kinds = (self.chart.states[s].kind for s in (*around, *between))
            if Kind.PARALLEL in kinds:
                advice = "give each state between its own `initial`"
                self._report("only children as initial states of regions", at, advice)

    def _transition(self, transition: Transition) -> None:
        at = transition.span
        if transition.trigger is Trigger.SOMETIMES or transition.least is not None:
            self._report("no spontaneous transitions", at, "give it an event")
        is_initial = transition.trigger is Trigger.INITIAL
        if len(transition.targets) > 1 and not self.chart.states[transition.source].is_history:
            self._report("only one destination", at, "make the other states the initial ones")
        elif is_initial and transition.source:
            self._initial(transition)
        if transition.guard is not None:
            self._expression(transition.guard)
            for found in leaving_in(self.chart, transition.guard):
                self._leaves(found, transition.guard.span)
        fields = self._fields(transition)
        with_event = transition.trigger is Trigger.EVENT
        facts = facts_in_content(self.chart, transition)
        self._content((transition.content,), with_event=with_event, fields=fields, facts=facts)
        if transition.guard is not None:
            self._event(transition.guard, fields, with_event=with_event)

    def _fields(self, transition: Transition) -> frozenset[str]:
        """Return the fields that all events of a transition have at the same position."""
        events = [e for e in transition.events if e in self.order.occurring]
        each = [set(enumerate(f.name for f in self.chart.events[e].fields)) for e in events]
        return frozenset(name for _, name in set.intersection(*each)) if each else frozenset()

    # --- content and expressions --------------------------------------------------------------

    def _content(
        self,
        blocks: tuple[stmt.Block, ...],
        *,
        with_event: bool,
        fields: frozenset[str] = frozenset(),
        facts: Facts = (),
    ) -> None:
        for block in blocks:
            for statement, found in leaving(self.chart, block, facts):
                self._leaves(found, statement.span)
            for statement in statements(block):
                self._statement(statement)
                for value in values(statement):
                    self._expression(value, statement.span)
                    self._event(value, fields, with_event=with_event)
                    self._configuration(value)

    def _statement(self, statement: stmt.Statement) -> None:
        match statement:
            case stmt.Send(delay=delay) if delay is not None and not isinstance(
                lang.fold(delay), lang.Literal
            ):
                advice = "give it a constant delay"
                self._report("no `error.execution`, and this delay can be negative",
                    statement.span, advice)  # fmt: skip
            case stmt.Send(destination=stmt.Destination.SELF, delay=None):
                advice = "`raise` it: the library has one queue"
                self._report("no second queue for what a machine sends itself", statement.span,
                    advice)  # fmt: skip
            case stmt.Send(destination=stmt.Destination.INVOKER | stmt.Destination.INVOKED):
                advice = "send an event that leaves the machine"
                self._report("no invoked machines", statement.span, advice)
            case stmt.Reply():
                advice = "send an event that leaves the machine, or call an operation"
                self._report("no answer but whether a transition was taken", statement.span, advice)
            case stmt.Fail():
                advice = "fix the expression"
                self._report("no `error.execution`", statement.span, advice)
            case stmt.Invoke():
                pass  # said of the invocation
            case stmt.ForEach(array=array, item=item) if (
                isinstance(array, lang.Numbers) or item.storage is lang.Storage.LOCAL
            ):
                advice = "declare the variable of the loop under `data`, and loop over an array"
                self._report("no local variables of loops", statement.span, advice)
            case _ if not isinstance(statement, PRINTED):
                advice = "call an operation of the host"
                self._report(
                    f"no equivalent of `{stmt.word_of(statement)}`", statement.span, advice
                )
            case _:
                if can_fail(_without_bodies(statement)):
                    advice = "test it before: a divisor for zero, an index for its range"
                    self._report("no `error.execution`, and this can fail", statement.span, advice)

    def _expression(self, expr: lang.Expr, within: Span | None = None) -> None:
        at = within or expr.span
        if can_fail(lang.fold(expr)):
            advice = "test it before: a divisor for zero, an index for its range"
            self._report("no `error.execution`, and this can fail", at, advice)
        for part in nodes(lang.fold(expr)):
            if isinstance(part, lang.CallFunction):
                advice = "write what it computes here, or declare an operation"
                self._report("no functions of a chart", at, advice)

    def _leaves(self, conversion: lang.Convert, at: Span) -> None:
        advice = "test it before, use `min` and `max`, a type that wraps, or a machine integer"
        self._report(f"no `error.range`, and this can leave {conversion.type}", at, advice)

    def _event(self, expr: lang.Expr, fields: frozenset[str], *, with_event: bool) -> None:
        for part in subexpressions(expr):
            is_event = isinstance(part, lang.EventField | lang.EventName)
            if isinstance(part, lang.EventType):
                advice = "use different names for raised and for sent events"
                self._report("no types of events", part.span, advice)
            if is_event and not with_event:
                advice = "assign it to a variable in the transition"
                self._report("no event when it is started", part.span, advice)
            elif isinstance(part, lang.EventField) and part.name not in fields:
                advice = "write a transition for each event"
                self._report("its arguments by position, another one for each event", part.span,
                    advice)  # fmt: skip

    def _configuration(self, expr: lang.Expr) -> None:
        for part in subexpressions(expr):
            if isinstance(part, lang.InState):
                advice = "test it in guards, or store it in a variable"
                self._report("another configuration during a step", part.span, advice)

    # --- moves --------------------------------------------------------------------------------

    def moves(self) -> None:
        """Report transitions for which the library would exit or enter other states."""
        for transition in self.chart.transitions:
            if (transition.trigger is not Trigger.INITIAL or not transition.source) and (
                transition.targets
            ):
                self._moves(transition)

    def _moves(self, transition: Transition) -> None:
        domain, target = self.order.domain(transition), self.order.dest(transition)
        assert domain is not None  # noqa: S101  (it has a target)
        states = self.chart.states
        if states[transition.targets[0]].is_history and self._is_around(target, transition.source):
            advice = "name the state to return to as the target"
            self._report("no transition to a history from inside", transition.span, advice)
            return
        first, *rest = self.order.path(domain, target)
        if domain != transition.source and self.plan.is_below(target, transition.source):
            advice = "mark it `type: internal`, or exit through another state"
            self._report("no exit from a state on the way into it", transition.span, advice)
        elif rest and domain == transition.source and transition.source:
            advice = f"let it lead to `{states[first].id}`"
            self._report(
                f"another meaning for this where `{states[first].id}` is active: "
                "it would not be left",
                transition.span,
                advice,
                (states[first].span, "this stays active"),
            )
        elif rest and self._is_around(first, transition.source):
            advice = "let the region that changes have the transition"
            self._report(
                "no transition from one region to another, or out of one and back in",
                transition.span, advice, (states[first].span, "this stays active"),
            )  # fmt: skip
        elif inside := [s for s in (first, *rest)[:-1] if states[s].kind is Kind.PARALLEL]:
            name = states[inside[0]].id
            self._report(
                f"no transition into one region of `{name}` that enters the others too",
                transition.span,
                f"let it lead to `{name}`",
                (states[inside[0]].span, "these regions would not be entered"),
            )

    def _is_around(self, outer: int, inner: int) -> bool:
        return outer == inner or self.plan.is_below(inner, outer)


def _without_bodies(statement: stmt.Statement) -> object:
    """Return the expressions of a statement without those of its bodies."""
    return values(statement) if isinstance(statement, stmt.If | stmt.ForEach) else statement
