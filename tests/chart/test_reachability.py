"""Which states a transition can enter: those below its domain, whatever lies beside it."""

from __future__ import annotations

from pathlib import Path

from fsmkit.chart.analysis.reachability import entered
from fsmkit.chart.chart import Chart
from fsmkit.chart.loading import load
from tests.codegen.c.sized import parallel

DEEP = """
chart: Deep
events: {in: [go, over]}
initial: all
states:
  all:
    regions:
      left:
        initial: a
        states:
          a: {on: {go: b}}
          b:
            regions:
              c: {initial: c1, states: {c1: {on: {go: c2}}, c2: {}}}
              d: {initial: d1, states: {d1: {}}}
      right: {initial: e, states: {e: {on: {over: c2}}}}
"""


def by_name(chart: Chart, target: str, domain: str | None) -> set[str]:
    index = chart.state_index
    found = entered(chart, [index[target]], None if domain is None else index[domain])
    return {chart.states[number].id for number in found} & set(index) - {chart.states[0].id}


def test_what_lies_around_the_domain_is_not_entered(tmp_path: Path) -> None:
    path = tmp_path / "deep.yaml"
    path.write_text(DEEP, encoding="utf-8")
    chart = load(path)
    inside = {"c", "c2", "d", "d1"}
    assert by_name(chart, "c2", "c") == {"c2"}
    assert by_name(chart, "c2", "left") == {"b", *inside}
    assert by_name(chart, "c2", None) == {"all", "left", "b", *inside, "right", "e"}
    assert by_name(chart, "b", "left") == {"b", "c", "c1", "d", "d1"}


def test_regions_beside_do_not_count(tmp_path: Path) -> None:
    path = tmp_path / "parallel.scxml"
    path.write_text(parallel(300), encoding="utf-8")
    chart = load(path)
    assert by_name(chart, "b7", "r7") == {"b7"}
    assert len(by_name(chart, "b7", None)) == 300 - 99
