"""What a step of a generated machine leaves in memory, and that what it would leave is seen."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from benchmarks.allocations import measured
from fsmkit.chart.loading import load
from fsmkit.codegen.python.loading import load_machine
from fsmkit.testing.harness import pyext

EVENTS = 20_000
FLAT = """\
chart: Flat
data: {n: int32 = 0}
events: {in: [up, down, tick(by 0..5)]}
states:
  low: {on: {up: {target: high, do: n += 3}, tick: {do: n += event.by}}}
  high: {exit: n -= 1, on: {down: low, tick: {if: n > 400, target: low}}}
"""
REGIONS = """\
chart: Regions
data: {a: uint32 = 0, b: uint32 = 0}
events: {in: [tick, swap, off, on]}
initial: work
states:
  none: {on: {on: work}}
  work:
    on: {off: none}
    regions:
      left: {states: {l1: {exit: a += 1, on: {tick: l2}}, l2: {on: {tick: l1, swap: l1}}}}
      right: {states: {r1: {exit: b += 1, on: {tick: r2}}, r2: {on: {tick: r1}}}}
"""
CALLING = """\
chart: Calling
data: {n: uint16 = 0}
events: {in: [go, stop], out: [done(n uint16)]}
operations: [move(to uint16)]
states:
  idle: {on: {go: {target: busy, do: move(n)}}}
  busy:
    on: {stop: idle}
    after: {5s: idle}
    exit: send done(n = n); n += 1
"""


class Host:
    def move(self, _: int) -> None:
        pass

    def send_done(self, _: int) -> None:
        pass


def started(tmp_path: Path, text: str, load_class: Callable[..., Any] = load_machine) -> Any:
    path = tmp_path / "chart.yaml"
    path.write_text(text)
    machine = load_class(load(path))(Host())
    machine.start(0)
    return machine


@pytest.mark.slow
@pytest.mark.parametrize(
    ("text", "events"),
    [
        (FLAT, ("up", "down", "up", "tick")),
        (REGIONS, ("tick", "swap", "tick", "off", "tick", "on")),
        (CALLING, ("go", "stop", "stop")),
    ],
    ids=["flat", "regions", "calling"],
)
def test_a_step_leaves_nothing_and_makes_nothing_that_is_tracked(
    tmp_path: Path, text: str, events: tuple[str, ...]
) -> None:
    machine = started(tmp_path, text)
    calls = [getattr(machine, f"dispatch_{event}") for event in events]
    if text == FLAT:
        calls[-1] = partial(machine.dispatch_tick, 2)
    found = measured(calls * (EVENTS // len(calls)))
    assert machine.running
    assert found.blocks <= 4  # an integer that grew out of those that Python keeps
    assert (found.tracked, found.collections) == (0, 0)
    assert found.bytes_kept <= 128


@pytest.mark.cc
def test_neither_does_one_of_an_extension_module(
    tmp_path: Path, require_tool: Callable[[str], str]
) -> None:
    require_tool("cc")
    machine = started(tmp_path, CALLING, pyext.load_class)
    calls = [getattr(machine, f"dispatch_{event}") for event in ("go", "stop", "stop")]
    found = measured(calls * (EVENTS // len(calls)))
    assert machine.n == EVENTS // len(calls) * 4 % 65536
    assert found.blocks <= 4
    assert (found.tracked, found.collections) == (0, 0)
    assert found.bytes_kept <= 128


@pytest.mark.slow
def test_what_is_kept_is_seen() -> None:
    kept: list[list[int]] = []
    found = measured([partial(kept.append, [])] + [lambda: kept.append([])] * 1000)
    assert found.blocks >= 1000
    assert found.tracked >= 900
    assert found.bytes_kept > 50_000


@pytest.mark.slow
def test_what_is_tracked_for_a_moment_is_seen() -> None:
    assert measured([lambda: {"a": [1]}]).collections >= 1
