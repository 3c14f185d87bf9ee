"""A campaign for people, as rich text, and as data."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from difflib import unified_diff
from pathlib import Path

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from fsmkit.texts.lines import one_line
from fsmkit.verify.mutants.campaign import Campaign, score
from fsmkit.verify.mutants.fates import Fate, Judged
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
    """Return the survivors, each with its diff and a run that differs, and the scores."""
    parts: list[RenderableType] = []
    for judged in found.survivors:
        parts += [*_survivor(found, judged), Text()]
    parts += [scores(found), Text()]
    parts += _counts(found)
    return Group(*parts)


def _survivor(found: Campaign, judged: Judged) -> Iterator[Text]:
    mutant = judged.mutant
    place = "" if mutant.place is None else f" ({mutant.place})"
    yield Text(f"survives: {mutant.machine}, {mutant.operator}: {mutant.what}{place}", "bold red")
    for line in diff(found, judged):
        yield Text(line, {"+": "green", "-": "red"}.get(line[:1], ""))
    if len(judged.systems) > 1:
        yield Text(f"every property holds in {', '.join(judged.systems)}", "dim")
    contrast = judged.contrast
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


def decided(judged: Judged) -> Text:
    """Return a line on a mutant that was just judged."""
    mutant = judged.mutant
    place = "" if mutant.place is None else f" ({mutant.place})"
    why = ", ".join(judged.by) or judged.why
    return Text.assemble(
        (f"{judged.fate.value:<10} ", STYLES[judged.fate]),
        one_line(f"{mutant.machine}, {mutant.operator}: {mutant.what}{place}"),
        (f"  {one_line(why)}" if why else "", "dim"),
    )


def diff(found: Campaign, judged: Judged) -> tuple[str, ...]:
    """Return what changed, as lines of a unified diff of the chart in YAML; of a connection, it."""
    mutant = judged.mutant
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
    """Return a line for each machine: its mutants by fate, and the share that was found."""
    table = Table(box=None, pad_edge=False, padding=(0, 2, 0, 0), header_style="dim")
    table.add_column("machine")
    for heading in ("mutants", *(fate.value for fate in Fate), "score"):
        table.add_column(heading, justify="right")
    rows = [(name, found.of(name)) for name in found.documents]
    for name, judged in (*rows, ("all", found.judged)):
        counts = [str(sum(each.fate is fate for each in judged)) for fate in Fate]
        table.add_row(Text(name), str(len(judged)), *counts, _percent(judged))
    return table


def _percent(judged: tuple[Judged, ...]) -> str:
    share = score(judged)
    return "-" if share is None else f"{100 * share:.0f} %"


def _counts(found: Campaign) -> Iterator[Text]:
    by: dict[str, int] = {}
    for judged in found.judged:
        for name in judged.by:
            by[name] = by.get(name, 0) + 1
    if by:
        named = ", ".join(f"{name} {by[name]}" for name in sorted(by, key=lambda n: (-by[n], n)))
        yield Text(f"found by: {named}")
    idle = [r.name for r in found.original.results if r.kind is not None and r.name not in by]
    if idle:
        yield Text(f"found none first: {', '.join(idle)}", "dim")
    yield Text(
        f"{found.possible:,} changes are possible; of those tried {found.same} mean the same as "
        f"the original or as another, {found.broken} cannot be elaborated; {found.left:,} not tried"
        + (f": {found.ended}" if found.ended else ""),
        "dim",
    )
    missing = min(found.wanted - len(found.judged), found.left)
    if found.ended and missing > 0:
        yield Text(f"{len(found.judged):,} of {found.wanted:,} mutants are judged", "yellow")


def document(found: Campaign) -> Mapping[str, object]:
    """Return a campaign as data."""
    return {
        "verdict": found.original.verdict.value,
        "mutants": [_judged(found, each) for each in found.judged],
        "score": score(found.judged),
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


def _judged(found: Campaign, judged: Judged) -> Mapping[str, object]:
    mutant, contrast = judged.mutant, judged.contrast
    told: dict[str, object] = {
        "machine": mutant.machine,
        "operator": mutant.operator,
        "what": mutant.what,
        "place": None if mutant.place is None else str(mutant.place),
        "fate": judged.fate.value,
        "by": list(judged.by),
        "states": judged.states,
        "systems": list(judged.systems),
    }
    if judged.why:
        told["why"] = judged.why
    if judged.fate is Fate.SURVIVING:
        told["diff"] = list(diff(found, judged))
    if contrast is not None and contrast.lines:
        told["run"] = list(contrast.steps)
        told["run_of"] = "mutant" if contrast.in_mutant else "original"
    elif contrast is not None:
        told["why"] = contrast.why
        told["local"] = list(contrast.local)
    return told
