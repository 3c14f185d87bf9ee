"""Mutation analysis: each operator on a small chart, and the fate of mutants of a small system."""

import json
from collections import Counter
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from fsmkit.chart.loading import read_documents
from fsmkit.cli import execute
from fsmkit.diagnostics import Findings, FsmkitError
from fsmkit.system.any_file import load_any
from fsmkit.verify.campaign.mutants import KeptMutants
from fsmkit.verify.engines.c.engine import CEngine
from fsmkit.verify.engines.c.local_states import local_states
from fsmkit.verify.explore import ExplorationOptions, check
from fsmkit.verify.mutants import evaluation
from fsmkit.verify.mutants.campaign import Campaign, evaluate_mutants, score
from fsmkit.verify.mutants.difference import Sameness, compare
from fsmkit.verify.mutants.evaluation import Evaluator
from fsmkit.verify.mutants.fates import Evaluated, Fate
from fsmkit.verify.mutants.operators import mutations
from fsmkit.verify.mutants.subject import Subject
from fsmkit.verify.report.verdict import Report
from fsmkit.verify.resources.deadline import Deadline
from fsmkit.verify.resources.time import Time
from fsmkit.verify.statespace.global_steps import GlobalSteps
from fsmkit.verify.statespace.local_steps import LocalSteps

PUMP = """\
chart: Pump
constants: {MOST: 3}
data: {level: 0..9 = 0}
events: {in: [fill, drain, stop], out: [full]}
capacity: {queue: 4}
initial: working
states:
  working:
    on: {stop: off}
    initial: idle
    states:
      idle:
        on:
          fill: {if: level < MOST, target: filling, do: level += 1; send full}
      filling:
        entry: log "fills"
        on: {drain: {target: idle, do: level = 0}}
        after: {2s: idle}
  off: {on: {fill: working}}
"""
DERIVED = """\
chart: Loud
extends: pump.yaml
refine:
  filling: {entry: super; log "loudly"}
"""
BUFFER = """\
system: Buffer
machines: {producer: producer.yaml, consumer: consumer.yaml}
connect: [producer.made -> consumer.made, consumer.taken -> producer.taken]
properties:
  one: {never: producer.count > 1}
  D: deadlock_free
"""
PRODUCER = """\
chart: Producer
data: {count: 0..3 = 0}
events: {in: [taken], out: [made]}
initial: ready
states:
  ready: {after: {1s: {target: waiting, do: count += 1; send made}}}
  waiting: {on: {taken: {target: ready, do: count -= 1}}}
"""
CONSUMER = """\
chart: Consumer
events: {in: [made], out: [taken]}
initial: empty
states:
  empty: {rest: true, on: {made: full}}
  full:
    entry: log "got one"
    after: {500ms: {target: empty, do: send taken}}
    on: {made: {target: empty, if: "false", do: log "never"}}
"""


@pytest.fixture
def buffer(tmp_path: Path) -> Path:
    (tmp_path / "producer.yaml").write_text(PRODUCER)
    (tmp_path / "consumer.yaml").write_text(CONSUMER)
    (tmp_path / "buffer.yaml").write_text(BUFFER)
    return tmp_path / "buffer.yaml"


def evaluated(path: Path, count: int = 0, seed: int = 0) -> Campaign:
    subject = Subject.read(path, Findings())
    options = ExplorationOptions(engine="python", time="discrete")
    return evaluate_mutants(subject, options, count=count, seed=seed)


def fates_in(err: str) -> list[str]:
    return [line for line in err.splitlines() if line.split()[:1] in [[f.value] for f in Fate]]


def test_every_operator_finds_its_places(tmp_path: Path) -> None:
    (tmp_path / "pump.yaml").write_text(PUMP)
    (tmp_path / "loud.yaml").write_text(DERIVED)
    path = tmp_path / "loud.yaml"
    chart = load_any(path, Findings()).machines[0].chart
    found = Counter(m.operator for m in mutations(read_documents(path, Findings()), chart))
    assert found == {
        "constant halved": 1,
        "constant doubled": 1,
        "queue shortened": 2,
        "guard dropped": 1,
        "guard negated": 1,
        "transition dropped": 5,
        "target moved": 5,
        "action dropped": 5,
        "actions swapped": 2,
        "super dropped": 1,
        "delay halved": 1,
        "delay doubled": 1,
        "event ignored": 2,
    }


