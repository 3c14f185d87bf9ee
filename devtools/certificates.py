"""Certificates under test: random charts must agree, and seeded faults must be found.

``python -m devtools.certificates charts --charts 1000`` certifies random charts: each difference is
a false alarm, or a mistake of a generator. ``... faults FILE --elf 300 --c 200`` changes one
instruction of the binary, or one statement of the generated C, at a time, and lists the faults
that no step shows. Faults in instructions that no step executes count as unreachable.
"""

from __future__ import annotations

import ctypes
import re
import subprocess
import tempfile
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from random import Random
from typing import NamedTuple

import click

from devtools.differential import LIMITS, random_case
from fsmkit.chart.chart import Chart
from fsmkit.codegen.c.compiler import find_compiler
from fsmkit.diagnostics import Findings, FsmkitError
from fsmkit.system.any_file import read_chart
from fsmkit.verify.certify.certify import certify, executions_of, options_of
from fsmkit.verify.certify.comparison import (
    Executions,
    Packet,
    Request,
    against_interpreter,
    exploration,
    packets,
)
from fsmkit.verify.certify.emulator import Emulator, StepError, image_of
from fsmkit.verify.certify.host import Answers, HostMachine, build_host, link_host, object_of
from fsmkit.verify.certify.program import Program, program_of
from fsmkit.verify.certify.target import build, probed

CORTEX_M0 = "arm-none-eabi-gcc -mcpu=cortex-m0 -Os"
NOP = 0x46C0
REJECTED = LIMITS | {"livelock", "not-certified", "not-explored-yet", "c-name-taken"}
"""The rules by which a random chart is not certified."""


class Fault(NamedTuple):
    """A changed instruction or statement."""

    where: str
    what: str


@dataclass(slots=True)
class Totals:
    """The fates of seeded faults."""

    found: int = 0
    unreachable: list[Fault] = field(default_factory=list)
    survived: list[Fault] = field(default_factory=list)

    def line(self, kind: str) -> str:
        """Return the figures in one line."""
        count = self.found + len(self.unreachable) + len(self.survived)
        return (
            f"{count} faults in {kind}: {self.found} found, {len(self.unreachable)} unreachable, "
            f"{len(self.survived)} survived"
        )


@dataclass(frozen=True, slots=True)
class Recorded:
    """A packet of steps, and the answers of the machine on this computer."""

    packet: Packet
    requests: bytes
    answers: Answers


class Subject:
    """A chart with all steps of its comparison."""

    def __init__(self, chart: Chart, folder: Path, command: str, limit: int) -> None:
        """Build both machines; take the steps once."""
        self.folder = folder
        self.program = program_of(chart, None, options_of(""))
        self.own, cross = folder / "host", folder / "target"
        self.own.mkdir(parents=True)
        cross.mkdir()
        self.compiler = [*find_compiler(), "-O1"]
        build_host(self.program, self.own, self.compiler)
        processor = probed(command.split(), cross)
        assert processor is not None  # noqa: S101
        self.binary = build(self.program, cross, command.split()).path
        image = image_of(self.binary, self.program.prefix)
        self.recorded: list[Recorded] = []
        request = Request(limit=limit)
        found = exploration(chart, self.program, request)
        with HostMachine(self.own) as host:
            self.executions = executions_of(self.program, host, self.own, image, processor)
            for _, packet in packets(found, request, self.executions.saved):
                requests = b"".join(step.request for step in packet.steps)
                answers = host.answer(packet.saved, packet.now, requests, self.executions.size)
                wrong = list(against_interpreter(self.executions, packet, answers))
                assert not wrong  # noqa: S101
                self.recorded.append(Recorded(packet, requests, answers))
                found.taken += len(packet.steps)
        assert self.executions.emulator is not None  # noqa: S101
        self.emulator: Emulator = self.executions.emulator

    def binary_differs(self) -> bool:
        """Return whether a step in the emulator differs from the recorded one."""
        for each in self.recorded:
            try:
                if self.emulator.answer(each.answers.state, each.requests) != each.answers.answers:
                    return True
            except StepError:
                return True
        return False

    def executed(self) -> set[int]:
        """Return the addresses of the instructions that the recorded steps execute."""
        found: set[int] = set()
        kind = ctypes.CFUNCTYPE(
            None, ctypes.c_void_p, ctypes.c_uint64, ctypes.c_uint32, ctypes.c_void_p
        )
        hook = kind(lambda _, address, __, ___: found.add(address))
        self.emulator.observe(hook)
        assert not self.binary_differs()  # noqa: S101
        self.emulator.observe(None)
        return found


# --- instructions ------------------------------------------------------------------------------


