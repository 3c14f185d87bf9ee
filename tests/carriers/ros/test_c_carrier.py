"""A node in C and a program of Cyclone DDS in another process."""

from __future__ import annotations

import os
import subprocess
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from fsmkit.cli import execute
from tests.carriers.ros.cell import DEPLOYMENT, written
from tests.carriers.ros.test_python_carrier import (  # noqa: F401  (one is a fixture)
    _loopback,
    does,
    domain,
    go,
    peer,
    said,
)
from tests.needs import need

pytestmark = [pytest.mark.external, pytest.mark.slow, pytest.mark.cc]

HERE = Path(__file__).parent
RUNTIME = HERE.parents[2] / "fsmkit/runtime/c"
ROS = HERE.parents[2] / "fsmkit/carriers/ros/c"
WARNINGS = ["-std=c99", "-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Wshadow", "-Werror"]
SOURCES = (
    *(RUNTIME / "links" / f"{name}.c" for name in ("fsm_link", "fsm_link_fan")),
    *(ROS / "dds" / f"fsm_link_{name}.c" for name in ("dds", "ros")),
    *(ROS / "dds" / f"fsm_dds_{name}.c" for name in ("domain", "diagnostics")),
)


class Builder:
    """Compiles deployments and a program with the C of their node ``b``."""

    def __init__(self, folder: Path, require_tool: Callable[[str], str]) -> None:
        self.folder = folder
        self.tool = require_tool
        need(Path("/usr/include/dds/dds.h").exists(), "cyclonedds-dev")

    def build(self, deployment: Path, program: str, compiler: str = "gcc", own: str = "b") -> Path:
        """Build a program of this folder; what `idlc` writes is not for ``-Wpedantic``."""
        gcc = self.tool(compiler)
        out = self.folder / "out"
        assert execute(["compile", str(deployment), "--out", str(out)]) == 0
        made = out / "made"
        made.mkdir()
        for each in [*sorted(out.glob("idl/*")), *(ROS / "dds").glob("*.idl")]:
            command = [self.tool("idlc"), "-t", "-o", str(made), each.name]
            subprocess.run(command, cwd=each.parent, check=True)
        sources = sorted(made.glob("*.c"))
        subprocess.run([gcc, "-c", *map(str, sources)], cwd=made, check=True)
        folders = [out / own, made, RUNTIME, RUNTIME / "hosts", RUNTIME / "links", ROS, ROS / "dds"]
        # players look for waiting events before they send; those on the way fit as well
        flags = [
            "-DFSM_LINK_DDS_WAITING=512",
            "-g",
            "-O1",
            "-pthread",
            *(f"-I{folder}" for folder in folders),
        ]
        if compiler == "gcc":
            flags.append("-fsanitize=address,undefined")
        files = [*sorted((out / own).glob("*.c")), HERE / program, *SOURCES]
        objects = [source.with_suffix(".o") for source in sources]
        player = self.folder / Path(program).stem
        parts = map(str, [*files, *objects])
        command = [gcc, *WARNINGS, *flags, *parts, "-lddsc", "-o", str(player)]
        subprocess.run(command, check=True)
        return player


@pytest.fixture(scope="module")
def builder(
    tmp_path_factory: pytest.TempPathFactory, require_tool: Callable[[str], str]
) -> Callable[..., Path]:
    """Build a program for the deployment, with changes of its files."""

    def build(program: str, compiler: str = "gcc", **changes: str) -> Path:
        folder = tmp_path_factory.mktemp("node")
        made = Builder(folder, require_tool)
        return made.build(written(folder, **changes), program, compiler)

    return build


@pytest.fixture(scope="module")
def player(builder: Callable[..., Path], domain: int) -> Path:  # noqa: F811
    text = DEPLOYMENT.replace("domain: 7", f"domain: {domain}\n        insecure: true")
    return builder("topic_player.c", deployment=text)


@contextmanager
def node(player: Path, *arguments: object) -> Iterator[subprocess.Popen[str]]:
    command = [str(player), *map(str, arguments)]
    with subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, bufsize=1
    ) as process:
        try:
            assert said(process) == "ready"
            yield process
        finally:
            process.kill()


def counts(process: subprocess.Popen[str]) -> dict[str, int]:
    assert process.stdin is not None
    process.stdin.write("counts\n")
    return numbers(said(process))


def numbers(line: str) -> dict[str, int]:
    words = line.split()
    return {name: int(value) for name, value in zip(words[::2], words[1::2], strict=True)}


def until(process: subprocess.Popen[str], **wanted: int) -> dict[str, int]:
    """Return the counts of a node once they are these."""
    end = time.monotonic() + 30
    while True:
        found = counts(process)
        if wanted.items() <= found.items():
            return found
        assert time.monotonic() < end, f"{found} is not {wanted}"
        time.sleep(0.005)


def test_ten_thousand_events_each_way_come_once_and_in_order(
    player: Path,
    domain: int,  # noqa: F811
) -> None:
    count = 10_000
    with peer("exchange", domain, count) as lens, node(player, "exchange", count) as camera:
        assert said(lens) == "ready"
        go(lens)
        go(camera)
        assert said(lens) == f"{count} True"
        found = numbers(said(camera))
        assert (found["came"], found["wrong"]) == (count, 0)
        assert (found["lost"], found["late"], found["overflow"]) == (0, 0, 0)
        assert (found["malformed"], found["restarts"], found["unsent"]) == (0, 0, 0)
        assert found["sent"] == count + 2  # and each level once


