"""How far drawings move while charts are edited: ``python -m devtools.stability``.

Random edits, one gesture each, are made on charts of the production cell and on built ones. After
each of them it measures how far the states move that the edit did not touch, in percent of the
diagonal of the drawing. After the last one it compares crossings of arrows and the area with a
fresh layout of the same chart, which *Tidy* brings. It ends with 1 if a limit is exceeded.
"""

from __future__ import annotations

import math
import random
import shutil
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from itertools import combinations, pairwise
from pathlib import Path
from statistics import fmean, median

import click

from fsmkit.chart.chart import Chart
from fsmkit.chart.drawing.positions.curves import Point, along
from fsmkit.chart.drawing.positions.placement import Placement, renamed
from fsmkit.chart.loading import load
from fsmkit.diagnostics import FsmkitError, Source
from fsmkit.diagnostics.fixes import apply_edits
from fsmkit.document.document import Kind, Origin, Trigger
from fsmkit.editor.editing import operations as op
from fsmkit.editor.editing.applying import apply
from fsmkit.system.views.drawing import draw_kept

MEAN, PART, FAR, TIMES = 1.0, 0.95, 6.0, 2.0
"""Limits: percent of the diagonal on average, and of this part of all; times a fresh layout."""
CELL = Path(__file__).parents[1] / "machines" / "production_cell"
NAMES = (
    "feeder", "supervisor", "molder", "robot", "belt", "extraction_belt", "plant", "plant/lens",
    "sorter", "feeder_belt", "plant/arm", "plant/axis", "plant/pusher", "plant/belt",
)  # fmt: skip
EMPTY = "chart: Empty\nevents: {in: [go]}\nstates: {first: {}}\n"
REGIONS = """chart: Regions
events: {in: [go]}
states:
  off: {on: {go: on}}
  on:
    regions:
"""


@dataclass(slots=True)
class Result:
    """The measures of one chart."""

    name: str
    edits: int = 0
    distances: list[float] = field(default_factory=list)
    milliseconds: list[float] = field(default_factory=list)
    crossings: tuple[int, int] = (0, 0)
    """At the end, and of a fresh layout."""
    areas: tuple[float, float] = (0.0, 0.0)
    is_tidy: bool = True

    @property
    def far(self) -> float:
        """The distance that only few states exceed, in percent."""
        found = sorted(self.distances)
        return found[min(int(PART * len(found)), len(found) - 1)] if found else 0.0

    @property
    def mean(self) -> float:
        """The distance of a state on average, in percent."""
        return fmean(self.distances) if self.distances else 0.0

    @property
    def is_good(self) -> bool:
        """Whether all limits hold."""
        return (
            self.mean <= MEAN
            and self.far < FAR
            and self.crossings[0] <= TIMES * max(self.crossings[1], 1)
            and self.areas[0] <= TIMES * self.areas[1]
            and self.is_tidy
        )

    def __str__(self) -> str:
        """Return a line of the report."""
        return (
            f"{self.name:18}{self.edits:4} edits  mean {self.mean:5.2f} %  95 % {self.far:5.2f} %  "
            f"crossings {self.crossings[0]:4}/{self.crossings[1]:4}  "
            f"area {self.areas[0] / max(self.areas[1], 1.0):4.2f}  "
            f"median {median(self.milliseconds or [0.0]):4.0f} ms{'' if self.is_good else '  FAR'}"
        )


# --- charts ---------------------------------------------------------------------------------------


def rings(groups: int, size: int, regions: int = 0) -> str:
    """Return a chart of composite states, each a ring of states, or of parallel regions."""
    if regions:
        lines = [REGIONS.rstrip("\n")]
        groups = regions
    else:
        lines = ["chart: Rings", "events: {in: [go, ring]}", "states:"]
    margin = " " * (6 if regions else 2)
    for group in range(groups):
        lines.append(f"{margin}g{group}:")
        if not regions:
            lines.append(f"{margin}  on: {{ring: g{(group + 1) % groups}}}")
        lines.append(f"{margin}  states:")
        lines += (
            f"{margin}    g{group}s{n}: {{on: {{go: g{group}s{(n + 1) % size}}}}}"
            for n in range(size)
        )
    return "\n".join(lines) + "\n"


