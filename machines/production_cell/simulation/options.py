"""The options of a run, and what is made of them: programs, plant, world."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import click

from . import boards, faults, markers, monitor, nodes, plant_fmu
from .camera import Detector, Judgement, itself
from .orchestrator import Estimating, Setup
from .pace import Pace
from .panel import Operator
from .world import World

SPARE = 120
"""For so many s longer than their run boards go on if nobody ends them."""


@dataclass(frozen=True, slots=True)
class Options:
    """The options of a run; see the command line."""

    steps: int
    out: Path
    blocks: int = 3
    seed: int = 1
    fault: str = ""
    bad: float = 0.05
    sorter: str = "verdict"
    drift: float = 0.0
    estimator: str = "itself"
    domain: int = 18
    aruco: bool = False
    plant: str = "itself"
    double: bool = False
    hz: int = 0
    priority: int = 0
    registers: bool = False
    timeout: float = 10.0
    is_followed: bool = False
    """Boards write their logs out before each answer."""

    @property
    def pace(self) -> Pace:
        """The pace of the run."""
        return Pace(self.hz, self.priority)

    @property
    def ring(self) -> Path:
        """The system whose properties are judged."""
        return monitor.BY_POSITION if self.sorter == "position" else monitor.RING


OPTIONS = (
    click.option(
        "--blocks", type=click.IntRange(1, 8), default=3, show_default=True, help="In the ring."
    ),
    click.option("--seed", type=int, default=1, show_default=True),
    click.option(
        "--fault", default="", help=f"One of {', '.join(faults.DEFAULTS)}, or a file of them."
    ),
    click.option("--bad", type=float, default=0.05, show_default=True, help="Share of bad blocks."),
    click.option(
        "--sorter",
        type=click.Choice(["verdict", "position"]),
        default="verdict",
        show_default=True,
        help="By which it goes: the verdict of the camera, or where the block is estimated to be.",
    ),
    click.option(
        "--drift",
        type=float,
        default=0.0,
        help="By this share of it, the way of the belt is taken for too long by the estimate.",
    ),
    click.option(
        "--estimator",
        type=click.Choice(["itself", "ros"]),
        default="itself",
        show_default=True,
        help="With `--sorter position`: `ros` is a process of its own, over topics of ROS 2.",
    ),
    click.option(
        "--domain",
        type=click.IntRange(0, 232),
        default=18,
        show_default=True,
        help="Of DDS, with `--estimator ros`: another for each run at a time.",
    ),
    click.option("--aruco", is_flag=True, help="Read the blocks off pictures, with OpenCV."),
    click.option(
        "--plant",
        default="itself",
        show_default=True,
        help="`fmu`: packed as an FMU; or the path of another's FMU.",
    ),
    click.option("--double", is_flag=True, help="The boards in Python, in one process, not in C."),
    click.option("--hz", type=int, default=0, help="Hardware in the loop: cycles a second."),
    click.option(
        "--priority",
        type=click.IntRange(0, 97),
        default=0,
        help="Rate of the boards' loops, with --hz.",
    ),
    click.option(
        "--registers", is_flag=True, help="The wires of the boards are registers of a fake FPGA."
    ),
    click.option("--timeout", type=float, default=10.0, help="For an answer of a process, in s."),
)


def run_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Give a command the options of a run, named as the fields of `Options`."""
    for option in reversed(OPTIONS):
        command = option(command)
    return command


def steps_of(hours: float, seconds: float | None) -> int:
    """Return how many steps a run takes."""
    return round(1000 * (hours * 3600 if seconds is None else seconds))


def prepare(options: Options, endpoints: Path) -> tuple[Setup, World]:
    """Build what is run; sockets are in a folder. Raises `CellError`, `FaultError`."""
    _check_pace(options.pace, double=options.double)
    if options.registers and options.double:
        raise nodes.CellError("--double has no wires: remove --registers")
    if options.estimator == "ros" and options.sorter != "position":
        raise nodes.CellError("--estimator ros switches nothing: add --sorter position")
    out = options.out
    out.mkdir(parents=True, exist_ok=True)
    schedule = faults.read(options.fault)
    faults.check_times(schedule, options.steps)
    by_position = options.sorter == "position"
    programs = (
        (nodes.double_program(by_position=by_position),)
        if options.double
        else boards.build(
            out / ("boards_by_position" if by_position else "boards"),
            endpoints,
            options.pace,
            options.steps // 1000 + SPARE,
            registers=options.registers,
            by_position=by_position,
            is_followed=options.is_followed,
        )
    )
    about = {"seed": options.seed, "blocks": options.blocks, "fault": options.fault}
    setup = Setup(
        options.steps, programs, _plant(options.plant, out, options.seed), out, endpoints,
        schedule, about, options.timeout, pace=options.pace, estimator=_estimator(options),
    )  # fmt: skip
    judgement = Judgement(options.seed, options.bad, drift=options.drift)
    detector = _detector(aruco=options.aruco, seed=options.seed)
    if options.aruco and options.hz:
        detector = markers.Bounded(detector)
    return setup, World(Operator(options.blocks), judgement, (), detector)


def _check_pace(pace: Pace, *, double: bool) -> None:
    """Raise `CellError` if the boards cannot run at this pace."""
    if pace.hz < 0 or (pace.hz and 1000 % pace.hz):
        raise nodes.CellError(f"--hz {pace.hz} is no divisor of 1000")
    if pace.hz and double:
        raise nodes.CellError("--double has no loop of its own: remove --hz")
    if pace.priority and not pace.hz:
        raise nodes.CellError("--priority needs --hz: without it nobody looks at a clock")


def _detector(*, aruco: bool, seed: int) -> Detector:
    """Return the detector of blocks."""
    if not aruco:
        return itself
    try:
        return markers.detector(seed)
    except ImportError:
        raise nodes.CellError("OpenCV is missing: pip install 'fsmkit[camera]'") from None


def _estimator(options: Options) -> Callable[[], Estimating] | None:
    """Return the program of an estimator in another process, or None."""
    if options.estimator != "ros":
        return None
    if find_spec("cyclonedds") is None:
        raise nodes.CellError("cyclonedds is missing: pip install 'fsmkit[ros]'")
    from ..vision.estimating import RosEstimator

    return lambda: RosEstimator(
        options.out / "estimator.log", options.drift, waits=not options.hz, domain=options.domain
    )


def _plant(plant: str, out: Path, seed: int) -> nodes.Program:
    """Return the plant: itself, itself as an FMU, or another's FMU."""
    if plant == "itself":
        return nodes.plant_program(seed)
    for package in ("fmpy", *(("pythonfmu3",) if plant == "fmu" else ())):
        if find_spec(package) is None:
            raise nodes.CellError(f"{package} is missing: pip install 'fsmkit[fmi]'")
    path = plant_fmu.build(out) if plant == "fmu" else Path(plant).resolve()
    if not path.is_file():
        raise nodes.CellError(f"there is no FMU {plant}; --plant is `itself`, `fmu` or a file")
    return nodes.fmu_program(path, seed)
