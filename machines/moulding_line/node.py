"""A node of the line: its machines, its link, and a record of their changes.

``python -m machines.moulding_line.node press --seconds 600 --record press.jsonl``. A line of the
record is a machine after a cycle in which it changed: the time (ns, CLOCK_MONOTONIC), its active
states, its data and its inputs.
"""

from __future__ import annotations

import json
import time
from pathlib import Path

import click

import fsmkit
from fsmkit import Deployment, Node
from fsmkit.runtime.links.faults import Faults

DEPLOYMENT = Path(__file__).with_name("deployment.yaml")
PERIOD_NS = 2_000_000
TICK_NS = 1_000_000


@click.command()
@click.argument("name")
@click.option("--seconds", type=float, required=True)
@click.option("--loss", type=float, default=0.0, help="The share of arriving frames that is lost.")
@click.option("--seed", type=int, default=1)
@click.option("--deployment", "path", type=click.Path(path_type=Path), default=DEPLOYMENT)
@click.option("--record", type=click.Path(path_type=Path), required=True)
def main(name: str, seconds: float, loss: float, seed: int, path: Path, record: Path) -> None:
    """Run the node NAME of the line."""
    deployment = fsmkit.read(path)
    if not isinstance(deployment, Deployment):
        raise click.ClickException(f"{path} is no deployment")
    faults = Faults(seed=seed, loss=loss)
    with (
        Node(deployment, name, session=int(time.time()), faults=faults) as node,
        record.open("w", encoding="utf-8") as out,
    ):
        begin = time.monotonic_ns()
        due, last = begin, dict[str, object]()
        while (now := time.monotonic_ns()) < begin + seconds * 1e9:
            node.cycle((now - begin) // TICK_NS)
            for machine in node.system.machines:
                snapshot = node.machines.snapshot(machine.name)
                found = sorted(snapshot.configuration), snapshot.data, snapshot.inputs
                if last.get(machine.name) != found:
                    last[machine.name] = found
                    out.write(json.dumps([now, machine.name, *found]) + "\n")
            due = max(due + PERIOD_NS, now)
            time.sleep(max(0, due - time.monotonic_ns()) / 1e9)
        peers = {
            peer: {
                "restarts": node.link.counters(peer).restarts,
                "lost events": node.link.counters(peer).lost_events,
            }
            for peer in deployment.nodes
            if peer != name
        }
        click.echo(json.dumps({"node": name, "dropped": faults.lost, "peers": peers}))


if __name__ == "__main__":
    main()