def instructions(subject: Subject) -> Iterator[tuple[int, int, str]]:
    """Yield address, code and function of each 16-bit Thumb instruction of the machine."""
    symbols = subject.emulator.image.symbols
    p = subject.program.prefix
    lines = subprocess.run(
        ["arm-none-eabi-objdump", "-d", "--no-show-raw-insn", str(subject.binary)],
        capture_output=True, text=True, check=True,
    ).stdout.splitlines()  # fmt: skip
    name = ""
    driver = symbols["certify_driver_end"].address
    for line in lines:
        if head := re.match(r"[0-9a-f]+ <(\w+)>:", line):
            name = head[1]
        elif found := re.match(r" +([0-9a-f]+):\t(\S+)", line):
            address = int(found[1], 16)
            is_own = name.startswith((f"{p}_", "fsm_")) and address >= driver
            if is_own and not found[2].startswith("."):
                code = int.from_bytes(subject.emulator.read(address, 2), "little")
                if code >> 11 < 0x1D:
                    yield address, code, name


def changes(code: int) -> Iterator[tuple[str, int]]:
    """Yield the faults of a Thumb instruction: kind and changed code."""
    top = code >> 11
    if code >> 12 == 0xD and code >> 8 & 15 < 14:
        yield "condition inverted", code ^ 0x100
    if top in (4, 5, 6, 7):  # MOVS, CMP, ADDS, SUBS with 8 bits
        yield "constant off by one", code & 0xFF00 | (code + 1) & 0xFF
    if top in (0, 1, 2, 12, 13, 14, 15, 16, 17):  # shifts, loads and stores with 5 bits
        yield "constant off by one", code & ~0x7C0 | (code + 0x40) & 0x7C0
    if code >> 13 in (0, 3) or code >> 12 in (5, 8) or code >> 10 == 0x10:
        yield "register swapped", code ^ 1
    if code >> 9 in (0x28, 0x29, 0x2A) or top in (12, 14, 16):
        yield "store dropped", NOP


def binary_faults(subject: Subject, count: int, random: Random) -> Totals:
    """Seed faults in the binary, one at a time."""
    executed = subject.executed()
    possible = [
        (address, f"{address:#x} in {name}: {code:04x} to {changed:04x}", kind, changed)
        for address, code, name in instructions(subject)
        for kind, changed in changes(code)
        if changed != code
    ]
    totals = Totals()
    for address, where, kind, changed in random.sample(possible, min(count, len(possible))):
        subject.emulator.reload(address, changed.to_bytes(2, "little"))
        fault = Fault(where, kind)
        if subject.binary_differs():
            totals.found += 1
        elif address not in executed:
            totals.unreachable.append(fault)
        else:
            totals.survived.append(fault)
    subject.emulator.reload()
    return totals


# --- statements --------------------------------------------------------------------------------

STATEMENT = re.compile(r"^ +[^/#].*;(?: /\*.*\*/)?$")
NUMBER = re.compile(r"(?<![\w.])(\d+)(u?)\b")


def statement_changes(text: str) -> Iterator[tuple[int, str, str]]:
    """Yield the faults of generated C: line, kind and changed line."""
    for number, line in enumerate(text.splitlines()):
        if line.startswith(" ") and "if (" in line and line.rstrip().endswith("{"):
            start = line.index("if (") + 4
            inside = line[start : line.rindex(")")]
            yield number, "condition inverted", f"{line[:start]}!({inside})) {{"
        if "FSM_HOOK" in line or "FSM_CHECKED" in line:  # nothing is compiled there
            continue
        declares = re.match(r" +(const |static |\w+ \w+( =|;))", line)
        if STATEMENT.match(line) and not declares:
            is_needed = line.strip().startswith(("return", "break", "FEEDER", "case"))
            if not is_needed and line.strip().startswith(("m->", "(*", "queue[")):
                yield number, "store dropped", "    ;"
            elif not is_needed and re.match(r" +\w+\(m", line):
                yield number, "call dropped", "    ;"
            if found := NUMBER.search(line):
                changed = (
                    f"{line[: found.start()]}{int(found[1]) + 1}{found[2]}{line[found.end() :]}"
                )
                yield number, "constant off by one", changed


def statement_faults(subject: Subject, count: int, random: Random) -> Totals:
    """Seed faults in the generated C, one at a time; only those that compile count."""
    name = f"{subject.program.prefix}.c"
    lines = subject.program.files[name].splitlines()
    possible = list(statement_changes("\n".join(lines)))
    random.shuffle(possible)
    totals, done = Totals(), 0
    for number, kind, changed in possible:
        if done == count:
            break
        (subject.own / name).write_text("\n".join([*lines[:number], changed, *lines[number + 1 :]]))
        try:
            differs = _differs(subject, name)
        except FsmkitError:
            continue
        done += 1
        fault = Fault(f"{name}:{number + 1}: {lines[number].strip()}", kind)
        if differs:
            totals.found += 1
        else:
            totals.survived.append(fault)
    return totals


