"""Recording histories in C, and testing what they recorded (SCXML 3.10)."""

from __future__ import annotations

from collections.abc import Iterable

from fsmkit.codegen.c.expressions.fragments import ATOM
from fsmkit.codegen.c.ir import Unit
from fsmkit.codegen.c.names import Names
from fsmkit.emit import Emitter
from fsmkit.plan import Within
from fsmkit.plan.exits import recording_domains
from fsmkit.plan.operations import Record


class HistoryPrinter:
    """Prints the recording of histories that have members of their own."""

    def __init__(self, names: Names) -> None:
        """Create a printer with these names."""
        self.names = names
        self.plan = names.plan
        own = {history for history, _ in names.histories}
        self.every = [history for history in self.plan.every_history if history in own]
        """The histories with a member of their own."""

    def is_recorded(self, history: int, region: int, state: int | None = None) -> str:
        """Return the test whether a history recorded a state in a region; None for any."""
        member = f"m->{self.names.recorded(history, region)}"
        return f"{member} != 0u" if state is None else f"{member} == {self.names.number(state)}"

    def within(self, condition: Within) -> str:
        """Return the test of a condition on what a history recorded."""
        history, region = condition.history, condition.region
        inside = self.plan.numbers_within(region, condition.first, condition.last)
        if len(inside) < 2:
            return self.is_recorded(history, region, inside[0] if inside else 0)
        variable = f"m->{self.names.histories[history, region]}"
        first, last = self.names.number(inside[0]), self.names.number(inside[-1])
        return f"{variable} >= {first} && {variable} <= {last}"

    def print_record(self, out: Unit) -> None:
        """Print the function that records histories before all below a domain is exited."""
        if not self.every:
            return
        p = self.names.own
        out.define("record")
        out.line(f"static void {p}_record({p} *m, uint16_t domain)")
        with out.block("{"):
            for history in self.every:
                if domains := recording_domains(self.plan, history):
                    tests = " || ".join(f"domain == {domain + 1}u" for domain in domains)
                    self.record_if(out, history, f"({tests})")
        out.line()

    def record_if(self, out: Emitter, history: int, test: str) -> None:
        """Print the recording of a history if its parent is active and a test holds."""
        active = self.names.in_state("m", self.plan.parents[history]).at(ATOM)
        with out.block(f"if ({test} && {active}) {{ {self.names.note(history)}"):
            self._record(out, history)

    def record_all(self, out: Emitter, records: Iterable[Record]) -> None:
        """Print the recording of histories."""
        for record in records:
            if record.history not in self.every:
                continue
            if record.is_sure:
                self._record(out, record.history)
                continue
            active = self.names.in_state("m", record.state).text
            with out.block(f"if ({active}) {{ {self.names.note(record.history)}"):
                self._record(out, record.history)

    def _record(self, out: Emitter, history: int) -> None:
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
            ctype = names.number_type(part.region)
            out.line(f"{kept} = ({ctype})({text});" if others else f"{kept} = {text};")
