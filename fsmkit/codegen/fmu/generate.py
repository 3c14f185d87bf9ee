"""An FMU of a chart or a system: C, tables, the description, and an optional library.

The machines of a system are one FMU. Their connections are the C of a system (`codegen.system`);
unconnected ports belong to the importer.
"""

from __future__ import annotations

import hashlib
import io
import platform
import sys
import tempfile
import zipfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path

from fsmkit.chart.chart import Chart
from fsmkit.codegen.c.compiler import compile_c
from fsmkit.codegen.c.generate import generate_machine
from fsmkit.codegen.c.host import print_host
from fsmkit.codegen.c.names import Names
from fsmkit.codegen.c.options import Options
from fsmkit.codegen.fmu.description import build_description, description
from fsmkit.codegen.fmu.variables import Joined, Variable, variables_of, variables_of_all
from fsmkit.codegen.system.glue import compose
from fsmkit.codegen.system.parts import named_charts, parts_of
from fsmkit.diagnostics import Findings, fail
from fsmkit.emit import Emitter, snake
from fsmkit.language import SymbolType, Type
from fsmkit.plan.fingerprint import fingerprint
from fsmkit.plan.image import scalars
from fsmkit.system.system import System, part_of

WRAPPER = Path(__file__).parent / "sources"
"""The C between FMI and a machine."""
FLAGS = ("-std=c99", "-O2", "-fPIC", "-fvisibility=hidden", "-shared", "-w")
"""The compiler flags: only FMI's functions are visible, since FMUs of a process share names."""
EPOCH = (1980, 1, 1, 0, 0, 0)
"""The time stamp of files in the archive, so that equal charts have equal archives."""


