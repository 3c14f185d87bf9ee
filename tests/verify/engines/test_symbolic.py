"""States as a decision diagram: all that is found is what the explicit search finds."""

from __future__ import annotations

import json
import subprocess
from collections.abc import Callable, Iterator, Mapping
from contextlib import closing
from pathlib import Path
from random import Random
from typing import Any

import pytest

from benchmarks.explorer.__main__ import MODELS, build_fsmkit
from fsmkit.cli import execute
from fsmkit.diagnostics import Findings, FsmkitError
from fsmkit.system.properties.property import AtStates
from fsmkit.system.system import System
from fsmkit.system.system_file import load_system
from fsmkit.verify.engines.c.cache import ORDER
from fsmkit.verify.engines.c.engine import CEngine
from fsmkit.verify.engines.c.splitting import parts_of
from fsmkit.verify.explore import ExplorationOptions, check
from fsmkit.verify.report.figures import count_in_json, count_text
from fsmkit.verify.report.verdict import Report, Verdict
from fsmkit.verify.statespace.closed_system import UNLIMITED, ClosedSystem, close
from fsmkit.verify.statespace.exploration import DEADLOCK, End, Exploration
from fsmkit.verify.statespace.symbolic_search import Search, read_search
from tests.machines.test_philosophers import sized
from tests.verify.random_systems import (
    load_files,
    random_deferring,
    random_open_chart,
    random_system,
)
from tests.verify.systems import SYSTEMS

pytestmark = [pytest.mark.cc, pytest.mark.usefixtures("own_cache", "quickly_compiled")]

MEMORY = 1 << 28


def evaluated_at_states(closed: ClosedSystem) -> Callable[[int], bool]:
    """Return whether a mark is one that a diagram is asked for."""
    properties = closed.system.properties
    marks = range(1, 1 + len(properties) + sum(p.goal is not None for p in properties))
    asked = {1 + n for n, p in enumerate(properties) if isinstance(p.kind.decided, AtStates)}
    return lambda mark: mark not in marks or mark in asked


def seen(closed: ClosedSystem, found: Exploration) -> dict[str, Any]:
    """Return all of a result that does not depend on how it was found."""
    is_asked = evaluated_at_states(closed)
    return {
        "end": found.end,
        "states": found.states,
        "transitions": found.transitions,
        "marks": sorted(mark.number for mark in found.marks if is_asked(mark.number)),
        "deadlocks": [mark.count for mark in found.marks if mark.number == DEADLOCK],
        "livelock": (found.livelock_known, found.livelock is not None),
        "traps": (found.traps_known, len(found.traps)),
        "machines": [
            (m.queue, m.timers, m.microsteps, m.states, m.transitions) for m in found.machines
        ],
    }


def same(system: System, *, untimed: bool, orders: int = 2, max_pending: int = 1) -> None:
    closed = close(system, untimed=untimed, max_pending=max_pending)
    numbers = list(range(len(closed.system.machines)))
    with closing(CEngine(closed, Findings())) as built:
        explicit = built.explore(MEMORY, 0, None)
        lengths = {mark.number: len(mark.path) for mark in explicit.marks}
        for turn in range(orders):
            Random(turn).shuffle(numbers)
            order = numbers if turn else ()
            for slots in (False, True):
                found = built.explore(
                    MEMORY, 0, None, search=Search.SYMBOLIC, order=order, slots=slots
                )
                assert seen(closed, found) == seen(closed, explicit)
                for mark in found.marks:
                    assert len(mark.path) in (0, lengths[mark.number])
                assert all(found.traps)


@pytest.mark.parametrize("untimed", [True, False])
@pytest.mark.parametrize("name", SYSTEMS)
def test_small_systems_are_the_same(name: str, untimed: bool) -> None:
    same(load_files(SYSTEMS[name]), untimed=untimed)


@pytest.mark.parametrize("seed", [3, 8])
def test_random_systems_are_the_same(seed: int) -> None:
    same(load_files(random_system(seed)), untimed=False, orders=3)


@pytest.mark.parametrize(
    ("seed", "untimed", "max_pending"),
    [(3, True, 1), (8, False, 1), (9, True, UNLIMITED), (13, False, 3)],
)
def test_random_charts_alone_are_the_same(seed: int, untimed: bool, max_pending: int) -> None:
    same(load_files(random_open_chart(seed)), untimed=untimed, max_pending=max_pending)


