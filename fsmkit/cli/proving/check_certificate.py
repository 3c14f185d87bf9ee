"""``fsmkit check-certificate``: check the certificate of a system by an independent program."""

from __future__ import annotations

from pathlib import Path

import click
from rich.markup import escape

from fsmkit.cli.common.console import print_json, report, result
from fsmkit.cli.common.options import OneOf, Reading, reading_options
from fsmkit.cli.common.verbs import verb
from fsmkit.system.any_file import load_any
from fsmkit.verify.resources.time import TIMES
from fsmkit.verify.state_certificates.checking import check_certificate
from fsmkit.verify.statespace.closed_system import UNLIMITED

EPILOG = """\b
Examples:
  fsmkit check-certificate table.cert table.yaml
  fsmkit check-certificate table.cert table.yaml --time discrete --json
"""


@verb(EPILOG, Model=("time", "parameters"))
@click.argument("file", metavar="CERTIFICATE", type=click.Path(path_type=Path))
@click.argument("system", type=click.Path(path_type=Path))
@click.option("--time", type=OneOf("kind of time", TIMES), help="Require this kind of time.")
@click.option("--json", "as_json", is_flag=True, help="Print one JSON document.")
@reading_options
def command(file: Path, system: Path, time: str | None, as_json: bool, reading: Reading) -> int:
    """Check a certificate that `fsmkit check --certificate` wrote.

    A program in JavaScript, run by Node.js, checks that the set of states contains the initial
    states, is closed under all steps, and satisfies the covered properties. The reference
    interpreter performs the steps.

    Exit code 1: the certificate is rejected.
    """
    own = reading.of(system)
    findings = own.findings()
    load_any(system, findings, strict=own.strict, parameters=own.parameters)
    checked = check_certificate(
        file, system, parameters=own.parameters, strict=own.strict, time=time
    )
    if not checked["accepted"]:
        message = f"`{file}` is rejected: {checked['reason']}"
        findings.add("rejected-certificate", message, None)
    report(findings)
    if as_json:
        print_json(checked)
    elif checked["accepted"]:
        for name, text in checked["covered"]:
            result.print(f"HOLDS  {escape(name)}  {escape(text)}")
        for name, text in checked["not_covered"]:
            result.print(f"not covered  {escape(name)}  {escape(text)}", style="dim")
        chosen = checked["options"]
        most = chosen["max_pending"]
        pending = (
            "external events at any time"
            if most == UNLIMITED
            else f"external events while at most {most:,} queued"
        )
        result.print(
            f"{checked['states']:,} states, {checked['steps']:,} steps, {chosen['time']}, "
            f"{pending}; checked in {checked['seconds']:.1f} s",
            style="dim",
        )
    return 0 if checked["accepted"] else 1
