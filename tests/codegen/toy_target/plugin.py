"""The plug-in: a target for awk, its limits, and a harness for the differential test."""

from __future__ import annotations

import subprocess
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import fsmkit.language as lang
from fsmkit.chart import statements as stmt
from fsmkit.chart.analysis.effects import reads_event
from fsmkit.chart.analysis.ranges import raw_range, within
from fsmkit.chart.chart import Chart
from fsmkit.chart.walk import own_nodes
from fsmkit.codegen.target import Generated
from fsmkit.diagnostics import Findings, Span
from fsmkit.emit import plain
from fsmkit.plan.environment_only import report_environment_only
from fsmkit.plan.features import payload_of
from fsmkit.runtime.script import read_line, script_texts, wrong_line
from tests.codegen.toy_target.program import program

RULE = "target-limit"
SAFE = (-(2**53), 2**53)
"""The integers that awk, which computes with binary64, has exactly."""
DESTINATIONS = (stmt.Destination.SELF, stmt.Destination.INTERNAL, stmt.Destination.PORT)


def limits(chart: Chart) -> Iterator[tuple[str, Span]]:
    """Yield the features that this target cannot express, each with its location."""
    root = chart.root.span
    if chart.operations or chart.inputs or chart.functions or chart.invocations:
        yield "a chart with operations, inputs, functions or invoked charts", root
    for state in chart.states:
        if state.defer:
            yield f"the deferral of events in `{state.id}`", state.span
    for event in chart.events:
        if event.reply is not None or not all(_is_number(part.type) for part in event.fields):
            yield f"the reply or a field of `{event.name}`", event.span or root
    for data in (*chart.data, *chart.outputs):
        if not _is_number(data.type):
            yield f"the type of `{data.name}`", data.span
    for transition in chart.transitions:
        own = transition.guard, transition.content
        if reads_event(own) and payload_of(chart, transition) is None:
            yield "a field of one of several events", transition.span
    if reads_event((chart.states, chart.script)):
        yield "a field of an event outside of the transitions on that event", root
    for node in own_nodes(chart):
        if message := _limit_of(node):
            yield message, getattr(node, "span", root)


def _is_number(type_: lang.Type) -> bool:
    if isinstance(type_, lang.IntType):
        is_exact = within((type_.lo, type_.hi), SAFE)
        return is_exact and type_.overflow is not lang.Overflow.FAULT
    return isinstance(type_, lang.BoolType | lang.EnumType | lang.DurationType)


def _limit_of(node: object) -> str | None:
    """Return the name of a node that awk cannot express; None if it can."""
    match node:
        case stmt.ForEach() | stmt.Local() | stmt.Fail() | stmt.Reply():
            return "this statement"
        case stmt.Send(destination=destination, delay=delay):
            if destination not in DESTINATIONS:
                return "an event for another machine"
            if not (delay is None or isinstance(delay, lang.Literal)):
                return "a delay that is computed"
        case lang.Binary() | lang.Unary() | lang.Apply() if isinstance(node.type, lang.IntType):
            raw = raw_range(node)
            if raw is None or not within(raw, SAFE):
                return "an integer of more than 53 bits"
        case lang.EventName() | lang.EventType() | lang.Checked() | lang.Invalid():
            return "this expression"
        case lang.Convert() | lang.Variable() | lang.Literal() if not _is_number(node.type):
            return f"a value of type `{node.type}`"
        case _:
            pass
    return None


@dataclass(frozen=True, slots=True)
class AwkTarget:
    """Writes ``<chart>.awk``, which reads scripts and prints traces."""

    name: str = "awk"
    summary: str = "a program for awk, which reads scripts"
    options: tuple[str, ...] = ()

    def generate(
        self, chart: Chart, findings: Findings, options: Mapping[str, str]
    ) -> Generated | None:
        """Return the program, or None with a finding for each construct that awk lacks."""
        del options
        can_run = report_environment_only(chart, findings, RULE)
        for what, span in dict.fromkeys(limits(chart)):
            can_run = False
            findings.add(RULE, f"awk lacks {what}", span, help="compile it with `--target python`")
        if not can_run:
            return None
        text = program(chart)
        return Generated({f"{plain(chart.name)}.awk": text}, {"lines": text.count("\n")})

    def harness_run(self, chart: Chart, script_lines: Sequence[str]) -> list[str]:
        """Run a script and return the trace; `FsmkitError` for a chart that awk lacks."""
        findings = Findings()
        generated = self.generate(chart, findings, {})
        findings.stop_on_errors()
        assert generated is not None
        (text,) = generated.files.values()
        lines = "".join(f"{each}\n" for each in _plain_lines(chart, script_lines))
        done = subprocess.run(
            ["awk", text], input=lines, capture_output=True, text=True, check=True
        )
        return done.stdout.splitlines()


def _plain_lines(chart: Chart, script: Sequence[str]) -> Iterator[str]:
    """Yield the lines of a script with the number of each event, and its fields as numbers."""
    for line in script_texts(script):
        read = read_line(chart, line)
        match read.verb:
            case "start" | "run" | "at":
                yield f"{read.verb} {read.number}"
            case "post" | "dispatch" | "ask":
                fields = (int(value) for value in read.event.payload)  # type: ignore[arg-type]
                yield " ".join((read.verb, str(read.event.event), *map(str, fields)))
            case "dump" | "seed":
                yield read.verb
            case verb:
                raise wrong_line(line, f"a machine in awk has no line `{verb}`")


PLUGIN = AwkTarget()
