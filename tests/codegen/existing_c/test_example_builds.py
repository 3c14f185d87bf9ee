"""The example of a charger is tested by its own tests, and built by its own CMake."""

from __future__ import annotations

import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from fsmkit.cli import execute
from tests.codegen.existing_c.test_charger import EXAMPLE, PRINTED

ROOT = Path(__file__).parents[3]


def test_its_tests_pass(capsys: pytest.CaptureFixture[str]) -> None:
    assert execute(["test", str(EXAMPLE / "charger.test.yaml")]) == 0
    assert "2 passed, 0 failed" in capsys.readouterr().out


@pytest.mark.slow
@pytest.mark.cc
@pytest.mark.external
def test_cmake_builds_it(
    tmp_path: Path, require_tool: Callable[[str], str], monkeypatch: pytest.MonkeyPatch
) -> None:
    cmake = require_tool("cmake")
    monkeypatch.setenv("PYTHONPATH", str(ROOT))
    folder = shutil.copytree(EXAMPLE, tmp_path / "charger")
    build = tmp_path / "build"
    for arguments in (
        ["-S", folder, "-B", build, f"-Dfsmkit_DIR={ROOT / 'fsmkit/runtime/c/cmake'}",
         f"-DFSMKIT_EXECUTABLE={Path(sys.executable).parent / 'fsmkit'}"],
        ["--build", build],
    ):  # fmt: skip
        done = subprocess.run(
            [cmake, *map(str, arguments)], capture_output=True, text=True, check=False
        )
        assert done.returncode == 0, done.stdout + done.stderr
    ran = subprocess.run([build / "charger"], capture_output=True, text=True, check=True)
    assert ran.stdout == PRINTED
