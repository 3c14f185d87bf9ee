"""A chart with a bit of everything, and bindings of it that are written into a folder."""

from __future__ import annotations

from pathlib import Path
from typing import Protocol

import pytest

from fsmkit.chart.loading import load
from fsmkit.codegen.existing_c.checks import check_binding
from fsmkit.codegen.existing_c.reader import read_binding
from fsmkit.diagnostics import Findings, FsmkitError

CHART = """\
chart: Pump
constants: {LIMIT: 300, T_OPEN: 50ms, COLD: -5, GAIN: 1.5}
types:
  Fault: [none, hot]
  Sample: {amps: 0..500, tags: "uint8[2]"}
  Deep: {inner: Sample}
inputs: {temp: -40..125, name: symbol}
outputs: {level: 0..100, lamp: bool, levels: "uint8[4]"}
operations: ["set(amps 0..500)", "healthy() -> bool", "keep(sample Sample)", "name_of() -> symbol"]
events: {in: [go], out: [done, "failed(fault Fault)"], internal: [again]}
initial: idle
states:
  idle: {on: {go: {target: busy, do: "send done; send failed(fault = Fault.hot); raise again"}}}
  busy: {}
"""
HEAD = "binding: Pump\nchart: pump.yaml\n"
Told = tuple[str, str, int]


class Judge(Protocol):
    """Reads a binding of the chart; returns rule, message and line of each finding."""

    def __call__(self, text: str, head: str = HEAD) -> list[Told]: ...


@pytest.fixture
def judge(tmp_path: Path) -> Judge:
    """Return a reader of bindings of the chart: rule, message and line of each finding."""
    (tmp_path / "pump.yaml").write_text(CHART, encoding="utf-8")

    def found(text: str, head: str = HEAD) -> list[Told]:
        path = tmp_path / "pump.c.yaml"
        path.write_text(head + text, encoding="utf-8")
        findings = Findings()
        try:
            chart = load(tmp_path / "pump.yaml")
            check_binding(read_binding(path, findings), chart, findings)
            told = tuple(findings)
        except FsmkitError as error:
            told = error.diagnostics
        return [
            (
                each.rule.name,
                each.message,
                0
                if each.primary is None
                else each.primary.span.source.position(each.primary.span.start)[0],
            )
            for each in told
        ]

    return found
