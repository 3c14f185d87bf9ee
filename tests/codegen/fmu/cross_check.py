"""Files of the FMI Cross-Check: ``python -m tests.codegen.fmu.cross_check CHART --fmi 2.0 OUT``.

For each chart its FMU, the input signals, the reference solution and its options, by the rules of
the Modelica Association (version 4.1, 9.1.4 and appendix B). The interpreter computes the reference
solution, not the FMU. The inputs are chosen at random: events that an active state waits for, and
values of inputs. A Clock of FMI 3.0 has no column in these files; events are given in 2.0 only.
"""

from __future__ import annotations

import argparse
import random
from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import fsmkit
from fsmkit.chart.analysis.host_events import posted_events
from fsmkit.chart.chart import Chart
from fsmkit.chart.loading import load
from fsmkit.codegen.fmu.variables import Variable, variables_of
from fsmkit.language.values import to_python
from fsmkit.plan import lower
from fsmkit.runtime.script import SeededHost
from tests.codegen.fmu.beside import Beside, build_fmu, named

STEP = 0.01
"""In s."""
COLUMNS = 10
"""The columns of a reference solution beside the time; more are not recommended."""
LARGEST = 10**6
"""Bytes of a file."""
RELATIVE_TOLERANCE = 1e-4

Row = tuple[float, ...]


@dataclass
class Solution:
    """Input signals and the resulting outputs."""

    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    signals: list[Row] = field(default_factory=list)
    """Times and values; a jump is two rows of one time."""
    rows: list[Row] = field(default_factory=list)


class _Stimulus:
    """Plays random events and inputs to the interpreter, and notes them."""

    def __init__(self, chart: Chart, version: str, seed: int, left_out: Collection[str]) -> None:
        self.chart = chart
        self.beside = Beside(chart)
        self._choose = random.Random(seed)
        self._values = SeededHost(chart, seed)
        events = (chart.events[index] for index in posted_events(chart))
        self._events = [event for event in events if event.name not in left_out]
        self._has_counters = version == "2.0"
        of = variables_of(chart, lower(chart), with_clocks=not self._has_counters)
        self.given: dict[str, float] = {
            v.name: _number(v.start) for v in of if v.causality == "input" and self._is_given(v)
        }
        """Values of the inputs now."""
        self._seen: Counter[str] = Counter()
        leaving = (v.name for v in of if v.source in ("OUT", "CALL") and v.field == 0)
        self._leaving = tuple(n for n in leaving if n.count(".") == 1)

    def _is_given(self, variable: Variable) -> bool:
        """Return whether a column can have it: no Clock, and nothing that belongs to one."""
        return self._has_counters or (variable.kind != "Clock" and variable.clock is None)

    def change(self) -> None:
        """Set inputs and post an event, now and then."""
        session = self.beside.session
        for declared in self.chart.inputs:
            if self._choose.random() < 0.02:
                value = self._values.value(declared.type)
                session.inputs[declared.name] = to_python(value, declared.type)
                for path, scalar in named(declared.type, value):
                    self.given[f"{declared.name}{path}"] = _number(scalar)
        if self._has_counters and self._choose.random() < 0.05:
            self._post()

    def _post(self) -> None:
        """Post an event that an active state waits for."""
        session = self.beside.session
        active = set(session.configuration)
        depths: dict[int, int] = {}  # of the innermost active state that waits for an event
        for transition in self.chart.transitions:
            if self.chart.states[transition.source].id in active:
                for index in transition.events:
                    depths[index] = max(depths.get(index, 0), self._depth(transition.source))
        heard = [e for e in self._events if e.index in depths]
        if not heard:
            return
        # what an inner state waits for, and what was rare so far, leads further
        count = {e.index: self.given[f"post.{e.name}"] for e in heard}
        likely = [10.0 ** depths[e.index] / (1 + count[e.index]) ** 2 for e in heard]
        (event,) = self._choose.choices(heard, likely)
        fields = {}
        for part in event.fields:
            value = self._values.value(part.type)
            fields[part.name] = to_python(value, part.type)
            for path, scalar in named(part.type, value):
                self.given[f"post.{event.name}.{part.name}{path}"] = _number(scalar)
        self.given[f"post.{event.name}"] += 1
        session.post(event.name, **fields)

    def _depth(self, state: int) -> int:
        parent = self.chart.states[state].parent
        return 0 if parent is None else 1 + self._depth(parent)

    def seen(self) -> Mapping[str, float]:
        """Return values by name: states and outputs first, then data, then counters."""
        self._seen.update(name for name, _ in self.beside.seen)
        self.beside.seen.clear()
        states = {name: _number(value) for name, value in self.beside.states().items()}
        data = {declared.name for declared in self.chart.data}
        inputs = {declared.name for declared in self.chart.inputs}
        ranked = sorted(states, key=lambda name: _root(name) in data)
        found = {name: states[name] for name in ranked if _root(name) not in inputs}
        if self._has_counters:
            found |= {name: float(self._seen[name]) for name in self._leaving}
        return found


