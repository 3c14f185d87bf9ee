"""``fsmkit check``: explore a chart or a system, and tell what holds."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from pathlib import Path
from types import MappingProxyType

import click
from rich.markup import escape

from fsmkit.cli.common.bindings import check_bindings
from fsmkit.cli.common.boards import check_boards, is_board
from fsmkit.cli.common.console import out, print_json, progress, report, result
from fsmkit.cli.common.debug import TRACES, read_configurations, with_counterexamples
from fsmkit.cli.common.fixing import fixed
from fsmkit.cli.common.interrupts import began
from fsmkit.cli.common.many_files import check_several
from fsmkit.cli.common.mutants import check_mutants
from fsmkit.cli.common.options import (
    REPLACE,
    SILENT,
    TIMEOUT,
    OneOf,
    Reading,
    by_default,
    option_value,
    path_option,
    project_for,
    read_patience,
    read_size,
    reading_options,
)
from fsmkit.cli.common.refines import compare
from fsmkit.cli.common.spin import show_trail
from fsmkit.cli.common.watching import watched
from fsmkit.cli.common.writing import write_files
from fsmkit.codegen.existing_c.reader import SUFFIXES
from fsmkit.diagnostics.allowing import counting
from fsmkit.diagnostics.unused import EXPLORING, READING, tell_unused
from fsmkit.export.exporter import ExportOptions, given_up_at
from fsmkit.system.any_file import load_any, sources_of
from fsmkit.system.system import System
from fsmkit.verify.explore import REDUCTIONS, ExplorationOptions, asking_only, check_file
from fsmkit.verify.report.document import document
from fsmkit.verify.report.pictures import pictures, require_notation
from fsmkit.verify.report.show import summary
from fsmkit.verify.report.verdict import Report, Verdict
from fsmkit.verify.resources.deadline import Deadline
from fsmkit.verify.resources.time import TIMES, Time
from fsmkit.verify.statespace.ranks import MOST_RANKS, Ranks
from fsmkit.verify.statespace.storage import Storage
from fsmkit.verify.statespace.symbolic_search import SEARCHES, Search
from fsmkit.verify.testgen.cover import cover, told
from fsmkit.verify.testgen.save import json_traces, saved
from fsmkit.verify.testgen.suites import compiled_charts, covering, require_language, suite, traces

EPILOG = """\b
Examples:
  fsmkit check feeder.yaml
  fsmkit check cell.yaml --property P2 --save-trace traces
  fsmkit check cell.yaml --time untimed --assume-watchdogs-silent
  fsmkit check cell.yaml --replace feeder=defects/m5_feeder.yaml
  fsmkit check feeder.yaml --refines module.scxml
  fsmkit check cell.yaml --mutants 50
  fsmkit check board_a.io.yaml
  fsmkit check charger.c.yaml
