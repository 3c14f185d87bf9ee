"""A package of ROS: its manifest, its messages by rosidl, its program with a stand-in for rclc."""

from __future__ import annotations

import subprocess
from collections.abc import Callable, Sequence
from pathlib import Path

import pytest
from lxml import etree

import fsmkit
from fsmkit.carriers.ros.definitions import EMPTY, with_nested
from fsmkit.carriers.ros.messages import DURATION, INTEGERS, RosType
from fsmkit.carriers.ros.network import ros_nodes
from fsmkit.carriers.ros.rclc_tables import header_of
from fsmkit.cli import execute
from fsmkit.system.deployment.deployment import Deployment
from tests.carriers.ros.cell import DEPLOYMENT, written
from tests.carriers.ros.test_c_carrier import ROS, WARNINGS
from tests.carriers.ros.test_rclpy import ROS_PYTHON
from tests.needs import where

HERE = Path(__file__).parent
STAND_IN = HERE / "rclc_stand_in"


TURNING = """\
chart: Camera
types: {Verdict: [good, bad_2]}
data: {seen: 0..255 = 0, last: Verdict = Verdict.good}
inputs: {light: 0..1000, is_sharp: bool}
events: {in: ["judged(verdict Verdict, quality 0..255)"], out: [look(near bool)]}
initial: both
states:
  both:
    regions:
      turning:
        initial: waiting
        states:
          waiting:
            on: {judged: {do: "seen = event.quality; send look(near = true)", target: judging}}
          judging:
            on: {judged: {do: "last = event.verdict; send look(near = true)", target: waiting}}
      other: {initial: idle, states: {idle: {}}}
"""
"""Its active states change with each verdict, and there are two of them."""


def packed(folder: Path, **changes: str) -> Path:
    out = folder / "package"
    path = written(folder, **changes)
    assert execute(["compile", str(path), "--package", "ros2", "--out", str(out), "--quiet"]) == 0
    return out


def test_the_manifest_names_what_the_messages_need(tmp_path: Path) -> None:
    out = packed(tmp_path)
    root = etree.fromstring((out / "package.xml").read_bytes())
    assert root.findtext("name") == "fsmkit_cell"
    depends = [each.text for each in root.findall("depend")]
    assert depends == ["rclc", "builtin_interfaces", "std_msgs"]
    cmake = (out / "CMakeLists.txt").read_text(encoding="utf-8")
    listed = {line.strip() for line in cmake.splitlines() if line.strip().endswith(".c")}
    assert listed == {str(path.relative_to(out)) for path in (out / "src").rglob("*.c")}
    assert '"msg/LensJudged.msg"' in cmake


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"deployment": DEPLOYMENT.replace("[camera, belt]", "[camera]\n  c: [belt]")}, "`b`|`c`"),
        ({"cell": "chart: Cell\ninitial: a\nstates: {a: {}}\n", "deployment": ""}, "deployment"),
    ],
)
def test_what_topics_do_not_carry_is_refused(
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    changes: dict[str, str],
    message: str,
) -> None:
    path = written(tmp_path, **changes)
    if not changes["deployment"]:
        path = tmp_path / "cell.yaml"
    code = execute(["compile", str(path), "--package", "ros2", "--out", str(tmp_path / "x")])
    if message == "deployment":
        assert code == 2
        assert "is built from a deployment" in capsys.readouterr().err
    else:  # each node has topics, and none joins the two
        assert code == 0
        assert {p.name for p in (tmp_path / "x/src").iterdir()} == {"b", "c", "link"}


def test_nodes_that_speak_in_frames_are_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    from tests.carriers.ros.counting import between

    path = between(tmp_path, 7)
    assert execute(["compile", str(path), "--package", "ros2", "--out", str(tmp_path / "x")]) == 2
    assert "joins two nodes of fsmkit" in capsys.readouterr().err


C_TYPES = {"bool": "bool", "float32": "float", "float64": "double", DURATION: "struct duration"}
C_TYPES |= {name: f"{name}_t" for name in INTEGERS}


