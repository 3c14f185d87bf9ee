"""``fsmkit check``: explore a chart or a system, and report the verdicts."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path
from types import MappingProxyType

import click
from rich.markup import escape

from fsmkit.cli.common.bindings import check_bindings
from fsmkit.cli.common.boards import check_boards, is_board
from fsmkit.cli.common.console import out, print_json, progress, report, result
from fsmkit.cli.common.debug import TRACES, read_configurations, with_counterexamples
from fsmkit.cli.common.exploring import COMPUTERS, MODEL, SEARCH, Exploring, exploring_options
from fsmkit.cli.common.fixing import fixed
from fsmkit.cli.common.many_files import check_several
from fsmkit.cli.common.options import Reading, option_value, path_option, reading_options
from fsmkit.cli.common.verbs import verb
from fsmkit.cli.common.watching import watched
from fsmkit.cli.common.writing import write_files
from fsmkit.codegen.existing_c.reader import SUFFIXES
from fsmkit.diagnostics.allow_comments import record_used
from fsmkit.diagnostics.unused_comments import EXPLORING, READING, report_unused_comments
from fsmkit.system.any_file import sources_of
from fsmkit.system.system import System
from fsmkit.verify.any_number.family import any_parameter
from fsmkit.verify.explore import ExplorationOptions, check_file
from fsmkit.verify.report.document import document
from fsmkit.verify.report.pictures import pictures, require_notation
from fsmkit.verify.report.show import summary
from fsmkit.verify.report.verdict import Report, Verdict
from fsmkit.verify.resources.deadline import Deadline
from fsmkit.verify.state_certificates.certificate import certificate_of, require_options
from fsmkit.verify.statespace.symbolic_search import Search
from fsmkit.verify.testgen.save import json_traces, saved
from fsmkit.verify.testgen.suites import compiled_charts, require_language, suite, traces

EPILOG = """\b
Examples:
  fsmkit check feeder.yaml
  fsmkit check cell.yaml --property P2 --save-trace traces
  fsmkit check cell.yaml --time untimed --assume-watchdogs-silent
  fsmkit check cell.yaml --replace feeder=defects/m5_feeder.yaml
  fsmkit check board_a.io.yaml charger.c.yaml
