"""Code for size: tables, and functions that read them."""

from __future__ import annotations

import subprocess
from collections.abc import Callable, Mapping
from pathlib import Path

import pytest

from fsmkit.chart.loading import load
from fsmkit.codegen.c.generate import generate_machine
from fsmkit.codegen.c.options import Options
from fsmkit.codegen.c.plugin import PLUGIN
from fsmkit.diagnostics import Findings, FsmkitError

DEEP = """
chart: Deep
events: {in: [off, next, back, all]}
data: {n: uint32 = 0}
initial: out
states:
  out: {on: {next: work, back: h}}
  work:
    entry: n += 1
    exit: n += 10
    on: {off: out}
    regions:
      h: {history: deep, initial: [l1, r1]}
      left:
        states:
          l1: {on: {next: l2}}
          l2: {on: {next: l1, all: {if: n > 5, target: l1}}, exit: n += 100}
      right:
        states:
          r1: {on: {next: r2, all: r2}}
          r2: {on: {next: r1}}
"""

Write = Callable[[Path, Mapping[str, str]], Path]
Compile = Callable[..., subprocess.CompletedProcess[str]]


def written(tmp_path: Path) -> Path:
    path = tmp_path / "deep.yaml"
    path.write_text(DEEP)
    return path


@pytest.mark.cc
@pytest.mark.parametrize("compiler", ["gcc", "clang", "g++"])
def test_small_code_compiles_without_a_warning(
    tmp_path: Path, compiler: str, compile_with: Compile, write: Write
) -> None:
    machine = generate_machine(load(written(tmp_path)), None, Options(is_small=True))
    write(tmp_path, machine.files)
    compile_with(tmp_path, compiler, "-c", "deep.c")


@pytest.mark.cc
def test_it_is_smaller(tmp_path: Path, compile_with: Compile, write: Write) -> None:
    sizes = {}
    chart = load(Path(__file__).parents[3] / "machines/production_cell/feeder.yaml")
    aims = {"": Options(), "size": Options(is_small=True)}
    for aim, options in aims.items():
        folder = tmp_path / f"for {aim}"
        folder.mkdir()
        write(folder, generate_machine(chart, None, options).files)
        compile_with(folder, "gcc", "-Os", "-DFSM_NO_NAMES", "-c", "feeder.c")
        told = subprocess.run(
            ["size", "feeder.o"], cwd=folder, capture_output=True, text=True, check=True
        ).stdout
        text, data = told.splitlines()[1].split()[:2]
        sizes[aim] = int(text) + int(data)
    assert sizes["size"] < sizes[""]


def test_an_unknown_aim_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(FsmkitError) as caught:
        PLUGIN.generate(load(written(tmp_path)), Findings(), {"optimize": "speed"})
    assert "`speed`" in str(caught.value)
