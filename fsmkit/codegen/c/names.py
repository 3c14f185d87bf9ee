"""The C names of everything in a chart."""

from __future__ import annotations

from collections.abc import Callable, Container, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import ClassVar

from fsmkit.chart.analysis.effects import can_stop
from fsmkit.chart.chart import Chart, Operation
from fsmkit.codegen.c.copies import Structs
from fsmkit.codegen.c.expressions.fragments import AND, Fragment
from fsmkit.codegen.c.forms import Form, form_of
from fsmkit.codegen.c.ir import OWN, OWN_UPPER
from fsmkit.codegen.c.mechanisms import Mechanisms, mechanisms_of
from fsmkit.codegen.c.options import Options
from fsmkit.codegen.c.reserved import (
    TO_INVOKE,
)
from fsmkit.diagnostics import Span
from fsmkit.emit.c import comment
from fsmkit.language import FunctionBody
from fsmkit.plan import Plan

NARROW = 255
"""The greatest number in a byte."""
NOTING = frozenset({"failed", "end_block", "holds", "guard_holds", "clamp", "clamp_u", "clamp_f"})
"""Entries of `Names.used` for operators and helpers that read ``failed``."""
NO_STATE = 65535
"""The greatest number in two bytes."""


@dataclass
class Names:
    """The C names of a machine, by index or by name, and how its code refers to them."""

    plan: Plan
    prefix: str
    upper: str
    variables: dict[str, str]
    states: tuple[str, ...]
    events: tuple[str, ...]
    event_names: tuple[str, ...]
    """In lower case, for functions."""
    payloads: tuple[str, ...]
    operations: dict[str, str]
    functions: dict[str, str]
    """The static functions of the chart."""
    records: dict[str, str]
    members: dict[str, tuple[str, ...]]
    """The constants of each enumeration."""
    enumerations: dict[str, str]
    regions: tuple[str, ...]
    histories: dict[tuple[int, int], str]
    """By history and region: the member that holds the record alone."""
    constants: dict[str, str]
    """The macros of whole numbers and durations."""
    timers: dict[int, str]
    """By transition: the constant of its timer."""
    fields: dict[str, str]
    """The fields of records, payloads and operations."""
    symbols: list[str] = field(default_factory=lambda: [""])
    numbers: dict[str, int] = field(default_factory=lambda: {"": 0})
    """Numbers of the interned strings."""
    used: set[str] = field(default_factory=set)
    """Helpers that the printed expressions call."""
    marks: dict[str, int] = field(default_factory=dict)
    """Numbers of the ids of delayed sends, from 1."""
    state_names: tuple[str, ...] = ()
    """In lower case, for functions."""
    path: tuple[str, ...] = ()
    """The ids of the slots in which the machine lies, outermost first."""
    outermost: str = ""
    """The prefix of the machine that a host runs: this one or the one that holds it."""
    slots: tuple[str, ...] = ()
    """By invocation: the member that holds the machine."""
    invoked: tuple[Names, ...] = ()
    """By invocation: the names of the machine."""
    options: Options = field(default_factory=Options)
    shared: dict[int, int] = field(default_factory=dict)
    """By region: the history whose record its byte holds (`codegen.c.sharing`)."""
    structs: Structs | None = None
    """The structs that hold the data of copies of used charts; None without copies."""
    reached: dict[tuple[int, ...], int] = field(default_factory=dict)
    """Numbers of the sets of slots that events are sent to."""
    own: ClassVar[str] = OWN
    """The symbol of the prefix in definitions (`codegen.c.ir`)."""
    own_upper: ClassVar[str] = OWN_UPPER
    """The symbol of the prefix of macros and constants."""

    copy_argument: ClassVar[str] = ""
    """The argument that calls of blocks and guards have after the machine (`small.copy_names`)."""
    copy_parameter: ClassVar[str] = ""
    """The parameter for this argument."""
    varied: ClassVar[Container[int]] = ()
    """States whose names are those of each copy."""

    @property
    def chart(self) -> Chart:
        """The chart."""
        return self.plan.chart

    @cached_property
    def does(self) -> Mechanisms:
        """The mechanisms that the machine needs."""
        is_family = bool(self.slots or self.invoking or self.is_invoked)
        return mechanisms_of(
            self.plan, self.options, is_family=is_family, has_slots=bool(self.slots)
        )

    @cached_property
    def facts(self) -> dict[str, bool]:
        """The facts that conditions of pieces test (`codegen.c.pieces`)."""
        chart, features = self.chart, self.plan.features
        return {
            **self.does.facts,
            "SINGLE": self.plan.is_single,
            "TIMED": features.timeouts or self.does.delays,
            "SAMPLES": features.samples_inputs,
            "HISTORIES": bool(self.histories),
            "PREEMPTS": self.plan.selection.is_general,
            "FAULTY": any(t.guard is not None and can_stop(t.guard) for t in chart.transitions),
            "SHARED_DEFERRAL": any(self.plan.shared_deferral),
            "SLOTS": bool(self.slots),
            "INVOKING": bool(self.invoking),
            "INVOKED": self.is_invoked,
            "TELLS_END": self.is_invoked and chart.done is not None,
            "PLAIN": False,
            "SPECIAL_STEPS": False,
        }

    @property
    def has_timers(self) -> bool:
        """Whether there are timeouts."""
        return self.plan.features.timeouts

    @property
    def running(self) -> str:
        """The test whether the machine runs."""
        return "m->fsm.running" if self.does.running else f"m->{self.regions[0]} != 0u"

    @property
    def stopped(self) -> str:
        """The test whether it does not."""
        return "!m->fsm.running" if self.does.running else f"m->{self.regions[0]} == 0u"

    @property
    def rejects_posts(self) -> str:
        """The test whether no event can be posted: not started yet, ended, or stopped by a fault.

        An operation may post in the middle of a step, when the number of the active state is 0.
        """
        within = self.does.guarded and not self.does.running
        return f"{self.stopped} && !m->fsm.busy" if within else self.stopped

    @property
    def ignores_steps(self) -> str:
        """The test that a step does nothing: it is nested, or the machine has stopped."""
        return f"m->fsm.busy || {self.stopped}" if self.does.guarded else self.stopped

    def hook(self, verb: str) -> str:
        """Return the hook macro that reports entering a state or taking a transition."""
        is_counted = "coverage" in self.options.extras
        return f"FSM_{self.own_upper}_{verb}" if is_counted else f"FSM_HOOK_{verb}"

    @property
    def is_invoked(self) -> bool:
        """Whether the machine lives in a slot of another."""
        return bool(self.path)

    @cached_property
    def invoking(self) -> tuple[int, ...]:
        """The states that invoke something."""
        return tuple(state.index for state in self.chart.states if state.invokes)

    def to_invoke(self, state: int) -> tuple[str, int]:
        """Return the member that holds the bit of a state that invokes something, and the bit."""
        place = self.invoking.index(state)
        return f"m->fsm.{TO_INVOKE}[{place // 8}]", 1 << place % 8

    def slot_set(self, slots: tuple[int, ...]) -> int:
        """Return the number of a set of slots that an event is sent to."""
        return self.reached.setdefault(slots, len(self.reached))

    def symbol(self, text: str) -> int:
        """Return the number of an interned string."""
        number = self.numbers.setdefault(text, len(self.symbols))
        if number == len(self.symbols):
            self.symbols.append(text)
        return number

    def mark(self, name: str | None) -> int:
        """Return the number of the id of a delayed send, 0 for none."""
        return 0 if name is None else self.marks.setdefault(name, len(self.marks) + 1)

    @property
    def can_fail(self) -> bool:
        """Whether something notes that it failed; known when all content is printed."""
        return not self.used.isdisjoint(NOTING) or any(u.startswith("guarded ") for u in self.used)

    def failure(self) -> str:
        """Return the address at which an operator notes that it failed."""
        self.used.add("failed")
        return "&m->fsm.failed"

    def operation(self, name: str) -> Operation:
        """Return the declaration of an operation."""
        return next(o for o in self.chart.operations if o.name == name)

    def constant(self, name: str | None) -> str:
        """Return the macro of a constant of the chart, or "" if it has no macro."""
        return "" if name is None else self.constants.get(name, "")

    def field(self, name: str) -> str:
        """Return the C name of a field of a record or payload."""
        return self.fields[name]

    @cached_property
    def form(self) -> Form:
        """The form of the code."""
        return form_of(self.plan, self.options)

    @cached_property
    def taken_type(self) -> str:
        """The C type of every number by which a transition is taken, plus one.

        A transition has one such number; in tables it may have one for each of its events.
        """
        most = sum(max(1, len(transition.events)) for transition in self.chart.transitions)
        return "uint16_t" if most < NO_STATE else "uint32_t"

    @property
    def region_type(self) -> str:
        """The C type that holds how many regions there are."""
        return "uint8_t" if len(self.plan.regions) <= NARROW else "uint16_t"

    def number_type(self, region: int) -> str:
        """Return the C type of the member that holds the number of a region's active state.

        Functions that read tables handle all regions alike, so all have the widest type there.
        """
        is_one_type = self.options.is_small and not self.plan.is_single
        regions = self.plan.regions if is_one_type else self.plan.regions[region : region + 1]
        most = max(each.states[-1] if each.states else 0 for each in regions)
        return "uint8_t" if most <= NARROW else "uint16_t"

    def number(self, state: int) -> str:
        """Return the constant of a state as a region holds it; nothing is active in the root."""
        return self.states[state] if state else "0u"

    def note(self, state: int) -> str:
        """Return a comment with the id of a state."""
        return self.remark(self.chart.states[state].id)

    def remark(self, text: str) -> str:
        """Return a comment."""
        return f"/* {comment(text)} */"

    def function(self, verb: str, state: int) -> str:
        """Return the name of the function of a state: ``enter``, ``exit`` or ``at``."""
        return f"{self.own}_{verb}_{self.state_names[state]}"

    def event(self, index: int) -> str:
        """Return the number of an event."""
        return self.events[index]

    def event_constant(self, index: int) -> str:
        """Return an event as a constant for hosts; C++ needs the type of the constant."""
        return self.events[index]

    def timer(self, transition: int) -> str:
        """Return the number of the timer of a transition."""
        return self.timers[transition]

    def variable(self, name: str, machine: str) -> str:
        """Return a variable of the chart as an lvalue; ``machine`` is a pointer to the machine."""
        return f"{machine}->{self.variables[name]}"

    def input_number(self, name: str) -> str:
        """Return the number of an input."""
        return f"{[declared.name for declared in self.chart.inputs].index(name)}u"

    def stand_in(self, name: str) -> str:
        """Return the number that a placeholder variable represents (`small.copy_names`)."""
        raise AssertionError(name)

    def marked(self, name: str | None) -> str:
        """Return the number of the id of a delayed send."""
        return f"{self.mark(name)}u"

    def sending(self, event: int, arguments: Sequence[str]) -> str:
        """Return the call by which the host delivers an event."""
        return f"{self.own}_send_{self.event_names[event]}({', '.join(('m', *arguments))})"

    def calling(self, verb: str, operation: str, arguments: Sequence[str], machine: str) -> str:
        """Return the call of an operation; ``verb``: the kind of function that makes the call."""
        name = f"{self.own}_{verb}{self.operations[operation]}"
        return f"{name}({', '.join((machine, *arguments))})"

    def computing(self, function: FunctionBody, arguments: Sequence[str], machine: str) -> str:
        """Return the call of a function of the chart."""
        name = f"{self.own}_{self.functions[function.name]}"
        return f"{name}({', '.join((machine, *arguments))})"

    def of_text(self, text: str, line: Callable[[str], str]) -> list[str]:
        """Return the statement that sends a string of the chart to a trace."""
        return [line(text)]

    def in_state(self, machine: str, state: int) -> Fragment:
        """Return the test whether a state is active."""
        plan = self.plan
        if state == 0:
            test = "fsm.running" if self.does.running else f"{self.regions[0]} != 0u"
            return Fragment(f"{machine}->{test}", "bool", AND)
        variable = f"{machine}->{self.regions[plan.region_of[state]]}"
        text = self._within(variable, state, plan.last_below[state], plan.region_of[state])
        return Fragment(text, "bool", AND)

    def _within(self, variable: str, first: int, last: int, region: int) -> str:
        """Return the test whether a number of a region lies between those of two states."""
        states = self.plan.regions[region].states
        if first == last:
            return f"{variable} == {self.number(first)}"
        if last == states[-1] and region not in self.shared:
            return f"{variable} >= {self.number(first)}"
        if first == states[0]:
            return f"{variable} != 0u && {variable} <= {self.number(last)}"
        return f"{variable} >= {self.number(first)} && {variable} <= {self.number(last)}"

    def recorded(self, history: int, region: int) -> str:
        """Return the member with what a history recorded of a region, 0 for nothing."""
        return self.histories.get((history, region), self.regions[region])

    def place(self, span: Span) -> str:
        """Return a source location for comments: file and line."""
        name = span.source.name.rpartition("/")[2]
        return f"{name}:{span.source.position(span.start)[0]}"
