"""Exiting states in C: a function for each region, which exits its states innermost first."""

from __future__ import annotations

from fsmkit.codegen.c.expressions.cases import case, default
from fsmkit.codegen.c.ir import Unit
from fsmkit.codegen.c.reactions.actions import ActionPrinter
from fsmkit.codegen.c.reactions.histories import HistoryPrinter
from fsmkit.codegen.c.sharing import RECORDED
from fsmkit.emit import Emitter
from fsmkit.emit.c import comment
from fsmkit.plan import Region

Lines = tuple[str, ...]


class ExitPrinter:
    """Prints the functions that exit regions, and the calls of them."""

    def __init__(self, actions: ActionPrinter, histories: HistoryPrinter) -> None:
        """Create a printer that uses these printers."""
        self.names = actions.names
        self.plan = actions.plan
        self._actions = actions
        self._histories = histories
        self._bodies: dict[int, Lines] = {}

    def body(self, state: int) -> Lines:
        """Return the actions of exiting a state."""
        if state not in self._bodies:
            out = Emitter()
            self._actions.exit_actions(out, state)
            self._bodies[state] = out.collected()
        return self._bodies[state]

    def state_call(self, state: int) -> Lines:
        """Return the hook of a state that is exited, and the call of its actions."""
        return (f"FSM_HOOK_EXIT(m, {self.names.states[state]});", *self._body_call(state))

    def region_call(self, region: Region, until: int = 0, keep: str = "false") -> str:
        """Return the call that exits a region down to a state, or all of it."""
        more = f", {keep}" if self.names.does.ends else ""
        return f"{self._name(region)}(m, {self.names.number(until)}{more});"

    def below_call(self, domain: int) -> str:
        """Return the call that exits all active states strictly below a domain."""
        return self.region_call(self.plan.regions[self.plan.region_of[domain]], domain)

    def print_region(self, out: Unit, region: Region) -> None:
        """Print the function that exits the active states of a region, innermost first."""
        if not region.states:
            return
        names, plan = self.names, self.plan
        own, variable = names.own, f"m->{names.regions[region.index]}"
        number, name = names.number_type(region.index), self._name(region)
        keep = ", bool keep" if names.does.ends else ""
        parents = plan.parents[: max(region.states) + 1]
        inside = [p if plan.region_of[p] == region.index else 0 for p in parents]
        out.define(f"{name}_above")
        out.line("/* By state: the state around it in its region; 0 for none. */")
        with out.block(f"static const {number} {name}_above[{len(inside)}] = {{", "};"):
            out.wrapped(names.number(p) for p in inside)
        out.line()
        out.define(name)
        out.line("/* Leave what is active below a state, innermost first. */")
        out.line(f"static void {name}({own} *m, {number} until{keep})")
        with out.block("{"):
            out.line(f"{number} at = {variable};")
            if region.index in names.shared:
                out.line(f"const {number} was = at;")
            if plan.is_single:
                is_kept = "!keep && " if names.does.ends else ""
                for history in self._histories.every:
                    test = f"{is_kept}until < {names.number(plan.parents[history])}"
                    self._histories.record_if(out, history, test)
            with out.block(f"while (at > until && at < {len(inside)}u) {{"):
                self._exit_one(out, region)
                out.line(f"at = {name}_above[at];")
                if names.does.ends:
                    with out.block("if (!keep) {"):
                        out.line(f"{variable} = at;")
                else:
                    out.line(f"{variable} = at;")
            if region.index in names.shared:
                with out.block(f"if (until == 0u{' && !keep' if names.does.ends else ''}) {{"):
                    out.line(self._keep_record(region))
        out.line()

    def _exit_one(self, out: Emitter, region: Region) -> None:
        """Print the exit of the state ``at`` of a region."""
        for state in region.states:
            if self.plan.inner[state]:
                with out.block(f"if (at == {self.names.number(state)}) {{"):
                    for each in reversed(self.plan.inner[state]):
                        out.line(self.region_call(each, 0, "keep"))
        out.line(f"FSM_HOOK_EXIT(m, ({self.names.own}_state)at);")
        calls = [s for s in region.states if self.body(s)]
        if not calls:
            return
        with out.block("switch (at) {"):
            for state in calls:
                with case(out, f"{self.names.number(state)}:"):
                    out.lines(self._body_call(state))
            default(out)

    def _body_call(self, state: int) -> Lines:
        """Return the call of a state's exit actions, or a single line of them itself."""
        lines = self.body(state)
        return lines if len(lines) < 2 else (f"{self.names.function('exit', state)}(m);",)

    def _name(self, region: Region) -> str:
        return f"{self.names.own}_leave_{region.index}"

    def _keep_record(self, region: Region) -> str:
        """Return the statement that keeps the active state of a region that is exited."""
        names = self.names
        note = "recorded by " + names.chart.states[names.shared[region.index]].id
        member = names.regions[region.index]
        return f"m->{member} = (uint8_t)(was | {RECORDED}u); /* {comment(note)} */"
