"""The machine built for another processor, with its driver in place of an operating system."""

from __future__ import annotations

import subprocess
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from fsmkit.diagnostics import fail
from fsmkit.verify.certify.processors import Processor, processor_of
from fsmkit.verify.certify.program import FOLDER, Program

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


def build(program: Program, folder: Path, command: Sequence[str]) -> Binary:
    """Build the machine and its driver with a compiler and its flags."""
    for name in ("support.c", "link.ld"):
        (folder / name).write_text((FOLDER / name).read_text(encoding="utf-8"), encoding="utf-8")
    for name, text in program.files.items():
        (folder / name).write_text(text, encoding="utf-8")
    objects = {}
    for name in program.sources:
        target = f"{name.removesuffix('.c')}.o"
        flags = [*MACHINE_FLAGS, f"-fdebug-prefix-map={folder}=."]
        compile_for(command, ["-c", *flags, name, "-o", target], folder)
        objects[target] = (folder / target).read_bytes()
    own = [f"driver_{program.prefix}.c", "driver.c", "support.c"]
    for name in own:
        target = f"{name.removesuffix('.c')}.o"
        compile_for(command, ["-c", "-g", name, "-o", target, *DRIVER_FLAGS], folder)
    parts = [f"{name.removesuffix('.c')}.o" for name in own]
    linked = [*parts, *objects, *LINK_FLAGS, "-lgcc", "-o", "certify.elf"]
    compile_for(command, linked, folder)
    return Binary(folder / "certify.elf", objects)
