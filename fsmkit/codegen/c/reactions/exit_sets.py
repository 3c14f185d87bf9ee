"""Leaving and recording states in C."""

from __future__ import annotations

from collections.abc import Iterable

from fsmkit.chart.analysis.effects import is_plain
from fsmkit.codegen.c.expressions.cases import case, default
from fsmkit.codegen.c.expressions.content import ContentPrinter
from fsmkit.codegen.c.expressions.fragments import ATOM
from fsmkit.codegen.c.ir import Unit
from fsmkit.codegen.c.names import Names
from fsmkit.codegen.c.reactions.actions import ActionPrinter
from fsmkit.codegen.c.reactions.sharing import RECORDED
from fsmkit.emit import Emitter
from fsmkit.emit.c import comment
from fsmkit.plan import Region
from fsmkit.plan.exits import recording_domains
from fsmkit.plan.operations import EndInvoked, Record, Run


class LeavePrinter(ActionPrinter):
    """Prints the functions that leave states, and record them for histories."""

    def __init__(self, names: Names, content: ContentPrinter) -> None:
        """Print with these names."""
        super().__init__(names, content)
        own = {history for history, _ in names.histories}
        self._exits: dict[int, tuple[str, ...]] = {}
        self._histories = [h for h in self.plan.every_history if h in own]
        """Those with a member of their own."""

    def exits(self, state: int) -> tuple[str, ...]:
        """Return what is done when a state is left, beside the hook."""
        if state not in self._exits:
            out = Emitter()
            self.leave_state(out, state)
            self._exits[state] = out.collected()
        return self._exits[state]

    def leave_state(self, out: Emitter, state: int) -> None:
        """Print what is done when a state is left."""
        self.actions(out, self.plan.leaving[state], "exit of " + self.chart.states[state].id)

    def leave_region(self, out: Unit, region: Region) -> None:
        """Print the function that leaves what is active in a region, innermost first."""
        names, plan = self.names, self.plan
        variable = f"m->{names.regions[region.index]}"
        number, above = self._ctype(region), f"{self._leave_name(region)}_above"
        keep = ", bool keep" if names.does.ends else ""
        if not region.states:
            return
        parents = plan.parents[: max(region.states) + 1]
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
            if plan.is_single:
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

    def _record_left(self, out: Emitter) -> None:
        """Print that histories are recorded of what is about to be left."""
        is_kept = "!keep && " if self.names.does.ends else ""
        for history in self._histories:
            parent = self.plan.parents[history]
            active = self.names.in_state("m", parent).at(ATOM)
            test = f"{is_kept}until < {self.names.number(parent)} && {active}"
            with out.block(f"if ({test}) {{ {self.names.note(history)}"):
                self._record_one(out, history)

    def _over_left(self, out: Emitter, region: Region) -> None:
        """Print what is done when the state ``at`` of a region is left."""
        for state in region.states:
            if self.plan.inner[state]:
                with out.block(f"if (at == {self.names.number(state)}) {{"):
                    for each in reversed(self.plan.inner[state]):
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
        """Whether something can read what is active while a state is left."""
        actions = self.plan.leaving[state]
        blocks = [action.block for action in actions if isinstance(action, Run)]
        ends_invoked = any(isinstance(action, EndInvoked) for action in actions)
        return ends_invoked or not all(map(is_plain, blocks))

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
                domains = recording_domains(self.plan, history)
                tests = " || ".join(f"domain == {a + 1}u" for a in domains)
                active = self.names.in_state("m", self.plan.parents[history]).at(ATOM)
                if not domains:
                    continue
                with out.block(f"if (({tests}) && {active}) {{ {self.names.note(history)}"):
                    self._record_one(out, history)
        out.line()

    def record_all(self, out: Emitter, records: Iterable[Record]) -> None:
        """Print that histories are recorded."""
        for record in records:
            if record.history not in self._histories:
                continue
            if record.is_sure:
                self._record_one(out, record.history)
                continue
            active = self.names.in_state("m", record.state).text
            with out.block(f"if ({active}) {{ {self.names.note(record.history)}"):
                self._record_one(out, record.history)

    def _record_one(self, out: Emitter, history: int) -> None:
        names = self.names
        for part in self.plan.kept[history]:
            if (history, part.region) not in names.histories:
                continue
            kept = f"m->{names.histories[history, part.region]}"
            variable = f"m->{names.regions[part.region]}"
            if part.states is None:
                out.line(f"{kept} = {variable};")
                continue
            first, *others = map(names.number, part.states)
            text = first
            for number in others:
                text = f"{variable} >= {number} ? {number} : {text}"
                text = f"({text})" if number != others[-1] else text
            ctype = self._ctype(self.plan.regions[part.region])
            out.line(f"{kept} = ({ctype})({text});" if others else f"{kept} = {text};")
