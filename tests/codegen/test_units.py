"""Files for supervisors: their text, their readers, and nodes that are kept running."""

from __future__ import annotations

import os
import shlex
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path

import pytest

import fsmkit
from fsmkit.cli import execute
from fsmkit.codegen.units import KINDS, services_of
from fsmkit.codegen.units.service import Keeping, Service
from fsmkit.diagnostics import FsmkitError
from fsmkit.emit import Written
from fsmkit.system.deployment.deployment import Deployment
from tests.needs import need
from tests.runtime.test_node import FILES

DEPLOYMENT = Path(__file__).parents[2] / "machines/production_cell/deployment.yaml"
HOSTILE = (
    "/opt/my cell/run",
    "100 %",
    "%(ENV_HOME)s %i",
    "$HOME ${HOME}",
    "a;b #c ;d",
    'it\'s "so" \\n \\',
    "",
    "[program:x]",
    "é 🙂",
)
"""Words of a command."""


@pytest.fixture(scope="module")
def deployment() -> Deployment:
    read = fsmkit.read(DEPLOYMENT)
    assert isinstance(read, Deployment)
    return read


def files(
    kind: str, deployment: Deployment, command: str, keeping: Keeping, node: str | None = None
) -> dict[str, str]:
    return KINDS[kind](services_of(deployment, command, node), keeping)


def test_units_of_systemd(deployment: Deployment) -> None:
    keeping = Keeping(watchdog=0.5, restart=2, tries=3, priority=82, cpus=(2, 3), user="cell")
    made = files("systemd", deployment, "/opt/cell/board_{node} --realtime {health}", keeping)
    assert list(made) == [
        "fsmkit-ring-a.service",
        "fsmkit-ring-b.service",
        "fsmkit-ring.target",
    ]
    assert (
        made["fsmkit-ring-b.service"]
        == """\
[Unit]
Description=Node b of Ring: extraction_belt, sorter, camera, rotator
PartOf=fsmkit-ring.target
After=network.target
StartLimitIntervalSec=15
StartLimitBurst=3

[Service]
Type=notify
TimeoutStartSec=infinity
WatchdogSec=0.5
ExecStart="/opt/cell/board_b" "--realtime" "tcp://127.0.0.1:5582"
Restart=on-failure
RestartSec=2
User=cell
LimitRTPRIO=82
LimitMEMLOCK=infinity
CPUAffinity=2 3

[Install]
WantedBy=fsmkit-ring.target
"""
    )
    assert made["fsmkit-ring.target"].splitlines()[2:4] == [
        "Wants=fsmkit-ring-a.service",
        "Wants=fsmkit-ring-b.service",
    ]


def test_one_node_and_a_program_that_sends_no_notices(deployment: Deployment) -> None:
    made = files("systemd", deployment, "/bin/true", Keeping(watchdog=0), "a")
    assert list(made) == ["fsmkit-ring-a.service", "fsmkit-ring.target"]
    assert "Type=exec\nExecStart" in made["fsmkit-ring-a.service"]
    assert "fsmkit-ring-b" not in made["fsmkit-ring.target"]


def test_names_that_are_equal_in_lower_case_have_units_of_their_own(deployment: Deployment) -> None:
    odd = replace(
        deployment, nodes=("nodeA", "node_a"), system=replace(deployment.system, name=Written("…"))
    )
    assert [service.name for service in services_of(odd, "/bin/true")] == [
        "fsmkit-system-node-a",
        "fsmkit-system-node-a-2",
    ]


