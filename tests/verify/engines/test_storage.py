"""Hash compaction and bitstate: what they find is real, and what they may miss is told."""

from __future__ import annotations

import json
import math
import subprocess
from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import fsmkit
from fsmkit.cli import execute
from fsmkit.diagnostics import Findings, FsmkitError
from fsmkit.system.system import System
from fsmkit.system.system_file import load_system
from fsmkit.verify.bounds import prove_bounds
from fsmkit.verify.engines.c.engine import CEngine, compiler
from fsmkit.verify.explore import ExplorationOptions, check
from fsmkit.verify.report.verdict import Report, Verdict
from fsmkit.verify.statespace.closed_system import ClosedSystem, close
from fsmkit.verify.statespace.exploration import End, Exploration
from fsmkit.verify.statespace.storage import (
    NEEDS_EXACT,
    LossyTable,
    Storage,
    expected_omissions,
    omission_probability,
    read_storage,
)
from fsmkit.verify.testgen.cover import cover
from tests.machines.test_philosophers import sized
from tests.verify.conftest import Load
from tests.verify.core.test_core import CORE, ROOT, STRICT
from tests.verify.engines.test_cores import told
from tests.verify.random_systems import random_system
from tests.verify.systems import SYSTEMS

pytestmark = [pytest.mark.cc, pytest.mark.usefixtures("own_cache", "quickly_compiled")]

TABLES = ROOT / "machines/philosophers"
LOSSY = [Storage.HASH_COMPACT, Storage.BITSTATE]
AMPLE: dict[str, Any] = {"memory": 32 << 20, "timeout": 60}


@pytest.fixture
def tables_of(monkeypatch: pytest.MonkeyPatch) -> Callable[[int], None]:
    """Give lossy tables so many bytes, however much memory there is."""

    def resize(size: int) -> None:
        asked = CEngine.result

        def result(self: CEngine, command: list[str], progress: Any) -> Any:
            names = {storage.value for storage in LOSSY}
            sized = [f"{word},{size}" if word in names else word for word in command]
            return asked(self, sized, progress)

        monkeypatch.setattr(CEngine, "result", result)

    return resize


def philosophers(name: str = "table") -> System:
    return load_system(TABLES / f"{name}.yaml", Findings())


def five(folder: Path, name: str = "ordered_table") -> System:
    """Return a table for five: some thousands of states."""
    return load_system(sized(f"{name}.yaml", 5, folder), Findings())


def checked(system: System, storage: Storage, **options: Any) -> Report:
    return check(
        system,
        Findings(),
        options=ExplorationOptions("c", time="discrete", storage=storage, **{**AMPLE, **options}),
    )


# --- the table -----------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def alone(tmp_path_factory: pytest.TempPathFactory) -> Path:
    program = tmp_path_factory.mktemp("lossy") / "lossy"
    command = compiler()
    assert command is not None
    sources = [
        ROOT / "tests/c/explorer_lossy.c",
        CORE / "store/hash_compaction.c",
        CORE / "store/region.c",
    ]
    sanitized = ["-fsanitize=address,undefined", "-fno-sanitize-recover=all"]
    subprocess.run([command, *STRICT, *sanitized, "-I", CORE, *sources, "-o", program], check=True)
    return program


