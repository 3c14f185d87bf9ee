"""Deployments: what is read, what is refused, what is written."""

from __future__ import annotations

import json
import subprocess
from collections.abc import Callable, Mapping
from pathlib import Path

import pytest

from fsmkit.cli import execute
from fsmkit.cli.tools.paths import PATHS
from fsmkit.diagnostics import Findings, FsmkitError
from fsmkit.runtime.links import EventMap
from fsmkit.system.any_file import read
from fsmkit.system.deployment.deployment import Deployment
from tests.codegen.c.conftest import WARNINGS

SYSTEM = """\
system: Pair
machines: {left: side.yaml, right: side.yaml, world: world.yaml}
connect:
  - {left.ping -> right.pong: {kind: lossy, loss: 1}}
  - right.ping -> left.pong
  - left.busy -> right.other
  - right.busy -> left.other
environment: {will: [world], may: [left.go, right.go]}
"""
SIDE = """\
chart: Side
inputs: {other: bool}
outputs: {busy: bool = true}
events: {in: [go, pong(n 0..9)], out: [ping(n 0..9)]}
initial: idle
states:
  idle:
    on:
      go: {if: not other, do: send ping(n = 3)}
      pong: {do: busy = event.n > 4}
"""
WORLD = "chart: World\ninitial: there\nstates: {there: {}}\n"


def load_deployment(path: Path, findings: Findings | None = None) -> Deployment:
    """Return the deployment of a file."""
    found = read(path, Findings() if findings is None else findings)
    assert isinstance(found, Deployment)
    return found


@pytest.fixture
def write_pair(tmp_path: Path) -> Callable[[str], Path]:
    """Write a deployment beside its system."""

    def written(text: str) -> Path:
        for name, content in (
            ("pair", SYSTEM),
            ("side", SIDE),
            ("world", WORLD),
            ("deployment", text),
        ):
            (tmp_path / f"{name}.yaml").write_text(content, encoding="utf-8")
        return tmp_path / "deployment.yaml"

    return written


LANGUAGE = {"gcc": ["-std=c99"], "clang": ["-std=c99"], "g++": ["-x", "c++"]}
WHOLE = "system: pair.yaml\nnodes: {a: [left], b: [right]}\n"

FAR = WHOLE + "links: {endpoints: {a: 'tcp://x:1', b: 'ipc://y'}}\n"


def test_the_environment_needs_no_node_and_channels_are_links(
    write_pair: Callable[[str], Path],
) -> None:
    path = write_pair(
        WHOLE + "links: {every: 10, insecure: true, endpoints: {a: 'tcp://x:1', b: 'ipc://y'}}\n"
    )
    deployment = load_deployment(path)
    assert read(path, Findings()) == deployment
    assert not isinstance(read(path.parent / "pair.yaml", Findings()), Deployment)
    assert [message.name for message in deployment.map.messages] == [
        "left.ping -> right.pong",
        "right.ping -> left.pong",
    ]
    assert len(deployment.map.levels) == 2
    assert deployment.placed == (0, 1, None)
    assert deployment.every == 10
    assert deployment.map.endpoints == ("tcp://x:1", "ipc://y")


def test_the_hash_is_of_what_crosses_not_of_endpoints(write_pair: Callable[[str], Path]) -> None:
    plain = load_deployment(write_pair(WHOLE)).map
    ends = WHOLE + "links: {insecure: true, endpoints: {a: 'tcp://x:1', b: 'tcp://y:2'}}\n"
    assert load_deployment(write_pair(ends)).map.hash == plain.hash
    swapped = "system: pair.yaml\nnodes: {b: [right], a: [left]}\n"
    assert load_deployment(write_pair(swapped)).map.hash != plain.hash


