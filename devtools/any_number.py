"""Compare proofs for any number of machines with explicit searches.

``python -m devtools.any_number SYSTEM ... [--most 7]`` decides each system for ``N=any``, and
explores it for each number of machines up to ``--most``. It fails if a verdict differs, or if a
reachable state has a window that is not in the proof's set.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from itertools import combinations
from pathlib import Path

import click

from fsmkit.diagnostics import Findings
from fsmkit.verify.any_number import prove
from fsmkit.verify.any_number.cells import Ring
from fsmkit.verify.any_number.multisets import Multisets
from fsmkit.verify.any_number.windows import Windows
from fsmkit.verify.explore import ExplorationOptions, check
from fsmkit.verify.report.verdict import Verdict

MOST_STATES = 40_000
"""States of a system whose windows are compared."""


def problems(
    proof: prove.Proof, most: int, options: ExplorationOptions, states: int = MOST_STATES
) -> Iterator[str]:
    """Yield each difference between a proof and explorations of up to ``most`` machines."""
    path = proof.family.path
    for value in range(proof.family.least, most + 1):
        report = check(proof.family.system(value, Findings()), Findings(), options=options)
        own = {result.name: result.verdict for result in report.results}
        for result in proof.results:
            explored = own.get(result.name, Verdict.HOLDS)
            if result.verdict is Verdict.HOLDS and explored is not Verdict.HOLDS:
                yield f"{path.name}: `{result.name}` is proved, but {explored.value} for N={value}"
    if proof.views is not None:
        for value in range(proof.family.least, most + 1):
            yield from missing_views(proof, proof.views, value, options, states)


def missing_views(
    proof: prove.Proof,
    views: Windows | Multisets,
    value: int,
    options: ExplorationOptions,
    states: int,
) -> Iterator[str]:
    """Yield a view of reachable states of one size that is not in the set."""
    family, ring = proof.family, views.ring
    length = family.length(value)
    if length < views.least:
        return
    names = frozenset(result.name for result in proof.results)
    closed = prove.closed_for_views(family.system(value, Findings()), options, names)
    other = Ring(family, closed, ring.numbers)
    todo = [edge.to for edge in other.steps.initial()]
    seen = set(todo)
    for state in todo:  # grows
        cells = [other.cell(p, state) for p in range(length)]
        if isinstance(views, Multisets):
            is_known = has_multisets(views, cells)
        else:
            is_known = has_windows(views, cells)
        if not is_known:
            yield f"N={value}: a view of a reachable state is missing"
            return
        for edge in other.steps.successors(state):
            if edge.to not in seen and len(seen) < states:
                seen.add(edge.to)
                todo.append(edge.to)


def has_windows(windows: Windows, cells: list[int]) -> bool:
    """Return whether all windows of a state are in the set."""
    length = len(cells)
    return all(
        tuple(cells[(at + n) % length] for n in range(windows.width)) in windows.known[place]
        for place, start in enumerate(windows.starts)
        for at in positions(windows, place, length, start)
    )


def has_multisets(views: Multisets, cells: list[int]) -> bool:
    """Return whether all choices of machines of a state are in the set."""
    states = sorted(views.ring.numbers.contents[cell][0] for cell in cells)
    return set(combinations(states, views.width)) <= views.known


def positions(windows: Windows, place: int, length: int, start: int) -> Iterator[int]:
    """Yield the positions in a system of ``length`` machines that have a placement."""
    ends = windows.ring.family.ends
    if place == 0:
        yield from range(ends.low, length - ends.high - windows.width + 1)
    else:
        yield (start - windows.ring.length if start >= windows.ring.length // 2 else start) % length


@click.command()
@click.argument("systems", nargs=-1, required=True, type=click.Path(path_type=Path, exists=True))
@click.option("--most", default=7, show_default=True, help="Explore up to this many machines.")
@click.option("--time", "kind", default="untimed", show_default=True)
def main(systems: tuple[Path, ...], most: int, kind: str) -> None:
    """Compare proofs for any number of machines with explicit searches."""
    options = ExplorationOptions(time=kind)  # type: ignore[arg-type]
    count = 0
    for path in systems:
        began = time.monotonic()
        proof = prove.prove_file(path, Findings(), parameters={"N": "any"}, options=options)
        spent = time.monotonic() - began
        found = list(problems(proof, most, options))
        count += len(found)
        views = proof.abstraction
        verdicts = ", ".join(f"{r.name} {r.verdict.value}" for r in proof.results)
        shown = "-" if views is None else f"width {views.width}, {views.views} {views.method}"
        refuted = f", refuted for N={min(proof.refuted)}" if proof.refuted else ""
        click.echo(
            f"{path.stem}: {verdicts}{refuted}; {shown}; {spent:.1f} s; {len(found)} problems"
        )
        for each in found:
            click.echo(f"  {each}")
    raise SystemExit(count > 0)


if __name__ == "__main__":
    main()
