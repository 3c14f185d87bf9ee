"""The operations on zones in C, compared with their definitions, under sanitizers."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest

from tests.verify.core.test_core import COMPILERS, CORE, ROOT, STRICT

pytestmark = pytest.mark.cc


@pytest.fixture(scope="module")
def program(tmp_path_factory: pytest.TempPathFactory) -> Path:
    made = tmp_path_factory.mktemp("zones") / "zones_test"
    sources = [
        ROOT / "tests/c/zones_test.c",
        CORE / "zones/zones.c",
        CORE / "store/store.c",
        CORE / "store/region.c",
    ]
    subprocess.run(
        [COMPILERS[0], *STRICT, "-O2", "-fsanitize=address,undefined", "-fno-sanitize-recover=all",
         "-I", CORE, *sources, "-o", made],
        check=True,
    )  # fmt: skip
    return made


@pytest.mark.cc
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_operations_are_what_they_are_defined_as(program: Path, seed: int) -> None:
    done = subprocess.run([program, "6", str(seed)], capture_output=True, text=True, check=False)
    assert (done.stdout, done.stderr, done.returncode) == ("6\n", "", 0)
