"""Compiling hosts in the tests, for this computer and for boards."""

from __future__ import annotations

import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
RUNTIME = ROOT / "fsmkit/runtime/c"
HOSTS = RUNTIME / "hosts"
WARNINGS = ("-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Wshadow", "-Werror")

Build = Callable[..., Path]
Run = Callable[..., str]


@pytest.fixture(scope="session")
def build(require_tool: Callable[[str], str]) -> Build:
    """Compile with the strictest warnings, of which there must be none; return the result."""

    def compiled(folder: Path, compiler: str, *arguments: str | Path) -> Path:
        standard = [] if any(str(a).startswith("-std=") for a in arguments) else ["-std=c99"]
        if compiler.endswith("++"):
            standard = ["-x", "c++"]
        command = [
            require_tool(compiler),
            *standard,
            *WARNINGS,
            f"-I{folder}",
            f"-I{RUNTIME}",
            f"-I{HOSTS}",
        ]
        words = [*command, *map(str, arguments), "-o", "made"]
        done = subprocess.run(words, cwd=folder, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr
        assert not done.stderr
        return folder / "made"

    return compiled


@pytest.fixture(scope="session")
def run() -> Run:
    """Run a program, which must succeed, and return its output."""

    def output(*command: str | Path, seconds: int = 300) -> str:
        done = subprocess.run(
            [str(word) for word in command],
            capture_output=True,
            text=True,
            check=False,
            timeout=seconds,
        )
        assert done.returncode == 0, done.stdout[-2000:] + done.stderr[-2000:]
        return done.stdout

    return output
