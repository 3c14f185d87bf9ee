"""What was done is saved as a test in C, which passes and can fail, and as a sequence diagram."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest

import fsmkit
from fsmkit.cli import execute
from fsmkit.inspector.hub import Hub
from tests.inspector.conftest import Client
from tests.inspector.test_hub import DICE

CELL = Path(__file__).parents[2] / "machines/production_cell/cell.yaml"
TALK = {
    "talk": """\
system: Talk
machines: {ping: ping.yaml, pong: pong.yaml}
connect: [ping.hit -> pong.came, pong.back -> ping.came, ping.lit -> pong.dark]
environment: {may: [ping.go]}
""",
    "ping": """\
chart: Ping
events: {in: [go, "came(n 0..9)"], out: ["hit(n 0..9)"]}
outputs: {lit: bool}
data: {hits: 0..9 = 0}
initial: idle
states:
  idle: {rest: true, on: {go: {target: busy, do: [lit = true, send hit(n = 3)]}}}
  busy:
    on: {came: {target: idle, do: [hits = event.n, lit = false]}}
""",
    "pong": """\
chart: Pong
events: {in: ["came(n 0..9)"], out: ["back(n 0..9)"]}
inputs: {dark: bool}
data: {last: 0..9 = 0}
initial: here
states:
  here: {rest: true, on: {came: {target: there, do: last = event.n}}}
  there: {after: {200ms: {target: here, do: send back(n = last)}}}
""",
}


def performed(folder: Path, file: Path, text: str) -> subprocess.CompletedProcess[str]:
    """Compile the machines and a test, and run it."""
    (folder / "session.c").write_text(text, encoding="utf-8")
    lines = text[: text.index("*/")].splitlines()
    compiles = [line.split("fsmkit ")[1] for line in lines if "fsmkit compile" in line]
    cc = next(line for line in lines if " cc -I " in line)
    assert compiles
    for words in compiles:
        name = words.split()[1]
        assert (
            execute(
                ["compile", str(file.parent / Path(name).name), "--out", str(folder / "generated")]
            )
            == 0
        )
    sources = [word for word in cc.split() if word.startswith("generated/")]
    flags = ["-std=c99", "-Wall", "-Wextra", "-Werror"]
    subprocess.run(
        ["cc", *flags, "-I", "generated", "session.c", *sources, "-o", "session"],
        cwd=folder,
        check=True,
    )
    return subprocess.run(["./session"], cwd=folder, capture_output=True, text=True, check=False)


@pytest.mark.cc
def test_a_session_of_a_chart_is_a_test_in_c(gate: Path, tmp_path: Path) -> None:
    client = Client(Hub(fsmkit.read_chart(gate), file=gate))
    client.result("set", m="Gate", input="blocked", value=True)
    client.result("post", m="Gate", event="open")
    client.result("set", m="Gate", input="blocked", value=False)
    client.result("post", m="Gate", event="open")
    client.result("step", how="timer")
    client.result("post", m="Gate", event="close")
    client.result("post", m="Gate", event="open")
    client.result("post", m="Gate", event="fault", **{"with": {"code": "jam"}})
    text = client.result("save", **{"as": "c"})
    done = performed(tmp_path, gate, text)
    assert (done.returncode, done.stdout) == (0, "")
    assert "d fault_code 1" in text
    done = performed(tmp_path, gate, text.replace("d fault_code 1", "d fault_code 2"))
    assert done.returncode == 1


@pytest.mark.cc
def test_results_of_operations_are_those_of_the_session(tmp_path: Path) -> None:
    file = tmp_path / "dice.yaml"
    file.write_text(DICE, encoding="utf-8")
    client = Client(Hub(fsmkit.read_chart(file), file=file, seed=3))
    for _ in range(6):
        client.result("post", m="Dice", event="roll")
    total = client.result("watch", expression="sum")["value"]
    text = client.result("save", **{"as": "c"})
    assert f"d sum {total}" in text
    done = performed(tmp_path, file, text)
    assert (done.returncode, done.stdout) == (0, "")


def talking(tmp_path: Path) -> tuple[Client, Path]:
    for name, text in TALK.items():
        (tmp_path / f"{name}.yaml").write_text(text, encoding="utf-8")
    file = tmp_path / "talk.yaml"
    client = Client(Hub(fsmkit.read_system(file), file=file))
    client.result("post", m="ping", event="go")
    client.result("run", speed=0)
    client.hub.advance(1)
    client.result("post", m="ping", event="go")
    client.result("step", how="timer")
    return client, file


@pytest.mark.cc
def test_a_session_of_a_system_is_a_test_of_its_machines(tmp_path: Path) -> None:
    client, file = talking(tmp_path)
    text = client.result("save", **{"as": "c"})
    done = performed(tmp_path, file, text)
    assert (done.returncode, done.stdout) == (0, "")


def test_a_sequence_says_who_did_what(tmp_path: Path) -> None:
    client, _ = talking(tmp_path)
    lines = client.result("save", **{"as": "sequence"}).splitlines()
    assert lines[0] == "sequenceDiagram"
    text = "\n".join(lines)
    assert "outside->>m0: go" in text
    assert "m0->>m1: came(3)" in text
    assert "200ms" in text


def test_a_sequence_of_a_chart_has_what_leaves_it(gate: Path) -> None:
    client = Client(Hub(fsmkit.read_chart(gate), file=gate))
    client.result("post", m="Gate", event="open")
    client.result("step", how="timer")
    text = client.result("save", **{"as": "sequence"})
    assert "outside->>m0: open" in text
    assert "m0->>outside: opened" in text


def test_what_no_test_in_c_says_is_refused(gate: Path, tmp_path: Path) -> None:
    client = Client(Hub(fsmkit.read_chart(gate)))
    assert client.say("save", **{"as": "c"})["k"] == "refused"
    client, _ = talking(tmp_path)
    client.result("set", m="pong", input="dark", value=True)
    answer = client.say("save", **{"as": "c"})
    assert answer["k"] == "refused"
    assert "input of a system" in answer["message"]
