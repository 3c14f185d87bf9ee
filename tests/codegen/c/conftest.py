"""Compiling generated C in the tests."""

from __future__ import annotations

import os
import subprocess
from collections.abc import Callable, Mapping
from functools import cache
from pathlib import Path

import pytest

from fsmkit.chart.loading import load
from fsmkit.codegen.c.generate import Machine, generate_machine

ROOT = Path(__file__).parents[3]
CELL = ROOT / "machines/production_cell"
HERE = Path(__file__).parent
CHARTS = {
    **{p.stem: p for p in sorted(CELL.glob("*.yaml")) if "\nsystem:" not in f"\n{p.read_text()}"},
    "camera": CELL / "camera.scxml",
    **{p.stem: p for p in sorted((HERE / "charts").glob("*.yaml"))},
    "shop": ROOT / "tests/golden/shop.yaml",
    **{
        f"chart_{p.stem.lower()}": p
        for p in sorted((ROOT / "benchmarks/yardstick").glob("*.scxml"))
    },
}
"""The charts whose C is examined: the production cell, the yardstick of the benchmarks, and charts
with the rest of the language."""
SOME = ("feeder", "plant", "apart", "kinds", "shop")
EVERY = tuple(CHARTS) if os.environ.get("FSMKIT_PROVE") else SOME
"""For what takes long: the others with `make prove`."""
WARNINGS = ("-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Wshadow", "-Werror")
SANITIZERS = ("-fsanitize=address,undefined", "-fno-sanitize-recover=all", "-g")

Compile = Callable[..., subprocess.CompletedProcess[str]]


@pytest.fixture(scope="session")
def compile_with(require_tool: Callable[[str], str]) -> Compile:
    """Run a compiler in a folder with the strictest warnings; it must say nothing."""

    def run(folder: Path, compiler: str, *arguments: str) -> subprocess.CompletedProcess[str]:
        standard = ("-x", "c++") if compiler.endswith("++") else ("-std=c99",)
        done = subprocess.run(
            [require_tool(compiler), *standard, *WARNINGS, *arguments],
            cwd=folder,
            capture_output=True,
            text=True,
            check=False,
        )
        assert done.returncode == 0, done.stderr
        assert not done.stderr
        return done

    return run


@pytest.fixture(scope="session")
def write() -> Callable[[Path, Mapping[str, str]], Path]:
    """Write texts by file name into a folder and return it."""

    def files(folder: Path, texts: Mapping[str, str]) -> Path:
        folder.mkdir(parents=True, exist_ok=True)
        for name, text in texts.items():
            (folder / name).write_text(text, encoding="utf-8")
        return folder

    return files


@cache
def machine_of(name: str) -> Machine:
    """Return the machine of one of `CHARTS`."""
    return generate_machine(load(CHARTS[name]), name)
