"""Three checkers of one closed system: the explorer, SPIN, and Storm; and whether they agree."""

from __future__ import annotations

import importlib.util
import json
import re
import subprocess
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

from fsmkit.diagnostics import Findings
from fsmkit.export.collect import network_of
from fsmkit.export.exporter import ExportOptions
from fsmkit.export.jani.model import FORESEEN, model_of
from fsmkit.export.network import Network
from fsmkit.export.promela.model import claim_names, write_model
from fsmkit.system.properties.kinds import deadlock_free, leads_to, reachable
from fsmkit.system.properties.property import Property
from fsmkit.system.system import System
from fsmkit.verify.explore import ExplorationOptions, check
from fsmkit.verify.report.verdict import Report, Verdict
from fsmkit.verify.resources.deadline import Deadline
from fsmkit.verify.statespace.exploration import DEADLOCK, End

MOST = 5_000_000
"""States beyond which nothing is compared."""
FREE_OF_DEADLOCK = "deadlock"
"""The property that is added where none asks for deadlocks."""
SPIN_FLAGS = ("-w", "-DNOREDUCE", "-DCOLLAPSE", "-DVECTORSZ=16384")
FEW = 20_000
"""States up to which it is not worth while to optimize."""
EVERYTHING = "never everything_ { do :: true od }"
"""A claim that is never violated, and has one state."""
DEEPEST = 3_000_000
"""Steps of SPIN's longest path; on each state there are two, one of them of the claim."""


class CheckerError(Exception):
    """A checker cannot read a model, or gives up."""


class TooLargeError(CheckerError):
    """A system has more states than shall be compared."""


@dataclass(frozen=True)
class Answer:
    """What a checker says: how many states (0: not asked for), and which properties hold."""

    states: int
    holds: Mapping[str, bool]


@dataclass(frozen=True)
class Compared:
    """What the checkers say of one system. ``unfair``: the properties of which only the explorer
    knows that fair events do come; the others may find more violations, never fewer.
    """

    name: str
    time: str
    explorer: Answer
    spin: Answer
    storm: Answer | None
    unfair: frozenset[str] = frozenset()
    builtin_results: frozenset[str] = field(default_factory=frozenset)
    """Properties that are not carried over."""

    def differences(self) -> list[str]:
        """Return where the checkers do not agree."""
        found = []
        for name, checker, more in (("SPIN", self.spin, 1), ("Storm", self.storm, 0)):
            if checker is None:
                continue
            if checker.states and checker.states != self.explorer.states + more:
                found.append(f"{name}: {checker.states} states")
            for property_, holds in checker.holds.items():
                ours = self.explorer.holds.get(property_)
                if ours is None or holds == ours or (property_ in self.unfair and ours):
                    continue
                found.append(f"{name}: {property_} {'holds' if holds else 'is violated'}")
        return found


def with_deadlock(system: System) -> System:
    """Return a system that asks for deadlocks; a chart alone has traps instead (see `check`)."""
    if system.is_open or any(p.kind is deadlock_free.KIND for p in system.properties):
        return system
    more = Property(FREE_OF_DEADLOCK, deadlock_free.KIND, "no deadlock")
    return replace(system, properties=(*system.properties, more))


def compare(
    name: str,
    system: System,
    *,
    untimed: bool = False,
    silent: bool = False,
    storm: bool = True,
    most: int = MOST,
    seconds: float = 600,
) -> Compared:
    """Ask all checkers; `FsmkitError` where a system cannot be exported."""
    system = with_deadlock(system)
    options = ExplorationOptions(
        "c",
        time="untimed" if untimed else "discrete",
        assume_watchdogs_silent=silent,
        timeout=seconds,
    )
    report = check(system, Findings(), options=options)
    if report.exploration.states > most:
        raise TooLargeError(f"{report.exploration.states:,} states")
    ours = by_explorer(report)
    network = network_of(system, ExportOptions(untimed, silent, most, Deadline(seconds)))
    kinds = {p.name: p.kind for p in system.properties}
    theirs = by_spin(network, seconds)
    stormy = by_storm(network) if storm else None
    asked = theirs.holds.keys() | (stormy.holds.keys() if stormy else set())
    return Compared(
        name,
        "untimed" if untimed else "discrete" if network.closed.unit else "none",
        ours,
        theirs,
        stormy,
        frozenset(p for p, kind in kinds.items() if kind is leads_to.KIND),
        frozenset(kinds) - asked,
    )


