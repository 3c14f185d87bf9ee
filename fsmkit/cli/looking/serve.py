"""``fsmkit serve``: a chart, a system or a counterexample, seen in a browser while it runs."""

from __future__ import annotations

import asyncio
import secrets
import webbrowser
from contextlib import nullcontext
from pathlib import Path
from typing import TYPE_CHECKING

import click

from fsmkit.chart.drawing.graphviz.engine import why_no_drawing
from fsmkit.cli.common.console import out, print_json, report, result
from fsmkit.cli.common.editor import editor
from fsmkit.cli.common.options import Reading, option_value, path_option, reading_options
from fsmkit.cli.common.verbs import verb
from fsmkit.diagnostics import Severity
from fsmkit.inspector.commands import Break
from fsmkit.inspector.sources.live_file import SUFFIXES, is_live

if TYPE_CHECKING:
    from fsmkit.inspector.sources.opening import Opened
    from fsmkit.inspector.sources.traced import Traced

EPILOG = """\b
Examples:
  fsmkit serve gate.yaml --open
  fsmkit serve gate.yaml --watch --open
  fsmkit serve cell.yaml --port 8080 --read-only
  fsmkit serve gate.yaml --break 'count == 3'
  fsmkit serve lamp.yaml --attach serial:/dev/ttyACM0:115200
  fsmkit serve line.yaml --view line.svg
  fsmkit serve traces/Cell_M5.json
  fsmkit serve feeder.yaml --replay feeder.log
  fsmkit serve feeder.yaml --record jam.live.gz
  fsmkit serve jam.live.gz
  ssh -L 8080:127.0.0.1:8080 robot fsmkit serve gate.yaml --port 8080
"""


