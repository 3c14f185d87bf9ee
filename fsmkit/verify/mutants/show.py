"""Format a campaign of mutants as rich text, and as data."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from difflib import unified_diff
from pathlib import Path

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from fsmkit.emit.lines import one_line
from fsmkit.verify.mutants.campaign import Campaign, score
from fsmkit.verify.mutants.fates import Evaluated, Fate
from fsmkit.yaml.writer import write_document

CONTEXT = 2
"""Lines around a change that a diff shows."""
MOST_STEPS = 12
"""The last steps of a run that differs, as the terminal shows them."""


STYLES = {
    Fate.FOUND: "green",
    Fate.EQUIVALENT: "dim",
    Fate.SURVIVING: "bold red",
    Fate.UNDECIDED: "yellow",
}


def summary(found: Campaign) -> RenderableType:
    """Return the survivors, each with its diff and a differing run, and the scores."""
    parts: list[RenderableType] = []
    for evaluated in found.survivors:
        parts += [*_survivor(found, evaluated), Text()]
    parts += [scores(found), Text()]
    parts += _counts(found)
    return Group(*parts)


def _survivor(found: Campaign, evaluated: Evaluated) -> Iterator[Text]:
    mutant = evaluated.mutant
    place = "" if mutant.place is None else f" ({mutant.place})"
    yield Text(f"survives: {mutant.machine}, {mutant.operator}: {mutant.what}{place}", "bold red")
    for line in diff(found, evaluated):
        yield Text(line, {"+": "green", "-": "red"}.get(line[:1], ""))
    if len(evaluated.systems) > 1:
        yield Text(f"every property holds in {', '.join(evaluated.systems)}", "dim")
    contrast = evaluated.contrast
    if contrast is None or not contrast.lines:
        why = "" if contrast is None else contrast.why
        yield Text(f"no run that differs was found: {why}", "dim")
        yield from map(Text, () if contrast is None else contrast.local)
        return
    own, other = ("mutant", "original") if contrast.in_mutant else ("original", "mutant")
    yield Text(f"a run of the {own} that the {other} does not have:")
    if len(contrast.lines) > MOST_STEPS:
        yield Text(f"  ... {len(contrast.lines) - MOST_STEPS} steps before", "dim")
    for line in contrast.lines[-MOST_STEPS:]:
        yield Text(f"  {line}")


def decided(evaluated: Evaluated) -> Text:
    """Return a line on a mutant after its evaluation."""
    mutant = evaluated.mutant
    place = "" if mutant.place is None else f" ({mutant.place})"
    why = ", ".join(evaluated.by) or evaluated.why
    return Text.assemble(
        (f"{evaluated.fate.value:<10} ", STYLES[evaluated.fate]),
        one_line(f"{mutant.machine}, {mutant.operator}: {mutant.what}{place}"),
        (f"  {one_line(why)}" if why else "", "dim"),
    )


def diff(found: Campaign, evaluated: Evaluated) -> tuple[str, ...]:
    """Return the change as a unified diff of the chart in YAML; for a connection, its line."""
    mutant = evaluated.mutant
    if mutant.documents is None:
        return (f"- connect: {mutant.what}",)
    lines: list[str] = []
    originals = found.documents[mutant.machine]
    for original, changed in zip(originals, mutant.documents, strict=True):
        if original is changed:
            continue
        name = Path(original.source.name).name
        before, after = (write_document(each).splitlines() for each in (original, changed))
        lines += unified_diff(before, after, name, f"{name} (mutant)", lineterm="", n=CONTEXT)
    return tuple(map(one_line, lines))


def scores(found: Campaign) -> Table:
    """Return a line for each machine: its mutants by fate, and the detected share."""
    table = Table(box=None, pad_edge=False, padding=(0, 2, 0, 0), header_style="dim")
    table.add_column("machine")
    for heading in ("mutants", *(fate.value for fate in Fate), "score"):
        table.add_column(heading, justify="right")
    rows = [(name, found.of(name)) for name in found.documents]
    for name, evaluated in (*rows, ("all", found.evaluated)):
        counts = [str(sum(each.fate is fate for each in evaluated)) for fate in Fate]
        table.add_row(Text(name), str(len(evaluated)), *counts, _percent(evaluated))
    return table


def _percent(evaluated: tuple[Evaluated, ...]) -> str:
    share = score(evaluated)
    return "-" if share is None else f"{100 * share:.0f} %"


def _counts(found: Campaign) -> Iterator[Text]:
    by: dict[str, int] = {}
    for evaluated in found.evaluated:
        for name in evaluated.by:
            by[name] = by.get(name, 0) + 1
    if by:
        named = ", ".join(f"{name} {by[name]}" for name in sorted(by, key=lambda n: (-by[n], n)))
        yield Text(f"found by: {named}")
    idle = [r.name for r in found.original.results if r.kind is not None and r.name not in by]
    if idle:
        yield Text(f"found none first: {', '.join(idle)}", "dim")
    yield Text(
        f"{found.possible:,} changes are possible; of those tried {found.same} are equal to "
        f"the original or as another, {found.broken} cannot be elaborated; {found.left:,} not tried"
        + (f": {found.ended}" if found.ended else ""),
        "dim",
    )
    missing = min(found.wanted - len(found.evaluated), found.left)
    if found.ended and missing > 0:
        yield Text(f"{len(found.evaluated):,} of {found.wanted:,} mutants are evaluated", "yellow")


def document(found: Campaign) -> Mapping[str, object]:
    """Return a campaign as data."""
    return {
        "verdict": found.original.verdict.value,
        "mutants": [_evaluated(found, each) for each in found.evaluated],
        "score": score(found.evaluated),
        "machines": {
            name: {
                **{fate.value: sum(j.fate is fate for j in found.of(name)) for fate in Fate},
                "score": score(found.of(name)),
            }
            for name in found.documents
        },
        "possible": found.possible,
        "same": found.same,
        "broken": found.broken,
        "left": found.left,
        "wanted": found.wanted,
        "ended": found.ended,
    }


def _evaluated(found: Campaign, evaluated: Evaluated) -> Mapping[str, object]:
    mutant, contrast = evaluated.mutant, evaluated.contrast
    record: dict[str, object] = {
        "machine": mutant.machine,
        "operator": mutant.operator,
        "what": mutant.what,
        "place": None if mutant.place is None else str(mutant.place),
        "fate": evaluated.fate.value,
        "by": list(evaluated.by),
        "states": evaluated.states,
        "systems": list(evaluated.systems),
    }
    if evaluated.why:
        record["why"] = evaluated.why
    if evaluated.fate is Fate.SURVIVING:
        record["diff"] = list(diff(found, evaluated))
    if contrast is not None and contrast.lines:
        record["run"] = list(contrast.steps)
        record["run_of"] = "mutant" if contrast.in_mutant else "original"
    elif contrast is not None:
        record["why"] = contrast.why
        record["local"] = list(contrast.local)
    return record