@pytest.mark.parametrize("count", [9, 16, 255, 257])
@pytest.mark.parametrize("command", [["check"], ["compile", "--quiet", "--out", "made"]])
def test_more_nodes_than_a_link_has_are_rejected_by_every_command(
    command: list[str],
    count: int,
    write_pair: Callable[[str], Path],
    capsys: pytest.CaptureFixture[str],
) -> None:
    nodes = ", ".join(f"n{number}: [left]" for number in range(count))
    path = write_pair(f"system: pair.yaml\nnodes: {{{nodes}}}\n")
    assert execute([command[0], str(path), *command[1:]]) == 1
    found = capsys.readouterr().err
    assert f"a deployment has 1 to 8 nodes, not {count}" in found
    assert "help: place several machines on one node" in found


@pytest.mark.parametrize(
    ("text", "rule", "message"),
    [
        ("nodes: {a: [left]}\n", "broken-deployment", "`right` of `Pair` has no node"),
        ("nodes: {a: [left, right], b: [left]}\n", "broken-deployment", "`left` has a node"),
        ("nodes: {a: [lift], b: [right]}\n", "unknown-name", "no machine `lift`"),
        ("links: {}\nnodes: {a: [left]}\n", "broken-deployment", "needs `system` and `nodes`"),
        ("nodes: {}\n", "broken-deployment", "1 to 8 nodes"),
        ("nodes: {a b: [left, right]}\n", "broken-deployment", "not a valid node name"),
        (WHOLE + "links: {endpoints: {a: 'ipc://x'}}\n", "broken-deployment", "`b` has no"),
        (FAR, "unguarded-endpoint", "`tcp://x:1` is not of this computer only"),
        (FAR.replace("{e", "{insecure: false, e"), "unguarded-endpoint", "`tcp://x:1`"),
        (FAR.replace("{e", "{insecure: maybe, e"), "unexpected-value", "`true` or `false`"),
        (FAR.replace("{e", "{insecure: true, curve: k, e"), "broken-deployment", "has no meaning"),
        (WHOLE + "links: {every: 0}\n", "unexpected-value", "1 to 65535"),
        (WHOLE + "links: {speed: 1}\n", "unknown-key", "speed"),
        ("system: none.yaml\nnodes: {a: [left]}\n", "unreadable-file", "none.yaml"),
    ],
)  # fmt: skip
def test_a_wrong_deployment_is_refused(
    text: str, rule: str, message: str, write_pair: Callable[[str], Path]
) -> None:
    system = "" if "system:" in text or text.startswith("links") else "system: pair.yaml\n"
    with pytest.raises(FsmkitError) as caught:
        load_deployment(write_pair(system + text))
    found = {(finding.rule.name, finding.message) for finding in caught.value.diagnostics}
    assert any(name == rule and message in told for name, told in found), found


@pytest.mark.parametrize(
    ("node", "links", "message"),
    [
        ("a: {machines: [left]}", "{}", ""),
        ("a: {machines: [left], silent: [right.lost], within: 100ms}", "{}", ""),
        ("a: {machines: [left], silent: [right.lost], within: 50ms}", "{watchdog: 50ms}", ""),
        ("c: {machines: [left], silent: [right.lost], within: 1ms}", "{}", ""),
        ("a: {machines: [left, right]}", "{}", "the node `a` has other machines here"),
        ("a: {machines: [left], silent: [right.lost], within: 99ms}", "{}", "may send for 100ms"),
        (
            "a: {machines: [left], silent: [right.lost], within: 10ms..90ms}",
            "{watchdog: 91ms}",
            "may send for 91ms, but the silence of `a` is noticed within 90ms",
        ),
    ],
)
def test_a_node_freezes_as_its_deployment_lets_it(
    node: str, links: str, message: str, write_pair: Callable[[str], Path]
) -> None:
    path = write_pair(f"{WHOLE}links: {links}\n")
    text = SYSTEM.replace("{will:", f"{{freezes: {{{node}}}, will:")
    (path.parent / "pair.yaml").write_text(text)
    (path.parent / "side.yaml").write_text(SIDE.replace("[go, pong", "[lost, go, pong"))
    if not message:
        (freezer,) = load_deployment(path).written.freezers
        assert freezer.frozen == (0,)
        return
    with pytest.raises(FsmkitError) as caught:
        load_deployment(path)
    (found,) = [f for f in caught.value.diagnostics if f.rule.name == "broken-deployment"]
    assert message in found.message
    assert found.primary is not None
    assert found.primary.span.source.name.endswith("pair.yaml")


