"""Foreign nodes of ROS: topics, types and QoS of connections, and what does not fit."""

from __future__ import annotations

import re
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest

from fsmkit.carriers.ros.messages import camel, event_type, holds, level_type, lower, package_name
from fsmkit.carriers.ros.network import ros_nodes
from fsmkit.cli import execute
from fsmkit.diagnostics import FsmkitError
from fsmkit.language import BOOL, DURATION, EnumType, FloatType, IntType, Type
from tests.carriers.ros.cell import DEPLOYMENT, FILES, written
from tests.reading import load_deployment


@pytest.fixture
def write(tmp_path: Path) -> Callable[..., Path]:
    """Write a deployment with a lens in ROS; changes by the names of files."""
    return lambda **changes: written(tmp_path, **changes)


def test_connections_are_topics_of_the_foreign_machine(write: Callable[..., Path]) -> None:
    (node,) = ros_nodes(load_deployment(write())).values()
    assert (node.domain, node.namespace) == (7, "/cell")
    found = {
        wire.topic.name: (str(wire.topic.type), wire.topic.qos, wire.sender) for wire in node.wires
    }
    assert found == {
        "/cell/lens/judged": ("fsmkit_cell/msg/LensJudged", "default", 1),
        "/cell/lens/look": ("fsmkit_cell/msg/LensLook", "default", 0),
        "/cell/lens/light": ("std_msgs/msg/UInt16", "state", 1),
        "/cell/lens/is_sharp": ("std_msgs/msg/Bool", "state", 1),
        "/cell/lens/encoder": ("std_msgs/msg/Int32", "state", 0),
        "/cell/lens/pause": ("builtin_interfaces/msg/Duration", "state", 0),
    }
    assert node.start == (0, True)
    judged = next(wire for wire in node.wires if wire.topic.name == "/cell/lens/judged")
    assert [field.name for field in judged.topic.type.fields] == [
        *("session", "sequence", "events"),
        *("quality", "verdict", "took", "ratio"),
    ]
    # the camera takes (verdict, quality), by names: the values are in its order
    assert [part.field for part in judged.parts] == ["verdict", "quality"]


def test_compile_writes_messages_and_their_idl(write: Callable[..., Path], tmp_path: Path) -> None:
    assert execute(["compile", str(write()), "--out", str(tmp_path / "out")]) == 0
    out = tmp_path / "out"
    assert sorted(path.name for path in (out / "msg").iterdir()) == [
        "LensJudged.msg",
        "LensLook.msg",
    ]
    assert (out / "msg/LensJudged.msg").read_text().splitlines()[1:] == [
        "uint32 session",
        "uint32 sequence",
        "uint32 events",
        "uint8 quality",
        "uint8 VERDICT_GOOD=0",
        "uint8 VERDICT_BAD_2=1",
        "uint8 verdict",
        "builtin_interfaces/Duration took",
        "float32 ratio",
    ]
    text = (out / "idl/fsmkit_cell_LensJudged_.idl").read_text()
    for line in (
        '#include "builtin_interfaces_Duration_.idl"',
        "module fsmkit_cell {",
        "struct LensJudged_ {",
        "const uint8 VERDICT_BAD_2 = 1;",
        "uint8 verdict;",
        "unsigned long session;",
        "builtin_interfaces::msg::dds_::Duration_ took;",
        "float ratio;",
    ):
        assert line in text, text
    names = {path.name for path in (out / "idl").iterdir()}
    assert {"std_msgs_UInt16_.idl", "builtin_interfaces_Duration_.idl"} <= names


def test_what_is_bound_has_other_topics_types_and_qos(write: Callable[..., Path]) -> None:
    bind = """\
        bind:
          lens.judged->camera.judged:
            topic: /vision/verdict
            type: std_msgs/msg/UInt8
            fields: {quality: data, verdict: data}
          belt.position -> lens.encoder: {topic: belt, type: std_msgs/msg/Int64, qos: sensor}
          camera.look -> lens.look: {topic: /go, type: std_msgs/msg/Empty}
"""
    files = {"belt": FILES["belt"], "lens": FILES["lens"].replace("look(near bool)", "look")}
    files["camera"] = (
        FILES["camera"].replace("look(near bool)", "look").replace("(near = true)", "")
    )
    (node,) = ros_nodes(load_deployment(write(deployment=DEPLOYMENT + bind, **files))).values()
    found = {wire.topic.name: wire for wire in node.wires}
    assert [part.field for part in found["/vision/verdict"].parts] == ["data", "data"]
    assert not found["/vision/verdict"].topic.type.is_counted
    belt = found["/cell/belt"].topic
    assert (str(belt.type), belt.qos, belt.is_event) == ("std_msgs/msg/Int64", "sensor", False)
    assert found["/go"].parts == ()