@pytest.mark.external
@pytest.mark.parametrize("user", [None, "root"])
def test_systemd_takes_the_units_without_a_word(
    deployment: Deployment,
    tmp_path: Path,
    user: str | None,
    require_tool: Callable[[str], str],
) -> None:
    analyze = require_tool("systemd-analyze")
    system = replace(deployment.system, name=Written("Ring\n[Service]\nExecStart=%h \\"))
    whole = replace(deployment, system=system)
    command = shlex.join(("/bin/true", *HOSTILE))
    keeping = Keeping(priority=82, cpus=(0, 1), user=user)
    for name, text in files("systemd", whole, command, keeping).items():
        (tmp_path / name).write_text(text, encoding="utf-8")
    done = subprocess.run(
        [analyze, "verify", *map(str, sorted(tmp_path.iterdir()))],
        capture_output=True,
        text=True,
        check=False,
    )
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")


def test_systemd_runs_the_words_of_the_command() -> None:
    """Read back by the rules of systemd.service(5): quotes and escapes, then `%%` and `$$`."""
    service = Service("n", "g", "s", "a", (), ("/bin/x", *HOSTILE))
    line = next(
        line
        for line in KINDS["systemd"]([service], Keeping())["n.service"].splitlines()
        if line.startswith("ExecStart=")
    )
    words = shlex.split(line.removeprefix("ExecStart="))
    assert all("%" not in word.replace("%%", "") for word in words)
    assert all("$" not in word.replace("$$", "") for word in words)
    assert tuple(w.replace("%%", "%").replace("$$", "$") for w in words) == service.command


READ_BY_SUPERVISOR = """
import sys
from supervisor.options import ServerOptions
options = ServerOptions()
options.realize(["-c", sys.argv[1]])
for group in options.process_group_configs:
    for program in group.process_configs:
        process = program.make_process(group)
        print(repr((group.name, program.name, process.get_execv_args()[1])))
"""


