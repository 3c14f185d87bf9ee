"""The processors that certificates are for: how their binaries are known, built and emulated."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from fsmkit.diagnostics import fail

if TYPE_CHECKING:
    from elftools.elf.elffile import ELFFile

M_PROFILE = {11: "Cortex-M0", 12: "Cortex-M0", 10: "Cortex-M3", 13: "Cortex-M4", 17: "Cortex-M33"}
"""The cores by ``Tag_CPU_arch`` of Arm's build attributes, where the core is not named."""


@dataclass(frozen=True, slots=True)
class Processor:
    """A processor of the emulator; names of constants are those of `unicorn`."""

    name: str
    family: str
    """The module of constants, such as ``arm``."""
    architecture: str
    modes: tuple[str, ...]
    stack: str
    link: str
    """The register that holds the return address."""
    counter: str
    """The program counter."""
    arguments: tuple[str, ...]
    """The registers of the first three arguments of a function."""
    model: str = ""
    status: str = ""
    """The register that holds the conditions of IT blocks."""
    is_thumb: bool = False
    is_big_endian: bool = False
    taken: int = 0
    """The cycles that a taken branch adds, where cycles are counted."""
    globals: tuple[tuple[str, str], ...] = ()
    """Registers with the values of symbols, for small data."""
    values: tuple[tuple[str, int], ...] = ()
    """Registers with other values, such as those that enable floating point."""


def _registers(name: str, first: int) -> tuple[str, ...]:
    return tuple(f"{name}{number}" for number in range(first, first + 3))


def _cortex(name: str, model: str, taken: int = 0) -> Processor:
    return Processor(
        name, "arm", "UC_ARCH_ARM", ("UC_MODE_THUMB", "UC_MODE_MCLASS"), "UC_ARM_REG_SP",
        "UC_ARM_REG_LR", "UC_ARM_REG_PC", _registers("UC_ARM_REG_R", 0),
        f"UC_CPU_ARM_CORTEX_{model}", "" if taken else "UC_ARM_REG_XPSR",
        is_thumb=True, taken=taken,
    )  # fmt: skip


PROCESSORS = (
    _cortex("Cortex-M0", "M0", 2),
    _cortex("Cortex-M0+", "M0", 1),
    _cortex("Cortex-M3", "M3"),
    _cortex("Cortex-M4", "M4"),
    _cortex("Cortex-M33", "M33"),
    Processor(
        "RV32IMC", "riscv", "UC_ARCH_RISCV", ("UC_MODE_RISCV32",), "UC_RISCV_REG_SP",
        "UC_RISCV_REG_RA", "UC_RISCV_REG_PC", _registers("UC_RISCV_REG_A", 0),
        globals=(("UC_RISCV_REG_GP", "__global_pointer$"),),
    ),
    Processor(
        "AArch64", "arm64", "UC_ARCH_ARM64", ("UC_MODE_ARM",), "UC_ARM64_REG_SP",
        "UC_ARM64_REG_LR", "UC_ARM64_REG_PC", _registers("UC_ARM64_REG_X", 0),
    ),
    Processor(
        "PowerPC", "ppc", "UC_ARCH_PPC", ("UC_MODE_PPC32", "UC_MODE_BIG_ENDIAN"), "UC_PPC_REG_1",
        "UC_PPC_REG_LR", "UC_PPC_REG_PC", _registers("UC_PPC_REG_", 3),
        is_big_endian=True,
        globals=(("UC_PPC_REG_13", "_SDA_BASE_"), ("UC_PPC_REG_2", "_SDA2_BASE_")),
        values=(("UC_PPC_REG_MSR", 0x2000),),
    ),
)  # fmt: skip
"""All processors of the emulator."""


def processor_of(elf: ELFFile, command: Sequence[str] = ()) -> Processor | None:
    """Return the processor of a binary, or None for one of this computer's kind (x86-64).

    The flags of the compiler's ``command`` name the core of an Arm processor (``-mcpu``); without
    that, its architecture implies one.

    Raises `FsmkitError` (``certify-processor``) for others.
    """
    machine, bits = elf["e_machine"], elf.elfclass
    if machine == "EM_X86_64":
        return None
    known: dict[tuple[Any, int, bool], str] = {
        ("EM_RISCV", 32, True): "RV32IMC",
        ("EM_AARCH64", 64, True): "AArch64",
        ("EM_PPC", 32, False): "PowerPC",
    }
    if machine == "EM_ARM" and elf.little_endian:
        name = _arm_core(elf, command)
    else:
        name = known.get((machine, bits, elf.little_endian), "")
    for processor in PROCESSORS:
        if processor.name == name:
            return processor
    order = "little" if elf.little_endian else "big"
    what = name or f"{str(machine).removeprefix('EM_')}, {bits} bits, {order}-endian"
    raise fail(
        "certify-processor",
        f"binaries for {what} are not emulated",
        help=f"build for x86-64, or for one of {', '.join(p.name for p in PROCESSORS)}",
    )


def _arm_core(elf: ELFFile, command: Sequence[str]) -> str:
    """Return the Cortex-M core that a binary is for."""
    found: dict[str, Any] = {}
    section: Any = elf.get_section_by_name(".ARM.attributes")
    if section is not None:
        for part in section.iter_subsections():
            for group in part.iter_subsubsections():
                for attribute in group.iter_attributes():
                    found.setdefault(str(attribute.tag), attribute.value)
    profile = found.get("TAG_CPU_ARCH_PROFILE")
    flags = [flag for flag in command if flag.startswith("-mcpu=")]
    architecture = int(found.get("TAG_CPU_ARCH", 0))
    if profile is not None and chr(int(profile)) != "M" and int(profile) != 0:
        return f"an Arm core of profile {chr(int(profile))}"
    if flags:
        core = flags[-1].removeprefix("-mcpu=").partition("+")[0]
        return core.capitalize().replace("-m", "-M").replace("plus", "+")
    return M_PROFILE.get(architecture, f"Arm architecture {architecture}")