@verb(
    EPILOG,
    Other_computers=("host", "origins", "allow_commands", "is_readonly"),
    Recordings_and_targets=("attach", "is_raw", "replay", "instance", "record"),
    Model=("parameters",),
)
@click.argument("file", type=click.Path(path_type=Path))
@click.option(
    "--port",
    type=click.IntRange(0, 65535),
    default=0,
    help="Serve at this port (default: any free one).",
)
@click.option("--open", "is_opened", is_flag=True, help="Open the page in a browser.")
@click.option(
    "--open-with",
    metavar="COMMAND",
    help="Open sources by this command, such as `code -g {file}:{line}`.",
)
@click.option("--read-only", "is_readonly", is_flag=True, help="Let visitors watch, not command.")
@click.option(
    "--break",
    "breaks",
    multiple=True,
    metavar="CONDITION",
    help="Stop when this condition becomes true; repeatable.",
)
@click.option(
    "--attach",
    metavar="ENDPOINT",
    help="Show a running target: serial:DEVICE:BAUD, tcp:HOST:PORT, rtt:HOST:PORT, file:PATH or -.",
)
@click.option(
    "--raw/--framed", "is_raw", default=None, help="Read records in this framing, with --attach."
)
@click.option(
    "--seed",
    type=click.IntRange(0, 2**31 - 1),
    default=1,
    show_default=True,
    help="Choose the pseudo-random sequence.",
)
@path_option(
    "--replay",
    help="Show this log of a machine in C, or file of --record.",
)
@click.option("--instance", type=click.IntRange(0, 65535), help="Show this machine of the log.")
@click.option(
    "--watch", is_flag=True, help="Load the file again when it is saved, and repeat the session."
)
@path_option(
    "--record",
    help="Record the session into this file, x.live or x.live.gz.",
)
@click.option("--host", help="Serve at this address for other computers; needs --origin.")
@click.option("--origin", "origins", multiple=True, help="Accept pages of this origin; repeatable.")
@path_option(
    "--view",
    "picture",
    help="Show this SVG of the plant, bound to the machines.",
)
@click.option(
    "--allow-commands", is_flag=True, help="Let visitors from other computers command, with --host."
)
@click.option(
    "--dap",
    "dap_port",
    type=click.IntRange(0, 65535),
    help="Let an editor join at this port; 0: any free one.",
)
@click.option("--json", "as_json", is_flag=True, help="Print the address as one JSON document.")
@reading_options
def command(
    file: Path,
    port: int,
    is_opened: bool,
    open_with: str | None,
    is_readonly: bool,
    breaks: tuple[str, ...],
    attach: str | None,
    is_raw: bool | None,
    seed: int,
    replay: Path | None,
    instance: int | None,
    watch: bool,
    record: Path | None,
    host: str | None,
    origins: tuple[str, ...],
    picture: Path | None,
    allow_commands: bool,
    dap_port: int | None,
    as_json: bool,
    reading: Reading,
) -> int:
    """Show a chart, a system or a trace in a local page.

    The page is served until you interrupt it. It draws the machines, marks active states, posts
    events, steps back in time, stops at breakpoints and explains why an event has no effect. A
    trace (`check --save-trace`) starts at its end. The address holds a token that grants control
    of the session.
    """
    if host is not None and not origins:
        raise click.UsageError("--host needs --origin: the address that browsers use")
    from fsmkit.inspector.dap.serving import PortServer
    from fsmkit.inspector.hub import Hub, system_within
    from fsmkit.inspector.picture import check_names, read_picture
    from fsmkit.inspector.server import LiveServer, serve_hub
    from fsmkit.inspector.sources import Followed
    from fsmkit.inspector.sources.opening import open_source, read_model
    from fsmkit.inspector.watching import Watcher

    findings = reading.findings()
    opened = open_source(
        file,
        findings,
        strict=reading.strict,
        parameters=reading.parameters,
        replay=replay,
        instance=instance,
    )
    drawn = None if picture is None else read_picture(picture, findings)
    if drawn is not None:
        check_names(drawn, system_within(opened.source))
    report(finding for finding in findings if finding.severity is not Severity.NOTE)
    source = opened.source if attach is None else _trace_source(attach, opened, is_raw=is_raw)
    with option_value():
        opening = None if open_with is None else editor(open_with)
    hub = Hub(
        source,
        file=opened.file,
        session=secrets.token_hex(4),
        seed=seed,
        picture=drawn,
        editor=opening,
    )
    recorder = None if record is None else hub.record(_of_messages(record))
    for condition in breaks:
        hub.add_breakpoint(Break(id=0, on="condition", what=condition))
    is_readonly = is_readonly or (host is not None and not allow_commands)
    server = LiveServer(hub, host=host, port=port, origins=origins, is_readonly=is_readonly)

    editors = None if dap_port is None else PortServer(dap_port, page=server)

    def ready(address: str) -> None:
        port = {} if editors is None else {"dap": editors.port}
        if as_json:
            print_json({"name": opened.name, "session": hub.session, "address": address, **port})
        else:
            result.print(f"{opened.name}: {address}", markup=False, soft_wrap=True)
            if (reason := why_no_drawing()) is not None:
                out.print(f"states are listed, not drawn: {reason}", markup=False, soft_wrap=True)
            for number in port.values():
                result.print(f"editors: 127.0.0.1:{number}", markup=False, soft_wrap=True)
        if is_opened:
            webbrowser.open(address)

    watcher = None
    if watch:
        if opened.model is None:
            raise click.UsageError("--watch takes a chart or a system, which is simulated")
        watcher = Watcher(
            hub,
            file,
            lambda: read_model(
                file, reading.findings(), strict=reading.strict, parameters=reading.parameters
            ),
        )

    async def serve() -> None:
        async with nullcontext() if editors is None else editors:
            await serve_hub(server, ready, watcher=watcher)

    try:
        asyncio.run(serve())
    finally:
        if recorder is not None:
            recorder.close()
        if isinstance(source, Followed):
            source.close()
    if recorder is not None and recorder.error is not None:
        raise recorder.error
    return 0


def _trace_source(endpoint: str, opened: Opened, *, is_raw: bool | None) -> Traced:
    """Return the source for the trace of a target with the machines of the file."""
    from fsmkit.inspector.sources import Recorded
    from fsmkit.inspector.sources.traced import Traced, numberings_of
    from fsmkit.runtime.tracing.reading import Reader
    from fsmkit.runtime.tracing.transports import open_endpoint
    from fsmkit.system.any_file import system_within

    if isinstance(opened.source, Recorded):
        raise click.UsageError("--attach takes a chart or a system, and nothing that is recorded")
    system = system_within(opened.source)
    framed = None if is_raw is None else not is_raw
    reader = Reader(open_endpoint(endpoint), numberings_of(system), framed=framed)
    return Traced(system, reader, ends=not reader.is_file)


def _of_messages(path: Path) -> Path:
    """Return the path of a file of messages, which ends so that it can be read again."""
    if not is_live(path):
        raise click.UsageError(f"--record writes {' or '.join(SUFFIXES)}, not `{path.name}`")
    return path
