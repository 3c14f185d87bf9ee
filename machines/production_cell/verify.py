"""The Production Cell proved: every system, every property, every seeded defect.

``make verify`` runs it. Two kinds of runs: *proofs*, in which every property of a system must
hold, and *mutants*, charts with one mistake, of which one property each must be violated (and of
which one is none: it must hold). Exit code 0: every verdict is as expected; 1: one is not.
"""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path

from rich.console import Console
from rich.table import Table

import fsmkit
from fsmkit.system.properties.kinds import leads_to
from fsmkit.verify.resources.time import Time

CELL = Path(__file__).resolve().parent
HOLDS, VIOLATED = fsmkit.Verdict.HOLDS, fsmkit.Verdict.VIOLATED
SECONDS = 1800.0
"""The most one exploration may take."""

MEANINGS = {
    "P1": "the arm is in the mould only while the door stands open",
    "P2": "the feeder is forward only behind a closed door",
    "P3": "the feeder belt turns only while the feeder is at home; no slot takes two blocks",
    "P4": "the extraction belt stands still while the rotator is over it",
    "P5": "the feeder belt stands still while the rotator is over it; laid down only when lent",
    "P6": "the extraction belt stands still while the extractor is over it; likewise",
    "P7": "it turns only with the sorter out of the way and nothing at its end",
    "P8": "no magnet lets a block go elsewhere than over its belt",
    "P9": "no block is lost or doubled; no handshake overruns; nothing fails by itself",
    "P10": "an emergency stop takes the power from every motor; nothing moves without",
    "P11": "a pause is heard by whoever works, in whatever it does",
    "P12": "the mould is hot while it molds",
    "Q1": "a block that was judged bad never reaches the end of the extraction belt",
    "Q2": "no verdict comes later than the sorter waits for it",
    "Q3": "where an estimate tells the sorter, no block that was judged good is pushed out",
    "Q4": "production begins with no verdict awaited and no block that will not be judged",
    "Q5": "once a verdict that was late has come, the next one counts",
    "Q6": "a block that was pushed out is one less in the ring",
    "H1": "no slot is lent in vain: grant and `placed` are heard, whatever is paused, stopped",
    "H2": "door and belts home only when nobody stands in their way, whatever was stopped where",
    "H3": "who says that it has homed is at home",
    "R1": "a stage of homing begins when the one before is ready, production when all are",
    "R2": "the supervisor waits for no module in vain",
    "R3": "a reset is heard",
    "B1": "no handshake comes twice, whatever is paused, stopped, homed again",
    "E1": "an emergency stop is heard, whatever the supervisor does",
    "F1": "a module whose motor stalls fails",
    "F2": "nobody waits for an answer longer than its time limit",
    "F3": "who homes again has no fault any more",
    "L1": "no deadlock",
    "L2": "in time: no time limit of a handshake or of a motion is ever reached",
    "L3": "the rotator, when it asks for a slot, is lent one, whatever the operator lays there",
}


@dataclass(frozen=True)
class Run:
    """A system to explore. ``time``: ``untimed``, ``zones`` or ``discrete``.

    Untimed, a timer may fire at any time and watchdogs are assumed silent, unless they are
    ``live``. ``symbolic``: there are too many states to keep them one by one. ``blocks``: how
    many the operator lays into the ring (0: as the file says).
    """

    system: str
    time: Time
    blocks: int = 0
    replace: tuple[tuple[str, str], ...] = ()
    live: bool = False
    symbolic: bool = False

    @property
    def name(self) -> str:
        """What to call it in a table."""
        name = self.system.removesuffix(".yaml").removeprefix("pairs/")
        name = f"{name}, {self.blocks}" if self.blocks else name
        return f"{name}, watchdogs live" if self.live else name


@dataclass(frozen=True)
class Mutant:
    """A mistake: the charts that have it, where it shows, and the property that it breaks.

    ``breaks`` empty: equivalent to the reference, nothing is broken.
    """

    name: str
    what: str
    run: Run
    breaks: str


@dataclass
class Found:
    """Verdicts of one property in several runs."""

    where: list[str] = field(default_factory=list)
    holds: bool = True
    states: int = 0
    seconds: float = 0


