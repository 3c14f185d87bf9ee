"""The machine built for another processor, with its driver in place of an operating system."""

from __future__ import annotations

import subprocess
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from fsmkit.diagnostics import fail
from fsmkit.verify.certify.processors import Processor, processor_of
from fsmkit.verify.certify.program import FOLDER, OWN, Program

MACHINE_FLAGS = ("-std=c99", "-g")
"""Flags that do not change the code."""
DRIVER_FLAGS = (
    "-std=c99", "-w", "-O2", "-ffreestanding", "-fno-builtin", "-fno-lto",
    "-fno-tree-loop-distribute-patterns", "-ffunction-sections",
)  # fmt: skip
"""The driver is compiled alike for all certificates; its instructions do not count."""
LINK_FLAGS = (
    "-nostdlib",
    "-static",
    "-Wl,--build-id=none",
    "-Wl,-T,link.ld",
    "-Wl,-e,certify_main",
)


class Binary(NamedTuple):
    """A linked binary, and the object code of the machine in it."""

    path: Path
    objects: dict[str, bytes]
    """The object files of the project's sources, by name."""


def compile_for(command: Sequence[str], arguments: Sequence[str], folder: Path) -> None:
    """Run a compiler. Raises `FsmkitError` (``certify-build``) if it is missing or fails."""
    try:
        done = subprocess.run(
            [*command, *arguments], cwd=folder, capture_output=True, text=True, check=False
        )
    except OSError as error:
        raise fail(
            "certify-build",
            f"the compiler `{command[0]}` cannot be started: {error.strerror}",
            help="give the command and its flags in one string, such as "
            "`--cc 'arm-none-eabi-gcc -mcpu=cortex-m0 -Os'`",
        ) from error
    if done.returncode != 0:
        shown = "\n".join(done.stderr.splitlines()[:20])
        raise fail(
            "certify-build",
            f"`{command[0]}` failed with code {done.returncode}:\n{shown}",
            help="check the flags of `--cc`; only gcc, clang and compatible compilers are known",
        )


def probed(command: Sequence[str], folder: Path) -> Processor | None:
    """Return the processor that a compiler builds for, None for x86-64."""
    from elftools.elf.elffile import ELFFile

    (folder / "probed.c").write_text("int probed;\n", encoding="utf-8")
    compile_for(command, ["-c", "probed.c", "-o", "probed.o", "-fno-lto"], folder)
    with (folder / "probed.o").open("rb") as file:
        if file.read(4) != b"\x7fELF":
            raise fail("certify-build", f"`{command[0]}` writes no ELF files")
        file.seek(0)
        return processor_of(ELFFile(file), command)


def write_program(program: Program, folder: Path) -> None:
    """Write the sources of a program, and what links them."""
    for name in ("support.c", "link.ld"):
        (folder / name).write_text((FOLDER / name).read_text(encoding="utf-8"), encoding="utf-8")
    for name, text in program.files.items():
        (folder / name).write_text(text, encoding="utf-8")


def build(program: Program, folder: Path, command: Sequence[str]) -> Binary:
    """Build the machine and its driver with a compiler and its flags."""
    write_program(program, folder)
    objects = {}
    for name in program.sources:
        target = f"{name.removesuffix('.c')}.o"
        flags = [*MACHINE_FLAGS, f"-fdebug-prefix-map={folder}=."]
        compile_for(command, ["-c", *flags, name, "-o", target], folder)
        objects[target] = (folder / target).read_bytes()
    parts = _driver(program, folder, command, ())
    linked = [*parts, *objects, *LINK_FLAGS, "-lgcc", "-o", "certify.elf"]
    compile_for(command, linked, folder)
    return Binary(folder / "certify.elf", objects)


def _driver(
    program: Program, folder: Path, command: Sequence[str], flags: Sequence[str]
) -> list[str]:
    """Compile the driver; return its objects."""
    parts = []
    for name in (f"driver_{program.prefix}.c", "driver.c", "support.c"):
        target = f"{name.removesuffix('.c')}.o"
        own = [*flags, "-c", "-g", name, "-o", target, *DRIVER_FLAGS]
        compile_for(command, own, folder)
        parts.append(target)
    return parts


def build_driver(
    program: Program,
    folder: Path,
    command: Sequence[str],
    firmware: Path,
    base: int,
    called: Sequence[str],
    absent: Sequence[str],
) -> Path:
    """Build the driver for a machine in a firmware, at the address ``base``; return its path.

    ``called``: the functions of the host that the driver replaces; ``absent``: the functions of the
    machine that the firmware lacks.
    """
    write_program(program, folder)
    script = (folder / "link.ld").read_text(encoding="utf-8")
    script = script.replace("0x10000", hex(base)).replace("0x200000", hex(base + 0x200000))
    (folder / "link.ld").write_text(script, encoding="utf-8")
    renamed = [f"-D{name}={OWN}{name}" for name in called]
    without = [f"-DCERTIFY_WITHOUT_{name.upper()}" for name in absent]
    parts = _driver(program, folder, command, [*renamed, *without])
    linked = [*parts, *LINK_FLAGS, f"-Wl,--just-symbols={firmware}", "-lgcc", "-o", "driver.elf"]
    compile_for(command, linked, folder)
    return folder / "driver.elf"
