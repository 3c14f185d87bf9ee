"""``fsmkit trace``: print the steps of a target live, or write a file for a viewer."""

from __future__ import annotations

import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, suppress
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING

import click

from fsmkit.cli.common.console import out, print_json, report
from fsmkit.cli.common.options import OneOf, Reading, path_option, reading_options
from fsmkit.cli.common.verbs import verb
from fsmkit.cli.common.writing import write_files
from fsmkit.diagnostics import Findings, FsmkitError, Severity, fail
from fsmkit.plugins import plugins
from fsmkit.runtime.tracing.merging import merge_contexts
from fsmkit.system.any_file import read, system_within
from fsmkit.system.system import System

if TYPE_CHECKING:
    from fsmkit.inspector.exports import MessageExporter
    from fsmkit.inspector.sources.traced import TraceEncoder
    from fsmkit.runtime.live.messages import AnyMessage
    from fsmkit.runtime.tracing.following import Followed
    from fsmkit.runtime.tracing.numbering import Numbering
    from fsmkit.runtime.tracing.reading import Reader

EPILOG = """\b
Examples:
  fsmkit trace board.trace --charts lamp.yaml
  fsmkit trace serial:/dev/ttyACM0:115200 --charts charts
  fsmkit trace rtt:localhost:9090 --charts lamp.yaml
  fsmkit trace tcp:localhost:5555 --charts lamp.yaml --to vcd --out lamp.vcd
"""
FORMATS = ("live", "mcap", "perfetto", "vcd")
SUFFIXES = {".yaml", ".yml", ".scxml"}
MOST_CHARTS = 500
"""Files of a folder that are read to find a chart."""
MOST_PARTED = 10
"""Findings that the interpreter parts from a target."""
PAUSE = 0.02
"""Seconds between two reads."""


@verb(EPILOG, Model=("parameters",))
@click.argument("endpoints", nargs=-1, required=True, metavar="FILE|ENDPOINT...")
@path_option(
    "--charts",
    multiple=True,
    help="Decode records of this chart, system or folder; repeatable (default: this folder).",
)
@click.option(
    "--to",
    "format_",
    type=OneOf("format", FORMATS),
    help="Convert the records into this format, with --out.",
)
@path_option("-o", "--out", "target", help="Write this file.")
@click.option("--raw/--framed", "is_raw", default=None, help="Read records in this framing.")
@click.option("--json", "as_json", is_flag=True, help="Print one JSON document at the end.")
@click.option("--follow", is_flag=True, help="Wait for more at the end of a file.")
@reading_options
def command(
    endpoints: tuple[str, ...],
    charts: tuple[Path, ...],
    format_: str | None,
    target: Path | None,
    is_raw: bool | None,
    as_json: bool,
    follow: bool,
    reading: Reading,
) -> int:
    """Print the steps of machines in C, from their trace records.

    The machines are compiled `--with records`. An ENDPOINT is `serial:DEVICE:BAUD`,
    `tcp:HOST:PORT`, `rtt:HOST:PORT`, `zmq:tcp://HOST:PORT`, `file:PATH` or `-`. Several endpoints
    are merged by time. If data are unknown, a line shows states only. Exit code 1: the interpreter
    and the target differ.
    """
    if (format_ is None) is not (target is None):
        raise click.UsageError("--to and --out go together")
    findings = reading.findings()
    systems = list(_systems(charts, findings, reading))
    report(finding for finding in findings if finding.severity is not Severity.NOTE)
    from fsmkit.inspector.capturing import empty_system, lines_of, messages_of
    from fsmkit.inspector.exports import MessageExporter
    from fsmkit.inspector.sources.traced import TraceEncoder, numberings_of
    from fsmkit.runtime.tracing.reading import Reader
    from fsmkit.runtime.tracing.transports import open_endpoint

    numberings = [each for system in systems for each in numberings_of(system)]
    if not numberings:
        raise click.UsageError("there is no chart to read the trace with; give it by --charts")
    framed = None if is_raw is None else not is_raw
    name = _name(endpoints[0])
    system = systems[0] if len(systems) == 1 and not systems[0].is_open else empty_system(name)
    with ExitStack() as stack:
        readers = []
        for endpoint in endpoints:
            opened = open_endpoint(endpoint)
            stack.callback(opened.source.close)
            readers.append(Reader(opened, numberings, framed=framed))
        encoder = TraceEncoder(system, lambda instance: _numbering(readers, instance), grows=True)
        told = _replayed_items(readers, follow=follow)
        if format_ is not None and target is not None:
            exporter = next(e for e in plugins(MessageExporter) if e.name == format_)
            _export(
                exporter,
                messages_of(encoder, _until_interrupted(told), name, target.parent),
                target,
            )
        elif as_json:
            lines = [line for each in _until_interrupted(told) for line in lines_of(encoder, each)]
            losses = {name: sum(r.losses[name] for r in readers) for name in readers[0].losses}
            print_json({"trace": lines, "parted": encoder.parted, **losses})
        else:
            for each in _until_interrupted(told):
                sys.stdout.writelines(f"{line}\n" for line in lines_of(encoder, each))
                sys.stdout.flush()
    _require_records(endpoints, readers, follow=follow)
    _report(readers, encoder)
    return int(bool(encoder.parted))


