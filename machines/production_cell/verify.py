"""Verify the Production Cell: every system, every property, every seeded defect.

``make verify`` runs it. There are two kinds of runs. In *proofs* every property of a system must
hold. *Mutants* are charts with one mistake, each of which must violate one property; one mutant is
equivalent, and must hold. Exit code 0: every verdict is as expected; 1: one is not.
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
    "P9": "no block is lost or doubled; no handshake overruns; nothing fails without a fault",
    "P10": "an emergency stop takes the power from every motor; nothing moves without",
    "P11": "every working machine handles a pause in every state",
    "P12": "the mould is hot while it molds",
    "P13": "the mould is hot only while it molds and while it warms up",
    "P14": "no block is done before it was heated for a second",
    "P15": "the molder is ready only when the mould is warm",
    "P16": "a robot knows whether a block is on its magnet",
    "P17": "a magnet has half a second to grip and to release",
    "P18": "the lamp is lit only while the belt works, stands still, and its slot is not lent",
    "Q1": "a block that was judged bad never reaches the end of the extraction belt",
    "Q2": "no verdict comes later than the sorter waits for it",
    "Q3": "where an estimate informs the sorter, no block that was judged good is pushed out",
    "Q4": "production starts with no verdict awaited and no block that will not be judged",
    "Q5": "once a verdict that was late has come, the next one counts",
    "Q6": "a block that was pushed out is one less in the ring",
    "Q7": "the sorter lets only a block pass that was judged good",
    "Q8": "each block that leaves the view of the camera has one verdict, its own",
    "H1": "no slot is lent in vain: grant and `placed` are handled, whatever is paused, stopped",
    "H2": "door and belts home only when nothing blocks them, whatever was stopped where",
    "H3": "who says that it has homed is at home",
    "H4": "an axis drives to a position only after it has found its limit switch under power",
    "R1": "a stage of homing starts when the one before is ready, production when all are",
    "R2": "the supervisor waits for no module in vain",
    "R3": "a reset is handled",
    "B1": "no handshake comes twice, whatever is paused, stopped, homed again",
    "E1": "an emergency stop is handled, whatever the supervisor does",
    "E2": "an emergency stop is taken back only when the relay has had time to fall",
    "F1": "a module whose motor stalls fails",
    "F2": "nobody waits for an answer longer than its time limit",
    "F3": "who homes again has no fault any more",
    "F4": "a motor that is jammed has no power within half a second, while it homes as well",
    "F5": "a homing, a motion or a stop that does not end is a fault within its time limit",
    "F6": "a module that has failed has no power, gives the reason, and stops the cell",
    "F7": "the sorter gives up a block that sticks",
    "L1": "no deadlock",
    "L2": "in time: no time limit of a handshake or of a motion is ever reached",
    "L3": "the rotator, when it requests a slot, is lent one, whatever the operator lays there",
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
        """The name in a table."""
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
ALONE = tuple(
    f"alone/{module}.yaml"
    for module in (
        "molder", "feeder", "extractor", "feeder_belt", "extraction_belt", "sorter", "camera",
    )
)  # fmt: skip
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
"""Blocks up to which `leads_to` is checked untimed if external events wait."""


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
    alone = tuple(Run(one, "zones") for one in ALONE)
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
        *alone,
        *(pairs[:1] if quick else pairs),
    )


def in_ring(blocks: int, *replace: tuple[str, str], time: Time = "untimed") -> Run:
    """Return a run of the ring with other charts."""
    return Run("ring.yaml", time, blocks, replace)


def in_pair(pair: str, *replace: tuple[str, str]) -> Run:
    """Return a run of two modules with other charts."""
    return Run(f"pairs/{pair}.yaml", "zones", 0, replace)


def in_alone(module: str, *replace: tuple[str, str]) -> Run:
    """Return a run of a single module, its motor and its stand-ins with other charts."""
    return Run(f"alone/{module}.yaml", "zones", 0, replace)


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
        "M10", "the sorter gets no request",
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
        "M21", "a grant that comes during a pause is not handled",
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
        "M27", "a module does not handle that its motor stalls",
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
        "M30", "the rotator does not handle a pause while it swings back",
        in_pair("rotator-feeder_belt", ("rotator", "mutants/m30_rotator.yaml")), "P11",
    ),
    Mutant(
        "M31", "production does not handle the emergency stop",
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
        "M41", "the heater is switched off where the block is done, not where its state is left",
        in_alone("molder", ("molder", "mutants/m41_molder.yaml")), "P13",
    ),
    Mutant(
        "M42", "a block is moulded for 100 ms",
        in_alone("molder", ("molder", "mutants/m42_molder.yaml")), "P14",
    ),
    Mutant(
        "M43", "the time of moulding is counted from the shut door, not from the block in it",
        in_alone("molder", ("molder", "mutants/m43_molder.yaml")), "P14",
    ),
    Mutant(
        "M44", "the feeder is answered when moulding starts",
        in_alone("molder", ("molder", "mutants/m44_molder.yaml")), "P14",
    ),
    Mutant(
        "M45", "the extractor is invited when the door starts to open",
        in_alone("molder", ("molder", "mutants/m45_molder.yaml")), "P1",
    ),
    Mutant(
        "M46", "the feeder is invited when the door starts to close",
        in_alone("molder", ("molder", "mutants/m46_molder.yaml")), "P2",
    ),
    Mutant(
        "M47", "a stop opens the door, though the feeder may be in it",
        Run("cell.yaml", "discrete", 0, (("molder", "mutants/m47_molder.yaml"),)), "P2",
    ),
    Mutant(
        "M48", "a mould that was warm once is taken for warm for ever",
        in_alone("molder", ("molder", "mutants/m48_molder.yaml")), "P15",
    ),
    Mutant(
        "M49", "a new state is outside the state that handles the emergency stop",
        in_alone("molder", ("molder", "mutants/m49_molder.yaml")), "P10",
    ),
    Mutant(
        "M50", "a door that does not open is opened again and again",
        in_alone("molder", ("molder", "mutants/m50_molder.yaml")), "F5_moving",
    ),
    Mutant(
        "M51", "a stall while homing is passed over",
        in_alone("molder", ("molder", "mutants/m51_molder.yaml")), "F4",
    ),
    Mutant(
        "M52", "a stall while homing restarts the homing, for ever",
        in_alone("molder", ("molder", "mutants/m52_molder.yaml")), "F5_homing",
    ),
    Mutant(
        "M53", "the feeder pushes when a block or the mould is ready, not both",
        in_alone("feeder", ("feeder", "mutants/m53_feeder.yaml")), "P2",
    ),
    Mutant(
        "M54", "the feeder reports that it is out of the mould when it starts to withdraw",
        in_alone("feeder", ("feeder", "mutants/m54_feeder.yaml")), "P2",
    ),
    Mutant(
        "M55", "the feeder reports a free pocket when it starts to push",
        in_alone("feeder", ("feeder", "mutants/m55_feeder.yaml")), "P3",
    ),
    Mutant(
        "M56", "the feeder withdraws after a time of its own instead of waiting for the molder",
        in_alone("feeder", ("feeder", "mutants/m56_feeder.yaml")), "P2_press",
    ),
    Mutant(
        "M57", "the feeder forgets what was promised when it stops, not when it starts",
        in_alone("feeder", ("feeder", "mutants/m57_feeder.yaml")), "B1",
    ),
    Mutant(
        "M58", "the feeder switches its motor off during a pause",
        in_alone("feeder", ("feeder", "mutants/m58_feeder.yaml")), "P10_power",
    ),
    Mutant(
        "M59", "the feeder restarts its cycle after a pause",
        in_alone("feeder", ("feeder", "mutants/m59_feeder.yaml")), "P2_press",
    ),
    Mutant(
        "M60",
        "the feeder reports the end of a stop at once if it presses, since the mould needs it",
        in_alone("feeder", ("feeder", "mutants/m60_feeder.yaml")),
        "H3",
    ),
    Mutant(
        "M61", "the extractor switches its magnet on before it drives into the mould",
        in_alone("extractor", ("extractor", "mutants/m61_extractor.yaml")), "P16",
    ),
    Mutant(
        "M62", "the extractor switches its magnet off during a pause",
        in_alone("extractor", ("extractor", "mutants/m62_extractor.yaml")), "P9",
    ),
    Mutant(
        "M63",
        "the extractor sends `taken` with its arm still in the mould",
        in_alone("extractor", ("extractor", "mutants/m63_extractor.yaml")),
        "P1",
    ),
    Mutant(
        "M64", "the extractor sends `placed` when it releases the block, not when its arm is back",
        in_alone("extractor", ("extractor", "mutants/m64_extractor.yaml")), "P6",
    ),
    Mutant(
        "M65", "the extractor drives back as soon as its magnet is switched off",
        in_alone("extractor", ("extractor", "mutants/m65_extractor.yaml")), "P17",
    ),
    Mutant(
        "M66", "the extractor releases its block when it is stopped",
        in_alone("extractor", ("extractor", "mutants/m66_extractor.yaml")), "P9",
    ),
    Mutant(
        "M67", "the extractor forgets the block on its magnet at an emergency stop",
        in_alone("extractor", ("extractor", "mutants/m67_extractor.yaml")), "P16",
    ),
    Mutant(
        "M68", "the extractor is ready again after an emergency stop without homing",
        in_alone("extractor", ("extractor", "mutants/m68_extractor.yaml")), "H3",
    ),
    Mutant(
        "M69", "the feeder belt grants its slot at each request, whatever it does",
        in_alone("feeder_belt", ("feeder_belt", "mutants/m69_feeder_belt.yaml")), "P5",
    ),
    Mutant(
        "M70",
        "the feeder belt takes its slot back with the arm still over it",
        in_alone("feeder_belt", ("feeder_belt", "mutants/m70_feeder_belt.yaml")),
        "P5",
    ),
    Mutant(
        "M71", "the feeder belt reports that a block is ready when it starts to move",
        in_alone("feeder_belt", ("feeder_belt", "mutants/m71_feeder_belt.yaml")), "P3",
    ),
    Mutant(
        "M72", "the feeder belt checks only that the pocket is empty, not that the feeder is back",
        in_alone("feeder_belt", ("feeder_belt", "mutants/m72_feeder_belt.yaml")), "P3",
    ),
    Mutant(
        "M73", "the feeder belt sets its zero between two slots when it is stopped",
        in_alone("feeder_belt", ("feeder_belt", "mutants/m73_feeder_belt.yaml")), "P9",
    ),
    Mutant(
        "M74",
        "the feeder belt switches the lamp off in two transitions, not in the exit of the state",
        in_alone("feeder_belt", ("feeder_belt", "mutants/m74_feeder_belt.yaml")),
        "P18",
    ),
    Mutant(
        "M75", "the extraction belt reads the sensor of the wrong slot after a motion",
        in_alone("extraction_belt", ("extraction_belt", "mutants/m75_extraction_belt.yaml")), "L1",
    ),
    Mutant(
        "M76",
        "the extraction belt moves with the pusher still out",
        in_alone("extraction_belt", ("extraction_belt", "mutants/m76_extraction_belt.yaml")),
        "P7",
    ),
    Mutant(
        "M77",
        "the extraction belt takes its last slot for free with the arm still over it",
        in_alone("extraction_belt", ("extraction_belt", "mutants/m77_extraction_belt.yaml")),
        "P4",
    ),
    Mutant(
        "M78", "the sorter never gives up waiting for a verdict",
        in_alone("sorter", ("sorter", "mutants/m78_sorter.yaml")), "F2",
    ),
    Mutant(
        "M79", "the sorter resets its count of tries with each try",
        in_alone("sorter", ("sorter", "mutants/m79_sorter.yaml")), "F7",
    ),
    Mutant(
        "M80", "the sorter answers the belt when the block is gone, not when its pusher is back",
        in_alone("sorter", ("sorter", "mutants/m80_sorter.yaml")), "P7",
    ),
    Mutant(
        "M81", "the sorter takes each stroke for a success and does not read its sensor",
        in_alone("sorter", ("sorter", "mutants/m81_sorter.yaml")), "Q7",
    ),
    Mutant(
        "M82", "the sorter lets a block pass that the camera could not judge",
        in_alone("sorter", ("sorter", "mutants/m82_sorter.yaml")), "Q7",
    ),
    Mutant(
        "M83", "the sorter reports a block as pushed out when it starts to push",
        in_alone("sorter", ("sorter", "mutants/m83_sorter.yaml")), "Q6",
    ),
    Mutant(
        "M84", "the sorter takes a late verdict for that of the next block",
        in_alone("sorter", ("sorter", "mutants/m84_sorter.yaml")), "Q7",
    ),
    Mutant(
        "M85", "production can be started while a module still homes",
        in_alone("feeder", ("supervisor", "mutants/m85_supervisor.yaml")), "P11_resume",
    ),
    Mutant(
        "M86", "production can be started again while a module still stops",
        in_alone("feeder", ("supervisor", "mutants/m86_supervisor.yaml")), "P11_resume",
    ),
    Mutant(
        "M87", "after a pause the modules are started, not resumed",
        in_alone("feeder", ("supervisor", "mutants/m87_supervisor.yaml")), "P11_resume",
    ),
    Mutant(
        "M88", "the reset is accepted before the relay has fallen",
        in_alone("feeder", ("supervisor", "mutants/m88_supervisor.yaml")), "E2",
    ),
    Mutant(
        "M89", "a fault while homing is ignored",
        in_alone("feeder", ("supervisor", "mutants/m89_supervisor.yaml")), "F6",
    ),
    Mutant(
        "M90", "after a fault the modules are reset without an emergency stop before",
        in_pair("molder-extractor", ("supervisor", "mutants/m90_supervisor.yaml")), "R2",
    ),
    Mutant(
        "M91",
        "the camera sends its verdict when it has judged the block, not when that leaves its view",
        in_alone("camera", ("camera", "mutants/m91_camera.yaml")),
        "Q8",
    ),
    Mutant(
        "M92", "the camera reports a block that was not judged as a good one",
        in_alone("camera", ("camera", "mutants/m92_camera.yaml")), "Q8",
    ),
    Mutant(
        "M93", "the extractor holds its position after a fault, with power",
        in_alone("extractor", ("extractor", "mutants/m93_extractor.yaml")), "F6_power",
    ),
    Mutant(
        "M94", "the extraction belt does not report the fault that an answer is missing",
        in_alone("extraction_belt", ("extraction_belt", "mutants/m94_extraction_belt.yaml")), "F6",
    ),
    Mutant(
        "M95", "the time limit of homing covers only the search for the switch",
        in_alone("extractor", ("extractor", "mutants/m95_extractor.yaml")), "F5_homing",
    ),
    Mutant(
        "M12", "the same, six blocks: some gap always moves",
        in_ring(6, ("feeder_belt", "mutants/m12_feeder_belt.yaml")), "",
    ),
    Mutant(
        "EQ", "no defect: a guard that another implies is omitted",
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
    """Whether to check `leads_to`: not for a ring that may pause forever.

    With many blocks it is checked where no external event waits, which makes a diagram smaller.
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
    """Whether a defect was found, or an equivalent mutant holds."""
    if not mutant.breaks:
        return all(result.verdict is HOLDS for result in report.results)
    return any(r.name == mutant.breaks and r.verdict is VIOLATED for r in report.results)


def length(mutant: Mutant, report: fsmkit.Report) -> int:
    """Return the number of steps of the counterexample; 0 without one."""
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
    """Explore the reference charts; print systems and properties; return whether all hold."""
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
    """Explore the mutants; print the violated properties; return whether all is as expected."""
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