@pytest.mark.external
def test_supervisord_reads_the_words_of_the_command(tmp_path: Path) -> None:
    need(find_spec("supervisor") is not None, "supervisor")
    system = "Ring\n[program:x]\ncommand=/bin/false"
    services = [
        Service(f"fsmkit-ring-{node}", "fsmkit-ring", system, node, ("m",), ("/bin/true", *HOSTILE))
        for node in "ab"
    ]
    configuration = supervised(tmp_path, KINDS["supervisor"](services, Keeping()))
    done = subprocess.run(
        [sys.executable, "-W", "ignore", "-c", READ_BY_SUPERVISOR, str(configuration)],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.stderr == ""
    waker = ["/bin/sh", "-c", "while echo && sleep 0.1; do :; done"]
    assert done.stdout.splitlines() == [
        repr(("fsmkit-ring", name, list(command)))
        for name, command in [
            *((service.name, service.command) for service in services),
            ("fsmkit-ring.waker", waker),
        ]
    ]


def supervised(folder: Path, files: dict[str, str]) -> Path:
    """Write a configuration that includes the files."""
    for name, text in files.items():
        (folder / name).write_text(text, encoding="utf-8")
    configuration = folder / "supervisord.conf"
    configuration.write_text(
        "[supervisord]\nnodaemon=true\nlogfile=%(here)s/log\npidfile=%(here)s/pid\n"
        "childlogdir=%(here)s\n[unix_http_server]\nfile=%(here)s/s\n[rpcinterface:supervisor]\n"
        "supervisor.rpcinterface_factory=supervisor.rpcinterface:make_main_rpcinterface\n"
        "[supervisorctl]\nserverurl=unix://%(here)s/s\n[include]\nfiles=%(here)s/fsmkit-*.conf\n",
        encoding="utf-8",
    )
    return configuration


NODE = """
import json, os, sys, zmq
if os.path.exists(sys.argv[2]):
    sys.exit(3)
socket = zmq.Context().socket(zmq.REP)
socket.bind(sys.argv[1])
while socket.recv() == b"R":
    socket.send(b"R" + json.dumps({"ok": True, "status": "producing", "pid": os.getpid()}).encode())
"""


@contextmanager
def running(configuration: Path) -> Iterator[None]:
    command = [sys.executable, "-W", "ignore", "-m", "supervisor.supervisord"]
    daemon = subprocess.Popen(
        [*command, "-c", str(configuration)], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    )
    try:
        yield
    finally:
        daemon.terminate()
        daemon.wait(30)


@pytest.mark.slow
@pytest.mark.external
def test_nodes_are_kept_running(deployment: Deployment, tmp_path: Path) -> None:
    """A node that is killed comes back; one that always fails stays down, and the other goes on."""
    need(find_spec("supervisor") is not None, "supervisor")
    from fsmkit.runtime.health import Health, health_of

    (tmp_path / "node.py").write_text(NODE, encoding="utf-8")
    endpoints = tuple(f"ipc://{tmp_path}/{node}" for node in deployment.nodes)
    command = [sys.executable, str(tmp_path / "node.py"), "{health}", f"{tmp_path}/fail_{{node}}"]
    local = replace(deployment, health=endpoints)
    made = files("supervisor", local, shlex.join(command), Keeping(tries=2))

    def until(condition: Callable[[Sequence[Health]], bool], seconds: float) -> Sequence[Health]:
        end = time.monotonic() + seconds
        while not condition(found := health_of(zip("ab", endpoints, strict=True), 0.2)):
            assert time.monotonic() < end, found
        return found

    def both(found: Sequence[Health]) -> bool:
        return all(health.is_ok for health in found)

    def pid() -> int:
        return int(until(both, 30)[1].report["pid"])

    with running(supervised(tmp_path, made)):
        for _ in range(3):
            last = pid()
            time.sleep(1.1)  # a node counts as started after a second
            os.kill(last, signal.SIGKILL)
            found = until(lambda found: both(found) and found[1].report["pid"] != last, 30)  # noqa: B023
            assert found[0].status == "producing"
        (tmp_path / "fail_b").touch()
        os.kill(pid(), signal.SIGKILL)
        log = tmp_path / "log"
        end = time.monotonic() + 60
        while "entered FATAL state" not in log.read_text(encoding="utf-8"):
            assert time.monotonic() < end
            time.sleep(0.1)
        assert [h.is_ok for h in health_of(zip("ab", endpoints, strict=True), 1)] == [True, False]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--exec", "board_{node}"], "does not start with an absolute path"),
        (["--exec", "/bin/'x"], "cannot be divided into words"),
        (["--exec", "/bin/x '\n'"], "unprintable characters"),
        (["--exec", ""], "does not start with an absolute path"),
        (["--exec", "/bin/x", "--node", "c"], "the deployment has no node `c`"),
        (["--exec", "/bin/x", "--cpus", "2-3"], "`2-3` is not a list of processors"),
        (["--exec", "/bin/x", "--user", "a\nb"], "is not a user name"),
        (["--exec", "/bin/x", "--watchdog", "soon"], "`soon` is not a duration"),
    ],
)
def test_commands_that_cannot_be_started(
    arguments: list[str], message: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for name, text in FILES.items():
        (tmp_path / f"{name}.yaml").write_text(text)
    hall = str(tmp_path / "deployment.yaml")
    words = ["deploy", hall, "--to", "systemd", "--out", str(tmp_path / "u"), *arguments]
    assert execute(words) in (1, 2)
    assert message in " ".join(capsys.readouterr().err.split())
    assert not (tmp_path / "u").exists()


def test_where_nodes_answer_must_be_there_if_a_command_names_it(deployment: Deployment) -> None:
    with pytest.raises(FsmkitError) as refused:
        services_of(replace(deployment, health=()), "/bin/x {health}")
    assert "needs the health address of `a`" in str(refused.value)


def test_a_chart_is_no_deployment(capsys: pytest.CaptureFixture[str]) -> None:
    chart = DEPLOYMENT.parent / "feeder.yaml"
    for words in (
        ["deploy", str(chart), "--to", "systemd", "--exec", "/x"],
        ["health", str(chart)],
    ):
        assert execute(words) == 1
        assert "FK0541" in capsys.readouterr().err
