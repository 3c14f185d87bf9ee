"""Perform one job of a campaign, in this process and in programs that it starts."""

from __future__ import annotations

import subprocess
import sys
import time
from collections.abc import Callable, Mapping
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from fsmkit.diagnostics import Findings, FsmkitError
from fsmkit.verify.campaign.jobs import Job, Outcome
from fsmkit.verify.explore import ExplorationOptions, check_file
from fsmkit.verify.mutants.campaign import evaluate_mutants
from fsmkit.verify.mutants.fates import Fate
from fsmkit.verify.mutants.subject import Subject
from fsmkit.verify.report.verdict import Verdict
from fsmkit.verify.resources.deadline import Deadline
from fsmkit.verify.statespace.storage import Storage

Found = tuple[str, str, Mapping[str, Any]]
"""A verdict, its reason, and further results."""


def perform(job: Job) -> Outcome:
    """Return the outcome of a job; errors are outcomes, too."""
    began = time.monotonic()
    try:
        verdict, why, results = WORK[job.kind](job)
    except FsmkitError as error:
        verdict, why, results = "error", next(iter(error.diagnostics)).message, {}
    except Exception as error:  # noqa: BLE001  (one job that fails must not end the others)
        verdict, why, results = "error", f"{type(error).__name__}: {error}", {}
    return Outcome(job.key, verdict, why, round(time.monotonic() - began, 3), results)


def _options(job: Job) -> ExplorationOptions:
    parameters = job.parameters
    return ExplorationOptions(
        parameters["engine"] if parameters["engine"] != "c" else "",
        time=parameters["time"],
        assume_watchdogs_silent=parameters["silent"],
        memory=parameters["memory"],
        timeout=parameters["timeout"],
        storage=Storage(parameters.get("storage", Storage.EXACT.value)),
        seed=parameters.get("seed", 0),
    )


def _check(job: Job) -> Found:
    """Explore a system once; a swarm's search without a violation is always undecided."""
    _, report = check_file(
        Path(job.about),
        Findings(),
        parameters=job.parameters["set"],
        options=_options(job),
        properties=frozenset(job.parameters["properties"]),
    )
    by: dict[Verdict, list[str]] = {}
    for result in report.results:
        by.setdefault(result.verdict, []).append(result.name)
    found = report.exploration
    results = {
        "states": found.states,
        "transitions": found.transitions,
        "violated": by.get(Verdict.VIOLATED, []),
        "undecided": by.get(Verdict.UNDECIDED, []),
    }
    reasons = {r.reason for r in report.results if r.verdict is Verdict.UNDECIDED and r.reason}
    return report.verdict.value, min(reasons, default=""), results


def _mutants(job: Job) -> Found:
    parameters = job.parameters
    found = evaluate_mutants(
        Subject.read(Path(job.about), Findings(), parameters=parameters["set"]),
        _options(job),
        seed=parameters["seed"],
        part=slice(parameters["first"], parameters["last"]),
        properties=frozenset(parameters["properties"]),
        deadline=Deadline(parameters["timeout"]),
    )
    counts = {fate.value: sum(each.fate is fate for each in found.evaluated) for fate in Fate}
    results: dict[str, Any] = {**counts, "same": found.same, "broken": found.broken}
    results["survivors"] = [
        f"{each.mutant.machine}, {each.mutant.operator}: {each.mutant.what}"
        for each in found.survivors
    ]
    if found.survivors:
        return "violated", "", results
    undecided = found.ended or counts[Fate.UNDECIDED.value]
    return ("undecided" if undecided else "holds"), found.ended, results


def _differential(job: Job) -> Found:
    """Compare random charts, with the development tool for that."""
    tool = import_module("devtools.differential")
    parameters = job.parameters
    numbers = range(parameters["first"], parameters["first"] + parameters["charts"])
    totals = tool.run_batch(
        parameters["seed"], numbers, tool.target_names(parameters["targets"] or None)
    )
    results = {
        "charts": totals.charts,
        "macrosteps": totals.macrosteps,
        "refused": totals.refused,
        "divergences": [
            f"{name}: {each.target} {each.expected!r} {each.got!r}"
            for name, each in totals.divergences
        ],
    }
    return ("violated" if totals.divergences else "holds"), "", results


def _fuzz(job: Job) -> Found:
    """Run one target of `make fuzz`."""
    if find_spec("atheris") is None:
        return "error", "atheris is not installed: `pip install 'fsmkit[fuzz]'`", {}
    devtools = import_module("devtools").__file__
    folder = Path(str(devtools)).parent
    artifacts = Path("build/fuzz")
    (artifacts / job.about).mkdir(parents=True, exist_ok=True)
    seed, seconds = job.parameters["seed"], job.parameters["seconds"]
    done = subprocess.run(
        [sys.executable, str(folder / "fuzz" / f"fuzz_{job.about}.py"), f"-seed={seed}",
         f"-max_total_time={seconds}", "-timeout=30", "-rss_limit_mb=1024",
         "-max_len=8192", "-len_control=0", f"-artifact_prefix={artifacts / job.about}-",
         str(artifacts / job.about)],
        capture_output=True, text=True, check=False, errors="replace",
        env={"PYTHONPATH": str(folder.parent), "PATH": ""},
    )  # fmt: skip
    last = next((line for line in reversed(done.stderr.splitlines()) if line.strip()), "")
    return ("violated" if done.returncode else "holds"), last if done.returncode else "", {}


WORK: Mapping[str, Callable[[Job], Found]] = {
    "check": _check,
    "swarm": _check,
    "mutants": _mutants,
    "differential": _differential,
    "fuzz": _fuzz,
}
