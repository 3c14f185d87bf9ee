"""``fsmkit certify``: compare interpreter, C and the target's binary in every reachable step."""

from __future__ import annotations

import json
import shlex
from pathlib import Path
from typing import Any

import click

from fsmkit.cli.common.console import print_json, progress, report, result
from fsmkit.cli.common.options import TIMEOUT, OneOf, Reading, path_option, reading_options
from fsmkit.cli.common.verbs import verb
from fsmkit.cli.common.writing import write_files
from fsmkit.codegen.c.options import COMPILING, SIZE
from fsmkit.diagnostics import Findings
from fsmkit.system.any_file import read_chart
from fsmkit.verify.certify import certificate as certificates
from fsmkit.verify.certify.certify import certify, changed
from fsmkit.verify.certify.comparison import LIMIT, Request
from fsmkit.verify.certify.page import page
from fsmkit.verify.certify.show import summary

EPILOG = """\b
Examples:
  fsmkit certify gate.yaml
  fsmkit certify gate.yaml --cc 'arm-none-eabi-gcc -mcpu=cortex-m0 -Os'
  fsmkit certify --verify certificate.json
"""


@verb(EPILOG, Model=("parameters",), Bounds=("limit", "timeout", "allow_partial"))
@click.argument("file", metavar="[CHART]", required=False, type=click.Path(path_type=Path))
@click.option(
    "--cc",
    "compiler",
    metavar="COMMAND",
    default="",
    help="Build with this compiler and flags (default: this computer's).",
)
@path_option(
    "--elf",
    "firmware",
    metavar="FILE",
    help="Certify the machine in this firmware, built by --cc with -g.",
)
@click.option(
    "--optimize",
    "form",
    type=OneOf("form of the code", (SIZE, COMPILING)),
    help="Certify this form of the C, as for `fsmkit compile`.",
)
@click.option("--prefix", help="Prefix of generated names (default: the chart's name).")
@path_option(
    "-o",
    "--out",
    default=Path("certificate.json"),
    show_default=True,
    help="Write the certificate here, and a page beside it.",
)
@click.option(
    "--limit",
    type=click.IntRange(min=1),
    default=LIMIT,
    show_default=True,
    metavar="N",
    help="Stop after N steps; the certificate is then partial.",
)
@TIMEOUT
@click.option("--allow-partial", is_flag=True, help="Accept a partial certificate: exit code 0.")
@path_option(
    "--verify",
    "verified",
    metavar="CERTIFICATE",
    help="Check a certificate: its hash, and those of its files.",
)
@click.option("--again", is_flag=True, help="Also repeat the comparison (--verify).")
@click.option("--json", "as_json", is_flag=True, help="Print one JSON document.")
@reading_options
def command(
    file: Path | None,
    compiler: str,
    firmware: Path | None,
    form: str | None,
    prefix: str | None,
    out: Path,
    limit: int,
    timeout: float,
    allow_partial: bool,
    verified: Path | None,
    again: bool,
    as_json: bool,
    reading: Reading,
) -> int:
    """Compare all executions of a chart in every reachable step.

    The reference interpreter, the C compiled for this computer and, with `--cc`, the binary for
    another processor in an emulator take each step. Writes a certificate: what was compared, by
    which tools, and the most instructions and bytes of stack of each event.

    Exit code 1: the executions differ, the certificate is partial, or it does not match its files.
    """
    findings = reading.findings()
    if verified is not None:
        return _verify(verified, file, findings, reading, again=again, as_json=as_json)
    if file is None:
        raise click.UsageError("name a chart, or a certificate with --verify")
    if again:
        raise click.UsageError("--again goes with --verify")
    request = Request(
        tuple(shlex.split(compiler)), limit=limit, timeout=timeout, form=form or "", prefix=prefix,
        parameters=reading.of(file).parameters,
        firmware=firmware,
    )  # fmt: skip
    document = _certificate_of(file, request, findings, reading, is_quiet=as_json)
    write_files({
        out: json.dumps(document, indent=1) + "\n", out.with_suffix(".html"): page(document),
    })  # fmt: skip
    _add(document, findings, allow_partial=allow_partial)
    report(findings)
    if as_json:
        print_json(document)
    else:
        result.print(summary(document), markup=False, highlight=False)
        result.print(f"wrote {out} and {out.with_suffix('.html')}", markup=False, highlight=False)
    return int(findings.has_errors)


def _certificate_of(
    file: Path, request: Request, findings: Findings, reading: Reading, *, is_quiet: bool
) -> dict[str, Any]:
    own = reading.of(file)
    chart = read_chart(file, findings, strict=own.strict, parameters=request.parameters)
    with progress(f"certifying {file.name}", is_quiet=is_quiet) as shown:

        def show(states: int, left: int, steps: int) -> None:
            shown(f"certifying {file.name}: {states:,} states, {left:,} left, {steps:,} steps")

        return certify(chart, request, show)


def _add(document: dict[str, Any], findings: Findings, *, allow_partial: bool) -> None:
    """Add the findings of a certificate."""
    for each in document["differences"]:
        after = f"after {', '.join(f'`{name}`' for name in each['path'])}, " if each["path"] else ""
        findings.add(
            "certify-difference", f"{after}`{each['step']}`: {each['what']}", None,
            help="repeat with another `-O` to see whether the compiler is the cause",
        )  # fmt: skip
    if document["result"] == certificates.PARTIAL and not allow_partial:
        findings.add(
            "certify-partial",
            f"the certificate is partial: {'; '.join(document['reasons'])}",
            None,
            help="raise `--limit` or `--timeout`, narrow the types of inputs and results, or "
            "accept it with `--allow-partial`",
        )


def _verify(
    verified: Path,
    file: Path | None,
    findings: Findings,
    reading: Reading,
    *,
    again: bool,
    as_json: bool,
) -> int:
    """Check a certificate against its files; ``again``: repeat the comparison, too."""
    document = certificates.read(verified)
    source = file or Path(document["sources"][0]["file"])
    parameters = document["parameters"]
    chart = read_chart(source, findings, strict=reading.of(source).strict, parameters=parameters)
    found = changed(document, chart)
    if again and not found:
        form = document["form"]
        request = Request(
            tuple(document["command"]),
            limit=document["limit"],
            form="" if form == "default" else form,
            prefix=document["prefix"],
            parameters=parameters,
            firmware=None if document["firmware"] is None else Path(document["firmware"]["file"]),
        )
        new = _certificate_of(source, request, findings, reading, is_quiet=as_json)
        found = [
            f"`{key}` is different when the comparison is repeated"
            for key in certificates.compared(document, new)
        ]
    for what in found:
        findings.add(
            "wrong-certificate", f"`{verified}` does not match: {what}", None,
            help="certify the chart again",
        )  # fmt: skip
    report(findings)
    if as_json:
        print_json({"certificate": str(verified), "result": document["result"], "changed": found})
    elif not findings.has_errors:
        what = "its content, its files and a repetition" if again else "its content and its files"
        result.print(f"{verified}: {document['result']}, {what} match", markup=False)
    return int(findings.has_errors or document["result"] == certificates.DIFFERENT)