"""


@verb(
    EPILOG,
    Model=(*MODEL, "wires"),
    Search=SEARCH,
    Several_computers=COMPUTERS,
    Counterexamples=("save_trace", "drawings", "tests", "debug"),
    Proof=("certificate",),
)
@click.argument("files", nargs=-1, required=True, type=click.Path(path_type=Path))
@exploring_options
@path_option(
    "--wires",
    multiple=True,
    metavar="BOARD",
    help="Limit inputs and events to this board's wires; repeatable.",
)
@click.option(
    "--resume",
    "checkpoints",
    type=click.Path(path_type=Path, file_okay=False),
    metavar="FOLDER",
    help="Keep checkpoints here, and continue from them (--mpi).",
)
@click.option(
    "--checkpoint-every",
    type=click.IntRange(min=1),
    default=16,
    show_default=True,
    metavar="LAYERS",
    help="Write a checkpoint every so many layers.",
)
@path_option(
    "--save-trace",
    metavar="FOLDER",
    help="Save each trace into this folder.",
)
@path_option(
    "--draw",
    "drawings",
    multiple=True,
    help="Draw each trace as a sequence diagram; repeatable.",
)
@path_option(
    "--save-test",
    "tests",
    multiple=True,
    help="Write the traces as tests (.py or .c); repeatable.",
)
@path_option(
    "--debug",
    metavar="LAUNCH_JSON",
    help="Write launch configurations to debug each trace.",
)
@path_option("--certificate", metavar="FILE", help="Write the set of states, for a proof checker.")
@click.option(
    "--fix",
    "is_fixing",
    is_flag=True,
    help="Apply unambiguous fixes first: quotes, units, attributes.",
)
@click.option("--json", "as_json_document", is_flag=True, help="Print one JSON document.")
@watched
@reading_options
def command(
    files: tuple[Path, ...],
    exploring: Exploring,
    wires: tuple[Path, ...],
    checkpoints: Path | None,
    checkpoint_every: int,
    save_trace: Path | None,
    drawings: tuple[Path, ...],
    tests: tuple[Path, ...],
    debug: Path | None,
    certificate: Path | None,
    is_fixing: bool,
    as_json_document: bool,
    reading: Reading,
) -> int:
    """Check a chart or a system exhaustively.

    Reports deadlocks, traps, livelocks, faults, queue overflows, unreachable states, and the
    verdict on each property. Exit code 1: a property is violated or undecided, or a file has an
    error.

    Given several files or a folder, checks each chart and system separately and prints one line
    per file; abstract charts are skipped. For boards (`.io.yaml`) and bindings (`.c.yaml`), checks
    that they fit their charts; nothing is explored.
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
    options, names, replacing = exploring.options, exploring.names, exploring.replacing
    if options.ranks is not None:
        ranks = replace(options.ranks, folder=checkpoints, every=checkpoint_every)
        options = replace(options, ranks=ranks)
    elif checkpoints is not None:
        raise click.UsageError("--resume goes with --mpi")
    with option_value():
        for path in drawings:
            require_notation(path)
        for path in tests:
            require_language(path)
    if certificate is not None:
        if names or replacing or wires or len(files) > 1 or files[0].is_dir():
            given = "--property, --replace, --wires"
            raise click.UsageError(f"--certificate goes with one file, and not with {given}")
        with option_value():
            require_options(options)
        options = replace(options, search=Search.EXPLICIT)
    evaluate = partial(evaluate_file, options=options, reading=reading, is_quiet=as_json_document)
    if any_parameter(reading.parameters) is not None:
        others = (replacing, wires, save_trace, debug, drawings, tests, certificate)
        if len(files) > 1 or files[0].is_dir() or any(others):
            raise click.UsageError("`any` goes with one system, and with none of the files written")
        return _check_any_number(files[0], exploring, reading, as_json=as_json_document)
    if len(files) > 1 or files[0].is_dir():
        if any((names, replacing, wires, save_trace, debug, drawings, tests)):
            given = "--property, --replace, --wires, --save-trace, --debug, --draw"
            raise click.UsageError(f"{given} and --save-test go with one file")
        return check_several(files, evaluate, document if as_json_document else None)
    (file,) = files
    configured = read_configurations(debug) if debug is not None else {}
    system, found = evaluate(
        file, names=names, replacing=replacing, wires=wires, deadline=exploring.deadline
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
    writes_code = bool(tests) and bool(system.machines)
    charts = compiled_charts(system, found.closed.system) if writes_code else ()
    made |= {
        path: suite(path, found.closed, paths, file, charts)
        for path in tests
        if (paths := traces(found))
    }
    if certificate is not None and found.verdict is Verdict.HOLDS:
        made[certificate] = certificate_of(found, system, options, exploring.deadline).text
    write_files(made)
    report(found.findings)
    if as_json_document:
        print_json(document(found))
    else:
        result.print(summary(found, result.width))
        if traced:
            out.print(f"saved {len(traced)} files in {save_trace}", style="dim")
        for path in made:
            out.print(f"wrote {escape(str(path))}", style="dim")
        if certificate is not None and certificate not in made:
            out.print("no certificate: not all properties hold", style="dim")
    return 0 if found.verdict is Verdict.HOLDS else 1


def _check_any_number(file: Path, exploring: Exploring, reading: Reading, *, as_json: bool) -> int:
    """Decide a system for every number of machines, and print the result."""
    from fsmkit.verify.any_number import prove, show  # only this option needs them

    own = reading.of(file)
    with progress(f"reading {file.name}", is_quiet=as_json) as show_progress:
        proof = prove.prove_file(
            file,
            own.findings(),
            parameters=own.parameters,
            options=exploring.options,
            properties=exploring.names,
            strict=own.strict,
            deadline=exploring.deadline,
            progress=lambda text: show_progress(f"{file.name}: {text}"),
        )
    report(proof.findings)
    if as_json:
        print_json(show.document(proof))
    else:
        result.print(show.summary(proof, result.width))
    return 0 if proof.verdict is Verdict.HOLDS else 1


def evaluate_file(
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
    """Return the system of a file and the report of its exploration.

    Without a ``deadline``, the time limit starts now.
    """
    own = reading.of(file)
    with progress(f"reading {file.name}", is_quiet=is_quiet) as show:

        def report_progress(states: int, transitions: int, depth: int) -> None:
            figures = f"{states:,} states, {transitions:,} transitions, depth {depth}"
            show(f"exploring {file.name}: {figures}")

        findings = own.findings()
        with record_used() as used:
            system, found = check_file(
                file,
                findings,
                replacing=replacing,
                wires=wires,
                strict=own.strict,
                parameters=own.parameters,
                options=options,
                properties=names,
                progress=report_progress,
                deadline=deadline,
            )
        is_whole = found.verdict is not Verdict.UNDECIDED
        codes = EXPLORING if is_whole and not names else READING
        report_unused_comments(sources_of(system), used, codes, found.findings)
    return system, found
