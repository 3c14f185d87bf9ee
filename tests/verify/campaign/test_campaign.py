"""Campaigns: what their files mean, that nothing is lost, and that nothing is done twice."""

from __future__ import annotations

import json
import multiprocessing
import os
import signal
from pathlib import Path

import pytest

from fsmkit.cli import execute
from fsmkit.diagnostics import Findings, FsmkitError
from fsmkit.verify.campaign import pool, reader, work
from fsmkit.verify.campaign.jobs import Job, Outcome
from fsmkit.verify.campaign.ledger import FILE, Ledger
from fsmkit.verify.campaign.pool import perform_jobs
from fsmkit.verify.campaign.reader import Campaign, read_campaign
from tests import needs

COUNTER = """\
chart: Counter
constants: {N: 3}
events: {in: [up, down]}
data: {n: 0..90 = 0}
initial: counting
states:
  counting:
    on:
      up: {if: n < N, do: n = n + 1}
      down: {if: n > 0, do: n = n - 1}
"""
STUCK = """\
chart: Stuck
events: {in: [go]}
initial: a
states: {a: {on: {go: b}}, b: {}}
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "counter.yaml").write_text(COUNTER, encoding="utf-8")
    (tmp_path / "stuck.yaml").write_text(STUCK, encoding="utf-8")
    return tmp_path


def campaign(folder: Path, *runs: str) -> Campaign:
    lines = "".join(f"  - {run}\n" for run in runs)
    file = folder / "night.yml"
    file.write_text(f"campaign: night\nruns:\n{lines}", encoding="utf-8")
    return read_campaign(file, Findings())


def test_a_family_is_each_combination(folder: Path) -> None:
    found = campaign(folder, "{check: counter.yaml, set: {N: 1..3, M: [a, b]}, engine: python}")
    assert [job.parameters["set"] for job in found.jobs] == [
        {"N": n, "M": m} for n in ("1", "2", "3") for m in ("a", "b")
    ]
    assert len({job.key for job in found.jobs}) == 6


def test_patterns_lists_seeds_and_parts(folder: Path) -> None:
    found = campaign(
        folder,
        "{check: '*.yaml'}",
        "{check: [stuck.yaml, counter.yaml], property: [P, Q]}",
        "{swarm: stuck.yaml, seeds: 2..4, storage: hash-compact}",
        "{swarm: stuck.yaml, seeds: 2}",
        "{mutants: counter.yaml, count: 3}",
        "{differential: {charts: 150, seed: 7}}",
    )
    by_run = {n: [job for job in found.jobs if job.run == n] for n in range(6)}
    assert [job.short for job in by_run[0]] == ["counter.yaml", "stuck.yaml"]
    assert [job.short for job in by_run[1]] == ["stuck.yaml", "counter.yaml"]
    assert by_run[1][0].parameters["properties"] == ["P", "Q"]
    assert [job.parameters["seed"] for job in by_run[2]] == [2, 3, 4]
    assert [job.parameters["seed"] for job in by_run[3]] == [1, 2]
    assert [(j.parameters["first"], j.parameters["last"]) for j in by_run[4]] == [(0, 3)]
    assert [(j.parameters["first"], j.parameters["charts"]) for j in by_run[5]] == [
        (0, 100),
        (100, 50),
    ]


def test_a_key_names_what_a_result_hangs_on(folder: Path) -> None:
    (before,) = campaign(folder, "{check: stuck.yaml}").jobs
    (moved,) = campaign(folder, "{check: stuck.yaml}").jobs
    assert before.key == moved.key
    (folder / "stuck.yaml").write_text(STUCK.replace("b: {}", "b: {rest: true}"))
    (changed,) = campaign(folder, "{check: stuck.yaml}").jobs
    (other,) = campaign(folder, "{check: stuck.yaml, time: untimed}").jobs
    assert len({before.key, changed.key, other.key}) == 3


HOSTILE = {
    "": "empty-file",
    "[]": "unexpected-shape",
    "campaign: x": "broken-campaign",
    "runs: []": "broken-campaign",
    "campaign: ''\nruns: [{check: stuck.yaml}]": "unexpected-shape",
    "campaign: x\nruns: []": "broken-campaign",
    "campaign: x\nruns: {check: stuck.yaml}": "unexpected-shape",
    "campaign: x\nruns: [stuck.yaml]": "unexpected-shape",
    "campaign: x\nruns: [{}]": "broken-campaign",
    "campaign: x\nruns: [{chek: stuck.yaml}]": "broken-campaign",
    "campaign: x\nruns: [{check: stuck.yaml, mutants: stuck.yaml}]": "broken-campaign",
    "campaign: x\nruns: [{check: nowhere.yaml}]": "unreadable-file",
    'campaign: x\nruns: [{check: "a\\0b"}]': "broken-yaml",
    "campaign: x\nruns: [{check: /etc/*}]": "unreadable-file",
    "campaign: x\nruns: [{check: {a: b}}]": "unexpected-shape",
    "campaign: x\nruns: [{check: stuck.yaml, colour: red}]": "unknown-key",
    "campaign: x\nruns: [{check: stuck.yaml, time: later}]": "unexpected-value",
    "campaign: x\nruns: [{check: stuck.yaml, timeout: soon}]": "unexpected-value",
    "campaign: x\nruns: [{check: stuck.yaml, memory: much}]": "unexpected-value",
    "campaign: x\nruns: [{check: stuck.yaml, silent: true}]": "broken-campaign",
    "campaign: x\nruns: [{check: stuck.yaml, set: {N: }}]": "unexpected-value",
    "campaign: x\nruns: [{check: stuck.yaml, set: [N]}]": "unexpected-shape",
    "campaign: x\nruns: [{check: stuck.yaml, set: {N: 1..90000, M: 1..90000}}]": "broken-campaign",
    "campaign: x\nruns: [{swarm: stuck.yaml, seeds: -1}]": "unexpected-value",
    "campaign: x\nruns: [{swarm: stuck.yaml, seeds: ²}]": "unexpected-value",
    "campaign: x\nruns: [{swarm: stuck.yaml, storage: exact}]": "unexpected-value",
    "campaign: x\nruns: [{mutants: stuck.yaml, count: 0}]": "unexpected-value",
    "campaign: x\nruns: [{mutants: night.yaml}]": "",
    "campaign: x\nruns: [{differential: yes}]": "unexpected-shape",
    "campaign: x\nruns: [{fuzz: {target: json}}]": "unexpected-value",
}


@pytest.mark.parametrize("text", HOSTILE, ids=range(len(HOSTILE)))
def test_what_is_wrong_is_found(
    text: str, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = folder / "night.yaml"
    file.write_text(text, encoding="utf-8")
    assert execute(["campaign", str(file)]) == 1
    assert HOSTILE[text] in capsys.readouterr().err


def test_tools_of_the_project_are_not_installed(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(reader, "is_checkout", lambda: False)
    with pytest.raises(FsmkitError, match="which are not installed"):
        campaign(folder, "{differential: {charts: 1}}")


def test_a_job_that_fails_is_an_outcome() -> None:
    parameters = {
        "set": {},
        "properties": [],
        "time": "untimed",
        "silent": False,
        "engine": "python",
    }
    job = Job(0, "check", "/no/such/file.yaml", {**parameters, "timeout": 0.0, "memory": 1 << 28})
    found = work.perform(job)
    assert found.verdict == "error"
    assert "no/such/file" in found.why


def test_what_is_kept_is_read_again(tmp_path: Path) -> None:
    outcomes = [Outcome(f"check-{n}", "holds", results={"states": n}) for n in range(3)]
    for outcome in outcomes:
        Ledger(tmp_path).keep(outcome)
    with (tmp_path / FILE).open("a") as file:
        file.write('\n{"key": "check-9", "verd')  # it was cut off
    Ledger(tmp_path).keep(Outcome("check-4", "violated"))
    assert list(Ledger(tmp_path).known()) == ["check-0", "check-1", "check-2", "check-4"]
    assert Ledger(tmp_path).known()["check-2"] == outcomes[2]


@pytest.mark.parametrize(
    "line",
    ["[" * 100_000, "9" * 10_000, "[]", '{"key": [], "verdict": "holds"}',
     '{"key": "a", "verdict": "holds", "told": []}', '{"key": "a", "verdict": "holds", "x": 1}',
     '{"key": "a", "verdict": "perhaps"}', '{"key": "a", "verdict": "holds", "seconds": "1"}'],
)  # fmt: skip
def test_a_damaged_line_counts_as_missing(line: str, tmp_path: Path) -> None:
    (tmp_path / FILE).write_text(f'{line}\n{{"key": "b", "verdict": "holds"}}\n')
    known = Ledger(tmp_path).known()
    assert known["b"] == Outcome("b", "holds")
    assert all(isinstance(outcome.results, dict) for outcome in known.values())


def test_a_folder_belongs_to_one_run_at_a_time(tmp_path: Path) -> None:
    ledger = Ledger(tmp_path)
    with pytest.raises(FsmkitError, match="is in use: another run"):
        Ledger(tmp_path)
    del ledger
    Ledger(tmp_path).keep(Outcome("a", "holds"))


def test_outcomes_in_a_pipe_are_rejected(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / FILE)
    with pytest.raises(FsmkitError, match="it is not a file"):
        Ledger(tmp_path).known()


@pytest.mark.slow
def test_without_dask(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(pool, "has_dask", lambda: False)
    run = "engine: python, time: untimed"
    campaign(
        folder,
        f"{{check: counter.yaml, set: {{N: [1, 2]}}, {run}}}",
        f"{{check: stuck.yaml, {run}}}",
    )
    arguments = [
        "campaign",
        str(folder / "night.yml"),
        "--workers",
        "2",
        "--resume",
        str(folder / "kept"),
    ]
    assert execute([*arguments, "--json"]) == 1
    results = json.loads(capsys.readouterr().out)
    assert results["counts"] == {"holds": 2, "violated": 1, "undecided": 0, "error": 0}
    assert [job["states"] for job in results["jobs"]] == [2, 3, 2]
    assert results["jobs"][2]["violated"] == ["trap"]
    kept = (folder / "kept" / FILE).read_text()
    monkeypatch.setattr(pool, "perform", None)  # all is known: nothing is done
    assert execute(arguments) == 1
    shown = capsys.readouterr().out
    assert "VIOLATED  check stuck.yaml  trap" in shown
    assert "3 jobs" in shown
    assert (folder / "kept" / FILE).read_text() == kept


def test_a_scheduler_without_dask(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(pool, "has_dask", lambda: False)
    campaign(folder, "{check: stuck.yaml}")
    assert execute(["campaign", str(folder / "night.yml"), "--scheduler", "tcp://a:1"]) == 1
    assert "pip install 'fsmkit[cluster]'" in capsys.readouterr().err


def family(folder: Path) -> Campaign:
    return campaign(folder, "{check: counter.yaml, set: {N: 1..20}, engine: python, time: untimed}")


@pytest.mark.slow
def test_a_process_that_dies_loses_nothing(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(pool, "has_dask", lambda: False)
    jobs = family(folder).jobs
    outcomes = []
    for outcome in perform_jobs(jobs, None, 2):
        outcomes.append(outcome)
        if len(outcomes) == 3:
            os.kill(int(multiprocessing.active_children()[-1].pid or 0), signal.SIGKILL)
    assert sorted(outcome.key for outcome in outcomes) == sorted(job.key for job in jobs)
    assert {outcome.verdict for outcome in outcomes} == {"holds"}


@pytest.mark.slow
@pytest.mark.external
@pytest.mark.filterwarnings("ignore:unclosed:ResourceWarning")  # of Dask itself
@pytest.mark.filterwarnings("ignore:Exception ignored in.*socket")
def test_a_worker_of_dask_that_dies_loses_nothing(folder: Path) -> None:
    needs.need(pool.has_dask(), "distributed")
    jobs = family(folder).jobs
    outcomes = []
    for outcome in perform_jobs(jobs, None, 2):
        outcomes.append(outcome)
        if len(outcomes) == 3:
            os.kill(workers()[-1], signal.SIGKILL)
    assert sorted(outcome.key for outcome in outcomes) == sorted(job.key for job in jobs)
    assert {outcome.verdict for outcome in outcomes} == {"holds"}


def workers() -> list[int]:
    """Return the processes that this one has begun by `multiprocessing`."""
    found = [
        int(child)
        for task in Path("/proc/self/task").iterdir()
        for child in (task / "children").read_text().split()
    ]
    return [pid for pid in found if b"spawn_main" in Path(f"/proc/{pid}/cmdline").read_bytes()]
