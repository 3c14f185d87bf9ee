"""Leaving and recording states in C."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence

from fsmkit.chart.analysis.effects import is_plain
from fsmkit.chart.chart import State
from fsmkit.codegen.c.expressions.cases import case, default
from fsmkit.codegen.c.expressions.content import ContentPrinter
from fsmkit.codegen.c.expressions.fragments import ATOM
from fsmkit.codegen.c.ir import Unit
from fsmkit.codegen.c.names import Names
from fsmkit.codegen.c.reactions.sharing import RECORDED
from fsmkit.document.document import Kind
from fsmkit.emit import Emitter
from fsmkit.emit.c import comment
from fsmkit.plan import Plan, Region


class LeavePrinter:
    """Prints the functions that leave states, and record them for histories."""

    def __init__(self, names: Names, content: ContentPrinter) -> None:
        """Print with these names."""
        self.names = names
        self.plan: Plan = names.plan
        self.chart = names.chart
        self.content = content
        self.own = names.own
        own = {history for history, _ in names.histories}
        self._exits: dict[int, tuple[str, ...]] = {}
        self._histories = tuple(self.chart.states[history] for history in sorted(own))
        """Those with a member of their own."""
        self._recorded = [history.index for history in self._histories]
        self._of_parent: dict[int, list[int]] = {}
        for place, history in enumerate(self._histories):
            self._of_parent.setdefault(history.parent or 0, []).append(place)

    def exits(self, state: int) -> tuple[str, ...]:
        """Return what is done when a state is left, beside the hook."""
        if state not in self._exits:
            out = Emitter()
            self.leave_state(out, state)
            self._exits[state] = out.collected()
        return self._exits[state]

    def leave_state(self, out: Emitter, state: int) -> None:
        """Print the timers and the exit handlers of a state."""
        names = self.names
        for transition in self._timed(state):
            out.line(self.disarm(transition))
        what = "exit of " + self.chart.states[state].id
        for block in self.chart.states[state].on_exit:
            self.content.block(out, block, (), what)
        if self.chart.states[state].invokes:
            member, bit = names.to_invoke(state)
            out.line(f"{member} = (uint8_t)({member} & {255 - bit}u);")
        for invocation in self.chart.invocations:
            if invocation.state == state:
                out.line(f"{self.own}_end_{invocation.index}(m);")

    def arm(self, transition: int) -> str:
        """Return the call that arms the timer of a transition."""
        names, timed = self.names, self.chart.transitions[transition]
        delay = names.constant(timed.delay_name) or f"{timed.delay}u"
        return f"{self.own}_arm(m, {names.timer(transition)}, {delay});"

    def disarm(self, transition: int) -> str:
        """Return the call that disarms the timer of a transition."""
        return f"{self.own}_disarm(m, {self.names.timer(transition)});"

    def _timed(self, state: int) -> list[int]:
        return [
            t for t in self.chart.states[state].transitions if self.chart.transitions[t].has_timer
        ]

    def leave_region(self, out: Unit, region: Region) -> None:
        """Print the function that leaves what is active in a region, innermost first."""
        names, plan = self.names, self.plan
        variable = f"m->{names.regions[region.index]}"
        number, above = self._ctype(region), f"{self._leave_name(region)}_above"
        keep = ", bool keep" if names.does.ends else ""
        if not region.states:
            return
        parents = [self.chart.states[s].parent or 0 for s in range(max(region.states) + 1)]
        inside = [p if plan.region_of[p] == region.index else 0 for p in parents]
        out.define(above)
        out.line("/* By state: the state around it in its region; 0 for none. */")
        with out.block(f"static const {number} {above}[{len(inside)}] = {{", "};"):
            out.wrapped(names.number(p) for p in inside)
        out.line()
        name = self._leave_name(region)
        out.define(name)
        out.line("/* Leave what is active below a state, innermost first. */")
        out.line(f"static void {name}({self.own} *m, {number} until{keep})")
        with out.block("{"):
            out.line(f"{number} at = {variable};")
            if region.index in names.shared:
                out.line(f"const {number} was = at;")
            if self._records_in_loop:
                self._record_left(out)
            with out.block(f"while (at > until && at < {len(inside)}u) {{"):
                self._over_left(out, region)
                out.line(f"at = {above}[at];")
                if names.does.ends:
                    with out.block("if (!keep) {"):
                        out.line(f"{variable} = at;")
                else:
                    out.line(f"{variable} = at;")
            if region.index in names.shared:
                with out.block(f"if (until == 0u{' && !keep' if names.does.ends else ''}) {{"):
                    out.line(self._keep_record(region))
        out.line()

    @property
    def _records_in_loop(self) -> bool:
        """Whether the function that leaves states records their histories."""
        return self.plan.is_single

    def _record_left(self, out: Emitter) -> None:
        """Print that histories are recorded of what is about to be left."""
        is_kept = "!keep && " if self.names.does.ends else ""
        for history in self._histories:
            parent = history.parent or 0
            active = self.names.in_state("m", parent).at(ATOM)
            test = f"{is_kept}until < {self.names.number(parent)} && {active}"
            with out.block(f"if ({test}) {{ {self.names.note(history.index)}"):
                self._record_one(out, history.index, parent)

    def _over_left(self, out: Emitter, region: Region) -> None:
        """Print what is done when the state ``at`` of a region is left."""
        inner = {s: self._inner(s) for s in region.states if self._inner(s)}
        for state, regions in inner.items():
            with out.block(f"if (at == {self.names.number(state)}) {{"):
                for each in reversed(regions):
                    out.line(self._leave_call(each, 0, "keep"))
        out.line(f"FSM_HOOK_EXIT(m, ({self.own}_state)at);")
        calls = [s for s in region.states if self.exits(s)]
        if not calls:
            return
        with out.block("switch (at) {"):
            for state in calls:
                with case(out, f"{self.names.number(state)}:"):
                    out.lines(self._exit_lines(state))
            default(out)

    def _inner(self, state: int) -> list[Region]:
        return self.plan.inner[state]

    def _leave_name(self, region: Region) -> str:
        return f"{self.own}_leave_{region.index}"

    def _ctype(self, region: Region) -> str:
        return self.names.number_type(region.index)

    def leave_all(self, region: Region) -> str:
        """Return the call that leaves all of a region of a parallel state."""
        return self._leave_call(region, 0)

    def _leave_call(self, region: Region, until: int, keep: str = "false") -> str:
        more = f", {keep}" if self.names.does.ends else ""
        return f"{self._leave_name(region)}(m, {self.names.number(until)}{more});"

    def _keep_record(self, region: Region) -> str:
        """Return the statement by which a region that is left keeps what was active."""
        note = "recorded by " + self.chart.states[self.names.shared[region.index]].id
        member = self.names.regions[region.index]
        return f"m->{member} = (uint8_t)(was | {RECORDED}u); /* {comment(note)} */"

    def exit_call(self, state: int) -> list[str]:
        """Return the hook of a state that is left, and the call of what is done then."""
        hook = f"FSM_HOOK_EXIT(m, {self.names.states[state]});"
        return [hook, *self._exit_lines(state)]

    def _exit_lines(self, state: int) -> tuple[str, ...]:
        """Return the call of what is done when a state is left, or that where it is little."""
        lines = self.exits(state)
        return lines if len(lines) < 2 else (f"{self.names.function('exit', state)}(m);",)

    def is_seen(self, state: int) -> bool:
        """Whether it can be told what is active while a state is left."""
        return not all(map(is_plain, self.chart.states[state].on_exit)) or any(
            invocation.state == state for invocation in self.chart.invocations
        )

    def set_active(self, state: int) -> str:
        """Return the statement that makes a state the deepest active one of its region."""
        region = self.plan.region_of[state]
        return f"m->{self.names.regions[region]} = {self.names.number(state)};"

    def leave_below(self, domain: int) -> str:
        """Return the call that leaves all states strictly below a domain."""
        region = self.plan.regions[self.plan.region_of[domain]]
        return self._leave_call(region, domain)

    def leave_machine(self) -> str:
        """Return the call that leaves everything, but lets the regions tell where it was."""
        return self._leave_call(self.plan.regions[0], 0, "true")

    def record(self, out: Unit) -> None:
        """Print the function that records the histories of the states about to be left."""
        if not self._histories:
            return
        out.define("record")
        out.line(f"static void {self.own}_record({self.own} *m, uint16_t domain)")
        with out.block("{"):
            for history in self._histories:
                parent = history.parent
                assert parent is not None  # noqa: S101
                above = [a for a in self.chart.ancestors(parent) if self._can_be_domain(a)]
                tests = " || ".join(f"domain == {a + 1}u" for a in above)
                active = self.names.in_state("m", parent).at(ATOM)
                if not above:
                    continue
                with out.block(f"if (({tests}) && {active}) {{ {self.names.note(history.index)}"):
                    self._record_one(out, history.index, parent)
        out.line()

    def record_below(
        self, out: Emitter, domain: int, source: int, path: Sequence[int] | None
    ) -> None:
        """Print that the histories of what is active below a domain are recorded.

        ``source``: a state that is active; ``path``: all that is active below the domain in its
        region, if that is known.
        """
        if path is None and self._records_in_loop:
            return
        for history in self._reaching(source):
            parent = history.parent
            assert parent is not None  # noqa: S101
            if not self.chart.is_descendant(parent, domain):
                continue
            if parent in (path or ()) or parent in (source, *self.chart.ancestors(source)):
                self._record_one(out, history.index, parent)
            elif path is None or self.plan.region_of[parent] != self.plan.region_of[domain]:
                active = self.names.in_state("m", parent).text
                with out.block(f"if ({active}) {{ {self.names.note(history.index)}"):
                    self._record_one(out, history.index, parent)

    def _reaching(self, source: int) -> list[State]:
        """Return the histories, in order, of what may be active while a state is.

        Those of its region are its own, and those of what lies around it and in it.
        """
        around, region_of = {source, *self.chart.ancestors(source)}, self.plan.region_of
        first = bisect_right(self._recorded, source)
        last = bisect_right(self._recorded, self.chart.states[source].last_descendant)
        if len(self.plan.regions) > 1:
            region = region_of[source]
            return [
                history
                for at, history in enumerate(self._histories)
                if first <= at < last
                or history.parent in around
                or region_of[history.parent or 0] != region
            ]
        own = (n for s in around for n in self._of_parent.get(s, ()))
        return [self._histories[n] for n in sorted({*own, *range(first, last)})]

    def _can_be_domain(self, state: int) -> bool:
        return state == 0 or self.chart.states[state].kind is Kind.COMPOUND

    def _record_one(self, out: Emitter, history: int, parent: int) -> None:
        names, plan = self.names, self.plan
        is_deep = self.chart.states[history].kind is Kind.DEEP_HISTORY
        for region in plan.recorded_regions[history]:
            if (history, region) not in names.histories:
                continue
            kept = f"m->{names.histories[history, region]}"
            variable = f"m->{names.regions[region]}"
            if is_deep:
                out.line(f"{kept} = {variable};")
            elif self.chart.states[parent].kind is Kind.PARALLEL:
                top = self.names.number(plan.regions[region].top)
                out.line(f"{kept} = {top};")
            else:
                children = [
                    c
                    for c in self.chart.states[parent].children
                    if not self.chart.states[c].is_history
                ]
                text = names.number(children[0])
                for child in children[1:]:
                    number = names.number(child)
                    text = f"{variable} >= {number} ? {number} : {text}"
                    text = f"({text})" if child != children[-1] else text
                ctype = self._ctype(plan.regions[region])
                out.line(f"{kept} = ({ctype})({text});")