def _systems(charts: Sequence[Path], findings: Findings, reading: Reading) -> Iterator[System]:
    """Yield the given charts and systems, and the readable ones in folders."""
    for place in charts or (Path(),):
        if not place.is_dir():
            yield system_within(read(place, findings, strict=reading.strict))
            continue
        files = (path for path in sorted(place.iterdir()) if path.suffix in SUFFIXES)
        for path in islice(files, MOST_CHARTS):
            with suppress(FsmkitError):  # a folder may hold other files, too
                yield system_within(read(path, Findings(), strict=reading.strict))


def _name(endpoint: str) -> str:
    with suppress(OSError, ValueError):
        if Path(endpoint).exists():
            return Path(endpoint).stem
    return endpoint


def _numbering(readers: Sequence[Reader], instance: int) -> Numbering | None:
    found = (reader.stream.of.get(instance) for reader in readers)
    return next((each for each in found if each is not None), None)


def _replayed_items(readers: Sequence[Reader], *, follow: bool) -> Iterator[Followed]:
    """Yield the replayed records, for files in order of time."""
    if len(readers) > 1 and not follow and all(reader.is_file for reader in readers):
        yield from merge_contexts(_to_end((reader,), follow=False) for reader in readers)
    else:
        yield from _to_end(readers, follow=follow)


def _to_end(readers: Sequence[Reader], *, follow: bool) -> Iterator[Followed]:
    while True:
        is_idle = True
        for reader in readers:
            for told in reader.followed():
                is_idle = False
                yield told
        if is_idle and not follow and all(reader.is_over for reader in readers):
            for reader in readers:
                yield from reader.end()
            return
        if is_idle:
            time.sleep(PAUSE)


def _until_interrupted(told: Iterator[Followed]) -> Iterator[Followed]:
    """Yield until the user interrupts, which is a regular end."""
    with suppress(KeyboardInterrupt):
        yield from told


def _export(exporter: MessageExporter, messages: Iterator[AnyMessage], target: Path) -> None:
    """Write a temporary file, and rename it when it is complete."""
    with tempfile.TemporaryFile() as file:
        exporter.export_messages(messages, file)
        file.seek(0)
        write_files({target: file.read()})
    out.print(str(target), markup=False, soft_wrap=True)


def _require_records(endpoints: Sequence[str], readers: Sequence[Reader], *, follow: bool) -> None:
    """Raise `FsmkitError` (``unreadable-log``) where a whole file has no record that is known."""
    for endpoint, reader in zip(endpoints, readers, strict=True):
        counts = reader.stream.counts
        has_some = counts.records or counts.lost or counts.unknown
        if reader.is_file and not follow and not has_some:
            raise fail(
                "unreadable-log",
                f"`{endpoint}` has no record of a machine",
                help="name a file that code made by `fsmkit compile --with records` wrote; "
                "`--raw` and `--framed` select the format of its records",
            )


def _report(readers: Sequence[Reader], encoder: TraceEncoder) -> None:
    findings = Findings()
    for reader in readers:
        reader.report(findings)
    for told in encoder.parted[:MOST_PARTED]:
        findings.add(
            "replay-parts", told, None,
            help="is the C made from this chart, and the memory of the machine its own?",
        )  # fmt: skip
    report(findings)