"""


@click.command(epilog=EPILOG)
@click.argument("files", nargs=-1, required=True, type=click.Path(path_type=Path))
@click.option("--property", "names", multiple=True, help="Evaluate this property; can be repeated.")
@click.option(
    "--time",
    type=OneOf("kind of time", TIMES),
    default="zones",
    show_default=True,
    help="Zones: time is dense. Discrete: it passes by the greatest common divisor of all delays. "
    "Untimed: an armed timer may fire at any time.",
)
@SILENT
@click.option(
    "--engine", type=OneOf("engine", ("c", "python")), help="What explores.  [default: c]"
)
@click.option(
    "--memory", callback=read_size, default="4G", show_default=True, help="The most to use."
)
@click.option(
    "--storage",
    type=OneOf("storage", [storage.value for storage in Storage]),
    default=Storage.EXACT.value,
    show_default=True,
    help="What is kept of a state: all of it; a hash of 24 bits; or 3 bits. The latter two, in a "
    "table of three quarters of the memory, may miss states: then nothing is proved, and it is "
    "told what the probability of a miss is. What they find is real.",
)
@click.option(
    "--search",
    type=OneOf("search", SEARCHES),
    default=Search.AUTO.value,
    show_default=True,
    help="Explicit: states are kept one by one. Symbolic: as one decision diagram; in discrete "
    "time and untimed; `within` and `occurs` need both. Auto: one by one, and where there are "
    "millions also as a diagram; the first to end answers.",
)
@click.option(
    "--order",
    metavar="MACHINE,...",
    default="",
    help="The order of the machines in a diagram, from the top; without it a good one is sought.",
)
@click.option(
    "--patience",
    metavar="N|none",
    callback=read_patience,
    help="The events that may be queued when another comes from outside; none: it never waits.  "
    "[default: 1; in a symbolic search none, unless queues overflow by that]",
)
@click.option(
    "--workers",
    type=click.IntRange(1, 64),
    default=1,
    show_default=True,
    help="The most cores to use; only spaces that are large need more than one.",
)
@click.option(
    "--mpi",
    type=click.IntRange(1, MOST_RANKS),
    metavar="N",
    help="Explore in N processes, by MPI, each with a part of the states and with --memory of its "
    "own; in discrete time and untimed.",
)
@click.option(
    "--hostfile",
    type=click.Path(path_type=Path, exists=True, dir_okay=False),
    help="With --mpi: the hosts, as mpirun reads them.",
)
@click.option(
    "--resume",
    "checkpoints",
    type=click.Path(path_type=Path, file_okay=False),
    metavar="FOLDER",
    help="With --mpi: keep checkpoints in this folder, and go on from those that are there. With "
    "--mutants: keep what became of each, and evaluate only those of which nothing is kept.",
)
@click.option(
    "--checkpoint-every",
    type=click.IntRange(min=1),
    default=16,
    show_default=True,
    metavar="LAYERS",
    help="With --resume: layers of states from one checkpoint to the next.",
)
@TIMEOUT
@click.option(
    "--no-reduction",
    "without",
    multiple=True,
    type=OneOf("reduction", REDUCTIONS),
    help="Switch a reduction off; verdicts stay the same. Dead: data that nothing can read any "
    "more count as at their start. Sleep: of steps that do not see each other one order is taken.",
)
@REPLACE
@path_option(
    "--wires",
    multiple=True,
    metavar="BOARD",
    help="A file of wires (.io.yaml): free inputs and events of its machines come only as often, "
    "and with such values, as debounce, period and ranges of the wires let them. Can be repeated.",
)
@path_option("--save-trace", help="A folder for the traces.")
@path_option(
    "--debug",
    metavar="LAUNCH_JSON",
    help="Write a launch configuration for each counterexample, with which an editor begins at its "
    "end (`fsmkit dap`). What else the file holds stays; traces are beside it, or in --save-trace.",
)
@path_option(
    "--draw",
    "drawings",
    multiple=True,
    help="Draw each trace as a sequence diagram: svg, mmd or puml. Of several traces, each is in a "
    "file with the name of its property added. Can be repeated.",
)
@path_option(
    "--save-test",
    "tests",
    multiple=True,
    help="Write all traces as one file of tests: py (a pytest, for interpreter and generated "
    "Python) or c (a program for the generated C). Can be repeated.",
)
@path_option(
    "--cover",
    "cover_folder",
    help="A folder for tests that take every transition and enter every state that can be reached: "
    "a pytest, a C program, and a page on what they cover.",
)
@path_option(
    "--refines",
    "base",
    metavar="BASE",
    help="Tell instead whether the chart does only what this chart can do, untimed.",
)
@click.option(
    "--mutants",
    type=click.IntRange(min=0),
    is_flag=False,
    flag_value=0,
    metavar="[N]",
    help="Seed mistakes in the charts and connections, one at a time, and show which of them no "
    "property finds: N of them, or all. Of several systems: those of the first, and those that it "
    "does not find also in the others.",
)
@click.option(
    "--seed", type=int, default=0, help="With --mutants: another order in which they are taken."
)
@path_option(
    "--spin-trail",
    metavar="MODEL",
    help="Show instead the path that SPIN found in the exported model (x.pml, beside x.pml.trail).",
)
@click.option(
    "--fix",
    "is_fixing",
    is_flag=True,
    help="Mend first what can be mended in one way only: quotes, units, missing attributes.",
)
@click.option("--json", "as_json_document", is_flag=True, help="Print one JSON document.")
@watched
@reading_options
def command(
    files: tuple[Path, ...],
    names: tuple[str, ...],
    time: Time,
    silent: bool,
    engine: str | None,
    memory: int,
    storage: str,
    search: str,
    order: str,
    patience: int | None,
    workers: int,
    mpi: int | None,
    hostfile: Path | None,
    checkpoints: Path | None,
    checkpoint_every: int,
    timeout: float,
    without: tuple[str, ...],
    replacing: Mapping[str, Path],
    wires: tuple[Path, ...],
    save_trace: Path | None,
    debug: Path | None,
    drawings: tuple[Path, ...],
    tests: tuple[Path, ...],
    cover_folder: Path | None,
    base: Path | None,
    mutants: int | None,
    seed: int,
    spin_trail: Path | None,
    is_fixing: bool,
    as_json_document: bool,
    reading: Reading,
) -> int:
    """Explore all that a chart or a system can do.

    Tells deadlocks, traps, livelocks, faults, overflows, what is never reached, and whether the
    properties hold. Exit code 0: all of them hold; 1: one is violated or undecided, or something
    is wrong; 2: usage.

    Of the wires of boards (`.io.yaml`): whether they fit the machines of their nodes. Of bindings
    (`.c.yaml`): whether they fit their charts. Nothing is explored.

    Of several files, or of a folder, all charts and systems below it: each by itself, a line each;
    abstract charts are skipped. The exit code is the worst of all.
    """
    if is_fixing:
        mended = fixed(files, reading)
        if not as_json_document:
            for line in mended:
                out.print(escape(line), style="dim")
    if all(file.name.endswith(SUFFIXES) for file in files):
        return check_bindings(files, reading, as_json=as_json_document)
    if all(is_board(file) for file in files):
        return check_boards(files, reading, as_json=as_json_document)
    project, context = project_for(files), click.get_current_context()
    if project is not None:
        timeout = by_default(context, "timeout", timeout, project.check.get("timeout"))
        memory = by_default(context, "memory", memory, project.check.get("memory"))
    deadline = Deadline(timeout, began())
    if silent and time != "untimed":
        raise click.UsageError("--assume-watchdogs-silent needs --time untimed")
    if mpi is None and hostfile is not None:
        raise click.UsageError("--hostfile goes with --mpi")
    if mpi is None and mutants is None and checkpoints is not None:
        raise click.UsageError("--resume goes with --mpi or --mutants")
    if base is not None:
        others = (names, silent, engine, without, replacing, wires, save_trace, drawings, tests)
        if any((*others, debug, cover_folder, storage != Storage.EXACT.value)):
            raise click.UsageError("--refines goes only with --timeout and --json")
        return compare(_only(files), base, deadline, reading, as_json=as_json_document)
    if spin_trail is not None:
        file = _only(files)
        if time == "zones":
            raise click.UsageError("--spin-trail needs --time discrete or untimed, as exported")
        wanted = ExportOptions(time == "untimed", silent, deadline=deadline)
        whole = load_any(
            file,
            reading.findings(),
            replacing,
            strict=reading.strict,
            parameters=reading.parameters,
        )
        loaded = asking_only(whole, frozenset(names))
        with given_up_at(deadline):
            return show_trail(
                loaded, wanted, file, spin_trail, save_trace, as_json_=as_json_document
            )
    with option_value():
        for path in drawings:
            require_notation(path)
        for path in tests:
            require_language(path)
    options = ExplorationOptions(
        engine or "",
        time=time,
        assume_watchdogs_silent=silent,
        memory=memory,
        timeout=timeout,
        workers=workers,
        covers=cover_folder is not None,
        reductions=frozenset(REDUCTIONS).difference(without),
        storage=Storage(storage),
        search=Search(search),
        order=tuple(name.strip() for name in order.split(",") if name.strip()),
        patience=patience,
        ranks=None
        if mpi is None
        else Ranks(mpi, hostfile, checkpoints if mutants is None else None, checkpoint_every),
    )
    if mutants is not None:
        if any((wires, save_trace, debug, drawings, tests, cover_folder)):
            given = "--wires, --save-trace, --debug, --draw, --save-test and --cover"
            raise click.UsageError(f"{given} do not go with --mutants")
        return check_mutants(
            files, mutants, seed, options, frozenset(names), replacing, deadline, reading,
            checkpoints, as_json=as_json_document,
        )  # fmt: skip
    evaluate = partial(evaluated, options=options, reading=reading, is_quiet=as_json_document)
    if len(files) > 1 or files[0].is_dir():
        if any((names, replacing, wires, save_trace, debug, drawings, tests, cover_folder)):
            given = "--property, --replace, --wires, --save-trace, --debug, --draw, --save-test"
            raise click.UsageError(f"{given} and --cover go with one file")
        return check_several(files, evaluate, document if as_json_document else None)
    (file,) = files
    configured = read_configurations(debug) if debug is not None else {}
    system, found = evaluate(
        file, names=frozenset(names), replacing=replacing, wires=wires, deadline=deadline
    )
    if debug is not None:
        save_trace = save_trace or debug.parent / TRACES
    traced = saved(found, file, save_trace) if save_trace is not None else {}
    write_files(traced, save_trace)
    made: dict[Path, str] = {}
    if debug is not None and save_trace is not None:
        text = with_counterexamples(configured, found, json_traces(found, save_trace))
        made |= {} if text is None else {debug: text}
    made |= {path: text for d in drawings for path, text in pictures(found, d).items()}
    writes_code = bool(tests or cover_folder is not None) and bool(system.machines)
    charts = compiled_charts(system, found.closed.system) if writes_code else ()
    made |= {
        path: suite(path, found.closed, paths, file, charts)
        for path in tests
        if (paths := traces(found))
    }
    covered = cover(found) if cover_folder is not None else None
    if covered is not None and cover_folder is not None:
        made |= covering(cover_folder, covered, file, charts)
    write_files(made)
    report(found.findings)
    if as_json_document:
        print_json(document(found))
    else:
        result.print(summary(found, result.width))
        if traced:
            out.print(f"saved {len(traced)} files in {save_trace}", style="dim")
        if covered is not None:
            result.print(escape(told(covered)))
        for path in made:
            out.print(f"wrote {escape(str(path))}", style="dim")
    return 0 if found.verdict is Verdict.HOLDS else 1


def _only(files: tuple[Path, ...]) -> Path:
    if len(files) > 1:
        raise click.UsageError("--refines and --spin-trail go with one file")
    return files[0]


def evaluated(
    file: Path,
    *,
    options: ExplorationOptions,
    reading: Reading,
    is_quiet: bool,
    names: frozenset[str] = frozenset(),
    replacing: Mapping[str, Path] = MappingProxyType({}),
    wires: tuple[Path, ...] = (),
    deadline: Deadline | None = None,
) -> tuple[System, Report]:
    """Return the system of a file, or of a chart, and what its exploration found.

    Without a ``deadline`` its time begins here.
    """
    own = reading.of(file)
    with progress(f"reading {file.name}", is_quiet=is_quiet) as show:

        def tell(states: int, transitions: int, depth: int) -> None:
            figures = f"{states:,} states, {transitions:,} transitions, depth {depth}"
            show(f"exploring {file.name}: {figures}")

        findings = own.findings()
        with counting() as used:
            system, found = check_file(
                file,
                findings,
                replacing=replacing,
                wires=wires,
                strict=own.strict,
                parameters=own.parameters,
                options=options,
                properties=names,
                progress=tell,
                deadline=deadline,
            )
        is_whole = found.verdict is not Verdict.UNDECIDED
        codes = EXPLORING if is_whole and not names else READING
        tell_unused(sources_of(system), used, codes, found.findings)
    return system, found
