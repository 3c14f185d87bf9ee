"""Rename each name of a system, check that the meaning is unchanged, and rename it back.

``python -m devtools.editor.renaming machines/production_cell ring.yaml cell.yaml --most 400``

After each renaming the systems are read again from the changed sources. There must be no new
finding, and the Plan of each machine and all connections must be equal up to the name. Renamed
back, every source must be equal byte for byte.
"""

from __future__ import annotations

import argparse
import json
import re
import sys
import time
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

from fsmkit.diagnostics import Findings
from fsmkit.editor.analysis import Analyses
from fsmkit.editor.context import Context
from fsmkit.editor.features.rename import RenameError, Renaming, renaming
from fsmkit.editor.index.symbols import Occurrence, Role, Symbol, SymbolKind
from fsmkit.editor.index.workspace import Workspace
from fsmkit.plan.lower import lower
from fsmkit.plan.tree import plan_document
from fsmkit.system.any_file import read, system_within
from fsmkit.system.system import System

FRESH = "zz_renamed"


def meaning(system: System) -> str:
    """Return the Plans and wires of a system as a string."""
    plans = [[m.name, plan_document(lower(m.chart))] for m in system.machines]
    return json.dumps(
        {
            "plans": plans,
            "events": [str(link) for link in system.event_links],
            "inputs": [str(link) for link in system.input_links],
            "properties": [p.name for p in system.properties],
            "possible": [str(p) for p in system.possible],
        },
        default=str,
    )


def named(context: Context, paths: tuple[Path, ...]) -> Iterator[tuple[Path, Occurrence]]:
    """Yield a place of each symbol that some files depend on, in the order of the files."""
    wanted = frozenset(p for path in paths for p in context.workspace.depends_on(path))
    seen: set[Symbol] = set()
    for path, uses in context.workspace.all_uses():
        for occurrence in uses.occurrences if path in wanted else ():
            if occurrence.role is not Role.DECLARATION or occurrence.symbol in seen:
                continue
            if occurrence.symbol.kind in (SymbolKind.CHART, SymbolKind.SYSTEM):
                continue
            seen.add(occurrence.symbol)
            yield path, occurrence


def apply(context: Context, made: Renaming) -> None:
    """Set the renamed sources as the open files of the editor."""
    for path in made.places:
        file = context.workspace.file(path)
        assert file is not None  # noqa: S101  (it was just read)
        context.workspace.set_text(path, made.text(path, file.source.text).encode())


def meanings_and_findings(context: Context, paths: tuple[Path, ...]) -> tuple[list[str], list[str]]:
    """Return the meaning and the findings of some systems."""
    meanings, found = [], []
    with context.workspace.unsaved():
        for path in paths:
            findings = Findings()
            meanings.append(meaning(system_within(read(path, findings))))
            found += [f"{f.rule.name} {f.message}" for f in findings]
    return meanings, found


def main() -> int:
    """Run the campaign; return 1 if a renaming was rejected or changed a meaning."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("systems", nargs="+")
    parser.add_argument("--most", type=int, default=400)
    parser.add_argument("--skip", type=int, default=0)
    given = parser.parse_args()
    workspace = Workspace((given.folder.resolve(),))
    context = Context(workspace, Analyses(workspace))
    paths = tuple((given.folder / name).resolve() for name in given.systems)
    places = list(named(context, paths))
    step = max(1, len(places) // given.most)
    chosen = places[given.skip % step :: step][: given.most]
    before = meanings_and_findings(context, paths)
    counts: Counter[str] = Counter()
    wrong: list[str] = []
    times: list[float] = []
    for number, (path, occurrence) in enumerate(chosen):
        new = f"{FRESH}_{number}"
        position = context.range(occurrence.span).start
        started = time.perf_counter()
        try:
            made = renaming(context, path, position, new)
        except RenameError as error:
            wrong.append(f"{path.name} {occurrence.symbol}: rejected: {error}")
            continue
        times.append(time.perf_counter() - started)
        originals = {p: context.source(p) for p in made.places}
        apply(context, made)
        try:
            after = meanings_and_findings(context, paths)
            back = re.compile(rf"(?<![A-Za-z0-9]){new}(?![A-Za-z0-9])")
            if [back.sub(made.old, text) for text in after[0]] != before[0]:
                wrong.append(f"{path.name} {occurrence.symbol}: another meaning")
            if [back.sub(made.old, text) for text in after[1]] != before[1]:
                wrong.append(f"{path.name} {occurrence.symbol}: other findings")
        except Exception as error:  # noqa: BLE001  (the campaign goes on)
            wrong.append(f"{path.name} {occurrence.symbol}: {error}")
        lines = context.lines(path)
        assert lines is not None  # noqa: S101  (it is open)
        start = lines.text.index(new)
        again = renaming(context, path, lines.position(start), made.old)
        apply(context, again)
        for changed, source in originals.items():
            now = context.source(changed)
            if now is None or source is None or now.text != source.text:
                wrong.append(f"{changed.name} {occurrence.symbol}: not the same text again")
            workspace.set_text(changed, None)
        counts[occurrence.symbol.kind.value] += 1
    times.sort()
    sys.stdout.write(
        f"{len(places)} names, {len(chosen)} renamed and renamed back: "
        f"{dict(counts)}; {len(wrong)} wrong; "
        f"median {times[len(times) // 2]:.3f} s, 95th percentile "
        f"{times[int(len(times) * 0.95)]:.3f} s\n"
    )
    for line in wrong:
        sys.stdout.write(f"  {line}\n")
    return int(bool(wrong))


if __name__ == "__main__":
    sys.exit(main())