def _root(name: str) -> str:
    return name.partition("[")[0].partition(".")[0]


def _number(value: object) -> float:
    assert isinstance(value, bool | int | float)
    return float(value)


def solve(
    chart: Chart, version: str, seconds: float, seed: int, left_out: Collection[str]
) -> Solution:
    """Return inputs and reference; they end early where the machine ends, or has a fault.

    Events that are ``left_out`` are never posted.
    """
    stimulus = _Stimulus(chart, version, seed, left_out)
    session = stimulus.beside.session
    session.start()
    session.run(0)
    outputs = tuple(stimulus.seen())[:COLUMNS]
    solution = Solution(tuple(stimulus.given), outputs)
    ticks = round(STEP * 1e6 / chart.capacities.tick)

    def note(rows: list[Row], values: Mapping[str, float], names: Sequence[str]) -> None:
        rows.append((time, *(values[name] for name in names)))

    time = 0.0
    note(solution.signals, stimulus.given, solution.inputs)
    note(solution.rows, stimulus.seen(), outputs)
    for number in range(1, round(seconds / STEP) + 1):
        before = dict(stimulus.given)
        if number > 1:
            stimulus.change()
        session.run((number - 1) * ticks)
        session.run(number * ticks)
        if session.fault is not None or not session.is_running:
            break
        if stimulus.given != before:
            note(solution.signals, before, solution.inputs)
            note(solution.signals, stimulus.given, solution.inputs)
        time = round(number * STEP, 6)
        note(solution.rows, stimulus.seen(), outputs)
    note(solution.signals, solution_end(solution), solution.inputs)
    return solution


def solution_end(solution: Solution) -> Mapping[str, float]:
    """Return the inputs at the end."""
    return dict(zip(solution.inputs, solution.signals[-1][1:], strict=True))


def _literal(value: float) -> str:
    return str(int(value)) if value.is_integer() else repr(value)


def write_csv(path: Path, names: Sequence[str], rows: Sequence[Row]) -> None:
    """Write signals as appendix B of the rules has them."""
    lines = [",".join(f'"{name}"' for name in ("time", *names))]
    lines += [",".join(_literal(value) for value in row) for row in rows]
    text = "\n".join(lines) + "\n"
    assert len(text) <= LARGEST, f"{path} has {len(text)} bytes"
    path.write_text(text, encoding="ascii")


def write(
    out: Path,
    chart: Chart,
    version: str,
    seconds: float = 60.0,
    seed: int = 1,
    left_out: Collection[str] = (),
) -> Path:
    """Write the files of a chart into a folder below ``out``, as the rules name it; return it."""
    import fmpy

    tool = Path("fsmkit", fsmkit.__version__)
    file = build_fmu(out, chart, version)
    folder = out / "fmus" / version / "cs" / str(fmpy.platform) / tool / file.stem
    folder.mkdir(parents=True, exist_ok=True)
    file = file.replace(folder / file.name)
    solution = solve(chart, version, seconds, seed, left_out)
    write_csv(file.with_name(f"{file.stem}_ref.csv"), solution.outputs, solution.rows)
    if solution.inputs:
        write_csv(file.with_name(f"{file.stem}_in.csv"), solution.inputs, solution.signals)
    options = {
        "StartTime": 0.0,
        "StopTime": solution.rows[-1][0],
        "StepSize": STEP,
        "RelTol": RELATIVE_TOLERANCE,
    }
    lines = [f"{name}, {value:g}\n" for name, value in options.items()]
    file.with_name(f"{file.stem}_ref.opt").write_text("".join(lines), encoding="ascii")
    return folder


def main() -> None:
    """Write the files."""
    parser = argparse.ArgumentParser(description="Files of the FMI Cross-Check.")
    parser.add_argument("charts", type=Path, nargs="+")
    parser.add_argument("--fmi", choices=("2.0", "3.0"), default="2.0")
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--leave-out", nargs="*", default=(), metavar="EVENT", help="not posted")
    parser.add_argument("--out", type=Path, default=Path("build"))
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    for path in options.charts:
        print(  # noqa: T201
            write(
                options.out,
                load(path),
                options.fmi,
                options.seconds,
                options.seed,
                options.leave_out,
            )
        )


if __name__ == "__main__":
    main()
