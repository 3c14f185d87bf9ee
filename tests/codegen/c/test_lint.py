"""Linters report nothing in generated C but the deviations that the reference justifies."""

from __future__ import annotations

import re
import subprocess
from collections.abc import Callable, Mapping
from pathlib import Path

import pytest

from tests.codegen.c.conftest import EVERY, ROOT, machine_of

PAGE = (ROOT / "docs/reference/analysis.md").read_text(encoding="utf-8")
DEVIATIONS = frozenset(re.findall(r"^\| (\d+\.\d+) \| \S", PAGE, re.MULTILINE))
SWITCHED_OFF = re.findall(r"^\| `((?:bugprone|cert|clang)-[\w.-]+)` \| \w", PAGE, re.MULTILINE)

BRACES = "readability-braces-around-statements"
"""MISRA C:2012 rule 15.6: the body of a choice or of a loop is a compound statement."""

Write = Callable[[Path, Mapping[str, str]], Path]
RequireTool = Callable[[str], str]


@pytest.fixture(scope="module")
def sources(tmp_path_factory: pytest.TempPathFactory, write: Write) -> tuple[Path, list[str]]:
    """Give a folder with the machines of all charts, and the names of their sources."""
    folder = tmp_path_factory.mktemp("lint")
    for name in EVERY:
        write(folder, machine_of(name).files)
    return folder, sorted(path.name for path in folder.glob("*.c"))


@pytest.mark.slow
@pytest.mark.external
def test_cppcheck_and_misra(sources: tuple[Path, list[str]], require_tool: RequireTool) -> None:
    folder, names = sources
    command = [require_tool("cppcheck"), "-q", "-j2", "--addon=misra", "--std=c99", "-UFSM_HOOKS"]
    command += ["--enable=warning,performance,portability", "--template={id} {file}:{line}"]
    done = subprocess.run(
        [*command, *names], cwd=folder, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr
    found = set(done.stderr.splitlines())
    misra = {line for line in found if line.startswith("misra-c2012-")}
    assert sorted(found - misra) == []
    rules = set(map(_rule, misra))
    assert {line for line in misra if _rule(line) not in DEVIATIONS} == set()
    assert DEVIATIONS - rules == set(), "no deviation any more: take it from the list"


def _rule(line: str) -> str:
    return line.split(maxsplit=1)[0].removeprefix("misra-c2012-")


@pytest.mark.slow
@pytest.mark.external
def test_clang_tidy(sources: tuple[Path, list[str]], require_tool: RequireTool) -> None:
    folder, names = sources
    assert SWITCHED_OFF
    checks = ",".join(
        [
            "-*",
            "bugprone-*",
            "cert-*",
            "clang-analyzer-*",
            BRACES,
            *(f"-{name}" for name in SWITCHED_OFF),
        ]
    )
    command = [require_tool("clang-tidy"), "--quiet", f"-checks={checks}", *names]
    done = subprocess.run(
        [*command, "--", "-std=c99"], cwd=folder, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stdout
    assert done.stdout == ""


@pytest.mark.slow
@pytest.mark.cc
def test_gcc_analyzer(sources: tuple[Path, list[str]], require_tool: RequireTool) -> None:
    folder, names = sources
    command = [require_tool("gcc"), "-std=c99", "-O1", "-fanalyzer", "-Werror", "-c", *names]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")


@pytest.mark.cc
@pytest.mark.parametrize("compiler", ["g++", "clang++"])
def test_cpp17(compiler: str, sources: tuple[Path, list[str]], require_tool: RequireTool) -> None:
    folder, names = sources
    warnings = ("-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Wshadow", "-Werror")
    command = [require_tool(compiler), "-x", "c++", "-std=c++17", *warnings, "-fsyntax-only"]
    done = subprocess.run(
        [*command, *names], cwd=folder, capture_output=True, text=True, check=False
    )
    assert (done.returncode, done.stderr) == (0, "")
