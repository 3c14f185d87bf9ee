"""An endurance run: build the program, let it run, do some of its sessions again elsewhere."""

from __future__ import annotations

import subprocess
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from devtools.differential import first_difference
from devtools.endurance.program import program, report_limits
from devtools.endurance.replay import replay
from devtools.runtimes import harness
from fsmkit.chart.chart import Chart
from fsmkit.codegen.c.compiler import find_compiler
from fsmkit.diagnostics import Findings, fail

WARNINGS = ("-Wall", "-Wextra", "-Wno-type-limits", "-Wno-unused-function")
SANITIZERS = ("-fsanitize=address,undefined", "-fno-sanitize-recover=all")
TIME_LIMIT = 3600
"""Seconds of real time after which a program that has not ended never will."""


@dataclass(frozen=True, slots=True)
class Account:
    """The fate of all events and timers of a chart; ``figures`` by the names of endurance.c."""

    chart: Chart
    figures: dict[str, int]
    is_sanitized: bool
    replayed: int
    """Sessions that the interpreter did again, with the same figures and digest."""
    compared: int
    """Number of these sessions whose trace equals that of each target, too."""
    lines: int
    """Number of lines in those traces."""


def endure(
    chart: Chart,
    folder: Path,
    *,
    seconds: int,
    seed: int = 1,
    samples: int = 0,
    targets: Sequence[str] = ("c", "python"),
    compared: int = 0,
    report: Callable[[str], object] = lambda _: None,
) -> Account:
    """Run a chart for `seconds` simulated seconds in ``folder``; a violated law is an error.

    ``samples``: sessions that the interpreter repeats. The first ``compared`` of them also run on
    ``targets``, and their traces are compared line by line. ``report`` receives progress messages.
    """
    findings = Findings()
    report_limits(chart, findings)
    findings.stop_on_errors()
    is_sanitized = _build(chart, folder)
    report(f"{chart.name}: {seconds / 3600:g} simulated hours in C")
    told = _run(folder, seconds, seed, samples)
    sessions = [_figures(line) for line in told if line.startswith("session")]
    lines = 0
    for place, expected in enumerate(sessions):
        number = expected.pop("session")
        report(f"{chart.name}: session {number} again in the interpreter")
        path = folder / f"session_{number}.txt"
        script = path.read_text(encoding="utf-8").splitlines()
        _require_same(chart, path, expected, replay(chart, script))
        if place < compared:
            lines += _compare(chart, path, script, targets)
    (total,) = (_figures(line) for line in told if line.startswith("total"))
    done = len(sessions)
    return Account(chart, total, is_sanitized, done, min(done, compared), lines)


def _build(chart: Chart, folder: Path) -> bool:
    """Build the program; return whether with sanitizers, which not every compiler has."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, text in program(chart).items():
        (folder / name).write_text(text, encoding="utf-8")
    command = [*find_compiler(), "-std=c99", "-O1", "-g", *WARNINGS]
    said = ""
    for sanitizers in (SANITIZERS, ()):
        arguments = [*command, *sanitizers, "main.c", "-o", "endurance"]
        done = subprocess.run(arguments, cwd=folder, capture_output=True, text=True, check=False)
        if done.returncode == 0:
            return bool(sanitizers)
        said = said or done.stderr
    raise fail("harness-failed", f"the compiler rejected the program: {said.strip()[:2000]}")


def _run(folder: Path, seconds: int, seed: int, samples: int) -> list[str]:
    command = [str(folder / "endurance"), str(seed), str(seconds), str(samples), str(folder)]
    try:
        done = subprocess.run(
            command, capture_output=True, text=True, check=False, timeout=TIME_LIMIT
        )
    except subprocess.TimeoutExpired as error:
        raise fail("harness-failed", f"the program did not end in {TIME_LIMIT} s") from error
    if done.returncode != 0:
        raise fail(
            "harness-failed",
            f"seed {seed}, code {done.returncode}: {done.stderr.strip()[:2000]}",
            help=f"run it again with `{' '.join(command)}`",
        )
    return done.stdout.splitlines()


def _figures(line: str) -> dict[str, int]:
    words = line.removeprefix("total ").split()
    return {name: int(value) for name, value in zip(words[::2], words[1::2], strict=True)}


def _require_same(chart: Chart, path: Path, expected: dict[str, int], got: dict[str, int]) -> None:
    for name, value in expected.items():
        if got.get(name, 0) != value:
            raise fail(
                "harness-failed",
                f"`{chart.name}`, {path}: {name} is {value} in C, {got.get(name, 0)} in the "
                "interpreter",
            )


def _compare(chart: Chart, path: Path, script: Sequence[str], targets: Sequence[str]) -> int:
    """Compare the traces of a script line by line; return how many lines there are."""
    expected = harness("interpreter").run(chart, script)
    for target in targets:
        found = first_difference(target, expected, harness(target).run(chart, script))
        if found is not None:
            raise fail("harness-failed", f"`{chart.name}`, {path}: {found}")
    return len(expected)
