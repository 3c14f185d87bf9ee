"""A chart as a program for awk: the functions of its states and transitions, and the runtime."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import assert_never

from fsmkit.chart.chart import Chart, Transition
from fsmkit.document.document import Trigger
from fsmkit.emit import Emitter, printing
from fsmkit.emit.c import quoted
from fsmkit.plan import Branch, Content, Enter, Op, Plan, Restore, lower
from fsmkit.plan.features import payload_of
from fsmkit.plan.operations import (
    Action,
    Arm,
    Disarm,
    Finish,
    Forget,
    IfFinal,
    Kept,
    Leave,
    LeaveBelow,
    LeaveRegion,
    RaiseDone,
    Reaction,
    Record,
    Resume,
    Run,
)
from fsmkit.plan.selection import Defer
from tests.codegen.toy_target.expressions import AwkStatements, number, variable_names

RUNTIME = Path(__file__).parent / "runtime.awk"


@printing
def program(chart: Chart) -> str:
    """Return the program of a chart."""
    out = Emitter()
    ProgramPrinter(lower(chart), out).print()
    return out.finish() + RUNTIME.read_text(encoding="utf-8")


@dataclass(frozen=True, slots=True)
class ProgramPrinter:
    """Prints the parts of a machine that depend on its chart."""

    plan: Plan
    out: Emitter

    @property
    def chart(self) -> Chart:
        """The chart."""
        return self.plan.chart

    def print(self) -> None:
        """Print tables, then a function for each question of the runtime."""
        chart, plan = self.chart, self.plan
        with self.out.block("BEGIN {"):
            self._tables()
        with self._function("reset_data()"):
            for data in (*chart.data, *chart.outputs):
                name = variable_names(chart)[data.name]
                self.out.line(f"{name} = {number(data.init.value)}")
        with self._function("dump()"):
            for data in (*chart.data, *chart.outputs):
                name = variable_names(chart)[data.name]
                self.out.line(f"print {quoted(f'd {data.name} ')} {name}")
        for kind, by_state in (("entry", plan.entering), ("exit", plan.leaving)):
            self._dispatch(
                f"{kind}_actions",
                "state",
                ((s, partial(self._actions, own)) for s, own in enumerate(by_state) if own),
            )
        self._selection()
        triggered = [t for t in chart.transitions if t.trigger is not Trigger.INITIAL]
        self._dispatch(
            "guard",
            "transition",
            ((t.index, partial(self._guard, t)) for t in triggered if t.guard is not None),
            "return 1",
        )
        self._dispatch(
            "content",
            "transition",
            ((t.index, partial(self._content, t)) for t in chart.transitions if t.content),
        )
        reactions = [(t.index, plan.reactions[t.index]) for t in triggered]
        self._dispatch(
            "variant",
            "transition",
            ((t, partial(self._variants, own)) for t, own in reactions if len(own) > 1),
            "return 0",
        )
        variants = [
            (f"{t} {place}", reaction)
            for t, own in reactions
            for place, reaction in enumerate(own)
            if reaction.domain is not None
        ]
        self._dispatch(
            "record_histories",
            "reaction",
            ((key, partial(self._record, r.record)) for key, r in variants if r.record),
        )
        self._dispatch(
            "leave_states",
            "reaction",
            ((key, partial(self._leave, r)) for key, r in variants),
        )
        self._dispatch(
            "enter_states",
            "reaction",
            (
                ("start", self._start),
                *((key, partial(self._enter, r.enter)) for key, r in variants),
            ),
        )

    @contextmanager
    def _function(self, head: str) -> Iterator[None]:
        with self.out.block(f"function {head} {{"):
            yield
        self.out.line()

    def _dispatch(
        self,
        name: str,
        parameter: str,
        cases: Iterable[tuple[int | str, Callable[[], object]]],
        otherwise: str = "",
    ) -> None:
        """Print a function with a case for each value of its parameter, and a last line."""
        with self._function(f"{name}({parameter})"):
            for key, body in cases:
                test = key if isinstance(key, int) else f'"{key}"'
                with self.out.block(f"if ({parameter} == {test}) {{"):
                    body()
                    self.out.line("return")
            if otherwise:
                self.out.line(otherwise)

    def _tables(self) -> None:
        chart, plan = self.chart, self.plan
        self.out.line('CONVFMT = OFMT = "%.0f"')
        for name, value in (
            ("STATES", len(chart.states)),
            ("QUEUE", chart.capacities.queue),
            ("INTERNAL", chart.capacities.internal),
            ("DELAYED", chart.capacities.delayed),
            ("MICROSTEPS", chart.capacities.microsteps),
        ):
            self.out.line(f"{name} = {value}")
        for state in chart.states[1:]:
            if not state.is_history:
                s = state.index
                self.out.line(
                    f"ID[{s}] = {quoted(state.id)}; LEAF[{s}] = {int(state.is_leaf)}; "
                    f"REGION[{s}] = {plan.region_of[s]}; OUTER[{s}] = {plan.region_parents[s]}; "
                    f"LAST[{s}] = {plan.last_below[s]}"
                )
        for event in chart.events:
            self.out.line(f"NAME[{event.index}] = {quoted(event.name)}")
            if event.name.startswith("error.") and not event.directions:
                words = AwkStatements(chart, self.out, {}).occurrence(event.index)
                self.out.line(f"ERROR[{quoted(event.name)}] = {words}")
                self.out.line(f"STOPS[{event.index}] = {int(not chart.lenient)}")
        for transition in chart.transitions:
            t = transition.index
            self.out.line(f"SOURCE[{t}] = {transition.source}")
            if transition.trigger is Trigger.EVERY:
                self.out.line(f"PERIOD[{t}] = {transition.delay}")
            for place, reaction in enumerate(plan.reactions[t]):
                if reaction.domain is not None:
                    self.out.line(f'DOMAIN["{t} {place}"] = {reaction.domain}')
        for timer, waiting in chart.alternatives.items():
            self.out.line(f'WAITING[{timer}] = "{" ".join(str(t.index) for t in waiting)}"')
        for s, end in enumerate(plan.ends):
            self.out.line(f"BELOW[{s}] = {end}")

    # --- selection --------------------------------------------------------------------------------

    def _selection(self) -> None:
        selection = self.plan.selection
        with self._function("candidate(leaf, event)"):
            for event in (None, *(event.index for event in self.chart.events)):
                groups = selection.by_leaf(event)
                if not groups:
                    continue
                with self.out.block(f"if (event == {-1 if event is None else event}) {{"):
                    for leaves, tried in groups:
                        test = " || ".join(f"leaf == {leaf}" for leaf in leaves)
                        with self.out.block(f"if ({test}) {{"):
                            for each in tried:
                                assert not isinstance(each, Defer)
                                text = f"return {each.index}"
                                if each.guard is not None:
                                    text = f"if (holds({each.index})) {text}"
                                self.out.line(text)
            self.out.line("return -1")

    def _of(self, transition: Transition | None = None) -> AwkStatements:
        """Return a printer of content; with a transition, for its event."""
        payload = None if transition is None else payload_of(self.chart, transition)
        return AwkStatements(self.chart, self.out, payload or {})

    def _guard(self, transition: Transition) -> None:
        assert transition.guard is not None
        self.out.line(f"return {self._of(transition).test(transition.guard)}")

    def _content(self, transition: Transition) -> None:
        self._of(transition).block(transition.content)

    def _variants(self, reactions: tuple[Reaction, ...]) -> None:
        for place, reaction in enumerate(reactions):
            tests = [
                f"HISTORY[{c.history}, {c.region}] >= {c.first} "
                f"&& HISTORY[{c.history}, {c.region}] <= {c.last}"
                for c in reaction.conditions
            ]
            self.out.line(f"if ({' && '.join(tests) or 1}) return {place}")

    # --- reactions --------------------------------------------------------------------------------

    def _record(self, record: tuple[Record, ...]) -> None:
        for each in record:
            test = "1" if each.is_sure else f"active({each.state})"
            with self.out.block(f"if ({test}) {{"):
                for kept in self.plan.kept[each.history]:
                    self.out.line(f"HISTORY[{each.history}, {kept.region}] = {_kept(kept)}")

    def _leave(self, reaction: Reaction) -> None:
        plan = self.plan
        for op in reaction.leave:
            match op:
                case Leave(state):
                    self.out.line(f"leave({state})")
                case LeaveRegion(region):
                    top = plan.regions[region].top
                    self.out.line(f"leave_between({top}, {plan.ends[top]})")
                case LeaveBelow(domain):
                    self.out.line(f"leave_between({domain + 1}, {plan.ends[domain]})")
                case _:
                    assert_never(op)

    def _start(self) -> None:
        self._of().block(self.chart.script)
        self._of().block(self.chart.transitions[self.chart.root.initial or 0].content)
        self._enter(self.plan.start)

    def _enter(self, ops: tuple[Op | Resume, ...]) -> None:
        for op in ops:
            match op:
                case Enter(state, defaults):
                    self.out.line(f"enter({state})")
                    for each in defaults:
                        self.out.line(f"take({each})")
                case Content(transition):
                    self.out.line(f"take({transition})")
                case Branch(history, recorded, unrecorded):
                    first = self.plan.recorded_regions[history][0]
                    with self.out.block(f"if (HISTORY[{history}, {first}]) {{"):
                        self._enter(recorded)
                    with self.out.block("else {"):
                        self._enter(unrecorded)
                case Restore():
                    self._enter(self.plan.resumed(op))
                case Resume(history, region, cases):
                    for state, inner in cases:
                        with self.out.block(f"if (HISTORY[{history}, {region}] == {state}) {{"):
                            self._enter(inner)
                case _:
                    assert_never(op)

    # --- actions of states ------------------------------------------------------------------------

    def _actions(self, actions: Iterable[Action]) -> None:
        for action in actions:
            match action:
                case Forget():
                    pass  # read again after the next record only: saved machines alone show it
                case Arm(transition, delay):
                    self.out.line(f'arm("timeout", {transition}, "", {delay}, "")')
                case Disarm(transition):
                    self.out.line(f'disarm("timeout", {transition})')
                case Run(block):
                    self._of().block(block)
                case RaiseDone(event, data):
                    self.out.line(f"enqueue({self._of().done(event, data)})")
                case IfFinal(_, finals, event):
                    regions = (" || ".join(f"active({s})" for s in own) or "0" for own in finals)
                    with self.out.block(f"if ({' && '.join(f'({r})' for r in regions)}) {{"):
                        self._actions([event])
                case Finish():
                    self.out.line("finish()")
                case _:
                    raise NotImplementedError(action)


def _kept(kept: Kept) -> str:
    """Return the record of a region by a history."""
    if kept.states is None:
        return f"NUMBER[{kept.region}]"
    *others, last = kept.states
    return "".join(f"active({state}) ? {state} : " for state in others) + str(last)
