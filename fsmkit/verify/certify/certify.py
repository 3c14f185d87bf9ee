"""Certify a chart: build it, compare its executions, write down the result."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from fsmkit.chart.chart import Chart
from fsmkit.codegen.c.compiler import find_compiler
from fsmkit.codegen.c.limits import require_limits
from fsmkit.codegen.c.options import Options, read_options
from fsmkit.diagnostics import fail
from fsmkit.verify.certify.certificate import certificate, changes
from fsmkit.verify.certify.comparison import Executions, Progress, Request, compare
from fsmkit.verify.certify.emulator import Emulator, Image, image_of, require_emulator
from fsmkit.verify.certify.firmware import load_firmware
from fsmkit.verify.certify.host import HostMachine, build_host
from fsmkit.verify.certify.layout import Translation
from fsmkit.verify.certify.processors import Processor
from fsmkit.verify.certify.program import Program, program_of
from fsmkit.verify.certify.target import build, probed

TAKEN_FLAGS = ("-O", "-D", "-U", "-std", "-f")
"""The flags of a cross compiler that the compiler of this computer gets, too."""
NOT_TAKEN = ("-flto", "-ffunction", "-fdata", "-fshort-enums", "-fno-short-enums")


def certify(chart: Chart, request: Request, progress: Progress | None = None) -> dict[str, Any]:
    """Return the certificate of a chart.

    Raises `FsmkitError` if the chart cannot be certified: it has no C, a compiler fails, the
    processor is not emulated, or the firmware does not contain the machine.
    """
    require_limits([chart])
    options = options_of(request.form)
    with tempfile.TemporaryDirectory(prefix="fsmkit-certify-") as name:
        folder = Path(name)
        return _certify(chart, request, options, folder, progress)


def _certify(
    chart: Chart, request: Request, options: Options, folder: Path, progress: Progress | None
) -> dict[str, Any]:
    program = program_of(chart, request.prefix, options)
    own, cross = folder / "host", folder / "target"
    own.mkdir()
    cross.mkdir()
    command = list(request.command) or [*find_compiler(), "-O2"]
    processor = None
    if request.command or request.firmware is not None:
        require_emulator()
        processor = probed(command, cross)
    own_command = command if processor is None else [*find_compiler(), *_shared_flags(command)]
    image, binary = None, None
    absent: tuple[str, ...] = ()
    if request.firmware is not None:
        if processor is None:
            raise fail(
                "certify-elf", "a firmware is executed in the emulator, but no compiler is given",
                help="name the compiler of the firmware and its flags with `--cc`",
            )  # fmt: skip
        found = load_firmware(request.firmware, program, processor, command, cross)
        image, absent = found.image, found.absent
    elif processor is not None:
        binary = build(program, cross, command)
        image = image_of(binary.path, program.prefix)
    objects = build_host(program, own, own_command, absent)
    with HostMachine(own) as host:
        executions = executions_of(program, host, own, image, processor)
        comparison = compare(chart, program, executions, request, progress, absent)
    return certificate(
        chart, comparison, request, processor=processor, command=command, host_command=own_command,
        binary=binary, objects=objects,
    )  # fmt: skip


def _shared_flags(command: Sequence[str]) -> list[str]:
    return [
        flag
        for flag in command[1:]
        if flag.startswith(TAKEN_FLAGS) and not flag.startswith(NOT_TAKEN)
    ]


def executions_of(
    program: Program,
    host: HostMachine,
    folder: Path,
    image: Image | None,
    processor: Processor | None,
) -> Executions:
    """Return the machine on this computer, built in a folder, and that in the emulator."""
    figures = program.machine.figures
    size, saved = figures["struct_bytes"], figures["saved_bytes"] + 1
    if image is None or processor is None:
        return Executions(host, None, None, None, None, size, saved)
    own = image_of(folder / "host", program.prefix).layout
    payloads = program.payloads
    return Executions(
        host,
        Emulator(image, processor, folder, _inputs(program)),
        Translation(own, image.layout, payloads),
        Translation(image.layout, own, payloads),
        Translation(own, own, payloads),
        size,
        saved,
    )


def _inputs(program: Program) -> list[str]:
    """Return the members of the machine that hold its inputs."""
    names = program.names
    return [names.variables[each.name] for each in names.chart.inputs]


def options_of(form: str) -> Options:
    """Return the options of the C target for a form of the code, the value of ``--optimize``."""
    return read_options({"optimize": form} if form else {})


def changed(document: Mapping[str, Any], chart: Chart) -> list[str]:
    """Return what has changed since a certificate of a chart was made."""
    form = document["form"]
    program = program_of(chart, document["prefix"], options_of("" if form == "default" else form))
    return changes(document, chart, {name: program.files[name] for name in program.shipped})
