"""Analyse a generated machine with Frama-C/EVA under a host that does anything."""

from __future__ import annotations

import re
import subprocess
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from fsmkit.codegen.c.generate import Machine
from fsmkit.emit.lines import one_line
from fsmkit.testing.evidence.any_host import CHOICES, PROVED, any_host

UNROLLED = {
    "_init": 4096,
    "_take_out": 64,
    "_undelay": 64,
    "fsm_timers_remove": 64,
    "_enter_path": 64,
    "_leave_until": 64,
    "_select_at": 64,
}
"""Loops over arrays, by the end of the name of their function: how far they are unrolled.

Those over the tables of small machines end at an element, not at an index: a path ends with 0, and
the state around the outermost is 0. An interval of indexes does not hold that.
"""
ALARM = re.compile(r"^\[eva:alarm\] (.*(?:\n  .*)*)", re.MULTILINE)
DEFINED = re.compile(r"^(?:static )?(?:inline )?\w[\w ]*[ *](\w+)\([^;]*$", re.MULTILINE)


@dataclass(frozen=True, slots=True)
class Proof:
    """The result of the analysis."""

    alarms: tuple[str, ...]
    reached: int
    """Percent of the statements in the functions that are analysed."""
    failure: str = ""
    """Why the analysis did not end; then nothing is proved."""


def prove(frama_c: str, machine: Machine, folder: Path, timeout: float | None = None) -> Proof:
    """Analyse a machine under any host, without end; everything that it may do is covered.

    Args:
        frama_c: The program.
        machine: The generated C.
        folder: Receives the sources; it is the current folder of the analysis.
        timeout: Seconds after which the analysis is ended.

    """
    sources = [name for name in machine.files if name.endswith(".c")]
    sources = [name for name in sources if not name.endswith(("_info.c", "_save.c"))]
    texts = machine.files | {"any.h": CHOICES, "choices.c": PROVED, "host.c": any_host(machine)}
    for name, text in texts.items():
        (folder / name).write_text(text, encoding="utf-8")
    levels = _levels(machine.files[name] for name in sources)
    command = [
        *(frama_c, "-eva", "-eva-precision", "0", "-eva-plevel", "512"),
        *("-eva-auto-loop-unroll", "8"),
        *("-eva-slevel-function", ",".join(levels), "-machdep", "gcc_x86_64"),
        *("-warn-special-float", "none"),  # infinities and NaN are values like others here
        *("-eva-msg-key=-final-states,-initial-state",),
        *(str(folder / name) for name in (*sources, "choices.c", "host.c")),
    ]
    if _boolean_payload(machine):
        command.append("-no-warn-invalid-bool")
    try:
        done = subprocess.run(
            command, cwd=folder, capture_output=True, text=True, check=False, timeout=timeout
        )
    except subprocess.TimeoutExpired:
        return Proof((), 0, f"it did not end within {timeout:g} s")
    reached = re.search(r"statements reached \(out of \d+\): (\d+)% coverage", done.stdout)
    if done.returncode or reached is None or "[eva] done for function main" not in done.stdout:
        return Proof((), 0, f"it failed: {one_line(done.stdout[-500:])}")
    return Proof(tuple(ALARM.findall(done.stdout)), int(reached[1]))


def _boolean_payload(machine: Machine) -> bool:
    """Whether an event carries a bool where others carry something else.

    Then the analysis, which does not relate what a queued event is to what it carries, sees the
    bytes of one read as those of another. The sanitizers watch such reads instead.
    """
    return (
        "bool "
        in machine.files[f"{machine.names.prefix}.h"].partition("union {")[2].partition("} of;")[0]
    )


def _levels(texts: Iterable[str]) -> list[str]:
    found = {name for text in texts for name in DEFINED.findall(text)}
    return sorted(
        f"{name}:{level}"
        for name in found
        for ending, level in UNROLLED.items()
        if name.endswith(ending)
    )
