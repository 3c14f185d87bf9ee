"""An FMU of a chart: the C, the table of its variables, its description, and a library if asked."""

from __future__ import annotations

import io
import platform
import sys
import tempfile
import zipfile
from collections.abc import Sequence
from pathlib import Path

from fsmkit.chart.chart import Chart
from fsmkit.codegen.c.compiler import compile_c
from fsmkit.codegen.c.generate import generate_machine
from fsmkit.codegen.c.host import print_host
from fsmkit.codegen.c.names import Names
from fsmkit.codegen.c.options import Options
from fsmkit.codegen.fmu.description import build_description, description
from fsmkit.codegen.fmu.variables import Variable, variables_of
from fsmkit.diagnostics import Findings
from fsmkit.emit import Emitter
from fsmkit.language import SymbolType, Type
from fsmkit.plan.fingerprint import fingerprint
from fsmkit.plan.image import scalars

WRAPPER = Path(__file__).parent / "sources"
FLAGS = ("-std=c99", "-O2", "-fPIC", "-fvisibility=hidden", "-shared", "-w")
"""Only the functions of FMI are seen: two FMUs in one process have others of the same names."""
EPOCH = (1980, 1, 1, 0, 0, 0)
"""Of files in the archive, so that the same chart gives the same bytes."""


def report_fmu_limits(chart: Chart, findings: Findings) -> None:
    """Say what of a chart an FMU cannot express: charts that it invokes, results with strings.

    Other strings have no variable, which is a warning.
    """
    for invocation in chart.invocations:
        findings.add(
            "c-limit",
            f"an FMU of `{chart.name}` has no variables for the chart that it invokes",
            invocation.span,
            help="make an FMU of each chart",
        )
    declared: list[tuple[str, Type]] = [
        (v.name, v.type) for v in (*chart.data, *chart.outputs, *chart.inputs)
    ]
    declared += [(f"{e.name}.{f.name}", f.type) for e in chart.events for f in e.fields]
    for operation in chart.operations:
        declared += [(f"{operation.name}.{p.name}", p.type) for p in operation.parameters]
        if operation.result is not None and _has_string(operation.result):
            findings.add(
                "c-limit",
                f"the result of `{operation.name}` is a string, and an FMU has no variable for it",
                chart.root.span,
                help="declare an enumeration",
            )
    left_out = [name for name, type_ in declared if _has_string(type_)]
    if left_out:
        findings.add(
            "no-variable",
            f"strings of `{chart.name}` have no variable in an FMU: "
            + ", ".join(f"`{name}`" for name in left_out),
            chart.root.span,
            help="declare an enumeration",
        )


def _has_string(type_: Type) -> bool:
    return any(isinstance(scalar, SymbolType) for scalar in scalars(type_))


def generate(
    chart: Chart, version: str, prefix: str | None, *, with_binary: bool
) -> tuple[str, bytes, dict[str, int]]:
    """Return the name of an FMU, its bytes and its figures."""
    machine = generate_machine(chart, prefix, Options(extras=frozenset({"info"})))
    names = machine.names
    wanted = prefix or chart.name
    is_plain = wanted.isascii() and wanted.isidentifier()
    name = wanted if is_plain else names.prefix
    token = fingerprint(chart)[:32]
    variables = variables_of(chart, names.plan, with_clocks=version == "3.0")
    files = dict(machine.files)
    files["fmu_model.h"] = _header(names, variables, token, name)
    files["fmu_model.c"] = _source(names, variables, is_3=version == "3.0")
    digit = version[0]
    copied = ["fmu.h", "fmu.c", f"fmi{digit}.c"]
    copied += [p.name for p in WRAPPER.glob(f"fmi{digit}*.h")]
    for file in sorted(copied):
        files[file] = (WRAPPER / file).read_text(encoding="utf-8")
    sources = sorted(file for file in files if file.endswith(".c"))
    files["CMakeLists.txt"] = _cmake(name, sources)
    content = {f"sources/{file}": text.encode() for file, text in files.items()}
    content["modelDescription.xml"] = description(name, token, variables, version, sources)
    if version == "3.0":
        content["sources/buildDescription.xml"] = build_description(name, sources)
    if with_binary:
        folder, suffix = _platform(version)
        content[f"binaries/{folder}/{name}{suffix}"] = _library(files, sources)
    figures = {"variables": len(variables), **machine.figures}
    return name, _archive(content), figures


