"""Measure bytes on a Cortex-M0 and instructions on the host, of machines and differences."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from benchmarks.comparison.measure_c import APART
from benchmarks.comparison.tools import CORTEX_M0, HOST, code_bytes, instructions, run, sections
from benchmarks.overhead.pump import Program

TURNS = 5_000
HOST_PART = """
#include "pump.h"
#include <stdint.h>
#include <stdlib.h>
extern pump machine;
{head}
static void give(unsigned number)
{{
    pump_event e = PUMP_NO_EVENT;
    e.event = (uint8_t)number;
    (void)pump_dispatch(&machine, &e, 0u);
}}
pump machine;
{operations}
int main(int count, char **arguments)
{{
    pump *const m = &machine;
    (void)count;
    (void)m;
    (void)give;
    pump_init(&machine);
    pump_start(&machine, 0u);
    for (long left = atol(arguments[1]); left > 0; left--) {{
        {turn}
    }}
    return 0;
}}
"""
MOTOR = "void pump_motor(pump *m, bool on) { (void)m; (void)on; }"
LOG = "void fsm_log_write(const uint8_t *b, size_t n) { (void)b; (void)n; }"
SIZE = """
#include "pump.h"
const char ram[1 + sizeof(pump)] __attribute__((section(".price_ram"))) = {0};
"""


@dataclass(frozen=True, slots=True)
class Figures:
    """The figures of a machine, or the difference between two."""

    code: int
    """Bytes, Cortex-M0 -Os, that the linker keeps."""
    ram: int
    """Bytes on the Cortex-M0: the struct, and what the sources keep for all machines."""
    instructions: float
    """An event, gcc -O2 on the host, with what the turn needs to give it."""

    def less(self, other: Figures) -> Figures:
        """Return the difference to `other`."""
        return Figures(
            self.code - other.code,
            self.ram - other.ram,
            round(self.instructions - other.instructions, 2),
        )


class Meter:
    """Measures machines, each only once."""

    def __init__(self, folder: Path) -> None:
        """Work in a folder."""
        self._folder = folder
        self._known: list[tuple[Program, Figures]] = []

    def figures(self, program: Program) -> Figures:
        """Measure a machine; `UnavailableError` if a tool is missing."""
        for known, found in self._known:
            if known == program:
                return found
        folder = self._folder / str(len(self._known))
        folder.mkdir()
        for name, text in program.files.items():
            (folder / name).write_text(text, encoding="utf-8")
        code, kept = _linked(program, folder)
        found = Figures(code, kept + _struct(program, folder), _instructions(program, folder))
        self._known.append((program, found))
        return found

    def difference(self, with_it: Program, without_it: Program) -> Figures:
        """Return the additional cost of one machine over another."""
        return self.figures(with_it).less(self.figures(without_it))


def _flags(program: Program) -> list[str]:
    return ["-I.", "-DFSM_NO_NAMES", *program.macros]


def _linked(program: Program, folder: Path) -> tuple[int, int]:
    """Return the bytes of code and of memory that the linker keeps for a host."""
    objects = [f"{Path(source).stem}.o" for source in program.sources]
    for source, made in zip(program.sources, objects, strict=True):
        run([*CORTEX_M0, *_flags(program), *APART, "-c", source, "-o", made], folder)
    first, *others = (call if "fsm_" in call else f"pump_{call}" for call in program.calls)
    roots = [f"-Wl,-e,{first}", *(f"-Wl,-u,{name}" for name in others)]
    run([CORTEX_M0[0], "-r", "-nostdlib", "-Wl,--gc-sections", *roots, *objects, "-o", "all.o"],
        folder)  # fmt: skip
    found = sections(CORTEX_M0, folder / "all.o")
    return code_bytes(found), sum(n for name, n in found.items() if name.startswith(".bss"))


def _struct(program: Program, folder: Path) -> int:
    (folder / "size.c").write_text(SIZE, encoding="utf-8")
    run([*CORTEX_M0, *_flags(program), "-c", "size.c", "-o", "size.o"], folder)
    return sections(CORTEX_M0, folder / "size.o")[".price_ram"] - 1


def _instructions(program: Program, folder: Path) -> float:
    calls = MOTOR if "pump_motor(" in program.files["pump.h"] else ""
    logs = LOG if "-DFSM_LOGGED" in program.macros else ""
    heads = {"pump_trace.c": "fsm_trace.h", "pump_records.c": "fsm_records.h"}
    head = "".join(f'#include "{h}"' for source, h in heads.items() if source in program.sources)
    text = HOST_PART.format(head=head, operations=calls + logs, turn=program.turn)
    (folder / "host.c").write_text(text, encoding="utf-8")
    run([*HOST, *_flags(program), "host.c", *program.sources, "-o", "host"], folder)
    once, twice = (instructions([folder / "host", str(n * TURNS)], folder) for n in (1, 2))
    return round((twice - once) / TURNS / program.events, 2)
