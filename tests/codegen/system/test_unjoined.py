"""A target that does not connect the machines of a system says so."""

from __future__ import annotations

from pathlib import Path

import pytest

from fsmkit.cli import execute

FILES = {
    "one.yaml": "chart: One\nevents: {in: [go], out: [gone]}\n"
    "states: {s: {on: {go: {do: send gone}}}}\n",
    "two.yaml": "chart: Two\nevents: {in: [gone]}\nstates: {s: {on: {gone: {}}}}\n",
    "both.yaml": "system: Both\nmachines: {one: one.yaml, two: two.yaml}\n"
    "connect: [one.gone -> two.gone]\n",
    "apart.yaml": "system: Apart\nmachines: {one: one.yaml, two: two.yaml}\n",
    "nodes.yaml": "system: both.yaml\nnodes: {a: [one], b: [two]}\n",
}


@pytest.mark.parametrize(
    ("file", "target", "runner"),
    [
        ("both", "python", "SystemSession"),
        ("both", "javascript", "SystemSession"),
        ("both", "transitions", "SystemSession"),
        pytest.param("both", "pyext", "SystemSession", marks=pytest.mark.cc),
        ("nodes", "python", "fsmkit.Node"),
        ("nodes", "javascript", "fsmkit.Node"),
        ("both", "c", None),
        ("nodes", "c", None),
        ("apart", "python", None),
        ("one", "python", None),
    ],
)
def test_unconnected_machines_are_a_note(
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    file: str,
    target: str,
    runner: str | None,
) -> None:
    for name, text in FILES.items():
        (tmp_path / name).write_text(text)
    out = tmp_path / "out"
    command = ["compile", str(tmp_path / f"{file}.yaml"), "--target", target, "--out", str(out)]
    assert execute(command) == 0
    told = " ".join("".join(capsys.readouterr()).split())
    assert ("note[FK0571]" in told) == (runner is not None)
    assert runner is None or runner in told