BUILT = (
    ("empty", EMPTY), ("flat", rings(1, 12)), ("rings", rings(4, 4)), ("many", rings(8, 8)),
    ("regions", rings(0, 3, 3)), ("wide", rings(0, 5, 5)),
)  # fmt: skip


def charts(folder: Path, count: int) -> Iterator[Path]:
    """Yield chart files that may be edited, in a new folder."""
    built: list[Path] = []
    for name, text in BUILT:
        built.append(folder / f"{name}.yaml")
        built[-1].write_text(text, encoding="utf-8")
    named = [folder / str(number) / f"{name}.yaml" for number, name in enumerate(NAMES)]
    for number in range(len(NAMES)):  # an edit of a base would change the charts derived from it
        ignored = shutil.ignore_patterns("__pycache__", "*.py", "live", "mutants")
        shutil.copytree(CELL, folder / str(number), ignore=ignored)
    mixed = [path for pair in zip(named, built, strict=False) for path in pair]
    yield from [*mixed, *named[len(built) :]][:count]


# --- edits ----------------------------------------------------------------------------------------


def random_edit(chart: Chart, choices: random.Random, number: int) -> Sequence[op.Operation]:
    """Return the operations of one gesture."""
    states = [s for s in chart.states[1:] if s.kind not in (Kind.FINAL, Kind.CHOICE)]
    states = [s for s in states if not s.is_history]
    own = [s for s in states if s.origin is not Origin.INHERITED] or states
    source, target, one = choices.choice(own), choices.choice(states), choices.choice(own)
    parent = chart.states[source.parent or 0]
    inside = parent.id if source.parent else ""
    delay = f"{number + 1}s"
    match choices.choices(range(7), (40, 25, 10, 8, 5, 5, 7))[0]:
        case 0:
            return (op.AddTransition(source.id, (target.id,), Trigger.AFTER, delay),)
        case 1:
            name = f"new{number}"
            if parent.kind is Kind.PARALLEL:
                return (op.AddState(source.id, name),)
            return (
                op.AddState(inside, name),
                op.AddTransition(source.id, (name,), Trigger.AFTER, delay),
            )
        case 2:
            return (
                op.RenameSymbol("state", one.id, f"{one.id.rpartition('_')[0] or 'x'}_{number}"),
            )
        case 3:
            count = len(one.transitions)
            return (op.RemoveTransition(one.id, choices.randrange(count)),) if count else ()
        case 4:
            return () if one.children else (op.RemoveState(one.id),)
        case 5:
            return (op.MoveState(one.id, target.id),) if target.kind is Kind.COMPOUND else ()
        case _:
            count = len(one.transitions)
            index = choices.randrange(count) if count else 0
            label = f"{number * 100 + 1}ms"
            return (op.SetTrigger(one.id, index, Trigger.AFTER, label),) if count else ()


def touched(operations: Sequence[op.Operation]) -> set[str]:
    """Return the states that an edit itself moves, adds or renames."""
    found: set[str] = set()
    for one in operations:
        match one:
            case op.AddState(name=name) | op.RemoveState(state=name) | op.MoveState(state=name):
                found.add(name)
            case op.RenameSymbol(new=name):
                found.add(name)
            case _:
                pass
    return found


# --- measures -------------------------------------------------------------------------------------


def size(placement: Placement) -> tuple[float, float]:
    """Return width and height of a drawing, in points."""
    boxes = placement.boxes.values()
    return (
        max(box.right for box in boxes) - min(box.x for box in boxes),
        max(box.bottom for box in boxes) - min(box.y for box in boxes),
    )


