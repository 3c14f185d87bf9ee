"""Worst case of each event on a Cortex-M0: ``python -m benchmarks.worst_case``.

Runs generated and hand-written machines through the start of the yardstick's streams in the
emulator of certificates. Counts the instructions, cycles and bytes of stack of each `dispatch`.
"""

from __future__ import annotations

import struct
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import click

from benchmarks.comparison import c_machines
from benchmarks.comparison.tools import CORTEX_M0
from benchmarks.yardstick.charts import chart_file
from benchmarks.yardstick.streams import Stream, make_stream
from fsmkit.verify.certify.emulator import Emulator, image_of
from fsmkit.verify.certify.processors import PROCESSORS
from fsmkit.verify.certify.program import FOLDER
from fsmkit.verify.certify.target import DRIVER_FLAGS, LINK_FLAGS, MACHINE_FLAGS, compile_for

START, DISPATCH = 0, 1
PART = 20_000
"""The events of one packet."""
OWN = Path(__file__).parent / "driver_bench.c"


@dataclass(slots=True)
class Worst:
    """The greatest numbers of an event."""

    instructions: int = 0
    cycles: int = 0
    stack: int = 0

    def add(self, instructions: int, cycles: int, stack: int) -> None:
        """Take the numbers of one step."""
        self.instructions = max(self.instructions, instructions)
        self.cycles = max(self.cycles, cycles)
        self.stack = max(self.stack, stack)


def build(machine: c_machines.Machine, stream: Stream, folder: Path) -> Path:
    """Build a machine with the driver for a Cortex-M0; return the binary's path."""
    machine.write(folder)
    if "fsm.h" not in machine.files:
        text = "#include <stdbool.h>\n#include <stdint.h>\n"
        (folder / "fsm.h").write_text(text, encoding="utf-8")
    for name in ("driver.h", "driver.c", "support.c", "link.ld"):
        (folder / name).write_text((FOLDER / name).read_text(encoding="utf-8"), encoding="utf-8")
    (folder / OWN.name).write_text(OWN.read_text(encoding="utf-8"), encoding="utf-8")
    page = c_machines.driver_page(machine, stream)
    (folder / "bench_chart.h").write_text(page, encoding="utf-8")
    macros = [f"-D{macro}" for macro in machine.variant.macros]
    objects = []
    for source in machine.sources():
        objects.append(f"{Path(source).stem}.o")
        compile_for(
            CORTEX_M0, [*MACHINE_FLAGS, "-I.", *macros, "-c", source, "-o", objects[-1]], folder
        )
    for source in (OWN.name, "driver.c", "support.c"):
        objects.append(f"{Path(source).stem}.o")
        flags = [*DRIVER_FLAGS, "-g", "-I.", *macros]
        compile_for(CORTEX_M0, [*flags, "-c", source, "-o", objects[-1]], folder)
    compile_for(CORTEX_M0, [*objects, *LINK_FLAGS, "-lgcc", "-o", "bench.elf"], folder)
    return folder / "bench.elf"


def requests(stream: Stream, count: int) -> Iterator[bytes]:
    """Yield the requests of a run: the start, then an event each (``driver.h``)."""
    yield struct.pack("<HBIBHI", 12, START, 0, 0, 1, 0)
    for event in stream.events[:count]:
        yield struct.pack("<HBIBHIB", 13, DISPATCH, 0, 0, 1, 0, event)


def measure(
    machine: c_machines.Machine, stream: Stream, count: int, folder: Path
) -> dict[str, Worst]:
    """Return the greatest numbers of each event."""
    image = image_of(build(machine, stream, folder), machine.prefix)
    processor = next(each for each in PROCESSORS if each.name == "Cortex-M0")
    emulator = Emulator(image, processor, folder)
    found = {name: Worst() for name in stream.names}
    names = [None, *(stream.names[event] for event in stream.events[:count])]
    steps = list(requests(stream, count))
    state = bytes(image.symbols["fsm_state"].size)
    for at in range(0, len(steps), PART):
        emulator.answer(state, b"".join(steps[at : at + PART]))
        records = emulator.records()
        for place, name in enumerate(names[at : at + PART]):
            if name is not None:
                found[name].add(*records[3 * place : 3 * place + 3])
    return found


@click.command()
@click.option("--events", default=100_000, show_default=True, help="Events of each stream.")
@click.option("--chart", "letters", multiple=True, default=("A", "B", "C"), help="Repeatable.")
def main(events: int, letters: tuple[str, ...]) -> None:
    """Print the worst case of each event for hand-written and generated machines."""
    with tempfile.TemporaryDirectory(prefix="fsmkit-worst-") as name:
        for letter in letters:
            stream = make_stream(letter, Path(name), events)
            generated, _ = c_machines.machines(chart_file(letter), c_machines.VARIANTS)
            machines = [*c_machines.by_hand(letter), *generated]
            found = [
                measure(machine, stream, events, Path(name) / f"{letter}{number}")
                for number, machine in enumerate(machines)
            ]
            heads = [machine.variant.name for machine in machines]
            click.echo(f"\n| {letter}: instructions/cycles/stack | {' | '.join(heads)} |")
            click.echo(f"|{'---|' * (len(heads) + 1)}")
            for event in stream.names:
                cells = (one[event] for one in found)
                click.echo(f"| {event} | {' | '.join(map(_cell, cells))} |")
            worst = [
                Worst(*(max(getattr(each, key) for each in one.values()) for key in KEYS))
                for one in found
            ]
            click.echo(f"| all events | {' | '.join(map(_cell, worst))} |")


KEYS = ("instructions", "cycles", "stack")


def _cell(worst: Worst) -> str:
    return f"{worst.instructions}/{worst.cycles}/{worst.stack}"


if __name__ == "__main__":
    main()
