"""Measure machines in C, handwritten and generated, in the same way."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TypeVar

from benchmarks.comparison import c_machines
from benchmarks.comparison.figures import FSMKIT, Machine, Price, less, per_event
from benchmarks.comparison.tools import (
    CORTEX_M0,
    HOST,
    UnavailableError,
    code_bytes,
    instructions,
    run,
    sections,
)
from benchmarks.yardstick.model import Digests
from benchmarks.yardstick.streams import EVENTS, Stream

Found = TypeVar("Found")
Words = Sequence[str | Path]

DRIVER = Path(__file__).parent / "driver.c"
APART = ("-ffunction-sections", "-fdata-sections")

PARTS = {
    "queue: post, run": ("post", "run"),
    "timers: next_deadline": ("next_deadline",),
    "configuration: in, active": ("in", "active"),
    "exploration: step_..., rebase": ("step_event", "step_timer", "step_eventless", "rebase"),
}
"""Functions that a host may call in addition to `VERBS`; a linker omits those that it does not."""


@dataclass(frozen=True, slots=True)
class Bench:
    """The build folder, and the list of failed measurements."""

    work: Path
    note: Callable[[str], None]

    def attempt(self, what: Callable[[], Found]) -> Found | None:
        """Return the result of a measurement; None, with a note, if it fails."""
        try:
            return what()
        except UnavailableError as error:
            self.note(str(error))
            return None


def counted(program: Path, stream: Stream, mode: str) -> tuple[int, int]:
    """Return the instructions that a driver executes for the stream once, and twice."""
    once, twice = (
        instructions([program, stream.file, mode, times], program.parent) for times in ("1", "2")
    )
    return once, twice


def net(program: Path, empty: Path, stream: Stream, mode: str) -> float:
    """Return the instructions per event, without those of the loop."""
    once, twice = counted(program, stream, mode)
    loop_once, loop_twice = counted(empty, stream, mode)
    return per_event(once, twice, loop_twice - loop_once, EVENTS)


@dataclass(frozen=True, slots=True)
class Build:
    """A machine in its folder, with the page for the driver."""

    machine: c_machines.Machine
    stream: Stream
    folder: Path

    def flags(self) -> list[str]:
        """Return the flags of each compilation."""
        return ["-I.", *(f"-D{macro}" for macro in self.machine.variant.macros)]

    def sources(self) -> list[str]:
        """Return the files of the machine."""
        return self.machine.sources()

    def program(self, name: str, sources: Sequence[str], *macros: str) -> Path:
        """Return the driver with a machine; macros that verify replace those of the variant."""
        program = self.folder / name
        hooks = ["-include", "bench_chart.h"] if macros else []
        run([*HOST, *self.flags(), *macros, *hooks, DRIVER, *sources, "-o", program], self.folder)
        return program

    def objects(self, tool: tuple[str, ...]) -> list[str]:
        """Return the machine compiled, each function and each table in a section of its own."""
        objects = [f"{Path(source).stem}.o" for source in self.sources()]
        for source, object_file in zip(self.sources(), objects, strict=True):
            run([*tool, *self.flags(), *APART, "-c", source, "-o", object_file], self.folder)
        return objects

    def linked(self, tool: tuple[str, ...], objects: list[str], verbs: Sequence[str]) -> int:
        """Return the bytes that the linker keeps for a host that calls these functions."""
        first, *others = (f"{self.machine.prefix}_{verb}" for verb in verbs)
        roots = [f"-Wl,-e,{first}", *(f"-Wl,-u,{name}" for name in others)]
        run([tool[0], "-r", "-nostdlib", "-Wl,--gc-sections", *roots, *objects, "-o", "all.o"],
            self.folder)  # fmt: skip
        return code_bytes(sections(tool, self.folder / "all.o"))

    def ram(self, tool: tuple[str, ...]) -> int:
        """Return the size of the struct without the user's variables, in bytes."""
        run([*tool, *self.flags(), "-c", "bench_size.c", "-o", "bench_size.o"], self.folder)
        found = sections(tool, self.folder / "bench_size.o")
        return found[".bench_ram"] - found[".bench_user"]


def prepare(bench: Bench, machine: c_machines.Machine, stream: Stream) -> Build:
    """Write a machine and the pages for its measurement."""
    folder = bench.work / f"{stream.letter}_{machine.variant.name.replace(', ', '_')}"
    machine.write(folder)
    pages = {
        "bench_chart.h": c_machines.driver_page(machine, stream),
        "bench_empty.c": c_machines.empty_machine(machine),
        "bench_size.c": c_machines.size_page(machine, stream),
    }
    for name, text in pages.items():
        (folder / name).write_text(text, encoding="utf-8")
    return Build(machine, stream, folder)


def count(made: Build) -> float:
    """Return the instructions of an event."""
    empty = made.program("empty", ["bench_empty.c"])
    return net(made.program("driver", made.sources()), empty, made.stream, "run")


def figures(bench: Bench, made: Build, kind: str = FSMKIT) -> Machine:
    """Return the figures of a machine; `kind` is `LIMIT` or `FSMKIT`."""
    stream = made.stream
    verifier = made.program("verify", made.sources(), "-DBENCH_VERIFY")
    did = Digests(*run([verifier, stream.file, "verify"], made.folder).split())
    is_shown = did.order != "0" * 8 or stream.digests.order == did.order

    def code(tool: tuple[str, ...]) -> int:
        return made.linked(tool, made.objects(tool), c_machines.verbs(made.machine))

    return Machine(
        stream.letter, made.machine.variant.name, kind,
        is_correct=(did.work, did.path) == (stream.digests.work, stream.digests.path),
        is_ordered=did.order == stream.digests.order if is_shown else None,
        instructions=bench.attempt(partial(count, made)),
        code_m0=bench.attempt(lambda: code(CORTEX_M0)),
        code_x64=bench.attempt(lambda: code(HOST)),
        ram_m0=bench.attempt(lambda: made.ram(CORTEX_M0)),
        ram_x64=bench.attempt(lambda: made.ram(HOST)),
    )  # fmt: skip


def prices(bench: Bench, made: Build, whole: Machine) -> list[Price]:
    """Return the costs of parts: of the interface, and those that a macro removes.

    ``whole`` holds the figures of the machine with all removable parts.
    """
    m0 = bench.attempt(partial(costs, made, CORTEX_M0)) or {}
    x64 = bench.attempt(partial(costs, made, HOST)) or {}
    letter, name = made.stream.letter, made.machine.variant.name
    found = [
        Price(letter, name, part, m0.get(part), x64.get(part))
        for part in PARTS
        if part in m0 or part in x64
    ]
    for macro in c_machines.switches(made.machine):
        off = figures(bench, replace(made, machine=c_machines.without(made.machine, macro)))
        found.append(
            Price(
                letter, name, f"inside: all that {macro} leaves out",
                less(whole.code_m0, off.code_m0), less(whole.code_x64, off.code_x64),
                less(whole.ram_m0, off.ram_m0), less(whole.instructions, off.instructions),
            )
        )  # fmt: skip
    return found


def costs(made: Build, tool: tuple[str, ...]) -> dict[str, int]:
    """Return the bytes of code of each part of the interface that the machine has."""
    objects = made.objects(tool)
    base = made.linked(tool, objects, c_machines.VERBS)
    found = {}
    for part, verbs in PARTS.items():
        offered = [
            verb for verb in verbs if f"{made.machine.prefix}_{verb}(" in made.machine.header
        ]
        if offered:
            found[part] = made.linked(tool, objects, (*c_machines.VERBS, *offered)) - base
    return found