def bound(text: str) -> dict[str, str]:
    return {"deployment": f"{DEPLOYMENT}        bind: {{{text}}}\n"}


JUDGED = "lens.judged -> camera.judged"
POSITION = "belt.position -> lens.encoder"


@pytest.mark.parametrize(
    ("change", "rule", "message", "place"),
    [
        (bound(f"{POSITION}: {{type: std_msgs/msg/Int16}}"), "unfit-message",
         "is `-100000..100000`, which `std_msgs/msg/Int16` does not hold", POSITION),
        (bound(f"{POSITION}: {{type: std_msgs/msg/Float64}}"), "unfit-message",
         "which `std_msgs/msg/Float64` does not hold", POSITION),
        (bound(f"{JUDGED}: {{type: std_msgs/msg/Bool, fields: {{verdict: data}}}}"),
         "unfit-message", "`verdict` is `Verdict`", "data"),
        (bound(f"{JUDGED}: {{type: std_msgs/msg/UInt8}}"), "unfit-message",
         "`std_msgs/msg/UInt8` has no field for `verdict`", JUDGED),
        (bound(f"{JUDGED}: {{type: std_msgs/msg/UInt8, fields: {{quality: date}}}}"),
         "unfit-message", "has no field for `quality`", "date"),
        (bound(f"{JUDGED}: {{type: std_msgs/msg/UInt8, fields: {{m: data}}}}"), "unknown-name",
         "has no value `m`", "data"),
        (bound(f"{JUDGED}: {{fields: {{quality: data}}}}"),
         "unfit-message", "fields of no type", "data"),
        (bound(f"{POSITION}: {{type: std_msgs/msg/Int23}}"), "unexpected-value",
         "type of messages `std_msgs/msg/Int23` is unknown", "std_msgs/msg/Int23"),
        (bound(f"{POSITION}: {{type: geometry_msgs/msg/Pose}}"), "unfit-message",
         "cannot be bound", "geometry_msgs/msg/Pose"),
        (bound(f"{POSITION}: {{topic: {'a/' * 150}b}}"), "unexpected-value", "not a topic",
         "a/" * 150 + "b"),
        (bound(f"{POSITION}: {{qos: fast}}"), "unexpected-value", "QoS `fast` is unknown", "fast"),
        (bound(f"{POSITION}: {{topic: a__b}}"), "unexpected-value", "not a topic", "a__b"),
        (bound(f"{POSITION}: {{topic: '/1'}}"), "unexpected-value", "not a topic", "/1"),
        (bound(f"{POSITION}: {{topics: a}}"), "unknown-key", "topics", "topics"),
        (bound("belt.position -> lens.decoder: {topic: a}"), "unknown-name",
         "no connection with this node", "belt.position -> lens.decoder"),
        (bound(f"{POSITION}: {{topic: lens/light}}"), "unfit-message",
         "the topic `/cell/lens/light` would have two types", "lens/light"),
        (bound(f"{POSITION}: {{topic: lens/light, type: std_msgs/msg/UInt16}}"), "unfit-message",
         "does not hold", POSITION),
        ({"deployment": DEPLOYMENT.replace("domain: 7", "domain: 233")}, "unexpected-value",
         "0 to 232", "233"),
        ({"deployment": DEPLOYMENT.replace("/cell", "'a b'")}, "unexpected-value",
         "not a namespace", "a b"),
        ({"camera": FILES["camera"].replace("quality 0..255)", "quality 0..255) -> bool")},
         "unfit-message", "`camera.judged` is answered", "ros"),
    ],
)  # fmt: skip
def test_what_does_not_fit_is_a_finding_at_its_place(
    change: dict[str, str], rule: str, message: str, place: str, write: Callable[..., Path]
) -> None:
    with pytest.raises(FsmkitError) as caught:
        load_deployment(write(**change))
    found = []
    for each in caught.value.diagnostics:
        span = None if each.primary is None else each.primary.span
        text = "" if span is None else span.source.text[span.start : span.end]
        found.append((each.rule.name, each.message, text))
    assert any(r == rule and message in m and p == place for r, m, p in found), found


def test_one_topic_is_not_for_both_sides(write: Callable[..., Path]) -> None:
    bind = f"{POSITION}: {{topic: /x, type: std_msgs/msg/Int32}}, "
    bind += "lens.light -> camera.light: {topic: /x, type: std_msgs/msg/Int32}"
    with pytest.raises(FsmkitError, match="messages of both sides"):
        load_deployment(write(**bound(bind)))