def header(type_: RosType) -> str:
    """Return what rosidl_generator_c makes of a message, as far as it is used here."""
    name = f"{type_.package}__msg__{type_.name}"
    rows = [(C_TYPES[each.type], str(each.name)) for each in type_.fields] or [("uint8_t", EMPTY)]
    guard = f"{name}_H".upper()
    duration = "builtin_interfaces__msg__Duration"
    lines = [f"#ifndef {guard}", f"#define {guard}", "#include <rcl/rcl.h>"]
    if any(each.type == DURATION for each in type_.fields):
        lines.append("#include <builtin_interfaces/msg/duration.h>")
    lines += ["typedef struct {"]
    lines += [f"    {kind} {field};".replace("struct duration", duration) for kind, field in rows]
    support = f"support_{name}"
    lines += [f"}} {name};", f"static inline const rosidl_message_type_support_t *{support}(void)"]
    made = f'{{"{type_.package}/{type_.name}"}};'
    lines += ["{", f"    static const rosidl_message_type_support_t found = {made}"]
    lines += ["    return &found;", "}", "#endif", ""]
    return "\n".join(lines)


STRING = """\
#ifndef STD_MSGS__MSG__STRING_H
#define STD_MSGS__MSG__STRING_H
#include <rcl/rcl.h>
typedef struct {
    struct {
        char *data;
        size_t size, capacity;
    } data;
} std_msgs__msg__String;
static inline const rosidl_message_type_support_t *support_std_msgs__msg__String(void)
{
    static const rosidl_message_type_support_t found = {"std_msgs/String"};
    return &found;
}
#endif
"""


def stand_ins(folder: Path, types: Sequence[RosType]) -> Path:
    (folder / "std_msgs/msg").mkdir(parents=True)
    (folder / "std_msgs/msg/string.h").write_text(STRING, encoding="utf-8")
    for type_ in types:
        path = folder / header_of(type_)
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(header(type_), encoding="utf-8")
    return folder


