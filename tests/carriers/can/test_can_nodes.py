"""A heater on a CAN bus: what of a deployment fits its DBC file, response times, and proofs."""

from __future__ import annotations

import json
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest

from fsmkit.carriers.can.deployment import buses_of
from fsmkit.cli import execute
from fsmkit.diagnostics import FsmkitError
from tests.carriers.can.conftest import FOLDERS, HEATER
from tests.reading import load_deployment

pytestmark = pytest.mark.external

OVEN = """\
system: Oven
machines: {control: control.yaml, heater: heater.yaml}
connect:
  - control.set_power -> heater.set_power
  - heater.status_fault -> control.failed
  - heater.heater_silent -> control.heater_silent
  - heater.temperature -> control.temperature
environment: {will: [heater]}
"""
CONTROL = """\
chart: Control
types: {Mode: [off_2, heating_up, failed]}
inputs: {temperature: -400..1000}
events:
  in: [heater_silent, "failed(code 0..9, mode Mode)"]
  out: [set_power(percent 0..100)]
initial: idle
states:
  idle:
    always: [{if: temperature > 500, target: hot}]
    on:
      heater_silent: off
      failed: {if: event.mode == Mode.failed, target: off}
  hot:
    entry: send set_power(percent = 0)
    always: [{if: temperature < 400, target: idle}]
    on: {heater_silent: off, failed: off}
  off: {entry: send set_power(percent = 0)}
"""
DEPLOYMENT = """\
system: oven.yaml
nodes: {a: [control], heater: {machines: [heater], foreign: can}}
links: {foreign: {heater: {bus: can0, dbc: heater.dbc}}}
"""


@pytest.fixture
def write(tmp_path: Path) -> Callable[..., Path]:
    """Write a deployment with a heater whose chart is that of its DBC file."""

    def written(dbc: str | None = None, **changes: str) -> Path:
        text = HEATER.read_text() if dbc is None else dbc
        (tmp_path / "heater.dbc").write_text(text)
        files = {"oven": OVEN, "control": CONTROL, "deployment": DEPLOYMENT} | changes
        for name, content in files.items():
            (tmp_path / f"{name}.yaml").write_text(content)
        if "heater" not in changes:
            command = ["convert", str(HEATER), "--to", "yaml", "--node", "HEATER", "--may"]
            assert execute([*command, "bus_off", "--out", str(tmp_path / "heater.yaml")]) == 0
        return tmp_path / "deployment.yaml"

    return written


def findings_of(path: Path) -> list[tuple[str, str, str]]:
    with pytest.raises(FsmkitError) as caught:
        load_deployment(path)
    found = []
    for each in caught.value.diagnostics:
        span = None if each.primary is None else each.primary.span
        text = "" if span is None else span.source.text[span.start : span.end]
        found.append((each.rule.name, each.message, text))
    return found


def test_events_travel_as_long_as_their_messages_may_take(write: Callable[..., Path]) -> None:
    deployment = load_deployment(write())
    (bus,) = buses_of(deployment).values()
    # at 500 kbit/s, one error in 10 ms: blocked by status (95 bits), 31 + 75 for an error
    late = {message.name: response for message, response in bus.times.responses}
    assert late == {
        "heater": 2 * (95 + 75 + 31 + 75),
        "set_power": 2 * (95 + 75 + 65 + 31 + 75),
        "status_position": 2 * (75 + 65 + 95 + 31 + 95),
        "status_fault": 2 * (75 + 65 + 95 + 31 + 95),
    }
    channels = [machine for machine in deployment.written.machines if machine.is_channel]
    assert [machine.name for machine in channels] == [
        "control.set_power>heater.set_power",
        "heater.status_fault>control.failed",
    ]
    assert not any(machine.is_channel for machine in deployment.system.machines)


