"""The page on hosts and boards: its files are written, its commands run, its recipes compiled."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from collections.abc import Callable
from itertools import groupby
from pathlib import Path

import pytest

from fsmkit.chart.loading import load
from fsmkit.codegen.c.generate import generate_machine
from tests.boards.conftest import HOSTS, RUNTIME, WARNINGS

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs/how-to/hosts-and-boards.md").read_text(encoding="utf-8")
STANDINS = ROOT / "tests/boards/standins"
BLOCK = re.compile(r"^(## [^\n]*)$|^```(\w+)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
PUT = re.compile(r"[Pp]ut\s+this\s+into\s+`([^`]+)`:\s*$")
TOOLS = {
    "Linux and other POSIX systems": ("cc",),
    "A bare Cortex-M": ("arm-none-eabi-gcc", "qemu-system-arm"),
    "CMake": ("cmake", "cc"),
    "pkg-config and make": ("make", "pkg-config", "cc"),
}
MEASURED = re.compile(r"\d+ ns|ns or more: \d+")
"""What a run of the loop measured: it differs from run to run. So does the number of
cycles in its second of work: a busy machine misses deadlines."""
OVERRUN = re.compile(r"overruns by reason: |cycle \d+: woken ")
"""Lines on overruns, which only a busy machine has."""
RequireTool = Callable[[str], str]


def sections() -> dict[str, list[str]]:
    """Return the commands of each section with what they print, as ``command newline output``."""
    found: dict[str, list[str]] = {"": []}
    heading = ""
    for block in BLOCK.finditer(PAGE):
        if block[1]:
            heading = block[1].removeprefix("## ")
            found[heading] = []
        elif block[2] == "console":
            parts = re.split(r"^\$ ", block[3], flags=re.MULTILINE)
            assert parts[0] == ""
            found[heading] += parts[1:]
    return found


def files() -> dict[str, str]:
    """Return the files of the page by name."""
    found, end = {}, 0
    for block in BLOCK.finditer(PAGE):
        if put := PUT.search(PAGE[end : block.start()]):
            found[put[1]] = block[3]
        end = block.end()
    return found


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Where the files of the page are, and the commands find fsmkit."""
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    monkeypatch.setenv("PATH", path)
    monkeypatch.delenv("CC", raising=False)
    for name, text in files().items():
        (tmp_path / name).write_text(text, encoding="utf-8")
    return tmp_path


@pytest.mark.slow
@pytest.mark.cc
@pytest.mark.parametrize("section", TOOLS)
def test_what_the_commands_print(section: str, folder: Path, require_tool: RequireTool) -> None:
    for tool in TOOLS[section]:
        require_tool(tool)
    commands = sections()
    assert commands[section]
    for command in commands[""] + commands[section]:
        line, _, expected = command.partition("\n")
        done = subprocess.run(
            ["/bin/sh", "-c", f"exec 2>&1; {line}"],
            cwd=folder,
            capture_output=True,
            text=True,
            check=False,
            stdin=subprocess.DEVNULL,
        )
        assert tidy(done.stdout) == tidy(expected), line


def test_every_section_with_commands_is_run() -> None:
    assert {name for name, commands in sections().items() if commands} == {"", *TOOLS}


def tidy(printed: str) -> list[str]:
    """Return the lines without what was measured: histogram and overruns have any number."""
    steady = [line for line in printed.splitlines() if not OVERRUN.match(line)]
    lines = [MEASURED.sub("", line).split("late by ")[0] for line in steady]
    known = [re.sub(r"(priority|memory): (granted|denied: .*)", r"\1", line) for line in lines]
    counted = [re.sub(r"(cycles|overruns|deadlines) \d+", r"\1", line) for line in known]
    return [line.rstrip() for line, _ in groupby(counted)]


@pytest.mark.cc
@pytest.mark.parametrize("kernel", ["freertos", "zephyr"])
@pytest.mark.parametrize("compiler", ["gcc", "clang"])
def test_recipes_for_kernels(
    kernel: str, compiler: str, folder: Path, require_tool: RequireTool
) -> None:
    """Against stand-ins of their calls, on a simulated clock, pressed at the times of plan.c."""
    for name, text in generate_machine(load(folder / "lamp.yaml")).files.items():
        (folder / name).write_text(text, encoding="utf-8")
    includes = [f"-I{path}" for path in (folder, RUNTIME, HOSTS, STANDINS, STANDINS / kernel)]
    sources = [STANDINS / "standin.c", STANDINS / "plan.c", STANDINS / kernel / f"{kernel}.c"]
    command = [require_tool(compiler), "-std=c99", *WARNINGS, f"-D{kernel.upper()}", *includes]
    command += [f"lamp_{kernel}.c", "lamp.c", "fsm.c", *map(str, sources), "-o", kernel]
    compiled = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    assert (compiled.returncode, compiled.stderr) == (0, "")
    done = subprocess.run([folder / kernel], capture_output=True, text=True, check=False)
    assert done.returncode == 0
    assert done.stdout.splitlines() == [
        *("0 off", "100 on", "130 on", "180 off"),
        *("400 on", "400 on", "430 on", "480 off"),
        *("1000 on", "1050 off", "1050 asleep for ever"),
    ]


@pytest.mark.cc
@pytest.mark.parametrize("compiler", ["gcc", "clang"])
def test_programs_without_a_warning(compiler: str, folder: Path, require_tool: RequireTool) -> None:
    for name, text in generate_machine(load(folder / "lamp.yaml")).files.items():
        (folder / name).write_text(text, encoding="utf-8")
    tickless = next(block[3] for block in BLOCK.finditer(PAGE) if "bool next" in (block[3] or ""))
    lines = files()["lamp_posix.c"].replace("int main", f"{tickless}\nint main")
    changed = "fsm_posix_tickless(&host, step, next, &machine)"
    lines = lines.replace("fsm_posix_periodic(&host, step, NULL)", changed)
    assert changed in lines
    (folder / "lamp_tickless.c").write_text(lines, encoding="utf-8")
    for program in ("lamp_posix.c", "lamp_tickless.c"):
        command = [require_tool(compiler), "-std=c99", *WARNINGS, f"-I{HOSTS}", "-c", program]
        subprocess.run(command, cwd=folder, check=True)
