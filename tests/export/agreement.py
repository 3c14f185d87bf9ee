"""The table of `make agreement`: the explorer, SPIN and Storm on the same closed systems.

``python -m tests.export.agreement [GROUP ...]``; groups are those of `GROUPS`,
and ``random``. Exit code 0: the checkers agree wherever they could all be asked.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import partial
from itertools import count
from pathlib import Path
from types import ModuleType
from typing import Any

from fsmkit.diagnostics import Findings, FsmkitError
from fsmkit.export.exporter import ExportOptions
from fsmkit.system.any_file import load_any
from fsmkit.system.machine import Possible
from fsmkit.system.system import System
from tests.export.other_checkers import (
    CheckerError,
    Compared,
    TooLargeError,
    compare,
    find,
    has_storm,
)
from tests.machines.cell_script import the_script
from tests.verify.random_systems import load_files, random_system

MACHINES = Path(__file__).parents[2] / "machines"
CELL = MACHINES / "production_cell"
CHARTS = (
    "supervisor", "camera", "extractor", "rotator", "feeder", "molder", "feeder_belt", "sorter",
    "extraction_belt", "plant",
)  # fmt: skip
PAIRS = tuple(sorted((CELL / "pairs").glob("*-*.yaml")))
RINGS = (1, 2, 3)
SHOWN_BY = {
    "M14": "supervisor.press_pause",
    "M15": "supervisor.press_pause",
    "M17": "supervisor.press_estop",
    "M20": "supervisor.press_estop",
}
"""What shows a defect in a pair."""
RANDOM = "random"
LARGEST_RANDOM = 20_000
"""States of a random system; larger ones are left out."""


@dataclass(frozen=True)
class Case:
    """A system to compare. ``breaks``: a property that explorer and SPIN must find violated."""

    name: str
    load: Callable[[], System]
    untimed: bool = False
    silent: bool = False
    breaks: str = ""
    storm: bool = True

    def compare(self, most: int = LARGEST_RANDOM, seconds: float = 600) -> Compared:
        """Ask all checkers; of a defect only explorer and SPIN, about what it breaks."""
        system = self.load()
        if self.breaks:
            limits = ExportOptions(self.untimed, self.untimed, most)
            return find(self.name, system, self.breaks, limits, seconds)
        return compare(
            self.name,
            system,
            untimed=self.untimed,
            silent=self.silent,
            storm=self.storm and has_storm(),
            most=most,
            seconds=seconds,
        )


# --- what is compared ----------------------------------------------------------------------------


def examples() -> Iterator[Case]:
    """Yield Fischer's protocol and the philosophers."""
    for name in (
        "fischer/fischer",
        "fischer/hasty",
        "philosophers/table",
        "philosophers/ordered_table",
    ):
        yield Case(name.partition("/")[2], partial(loaded, MACHINES / f"{name}.yaml"))


def charts() -> Iterator[Case]:
    """Yield the charts of the Production Cell, each alone, untimed and timed."""
    for untimed in (True, False):
        for name in CHARTS:
            (path,) = (p for p in CELL.glob(f"{name}.*") if p.suffix in (".yaml", ".scxml"))
            yield Case(name, partial(loaded, path), untimed)


def pairs() -> Iterator[Case]:
    """Yield two modules that share a zone: undisturbed, and with each disturbance by itself."""
    systems = [loaded(path) for path in PAIRS]
    for path, system in zip(PAIRS, systems, strict=True):
        yield Case(path.stem, partial(disturbed, system, ""), untimed=True, silent=True)
    for path, system in zip(PAIRS, systems, strict=True):
        for what in disturbances(system):
            told = f"{path.stem}, {what}"
            yield Case(told, partial(disturbed, system, what), untimed=True, silent=True)


def whole_pairs() -> Iterator[Case]:
    """Yield the same with all disturbances: ten million states and more, too many for Storm."""
    for path in PAIRS:
        yield Case(path.stem, partial(loaded, path), untimed=True, silent=True, storm=False)


def disturbances(system: System) -> list[str]:
    """Return what may happen at any time, and need not."""
    return [_named(system, possible) for possible in system.possible if not possible.fair]


def disturbed(system: System, what: str) -> System:
    """Return a system in which only one of those may happen; empty: none."""
    kept = (p for p in system.possible if p.fair or _named(system, p) == what)
    return replace(system, possible=tuple(kept))


def _named(system: System, possible: Possible) -> str:
    machine = system.machines[possible.machine]
    return f"{machine.name}.{machine.chart.events[possible.event].name}"


def rings() -> Iterator[Case]:
    """Yield the ring with some blocks."""
    verify = the_script()
    for blocks in RINGS:
        run = verify.in_ring(blocks)
        yield Case(f"ring, {blocks}", partial(system_of_run, verify, run), True, True)


def cell() -> Iterator[Case]:
    """Yield feeder, molder and plant."""
    yield Case("cell", partial(loaded, CELL / "cell.yaml"))
    yield Case("cell", partial(loaded, CELL / "cell.yaml"), untimed=True, silent=True)


def mutants() -> Iterator[Case]:
    """Yield the seeded defects: untimed, and in discrete time what has been found by zones."""
    verify = the_script()
    for mutant in verify.MUTANTS:
        untimed = mutant.run.time == "untimed"
        yield Case(
            f"{mutant.name}: {mutant.run.name}",
            partial(system_of_mutant, verify, mutant),
            untimed,
            untimed,
            mutant.breaks,
        )