def find(name: str, system: System, bad: str, wanted: ExportOptions, seconds: float) -> Compared:
    """Ask explorer and SPIN about one property, no further than to a violation."""
    kept = tuple(p for p in system.properties if p.name == bad)
    system = replace(system, properties=kept)
    options = ExplorationOptions(
        "c",
        time="untimed" if wanted.untimed else "discrete",
        assume_watchdogs_silent=wanted.silent,
        timeout=seconds,
    )
    report = check(system, Findings(), options=options, properties=frozenset({bad}))
    ours = {r.name: r.verdict is not Verdict.VIOLATED for r in report.results if r.name == bad}
    network = network_of(system, replace(wanted, deadline=Deadline(seconds)))
    theirs = by_spin(network, seconds, states=False)
    time = "untimed" if wanted.untimed else "discrete"
    return Compared(name, time, Answer(network.states, ours), theirs, None)


def by_explorer(report: Report) -> Answer:
    """Return the verdicts of the engine in C, without those that are undecided."""
    found = report.exploration
    if found.end is not End.COMPLETE:
        raise CheckerError(f"the explorer gave up: {found.end}")
    holds = {
        result.name: result.verdict is Verdict.HOLDS
        for result in report.results
        if result.verdict is not Verdict.UNDECIDED
    }
    for property_ in report.closed.system.properties:
        if property_.kind is deadlock_free.KIND:
            holds[property_.name] = found.mark(DEADLOCK) is None
    return Answer(found.states, holds)


# --- SPIN ----------------------------------------------------------------------------------------


def by_spin(network: Network, seconds: float = 600, *, states: bool = True) -> Answer:
    """Return what SPIN says: all states, if wanted, and each property that is a never claim."""
    text = write_model(network)
    properties = network.closed.system.properties
    names = dict(zip(claim_names(properties), properties, strict=True))
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        compile_model(f"{text}{EVERYTHING}\n", folder, "-O0" if network.states < FEW else "-O1")
        deepest = f"-m{min(2 * network.states + 100, DEEPEST)}"
        found = errors = 0
        if states:
            found, errors = run_pan(folder, seconds, deepest, "-a", "-N", "everything_")
        if errors:
            raise CheckerError("SPIN reaches an assertion that fails: the explorer saw less")
        holds = {}
        for claim in re.findall(r"^never (\w+) ", text, re.MULTILINE):
            _, errors = run_pan(folder, seconds, deepest, "-a", "-N", claim)
            wanted = names[claim].kind is reachable.KIND
            holds[names[claim].name] = (errors > 0) is wanted
    return Answer(found, holds)


def compile_model(text: str, folder: Path, *flags: str) -> None:
    """Make SPIN's verifier ``pan`` of a model."""
    (folder / "m.pml").write_text(text, encoding="utf-8")
    for command in (["spin", "-a", "m.pml"], ["cc", *flags, *SPIN_FLAGS, "-o", "pan", "pan.c"]):
        done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
        if done.returncode or re.search(r"\berror\b", done.stdout, re.IGNORECASE):
            raise CheckerError(f"{command[0]}: {done.stdout[-500:]}{done.stderr[-500:]}")


def run_pan(folder: Path, seconds: float, *options: str) -> tuple[int, int]:
    """Run a verifier; return the states that it stored, and the errors that it found."""
    command = ["./pan", "-n", *options]
    try:
        done = subprocess.run(
            command, cwd=folder, capture_output=True, text=True, timeout=seconds, check=False
        )
    except subprocess.TimeoutExpired as error:
        raise CheckerError(f"SPIN takes more than {seconds:g} s") from error
    states = re.search(r"^\s*(\d+) states, stored", done.stdout, re.MULTILINE)
    errors = re.search(r"errors: (\d+)", done.stdout)
    if states is None or errors is None or "search depth too small" in done.stdout:
        raise CheckerError(f"pan: {done.stdout[-500:]}{done.stderr[-500:]}")
    return int(states[1]), int(errors[1])


# --- Storm ---------------------------------------------------------------------------------------


def has_storm() -> bool:
    """Whether Storm can be asked."""
    return importlib.util.find_spec("stormpy") is not None


def by_storm(network: Network) -> Answer:
    """Return what Storm says of the jani-model."""
    return evaluated_by_storm(json.dumps(model_of(network)))


def evaluated_by_storm(text: str) -> Answer:
    """Return what Storm says of a jani-model: the states that it builds, and each property."""
    import stormpy

    model, properties = stormpy.parse_jani_model_from_string(text)
    built = stormpy.build_model(model, properties)
    only_initial = stormpy.create_filter_initial_states(built)
    some = {p["name"] for p in json.loads(text)["properties"] if p["expression"]["fun"] == "∃"}
    holds = {}
    for property_ in properties:
        result = stormpy.model_checking(built, property_)
        result.filter(only_initial)
        name = property_.get_name()
        holds[name] = result.exists_true() if name in some else result.forall_true()
    if not holds.pop(FORESEEN):
        raise CheckerError("Storm reaches what the explorer never saw")
    return Answer(built.nr_states, holds)