@pytest.mark.external
@pytest.mark.cc
@pytest.mark.parametrize("compiler", ["gcc", "clang"])
def test_the_program_runs_with_a_stand_in_and_allocates_nothing(
    tmp_path: Path, require_tool: Callable[[str], str], compiler: str
) -> None:
    out = packed(tmp_path, camera=TURNING)
    deployment = fsmkit.read(tmp_path / "deployment.yaml")
    assert isinstance(deployment, Deployment)
    types = with_nested(type_ for ros in ros_nodes(deployment).values() for type_ in ros.types)
    messages = stand_ins(tmp_path / "messages", types)
    folders = [out / "src/b", out / "src/link", STAND_IN, messages]
    flags = [*WARNINGS, "-g", *(f"-I{folder}" for folder in folders)]
    sources = sorted((out / "src").rglob("*.c"))
    tool = require_tool(compiler)
    subprocess.run([tool, *flags, "-c", *map(str, sources)], cwd=tmp_path, check=True)
    objects = sorted(map(str, tmp_path.glob("*.o")))
    named = subprocess.run(["nm", "-u", *objects], capture_output=True, text=True, check=True)
    needed = {line.split()[-1] for line in named.stdout.splitlines() if " U " in line}
    assert "rcl_publish" in needed
    assert not needed & {"malloc", "calloc", "realloc", "free", "strdup"}
    sanitize = ["-fsanitize=address,undefined"] if compiler == "gcc" else []
    command = [tool, *flags, *sanitize, str(STAND_IN / "rclc.c"), *map(str, sources)]
    subprocess.run([*command, "-o", str(tmp_path / "node")], check=True)
    done = subprocess.run([str(tmp_path / "node")], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines() == [
        "domain 7",
        "/cell/camera/state waiting idle",
        "/cell/belt/state moving",
        "/cell/lens/encoder",
        "/cell/lens/pause",
        "/cell/lens/look 0 0 1",
        "/cell/camera/state judging idle",
        "/cell/lens/look 1 1 1",
        "/cell/camera/state waiting idle",
    ]
    names = [tool, *flags, "-DFSM_NO_NAMES", str(STAND_IN / "rclc.c"), *map(str, sources)]
    subprocess.run([*names, "-o", str(tmp_path / "nameless")], check=True)
    done = subprocess.run([tmp_path / "nameless"], capture_output=True, text=True, check=True)
    assert "/state" not in done.stdout


LONG = """
#include "fsm_rclc_state.h"
#include <stdio.h>
#include <string.h>
static int refused;
rcl_publisher_t rcl_get_zero_initialized_publisher(void) { return (rcl_publisher_t){0, 0}; }
rcl_ret_t rclc_publisher_init(rcl_publisher_t *p, const rcl_node_t *n,
                              const rosidl_message_type_support_t *t, const char *topic,
                              const rmw_qos_profile_t *q)
{
    (void)n, (void)t, (void)topic, (void)p;
    return q->durability == RMW_QOS_POLICY_DURABILITY_TRANSIENT_LOCAL ? RCL_RET_OK : RCL_RET_ERROR;
}
rcl_ret_t rcl_publisher_fini(rcl_publisher_t *p, rcl_node_t *n) { (void)p, (void)n; return 0; }
rcl_ret_t rcl_publish(const rcl_publisher_t *p, const void *m, rmw_publisher_allocation_t *a)
{
    const std_msgs__msg__String *text = m;
    (void)p, (void)a;
    if (refused-- > 0)
        return RCL_RET_ERROR;
    printf("%zu %s\\n", text->data.size, text->data.data);
    return RCL_RET_OK;
}
static fsm_rclc_state shown;
static void show(int count)
{
    fsm_rclc_state_begin(&shown);
    for (int i = 0; i < count; i++)
        fsm_rclc_state_add(&shown, i == 2 ? "a_name_that_does_not_fit" : "four");
    fsm_rclc_state_end(&shown);
}
int main(void)
{
    if (fsm_rclc_state_open(&shown, NULL, "/x") != RCL_RET_OK)
        return 1;
    show(3);
    show(4);
    refused = 1;
    show(1);
    show(1);
    show(1);
    show(0);
    printf("%u\\n", (unsigned)shown.unsent);
    fsm_rclc_state_close(&shown, NULL);
    show(1);
    return 0;
}
"""


@pytest.mark.cc
def test_states_that_do_not_fit_are_cut_off_between_names(
    tmp_path: Path, require_tool: Callable[[str], str]
) -> None:
    folder = ROS / "rclc"
    (tmp_path / "long.c").write_text(LONG, encoding="utf-8")
    folders = [folder, STAND_IN, stand_ins(tmp_path / "messages", [])]
    command = [require_tool("gcc"), *WARNINGS, "-DFSM_RCLC_TEXT=12"]
    command += ["-fsanitize=address,undefined", *(f"-I{each}" for each in folders)]
    command += [str(tmp_path / "long.c"), str(folder / "fsm_rclc_state.c")]
    subprocess.run([*command, "-o", str(tmp_path / "long")], check=True)
    done = subprocess.run([tmp_path / "long"], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines() == ["9 four four", "4 four", "0 ", "1"]


@pytest.mark.external
@where(ROS_PYTHON, "no rclpy here, a part of ROS: FSMKIT_ROS_PYTHON names a Python with it")
def test_rosidl_reads_the_messages(tmp_path: Path) -> None:
    out = packed(tmp_path)
    script = (
        "import sys, pathlib\n"
        "from rosidl_adapter.msg import convert_msg_to_idl\n"
        "root = pathlib.Path(sys.argv[1])\n"
        "for path in sorted(root.glob('msg/*.msg')):\n"
        "    made = convert_msg_to_idl(root, 'fsmkit_cell', path.relative_to(root), root / 'idl')\n"
        "    print(made.name)\n"
    )
    done = subprocess.run(
        [ROS_PYTHON, "-c", script, str(out)], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.splitlines()[-2:] == ["LensJudged.idl", "LensLook.idl"] or {
        "LensJudged.idl", "LensLook.idl",
    } <= set(done.stdout.split())  # fmt: skip
    text = (out / "idl" / "LensJudged.idl").read_text(encoding="utf-8")
    assert "builtin_interfaces::msg::Duration took;" in text
    assert "const uint8 VERDICT_BAD_2 = 1;" in text