PAIRS = (
    "pairs/molder-extractor.yaml",
    "pairs/extractor-extraction_belt.yaml",
    "pairs/extraction_belt-sorter.yaml",
    "pairs/extraction_belt-rotator.yaml",
    "pairs/rotator-feeder_belt.yaml",
    "pairs/feeder_belt-feeder.yaml",
)
HOMING = (
    "homing/molder.yaml",
    "homing/feeder_belt.yaml",
    "homing/extraction_belt.yaml",
)
BLOCKS = {
    "ring.yaml": "plant/blocks.yaml",
    "ring_by_position.yaml": "plant/followed_blocks.yaml",
}
"""The rings, and the chart of their blocks."""
WITHOUT_FAULTS = frozenset({"P9_faults", "Q6", "L3"})
"""Properties of the ring where no time limit is reached."""
MOST = 8
"""Blocks: all slots of the ring."""
MOST_TEMPORAL = 3
"""Blocks up to which `leads_to` is asked for untimed where what comes from outside waits."""


def proofs(*, quick: bool) -> tuple[Run, ...]:
    """Return what must hold; ``quick``: what takes seconds."""
    rings = range(1, 3 if quick else MOST + 1)
    untimed = tuple(Run("ring.yaml", "untimed", blocks) for blocks in rings)
    full = () if quick else (Run("ring.yaml", "untimed", MOST, symbolic=True),)
    timed = tuple(Run("ring.yaml", "zones", blocks) for blocks in ((2,) if quick else (1, 2, 3, 8)))
    pausing = (("supervisor", "rest/pausing_supervisor.yaml"),)
    paused = Run("ring.yaml", "untimed", 1, pausing, symbolic=True)
    live = tuple(
        Run("ring.yaml", "untimed", blocks, live=True, symbolic=True)
        for blocks in ((1,) if quick else (1, 2))
    )
    followed = (
        Run("ring_by_position.yaml", "untimed", 2),
        Run("ring_by_position.yaml", "zones", 2 if quick else MOST),
    )
    homing = tuple(Run(one, "zones") for one in HOMING)
    pairs = tuple(Run(pair, "zones") for pair in PAIRS)
    return (
        *untimed,
        *full,
        *timed,
        paused,
        *live,
        *followed,
        Run("cell.yaml", "discrete"),
        *homing,
        *(pairs[:1] if quick else pairs),
    )


def in_ring(blocks: int, *replace: tuple[str, str], time: Time = "untimed") -> Run:
    """Return a run of the ring with other charts."""
    return Run("ring.yaml", time, blocks, replace)


def in_pair(pair: str, *replace: tuple[str, str]) -> Run:
    """Return a run of two modules with other charts."""
    return Run(f"pairs/{pair}.yaml", "zones", 0, replace)


