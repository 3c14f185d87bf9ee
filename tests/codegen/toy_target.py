"""A target of some hundred lines, as somebody outside of fsmkit would write it: programs for awk.

It shows what a target needs (docs/explanation/architecture.md): a plug-in, a limit for what it
cannot express, a printer, a harness. It edits nothing of fsmkit.
"""

from __future__ import annotations

import subprocess
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from fsmkit.chart.chart import Chart, Transition
from fsmkit.chart.statements import Send
from fsmkit.codegen.target import Generated
from fsmkit.diagnostics import Findings, FsmkitError
from fsmkit.document.document import Kind, Trigger
from fsmkit.emit import Emitter, plain, printing

DRIVER = r"""
function react(event,  found) {
    print "@" now " > event " event
    found = step(event)
    if (!found) print "unhandled " event
    print "= " active
    return found
}
$1 == "start" {
    now = $2
    print "@" now " > start"
    enter(initial)
    print "= " active
}
$1 == "post" && count == QUEUE { print "full queue" }
$1 == "post" && count < QUEUE { queue[last++ % QUEUE] = $2; count++ }
$1 == "run" {
    for (now = $2; count > 0; count--)
        react(queue[first++ % QUEUE])
}
$1 == "dispatch" { react($2) }
$1 == "ask" { print "answer " (react($2) ? "handled" : "ignored") }
"""


def wrong(chart: Chart) -> Iterator[tuple[str, object]]:
    """Yield what awk is not given here, each with its place."""
    for state in chart.states[1:]:
        if state.kind is not Kind.ATOMIC or state.parent != 0 or state.on_entry or state.on_exit:
            yield f"`{state.id}` is no plain state", state.span
    for transition in (chart.transitions[t] for s in chart.states for t in s.transitions):
        content = [statement for statement in transition.content if not _sends(chart, statement)]
        if transition.trigger is not Trigger.EVENT or transition.guard is not None or content:
            yield "a transition has an event, and sends others at most", transition.span
    if chart.data or chart.operations or chart.inputs or chart.outputs or chart.script:
        yield "there are data or operations", chart.root.span


def _sends(chart: Chart, statement: object) -> bool:
    return (
        isinstance(statement, Send)
        and statement.delay is None
        and {d.value for d in chart.events[statement.event].directions} == {"out"}
        and not chart.events[statement.event].fields
    )


@printing
def program(chart: Chart) -> str:
    """Return the program: a function of states and events, and what every machine has."""
    out = Emitter()
    with out.block("BEGIN {"):
        out.line(f"QUEUE = {chart.capacities.queue}")
        out.line(f'initial = "{_initial(chart)}"')
    with out.block("function enter(state) {"):
        out.line('print "+ " state')
        out.line("active = state")
    with out.block("function step(event) {"):
        for state in chart.states[1:]:
            for number in state.transitions:
                _transition(out, chart, state.id, chart.transitions[number])
        out.line("return 0")
    out.text(DRIVER)
    return out.finish()


def _transition(out: Emitter, chart: Chart, state: str, transition: Transition) -> None:
    events = " || ".join(f'event == "{chart.events[e].name}"' for e in transition.events)
    with out.block(f'if (active == "{state}" && ({events})) {{'):
        if transition.targets:
            out.line('print "- " active')
        out.line(f'print "t {transition.index}"')
        for statement in transition.content:
            assert isinstance(statement, Send)
            out.line(f'print "out {chart.events[statement.event].name}"')
        if transition.targets:
            out.line(f'enter("{chart.states[transition.targets[0]].id}")')
        out.line("return 1")


def _initial(chart: Chart) -> str:
    number = chart.root.initial
    assert number is not None
    return chart.states[chart.transitions[number].targets[0]].id


@dataclass(frozen=True, slots=True)
class Awk:
    """The plug-in."""

    name: str = "awk"
    summary: str = "a program for awk, which reads scripts"
    options: tuple[str, ...] = ()

    def generate(
        self, chart: Chart, findings: Findings, options: Mapping[str, str]
    ) -> Generated | None:
        """Return the program, or None after saying what awk is not given."""
        del options
        for message, at in wrong(chart):
            findings.add("c-limit", message, at, help="choose another target")  # type: ignore[arg-type]
        if findings.has_errors:
            return None
        return Generated(
            {f"{plain(chart.name)}.awk": program(chart)}, {"states": len(chart.states) - 1}
        )

    def harness_run(self, chart: Chart, script_lines: Sequence[str]) -> list[str]:
        """Run a script and return the trace."""
        findings = Findings()
        made = self.generate(chart, findings, {})
        if made is None:
            raise FsmkitError(findings)
        (text,) = made.files.values()
        told = subprocess.run(
            ["awk", text], input="\n".join(script_lines), capture_output=True, text=True, check=True
        )
        return told.stdout.splitlines()


PLUGIN = Awk()
