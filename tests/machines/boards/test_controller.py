"""The controllers of the boards: what their test in C finds, with sanitizers and two compilers."""

from __future__ import annotations

import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest

HERE = Path(__file__).parent
CONTROLLER = HERE.parents[2] / "machines" / "production_cell" / "controller"
WARNINGS = ("-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Wshadow", "-Werror")
SANITIZED = ("-O1", "-fsanitize=address,undefined", "-fno-sanitize-recover=all")
SOURCES = [CONTROLLER / f"{name}.c" for name in ("profile", "pid", "drive")]


def printed(folder: Path, compiler: str, options: tuple[str, ...], trials: int) -> str:
    """Compile the test, run it, and return what it prints; it must succeed."""
    program = folder / "controller_test"
    command = [compiler, "-std=c99", *WARNINGS, *options, f"-I{CONTROLLER}"]
    sources = [str(HERE / "controller_test.c"), *map(str, SOURCES)]
    subprocess.run([*command, *sources, "-lm", "-o", str(program)], check=True)
    done = subprocess.run(
        [str(program), str(trials)], capture_output=True, text=True, check=False, timeout=120
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.mark.cc
@pytest.mark.parametrize("compiler", ["gcc", "clang"])
def test_profile_controller_and_drive_keep_their_promises(
    tmp_path: Path, compiler: str, require_tool: Callable[[str], str]
) -> None:
    """Limits kept, targets reached exactly, the analytic step response, homing, stalls, marks."""
    out = printed(tmp_path, require_tool(compiler), SANITIZED, 1000)
    assert out.endswith("\n0 failures\n")


@pytest.mark.external
def test_compilers_and_optimization_make_no_difference(
    tmp_path: Path, require_tool: Callable[[str], str]
) -> None:
    """All is integer, so the figures of a thousand motions are the same to the last digit."""
    ways = (("gcc", ("-O0",)), ("gcc", ("-O3",)), ("clang", ("-O2",)))
    found = {printed(tmp_path, require_tool(name), options, 200) for name, options in ways}
    assert len(found) == 1
