"""Measure round trips between two nodes in C, with and without priority of the link's threads.

Two processes run `ping.yaml` and `pong.yaml` in loops of their own, joined by ZeroMQ over TCP.
cyclictest (rt-tests), where it is installed, measures the same computer in the same seconds, and
`--load` adds processes that compute. SCHED_FIFO needs the right to it: CAP_SYS_NICE, or a limit
`rtprio`.
"""

from __future__ import annotations

import importlib.util
import json
import shutil
import socket
import subprocess
import sys
import tempfile
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

import click

import fsmkit
from fsmkit.cli import execute

HERE = Path(__file__).parent
RUNTIME = Path(fsmkit.__file__).parent / "runtime/c"
ZEROMQ = Path(fsmkit.__file__).parent / "carriers/zeromq/c"
PRIORITY = 80
LINK_PRIORITY = PRIORITY + 2


@dataclass(frozen=True)
class Case:
    """One measurement: round trips in ns, and overruns of the loop that sends."""

    period_us: int
    link_priority: int
    overruns: int
    round_trips: tuple[int, ...]

    def late(self, share: float) -> float:
        """Return the round trip in ms that this share did not exceed."""
        ordered = sorted(self.round_trips)
        return ordered[min(int(len(ordered) * share), len(ordered) - 1)] / 1e6


def build(folder: Path) -> None:
    """Compile both nodes into a folder: `near.out`, `far.out`."""
    if execute(["compile", str(HERE / "deployment.yaml"), "--out", str(folder), "--quiet"]) != 0:
        raise SystemExit(1)
    for node, options in (("near", ["-DNEAR"]), ("far", [])):
        sources = [HERE / "node.c", *(folder / node).glob("*.c")]
        for compiled in (RUNTIME / "hosts/posix", RUNTIME / "links", ZEROMQ):
            sources += compiled.glob("*.c")
        library = (RUNTIME, RUNTIME / "hosts", RUNTIME / "links", ZEROMQ)
        paths = (HERE.parent, folder / node, *library)
        command = ["cc", "-std=c99", "-O2", *options, *(f"-I{path}" for path in paths)]
        command += [*map(str, sources), "-lzmq", "-pthread", "-o", str(folder / f"{node}.out")]
        if subprocess.run(command, check=False).returncode != 0:
            raise click.ClickException("it needs `cc` and libzmq with its headers (make tools)")


def endpoints() -> list[str]:
    """Return two endpoints on ports that are free now, so that a second instance can run."""
    with ExitStack() as stack:
        sockets = [stack.enter_context(socket.create_server(("127.0.0.1", 0))) for _ in "ab"]
        return [f"tcp://127.0.0.1:{each.getsockname()[1]}" for each in sockets]


def measure(folder: Path, report: Path, period_us: int, link_priority: int, seconds: int) -> Case:
    """Run both nodes for some seconds; write the report of the loop to a file."""
    ends = endpoints()
    numbers = [str(period_us), str(PRIORITY), str(link_priority)]
    far = subprocess.Popen(
        [folder / "far.out", *numbers, str(seconds + 2), *ends], stdout=subprocess.DEVNULL
    )
    try:
        near = subprocess.run(
            [folder / "near.out", *numbers, str(seconds), *ends],
            check=True,
            stdout=subprocess.PIPE,
            text=True,
        )
    finally:
        far.terminate()
        far.wait()
    report.write_text(near.stdout, encoding="utf-8")
    loop, round_trips = map(json.loads, near.stdout.splitlines())
    return Case(period_us, link_priority, loop["overruns"], tuple(round_trips))


@click.command()
@click.option("--seconds", default=15, show_default=True, help="For each measurement.")
@click.option("--load", default=0, show_default=True, help="Processes that compute meanwhile.")
@click.option("--out", default="build/latency", type=click.Path(path_type=Path), show_default=True)
def main(seconds: int, load: int, out: Path) -> None:
    """Print round trips at 1 kHz and 10 kHz; draw the loop's jitter and cyclictest's."""
    out.mkdir(parents=True, exist_ok=True)
    if shutil.which("cc") is None:
        raise click.ClickException("it needs a C compiler, `cc`")
    cyclictest = shutil.which("cyclictest")
    cases: list[Case] = []
    with ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        build(folder)
        for _ in range(load):
            busy = subprocess.Popen([sys.executable, "-c", "while True: pass"])
            stack.callback(busy.wait)
            stack.callback(busy.kill)
        for period_us in (1000, 100):
            for link_priority in (0, LINK_PRIORITY):
                name = f"loop_{period_us}us_link_{link_priority}.json"
                cases.append(measure(folder, out / name, period_us, link_priority, seconds))
        reports = [str(out / f"loop_1000us_link_{LINK_PRIORITY}.json")]
        if cyclictest is None:
            print("cyclictest (rt-tests) is not installed: the loop is shown alone")
        else:
            # The loop again, in the same seconds as cyclictest.
            reports = [str(out / name) for name in ("loop.json", "cyclictest.json")]
            beside = [cyclictest, "-q", "-m", f"-p{PRIORITY}", "-i1000", "-h20000", f"-D{seconds}"]
            with subprocess.Popen([*beside, f"--json={reports[1]}"], stdout=subprocess.DEVNULL):
                measure(folder, Path(reports[0]), 1000, LINK_PRIORITY, seconds)
    print("| loop | priority of the link | round trips | p50, ms | p99 | p99.9 | max | overruns |")
    print("|---|---|---|---|---|---|---|---|")
    for case in cases:
        late = " | ".join(f"{case.late(share):.3f}" for share in (0.5, 0.99, 0.999, 1.0))
        rate, priority = 1000 // case.period_us, case.link_priority or "none"
        count = f"{len(case.round_trips):,}"
        print(f"| {rate} kHz | {priority} | {count} | {late} | {case.overruns:,} |")
    picture = [] if not _has_matplotlib() else ["--out", str(out / "late.svg")]
    raise SystemExit(execute(["latency", *reports, *picture]))


def _has_matplotlib() -> bool:
    return importlib.util.find_spec("matplotlib") is not None


if __name__ == "__main__":
    main()