def _header(names: Names, variables: Sequence[Variable], token: str, name: str) -> str:
    widest: dict[int, int] = {}
    for variable in variables:
        if variable.clock is not None:
            widest[variable.clock] = widest.get(variable.clock, 0) + 1
    out, p = Emitter(), names.prefix
    out.lines(["#ifndef FMU_MODEL_H", "#define FMU_MODEL_H", ""])
    library = {"fsm_info.h", f"{p}.h"}
    out.lines([*(f'#include "{file}"' for file in sorted(library)), ""])
    most = max(widest.values(), default=1)
    out.text(f"""
    #define FMU_TOKEN "{token}"
    #define FMU_IDENTIFIER "{name}"
    #define FMU_COUNT {len(variables)}u
    #define FMU_WIDEST {most}u
    #define FMU_TICK_US ((double){names.upper}_TICK_US)
    #define FMU_DRIVER {p}_driver
    typedef {p} fmu_machine;
    typedef {p}_event fmu_event;
    extern const fsm_driver {p}_driver;

    void fmu_sent(void *m, uint32_t event, const void *const *arguments);
    void fmu_called(void *m, uint32_t operation, const void *const *arguments, void *result);

    #endif
    """)
    return out.finish()


def _source(names: Names, variables: Sequence[Variable], *, is_3: bool) -> str:
    out = Emitter()
    out.lines(['#include "fmu.h"', ""])
    with out.block("const fmu_row fmu_rows[FMU_COUNT] = {", "};"):
        for v in variables:
            kind = v.kind if is_3 else v.kind2
            is_input = str(v.causality == "input").lower()
            out.line(
                f"{{FMU_{v.source}, FMU_AS_{kind.upper()}, {v.number}u, {v.field}u, {v.scalar}u, "
                f"{is_input}}},"
            )
    out.text("""

    #define FSM_HOST_CALL(m, number, given, result) fmu_called((m), (number), (given), (result))
    #define FSM_HOST_SEND(m, event, given) fmu_sent((m), (event), (given))
    """)
    out.line()
    print_host(out, names)
    return out.finish()


def _cmake(name: str, sources: Sequence[str]) -> str:
    listed = "\n  ".join(sources)
    return (
        "cmake_minimum_required(VERSION 3.10)\n"
        f"project({name} C)\n"
        "set(CMAKE_C_STANDARD 99)\n"
        "set(CMAKE_C_VISIBILITY_PRESET hidden)\n"
        f"add_library({name} SHARED\n  {listed})\n"
        f'set_target_properties({name} PROPERTIES PREFIX "")\n'
    )


def _platform(version: str) -> tuple[str, str]:
    """Return the folder of binaries for this machine, and how a library's name ends."""
    system, suffix = {
        "win32": ("windows", ".dll"),
        "darwin": ("darwin", ".dylib"),
    }.get(sys.platform, ("linux", ".so"))
    is_wide = sys.maxsize > 2**32
    if version == "2.0":
        return {"windows": "win"}.get(system, system) + ("64" if is_wide else "32"), suffix
    processor = platform.machine().lower()
    known = {"amd64": "x86_64", "arm64": "aarch64", "i386": "x86", "i686": "x86"}
    return f"{known.get(processor, processor)}-{system}", suffix


def _library(files: dict[str, str], sources: Sequence[str]) -> bytes:
    with tempfile.TemporaryDirectory(prefix="fsmkit-") as name:
        folder = Path(name)
        for file, text in files.items():
            (folder / file).write_text(text, encoding="utf-8")
        compile_c([*FLAGS, *sources, "-o", "library"], folder)
        return (folder / "library").read_bytes()


def _archive(content: dict[str, bytes]) -> bytes:
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
        for path, data in sorted(content.items()):
            archive.writestr(zipfile.ZipInfo(path, EPOCH), data, zipfile.ZIP_DEFLATED)
    return packed.getvalue()
