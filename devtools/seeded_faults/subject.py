"""A chart whose certificate is complete or bounded, with all its steps for the faults to come."""

from __future__ import annotations

import ctypes
import re
import shlex
import shutil
import struct
import subprocess
from collections import defaultdict
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

from fsmkit.chart.chart import Chart
from fsmkit.codegen.c.compiler import find_compiler
from fsmkit.diagnostics import FsmkitError
from fsmkit.verify.certify.certify import executions_of, options_of
from fsmkit.verify.certify.comparison import (
    Packet,
    Request,
    against_interpreter,
    exploration,
    packets,
)
from fsmkit.verify.certify.emulator import Emulator, StepError, image_of
from fsmkit.verify.certify.host import Answers, HostMachine, build_host, link_host, object_of
from fsmkit.verify.certify.program import program_of
from fsmkit.verify.certify.target import build, probed

INSTRUCTIONS = 100_000
"""The instructions after which a step of a faulty binary does not return."""
SECONDS = 2
"""The processor time after which a faulty machine does not return."""


class Fault(NamedTuple):
    """A changed instruction, statement or generator."""

    where: str
    what: str


@dataclass(slots=True)
class Totals:
    """The fates of seeded faults."""

    found: int = 0
    never_executed: list[Fault] = field(default_factory=list)
    equivalent: list[Fault] = field(default_factory=list)
    """Faults that leave the object code as it was."""
    survived: list[Fault] = field(default_factory=list)

    def line(self, kind: str) -> str:
        """Return the figures in one line."""
        count = self.found + sum(map(len, (self.never_executed, self.equivalent, self.survived)))
        return (
            f"{count} faults in {kind}: {self.found} found, {len(self.never_executed)} never "
            f"executed, {len(self.equivalent)} with equal object code, "
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
        """Build the machine, also for the emulator unless ``command`` is empty; take the steps."""
        self.chart, self.folder = chart, folder
        self.program = program_of(chart, None, options_of(""))
        self.own = folder / "host"
        self.own.mkdir(parents=True)
        self.compiler = [*find_compiler(), "-O1"]
        build_host(self.program, self.own, self.compiler)
        image, processor = None, None
        if command:
            cross = folder / "target"
            cross.mkdir()
            processor = probed(command.split(), cross)
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
                found.taken += sum(step.is_explored for step in packet.steps)
        if self.executions.emulator is not None:
            self.executions.emulator.limit_steps(INSTRUCTIONS)
        self.is_complete = not found.stopped
        self.steps = sum(len(each.packet.steps) for each in self.recorded)
        self._objects: dict[str, bytes] = {}
        """The object code of the original sources."""
        self._faulty: set[str] = set()
        self._stale: set[str] = set()
        """The files that are changed, and the sources whose objects are."""

    @property
    def emulator(self) -> Emulator:
        """The machine in the emulator."""
        assert self.executions.emulator is not None  # noqa: S101
        return self.executions.emulator

    # --- the binary ----------------------------------------------------------------------------

    def binary_differs(self) -> bool:
        """Return whether a step in the emulator differs from the recorded one."""
        for each in self.recorded:
            try:
                if self.emulator.answer(each.answers.state, each.requests) != each.answers.answers:
                    return True
            except StepError:
                return True
        return False

    def executed_addresses(self) -> set[int]:
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

    # --- the C on this computer ----------------------------------------------------------------

    def executed_lines(self) -> Mapping[str, set[int]]:
        """Return the lines of each source that the recorded steps execute, from 0 on."""
        folder = self.folder / "covered"
        if folder.exists():
            shutil.rmtree(folder)
        folder.mkdir()
        compiler = folder / "compiler"  # linking, too, needs the flag
        compiler.write_text(f'#!/bin/sh\nexec {shlex.join(self.compiler[:-1])} --coverage "$@"\n')
        compiler.chmod(0o700)
        build_host(self.program, folder, [str(compiler)])
        packets_ = (
            struct.pack("<III", len(p.saved), p.now % 2**32, len(each.requests))
            + p.saved
            + each.requests
            for each in self.recorded
            for p in (each.packet,)
        )
        subprocess.run(
            [str(folder / "host")], input=b"".join(packets_), stdout=subprocess.DEVNULL, check=True
        )
        found: dict[str, set[int]] = defaultdict(set)
        for name in self.program.sources:
            listed = subprocess.run(
                ["gcov", "-t", f"{name.removesuffix('.c')}.host.gcno"],
                cwd=folder, capture_output=True, text=True, check=True,
            ).stdout  # fmt: skip
            source = ""
            for line in listed.splitlines():
                count, number, text = (*line.split(":", 2), "", "")[:3]
                if number.strip() == "0" and text.startswith("Source:"):
                    source = text.removeprefix("Source:")
                elif re.match(r" *\d+[*]?$", count):
                    found[source].add(int(number) - 1)
        return found

    def _compile(self, name: str) -> bytes:
        """Compile a source as it is in the folder; return its object code, without line numbers.

        Raises `CompilationError` if it does not compile.
        """
        flags = ["-std=c99", "-w", "-DCERTIFY_HOST", *self.compiler[1:]]
        done = subprocess.run(
            [self.compiler[0], "-c", name, "-o", object_of(name), *flags],
            cwd=self.own, capture_output=True, check=False,
        )  # fmt: skip
        if done.returncode:
            raise CompilationError(done.stderr.decode())
        return (self.own / object_of(name)).read_bytes()

    def _write(self, name: str, text: str) -> None:
        (self.own / name).write_text(text, encoding="utf-8")

    def differs(self, files: Mapping[str, str]) -> bool | None:
        """Build a machine with other files; return whether it differs from the interpreter.

        None: its object code is the same. Raises `CompilationError` if it cannot be built.
        """
        p, original = self.program.prefix, self.program.files
        everything = [*self.program.sources, f"{p}_info.c", "fsm_save.c", f"driver_{p}.c"]
        has_header = any(name.endswith(".h") for name in files)
        changed = dict.fromkeys(
            everything if has_header else [n for n in files if n.endswith(".c")]
        )
        for name in self._faulty:
            self._write(name, original[name])
        for name in {**changed, **dict.fromkeys(self._stale)}:
            if name not in self._objects or name not in changed:
                self._objects[name] = self._compile(name)
        self._faulty, self._stale = set(files), set(changed)
        for name, text in files.items():
            self._write(name, text)
        found = [self._compile(name) == self._objects[name] for name in changed]
        if all(found):
            return None
        link_host(dict.fromkeys([*everything, "driver.c", "host.c"]), self.own, self.compiler)
        return self._host_differs()

    def _host_differs(self) -> bool:
        executions = self.executions
        with HostMachine(self.own, seconds=SECONDS) as host:
            for each in self.recorded:
                packet = each.packet
                try:
                    answers = host.answer(packet.saved, packet.now, each.requests, executions.size)
                except (FsmkitError, OSError):
                    return True
                if any(True for _ in against_interpreter(executions, packet, answers)):
                    return True
        return False


class CompilationError(Exception):
    """A faulty machine that cannot be built."""


def is_covered(lines: Iterable[int], covered: Collection[int]) -> bool:
    """Return whether one of some lines is executed."""
    return any(line in covered for line in lines)


def listed(kind: str, totals: Totals, *, has_all: bool) -> Sequence[str]:
    """Return the report of a campaign, a line each."""
    found = [f"  {totals.line(kind)}"]
    groups = [("survived", totals.survived)]
    if has_all:
        groups += [("never executed", totals.never_executed), ("equal code", totals.equivalent)]
    for name, faults in groups:
        found += [f"    {name}: {fault.what}, {fault.where}" for fault in faults]
    return found
