"""Every message of the Production Cell on two boards, through the C that is generated of it."""

from __future__ import annotations

import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest

from fsmkit.chart.chart import Chart
from fsmkit.cli import execute
from fsmkit.codegen.system.node import Node, nodes_of
from fsmkit.emit import snake
from fsmkit.runtime.links.codec import Codec, Frame
from fsmkit.system.deployment.deployment import Deployment
from tests.runtime.links.conftest import HOSTS, LINKS, LOCAL

HOOKS = """\
#include <stdio.h>
#define FSM_HOOK_EVENT(m, what, e) \\
    ((void)(m), (int)(what) == 11 ? (void)printf("%s %d\\n", CHART, (int)(e)->event) : (void)0)
"""
MAIN = """\
#include "fsm_link.h"
#include "NODE.h"
#include <string.h>
static fsm_link wire;
static NODE node;
int main(void)
{
    char line[256];
    fsm_link_frame frame;
    fsm_link_init(&wire, &NODE_map, 4u);
    NODE_init(&node);
    node.link = &wire;
    (void)NODE_start(&node, 0u);
    while (fgets(line, sizeof line, stdin) != NULL) {
        uint8_t bytes[128];
        size_t length = strcspn(line, "\\n") / 2u;
        for (size_t i = 0u; i < length; i++) {
            unsigned byte = 0u;
            (void)sscanf(line + 2u * i, "%2x", &byte);
            bytes[i] = (uint8_t)byte;
        }
        (void)fsm_link_arrive(&wire, (uint8_t)(1u - NODE_map.node), bytes, length);
        (void)NODE_cycle(&node, 0u);
    }
    puts("sent");
    while (fsm_link_next(&wire, &frame))
        ;
    SENDS
    fsm_link_end(&wire);
    while (fsm_link_next(&wire, &frame)) {
        for (unsigned i = 0u; i < frame.length; i++)
            printf("%02x", frame.bytes[i]);
        puts("");
    }
    return 0;
}
"""
LAST = 8
"""The number of the last member of `Fault`, the only type that crosses."""


def chart_of(node: Node, machine: str) -> Chart:
    names = [found.name for found in node.system.machines]
    return node.charts[names.index(machine)]


def sends(node: Node) -> str:
    lines = []
    for message in node.map.messages:
        if message.sender == node.place:
            prefix = snake(chart_of(node, message.source.machine).name)
            values = "".join(f", {LAST}u" for _ in message.fields)
            lines.append(
                f"{prefix}_send_{message.source.name}(&node.{message.source.machine}{values});"
            )
    return "\n    ".join(dict.fromkeys(lines))  # one port may lead to several


def built(node: Node, folder: Path, require_tool: Callable[[str], str]) -> Path:
    """Return a program of a node, in which what the host defines does nothing."""
    (folder / "hooks.h").write_text(HOOKS)
    main = MAIN.replace("SENDS", sends(node)).replace("NODE", node.prefix)
    (folder / "main.c").write_text(
        f"#include <stdio.h>\n{main}void nothing(void);\nvoid nothing(void) {{}}\n"
    )
    for path in (LINKS / "fsm_link.c", LOCAL / "fsm_link_local.c"):
        (folder / path.name).write_text(path.read_text())
    objects = []
    for source in sorted(folder.glob("*.c")):
        command = [
            require_tool("gcc"),
            "-std=c99",
            "-Wall",
            "-Wextra",
            "-Werror",
            "-c",
            source.name,
        ]
        command += [
            f"-I{LINKS}",
            f"-I{LOCAL}",
            f"-I{HOSTS}",
            f'-DCHART="{source.stem}"',
            '-DFSM_HOOKS="hooks.h"',
        ]
        subprocess.run(command, cwd=folder, check=True)
        objects.append(source.with_suffix(".o").name)
    listed = subprocess.run(
        ["nm", "-A", *objects], cwd=folder, check=True, capture_output=True, text=True
    ).stdout.split("\n")
    symbols = [(line.split()[-2], line.split()[-1]) for line in listed if line]
    known = {name for kind, name in symbols if kind in "TRDB"}
    own = tuple(f"{snake(chart.name)}_" for chart in node.charts)
    missing = {name for kind, name in symbols if kind == "U" and name.startswith(own)} - known
    stubs = [f"-Wl,--defsym={name}=nothing" for name in sorted(missing)]
    subprocess.run(["gcc", *objects, *stubs, "-o", "node"], cwd=folder, check=True)
    return folder / "node"


@pytest.mark.external
@pytest.mark.parametrize("place", [0, 1])
def test_every_message_goes_through_c(
    ring: Deployment, place: int, tmp_path: Path, require_tool: Callable[[str], str]
) -> None:
    node, codec = nodes_of(ring)[place], Codec(ring.map)
    assert ring.system.source is not None
    deployment = tmp_path / "deployment.yaml"
    rows = [
        f"  {other.name}: [{', '.join(machine.name for machine in other.system.machines)}]\n"
        for other in nodes_of(ring)
    ]
    deployment.write_text(f"system: {ring.system.source.name}\nnodes:\n{''.join(rows)}")
    assert execute(["compile", str(deployment), "--out", str(tmp_path)]) == 0
    program = built(node, tmp_path / node.name, require_tool)
    received = [message for message in ring.map.messages if message.receiver == place]
    lines = [
        codec.encode(Frame(1 - place, 3, n, n, m.number, (LAST,) * len(m.fields))).hex()
        for n, m in enumerate(received)
    ]
    said = subprocess.run(
        [program], input="\n".join(lines), text=True, capture_output=True, check=True
    ).stdout.splitlines()
    taken, frames = said[: said.index("sent")], said[said.index("sent") + 1 :]
    wanted = []
    for message in received:
        chart = chart_of(node, message.target.machine)
        wanted.append(f"{snake(chart.name)} {chart.event_index[message.target.name] + 1}")
    assert [line for line in taken if line in set(wanted)] == wanted
    decoded = [codec.decode(bytes.fromhex(frame), 1 - place) for frame in frames]
    own = [message for message in ring.map.messages if message.sender == place]
    found = sorted((frame.message, frame.values) for frame in decoded if isinstance(frame, Frame))
    assert found == [(message.number, (LAST,) * len(message.fields)) for message in own]
    assert len(own) + len(received) == 51
