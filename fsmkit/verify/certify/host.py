"""The generated machine on this computer: a process that answers requests."""

from __future__ import annotations

import struct
import subprocess
from collections.abc import Iterable, Sequence
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


def build_host(
    program: Program, folder: Path, compiler: Sequence[str], absent: Sequence[str] = ()
) -> dict[str, bytes]:
    """Build the machine with a compiler and its flags; return the object code by source.

    ``absent``: the functions of the machine that are not called.
    """
    for name, text in program.files.items():
        (folder / name).write_text(text, encoding="utf-8")
    without = [f"-DCERTIFY_WITHOUT_{name.upper()}" for name in absent]
    flags = [*FLAGS, f"-fdebug-prefix-map={folder}=.", "-DCERTIFY_HOST", *without]
    p = program.prefix
    own = [f"{p}_info.c", "fsm_save.c", f"driver_{p}.c", "driver.c", "host.c"]
    names = dict.fromkeys([*program.sources, *own])
    for name in names:
        compile_c(["-c", name, "-o", object_of(name), *flags], folder, compiler=compiler)
    link_host(names, folder, compiler)
    return {name: (folder / object_of(name)).read_bytes() for name in program.sources}


def object_of(source: str) -> str:
    """Return the name of the object file of a source."""
    return f"{source.removesuffix('.c')}.host.o"


def link_host(sources: Iterable[str], folder: Path, compiler: Sequence[str]) -> None:
    """Link the program ``host`` from the objects of sources."""
    compile_c([*map(object_of, sources), "-o", "host"], folder, compiler=compiler[:1])


class HostMachine:
    """A machine in a process of its own, so that a crash there is a finding."""

    def __init__(self, folder: Path, seconds: int = 0) -> None:
        """Start the program that `build_host` has built in a folder.

        ``seconds``: the processor time after which it ends, 0 for no limit.
        """
        self._process = subprocess.Popen(
            [str(folder / "host"), str(seconds)], stdin=subprocess.PIPE, stdout=subprocess.PIPE
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