def test_what_an_operator_says_is_where_the_original_stands(tmp_path: Path) -> None:
    (tmp_path / "pump.yaml").write_text(PUMP)
    path = tmp_path / "pump.yaml"
    chart = load_any(path, Findings()).machines[0].chart
    found = {m.operator: m for m in mutations(read_documents(path, Findings()), chart)}
    negated = found["guard negated"]
    assert negated.what == "`not (level < MOST)` instead of `level < MOST`"
    assert PUMP[negated.place.start : negated.place.end] == "level < MOST"
    assert found["delay halved"].what == "1s instead of 2s"
    assert found["constant doubled"].what == "`MOST` is (3) * 2 instead of 3"


def test_mutants_of_a_system_are_found_equivalent_or_survive(buffer: Path) -> None:
    found = evaluated(buffer)
    fates = {(j.mutant.operator, j.mutant.what): j for j in found.evaluated}
    lost = fates["connection dropped", "`producer.made -> consumer.made`"]
    assert (lost.fate, lost.by) == (Fate.FOUND, ("D",))
    never = fates["action dropped", '`log "never"`']
    assert (never.fate, never.why) == (Fate.EQUIVALENT, "in this system it is never executed")
    log = fates["action dropped", 'entry: `log "got one"`']
    assert log.fate is Fate.EQUIVALENT
    assert log.why.startswith("no run differs")
    slower = fates["delay doubled", "1000ms instead of 500ms"]
    assert slower.fate is Fate.SURVIVING
    assert slower.systems == ("Buffer",)
    assert slower.contrast is not None
    assert slower.contrast.lines[-2:] == (
        "until 1.5s",
        "consumer: timeout in full  [out taken; taken -> producer]",
    )
    assert found.left == 0
    assert 0 < (score(found.evaluated) or 0) < 1


def test_a_changed_chart_in_place_is_the_system_read_anew(buffer: Path) -> None:
    subject = Subject.read(buffer, Findings())
    documents = subject.documents()
    in_place = 0
    for mutant in subject.mutants(documents, 0):
        if mutant.documents is None:
            continue
        try:
            anew = load_any(buffer, Findings(), {mutant.machine: mutant.documents})
        except FsmkitError:
            with pytest.raises(FsmkitError):
                subject.changed(mutant)
            continue
        system = subject.changed(mutant)
        assert [m.chart for m in system.machines] == [m.chart for m in anew.machines]
        assert system.event_links == anew.event_links
        in_place += system.source is subject.system.source
    assert in_place > 20


