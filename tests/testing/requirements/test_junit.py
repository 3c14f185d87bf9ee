"""Results of other tests: what JUnit XML says of requirements, and files that do not."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from fsmkit.diagnostics import FsmkitError
from fsmkit.testing.requirements.junit import read_results

ROOT = Path(__file__).parents[3]
PYTHON = """\
import pytest

@pytest.mark.req("SAFE-1", "FUN-2")
@pytest.mark.parametrize("number", [1, 2])
def test_passes(number):
    pass

@pytest.mark.req("FUN-2")
class TestGate:
    @pytest.mark.req("FUN-3")
    def test_fails(self):
        assert False

    @pytest.mark.skip(reason="results of skipped tests are not traced")
    def test_is_skipped(self):
        pass

def test_of_nothing():
    pass
"""


@pytest.mark.cc
def test_the_plugin_of_pytest_writes_requirements(tmp_path: Path) -> None:
    (tmp_path / "test_gate.py").write_text(PYTHON)
    results = tmp_path / "results.xml"
    subprocess.run(
        [
            sys.executable, "-m", "pytest", "-q", "-p", "fsmkit.testing.pytest_plugin",
            "-p", "no:cacheprovider", "--strict-markers", f"--junitxml={results}", str(tmp_path),
        ],
        cwd=tmp_path,
        env={**os.environ, "PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1", "PYTHONPATH": str(ROOT)},
        capture_output=True,
        check=False,
    )  # fmt: skip
    found = [
        (one.name, [id_.value for id_ in one.req], one.passed) for one in read_results(results)
    ]
    assert found == [
        ("test_gate.test_passes[1]", ["SAFE-1", "FUN-2"], True),
        ("test_gate.test_passes[2]", ["SAFE-1", "FUN-2"], True),
        ("test_gate.TestGate.test_fails", ["FUN-3", "FUN-2"], False),
    ]


CASE = (
    '<testcase classname="a.b" name="c"><properties><property name="{}" value="{}"/></properties>'
    "{}</testcase>"
)


@pytest.mark.parametrize(
    ("name", "value", "more", "expected"),
    [
        ("req", "A", "", [("a.b.c", "A", True)]),
        ("req", "A", "<error/>", [("a.b.c", "A", False)]),
        ("req", "A", '<failure message="x">y</failure>', [("a.b.c", "A", False)]),
        ("req", " A&amp;B ", "", [("a.b.c", "A&B", True)]),
        ("req", " ", "", []),
        ("owner", "A", "", []),
        ("req", "A", "<skipped/>", []),
    ],
)
@pytest.mark.parametrize("depth", [1, 50])
def test_results_of_other_runners(
    tmp_path: Path,
    depth: int,
    name: str,
    value: str,
    more: str,
    expected: list[tuple[str, str, bool]],
) -> None:
    path = tmp_path / "results.xml"
    suites = "<testsuite>" * depth, "</testsuite>" * depth
    path.write_text(CASE.format(name, value, more).join(suites))
    found = [(one.name, one.req[0].value, one.passed) for one in read_results(path)]
    assert found == expected


@pytest.mark.parametrize(
    "content",
    [
        "",
        "no xml",
        "<html/>",
        "<testsuite>",
        '<!DOCTYPE a [<!ENTITY b "c">]><testsuite>&b;</testsuite>',
        "<testsuite>\xff</testsuite>".encode("latin-1"),
        f"{'<testsuite>' * 100_000}",
    ],
)
def test_other_files_are_no_results(tmp_path: Path, content: str | bytes) -> None:
    path = tmp_path / "results.xml"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    with pytest.raises(FsmkitError) as caught:
        read_results(path)
    (found,) = caught.value.diagnostics
    assert found.rule.name == "broken-tests"
