"""Decision diagrams in C against sets of bits, under sanitizers."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest

from tests.verify.core.test_core import COMPILERS, CORE, ROOT, STRICT

pytestmark = pytest.mark.cc


@pytest.fixture(scope="module")
def program(tmp_path_factory: pytest.TempPathFactory) -> Path:
    made = tmp_path_factory.mktemp("mdd") / "mdd_test"
    sources = [ROOT / "tests/c/mdd_test.c", CORE / "symbolic/mdd.c"]
    subprocess.run(
        [COMPILERS[0], *STRICT, "-fsanitize=address,undefined", "-fno-sanitize-recover=all",
         "-I", CORE, *sources, "-o", made],
        check=True,
    )  # fmt: skip
    return made


@pytest.mark.parametrize("every", [1, 64, 100000])
def test_operations_are_those_on_sets(program: Path, every: int) -> None:
    told = subprocess.run([program, str(every)], capture_output=True, text=True, check=False)
    assert told.returncode == 0, told.stdout + told.stderr
    compared, collections = map(int, told.stdout.split())
    assert compared == 3000
    assert (collections > 0) == (every < 100000)
