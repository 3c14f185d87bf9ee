"""Measure the growth of compiler stages with the size of a chart: 1,000 against 10,000 states.

For each kind of chart and each stage it prints the seconds and the number of function calls
(independent of other load) for both sizes, and the ratios; 10 is linear.

    python benchmarks/scaling.py [--small 1000] [--large 10000] [--kind flat] [--profile STAGE]
"""

# ruff: noqa: E501
# (lines of charts)

from __future__ import annotations

import argparse
import cProfile
import gc
import pstats
import sys
import time
from collections.abc import Callable, Iterator

from fsmkit.chart.chart import Chart
from fsmkit.chart.elaborate import elaborate
from fsmkit.cli.common.garbage import COLLECT_AFTER
from fsmkit.codegen.c.generate import generate_machine
from fsmkit.codegen.python.generate import module_text
from fsmkit.diagnostics import Findings, Source
from fsmkit.plan import lower
from fsmkit.scxml.reader import read_document as read_scxml
from fsmkit.yaml.reader import read_document as read_yaml

HEAD = """\
chart: Large
constants: {LIMIT: 70, SLOW: 250ms}
data: {count: 0..1000 = 0, level: int16 = 0, ok: bool = true, samples: "uint8[8] = 0"}
inputs: {sensor: "0..100"}
outputs: {lamp: bool = false}
operations: ["goto(position 0..100)"]
events:
  in: [a, b, c, "d(n 0..7)"]
  out: [pushed]
capacity: {delayed: 4}
"""


def state(index: int, near: int, far: int) -> list[str]:
    """Return the lines of a state with transitions to others, guards, content and, at times, a delay."""
    lines = [
        f"entry: count = min(count + {index % 9}, 1000); lamp = {str(index % 2 == 0).lower()}",
        "on:",
        f"  a: s{near}",
        f"  b: {{if: count < {index % 1000} and sensor > LIMIT, target: s{near}, do: level += {index % 50}}}",
        f"  d: {{if: event.n == {index % 8}, target: s{far}, do: 'samples[{index % 8}] = 1; send pushed'}}",
    ]
    if index % 5 == 0:
        lines += ["exit: goto(5)", "after:", f"  SLOW: s{near}"]
    return lines


def at(index: int, count: int) -> list[str]:
    """Return a state that leads to the next one and to one far away."""
    return state(index, (index + 1) % count, (index * 7 + 3) % count)


def indented(lines: list[str], depth: int) -> Iterator[str]:
    """Yield lines with two spaces for each level."""
    return (" " * (2 * depth) + line for line in lines)


def flat(count: int) -> str:
    """Return a chart without any hierarchy."""
    lines = ["initial: s0", "states:"]
    for index in range(count):
        lines += [f"  s{index}:", *indented(at(index, count), 2)]
    return HEAD + "\n".join(lines) + "\n"


def deep(count: int, levels: int = 20) -> str:
    """Return a chart of towers, each so many levels high."""
    lines = ["initial: s0", "states:"]
    for index in range(count):
        level = index % levels
        depth = 1 + 2 * level
        lines += [" " * (2 * depth) + f"s{index}:", *indented(at(index, count), depth + 1)]
        if level < levels - 1 and index + 1 < count:
            lines += indented([f"initial: s{index + 1}", "states:"], depth + 1)
    return HEAD + "\n".join(lines) + "\n"


def parallel(count: int, each: int = 10) -> str:
    """Return a chart of regions, all side by side, of ten states each; no transition leaves its own."""
    lines = ["initial: all", "states:", "  all:", "    regions:"]
    for first in range(0, count, each):
        region = range(first, min(first + each, count))
        lines += [f"      r{first}:", f"        initial: s{first}", "        states:"]
        for index in region:
            near = first + (index - first + 1) % len(region)
            own = state(index, near, first)
            lines += [f"          s{index}:", *indented(own, 6)]
    return HEAD + "\n".join(lines) + "\n"


def scxml(count: int, fan: int = 10) -> str:
    """Return a chart in SCXML: a tree in which each state has ten children; a history in each."""
    lines = [
        '<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" datamodel="ecmascript" name="Large">',
        '<datamodel><data id="count" expr="0"/><data id="level" expr="0"/></datamodel>',
    ]

    def add(index: int) -> None:
        lines.append(
            f'<state id="s{index}"><onentry><assign location="count" expr="{index}"/></onentry>'
        )
        lines.append(f'<transition event="a" target="s{(index + 1) % count}"/>')
        lines.append(
            f'<transition event="b.x" cond="count &lt; {index} &amp;&amp; level === 3" target="s{index // 2}">'
        )
        lines.append(
            f'<raise event="c"/><assign location="level" expr="level + {index % 7}"/></transition>'
        )
        children = range(index * fan + 1, min(index * fan + fan + 1, count))
        if children:
            lines.append(f'<history id="h{index}"><transition target="s{children[0]}"/></history>')
            lines.append(f'<transition event="c" target="h{(index + 1) % (count // fan)}"/>')
        for child in children:
            add(child)
        lines.append("</state>")

    add(0)
    return "\n".join([*lines, "</scxml>", ""])