@pytest.mark.parametrize(("seed", "max_pending"), [(4, 1), (6, UNLIMITED)])
def test_random_systems_that_defer_are_the_same(seed: int, max_pending: int) -> None:
    same(load_files(random_deferring(seed)), untimed=False, max_pending=max_pending)


LIFT = """
chart: Lift
events: {{in: ["call(at 0..5)", opened]}}
operations: [door(c -1..1)]
outputs: {{last: 0..5 = 0}}
capacity: {{queue: {queue}}}
properties: {{five: {{reachable: last == 5}}, four: {{reachable: last == 4}},
  three: {{reachable: last == 3}}, two: {{reachable: last == 2}}, one: {{reachable: last == 1}}}}
initial: idle
states:
  idle: {{rest: true, on: {{call: {{target: busy, do: last = event.at}}}}}}
  busy: {{defer: call, entry: door(1), on: {{opened: {last}}}}}
"""


@pytest.mark.parametrize(("queue", "search"), [(8, Search.AUTO), (32, Search.SYMBOLIC)])
def test_a_queue_of_payloads_is_levels_of_the_diagram(queue: int, search: Search) -> None:
    system = load_files({"lift": LIFT.format(queue=queue, last="idle")})
    report = check(system, Findings(), options=ExplorationOptions("c", search=search))
    found = report.exploration
    assert report.verdict is Verdict.HOLDS
    assert found.states == 12 * sum(6**length for length in range(queue + 1))
    assert found.machines[0].queue == queue
    assert found.machines[0].locals == found.states
    assert found.diagram is not None
    assert found.diagram.nodes <= 10 * queue


SHORTER = {"T_OPEN: 4s": "T_OPEN: 400ms", "T_DOOR_MAX: 8s": "T_DOOR_MAX: 600ms",
           "T_TRAVEL_MAX: 20s": "T_TRAVEL_MAX: 800ms"}  # fmt: skip


@pytest.mark.parametrize(
    ("time", "queue", "changes", "states", "transitions"),
    [  # of the first two the explicit search has these figures, which takes it a minute each
        ("untimed", 2, {}, 697_632, 5_133_668),
        ("discrete", 2, SHORTER, 1_055_128, 9_308_436),
        ("discrete", 3, {}, 30_618_872, 347_339_940),
    ],
)
def test_an_elevator_defers_calls_while_its_door_is_open(
    time: Any, queue: int, changes: Mapping[str, str], states: int, transitions: int
) -> None:
    folder = Path(__file__).parents[1] / "found"
    files = {name: (folder / f"{name}.yaml").read_text() for name in ("elevator", "safe_base")}
    for before, after in {**changes, "{queue: 3}": f"{{queue: {queue}}}"}.items():
        files["elevator"] = files["elevator"].replace(before, after)
    report = checked(load_files(files), time=time)
    found = report.exploration
    assert report.verdict is Verdict.HOLDS
    assert (found.states, found.transitions) == (states, transitions)
    assert found.machines[0].queue == queue
    assert found.machines[0].timers == 1


def test_a_trap_of_a_chart_with_many_queues_is_shown() -> None:
    wrong = "[{if: last == 3, target: stuck}, {target: idle}]"
    text = LIFT.format(queue=8, last=wrong) + "  stuck: {on: {opened: {target: stuck}}}\n"
    options = ExplorationOptions("c", search=Search.SYMBOLIC)
    report = check(load_files({"lift": text}), Findings(), options=options)
    (trap,) = [one for one in report.results if one.name == "trap"]
    assert trap.verdict is Verdict.VIOLATED
    assert trap.trace is not None
    assert trap.trace.replayed == ("interpreter", "generated C")
    assert "stuck" in trap.trace.steps[-1].after


# --- little memory -------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def drive(own_cache: None, quickly_compiled: None) -> Iterator[CEngine]:  # noqa: ARG001
    with closing(CEngine(close(load_files(SYSTEMS["drive"]), untimed=True), Findings())) as built:
        yield built


TEMPORAL = ("--leads-to", "2,3", "--leads-to", "3,2", "--leads-to", "2,2", "--recoverable", "3")


