"""Runs in dense time against runs in discrete time: `recoverable` and `leads_to` by zones."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterator
from contextlib import closing
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st

from fsmkit.diagnostics import Findings
from fsmkit.verify import engine as c_engine
from fsmkit.verify.closed import close
from fsmkit.verify.engine import CEngine, compiler
from fsmkit.verify.exploration import End
from fsmkit.verify.explore import Limits, Manner, check
from fsmkit.verify.replay import load_any
from fsmkit.verify.system import System, temporal_properties
from fsmkit.verify.verdict import Result
from tests.verify.timed_systems import systems

pytestmark = pytest.mark.skipif(compiler() is None, reason="there is no C compiler")

EXAMPLES = int(os.environ.get("FSMKIT_TIMED_EXAMPLES", "6"))
"""Random systems tried; each takes seconds to compile."""
PARTS = 8
"""The unit of time divided by that: so fine that clocks of four timers can be told apart."""
MOST = 400_000
"""States in discrete time beyond which a system is passed over."""


@pytest.fixture(autouse=True, scope="module")
def _own_cache(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """Compile quickly, into a cache of one's own."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_CACHE_HOME", str(tmp_path_factory.mktemp("cache")))
        patch.setattr(c_engine, "FLAGS", ("-O0", *(f for f in c_engine.FLAGS if f != "-O2")))
        yield


ASKED = """
  r0: {recoverable: a.In(s0)}
  r1: {recoverable: a.In(s1) and a.n == 1}
  l0: {leads_to: [a.In(s0), a.In(s1)]}
  l1: {leads_to: [a.In(s1), a.In(s0)]}
  l2: {leads_to: [a.n == 0, a.n == 1]}
  l3: {leads_to: [a.n == 1, a.n == 0 or a.n == 2]}
"""
ASKED_OF_TWO = """
  r2: {recoverable: a.In(s1) and b.In(s1)}
  r3: {recoverable: a.In(s0) and b.In(s0) and a.n == 0}
  l4: {leads_to: [a.In(s1), b.In(s1)]}
  l5: {leads_to: [a.In(s0) and b.In(s0), a.In(s1) and b.In(s0)]}
"""


@st.composite
def asking(draw: st.DrawFn) -> dict[str, str]:
    """Draw a system that is asked for runs; some of its events are owed."""
    files = draw(systems())
    lines = files["system"].splitlines()
    number = next(n for n, line in enumerate(lines) if line.startswith("environment:"))
    may, will = (part.split("]")[0].split(", ") for part in lines[number].split("[")[1:])
    owed = [event for event in may if draw(st.booleans())]
    free = [event for event in may if event not in owed]
    owed += [name for name in will if name]
    lines[number] = f"environment: {{may: [{', '.join(free)}], will: [{', '.join(owed)}]}}"
    asked = ASKED + (ASKED_OF_TWO if "b" in files else "")
    return files | {"system": "\n".join(lines) + asked}


def written(files: dict[str, str]) -> System:
    with tempfile.TemporaryDirectory() as folder:
        paths = [Path(folder) / f"{name}.yaml" for name in files]
        for path, text in zip(paths, files.values(), strict=True):
            path.write_text(text, encoding="utf-8")
        return load_any(paths[0], Findings())


def by_units(system: System) -> dict[str, str]:
    """Return the verdicts in discrete time, with a unit that is fine enough."""
    closed = close(system)
    with closing(CEngine(replace(closed, unit=closed.unit // PARTS), Findings())) as engine:
        found = engine.explore(1 << 30, 20, None)
    assume(found.end is End.COMPLETE and found.states < MOST)
    names = [p.name for p in system.properties]
    numbers = temporal_properties(system.properties)
    assert all(found.answer(n).known for n in numbers)
    return {names[n]: "violated" if found.answer(n).violated else "holds" for n in numbers}


def by_zones(system: System) -> dict[str, Result]:
    """Return what is found in dense time."""
    manner = Manner("c", limits=Limits(1 << 30, 60), zones=True)
    report = check(system, Findings(), manner=manner)
    assert report.exploration.end is End.COMPLETE
    return {result.name: result for result in report.results}


def performed(result: Result) -> None:
    """A violation is shown, and runs in the interpreter and in generated C."""
    assert result.trace is not None
    assert result.trace.differs == ""
    assert result.trace.replayed == ("interpreter", "generated C")
    times = [step.at for step in result.trace.steps if step.at is not None]
    assert times == sorted(times)


@settings(
    max_examples=EXAMPLES,
    deadline=None,
    derandomize=True,
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.filter_too_much],
)
@given(files=asking())
def test_verdicts_are_those_of_discrete_time(files: dict[str, str]) -> None:
    system = written(files)
    assume(close(system).unit > 0)
    expected = by_units(system)
    found = by_zones(system)
    for name, verdict in expected.items():
        result = found[name]
        if result.verdict.value == "undecided":
            assert "depends on" in result.reason
            continue
        assert result.verdict.value == verdict, name
        if verdict == "violated":
            performed(result)