@pytest.mark.slow
def test_what_one_system_does_not_find_another_may(
    buffer: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    timed = buffer.with_name("timed.yaml")
    bound = "  soon: {within: [producer.In(waiting), 600ms, producer.In(ready)]}\n"
    timed.write_text(BUFFER.replace("Buffer", "Timed") + bound)
    options = ["--time", "discrete", "--engine", "python", "--json"]
    told = []
    for files in ([buffer], [timed], [buffer, timed]):
        execute(["mutants", *map(str, files), *options])
        mutants = json.loads(capsys.readouterr().out)["mutants"]
        told.append({(m["machine"], m["operator"], m["what"]): m for m in mutants})
    first, second, both = told
    assert first.keys() == both.keys()
    slower = "consumer", "delay doubled", "1000ms instead of 500ms"
    assert (first[slower]["fate"], both[slower]["fate"]) == ("surviving", "found")
    assert both[slower]["by"] == ["Timed.soon"]
    for key, mutant in both.items():
        fates = {first[key]["fate"], second[key]["fate"]}
        assert (mutant["fate"] == "found") == ("found" in fates)


def test_what_a_later_system_lacks_costs_no_result_of_the_first(
    buffer: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A replacement counts where its machine is; a system that is not proved ends nothing."""
    other = buffer.with_name("other.yaml")
    other.write_text(
        "system: Other\nmachines: {producer: producer.yaml}\n"
        "environment: {may: [producer.taken]}\nproperties: {D: deadlock_free}\n"
    )
    slow = buffer.with_name("slow.yaml")
    slow.write_text(CONSUMER.replace("500ms", "700ms"))
    options = ["--time", "discrete", "--engine", "python", "--sample", "1", "--json"]
    files = ["mutants", str(buffer), str(other), *options]
    execute([*files, "--replace", f"consumer={slow}"])
    told = json.loads(capsys.readouterr().out)
    assert len(told["mutants"]) == 1
    assert execute([*files, "--replace", f"nobody={slow}"]) == 2
    assert "there is no machine `nobody` to replace" in capsys.readouterr().err
    other.write_text(BUFFER.replace("one:", "unread: {never: nobody.x}\n  one:"))
    assert execute(files) == 1  # at once: the systems are read before any is evaluated
    assert "mutants" not in json.loads(capsys.readouterr().out)


def interrupt_after(number: int, path: Path, folder: Path) -> None:
    """Evaluate so many mutants of a system, and keep them in a folder."""
    subject = Subject.read(path, Findings())
    options = ExplorationOptions("python", time="discrete")
    kept = KeptMutants.of(folder, [subject], options, frozenset())
    seen: list[Evaluated] = []

    def interrupted(one: Evaluated) -> None:
        kept.keep(one)
        seen.append(one)
        if len(seen) == number:
            raise KeyboardInterrupt

    first = evaluate_mutants(subject, options, recall=kept.recall, store=interrupted)
    assert (first.evaluated, first.ended) == (tuple(seen), "it was interrupted")
    assert first.left == first.possible - number - first.same - first.broken


@pytest.mark.slow
def test_an_interrupted_campaign_goes_on(
    buffer: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Each mutant is kept at once; the same texts are not evaluated again, changed ones are."""
    folder = tmp_path / "kept"
    interrupt_after(3, buffer, folder)
    with (folder / "outcomes.jsonl").open("a") as file:
        file.write('\n{"key": "mutants-0')  # what a full disk leaves
    arguments = ["mutants", str(buffer), "--time", "discrete", "--engine", "python"]
    execute(arguments)
    whole = capsys.readouterr()
    execute([*arguments, "--resume", str(folder)])
    resumed = capsys.readouterr()
    assert resumed.out == whole.out
    lines = fates_in(whole.err)
    assert fates_in(resumed.err) == lines[3:]
    execute([*arguments, "--resume", str(folder)])
    again = capsys.readouterr()
    assert (again.out, fates_in(again.err)) == (whole.out, [])
    buffer.write_text(BUFFER.replace("count > 1", "count > 2"))
    execute([*arguments, "--resume", str(folder)])
    assert len(fates_in(capsys.readouterr().err)) == len(lines)


def test_an_interrupt_within_an_exploration_decides_nothing(
    buffer: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The explorer ends by itself then, and has decided a part: the mutant is left."""
    checks = 0

    def interrupted(*given: Any, **options: Any) -> Report:
        nonlocal checks
        checks += 1
        found = check(*given, **options)
        return replace(found, interrupted=True, results=()) if checks == 3 else found

    monkeypatch.setattr(evaluation, "check", interrupted)
    found = evaluated(buffer)
    assert checks == 3
    assert found.ended == "it was interrupted"
    assert all(each.fate is not Fate.UNDECIDED for each in found.evaluated)


def test_results_that_cannot_be_kept_end_a_campaign(
    buffer: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "kept" / "outcomes.jsonl").mkdir(parents=True)
    arguments = ["mutants", str(buffer), "--time", "discrete", "--engine", "python"]
    assert execute([*arguments, "--resume", str(tmp_path / "kept")]) == 1
    assert "cannot be used" in capsys.readouterr().err
    assert execute(["check", str(buffer), "--resume", str(tmp_path / "kept")]) == 2
    assert "--resume goes with --mpi" in capsys.readouterr().err


@pytest.mark.cc
@pytest.mark.parametrize("time", ["zones", "discrete", "untimed"])
def test_what_is_the_same_in_each_local_step_is_equivalent(buffer: Path, time: Time) -> None:
    """It is never said of a mutant in which a comparison of whole systems finds a difference."""
    subject, options = Subject.read(buffer, Findings()), ExplorationOptions(time=time)
    evaluator = Evaluator(subject, options, frozenset(), Deadline())
    fates: dict[bool, set[Sameness]] = {True: set(), False: set()}
    for mutant in subject.mutants(evaluator.documents, 0):
        try:
            system = subject.changed(mutant)
        except FsmkitError:
            continue
        is_same = evaluator.local_difference(mutant, system) is None
        fates[is_same].add(evaluator.compared(system).sameness)
    assert fates[True] == {Sameness.EQUIVALENT}
    assert Sameness.DIFFERENT in fates[False]


@pytest.mark.cc
def test_a_local_difference_is_a_step_of_both(buffer: Path) -> None:
    subject = Subject.read(buffer, Findings())
    evaluator = Evaluator(subject, ExplorationOptions(), frozenset(), Deadline())
    found = {
        m.what: m for m in subject.mutants(evaluator.documents, 0) if m.operator == "delay doubled"
    }
    slower = found["1000ms instead of 500ms"]
    assert evaluator.local_difference(slower, subject.changed(slower)) == (
        "in empty: made",
        "  original: then in full, a timer of 500 ticks",
        "  mutant:   then in full, a timer of 1000 ticks",
    )


@pytest.mark.cc
def test_local_states_of_the_core_are_those_of_the_interpreter(buffer: Path) -> None:
    closed = ExplorationOptions(time="discrete").closed(load_any(buffer, Findings()), zones=False)
    steps = GlobalSteps(closed, LocalSteps(closed))
    ahead = [edge.to for edge in steps.initial()]
    for state in ahead:
        ahead += {edge.to for edge in steps.successors(state)}.difference(ahead)
    with closing(CEngine(closed, Findings())) as engine:
        found = engine.explore(1 << 28, 0, None, shows_locals=True)
    for machine, states in local_states(closed, found, {0, 1}).items():
        running = {state for state in states if state.running}
        assert running >= {steps.snapshots(state)[machine] for state in ahead}


def test_the_order_is_that_of_the_seed(buffer: Path) -> None:
    first, again, other = (
        [j.mutant for j in evaluated(buffer, count=4, seed=seed).evaluated] for seed in (1, 1, 2)
    )
    assert first == again
    assert first != other
    assert len(first) == 4


def test_a_system_equals_itself(buffer: Path) -> None:
    options = ExplorationOptions(time="discrete")
    closed = options.closed(load_any(buffer, Findings()), zones=False)
    assert compare(closed, closed, Deadline(), 1000).sameness is Sameness.EQUIVALENT
    assert compare(closed, closed, Deadline(), 2).sameness is Sameness.UNKNOWN


def test_an_original_that_is_not_explored_has_no_mutants(buffer: Path) -> None:
    subject = Subject.read(buffer, Findings())
    options = ExplorationOptions(engine="python", memory=64 << 10)
    with pytest.raises(FsmkitError, match="did not end"):
        evaluate_mutants(subject, options, deadline=Deadline(1e-9))


def test_the_verb_shows_survivors_and_scores(
    buffer: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments = ["mutants", str(buffer), "--time", "discrete", "--engine", "python"]
    assert execute(arguments) == 1
    told = capsys.readouterr().out
    assert "survives: consumer, delay doubled: 1000ms instead of 500ms" in told
    assert "-      500ms: {target: empty, do: send taken}" in told
    assert "a run of the original that the mutant does not have:" in told


@pytest.mark.cc
def test_the_engines_agree_on_mutants(buffer: Path, capsys: pytest.CaptureFixture[str]) -> None:
    found = []
    for engine in ("c", "python"):
        arguments = ["mutants", str(buffer), "--time", "discrete", "--sample", "5", "--json"]
        execute([*arguments, "--engine", engine])
        told = json.loads(capsys.readouterr().out)
        found.append([(m["what"], m["fate"]) for m in told["mutants"]])
    assert found[0] == found[1]
    assert {fate for _, fate in found[0]} >= {"found", "surviving"}
