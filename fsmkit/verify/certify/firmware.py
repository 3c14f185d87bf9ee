"""A machine inside a firmware: its functions are found by symbol, those of its host replaced."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from fsmkit.chart.analysis.host_events import sent_events
from fsmkit.codegen.c.names import Names
from fsmkit.diagnostics import fail
from fsmkit.diagnostics.suggestions import nearest_name
from fsmkit.verify.certify.emulator import Image, constants_of, image_of, segments_of, symbols_of
from fsmkit.verify.certify.layout import Translation, layout_of
from fsmkit.verify.certify.processors import Processor, processor_of
from fsmkit.verify.certify.program import OPTIONAL, OWN, Program
from fsmkit.verify.certify.target import MACHINE_FLAGS, build_driver, compile_for, write_program

if TYPE_CHECKING:
    from elftools.elf.elffile import ELFFile

MEGABYTE = 0x100000
ROOM = 4 * MEGABYTE
"""The bytes between the start of the driver and the end of its memory."""


@dataclass(frozen=True, slots=True)
class Firmware:
    """A firmware with a driver beside it."""

    image: Image
    absent: tuple[str, ...]
    """The functions of the machine that the firmware does not contain."""


def host_functions(names: Names) -> Iterator[str]:
    """Yield the C names of the functions that the host of a machine defines."""
    for inner in names.invoked:
        yield from host_functions(inner)
    p = names.prefix
    yield from (f"{p}_{name}" for name in names.operations.values())
    yield from (f"{p}_send_{names.event_names[event]}" for event in sent_events(names.chart))


def load_firmware(
    path: Path, program: Program, processor: Processor, command: Sequence[str], folder: Path
) -> Firmware:
    """Return a firmware with a driver for the machine in it.

    Raises `FsmkitError` (``certify-elf``, ``certify-layout``) if it does not contain the machine of
    the chart.
    """
    from elftools.common.exceptions import ELFError
    from elftools.elf.elffile import ELFFile

    try:
        with path.open("rb") as file:
            return _load(ELFFile(file), path, program, processor, command, folder)
    except (OSError, ELFError, UnicodeDecodeError) as error:
        what = f"is not an ELF file that can be read: {error}"
        raise wrong(path, what, "name the linked file") from error


def wrong(path: Path, what: str, way_out: str) -> Exception:
    """Return the error for a firmware."""
    return fail("certify-elf", f"`{path}` {what}", help=way_out)


def _load(
    elf: ELFFile,
    path: Path,
    program: Program,
    processor: Processor,
    command: Sequence[str],
    folder: Path,
) -> Firmware:
    names = program.names
    if elf["e_type"] != "ET_EXEC":
        raise wrong(path, "is not a linked program", "name the ELF file that is flashed")
    found = processor_of(elf)
    if found is None or found.name != processor.name.removesuffix("+"):
        other = "x86-64" if found is None else found.name
        raise wrong(path, f"is for {other}, but `--cc` builds for {processor.name}",
                    "give the compiler and flags of the firmware's build")  # fmt: skip
    symbols = symbols_of(elf)
    if not symbols:
        raise wrong(path, "is stripped: it has no symbols", "link without -s and keep the symbols")
    absent = _absent(path, names, symbols)
    called = _called(program, command, folder)
    for name in sorted(called - symbols.keys()):
        raise wrong(
            path,
            f"does not contain the function `{name}`, which the machine calls",
            "compile the functions of the host without -flto and not as `static`",
        )
    segments = tuple(segments_of(elf))
    base = _free(segments, symbols[f"{names.prefix}_start"].address)
    binary = build_driver(program, folder, command, path.resolve(), base, sorted(called), absent)
    own = image_of(binary, names.prefix)
    theirs = layout_of(elf.get_dwarf_info(), names.prefix, is_big_endian=processor.is_big_endian)
    payloads = program.payloads
    if not Translation(own.layout, theirs, payloads).is_same:
        raise fail(
            "certify-layout",
            f"the struct `{names.prefix}` has another layout in `{path}` than in the code that "
            f"`{command[0]}` builds now",
            help="give `--cc` the flags of the firmware's build; generate and build it again",
        )
    redirected = tuple(
        (symbols[name].address & ~1, own.symbols[OWN + name].address) for name in sorted(called)
    )
    image = replace(
        own,
        segments=own.segments + segments,
        constants=own.constants + constants_of(elf),
        symbols={**symbols, **own.symbols},
        redirected=redirected,
    )
    return Firmware(image, absent)


def _absent(path: Path, names: Names, symbols: dict[str, object] | object) -> tuple[str, ...]:
    """Return the functions of a machine that are missing; reject if it cannot be driven."""
    assert isinstance(symbols, dict)  # noqa: S101
    p = names.prefix
    if f"{p}_start" not in symbols:
        near = nearest_name(f"{p}_start", [name for name in symbols if name.endswith("_start")])
        hint = "" if near is None else f"; it has `{near}`"
        raise wrong(
            path, f"does not contain the machine `{p}`: it has no function `{p}_start`{hint}",
            "name the chart of the firmware, with the `--prefix` that it was generated with",
        )  # fmt: skip
    missing = tuple(name for name in OPTIONAL if f"{p}_{name}" not in symbols)
    if "dispatch" in missing and {"post", "run"} & set(missing):
        raise wrong(
            path, f"contains neither `{p}_dispatch` nor `{p}_post` with `{p}_run`",
            "link the functions that drive the machine",
        )  # fmt: skip
    return missing


def _called(program: Program, command: Sequence[str], folder: Path) -> set[str]:
    """Return the functions of the host that the machine calls, by the symbols of its objects."""
    from elftools.elf.elffile import ELFFile

    write_program(program, folder)
    found: set[str] = set()
    for name in program.sources:
        target = f"{name.removesuffix('.c')}.o"
        compile_for(command, ["-c", *MACHINE_FLAGS, "-fno-lto", name, "-o", target], folder)
        with (folder / target).open("rb") as file:
            table = ELFFile(file).get_section_by_name(".symtab")
            symbols = () if table is None else table.iter_symbols()  # type: ignore[attr-defined]
            found |= {s.name for s in symbols if s["st_shndx"] == "SHN_UNDEF"}
    return found & set(host_functions(program.names))


def _free(segments: Sequence[tuple[int, bytes, int]], near: int) -> int:
    """Return the start of free memory for the driver, close enough for calls of the machine."""
    taken = [(address, address + size) for address, _, size in segments]
    base = (near // MEGABYTE + 1) * MEGABYTE
    while any(start < base + ROOM and base < end for start, end in taken):
        base += MEGABYTE
    return base
