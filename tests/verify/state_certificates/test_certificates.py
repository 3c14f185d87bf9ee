"""Certificates of invariants: what is written, and what the checker accepts and rejects."""

from __future__ import annotations

import base64
import json
import os
import random
import shutil
import subprocess
from dataclasses import replace
from pathlib import Path

import pytest

from fsmkit.diagnostics import Findings, FsmkitError
from fsmkit.verify.explore import ExplorationOptions, check_file
from fsmkit.verify.resources.deadline import Deadline
from fsmkit.verify.state_certificates.certificate import (
    Certificate,
    certificate_of,
    last_line,
    require_options,
)
from fsmkit.verify.state_certificates.checking import CHECKER, check_certificate
from fsmkit.verify.state_certificates.encoding import json_line
from fsmkit.verify.state_certificates.steps import StepServer
from fsmkit.verify.statespace.storage import Storage
from fsmkit.verify.statespace.symbolic_search import Search
from tests import needs

EDITS = int(os.environ.get("FSMKIT_CERTIFICATE_EDITS", "50"))
WORKER = """
chart: Worker
events:
  in: [job]
  out: [done]
data: {count: 0..3 = 0}
initial: idle
states:
  idle: {on: {job: {target: busy, do: "count = count < 3 ? count + 1 : 0"}}}
  busy: {after: {20ms: {target: idle, do: send done}}}
"""
SENDER = """
chart: Sender
events:
  in: [done]
  out: [job]
initial: ready
states:
  ready: {after: {10ms: {target: waits, do: send job}}}
  waits: {on: {done: ready}}
"""
SYSTEM = """
system: Workshop
machines: {sender: sender.yaml, worker: worker.yaml}
connect:
  - sender.job -> worker.job
  - worker.done -> sender.done
properties:
  small: {invariant: worker.count <= 3}
  never_both: {never: sender.In(ready) && worker.In(busy)}
  job_in_time: {never: occurs(worker.job) && sender.In(ready)}
  D: deadlock_free
  ends: {leads_to: [worker.In(busy), worker.In(idle)]}
"""
TIMES = ("untimed", "discrete")


@pytest.fixture
def system(tmp_path: Path) -> Path:
    for name, text in (("worker", WORKER), ("sender", SENDER), ("system", SYSTEM)):
        (tmp_path / f"{name}.yaml").write_text(text, encoding="utf-8")
    return tmp_path / "system.yaml"


def certified(path: Path, time: str) -> tuple[Certificate, StepServer]:
    """Return the certificate of a system, and the program of its steps."""
    options = ExplorationOptions("python", time=time, search=Search.EXPLICIT)  # type: ignore[arg-type]
    system, report = check_file(path, Findings(), options=options)
    return certificate_of(report, system, options, Deadline()), StepServer(system, options)


def answered(text: str, server: StepServer) -> tuple[list[str], list[dict[str, object]]]:
    """Give the lines of a certificate to the steps; return its states and the answers for them."""
    header, *lines, _ = text.splitlines()
    assert json_line(server.answer("header")) == header
    for line in lines:
        if line.startswith("{"):
            server.answer(line)
    states = [line for line in lines if line.startswith("[")]
    return states, [server.answer(line) for line in ("initial", *states)]


def resealed(text: str, lines: list[str]) -> str:
    """Return a certificate with other lines between the first and the last, and a right digest."""
    header, *_ = text.splitlines()
    edited = "\n".join((header, *lines)) + "\n"
    tables = sum(line.startswith("{") for line in lines)
    return edited + last_line(edited, tables, len(lines) - tables)


@pytest.mark.parametrize("time", TIMES)
def test_the_set_is_closed_and_each_state_is_needed(system: Path, time: str) -> None:
    made, server = certified(system, time)
    header = json.loads(made.text.splitlines()[0])
    assert [name for name, _ in header["covered"]] == [
        *("small", "never_both", "job_in_time", "D", "faults", "queues"),
    ]
    assert [name for name, _ in header["not_covered"]] == ["ends", "livelock"]
    states, answers = answered(made.text, server)
    assert len(states) == made.states > 8
    reached = {json_line(to) for answer in answers for to in answer["to"]}  # type: ignore[attr-defined]
    assert reached == set(states)
    assert not any(answer["violated"] for answer in answers)


@pytest.mark.parametrize(
    ("old", "new", "violated"),
    [
        ("worker.count <= 3", "worker.count <= 2", "small"),
        (
            "sender.In(ready) && worker.In(busy)",
            "sender.In(waits) && worker.In(busy)",
            "never_both",
        ),
        ("occurs(worker.job) && sender.In(ready)", "occurs(worker.job)", "job_in_time"),
    ],
)
def test_a_violated_property_is_seen_at_its_state(
    system: Path, old: str, new: str, violated: str
) -> None:
    made, _ = certified(system, "untimed")
    system.write_text(SYSTEM.replace(old, new), encoding="utf-8")
    _, server = certified(system, "untimed")
    lines = made.text.splitlines()
    lines[0] = json_line(server.header)
    _, answers = answered("\n".join(lines) + "\n", server)
    seen = {server.header["covered"][n][0] for a in answers for n in a["violated"]}  # type: ignore[attr-defined]
    assert seen == {violated}


