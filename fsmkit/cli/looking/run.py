"""``fsmkit run``: step a chart or a system on a simulated clock."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TextIO

import click

from fsmkit.chart.chart import Chart
from fsmkit.chart.loading import read_bytes
from fsmkit.cli.common.console import print_json, report, result
from fsmkit.cli.common.options import OneOf, Reading, path_option, reading_options
from fsmkit.cli.common.stepping import Stepper, machines_of, script_lines
from fsmkit.cli.common.verbs import verb
from fsmkit.cli.common.writing import write_files
from fsmkit.diagnostics import FsmkitError, Severity, fail
from fsmkit.runtime.recording import RING, ring_lines
from fsmkit.runtime.recording import replay as replay_log
from fsmkit.system.any_file import read, system_within
from fsmkit.system.system import System
from fsmkit.testing.harness.harness import harness, harnesses

EPILOG = """\b
Examples:
  fsmkit run feeder.yaml --events 'arrived; fault code=lost; wait 500ms'
  fsmkit run feeder.yaml --script steps.txt --target c
  fsmkit run feeder.yaml              (interactively; type help)
  fsmkit run feeder.yaml --replay feeder.log
  fsmkit run cell.yaml --events 'plant.press_start; wait 10s; feeder.pause'
"""


@verb(EPILOG, Logs=("replay", "instance"), Model=("parameters",))
@click.argument("file", type=click.Path(path_type=Path))
@click.option(
    "--events",
    help="Run these script lines, separated by `;`.",
)
@path_option("--script", help="Run the lines of this file.")
@click.option(
    "--seed",
    type=click.IntRange(0, 2**31 - 1),
    default=1,
    show_default=True,
    help="Choose the pseudo-random sequence.",
)
@click.option(
    "-t",
    "--target",
    type=OneOf("target", [found.name for found in harnesses()]),
    default="interpreter",
    show_default=True,
    help="Run the chart on this target (default: the interpreter).",
)
@click.option("--trace", is_flag=True, help="Print the trace that all targets print alike.")
@path_option("--replay", help="Replay this log or ring of a machine in C.")
@click.option("--instance", type=click.IntRange(0, 65535), help="Replay this machine of the log.")
@click.option("--json", "as_json", is_flag=True, help="Print one JSON document.")
@reading_options
def command(
    file: Path,
    events: str | None,
    script: Path | None,
    seed: int,
    target: str,
    trace: bool,
    replay: Path | None,
    instance: int | None,
    as_json: bool,
    reading: Reading,
) -> int:
    """Run a chart or a system on a simulated clock.

    Without a script, a shell reads the lines. A script line is `EVENT a=1` or `post EVENT a=1`,
    `wait 500ms`, `set INPUT VALUE` or `OPERATION returns 1, 2`. In a system, an event is
    `machine.event`. Operations return pseudo-random values, equal for one seed on every target,
    unless a line sets their results.
    """
    if events is not None and script is not None:
        raise click.UsageError("give --events or --script, not both")
    findings = reading.findings()
    model = read(file, findings, strict=reading.strict, parameters=reading.parameters)
    if replay is not None and not (events is None and script is None and isinstance(model, Chart)):
        raise click.UsageError("--replay takes a chart, and excludes other scripts")
    if not isinstance(model, Chart) and target != "interpreter":
        raise click.UsageError("a system is run by the interpreter alone")
    report(finding for finding in findings if finding.severity is not Severity.NOTE)
    if isinstance(model, Chart) and replay is not None:
        return _replay(model, read_bytes(replay), instance, as_json=as_json)
    of_target = target != "interpreter" or (script is not None and not as_json)
    if isinstance(model, Chart) and of_target:
        if script is None and events is None:
            raise click.UsageError("only the interpreter runs interactively; give --events")
        lines = [f"seed {seed}", *script_lines(model, events, _read(script))]
        told = harness(target).run(model, lines)
        if as_json:
            print_json({"chart": model.name, "target": target, "trace": told})
        else:
            sys.stdout.writelines(f"{line}\n" for line in told)
        return 0
    is_watched = sys.stdin.isatty() and sys.stdout.isatty() and not as_json
    if script is None and events is None and is_watched:
        return _shell(
            model if isinstance(model, Chart) else system_within(model),
            file,
            seed,
            lines_only=trace,
        )
    machines = machines_of(model if isinstance(model, Chart) else system_within(model), seed)
    stepper = Stepper(machines, lines_only=trace, is_quiet=as_json)
    _step(stepper, events, _read(script))
    if as_json:
        print_json(stepper.document())
    for name, fault in stepper.faults.items() if not as_json else ():
        result.print(f"{name or 'the machine'} stopped with the fault {fault}", style="bold red")
    return int(bool(stepper.faults))


def _shell(model: Chart | System, file: Path, seed: int, *, lines_only: bool) -> int:
    """Run the interactive shell."""
    import asyncio

    from fsmkit.inspector.hub import Hub
    from fsmkit.inspector.shell.prompt import Serving, converse, history_of
    from fsmkit.inspector.shell.shell import Shell

    serving = Serving()
    shell = Shell(
        show=lambda line: result.print(line, markup=False, soft_wrap=True),
        write=_write_new,
        serve=serving.serve,
        lines_only=lines_only,
    )
    shell.attach(Hub(model, file=file, seed=seed, observer=shell.observe))

    async def session() -> None:
        result.print("type an event, or help", style="dim")
        try:
            await converse(shell, report, history_of())
        finally:
            await serving.close()

    asyncio.run(session())
    for name, fault in shell.faults.items():
        result.print(f"{name} stopped with the fault {fault}", style="bold red", markup=False)
    return int(bool(shell.faults))


def _write_new(path: Path, text: str) -> None:
    """Write a file that is not there yet."""
    if path.exists():
        raise fail("unwritable-output", f"`{path}` is there already", help="choose another name")
    write_files({path: text})


def _replay(chart: Chart, data: bytes, instance: int | None, *, as_json: bool) -> int:
    """Print the interpreter's trace of a log, up to where it does not do as the C did."""
    is_ring = data.startswith(RING)
    lines = ring_lines(chart, data) if is_ring else replay_log(chart, data, instance)
    if as_json:
        print_json({"chart": chart.name, "trace": list(lines)})
        return 0
    for line in lines:
        sys.stdout.write(f"{line}\n")
    return 0


def _step(stepper: Stepper, events: str | None, script: list[str] | None) -> None:
    """Execute the script or the events; without either, read lines."""
    if script is not None:
        stepper.do_script(script)
        return
    stepper.start()
    if events is None:
        _converse(stepper, sys.stdin)
        return
    for item in events.replace("\n", ";").split(";"):
        stepper.do(item)


def _read(script: Path | None) -> list[str] | None:
    if script is None:
        return None
    text = read_bytes(script).decode("utf-8", errors="replace")
    return [line for line in text.splitlines() if line.strip() and not line.startswith("#")]


def _converse(stepper: Stepper, file: TextIO) -> None:
    """Read and execute lines to the end; on a terminal a wrong line is reported and ignored."""
    is_terminal = file.isatty()
    if is_terminal:
        result.print("type an event, or help", style="dim")
    while True:
        if is_terminal:
            result.print("> ", end="")
        line = file.readline()
        word = line.strip()
        if not line or word in ("quit", "exit"):
            return
        try:
            if word in ("help", "?"):
                result.print(stepper.machines.help, markup=False)
            elif not stepper.answer(word):
                stepper.do(word)
        except FsmkitError as error:
            if not is_terminal:
                raise
            report(error.diagnostics)