def system_of_mutant(verify: ModuleType, mutant: Any) -> System:
    """Load the system that a defect breaks; of a pair, with the one disturbance that it takes."""
    system = system_of_run(verify, mutant.run)
    what = SHOWN_BY.get(mutant.name)
    return disturbed(system, what) if what else system


def random_cases() -> Iterator[Case]:
    """Yield random systems without end, every other one untimed."""
    for seed in count():
        files = random_system(seed)
        try:
            load_files(files)
        except FsmkitError:
            continue  # what is drawn is not always right
        yield Case(f"random {seed}", partial(load_files, files), seed % 2 == 1)


GROUPS: Mapping[str, Callable[[], Iterator[Case]]] = {
    "examples": examples,
    "charts": charts,
    "cell": cell,
    "pairs": pairs,
    "whole_pairs": whole_pairs,
    "rings": rings,
    "mutants": mutants,
}


def loaded(path: Path, replacing: Mapping[str, Path] | None = None) -> System:
    """Load a chart or a system."""
    return load_any(path, Findings(), replacing)


def system_of_run(verify: ModuleType, run: Any) -> System:
    """Load what a run of that script explores."""
    with tempfile.TemporaryDirectory() as folder:
        charts = {machine: CELL / chart for machine, chart in run.replace}
        if run.blocks:
            charts["blocks"] = verify.limited(run.blocks, charts.get("blocks"), Path(folder))
        return loaded(CELL / run.system, charts)


# --- the table -----------------------------------------------------------------------------------

HEADINGS = ("system", "time", "explorer", "SPIN", "Storm", "properties", "agree")
ROW = "| {:<52} | {:<8} | {:>10} | {:>10} | {:>10} | {:<34} | {}"


def row(case: Case, found: Compared) -> tuple[str, bool]:
    """Return a line of the table, and whether the checkers agree."""
    differences = found.differences()
    if case.breaks:
        checkers = (found.explorer, found.spin)
        missed = any(checker.holds.get(case.breaks) is not False for checker in checkers)
        differences += [f"{case.breaks} is not found by both"] if missed else []
    states = [
        f"{j.states:,}" if j and j.states else "-"
        for j in (found.explorer, found.spin, found.storm)
    ]
    told = ROW.format(
        found.name, found.time, *states, evaluated(found), "; ".join(differences) or "yes"
    )
    return f"{told} |", not differences


def evaluated(found: Compared) -> str:
    """Return how many properties all have evaluated, and which are violated."""
    both = found.explorer.holds.keys() & found.spin.holds.keys()
    bad = sorted(name for name in both if not found.explorer.holds[name])
    return f"{len(both)}" + (f", violated: {' '.join(bad)}" if bad else "")


def say(line: str) -> None:
    """Print a line at once."""
    sys.stdout.write(line + "\n")
    sys.stdout.flush()


def tell(cases: Iterable[Case], most: int, seconds: float) -> bool:
    """Print a line for each case; return whether the checkers agree."""
    good = True
    for case in cases:
        begun = time.monotonic()
        try:
            line, agree = row(case, case.compare(most, seconds))
        except (FsmkitError, CheckerError) as error:
            why = str(error).splitlines()[0][:80]
            line, agree = f"| {case.name:<42} | not compared: {why} |", True
        good &= agree
        say(f"{line}  {time.monotonic() - begun:.0f} s")
    return good


def tell_random(number: int, seconds: float) -> bool:
    """Compare so many random systems; print how many agree, and return whether all do."""
    agreed: list[Compared] = []
    differ: list[str] = []
    large = 0
    for case in random_cases():
        if len(agreed) + len(differ) >= number:
            break
        try:
            found = case.compare(LARGEST_RANDOM, seconds)
        except TooLargeError:
            large += 1
        except (FsmkitError, CheckerError) as error:
            differ.append(f"{case.name}: {str(error)[:200]}")
        else:
            differ += [f"{case.name}: {difference}" for difference in found.differences()]
            agreed += [] if found.differences() else [found]
    holds = [holds for found in agreed for holds in (found.storm or found.explorer).holds.values()]
    say(
        f"{len(agreed)} random systems agree, {sum(f.explorer.states for f in agreed):,} states, "
        f"{len(holds)} properties, {holds.count(False)} of them violated; {len(differ)} differ; "
        f"{large} with more than {LARGEST_RANDOM:,} states were left out"
    )
    for line in differ:
        say(line)
    return not differ


def main(arguments: list[str]) -> int:
    """Print the table."""
    parser = argparse.ArgumentParser(prog="agreement")
    parser.add_argument("groups", nargs="*", choices=[*GROUPS, RANDOM, []], default=[])
    parser.add_argument("--only", default="", help="systems with this in their names")
    parser.add_argument("--random", type=int, default=200, help="how many random systems")
    parser.add_argument("--most", type=int, default=20_000_000)
    parser.add_argument("--seconds", type=float, default=1800)
    asked = parser.parse_args(arguments)
    if not has_storm():
        say("`stormpy` is not installed (make tools): Storm is not asked")
    say(ROW.format(*HEADINGS) + " |")
    results = [
        tell((c for c in cases() if asked.only in c.name), asked.most, asked.seconds)
        for name, cases in GROUPS.items()
        if not asked.groups or name in asked.groups
    ]
    if not asked.groups or RANDOM in asked.groups:
        results.append(tell_random(asked.random, asked.seconds))
    return 0 if all(results) else 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
