"""The generated machine on this computer: a process that answers requests."""

from __future__ import annotations

import struct
import subprocess
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Self

from fsmkit.codegen.c.compiler import compile_c
from fsmkit.diagnostics import fail
from fsmkit.verify.certify.program import Program

FLAGS = ("-std=c99", "-w", "-g")
MOST_REQUESTS = 0x40000
"""The bytes of all requests of a packet (``driver.h``)."""


@dataclass(frozen=True, slots=True)
class Answers:
    """The answers to the requests of a packet."""

    state: bytes
    """The machine that all requests start from, as this computer holds it."""
    answers: bytes
    saved: bytes


class HostMachine:
    """A machine in a process of its own, so that a crash there is a finding."""

    def __init__(
        self, program: Program, folder: Path, compiler: Sequence[str], absent: Sequence[str] = ()
    ) -> None:
        """Build the machine with a compiler and its flags; start it.

        ``absent``: the functions of the machine that are not called.
        """
        without = [f"-DCERTIFY_WITHOUT_{name.upper()}" for name in absent]
        for name, text in program.files.items():
            (folder / name).write_text(text, encoding="utf-8")
        p = program.prefix
        objects: list[str] = []
        prefix = f"-fdebug-prefix-map={folder}=."
        for name in (*program.sources, f"{p}_info.c", "fsm_save.c", f"driver_{p}.c", "driver.c",
                     "host.c"):  # fmt: skip
            target = f"{name.removesuffix('.c')}.host.o"
            compile_c(
                ["-c", name, "-o", target, *FLAGS, prefix, "-DCERTIFY_HOST", *without],
                folder,
                compiler=compiler,
            )
            if target not in objects:
                objects.append(target)
        compile_c([*objects, "-o", "host"], folder, compiler=compiler[:1])
        self.objects = {
            name: (folder / f"{name.removesuffix('.c')}.host.o").read_bytes()
            for name in program.sources
        }
        self._process = subprocess.Popen(
            [str(folder / "host")], stdin=subprocess.PIPE, stdout=subprocess.PIPE
        )

    def __enter__(self) -> Self:
        """Return the machine."""
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """End the process."""
        self._process.kill()
        self._process.communicate()

    def answer(self, saved: bytes, now: int, requests: bytes, size: int) -> Answers:
        """Return the answers to requests; ``size``: the bytes of the machine, 0 if unknown."""
        to, source = self._process.stdin, self._process.stdout
        assert to is not None  # noqa: S101
        assert source is not None  # noqa: S101
        to.write(struct.pack("<III", len(saved), now % 2**32, len(requests)) + saved + requests)
        to.flush()
        (wrong,) = struct.unpack("<I", self._read(4))
        if wrong:
            raise fail("certify-failed", f"the generated C did not restore a state ({wrong})")
        state = self._read(size)
        answers, kept, done = [], [], 0
        while done < len(requests):
            done, answered, own = struct.unpack("<III", self._read(12))
            answers.append(self._read(answered))
            kept.append(self._read(own))
        return Answers(state, b"".join(answers), b"".join(kept))

    def _read(self, size: int) -> bytes:
        source = self._process.stdout
        assert source is not None  # noqa: S101
        found = source.read(size)
        if len(found) < size:
            code = self._process.wait()
            raise fail("certify-failed", f"the generated C ended with code {code}")
        return found
