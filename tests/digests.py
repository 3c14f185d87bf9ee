"""Digests of all that is generated: the safety net under a change that must not alter it.

``python -m tests.digests --save before.txt`` on one commit and ``--against before.txt`` on
another: charts and systems of the worked examples and random charts, through every form of every
target, every notation of export and every drawing. A line is a subject, an output and a digest;
lines that differ are printed, so what has changed is known by name.
"""

from __future__ import annotations

import hashlib
import os
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from pathlib import Path

import click

from devtools.differential import Case, random_case
from devtools.plain import plain_case
from fsmkit.chart.chart import Chart
from fsmkit.chart.drawing.drawing import Drawing
from fsmkit.codegen.target import Target
from fsmkit.diagnostics import Findings, FsmkitError
from fsmkit.document.front_ends import FrontEnd
from fsmkit.export.exporter import Exporter, ExportOptions
from fsmkit.plugins import plugin, plugins
from fsmkit.system.any_file import load_any
from fsmkit.system.of_one_chart import system_of
from fsmkit.system.system import System

MOST = 1_000
"""States that an export may explore: more is refused, and the refusal is digested."""
GROUP = 5
"""Random charts whose texts have one digest."""
PLAIN = 20
"""Random charts of the plain kind, small enough to be exported as well."""
EXPORTED = frozenset({"philosophers", "fischer"})
"""Folders of examples that are small enough to be exported in every notation."""
FORMS: tuple[tuple[str, Mapping[str, str]], ...] = (
    ("c", {}),
    ("c", {"optimize": "size"}),
    ("c", {"with": "save,trace"}),
    ("c", {"optimize": "size", "with": "save,trace"}),
    ("c", {"without": "queue,counters"}),
    ("python", {}),
    ("pyext", {"build": "no"}),
    ("transitions", {}),
)
"""Targets and options whose texts are digested."""

Made = Callable[[], str | Mapping[str, str]]


def digest(made: Made) -> str:
    """Return the digest of a text, of files, or of the diagnostics that refuse to make them."""
    try:
        text = made()
    except FsmkitError as error:
        text = "\n".join(f"{found.rule.name}: {found.message}" for found in error.diagnostics)
        return "refused-" + _hash(text)
    if not isinstance(text, str):
        text = "".join(f"{path}\0{text[path]}\0" for path in sorted(text))
    return _hash(text)


def _hash(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()[:16]


def outputs_of_chart(case: Case) -> Iterator[tuple[str, Made]]:
    """Yield what is written of one chart alone, by the name of the output, but its exports."""
    for name, options in FORMS:
        form = ",".join([name, *(f"{key}={value}" for key, value in options.items())])
        yield form, partial(_compiled, case.chart, name, options)
    for drawing in plugins(Drawing):
        yield f"draw {drawing.name}", partial(drawing.draw, case.chart, frozenset({0}))
    for front_end in plugins(FrontEnd):
        if case.documents:
            yield f"write {front_end.name}", partial(front_end.write, case.documents[0])


def _compiled(chart: Chart, name: str, options: Mapping[str, str]) -> Mapping[str, str]:
    findings = Findings()
    generated = plugin(Target, name).generate(chart, findings, options)
    findings.stop_on_errors()
    return {} if generated is None else generated.files


def outputs_of_system(system: System) -> Iterator[tuple[str, Made]]:
    """Yield every export of a system, in both of the times in which it is explored."""
    for exporter in plugins(Exporter):
        for untimed in (False, True):
            wanted = ExportOptions(untimed=untimed, most=MOST)
            name = f"export {exporter.name}{' untimed' if untimed else ''}"
            yield name, partial(_exported, exporter, system, wanted)


def _exported(exporter: Exporter, system: System, wanted: ExportOptions) -> str:
    return exporter.export(system, wanted).text


def digests_of_file(path: Path) -> list[str]:
    """Return the lines of a file: the machines of a chart or a system; small systems' exports."""
    system = load_any(path, Findings())
    outputs: list[tuple[str, Made]] = []
    if len(system.machines) == 1:
        outputs += outputs_of_chart(Case((), system.machines[0].chart, ()))
    if any(folder in path.parts for folder in EXPORTED):
        outputs += outputs_of_system(system)
    return [f"{path}: {name}: {digest(made)}" for name, made in outputs]


def digests_of_group(kind: str, seed: int, first: int) -> list[str]:
    """Return the lines of some random charts, whose texts are digested together."""
    together: dict[str, list[str]] = {}
    for number in range(first, first + GROUP):
        case = (plain_case if kind == "plain" else random_case)(seed, number)
        outputs = list(outputs_of_chart(case))
        if kind == "plain":
            outputs += outputs_of_system(system_of(case.chart))
        for name, made in outputs:
            together.setdefault(name, []).append(digest(made))
    subject = f"{kind} {first} to {first + GROUP - 1} of seed {seed}"
    return [f"{subject}: {name}: {_hash(' '.join(found))}" for name, found in together.items()]


def example_files(folder: Path) -> list[Path]:
    """Return the charts and systems below a folder; what neither is is left out."""
    found = []
    for path in sorted(folder.rglob("*.yaml")) + sorted(folder.rglob("*.scxml")):
        try:
            load_any(path, Findings())
        except FsmkitError:
            continue
        found.append(path)
    return found


def all_lines(folder: Path, charts: int, seed: int, processes: int) -> Iterator[list[str]]:
    """Yield the lines of all subjects, subject by subject."""
    with ProcessPoolExecutor(processes) as pool:
        yield from pool.map(digests_of_file, example_files(folder))
        yield from pool.map(partial(digests_of_group, "plain", seed), range(0, PLAIN, GROUP))
        yield from pool.map(partial(digests_of_group, "random", seed), range(0, charts, GROUP))


def differences(before: Sequence[str], after: Sequence[str]) -> list[str]:
    """Return what differs between two runs, by subject and output, in words."""
    old, new = (dict(line.rsplit(": ", 1) for line in lines) for lines in (before, after))
    changed = [f"changed: {name}" for name in old.keys() & new.keys() if old[name] != new[name]]
    gone = [f"gone: {name}" for name in old.keys() - new.keys()]
    added = [f"new: {name}" for name in new.keys() - old.keys()]
    return sorted([*changed, *gone, *added])


@click.command()
@click.option("--save", type=click.Path(path_type=Path), help="Write the digests there.")
@click.option("--against", type=click.Path(path_type=Path, exists=True), help="Compare with these.")
@click.option("--examples", default=Path("machines"), show_default=True, type=Path)
@click.option("--charts", default=300, show_default=True, help="How many random charts.")
@click.option("--seed", default=0, show_default=True)
@click.option("--processes", default=min(2, os.cpu_count() or 1), show_default=True)
def main(
    save: Path | None, against: Path | None, examples: Path, charts: int, seed: int, processes: int
) -> None:
    """Digest all that is generated of the examples and of random charts."""
    lines: list[str] = []
    for some in all_lines(examples, charts, seed, processes):
        lines += some
        if sys.stderr.isatty():
            click.echo(f"\r{len(lines)} digests", nl=False, err=True)
    if save:
        save.write_text("\n".join(lines) + "\n", encoding="utf-8")
    click.echo(f"{len(lines)} digests, all together {_hash(' '.join(sorted(lines)))}")
    if against:
        found = differences(against.read_text(encoding="utf-8").splitlines(), lines)
        click.echo("\n".join([*found, f"{len(found)} differ from {against}"]))
        sys.exit(1 if found else 0)


if __name__ == "__main__":
    main()