KINDS: dict[str, Callable[[int], str]] = {
    "flat": flat,
    "deep": deep,
    "parallel": parallel,
    "scxml": scxml,
}


class Run:
    """The stages of one chart, each of which needs the one before."""

    def __init__(self, kind: str, count: int) -> None:
        """Write the chart."""
        self.source = Source(f"large.{kind}", KINDS[kind](count))
        self.front_end = read_scxml if kind == "scxml" else read_yaml
        self.chart: Chart | None = None

    def read(self) -> None:
        """Make a Document of the text."""
        self.document = self.front_end(self.source, Findings())

    def elaborate(self) -> None:
        """Make a Chart of the Document."""
        assert self.document is not None
        findings = Findings()
        self.chart = elaborate((self.document,), findings)
        findings.stop_on_errors()

    def lower(self) -> None:
        """Make a Plan of the Chart."""
        lower(self._sound)

    def c(self) -> None:
        """Make C of the Chart."""
        generate_machine(self._sound)

    def python(self) -> None:
        """Make Python of the Chart."""
        module_text(self._sound)

    @property
    def _sound(self) -> Chart:
        assert self.chart is not None
        return self.chart


STAGES: dict[str, Callable[[Run], None]] = {
    "read": Run.read,
    "elaborate": Run.elaborate,
    "lower": Run.lower,
    "c": Run.c,
    "python": Run.python,
}


def measured(kind: str, count: int) -> dict[str, float]:
    """Return the seconds that each stage takes."""
    run = Run(kind, count)
    seconds = {}
    for name, stage in STAGES.items():
        gc.collect()
        start = time.process_time()
        stage(run)
        seconds[name] = time.process_time() - start
    return seconds


def counted(kind: str, count: int) -> dict[str, int]:
    """Return the calls of functions in each stage."""
    run = Run(kind, count)
    calls = {}
    for name, stage in STAGES.items():
        calls[name] = profiled(run, stage).total_calls  # type: ignore[attr-defined]
    return calls


def profiled(run: Run, stage: Callable[[Run], None]) -> pstats.Stats:
    """Return the statistics of one stage."""
    profile = cProfile.Profile(time.process_time)
    profile.enable()
    stage(run)
    profile.disable()
    return pstats.Stats(profile, stream=sys.stdout)


def main() -> None:
    """Print the table, or the profile of one stage."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n", maxsplit=1)[0])
    parser.add_argument("--small", type=int, default=1_000)
    parser.add_argument("--large", type=int, default=10_000)
    parser.add_argument("--kind", choices=KINDS, action="append")
    parser.add_argument("--calls", action="store_true", help="count the calls of functions too")
    parser.add_argument("--profile", choices=STAGES, metavar="STAGE")
    options = parser.parse_args()
    gc.set_threshold(COLLECT_AFTER)
    kinds = options.kind or list(KINDS)
    if options.profile:
        for kind in kinds:
            run = Run(kind, options.large)
            for name, stage in STAGES.items():
                if name == options.profile:
                    profiled(run, stage).sort_stats("tottime").print_stats(25)
                    break
                stage(run)
        return
    small, large = options.small, options.large
    print(f"{'chart':9}{'stage':10} {f's, {small}':>9} {f's, {large}':>9} {'ratio':>7}", end="")
    print(f" {f'calls, {small}':>13} {f'calls, {large}':>13} {'ratio':>7}" if options.calls else "")
    for kind in kinds:
        seconds = measured(kind, small), measured(kind, large)
        calls = (counted(kind, small), counted(kind, large)) if options.calls else None
        for name in STAGES:
            few, many = (each[name] for each in seconds)
            print(f"{kind:9}{name:10} {few:9.2f} {many:9.2f} {many / max(few, 1e-3):7.1f}", end="")
            if calls is not None:
                fewer, more = (each[name] for each in calls)
                print(f" {fewer:13,} {more:13,} {more / max(fewer, 1):7.1f}", end="")
            print(flush=True)


if __name__ == "__main__":
    main()
