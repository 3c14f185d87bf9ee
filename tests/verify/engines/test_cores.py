"""Several cores find what one finds, to the last step of each path."""

from __future__ import annotations

import json
import subprocess
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest

from fsmkit.diagnostics import Findings
from fsmkit.system.system_file import load_system
from fsmkit.verify.engines.c import engine
from fsmkit.verify.engines.c.engine import CEngine
from fsmkit.verify.explore import ExplorationOptions, check
from fsmkit.verify.statespace.closed_system import ClosedSystem, close
from tests.verify.conftest import Load
from tests.verify.random_systems import random_system

pytestmark = pytest.mark.cc

TABLES = Path(__file__).parents[3] / "machines" / "philosophers"
OWN = {"bytes", "seconds", "cores", "dense"}
"""What may differ."""


def told(program: Path, cores: int, *more: str) -> dict[str, Any]:
    """Return what the explorer tells that takes layers of a state or more by states each."""
    asked = ["--cores", str(cores), "--share", "1,1", "--livelock", "--traps", *more]
    done = subprocess.run([program, *asked], capture_output=True, text=True, check=True)
    result = json.loads(done.stdout.splitlines()[-1])["result"]
    assert result["cores"] == cores
    return {name: value for name, value in result.items() if name not in OWN}


def same(closed: ClosedSystem) -> None:
    with closing(CEngine(closed, Findings())) as built:
        more = [*built.temporal_options(), *(["--until", "0"] if not closed.is_open else [])]
        alone = told(built.program, 1, *more)
        assert told(built.program, 2, *more) == alone
        assert told(built.program, 3, *more) == alone


@pytest.fixture(scope="module", autouse=True)
def not_optimised() -> Iterator[None]:
    """Compile fast: what is compiled is run three times only."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(engine, "FLAGS", tuple(f for f in engine.FLAGS if f != "-O2"))
        yield


@pytest.mark.parametrize("seed", range(1000, 1007))
@pytest.mark.parametrize("untimed", [False, True])
def test_random_systems_are_the_same_on_any_number_of_cores(
    load: Load, seed: int, untimed: bool
) -> None:
    same(close(load(**random_system(seed)), untimed=untimed))


@pytest.mark.parametrize("name", ["table", "ordered_table"])
@pytest.mark.parametrize("untimed", [False, True])
def test_philosophers_are_the_same_on_any_number_of_cores(name: str, untimed: bool) -> None:
    findings = Findings()
    same(close(load_system(TABLES / f"{name}.yaml", findings), untimed=untimed))


def test_what_is_asked_of_the_command_line_reaches_the_explorer() -> None:
    system = load_system(TABLES / "table.yaml", Findings())
    found = check(system, Findings(), options=ExplorationOptions("c", time="discrete", workers=2))
    assert found.exploration.cores == 1  # it is too small
