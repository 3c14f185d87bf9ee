"""Measure round trips between two nodes in C that exchange topics by Cyclone DDS.

Two processes on this computer run `ping.yaml` and `pong.yaml` in loops of their own. The threads
of DDS have a priority above that of the loops. ``--strace`` counts the system calls of one loop's
thread.
"""

from __future__ import annotations

import subprocess
import tempfile
from contextlib import nullcontext
from pathlib import Path

import click

import fsmkit
from benchmarks.ros.others import others as other_topics
from fsmkit.cli import execute

DOMAIN = 77
"""As in `near.yaml` and `far.yaml`."""
HERE = Path(__file__).parent
RUNTIME = Path(fsmkit.__file__).parent / "runtime/c"
LINKS = RUNTIME / "links"
ROS = Path(fsmkit.__file__).parent / "carriers/ros/c"


def build(folder: Path) -> None:
    """Compile both nodes into a folder: `near.out`, `far.out`."""
    for node, options in (("near", ["-DNEAR"]), ("far", [])):
        out = folder / node
        if execute(["compile", str(HERE / f"{node}.yaml"), "--out", str(out), "--quiet"]) != 0:
            raise SystemExit(1)
        for each in (out / "idl").iterdir():
            subprocess.run(["idlc", "-t", "-o", str(out), each.name], cwd=each.parent, check=True)
        sources = [HERE / "node.c", *out.glob("*.c"), *(out / node).glob("*.c")]
        sources += (RUNTIME / "hosts/posix").glob("*.c")
        sources += [LINKS / name for name in ("fsm_link.c", "fsm_link_fan.c")]
        sources += [ROS / "dds" / name for name in ("fsm_link_dds.c", "fsm_dds_domain.c")]
        library = (RUNTIME, RUNTIME / "hosts", LINKS, ROS, ROS / "dds")
        paths = (HERE.parent, out, out / node, *library)
        command = ["cc", "-std=c99", "-O2", *options, *(f"-I{path}" for path in paths)]
        command += [*map(str, sources), "-lddsc", "-pthread", "-o", str(folder / f"{node}.out")]
        if subprocess.run(command, check=False).returncode != 0:
            raise click.ClickException("it needs `cc`, cyclonedds-dev and cyclonedds-tools")


def measure(
    folder: Path, period_us: int, priority: int, seconds: int, every: int, strace: Path | None
) -> str:
    """Run both nodes for some seconds; return the row of a table."""
    first, last = [str(period_us), str(priority)], str(every)
    far_command = [str(folder / "far.out"), *first, str(seconds + 1), last]
    near_command = [str(folder / "near.out"), *first, str(seconds), last]
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "text": True}
    with (
        subprocess.Popen(far_command, **pipes) as far,  # type: ignore[call-overload]
        subprocess.Popen(near_command, **pipes) as near,  # type: ignore[call-overload]
    ):
        for each in (far, near):
            process = each.stdout.readline().strip()  # of the thread that becomes the loop, too
        watch = None
        if strace is not None:
            watched = ["timeout", "-s", "INT", str(seconds - 1)]  # before it closes the topics
            watched += ["strace", "-c", "-p", process, "-o", str(strace)]
            watch = subprocess.Popen(watched)
        for each in (far, near):
            each.stdin.write("go\n")
            each.stdin.flush()
        found = sorted(int(line) / 1e6 for line in near.stdout)
        if watch is not None:
            watch.wait()
    late = (found[min(int(len(found) * share), len(found) - 1)] for share in (0.5, 0.99, 1.0))
    figures = " | ".join(f"{each:.3f}" for each in late)
    return f"| {1000 // period_us} kHz | {priority or 'none'} | {len(found):,} | {figures} |"


@click.command()
@click.option("--seconds", default=15, show_default=True, help="For each measurement.")
@click.option("--priority", default=80, show_default=True, help="SCHED_FIFO; 0: none.")
@click.option("--every", default=0, help="us between turns of the sender; 0: it is woken.")
@click.option("--others", is_flag=True, help="With 32 other topics, 100 messages a second each.")
@click.option("--strace", type=click.Path(path_type=Path), help="Where its table is written.")
def main(seconds: int, priority: int, every: int, *, others: bool, strace: Path | None) -> None:
    """Print round trips at 1 kHz and 10 kHz."""
    beside = other_topics(DOMAIN) if others else nullcontext()
    with tempfile.TemporaryDirectory() as name, beside:
        folder = Path(name)
        build(folder)
        print("| loop | priority | round trips | p50, ms | p99 | max |\n|---|---|---|---|---|---|")
        for period_us in (1000, 100):
            print(measure(folder, period_us, priority, seconds, every, strace))
            strace = None  # once is enough


if __name__ == "__main__":
    main()