@pytest.mark.cc
@settings(max_examples=40, deadline=None)
@given(
    st.sampled_from(LOSSY),
    st.integers(2048, 1 << 18),
    st.floats(0.05, 1.2),
    st.integers(1000, 300_000),
)
def test_a_table_misses_what_it_says(
    alone: Path, storage: Storage, size: int, load: float, probes: int
) -> None:
    states = int(load * size / 3)
    asked = [alone, storage.value, str(size), str(states), str(probes)]
    said = subprocess.run(asked, capture_output=True, text=True, check=True).stdout
    added, known, lines, matched, counted, *filled = map(int, said.split())
    assert counted
    lines_in_all = max(1, size // 64 // 32) * 32
    assert lines * 32 == lines_in_all
    bits = storage is Storage.BITSTATE
    room = lines * 512 if bits else lines
    share = [(count / room) ** 3 if bits else count / room / 2**24 for count in filled]
    match = sum(share) / len(share)
    found = LossyTable(storage, tuple(filled), room, lines_in_all * 64)
    assert math.isclose(found.match_probability, match, rel_tol=1e-12)
    assert abs(matched - match * probes) <= 6 * math.sqrt(match * probes) + 6
    if bits:
        assert known == states  # what was put stays known
        assert sum(filled) <= 3 * added
        mean = lines_in_all * 512 * -math.expm1(-3 * added / (lines_in_all * 512))
        assert abs(sum(filled) - mean) <= 6 * math.sqrt(3 * added) + 0.02 * mean
    else:
        assert sum(filled) >= added
        assert known == states or added >= 0.3 * lines_in_all * 21  # or it was full
        if max(filled) < 21:
            assert sum(filled) == added
    missed = states - added if known == states else 0
    bound = expected_omissions(match, states)
    assert missed <= bound + 6 * math.sqrt(bound) + 6


def test_the_formulas() -> None:
    half = LossyTable(Storage.BITSTATE, (512,) * 32, 1024, 4096)
    assert half.match_probability == 1 / 8
    uneven = LossyTable(Storage.BITSTATE, (0, 1024), 1024, 4096)
    assert uneven.match_probability == 1 / 2  # a part that is full takes all for known
    lines = LossyTable(Storage.HASH_COMPACT, (20, 12), 8, 4096)
    assert lines.match_probability == 2 / 2**24
    assert expected_omissions(0.5, 10) == 10
    assert expected_omissions(1, 10) == math.inf
    assert omission_probability(1e-6, 8) == pytest.approx(1e-5)
    assert omission_probability(0.5, 8) == 1


# --- the same as exact, with ample memory --------------------------------------------------------


def facts(found: Exploration) -> dict[str, object]:
    return {
        "end": found.end,
        "states": found.states,
        "transitions": found.transitions,
        "depth": found.depth,
        "marks": [(mark.number, mark.count, mark.path) for mark in found.marks],
        "machines": found.machines,
    }


def agree(closed: ClosedSystem) -> None:
    with closing(CEngine(closed, Findings())) as built:
        exact = built.explore(AMPLE["memory"], 60, None, sleeps=False)
        assert exact.table is None
        for storage in LOSSY:
            found = built.explore(AMPLE["memory"], 60, None, storage=storage)
            assert facts(found) == facts(exact)
            assert found.table is not None
            assert found.table.bytes == 24 << 20
            assert found.livelock is None
            assert not found.livelock_known
            assert not found.traps_known
            assert not any(answer.known for answer in found.temporal)


@pytest.mark.cc
@pytest.mark.parametrize("seed", [1000, 1001, 1002, 1003, 1004])
@pytest.mark.parametrize("untimed", [False, True])
def test_with_ample_memory_the_same_is_found(load: Load, seed: int, untimed: bool) -> None:
    agree(close(load(**random_system(seed)), untimed=untimed))


@pytest.mark.cc
@pytest.mark.parametrize("name", ["livelock", "drive"])
def test_with_ample_memory_the_same_is_found_in_others(load: Load, name: str) -> None:
    agree(close(load(**SYSTEMS[name])))


@pytest.mark.cc
@pytest.mark.parametrize("storage", LOSSY)
def test_a_violation_is_real_and_as_near(storage: Storage) -> None:
    exact, found = checked(philosophers(), Storage.EXACT), checked(philosophers(), storage)
    paths = [
        next(result.trace for result in report.results if result.name == "D")
        for report in (exact, found)
    ]
    assert all(path is not None and len(path.replayed) == 2 for path in paths)
    assert len({len(path.steps) for path in paths if path is not None}) == 1
    assert found.verdict is Verdict.VIOLATED


# --- what is told --------------------------------------------------------------------------------


@pytest.mark.cc
@pytest.mark.parametrize("storage", LOSSY)
@pytest.mark.parametrize("size", [64, 2048, 1 << 20])
def test_what_was_not_found_is_undecided_and_its_risk_told(
    tables_of: Callable[[int], None], storage: Storage, size: int
) -> None:
    tables_of(size)
    exact = checked(philosophers("ordered_table"), Storage.EXACT)
    assert exact.verdict is Verdict.HOLDS
    report = checked(philosophers("ordered_table"), storage)
    found = report.exploration
    assert found.end is End.COMPLETE
    assert found.table is not None
    assert found.table.bytes == max(size, 2048)
    missing = exact.exploration.states - found.states
    assert missing >= 0
    assert {result.verdict for result in report.results} == {Verdict.UNDECIDED}
    assert report.verdict is Verdict.UNDECIDED
    share = [
        (n / found.table.room) ** 3 if storage is Storage.BITSTATE else n / found.table.room / 2**24
        for n in found.table.filled
    ]
    risk = f"{min(1.0, (found.depth + 2) * sum(share) / 32):.2g}"
    for result in report.results:
        nothing = f"nothing found in {found.states:,} states, but {storage.value} storage misses"
        nothing += f" any one state with probability at most {risk}"
        assert result.reason == (NEEDS_EXACT if result.name == "livelock" else nothing)
    rules = {finding.rule.name for finding in report.findings}
    assert rules == {"undecided"}


@pytest.mark.cc
def test_bitstate_in_a_tiny_table_misses_states_and_says_so(
    tables_of: Callable[[int], None], tmp_path: Path
) -> None:
    tables_of(2048)  # of 16,384 bits
    exact = checked(five(tmp_path), Storage.EXACT)
    assert exact.verdict is Verdict.HOLDS
    report = checked(five(tmp_path), Storage.BITSTATE)
    found, table = report.exploration, report.exploration.table
    assert found.end is End.COMPLETE
    assert 500 < found.states < exact.exploration.states
    assert table is not None
    match = table.match_probability
    assert omission_probability(match, found.depth) > 0.1
    assert expected_omissions(match, found.states) > 1
    assert {result.verdict for result in report.results} == {Verdict.UNDECIDED}
    assert report.verdict is Verdict.UNDECIDED


@pytest.mark.cc
def test_hash_compaction_ends_where_its_table_is_full(
    tables_of: Callable[[int], None], tmp_path: Path
) -> None:
    tables_of(2048)
    report = checked(five(tmp_path), Storage.HASH_COMPACT)
    assert report.exploration.end is End.MEMORY
    assert report.exploration.states <= 32 * 19
    assert report.verdict is Verdict.UNDECIDED
    reasons = [result.reason for result in report.results]
    assert all(reason.startswith("the memory limit was reached") for reason in reasons)


@pytest.mark.cc
@pytest.mark.parametrize("storage", LOSSY)
def test_several_cores_find_the_same_with_ample_memory(tmp_path: Path, storage: Storage) -> None:
    with closing(CEngine(close(five(tmp_path), untimed=True), Findings())) as built:
        exact = told(built.program, 1, "--sleepless")
        for cores in (1, 2, 3):
            found = told(built.program, cores, "--storage", f"{storage.value},{1 << 22}")
            assert found.pop("table")["bytes"] == 1 << 22
            assert found | {"traps_known": True, "livelock_known": True} == exact


@pytest.mark.cc
@pytest.mark.parametrize("cores", [1, 2, 3])
def test_several_cores_may_miss_others_but_no_more(tmp_path: Path, cores: int) -> None:
    with closing(CEngine(close(five(tmp_path), untimed=True), Findings())) as built:
        exact = told(built.program, 1, "--sleepless")
        found = told(built.program, cores, "--storage", "bitstate,16384")
    table = LossyTable(Storage.BITSTATE, tuple(found["table"]["filled"]), 4096, 16384)
    assert found["table"]["room"] == table.room
    assert found["outcome"] == "complete"
    assert found["states"] == found["expanded"] < exact["states"]
    assert found["states"] > 0.9 * exact["states"]
    assert max(table.filled) < 4096 / 2
    assert 3 * found["states"] * 0.8 < sum(table.filled) < 3 * found["states"]
    assert 0.001 < table.match_probability < 0.1


LASTING = """
system: Lasting
machines: {lamp: lamp.yaml}
environment: {will: [lamp.press]}
properties:
  back: {recoverable: lamp.In(off)}
  lit: {leads_to: [lamp.In(off), lamp.In(on)]}
  seen: {reachable: lamp.In(on)}
  free: livelock_free
"""
LAMP = """
chart: Lamp
events: {in: [press, never]}
initial: off
states:
  off: {on: {press: on}}
  on: {on: {press: off, never: broken}}
  broken: {rest: true}
"""


@pytest.mark.cc
@pytest.mark.parametrize("storage", LOSSY)
def test_what_needs_the_whole_graph_needs_exact_storage(load: Load, storage: Storage) -> None:
    report = checked(load(system=LASTING, lamp=LAMP), storage)
    verdicts = {result.name: (result.verdict, result.reason) for result in report.results}
    for name in ("back", "lit", "free"):
        assert verdicts[name] == (Verdict.UNDECIDED, NEEDS_EXACT)
    assert verdicts["seen"] == (Verdict.HOLDS, "")
    rules = {finding.rule.name for finding in report.findings}
    assert not rules & {"never-entered", "never-taken"}
    exact = checked(load(system=LASTING, lamp=LAMP), Storage.EXACT)
    assert {"never-entered"} <= {finding.rule.name for finding in exact.findings}


@pytest.mark.cc
def test_only_what_was_found_can_hold(load: Load) -> None:
    options = ExplorationOptions("c", time="discrete", **AMPLE, storage=Storage.BITSTATE)
    system = load(system=LASTING, lamp=LAMP)
    report = check(system, Findings(), options=options, properties=frozenset({"seen"}))
    assert report.verdict is Verdict.HOLDS


@pytest.mark.cc
def test_a_suite_that_may_lack_something_says_so(load: Load) -> None:
    report = checked(load(system=LASTING, lamp=LAMP), Storage.BITSTATE, covers=True)
    missed = cover(report).uncovered
    assert missed
    assert {item.reason for item in missed} == {"not seen, but bitstate storage may miss states"}


@pytest.mark.cc
def test_bounds_are_not_proved_by_it(load: Load) -> None:
    options = ExplorationOptions("c", time="discrete", **AMPLE, storage=Storage.HASH_COMPACT)
    with pytest.raises(FsmkitError) as raised:
        prove_bounds(load(system=LASTING, lamp=LAMP), Findings(), options)
    assert "hash-compact storage may miss states" in str(raised.value)


@pytest.mark.cc
def test_the_command_line_tells_all_of_it(capsys: pytest.CaptureFixture[str]) -> None:
    words = ["check", str(TABLES / "ordered_table.yaml"), "--memory", "32M"]
    assert execute([*words, "--storage", "bitstate"]) == 1
    assert "bitstate storage, a table of 25,165,824 bytes" in " ".join(
        capsys.readouterr().out.split()
    )
    assert execute([*words, "--storage", "bitstate", "--workers", "2", "--json"]) == 1
    document = json.loads(capsys.readouterr().out)
    assert document["exact"] is document["complete"] is False
    stored = document["storage"]
    report = checked(philosophers("ordered_table"), Storage.BITSTATE)
    table = report.exploration.table
    assert table is not None
    match = math.fsum((n / table.room) ** 3 for n in table.filled) / 32
    assert stored["kind"] == "bitstate"
    assert stored["bytes"] == 24 << 20
    assert stored["match_probability"] == pytest.approx(match)
    assert stored["expected_omissions"] == pytest.approx(document["states"] * match / (1 - match))
    assert stored["omission_probability"] == pytest.approx((document["depth"] + 2) * match)
    assert execute([*words, "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert (document["exact"], document["storage"]) == (True, {"kind": "exact"})


# --- refused -------------------------------------------------------------------------------------


def refused(*words: str, capsys: pytest.CaptureFixture[str]) -> str:
    assert execute(["check", *words]) == 1
    said = capsys.readouterr().err
    assert "no-such-storage" in said
    return " ".join(said.split())


def test_it_is_for_the_engine_in_c_without_zones(capsys: pytest.CaptureFixture[str]) -> None:
    zones = refused(
        str(ROOT / "machines/fischer/fischer.yaml"), "--storage", "bitstate", capsys=capsys
    )
    assert "zones are kept exactly" in zones
    assert "--time discrete" in zones
    file = str(TABLES / "table.yaml")
    python = refused(file, "--storage", "hash-compact", "--engine", "python", capsys=capsys)
    assert "use the engine in C" in python


def test_a_storage_that_there_is_not() -> None:
    with pytest.raises(FsmkitError) as raised:
        fsmkit.check(TABLES / "table.yaml", storage="supertrace")
    assert "use one of exact, hash-compact, bitstate" in str(raised.value)
    assert read_storage("bitstate") is Storage.BITSTATE


@pytest.mark.cc
def test_the_python_interface_has_it() -> None:
    found = fsmkit.check(TABLES / "table.yaml", storage="bitstate", memory=32 << 20)
    assert found.exploration.table is not None
    assert found.verdict is fsmkit.Verdict.VIOLATED


@pytest.mark.parametrize("storage", LOSSY)
def test_another_seed_misses_others(
    storage: Storage, tmp_path: Path, tables_of: Callable[[int], None]
) -> None:
    system = five(tmp_path)
    whole = checked(system, Storage.EXACT).exploration.states
    tables_of(1 << 10 if storage is Storage.BITSTATE else 1 << 14)
    counts = [checked(system, storage, seed=seed).exploration.states for seed in (0, 1, 2, 3, 3)]
    assert max(counts) <= whole
    assert counts[3] == counts[4]
    if storage is Storage.BITSTATE:
        assert len(set(counts)) > 1
