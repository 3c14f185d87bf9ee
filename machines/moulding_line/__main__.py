"""Runs the line: two nodes of fsmkit, a heater on CAN and a lens on ROS 2, each a process.

``python -m machines.moulding_line --seconds 600 --loss 0.05``. At the end the properties of
handshakes.yaml and heating.yaml, which `fsmkit check` proves, are judged on the records.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path

import click

import fsmkit
from fsmkit.carriers.can.plugin import PLUGIN
from fsmkit.carriers.ros.network import ros_nodes

from .build import build
from .judge import Judged, Row, judge

HERE = Path(__file__).parent
SYSTEMS = ("handshakes", "heating")
RECORDS = {"press": "press.jsonl", "supply": "supply.jsonl"}
"""By node of fsmkit."""
SPARE = 60
"""For so many s longer than the nodes the other programs go on if nobody ends them."""
WHOLE = 1 << 16
"""Chances in C are in 1/65536."""
LOOPBACK = """<CycloneDDS><Domain Id="any">
<General><Interfaces><NetworkInterface name="lo" multicast="false"/></Interfaces>
<AllowMulticast>false</AllowMulticast></General>
<Discovery><ParticipantIndex>auto</ParticipantIndex><MaxAutoParticipantIndex>30</MaxAutoParticipantIndex>
<Peers><Peer Address="127.0.0.1"/></Peers></Discovery>
</Domain></CycloneDDS>"""
"""DDS within this computer, also where it has no network."""


@click.command()
@click.option("--seconds", type=float, default=60.0, show_default=True)
@click.option("--loss", type=float, default=0.05, show_default=True, help="Of each carrier.")
@click.option("--seed", type=int, default=1, show_default=True)
@click.option("--press", type=click.Choice(["python", "c"]), default="python", show_default=True)
@click.option("--out", type=click.Path(path_type=Path), default=Path("build/moulding_line"))
def main(seconds: float, loss: float, seed: int, press: str, out: Path) -> None:
    """Run the line in real time and judge its properties on the record."""
    out.mkdir(parents=True, exist_ok=True)
    said = run(out.resolve(), seconds, loss, seed, press=press)
    for line in said:
        click.echo(line)
    rows = read_rows(out)
    verdicts = judged(rows)
    for system, found in verdicts:
        shown = {True: "holds", False: "VIOLATED", None: "not judged"}[found.holds]
        where = "" if found.at is None else f"  at {found.at:.3f} s"
        click.echo(f"{shown:10}  {system}: {found.name}{where}")
    click.echo(f"{moulded(rows)} blocks moulded, {len(rows)} rows recorded")
    sys.exit(any(found.holds is False for _, found in verdicts))


def run(
    out: Path,
    seconds: float,
    loss: float,
    seed: int,
    deployment: Path = HERE / "deployment.yaml",
    press: str = "python",
) -> list[str]:
    """Run all processes for some seconds; return what they printed, a line each.

    ``press``: what runs the node of this name, generated C or the interpreter.
    """
    line = fsmkit.read(deployment)
    if not isinstance(line, fsmkit.Deployment):
        raise click.ClickException(f"{deployment} is no deployment")
    bus = PLUGIN.foreign_options(line, "press")["heater"]["bus"].removeprefix("udp:")
    domain = ros_nodes(line)[line.map.node("vision")].domain
    longest, shares = ["--seconds", str(seconds + SPARE)], ["--loss", str(loss), "--seed"]
    commands = {
        "heater": [*_module("heater"), bus, *longest, *shares, str(seed)],
        "lens": [*_module("lens"), str(domain), *longest, *shares, str(seed + 1)],
    }
    common = ["--seconds", str(seconds), *shares]
    for name, record in RECORDS.items():
        own = ["--deployment", str(deployment), "--record", str(out / record)]
        commands[name] = [*_module("node"), name, *common, str(seed + 2), *own]
    if press == "c":
        program, share = build(out / "generated", deployment), round(loss * WHOLE)
        numbers = [str(seconds), str(share), str(seed + 2)]
        commands["press"] = [str(program), *numbers, f"udp:{bus}", str(out / RECORDS["press"])]
    running = {
        name: subprocess.Popen(
            command,
            stdout=subprocess.PIPE,
            text=True,
            env={"CYCLONEDDS_URI": LOOPBACK, **os.environ},
        )
        for name, command in commands.items()
    }
    nodes = [running[name] for name in RECORDS]
    try:
        while any(node.poll() is None for node in nodes):
            if any(process.poll() for process in running.values()):
                break
            time.sleep(0.1)
        ended = {name: process.poll() for name, process in running.items()}
        for process in running.values():
            process.terminate()  # the programs that are no nodes end by that
        said = [process.communicate(timeout=10)[0].strip() for process in running.values()]
    finally:
        for process in running.values():
            process.kill()
    for name, code in ended.items():
        if code:
            raise click.ClickException(f"the program `{name}` ended with {code}")
    return said


def _module(name: str) -> list[str]:
    """Return the command that runs a module of this package."""
    return [sys.executable, "-m", f"machines.moulding_line.{name}"]


def read_rows(folder: Path) -> list[Row]:
    """Return the rows of all nodes, by their times."""
    rows = []
    for record in RECORDS.values():
        for line in (folder / record).read_text(encoding="utf-8").splitlines():
            at, machine, states, data, inputs = json.loads(line)
            rows.append(Row(at, machine, frozenset(states), data, inputs))
    return sorted(rows, key=lambda row: row.at)


def judged(rows: Sequence[Row]) -> list[tuple[str, Judged]]:
    """Return the verdicts of a record, with the systems in which the properties are proved."""
    return [
        (name, found)
        for name in SYSTEMS
        for found in judge(fsmkit.read_system(HERE / f"{name}.yaml"), rows)
    ]


def moulded(rows: Sequence[Row]) -> int:
    """Return how many blocks were moulded and judged."""
    chart = fsmkit.read_chart(HERE / "molder.yaml")
    number = [data.name for data in chart.data].index("number")
    numbers = [row.data[number] for row in rows if row.machine == "molder"]
    return sum(a != b for a, b in pairwise(numbers))


if __name__ == "__main__":
    main()