def test_two_foreign_nodes_are_not_connected(write: Callable[..., Path]) -> None:
    split = "b: [camera]\n  c: {machines: [belt], foreign: can}"
    deployment = DEPLOYMENT.replace("b: [camera, belt]", split)
    cell = FILES["cell"].replace("[lens]", "[lens, belt]")
    with pytest.raises(FsmkitError, match="both are on foreign nodes"):
        load_deployment(write(deployment=deployment, cell=cell))


@pytest.mark.parametrize(
    ("type_", "expected"),
    [
        (BOOL, "std_msgs/msg/Bool"),
        (IntType(0, 255), "std_msgs/msg/UInt8"),
        (IntType(-1, 127), "std_msgs/msg/Int8"),
        (IntType(0, 256), "std_msgs/msg/UInt16"),
        (IntType(-1, 128), "std_msgs/msg/Int16"),
        (IntType(-(2**31), 2**31 - 1), "std_msgs/msg/Int32"),
        (IntType(0, 2**64 - 1), "std_msgs/msg/UInt64"),
        (IntType(-1, 2**63 - 1), "std_msgs/msg/Int64"),
        (EnumType("E", ("a", "b")), "std_msgs/msg/UInt8"),
        (FloatType(32), "std_msgs/msg/Float32"),
        (FloatType(64), "std_msgs/msg/Float64"),
        (DURATION, "builtin_interfaces/msg/Duration"),
    ],
)
def test_the_smallest_type_is_chosen(type_: Type, expected: str) -> None:
    assert str(level_type(type_)) == expected


def test_types_hold_what_fits_unchanged() -> None:
    assert holds("float64", FloatType(32))
    assert not holds("float32", FloatType(64))
    assert not holds("int64", IntType(0, 2**63))
    assert not holds("uint8", BOOL)
    assert not holds("bool", IntType(0, 1))


def test_names_are_those_that_ros_allows() -> None:
    assert package_name("FeederBelt 2") == "fsmkit_feeder_belt_2"
    assert camel("lens[3]", "is_sharp") == "Lens3IsSharp"
    assert camel("é", "1") == "M1"
    assert (lower("_Is__sharp_"), lower("2nd"), lower("é")) == ("is_sharp", "f2nd", "f")


def test_no_field_has_the_name_of_a_keyword_of_c_or_a_counter() -> None:
    fields = [(name, BOOL) for name in ("register", "Class", "events", "near", "Near")]
    type_, names = event_type(package_name("Cell"), camel("Look"), fields)
    assert names == ("register_2", "class_2", "events_2", "near", "near_2")
    assert [field.name for field in type_.fields[3:]] == list(names)


@pytest.mark.cc
def test_a_check_with_a_foreign_node_is_the_check_of_the_system(
    write: Callable[..., Path], capsys: pytest.CaptureFixture[str]
) -> None:
    seeing = """\
  seeing:
    after:
      10ms..20ms: {do: "light = 1000 - light; send judged(quality = 7, verdict = Verdict.good, took = 5ms, ratio = 0.5)", target: seeing}
    on: {look: {target: seeing}}
"""  # noqa: E501
    lens = FILES["lens"].split("  seeing:\n")[0] + seeing
    deployment = write(lens=lens)
    explored = []
    for path in (deployment.with_name("cell.yaml"), deployment):
        execute(["check", str(path)])
        shown = capsys.readouterr().out
        explored.append(re.search(r"all (\d+) states.*depth \d+", shown))
    alone, deployed = explored
    assert alone is not None
    assert deployed is not None
    assert alone[0] == deployed[0]
    assert int(alone[1]) > 1


@pytest.mark.external
def test_idl_is_what_a_compiler_of_dds_takes(
    write: Callable[..., Path], tmp_path: Path, require_tool: Callable[[str], str]
) -> None:
    compiler = require_tool("idlc")
    bind = f"{POSITION}: {{topic: /x, type: std_msgs/msg/Int64}}, "
    bind += "camera.look -> lens.look: {topic: /go, type: std_msgs/msg/Empty}"
    files = {name: FILES[name].replace("look(near bool)", "look") for name in ("lens", "camera")}
    files["camera"] = files["camera"].replace("(near = true)", "")
    path = write(**bound(bind), **files)
    assert execute(["compile", str(path), "--out", str(tmp_path / "out")]) == 0
    found = sorted((tmp_path / "out/idl").iterdir())
    assert len(found) == 7
    for each in found:
        subprocess.run(
            [compiler, "-o", str(tmp_path), each.name], cwd=each.parent, check=True, text=True
        )
    made = (tmp_path / "fsmkit_cell_LensJudged_.c").read_text()
    assert '"fsmkit_cell::msg::dds_::LensJudged_"' in made
