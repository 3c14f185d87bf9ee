"""``fsmkit bind``: propose a binding of a chart to the headers of existing C."""

from __future__ import annotations

import os
import re
from collections.abc import Sequence
from pathlib import Path

import click

from fsmkit.chart.chart import Chart
from fsmkit.cli.common.console import out, print_json, report, result
from fsmkit.cli.common.options import Reading, path_option, reading_options
from fsmkit.cli.common.verbs import verb
from fsmkit.cli.common.writing import write_files
from fsmkit.codegen.c.compiler import find_compiler
from fsmkit.codegen.c.generate import machine_of
from fsmkit.codegen.existing_c.checks import check_binding
from fsmkit.codegen.existing_c.headers.folders import compiler_of
from fsmkit.codegen.existing_c.headers.model import Constant, Enumeration, Function, Header, Struct
from fsmkit.codegen.existing_c.headers.parsing import read_header
from fsmkit.codegen.existing_c.headers.propose import offers, proposed, rejections
from fsmkit.codegen.existing_c.headers.writing import binding_text
from fsmkit.codegen.existing_c.reader import SUFFIXES, beside, binding_of_text
from fsmkit.diagnostics import Findings, Severity, fail
from fsmkit.diagnostics.as_json import as_json as data_of
from fsmkit.emit import plain
from fsmkit.system.any_file import read_chart

WORD = re.compile(r"[A-Za-z_]\w*", re.ASCII)
MOST_SHARED = 5
"""Names that a finding lists."""
EPILOG = """\b
Examples:
  fsmkit bind vendor/bms.h --chart charger.yaml
  fsmkit bind vendor/bms.h --chart charger.yaml --write -- -Ivendor -DSTM32F407xx
  CC="arm-none-eabi-gcc -mcpu=cortex-m4" fsmkit bind board.h --chart charger.yaml
"""


@verb(EPILOG, Model=("parameters",))
@click.argument("header", type=click.Path(path_type=Path))
@click.argument("options", nargs=-1, type=click.UNPROCESSED, metavar="[-- OPTIONS OF THE COMPILER]")
@path_option(
    "--chart",
    "file",
    required=True,
    help="Bind this chart (required).",
)
@click.option(
    "--write", is_flag=True, help="Write the binding beside the chart instead of printing it."
)
@click.option("--json", "as_json", is_flag=True, help="Print one JSON document.")
@reading_options
def command(
    header: Path,
    options: tuple[str, ...],
    file: Path,
    write: bool,
    as_json: bool,
    reading: Reading,
) -> int:
    """Propose a binding of a chart to a C header.

    Constants, enumerations, records, operations, events, inputs and outputs are bound where one
    name of the header is similar and the types fit. The rest is written as comments. This needs
    the package libclang (`pip install fsmkit[headers]`).

    The header is read as the compiler of the variable CC would read it, with the options behind
    `--`. After an error of the compiler nothing is written.
    """
    findings = reading.findings()
    chart = read_chart(file, findings, strict=reading.strict, parameters=reading.parameters)
    path = file.with_name(file.stem + SUFFIXES[0])
    there = beside(file)
    if write and there is not None:
        raise fail(
            "unwritable-output",
            f"there is a binding already: `{there}`",
            help="run it without `--write` and copy what you need, or remove the file",
        )
    command = find_compiler()
    compiler = compiler_of(command, options)
    found = read_header(header, compiler, options)
    proposal = proposed(chart, found)
    include = include_of(header, options, compiler.folders)
    rejected = [] if write else list(rejections(found))
    offered = [] if write else list(offers(chart, found, proposal))
    text = binding_text(plain(chart.name), file.name, [include], proposal, offered, rejected)
    own = Findings()
    check_binding(binding_of_text(text, str(path), own), chart, own)
    own.stop_on_errors()
    if write:
        write_files({path: text})
    findings.extend(each for each in own if each.severity is Severity.NOTE)
    _report_shared(chart, found, findings)
    report(findings)
    if as_json:
        print_json(
            {
                "binding": text,
                "file": str(path) if write else None,
                "bound": len(proposal),
                "header": figures(found),
                "findings": [data_of(each) for each in findings],
            }
        )
    elif write:
        out.print(str(path), markup=False, highlight=False)
    else:
        result.print(text, end="", markup=False, highlight=False, soft_wrap=True)
    return 0


def _report_shared(chart: Chart, header: Header, findings: Findings) -> None:
    """Report names that the header of the machine will have, too."""
    machine = machine_of(chart, Findings(), {})
    if machine is None:
        return
    own = set(WORD.findall(machine.files[f"{machine.names.prefix}.h"]))
    parts: tuple[Sequence[Constant | Enumeration | Struct | Function], ...] = (
        header.constants,
        header.enumerations,
        header.structs,
        header.functions,
    )
    begin = f"{machine.names.prefix}_"
    names = sorted({e.name.rpartition(" ")[2] for part in parts for e in part if e.is_own} & own)
    shared = [name for name in names if name.lower().startswith(begin)]
    if shared:
        shared_names = ", ".join(f"`{name}`" for name in shared[:MOST_SHARED])
        more = f" and {len(shared) - MOST_SHARED} more" if len(shared) > MOST_SHARED else ""
        findings.add(
            "c-name-taken",
            f"the header and the machine both have {shared_names}{more}",
            chart.root.span,
            help=f"choose another prefix, `fsmkit compile --prefix {begin}chart`, or names in C "
            "under `names` of the binding",
            severity=Severity.WARNING,
        )


def include_of(header: Path, options: tuple[str, ...], folders: tuple[str, ...]) -> str:
    """Return the include of a header: relative to a searched folder, else its name.

    System headers have angle brackets.
    """
    here = os.path.realpath(header)
    words = iter(options)
    own = [word[2:] or next(words, "") for word in words if word.startswith("-I")]
    for folder, shape in (*((f, "{}") for f in own), *((f, "<{}>") for f in folders)):
        start = os.path.realpath(folder)
        if here.startswith(start + os.sep):
            return shape.format(os.path.relpath(here, start).replace(os.sep, "/"))
    return header.name


def figures(header: Header) -> dict[str, int]:
    """Return the numbers of declarations in a header and its includes."""
    return {
        "macros": header.macros,
        "numbers": len(header.constants),
        "enumerations": len(header.enumerations),
        "structs": len(header.structs),
        "functions": sum(not each.is_variable for each in header.functions),
    }