def test_an_endpoint_beyond_the_computer_needs_keys_or_the_word_insecure(
    write_pair: Callable[[str], Path],
) -> None:
    path = write_pair(FAR)
    with pytest.raises(FsmkitError) as caught:
        load_deployment(path)
    (found,) = caught.value.diagnostics
    assert found.primary is not None
    span = found.primary.span
    assert path.read_text()[span.start : span.end].strip("'") == "tcp://x:1"
    keys = load_deployment(write_pair(FAR.replace("{e", "{curve: keys, e")))
    assert (keys.map.is_insecure, keys.keys) == (False, path.parent / "keys")
    said = load_deployment(write_pair(FAR.replace("{e", "{insecure: true, e"))).map
    assert said.is_insecure
    assert said.hash == keys.map.hash
    assert EventMap.from_json(said.as_json()).is_insecure
    assert not EventMap.from_json(keys.map.as_json()).is_insecure


def test_the_c_of_a_node_knows_whether_the_deployment_says_insecure(
    write_pair: Callable[[str], Path], tmp_path: Path
) -> None:
    for word in ("true", "false"):
        text = FAR.replace("{e", f"{{insecure: {word}, e").replace("tcp://x:1", "ipc://x")
        out = tmp_path / word
        assert execute(["compile", str(write_pair(text)), "--out", str(out)]) == 0
        assert f"    1u,\n    {word},\n" in (out / "a/pair_a.c").read_text()


def test_what_no_link_can_carry_is_refused(write_pair: Callable[[str], Path]) -> None:
    path = write_pair(WHOLE)
    asking = SYSTEM.replace("  - left.busy", "  - left.ask -> right.go\n  - left.busy")
    (path.parent / "pair.yaml").write_text(asking)
    side = SIDE.replace("initial:", "operations: [ask() -> bool]\ninitial:")
    (path.parent / "side.yaml").write_text(side.replace("not other", "not other and ask()"))
    findings = Findings()
    with pytest.raises(FsmkitError):
        load_deployment(path, findings)
    assert {"not-joined", "broken-deployment"} <= {found.rule.name for found in findings}


@pytest.mark.external
def test_each_node_is_written_with_the_map(
    write_pair: Callable[[str], Path], require_tool: Callable[[str], str], tmp_path: Path
) -> None:
    out = tmp_path / "out"
    assert execute(["compile", str(write_pair(WHOLE)), "--out", str(out)]) == 0
    found = {str(path.relative_to(out)) for path in out.rglob("*") if path.is_file()}
    machine = {"side.c", "side.h", "fsm.c", "fsm.h"}
    assert found == {
        "links.json",
        *(f"a/{name}" for name in machine | {"pair_a.c", "pair_a.h"}),
        *(f"b/{name}" for name in machine | {"pair_b.c", "pair_b.h"}),
    }
    event_map = EventMap.from_json((out / "links.json").read_text())
    assert event_map.hash == load_deployment(tmp_path / "deployment.yaml").map.hash
    includes = [f"-I{PATHS[name]}" for name in ("links", "hosts")]
    for node in "ab":
        for compiler in ("gcc", "clang", "g++"):
            done = subprocess.run(
                [
                    *(require_tool(compiler), *LANGUAGE[compiler], *WARNINGS, *includes),
                    *("-c", f"pair_{node}.c", "-o", "/dev/null"),
                ],
                cwd=out / node,
                capture_output=True,
                text=True,
                check=False,
            )
            assert done.returncode == 0, done.stderr


def test_python_machines_of_a_node_have_the_map_beside_them(
    write_pair: Callable[[str], Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    path = write_pair(WHOLE)
    assert execute(["compile", str(path), "--target", "python", "--out", str(out), "--json"]) == 0
    told: Mapping[str, list[str]] = json.loads(capsys.readouterr().out)
    names = {str(Path(name).relative_to(out)) for name in told["files"]}
    assert names == {"links.json", "a/side.py", "b/side.py"}