def told(engine: CEngine, *more: str) -> tuple[int, Mapping[str, Any]]:
    command = [
        str(engine.program),
        "--search",
        "symbolic",
        "--livelock",
        "--ways",
        "0,1,2,3",
        *TEMPORAL,
        *more,
    ]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode in (0, 3), done.stderr
    return done.returncode, json.loads(done.stdout)["result"] if done.stdout else {}


def kept(result: Mapping[str, Any]) -> dict[str, Any]:
    own = ("search", "seconds", "bytes", "temporal")
    found = {name: value for name, value in result.items() if name not in own}
    return {**found, "temporal": verdicts_of(result)}


def verdicts_of(result: Mapping[str, Any]) -> list[tuple[bool, bool, bool]]:
    """Return whether each temporal property is decided, violated, and by a cycle.

    Runs depend on the order of the diagram.
    """
    assert all(bool(one["path"]) == one["violated"] for one in result["temporal"])
    return [(one["known"], one["violated"], bool(one["cycle"])) for one in result["temporal"]]


def test_caches_and_garbage_change_nothing(drive: CEngine) -> None:
    _, whole = told(drive)
    _, tight = told(drive, "--cache-bits", "1", "--collect-every", "1", "--order", "0,1")
    assert kept(tight) == kept(whole)
    assert tight["search"]["collections"] > 0


def test_an_allocation_that_fails_loses_no_state(drive: CEngine) -> None:
    _, whole = told(drive)
    ends, undecided = set(), 0
    for fail_at in [*range(1, 40), *range(40, 400, 11)]:
        code, result = told(drive, "--fail-at", str(fail_at), "--order", "0,1")
        ends.add(result["outcome"] if code == 0 else "none")
        if code == 0 and result["outcome"] == "complete":
            assert result["states"] == whole["states"]
            for one, other in zip(result["temporal"], whole["temporal"], strict=True):
                assert one["violated"] == (one["known"] and other["violated"])
                assert one["known"] or one["unknown"] == "memory"
                undecided += not one["known"]
        elif code == 0:
            assert result["outcome"] == "memory"
            assert result["states"] <= whole["states"]
            marks = {mark["mark"] for mark in whole["marks"]}
            assert {mark["mark"] for mark in result["marks"]} <= marks
    assert "none" in ends
    assert "complete" in ends
    assert undecided > 0


def test_the_first_of_two_searches_answers(drive: CEngine) -> None:
    more = ["--livelock", "--ways", "0,1,2,3", *TEMPORAL]
    _, whole = told(drive)
    _, explicit = told(drive, "--search", "explicit")
    verdicts = verdicts_of(explicit)
    assert len(set(verdicts)) > 1
    assert verdicts_of(whole) == verdicts
    for many in ("1", "50"):
        command = [str(drive.program), "--search", "auto", "--many", many, *more]
        done = subprocess.run(command, capture_output=True, text=True, check=True)
        result = json.loads(done.stdout)["result"]
        assert (result["outcome"], result["states"]) == ("complete", whole["states"])
        assert verdicts_of(result) == verdicts


def test_a_diagram_may_decide_fair_runs_after_a_search_has_ended(tmp_path: Path) -> None:
    path = sized("ordered_table.yaml", 5, tmp_path)
    waits = 'W: {leads_to: ["phil[0].In(holding)", "phil[0].In(eating)"]}'
    text = path.read_text().partition("properties:")[0]
    path.write_text(f"{text}environment: {{will: ['phil[i]']}}\nproperties: {{{waits}}}")
    found = []
    with closing(CEngine(close(load_system(path, Findings())), Findings())) as built:
        for asked, part in (("--leads-to", 1), ("--leads-to", 2), ("--recoverable", 1)):
            operands = "1,2" if asked == "--leads-to" else "2"
            many = str(16 * 8_352 * part)  # from a 16th of these states on
            command = [str(built.program), "--search", "auto", "--many", many, asked, operands]
            done = subprocess.run(command, capture_output=True, text=True, check=True)
            found.append(json.loads(done.stdout)["result"])
    assert ["search" in result for result in found] == [True, False, False]
    assert {result["states"] for result in found} == {8_352}
    assert [one["violated"] for result in found for one in result["temporal"]] == [
        True,
        True,
        False,
    ]


