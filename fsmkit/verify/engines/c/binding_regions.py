"""What the binding of a machine says about its active states: tables of the Plan, read by region.

A region keeps the number of its deepest active state (`fsmkit.plan`). So what is active is a few
numbers, however many states there are; no code is written for each of these.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence

from fsmkit.chart.chart import Chart
from fsmkit.chart.walk import charts_within
from fsmkit.codegen.c.layout import narrowest
from fsmkit.codegen.c.reactions.sharing import number_of
from fsmkit.document.document import Kind
from fsmkit.system.readiness import resting
from fsmkit.verify.engines.c.binding_values import ValueWriter

COLUMNS = 16


def own_configuration_size(chart: Chart) -> int:
    """Return how many bytes tell whether a machine runs, and the numbers of its regions."""
    parallel = (state for state in chart.states if state.kind is Kind.PARALLEL)
    inner = sum(not chart.states[c].is_history for state in parallel for c in state.children)
    return 1 + 2 * (1 + inner)


def configuration_size(chart: Chart) -> int:
    """Return how many bytes tell that, and the same of all machines in its slots."""
    return sum(map(own_configuration_size, charts_within(chart)))


class RegionWriter(ValueWriter):
    """Writes C that looks at the active states."""

    def _regions(self) -> None:
        """Write the tables, and what reads the numbers of regions."""
        out, names, plan = self.out, self.names, self.names.plan
        above = []
        for state in self.chart.states:
            parent = state.parent or 0
            is_inside = plan.region_of[parent] == plan.region_of[state.index]
            above.append(parent if is_inside else 0)
        rests = resting(self.chart, self.machine)
        leaves = [state.index > 0 and state.is_leaf for state in self.chart.states]
        out.line("/* By state: the state around it in its region, 0 for none; whether it is a")
        out.line(" * leaf; whether the machine must go on where it is one. */")
        self._table_of("state_above", above)
        self._table_of("state_leaf", [int(leaf) for leaf in leaves])
        restless = [int(leaf and s not in rests) for s, leaf in enumerate(leaves)]
        self._table_of("state_restless", restless)
        out.line()
        with out.block(f"static uint32_t state_in(const {self.type} *m, uint32_t region)\n{{"):
            out.line("uint32_t number = 0u;")
            with out.block("switch (region) {"):
                for region in plan.regions:
                    member = f"m->{names.regions[region.index]}"
                    text = number_of(member) if region.index in names.shared else member
                    out.lines([f"case {region.index}u:", f"    number = {text};", "    break;"])
            out.line("return number;")
        out.text(f"""

        /* Whether one of a set of states, a bit for each, is active. */
        static bool is_any_active(const {self.type} *m, const unsigned char *states)
        {{
            {self.each_region}
                for (uint32_t at = state_in(m, region); at != 0u; at = state_above[at])
                    if (states[at / 8u] >> at % 8u & 1u)
                        return true;
            return false;
        }}
        """)
        out.line()

    def _table_of(self, name: str, values: Sequence[int]) -> None:
        out = self.out
        with out.block(f"static const {narrowest(max(values))} {name}[{len(values)}] = {{", "};"):
            for at in range(0, len(values), COLUMNS):
                out.line(", ".join(map(str, values[at : at + COLUMNS])) + ",")

    def _set_of(self, name: str, states: Collection[int]) -> None:
        """Write a set of states for ``is_any_active``."""
        bits = bytearray(len(self.chart.states) // 8 + 1)
        for state in states:
            bits[state // 8] |= 1 << state % 8
        self._table_of(name, bits)

    @property
    def each_region(self) -> str:
        """The head of a loop over the regions."""
        return f"for (uint32_t region = 0u; region < {len(self.names.plan.regions)}u; region++)"