def _differs(subject: Subject, name: str) -> bool:
    """Build a changed machine; return whether it differs from the interpreter, or crashes."""
    flags = ["-c", name, "-o", object_of(name), "-std=c99", "-w", "-DCERTIFY_HOST", "-O1"]
    done = subprocess.run(
        [subject.compiler[0], *flags], cwd=subject.own, capture_output=True, check=False
    )
    if done.returncode:
        raise FsmkitError(Findings())
    link_host([*_sources(subject.program)], subject.own, subject.compiler)
    executions: Executions = subject.executions
    with HostMachine(subject.own, seconds=60) as host:
        for each in subject.recorded:
            packet = each.packet
            try:
                answers = host.answer(packet.saved, packet.now, each.requests, executions.size)
            except FsmkitError:
                return True
            if any(True for _ in against_interpreter(executions, packet, answers)):
                return True
    return False


def _sources(program: Program) -> Sequence[str]:
    p = program.prefix
    own = [f"{p}_info.c", "fsm_save.c", f"driver_{p}.c", "driver.c", "host.c"]
    return list(dict.fromkeys([*program.sources, *own]))


# --- commands ----------------------------------------------------------------------------------


@click.group()
def main() -> None:
    """Test certificates by random charts and by seeded faults."""


@main.command()
@click.option("--charts", default=1000, show_default=True, help="How many random charts.")
@click.option("--seed", default=0, show_default=True, help="Which thousand.")
@click.option("--first", default=0, show_default=True, help="The number of the first chart.")
@click.option("--limit", default=300, show_default=True, help="Steps of each chart.")
@click.option("--seconds", default=0.0, help="Stop after this time.")
@click.option("--cc", default="", help="The compiler with its flags (default: this computer's).")
def charts(charts: int, seed: int, first: int, limit: int, seconds: float, cc: str) -> None:
    """Certify random charts and list those whose executions differ."""
    totals = random_charts(range(first, first + charts), seed, limit, seconds, cc)
    raise SystemExit(1 if totals else 0)


def random_charts(
    numbers: Sequence[int], seed: int, limit: int, seconds: float, command: str
) -> list[str]:
    """Certify random charts; return a line for each difference."""
    wrong: list[str] = []
    done = rejected = steps = 0
    started = time.monotonic()
    for number in numbers:
        if seconds and time.monotonic() - started > seconds:
            break
        try:
            chart = random_case(seed, number).chart
            document = certify(chart, Request(tuple(command.split()), limit=limit, timeout=20))
        except FsmkitError as error:
            rules = {d.rule.name for d in error.diagnostics}
            if rules <= REJECTED:
                rejected += 1
                continue
            wrong.append(f"chart {number}: {error}")
            click.echo(wrong[-1])
            continue
        done += 1
        steps += document["steps"]
        for each in document["differences"][:1]:
            wrong.append(f"chart {number}: {[*each['path'], each['step']]}: {each['what']}")
            click.echo(wrong[-1])
    click.echo(
        f"{done} charts, {steps:,} steps, {rejected} not certified, {len(wrong)} differences, "
        f"{time.monotonic() - started:.0f} s"
    )
    return wrong


@main.command()
@click.argument("files", nargs=-1, required=True, type=click.Path(path_type=Path, exists=True))
@click.option("--elf", default=300, show_default=True, help="Faults in the binary of each chart.")
@click.option("--c", "in_c", default=200, show_default=True, help="Faults in its generated C.")
@click.option("--limit", default=30_000, show_default=True, help="Steps of each chart.")
@click.option("--seed", default=0, show_default=True, help="Which faults.")
@click.option("--cc", default=CORTEX_M0, show_default=True, help="The compiler with its flags.")
def faults(files: tuple[Path, ...], elf: int, in_c: int, limit: int, seed: int, cc: str) -> None:
    """Seed faults and list those that no step shows."""
    for file in files:
        with tempfile.TemporaryDirectory(prefix="fsmkit-certify-") as name:
            subject = Subject(read_chart(file, Findings()), Path(name), cc, limit)
            steps = sum(len(each.packet.steps) for each in subject.recorded)
            click.echo(f"{file.name}: {steps:,} steps")
            random = Random(seed)  # noqa: S311
            for kind, totals in (
                ("the binary", binary_faults(subject, elf, random)),
                ("the generated C", statement_faults(subject, in_c, random)),
            ):
                click.echo(f"  {totals.line(kind)}")
                for fault in totals.survived:
                    click.echo(f"    survived: {fault.what}, {fault.where}")


if __name__ == "__main__":
    main()