def test_a_diagram_begins_early_where_a_queue_makes_most_local_states() -> None:
    text = LIFT.format(queue=4, last="idle")
    with closing(CEngine(close(load_files({"lift": text})), Findings())) as built:
        results = []
        for many in ("1000000", "40000"):
            command = [str(built.program), "--search", "auto", "--many", many]
            done = subprocess.run(command, capture_output=True, text=True, check=True)
            results.append(json.loads(done.stdout)["result"])
    engines = [result.get("search", {}).get("engine", "explicit") for result in results]
    assert engines == ["explicit", "symbolic"]
    assert [result["states"] for result in results] == [18_660, 18_660]


def test_a_search_that_takes_turns_still_finds_a_livelock() -> None:
    system = load_files(SYSTEMS["livelock"])
    report = check(system, Findings(), options=ExplorationOptions("c", time="untimed"))
    assert report.exploration.livelock is not None
    assert report.exploration.diagram is None


def test_the_order_of_a_token_ring_is_a_good_one(tmp_path: Path) -> None:
    (model,) = (each for each in MODELS if each.name == "ring")
    program = build_fsmkit(model, 12, tmp_path)
    command = [str(program), "--search", "symbolic"]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    result = json.loads(done.stdout)["result"]
    assert result["states"] == 59_851_521_084
    assert result["search"]["fires"] < 4_000_000  # 7 million with an order of hardly more nodes


# --- reports -------------------------------------------------------------------------------------


def checked(system: System, **options: Any) -> Report:
    manner = ExplorationOptions("c", search=Search.SYMBOLIC, **{"time": "untimed", **options})
    return check(system, Findings(), options=manner)


def test_a_deadlock_is_shown_by_a_shortest_way_that_was_replayed(tmp_path: Path) -> None:
    table = load_system(sized("table.yaml", 3, tmp_path), Findings())
    report = checked(table, time="discrete")
    (deadlock,) = [one for one in report.results if one.name == "D"]
    assert deadlock.verdict is Verdict.VIOLATED
    assert deadlock.trace is not None
    assert deadlock.trace.replayed == ("interpreter", "generated C")
    assert report.exploration.diagram is not None
    assert report.exploration.end is End.COMPLETE