MUTANTS = (
    Mutant(
        "M1", "the extraction belt forgets what it has lent",
        in_ring(2, ("extraction_belt", "mutants/m1_extraction_belt.yaml")), "P4",
    ),
    Mutant(
        "M2", "the feeder does not latch `mold_ready`",
        in_ring(1, ("feeder", "defects/m2_feeder.yaml")), "L1",
    ),
    Mutant(
        "M4", "the feeder belt turns with a block in the pocket",
        in_ring(2, ("feeder_belt", "mutants/m4_feeder_belt.yaml")), "P3_slots",
    ),
    Mutant(
        "M5", "the feeder ignores `mold_ready`",
        in_ring(1, ("feeder", "defects/m5_feeder.yaml")), "P2",
    ),
    Mutant(
        "M7", "the door closes with the arm inside",
        in_ring(1, ("molder", "mutants/m7_molder.yaml")), "P1",
    ),
    Mutant(
        "M8", "the extractor does not wait for the grant",
        in_ring(1, ("extractor", "mutants/m8_extractor.yaml")), "P6_grant",
    ),
    Mutant(
        "M10", "the sorter is not asked",
        in_ring(1, ("extraction_belt", "mutants/m10_extraction_belt.yaml")), "Q1",
    ),
    Mutant(
        "M12", "the lamp ignores the rotator",
        in_ring(7, ("feeder_belt", "mutants/m12_feeder_belt.yaml")), "L1",
    ),
    Mutant(
        "M14", "a relative motion in `entry`",
        in_pair("rotator-feeder_belt", ("feeder_belt", "mutants/m14_feeder_belt.yaml")), "P9",
    ),
    Mutant(
        "M15", "a `send` in `entry`",
        in_pair("rotator-feeder_belt", ("rotator", "mutants/m15_rotator.yaml")), "B1",
    ),
    Mutant(
        "M16", "a time limit that nobody cancels",
        in_ring(1, ("feeder_belt", "mutants/m16_feeder_belt.yaml"), time="zones"), "P9_faults",
    ),
    Mutant(
        "M17", "the magnet is switched off by an emergency stop",
        in_pair("extractor-extraction_belt", ("extractor", "mutants/m17_extractor.yaml")), "P9",
    ),
    Mutant(
        "M20", "one module overrides the emergency stop",
        in_pair("extractor-extraction_belt", ("extractor", "mutants/m20_extractor.yaml")), "P10",
    ),
    Mutant(
        "M21", "a grant that comes during a pause is not heard",
        in_pair("rotator-feeder_belt", ("rotator", "mutants/m21_rotator.yaml")), "H1",
    ),
    Mutant(
        "M22", "a verdict that comes later than the sorter waits",
        in_ring(1, ("camera", "mutants/m22_camera.yaml"), time="zones"), "Q2",
    ),
    Mutant(
        "M23", "the molder homes before the feeder is ready",
        Run("homing/molder.yaml", "zones", 0, (("supervisor", "mutants/m23_supervisor.yaml"),)),
        "H2",
    ),
    Mutant(
        "M24", "the feeder belt invites until every slot has a block",
        in_ring(8, ("feeder_belt", "mutants/m24_feeder_belt.yaml"), time="zones"), "L1",
    ),
    Mutant(
        "M25", "the feeder belt invites again while the rotator waits",
        in_ring(2, ("feeder_belt", "mutants/m25_feeder_belt.yaml")), "L3",
    ),
    Mutant(
        "M26", "the estimate is behind by a slot",
        Run("ring_by_position.yaml", "zones", 3, (("blocks", "mutants/m26_blocks.yaml"),)), "Q1",
    ),
    Mutant(
        "M27", "a module does not hear that its motor stalls",
        in_pair("rotator-feeder_belt", ("rotator", "mutants/m27_rotator.yaml")), "F1_rotator",
    ),
    Mutant(
        "M28", "the extraction belt waits too long for the sorter",
        in_pair("extraction_belt-sorter", ("extraction_belt", "mutants/m28_extraction_belt.yaml")),
        "F2",
    ),
    Mutant(
        "M29", "the supervisor takes a pause for a stop",
        in_pair("rotator-feeder_belt", ("supervisor", "mutants/m29_supervisor.yaml")), "R2",
    ),
    Mutant(
        "M30", "the rotator does not hear a pause while it swings back",
        in_pair("rotator-feeder_belt", ("rotator", "mutants/m30_rotator.yaml")), "P11",
    ),
    Mutant(
        "M31", "production does not hear the emergency stop",
        Run("homing/molder.yaml", "zones", 0, (("supervisor", "mutants/m31_supervisor.yaml"),)),
        "E1",
    ),
    Mutant(
        "M32", "the sorter has homed before its pusher is back",
        in_pair("extraction_belt-sorter", ("sorter", "mutants/m32_sorter.yaml")), "H3",
    ),
    Mutant(
        "M33", "the feeder does not notice the end of a stop",
        in_pair("feeder_belt-feeder", ("feeder", "mutants/m33_feeder.yaml")), "L2",
    ),
    Mutant(
        "M34", "the molder shows its last fault when it homes again",
        in_pair("molder-extractor", ("molder", "mutants/m34_molder.yaml")), "F3",
    ),
    Mutant(
        "M35", "the sorter does not push out a block that is not judged in time",
        in_pair("extraction_belt-sorter", ("sorter", "mutants/m35_sorter.yaml")), "rejects_late",
    ),
    Mutant(
        "M36", "after a stop the sorter awaits a verdict on a block that is gone",
        in_pair("extraction_belt-sorter", ("sorter", "mutants/m36_sorter.yaml")), "Q4",
    ),
    Mutant(
        "M37", "the sorter does not push out a block that was there at the start",
        in_pair("extraction_belt-sorter", ("sorter", "mutants/m37_sorter.yaml")), "Q4",
    ),
    Mutant(
        "M38", "the sorter awaits a late verdict for ever",
        in_pair("extraction_belt-sorter", ("sorter", "mutants/m38_sorter.yaml")), "Q5",
    ),
    Mutant(
        "M39", "the feeder belt counts blocks that were pushed out",
        in_ring(1, ("feeder_belt", "mutants/m39_feeder_belt.yaml")), "Q6",
    ),
    Mutant(
        "M40", "the supervisor takes the start of production for a pause",
        in_pair("feeder_belt-feeder", ("supervisor", "mutants/m40_supervisor.yaml")), "P11",
    ),
    Mutant(
        "M12", "the same, six blocks: some gap always moves",
        in_ring(6, ("feeder_belt", "mutants/m12_feeder_belt.yaml")), "",
    ),
    Mutant(
        "EQ", "no defect: a guard that another implies is left out",
        in_ring(3, ("extraction_belt", "mutants/eq_extraction_belt.yaml")), "",
    ),
)  # fmt: skip
NOT_QUICK = frozenset({"M12", "EQ", "M14", "M15"})


