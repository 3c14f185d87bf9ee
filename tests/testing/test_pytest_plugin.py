"""The plug-in of pytest, in runs of its own."""

from __future__ import annotations

import os
import subprocess
import sys
import tomllib
from importlib import import_module
from pathlib import Path

import pytest

from fsmkit.testing import pytest_plugin, reading
from fsmkit.testing.coverage import record
from tests.testing.test_suites import GATE, TESTS

ROOT = Path(__file__).parents[2]
PYTHON = """\
from fsmkit.testing import assert_in, calls

def test_it(machine):
    gate = machine("gate.yaml", {"weigh": lambda slot: 7})
    gate.post("request")
    gate.run()
    assert_in(gate, "opening")
    assert calls(gate) == (("motor", 1), ("weigh", 1))
    assert gate["weight"] == 7
"""


@pytest.fixture
def gate(tmp_path: Path) -> Path:
    (tmp_path / "gate.yaml").write_text(GATE)
    (tmp_path / "gate.test.yaml").write_text(TESTS)
    (tmp_path / "test_gate.py").write_text(PYTHON)
    return tmp_path


def run(folder: Path, *arguments: str) -> tuple[int, str]:
    environment = {
        **os.environ,
        "PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1",
        "PYTHONPATH": str(ROOT),
    }
    command = [
        sys.executable, "-m", "pytest", "-p", "fsmkit.testing.pytest_plugin", "-p", "xdist",
        "-p", "no:cacheprovider", *arguments,
    ]  # fmt: skip
    done = subprocess.run(
        command, cwd=folder, env=environment, capture_output=True, text=True, check=False
    )
    return done.returncode, done.stdout + done.stderr


@pytest.mark.cc
@pytest.mark.slow
def test_cases_and_coverage_of_two_processes(gate: Path) -> None:
    code, text = run(gate, "-n", "2", "--fsmkit-cov", "--fsmkit-cov-fail-under", "99")
    assert "5 passed" in text, text
    assert "Gate  states 5/5  transitions 6/9" in text
    assert "are covered, less than 99 %" in text
    assert code == 1
    assert (
        run(gate, "--fsmkit-cov", "--fsmkit-cov-append", "--fsmkit-target", "python", "-q")[0] == 0
    )
    assert len(list((gate / ".fsmkit-coverage").glob("*.json"))) >= 2


@pytest.mark.cc
def test_a_failed_case_has_no_traceback(gate: Path) -> None:
    (gate / "gate.yaml").write_text(GATE.replace("{3s: closing}", "{4s: closing}"))
    code, text = run(gate, "gate.test.yaml", "-q")
    assert code == 1
    assert "not in `closing`: active is open" in text
    assert "FAILED gate.test.yaml::opens and closes" in text
    assert "Traceback" not in text


@pytest.mark.cc
def test_a_broken_file_is_an_error_of_collecting(gate: Path) -> None:
    (gate / "gate.test.yaml").write_text(TESTS.replace("post request", "post requst"))
    code, text = run(gate, "gate.test.yaml", "-q")
    assert code == 2
    assert "there is no event `requst`" in text
    assert "Traceback" not in text


def test_it_means_the_same_files_and_folder() -> None:
    assert pytest_plugin.SUFFIXES == reading.SUFFIXES
    assert pytest_plugin.FOLDER == record.FOLDER


def test_the_entry_point_is_the_plug_in() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    module = import_module(project["entry-points"]["pytest11"]["fsmkit"])
    assert hasattr(module, "pytest_collect_file")
