"""Names longer than the string literals that each compiler of C99 takes."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path

import pytest

from fsmkit.cli import execute

STRICT = ("-std=c99", "-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Wshadow", "-Werror")
CHART = """\
<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" name="Long">
  <state id="{name}"><transition event="go" target="b"/></state>
  <state id="b"/>
</scxml>
"""
MAIN = """\
#include "wordy.h"
#include <stdio.h>
int main(void)
{
    printf("%s", wordy_state_name((wordy_state)1));
    return 0;
}
"""


@pytest.mark.cc
@pytest.mark.parametrize("options", [[], ["--optimize", "size"], ["--with", "trace,save"]])
@pytest.mark.parametrize("length", [4095, 4096, 5001])
def test_a_name_of_any_length_compiles(tmp_path: Path, length: int, options: list[str]) -> None:
    name = ("ö" + "x" * length)[: length - 1]  # two bytes and as many of one
    chart = tmp_path / "long.scxml"
    chart.write_text(CHART.format(name=name), encoding="utf-8")
    out = tmp_path / "generated"
    command = ["compile", str(chart), "--prefix", "wordy", "--out", str(out), *options]
    assert execute(command) == 0
    (out / "main.c").write_text(MAIN)
    sources = [path.name for path in out.glob("*.c") if "trace" not in path.name]
    compiler = os.environ.get("CC", "cc")
    subprocess.run([compiler, *STRICT, *sources, "-o", "long"], cwd=out, check=True)
    done = subprocess.run(["./long"], cwd=out, check=True, capture_output=True)
    assert done.stdout.decode() == name