def check(run: Run, properties: tuple[str, ...] = ()) -> fsmkit.Report:
    """Explore a system."""
    with tempfile.TemporaryDirectory() as folder:
        charts = {machine: CELL / chart for machine, chart in run.replace}
        if run.blocks:
            base = charts.get("blocks", CELL / BLOCKS[run.system])
            charts["blocks"] = limited(run.blocks, base, Path(folder))
        system = fsmkit.read_system(CELL / run.system, replace=charts)
        if not properties and not is_temporal(run):
            system = without_temporal(system)
        if run.live:
            system = without(WITHOUT_FAULTS, system)
        return fsmkit.check(
            system,
            properties=properties,
            time=run.time,
            assume_watchdogs_silent=run.time == "untimed" and not run.live,
            search="symbolic" if run.symbolic else "auto",
            timeout=SECONDS,
        )


def is_temporal(run: Run) -> bool:
    """Tell whether `leads_to` is asked for: not of a ring that may pause, and so for ever.

    Of many blocks it is where nothing from outside waits, which makes a diagram smaller.
    """
    if run.symbolic:
        return not run.replace
    return run.time != "untimed" or run.blocks <= MOST_TEMPORAL


def without_temporal(system: fsmkit.System) -> fsmkit.System:
    """Return a system without the properties that say that something happens some time."""
    kept = tuple(p for p in system.properties if p.kind is not leads_to.KIND)
    return replace(system, properties=kept)


def without(names: frozenset[str], system: fsmkit.System) -> fsmkit.System:
    """Return a system without the properties of some names."""
    kept = tuple(p for p in system.properties if p.name not in names)
    return replace(system, properties=kept)


def limited(blocks: int, base: Path, folder: Path) -> Path:
    """Write a chart of the blocks in which the operator lays no more than so many into the ring."""
    chart = folder / "blocks.yaml"
    text = f"chart: Blocks\nextends: {base}\nconstants: {{BLOCKS: {blocks}}}\n"
    chart.write_text(text, encoding="utf-8")
    return chart


def is_as_expected(mutant: Mutant, report: fsmkit.Report) -> bool:
    """Tell whether a defect was found, or nothing in what is none."""
    if not mutant.breaks:
        return all(result.verdict is HOLDS for result in report.results)
    return any(r.name == mutant.breaks and r.verdict is VIOLATED for r in report.results)


def length(mutant: Mutant, report: fsmkit.Report) -> int:
    """Return the steps of the counterexample; 0 if there is none."""
    traces = (r.trace for r in report.results if r.name == mutant.breaks)
    return next((len(trace.steps) for trace in traces if trace is not None), 0)


# --- what is printed -----------------------------------------------------------------------------