def test_the_steps_reject_local_states_that_are_doubled_or_not_canonical(system: Path) -> None:
    made, server = certified(system, "untimed")
    local = made.text.splitlines()[1]
    server.answer(local)
    with pytest.raises(ValueError, match="twice"):
        server.answer(local)
    for other in (made.text.splitlines()[2] + " ", '{"machine":0,"active":[2,0,1],"data":[]}'):
        with pytest.raises(ValueError, match="canonical"):
            server.answer(other)
    with pytest.raises(ValueError, match="no local state"):
        server.answer("[0,999]")


@pytest.mark.parametrize(
    "options",
    [
        ExplorationOptions(),
        ExplorationOptions(time="untimed", search=Search.SYMBOLIC),
        ExplorationOptions(time="untimed", storage=Storage.BITSTATE),
    ],
)
def test_options_without_a_set_of_states_are_rejected(options: ExplorationOptions) -> None:
    with pytest.raises(FsmkitError, match="not-certified"):
        require_options(options)
    require_options(replace(options, time="discrete", search=Search.AUTO, storage=Storage.EXACT))


def test_a_missing_node_is_reported(system: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(shutil, "which", lambda _: None)
    assert not check_certificate(system, system, parameters={})["accepted"]
    file = system.with_name("system.cert")
    file.write_text(certified(system, "untimed")[0].text, encoding="utf-8")
    with pytest.raises(FsmkitError, match="no-node"):
        check_certificate(file, system, parameters={})


READ = """
const {readCertificate} = require(process.argv[1]);
const files = JSON.parse(require('node:fs').readFileSync(0, 'utf8'));
const reasons = files.map((file) => {
  try {
    readCertificate(Buffer.from(file, 'base64'));
    return '';
  } catch (error) {
    return error.message;
  }
});
console.log(JSON.stringify(reasons));
"""


def reasons(files: list[bytes]) -> list[str]:
    """Return why the checker rejects each file before it performs steps; empty if it does not."""
    given = json.dumps([base64.b64encode(file).decode() for file in files])
    words = [needs.tool("node"), "-e", READ, str(CHECKER)]
    done = subprocess.run(words, input=given, stdout=subprocess.PIPE, text=True, check=True)
    found: list[str] = json.loads(done.stdout)
    return found


@pytest.mark.cc
@pytest.mark.external
def test_edits_of_any_byte_are_rejected(system: Path) -> None:
    made, _ = certified(system, "untimed")
    content = made.text.encode()
    choose = random.Random(41)
    files = [content]
    for _ in range(EDITS):
        place = choose.randrange(len(content))
        other = bytes([choose.choice([b for b in range(256) if b != content[place]])])
        rest = choose.choice([content[place + 1 :], content[place:]])
        files.append(content[:place] + choose.choice([other, b""]) + rest)
    files = [files[0], *(file for file in files[1:] if file != content)]
    whole, *edited = reasons(files)
    assert whole == ""
    assert len(edited) > EDITS // 2
    assert all(edited)


@pytest.mark.cc
@pytest.mark.external
def test_files_with_a_right_digest_and_wrong_lines_are_rejected(system: Path) -> None:
    made, _ = certified(system, "untimed")
    lines = made.text.splitlines()[1:-1]
    wrong = {
        "is there twice": [*lines, lines[-1]],
        "a local state is there twice": [lines[0], *lines],
        "a number of no local state": [*lines, "[0,99]"],
        "not a number for each machine": [*lines, "[0]"],
        "is not a state": [*lines, "[0,true]"],
        "is of no machine": ['{"machine":2}', *lines],
    }
    found = reasons([resealed(made.text, each).encode() for each in wrong.values()])
    for expected, reason in zip(wrong, found, strict=True):
        assert expected in reason


@pytest.mark.cc
@pytest.mark.external
@pytest.mark.slow
def test_the_checker_accepts_a_certificate_and_rejects_others(system: Path) -> None:
    needs.tool("node")
    made, _ = certified(system, "discrete")
    file = system.with_name("system.cert")

    def reason(text: str) -> str:
        file.write_text(text, encoding="utf-8")
        found = check_certificate(file, system, parameters={})
        return "" if found["accepted"] else str(found["reason"])

    assert reason(made.text) == ""
    lines = made.text.splitlines()[1:-1]
    assert "missing" in reason(resealed(made.text, lines[:-1]))
    system.write_text(SYSTEM.replace("worker.count <= 3", "worker.count <= 4"), encoding="utf-8")
    assert "another system" in reason(made.text)