def report_fmu_limits(chart: Chart, findings: Findings) -> None:
    """Report the parts of a chart that an FMU cannot express: invoked charts, string results.

    Other strings have no variable, which is a warning.
    """
    for invocation in chart.invocations:
        findings.add(
            "c-limit",
            f"an FMU of `{chart.name}` has no variables for the chart that it invokes",
            invocation.span,
            help="build an FMU for each chart",
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


@dataclass(frozen=True, slots=True)
class _Model:
    """The model of an FMU. ``prefix``: of the functions that drive all machines."""

    name: str
    prefix: str
    token: str
    machines: tuple[tuple[Names, str], ...]
    """The machines with their members in the system's struct; "" for a single chart."""
    joined: tuple[Joined, ...]
    files: Mapping[str, str]
    figures: Mapping[str, int]

    @property
    def is_system(self) -> bool:
        """Whether a system's struct contains the machines."""
        return any(member for _, member in self.machines)

    @property
    def names(self) -> tuple[tuple[Names, Joined], ...]:
        """The names of each distinct chart, with the connected ports of its machines."""
        once = {
            names.prefix: (names, joined)
            for (names, _), joined in zip(self.machines, self.joined, strict=True)
        }
        return tuple(once.values())


def generate(
    chart: Chart, version: str, prefix: str | None, *, with_binary: bool
) -> tuple[str, bytes, dict[str, int]]:
    """Return the name of a chart's FMU, its archive and its figures."""
    machine = generate_machine(chart, prefix, Options(extras=frozenset({"info"})))
    name = _identifier(prefix or chart.name, machine.names.prefix)
    token = fingerprint(chart)[:32]
    variables = variables_of(chart, machine.names.plan, with_clocks=version == "3.0")
    model = _Model(
        name,
        machine.names.prefix,
        token,
        ((machine.names, ""),),
        (Joined(),),
        machine.files,
        machine.figures,
    )
    return _generated(model, variables, version, with_binary=with_binary)


def generate_system(
    system: System, version: str, findings: Findings, *, with_binary: bool
) -> tuple[str, bytes, dict[str, int]] | None:
    """Return the same for a system, or None after reporting why it cannot be joined."""
    charts = named_charts(system)
    options = Options(extras=frozenset({"info"}))
    made = {chart.name: generate_machine(chart, None, options) for chart in dict.fromkeys(charts)}
    queued = [name for name, machine in made.items() if machine.figures.get("queue")]
    glue = compose(system, charts, queued, findings)
    if not glue:
        return None
    files: dict[str, str] = {}
    for each in (*(machine.files for machine in made.values()), glue):
        for path, text in each.items():
            if files.setdefault(path, text) != text:
                raise fail(
                    "duplicate-output",
                    f"two machines would be written to `{path}`",
                    help="give the charts different names",
                )
    parts = {part.index: part for part in parts_of(system, charts, queued)}
    machines = tuple(
        (made[chart.name].names, parts[number].member) for number, chart in enumerate(charts)
    )
    joined = tuple(_joined(system, number) for number in range(len(charts)))
    variables = variables_of_all(
        [
            (machine.name, names.chart, names.plan, own)
            for machine, (names, _), own in zip(system.machines, machines, joined, strict=True)
        ],
        with_clocks=version == "3.0",
    )
    prefix = snake(system.name)
    token = hashlib.sha256(repr(sorted(files.items())).encode()).hexdigest()[:32]
    figures = {"machines": len(machines)}
    name = _identifier(system.name, prefix)
    model = _Model(name, prefix, token, machines, joined, files, figures)
    return _generated(model, variables, version, with_binary=with_binary)


def surrounded(system: System) -> System:
    """Return the part of a system that becomes the FMU: the importer is its environment."""
    own = tuple(n for n, machine in enumerate(system.machines) if not machine.environment)
    if not own:
        raise fail(
            "wrong-option",
            f"all machines of `{system.name}` are of the environment: nothing is left for an FMU",
            help="remove the machines to simulate from `environment`",
        )
    return part_of(system, own)


def _joined(system: System, machine: int) -> Joined:
    """Return the ports of a machine that the importer does not access.

    Events that the environment may send belong to the importer, even if they are connected.
    """
    possible = {each.event for each in system.possible if each.machine == machine}
    events = {link.event for link in system.event_links if link.target == machine}
    return Joined(
        frozenset(link.input for link in system.input_links if link.target == machine),
        frozenset(events - possible),
        frozenset(link.port for link in system.event_links if link.source == machine),
    )


def _identifier(name: str, prefix: str) -> str:
    """Return the name of an FMU, which is used for a file and for functions."""
    return name if name.isascii() and name.isidentifier() else prefix


def _generated(
    model: _Model, variables: Sequence[Variable], version: str, *, with_binary: bool
) -> tuple[str, bytes, dict[str, int]]:
    name = model.name
    files = dict(model.files)
    files["fmu_model.h"] = _header(model, variables)
    files["fmu_model.c"] = _source(model, variables, is_3=version == "3.0")
    digit = version[0]
    for file in (f"fmi{digit}.c", "fmu.c", "fmu.h"):
        files[file] = (WRAPPER / file).read_text(encoding="utf-8")
    files |= _standard_headers(digit)
    sources = sorted(file for file in files if file.endswith(".c"))
    files["CMakeLists.txt"] = _cmake(name, sources)
    content = {f"sources/{file}": text.encode() for file, text in files.items()}
    content["modelDescription.xml"] = description(name, model.token, variables, version, sources)
    if version == "3.0":
        content["sources/buildDescription.xml"] = build_description(name, sources)
    if with_binary:
        folder, suffix = _platform(version)
        content[f"binaries/{folder}/{name}{suffix}"] = _library(files, sources)
    figures = {"variables": len(variables), **model.figures}
    return name, _archive(content), figures


def _standard_headers(digit: str) -> dict[str, str]:
    """Return the headers of FMI 2 or 3, which the package FMPy contains."""
    package = find_spec("fmpy")  # importing it would load its importer of FMUs
    folders = () if package is None else package.submodule_search_locations or ()
    for folder in folders:
        headers = sorted((Path(folder) / "c-code").glob(f"fmi{digit}*.h"))
        if headers:
            return {path.name: path.read_text(encoding="utf-8") for path in headers}
    raise fail(
        "missing-package",
        "an FMU contains the header files of FMI, which come from the package FMPy: it is not "
        "installed",
        help="install it: `pip install 'fsmkit[fmi]'`",
    )


def _header(model: _Model, variables: Sequence[Variable]) -> str:
    widest: dict[int, int] = {}
    for variable in variables:
        if variable.clock is not None:
            widest[variable.clock] = widest.get(variable.clock, 0) + 1
    out = Emitter()
    out.lines(["#ifndef FMU_MODEL_H", "#define FMU_MODEL_H", ""])
    charts = [names for names, _ in model.names]
    library = {"fsm_info.h", f"{model.prefix}.h", *(f"{names.prefix}.h" for names in charts)}
    out.lines([*(f'#include "{file}"' for file in sorted(library)), ""])
    most = max(widest.values(), default=1)
    out.text(f"""
    #define FMU_TOKEN "{model.token}"
    #define FMU_IDENTIFIER "{model.name}"
    #define FMU_COUNT {len(variables)}u
    #define FMU_PARTS {len(model.machines)}u
    #define FMU_WIDEST {most}u
    #define FMU_TICK_US ((double){charts[0].upper}_TICK_US)
    typedef {model.prefix} fmu_machine;
    """)
    with out.block("typedef union {", "} fmu_event;"):
        out.lines(f"{names.prefix}_event of_{names.prefix};" for names in charts)
    out.lines(f"extern const fsm_driver {names.prefix}_driver;" for names in charts)
    out.text("""

    void fmu_sent(void *m, uint32_t event, const void *const *arguments);
    void fmu_called(void *m, uint32_t operation, const void *const *arguments, void *result);

    #endif
    """)
    return out.finish()


def _source(model: _Model, variables: Sequence[Variable], *, is_3: bool) -> str:
    out, p = Emitter(), model.prefix
    out.lines(['#include "fmu.h"', ""])
    with out.block("const fmu_row fmu_rows[FMU_COUNT] = {", "};"):
        for v in variables:
            kind = v.kind if is_3 else v.kind2
            is_input = str(v.causality == "input").lower()
            out.line(
                f"{{FMU_{v.source}, FMU_AS_{kind.upper()}, {v.part}u, {v.number}u, {v.field}u, "
                f"{v.scalar}u, {is_input}}},"
            )
    with out.block("const fmu_part fmu_parts[FMU_PARTS] = {", "};"):
        for names, member in model.machines:
            offset = f"offsetof({p}, {member})" if member else "0u"
            out.line(f"{{&{names.prefix}_driver, {offset}}},")
    init, start = f"{p}_init(m)", f"{p}_start(m, now)"
    run, due = f"return {p}_run(m, now);", f"return {p}_next_deadline(m, deadline);"
    if not model.is_system:
        driver = f"{p}_driver"
        init, start = f"{driver}.info->init(m)", f"{driver}.start(m, now)"
        run = f"{driver}.run(m, now);\n        return true;"
        due = f"return {driver}.next_deadline(m, deadline);"
    else:
        start = f"(void){start}"
    out.text(f"""

    void fmu_model_init(fmu_machine *m)
    {{
        {init};
    }}

    void fmu_model_start(fmu_machine *m, uint32_t now)
    {{
        {start};
    }}

    bool fmu_model_run(fmu_machine *m, uint32_t now)
    {{
        {run}
    }}

    bool fmu_model_next_deadline(const fmu_machine *m, uint32_t *deadline)
    {{
        {due}
    }}

    #define FSM_HOST_CALL(m, number, given, result) fmu_called((m), (number), (given), (result))
    #define FSM_HOST_SEND(m, event, given) fmu_sent((m), (event), (given))
    """)
    out.line()
    for names, joined in model.names:
        print_host(out, names, joined.ports)
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
    """Return the folder of binaries for this platform, and the suffix of a library."""
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