def test_compile_prints_the_response_times(
    write: Callable[..., Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path, out = write(), tmp_path / "out"
    capsys.readouterr()
    assert execute(["compile", str(path), "--out", str(out)]) == 0
    printed = capsys.readouterr().out
    assert "heater: bus load 4.7%; worst-case response times:" in printed
    assert "  heater (0x100, every 10 ms): 552 us" in printed
    assert execute(["compile", str(path), "--out", str(out), "--json"]) == 0
    figures = json.loads(capsys.readouterr().out)["buses"]["heater"]
    assert figures["response_us"]["set_power"] == 682
    assert figures["silent_us"] is None  # only the heater sends in a cycle


@pytest.mark.parametrize(
    ("change", "rule", "message", "place"),
    [
        ({"dbc": HEATER.read_text().replace("BO_ 256 heater", "BO_ 256 warmer")},
         "unfit-message", "`heater.heater_silent` is connected, but no message", "heater.dbc"),
        ({"dbc": HEATER.read_text().replace("[-40|100]", "[-40|90]")},
         "unfit-message", "its signal `-400..900`", "heater.dbc"),
        ({"dbc": HEATER.read_text().replace("SG_ percent", "SG_ power")},
         "unfit-message", "its message has the signals power", "heater.dbc"),
        ({"dbc": HEATER.read_text().replace("HEATER", "BURNER")},
         "unfit-message", "no node with the name of the chart `Heater`", "heater.dbc"),
        ({"dbc": HEATER.read_text().replace("BO_ 512 set_power: 1", "BO_ 512 set_power: 0")},
         "broken-dbc", "does not fit", "percent"),
        ({"deployment": DEPLOYMENT.replace("dbc:", "bitrate: 5000, dbc:")},
         "late-message", "the response time of `heater`", "heater"),
        ({"deployment": DEPLOYMENT.replace("dbc:", "error_every: 100us, dbc:")},
         "late-message", "has no bound", "heater"),
        ({"deployment": DEPLOYMENT.replace("dbc:", "bitrate: 7, dbc:")},
         "unexpected-value", "1,000 to 1,000,000", "7"),
        ({"deployment": DEPLOYMENT.replace("heater.dbc", "none.dbc")},
         "unreadable-file", "none.dbc", "none.dbc"),
    ],
)  # fmt: skip
def test_what_does_not_fit_is_a_finding_at_its_place(
    change: dict[str, str], rule: str, message: str, place: str, write: Callable[..., Path]
) -> None:
    found = findings_of(write(**change))
    assert any(r == rule and message in m and p == place for r, m, p in found), found


@pytest.mark.cc
def test_compile_writes_the_tables_of_a_node(
    write: Callable[..., Path], tmp_path: Path, require_tool: Callable[[str], str]
) -> None:
    out = tmp_path / "out"
    assert execute(["compile", str(write()), "--out", str(out)]) == 0
    text = (out / "a/oven_a_can.c").read_text()
    for line in (
        "{0x100u, 0u, 10u, 2u, false, 1u, oven_a_can_heater_received_0}, /* heater */",
        "{0x300u, 2u, 0u, 4u, false, 3u, oven_a_can_heater_received_1}, /* status_fault */",
        "{0x300u, FSM_CAN_NOWHERE, 0u, 4u, false, 1u, oven_a_can_heater_received_2}, /* status_pos",
        "{0x200u, 1u, 0u, 1u, false, 1u, oven_a_can_heater_sent_0}, /* set_power */",
        "{0u, 3u},",
        "oven_a_can_heater_start[] = {0u, 0u};",
    ):
        assert line in text
    folders = [out / "a", *FOLDERS]
    command = [require_tool("gcc"), "-std=c99", "-Wall", "-Wextra", "-Wpedantic", "-Wconversion"]
    command += ["-Werror", "-fsyntax-only", *(f"-I{folder}" for folder in folders)]
    subprocess.run([*command, str(out / "a/oven_a_can.c")], check=True)


def test_a_deployment_with_a_bus_is_formatted_for_it_means_the_same(
    write: Callable[..., Path],
) -> None:
    links = "links: {foreign: {heater:   {bus: can0, dbc: heater.dbc}}}"
    path = write(deployment=DEPLOYMENT.partition("links:")[0] + links)
    before = load_deployment(path)
    assert execute(["fmt", str(path)]) == 0
    assert "heater:   {" not in path.read_text()
    assert load_deployment(path).foreign_networks == before.foreign_networks != {}