def crossings(placement: Placement) -> int:
    """Return how many pairs of arrows cross that have no end in common."""
    lines = [
        (frozenset(name.split("_")[0].replace(">", " ").split()), along(arrow))
        for name, arrow in placement.arrows.items()
    ]
    around = [
        (min(x for x, _ in p), min(y for _, y in p), max(x for x, _ in p), max(y for _, y in p))
        for _, p in lines
    ]
    found = 0
    for (a, (ends, one)), (b, (others, two)) in combinations(enumerate(lines), 2):
        (l1, t1, r1, b1), (l2, t2, r2, b2) = around[a], around[b]
        if l1 < r2 and l2 < r1 and t1 < b2 and t2 < b1 and not ends & others:
            found += any(_meet(*s, *t) for s in pairwise(one) for t in pairwise(two))
    return found


def _meet(a: Point, b: Point, c: Point, d: Point) -> bool:
    """Whether two lines cross."""

    def side(p: Point, q: Point, r: Point) -> float:
        return (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0])

    return side(a, b, c) * side(a, b, d) < 0 and side(c, d, a) * side(c, d, b) < 0


def measure(path: Path, edits: int, seed: int) -> Result:
    """Edit one chart and return its measures."""
    choices = random.Random(f"{seed} {path.stem}")  # noqa: S311
    result = Result(path.stem)
    chart = load(path)
    _, placement = draw_kept(chart, None)
    for number in range(20 * edits):
        if result.edits == edits:
            break
        operations = random_edit(chart, choices, number)
        before = text = path.read_text(encoding="utf-8")
        try:
            for one in operations:
                text = apply_edits(text, apply(Source(str(path), text), one))
            path.write_text(text, encoding="utf-8")
            changed = load(path)
        except FsmkitError:  # the edit does not fit the chart
            path.write_text(before, encoding="utf-8")
            continue
        if text == before:
            continue
        for one in operations:
            if isinstance(one, op.RenameSymbol):
                placement = renamed(placement, one.name, one.new)
        start = time.process_time()
        _, new = draw_kept(changed, placement)
        result.milliseconds.append(1000 * (time.process_time() - start))
        diagonal = math.hypot(*size(placement))
        result.distances += (
            100 * math.hypot(new.boxes[s.id].x - old.x, new.boxes[s.id].y - old.y) / diagonal
            for s in changed.states[1:]
            if s.id not in touched(operations)
            and s.id in new.boxes
            and (old := placement.boxes.get(s.id)) is not None
        )
        chart, placement = changed, new
        result.edits += 1
    _, fresh = draw_kept(chart, None)
    result.crossings = crossings(placement), crossings(fresh)
    result.areas = math.prod(size(placement)), math.prod(size(fresh))
    result.is_tidy = draw_kept(chart, None)[1] == fresh
    return result


@click.command()
@click.option("--charts", "count", default=20, help="Number of charts, at most 20.")
@click.option("--edits", default=200, help="Edits of each chart.")
@click.option("--seed", default=1, help="Seed of the random edits.")
@click.option("--only", default="", help="Only the chart of this name.")
def main(count: int, edits: int, seed: int, only: str) -> None:
    """Measure the stability of drawings while charts are edited."""
    results: list[Result] = []
    with tempfile.TemporaryDirectory() as folder:
        for path in charts(Path(folder), count):
            if only in ("", path.stem):
                results.append(measure(path, edits, seed))
                click.echo(str(results[-1]))
    if not results:
        sys.exit(2)
    whole = Result(
        "all", sum(each.edits for each in results),
        [distance for each in results for distance in each.distances],
        [each for result in results for each in result.milliseconds],
        (sum(e.crossings[0] for e in results), sum(e.crossings[1] for e in results)),
        (sum(e.areas[0] for e in results), sum(e.areas[1] for e in results)),
        all(each.is_tidy for each in results),
    )  # fmt: skip
    click.echo(str(whole))
    sys.exit(0 if whole.is_good else 1)


if __name__ == "__main__":
    main()
