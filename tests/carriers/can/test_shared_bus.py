"""Nodes of fsmkit and a foreign one on one bus: both count in times and identifiers."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from fsmkit.carriers.can.deployment import times_of_buses
from fsmkit.system.deployment.deployment import Deployment
from tests.carriers.can.test_can_nodes import OVEN, findings_of, write  # noqa: F401  (a fixture)
from tests.reading import load_deployment

pytestmark = pytest.mark.external

LAMP = """\
chart: Lamp
events: {in: ["power(percent 0..100)"]}
outputs: {on: bool = false}
initial: there
states: {there: {on: {power: {do: on = event.percent > 0}}}}
"""
SYSTEM = OVEN.replace("control: control.yaml", "control: control.yaml, lamp: lamp.yaml").replace(
    "connect:\n", "connect:\n  - control.set_power -> lamp.power\n"
)
SHARED = """\
system: oven.yaml
nodes: {a: [control], b: [lamp], heater: {machines: [heater], foreign: can}}
links:
  kind: can
  bus: can0
  base: 0x80
  foreign: {heater: {bus: can0, dbc: heater.dbc}}
"""


def times(found: Deployment) -> tuple[list[float], dict[str, int | None]]:
    """Return the loads of the buses, and the response times of all messages."""
    late = [pair for times in times_of_buses(found) for pair in times.responses]
    loads = [times.load for times in times_of_buses(found)]
    return loads, {message.name: time for message, time in late}


def test_what_is_on_one_bus_counts_for_all_of_it(
    write: Callable[..., Path],  # noqa: F811
) -> None:
    def found(deployment: str) -> tuple[list[float], dict[str, int | None]]:
        return times(load_deployment(write(oven=SYSTEM, lamp=LAMP, deployment=deployment)))

    apart_loads, apart = found(SHARED.replace("heater: {bus: can0", "heater: {bus: can1"))
    loads, shared = found(SHARED)
    assert loads == [pytest.approx(sum(apart_loads))] * 2
    assert shared.keys() == apart.keys()
    assert None not in shared.values()
    for name in ("heater", "status_fault", "set_power"):  # of lower priority: 0x100 and more
        assert (shared[name] or 0) > (apart[name] or 0), name


def test_one_bus_has_one_bitrate(write: Callable[..., Path]) -> None:  # noqa: F811
    text = SHARED.replace("  base:", "  bitrate: 250000\n  base:")
    ((rule, text, place),) = findings_of(write(oven=SYSTEM, lamp=LAMP, deployment=text))
    assert (rule, place) == ("broken-deployment", "can0")
    assert text == "`can0` has 250000 bits per second here, and 500000 for `heater`"


def test_an_identifier_that_both_have_is_a_finding(
    write: Callable[..., Path],  # noqa: F811
) -> None:
    path = write(oven=SYSTEM, lamp=LAMP, deployment=SHARED.replace("0x80", "0xfe"))
    ((rule, text, place),) = findings_of(path)
    assert (rule, place) == ("broken-deployment", "can0")
    assert text == "`heater` and `b_levels` have the identifier 0x100 on one bus"