def test_levels_come_and_silence_grows_until_another_run(
    player: Path,
    domain: int,  # noqa: F811
) -> None:
    with node(player, "obey") as camera:
        with peer("obey", domain) as lens:
            assert said(lens) == "ready"
            does(lens, "light 417")
            until(camera, light=417, sharp=1)  # its start value
            does(lens, "judged 3", "wait", "judged 4")
            until(camera, seen=4)
        silent = counts(camera)["silence"]
        while silent < 150:
            time.sleep(0.005)  # it answers, or cycles
            before, silent = silent, counts(camera)["silence"]
            assert silent >= before
        assert counts(camera)["restarts"] == 0
        with peer("obey", domain) as lens:
            assert said(lens) == "ready"
            does(lens, "light 5")
            found = until(camera, light=5, restarts=1)
            assert found["silence"] < 150
            does(lens, "judged 8", "wait", "judged 9")
            assert until(camera, seen=9)["restarts"] == 1


def test_gaps_are_lost_and_what_is_out_of_range_is_malformed(
    player: Path,
    domain: int,  # noqa: F811
) -> None:
    with node(player, "obey") as camera, peer("obey", domain) as lens:
        assert said(lens) == "ready"
        does(lens, "light 1001")
        until(camera, malformed=1, light=0)
        does(lens, "light 1000")
        until(camera, light=1000)
        does(lens, "judged 1 5 0 2")  # there are two verdicts
        does(lens, "wait")
        does(lens, "judged 1 7 0", "judged 2 7 1", "judged 9 7 0", "judged 3 7 4")
        found = until(camera, seen=3, lost=2, late=1)
        assert found["malformed"] <= 2


def test_a_late_subscriber_has_what_is_kept(
    builder: Callable[..., Path],
    domain: int,  # noqa: F811
) -> None:
    text = DEPLOYMENT.replace("domain: 7", f"domain: {domain}")
    player = builder("topic_player.c", "clang", deployment=text)
    with node(player, "obey") as camera:
        assert camera.stdin is not None
        for position in (1, 2, -99_999):
            camera.stdin.write(f"position {position}\n")
        with peer("late", domain) as lens:
            assert said(lens) == "Int32(data=-99999)"
            assert said(lens) == "Duration(sec=0, nanosec=10000000)"
            assert said(lens) == "String(data='waiting')"
            assert float(said(lens)) <= 1


def test_values_of_other_types_are_taken_as_far_as_they_fit(builder: Callable[..., Path]) -> None:
    bind = """\
        bind:
          lens.light -> camera.light: {topic: /light, type: std_msgs/msg/Int64, qos: default}
          lens.judged -> camera.judged:
            {topic: /verdict, type: std_msgs/msg/Int32, fields: {quality: data, verdict: data}}
          belt.position -> lens.encoder: {topic: /belt, type: std_msgs/msg/Int64, qos: sensor}
"""
    for compiler in ("gcc", "clang"):
        player = builder("value_player.c", compiler, deployment=DEPLOYMENT + bind)
        subprocess.run([str(player)], check=True)


def test_diagnostics_show_counters_that_moved_and_faults(
    builder: Callable[..., Path],
    domain: int,  # noqa: F811
) -> None:
    from cyclonedds.core import Policy, Qos
    from cyclonedds.domain import DomainParticipant
    from cyclonedds.sub import DataReader
    from cyclonedds.topic import Topic

    from tests.carriers.ros.dds_diagnostics import DiagnosticArray

    participant = DomainParticipant(domain)
    topic: Any = Topic(participant, "rt/diagnostics", DiagnosticArray)
    qos = Qos(Policy.Reliability.Reliable(0), Policy.History.KeepLast(100))
    heard: Any = DataReader(participant, topic, qos=qos)

    def wait(name: str, level: int) -> tuple[str, dict[str, str]]:
        """Return the message and the values of a status, once it has this level."""
        end = time.monotonic() + 30
        while time.monotonic() < end:
            for array in heard.take(10):
                for status in array.status:
                    if (status.name, int(status.level)) == (name, level):
                        assert status.hardware_id == "Cell/b"
                        return status.message, {each.key: each.value for each in status.values}
            time.sleep(0.01)
        raise AssertionError(f"{name} has never had the level {level}")

    text = DEPLOYMENT.replace("domain: 7", f"domain: {domain}")
    with node(builder("diagnostics_player.c", deployment=text), domain) as player:
        assert wait("Cell/b: camera", 0) == ("runs", {})
        message, values = wait("Cell/b: vision", 0)
        assert message == "no counter moved"
        assert int(values["silence"]) > 100
        assert player.stdin is not None
        player.stdin.write("no frame\n")
        message, values = wait("Cell/b", 1)
        assert message == "moved: malformed, overruns"
        assert (values["malformed"], values["overruns"], values["refused"]) == ("1", "5", "0")
        assert wait("Cell/b: camera", 2)[0] == "stopped by the fault 3"
        assert wait("Cell/b", 0)[0] == "no counter moved"


def test_a_domain_that_cannot_be_joined_is_an_error(
    player: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    uri = os.environ["CYCLONEDDS_URI"].replace('name="lo"', 'name="none"')
    monkeypatch.setenv("CYCLONEDDS_URI", uri)
    done = subprocess.run([str(player), "obey"], capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert done.stdout.startswith("error -")