def new_table(*headings: str) -> Table:
    """Return an empty table; the last two columns are numbers."""
    table = Table(box=None, pad_edge=False, padding=(0, 2, 0, 0), header_style="dim")
    for place, heading in enumerate(headings):
        table.add_column(heading, justify="right" if place >= len(headings) - 2 else "left")
    return table


def requirement(name: str, run: Run) -> str:
    """Return which of `MEANINGS` a property of a system file is part of."""
    base = name.split("_", maxsplit=1)[0]
    if name == "P9_faults" and run.time != "untimed":
        return "L2"
    return {"D": "L1", "livelock": "", "produces": ""}.get(base, base)


def prove(runs: Iterable[Run], console: Console) -> bool:
    """Explore the reference charts; print systems and properties; tell whether all hold."""
    systems = new_table("system, blocks", "time", "verdict", "states", "seconds")
    found: dict[str, Found] = {}
    holds = True
    for run in runs:
        console.print(f"[dim]{run.name} ({run.time})[/]")
        report = check(run)
        explored = report.exploration
        good = report.verdict is HOLDS
        holds &= good
        wrong = ", ".join(r.name for r in report.results if r.verdict is not HOLDS)
        verdict = "[green]all hold[/]" if good else f"[bold red]not: {wrong}[/]"
        figures = f"{explored.states:,}", f"{explored.seconds:.1f}"
        systems.add_row(run.name, run.time, verdict, *figures)
        told = set()
        for result in report.results:
            key = requirement(result.name, run)
            if key not in MEANINGS:
                continue
            entry = found.setdefault(key, Found())
            entry.holds &= result.verdict is HOLDS
            if key not in told:
                told.add(key)
                entry.where.append(run.system.removesuffix(".yaml").removeprefix("pairs/"))
                entry.states += explored.states
                entry.seconds += explored.seconds
    console.print(systems)
    console.print()
    console.print(property_table(found))
    return holds


def property_table(found: dict[str, Found]) -> Table:
    """Return the table of properties."""
    table = new_table("property", "says", "verdict", "systems", "states", "seconds")
    for name, meaning in MEANINGS.items():
        if name not in found:
            continue
        entry = found[name]
        verdict = "[green]holds[/]" if entry.holds else "[bold red]NO[/]"
        where = str(len(entry.where))
        table.add_row(name, meaning, verdict, where, f"{entry.states:,}", f"{entry.seconds:.1f}")
    return table


def hunt(mutants: Iterable[Mutant], console: Console) -> bool:
    """Explore the mutants; print what each breaks; tell whether all is as expected."""
    table = new_table("mutant", "mistake", "found in", "by", "steps", "states")
    good = True
    for mutant in mutants:
        console.print(f"[dim]{mutant.name}[/]")
        report = check(mutant.run, (mutant.breaks,) if mutant.breaks else ())
        expected = is_as_expected(mutant, report)
        good &= expected
        by = mutant.breaks or "nothing"
        where = f"{mutant.run.name} ({mutant.run.time})"
        table.add_row(
            mutant.name,
            mutant.what,
            where,
            f"[green]{by}[/]" if expected else f"[bold red]NOT {by}[/]",
            f"{length(mutant, report) or '-'}",
            f"{report.exploration.states:,}",
        )
    console.print(table)
    return good


def chosen(*, quick: bool) -> Iterator[Mutant]:
    """Yield the mutants to look for."""
    return (m for m in MUTANTS if not quick or m.name not in NOT_QUICK)


def main(arguments: list[str]) -> int:
    """Prove the reference and hunt the mutants; ``--quick`` does the part that takes seconds."""
    if unknown := set(arguments) - {"--quick"}:
        print(f"{min(unknown)} is no option; there is --quick", file=sys.stderr)
        return 2
    quick = "--quick" in arguments
    console = Console(highlight=False, width=None if sys.stdout.isatty() else 130)
    console.print("[bold]The reference charts[/]")
    holds = prove(proofs(quick=quick), console)
    console.print("\n[bold]Charts with one mistake[/]")
    found = hunt(chosen(quick=quick), console)
    console.print("\nevery verdict is as expected" if holds and found else "\n[bold red]NO[/]")
    return 0 if holds and found else 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