def test_the_report_tells_of_the_diagram(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    path = str(sized("ordered_table.yaml", 3, tmp_path))
    order = ["--order", "phil[2],phil[0]"]
    assert execute(["check", path, "--search", "symbolic", *order]) == 0
    assert "all 192 states (saturation:" in capsys.readouterr().out
    assert execute(["check", path, "--search", "symbolic", "--json", *order]) == 0
    document = json.loads(capsys.readouterr().out)
    assert document["search"]["engine"] == "symbolic"
    assert document["search"]["order"] == ["phil[2]", "phil[0]", "phil[1]"]
    assert document["depth"] is None


def test_the_best_order_is_kept_for_the_next_run() -> None:
    system = load_files(SYSTEMS["shared"])
    count = len(system.machines)
    with closing(CEngine(close(system, untimed=True), Findings())) as built:

        def explored(order: tuple[int, ...] = ()) -> Exploration:
            return built.explore(MEMORY, 0, None, search=Search.SYMBOLIC, order=order)

        kept = built.program.parent / ORDER
        kept.unlink(missing_ok=True)  # of another test
        runs = [explored(), explored(), explored(tuple(range(count))), explored()]
        diagrams = [run.diagram for run in runs if run.diagram is not None]
        assert [one.found_by for one in diagrams] == ["found", "kept", "given", "kept"]
        best = min(diagrams, key=lambda one: one.made)
        assert diagrams[3].order == best.order
        assert len({run.states for run in runs}) == 1
        for damaged in ("", "[]", '{"order": ["x"], "made": 1}', '{"order": [7], "made": 1}'):
            kept.write_text(damaged)
            found = explored().diagram
            assert found is not None
            assert found.found_by == "found"
            kept.unlink(missing_ok=True)


def test_what_needs_the_graph_is_named() -> None:
    files = dict(SYSTEMS["shared"])
    wanted = (
        '  L: {leads_to: ["turn == 0", "turn == 2"]}\n'
        '  O: {never: "occurs(w[0].go) and turn == 2"}\n'
    )
    files["shared"] = files["shared"].replace("  D: dead", f"{wanted}  D: dead")
    system = load_files(files)
    explicit = check(
        system, Findings(), options=ExplorationOptions("c", time="untimed", search=Search.EXPLICIT)
    )
    report = checked(system)
    verdicts = {one.name: one.verdict for one in explicit.results}
    assert {one.name: one.verdict for one in report.results} == verdicts
    assert report.exploration.explicit_states == explicit.exploration.states


@pytest.mark.parametrize("goal", ["turn == 2", "w[0].In(first)", "looker.In(alarm)"])
def test_what_can_be_reached_again_is_the_same(goal: str) -> None:
    files = dict(SYSTEMS["shared"])
    wanted = f'  R: {{recoverable: "{goal}"}}\n'
    files["shared"] = files["shared"].replace("  D: dead", f"{wanted}  D: dead")
    system = load_files(files)
    explicit = ExplorationOptions("c", time="untimed", search=Search.EXPLICIT)
    (one,) = [r for r in check(system, Findings(), options=explicit).results if r.name == "R"]
    report = checked(system)
    (other,) = [result for result in report.results if result.name == "R"]
    assert other.verdict is one.verdict
    assert report.exploration.explicit_states == 0
    if one.trace is not None:
        assert other.trace is not None
        assert len(other.trace.steps) == len(one.trace.steps)
        assert other.trace.replayed == one.trace.replayed


MANY_READ = """
  W: {invariant: "all(i in phil: not (phil[i].In(holding) and phil[(i + 1) % 12].In(eating)))"}
  N: {never: "any(i in phil: phil[i].In(eating) and phil[(i + 11) % 12].In(eating))"}
  M: {invariant: "not any(i in phil: phil[i].In(eating) and phil[(i + 3) % 12].In(eating))"}
"""


def test_conditions_over_many_machines_are_evaluated_in_parts(tmp_path: Path) -> None:
    path = sized("ordered_table.yaml", 12, tmp_path)
    path.write_text(path.read_text() + MANY_READ)
    system = load_system(path, Findings())
    asked = frozenset({"apart", "W", "N", "M"})
    options = ExplorationOptions("c", time="untimed", search=Search.SYMBOLIC)
    results = check(system, Findings(), options=options, properties=asked).results
    verdicts = {one.name: one.verdict for one in results if one.name in asked}
    assert verdicts == {
        "apart": Verdict.HOLDS,
        "W": Verdict.VIOLATED,
        "N": Verdict.HOLDS,
        "M": Verdict.VIOLATED,
    }
    assert all(one.trace for one in results if one.name in ("W", "M"))


def test_parts_mark_what_the_whole_marks() -> None:
    files = dict(SYSTEMS["shared"])
    wanted = (
        '  A: {invariant: "turn < 9 and not (turn == 7 or w[0].In(first)) and turn >= 0"}\n'
        '  B: {never: "turn == 9 or not (turn < 5 and turn > 2)"}\n'
        '  C: {never: "turn == 9 or 4 / turn == 2"}\n'
    )
    files["shared"] = files["shared"].replace("  D: dead", f"{wanted}  D: dead")
    properties = {one.name: one for one in load_files(files).properties}
    assert [len(parts_of(properties[name])) for name in "ABC"] == [4, 3, 0]


def test_dense_time_is_refused() -> None:
    with pytest.raises(FsmkitError, match="time is dense"):
        checked(load_files(SYSTEMS["kitchen"]), time="zones")


def test_unknown_names_are_refused() -> None:
    with pytest.raises(FsmkitError, match="no search `bfs`"):
        read_search("bfs")
    with pytest.raises(FsmkitError, match="no machine `looper`"):
        checked(load_files(SYSTEMS["shared"]), order=("looper",))


def test_counts_of_any_size_are_told() -> None:
    texts = {
        0: "0",
        970679981: "970,679,981",
        10**18 - 1: "999,999,999,999,999,999",
        10**18: "1.00e18",
        205 * 10**51: "2.05e53",
        9999 * 10**40: "1.00e44",
        10**9000 + 1: "1.00e9000",
    }
    for count, text in texts.items():
        assert count_text(count) == text


def test_counts_of_any_size_go_into_json() -> None:
    assert count_in_json(12) == 12
    assert count_in_json(10**9000 + 7) == "1" + "0" * 8999 + "7"
