"""Mistakes that people make, in both notations: each message names the cause and a way out."""

from __future__ import annotations

from pathlib import Path
from shutil import copy

import pytest

from fsmkit.cli import execute
from fsmkit.runtime.endless_steps import final_cycle
from tests.cli.mistakes.table import COMMANDS, MISTAKES

NOTATIONS = ("yaml", "scxml")
FILES = Path(__file__).parent / "mistakes"
KNOWN = [
    (name, notation)
    for name, mistake in MISTAKES.items()
    for notation, edit in zip(NOTATIONS, (mistake.yaml, mistake.scxml), strict=True)
    if edit is not None
]


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Stand in a folder with the files that have no mistake."""
    for path in FILES.glob("g*.*ml"):
        copy(path, tmp_path)
    copy(FILES / "line.yaml", tmp_path)
    (tmp_path / "empty").mkdir()
    (tmp_path / "chart.json").write_text('{"chart": "X"}', encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def verb_for(file: str) -> list[str]:
    """Return how a file is read."""
    if file.endswith(".test.yaml"):
        return ["test", file]
    if file.endswith(".c.yaml"):
        return ["check", file]
    return ["show", "gate.yaml" if file.endswith(".toml") else file, "--strict"]


def lines_of(err: str, kind: str) -> list[str]:
    """Return what findings say, or the ways out of them."""
    marks = ("error[", "warning[") if kind == "cause" else ("= help: ", "Error: ")
    return [line for line in err.splitlines() if line.strip().startswith(marks)]


@pytest.mark.parametrize("file", ["gate.yaml", "gate.scxml", "line.yaml", "guard.yaml"])
def test_without_a_mistake_nothing_is_told(
    file: str, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert execute(["show", str(folder / file), "--strict"]) == 0
    assert not capsys.readouterr().err


@pytest.mark.parametrize(("name", "notation"), KNOWN)
def test_a_mistake_is_told(
    name: str, notation: str, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    mistake = MISTAKES[name]
    place = NOTATIONS.index(notation)
    file = f"gate.{notation}" if mistake.file == "gate" else mistake.file
    (was, wrong) = (mistake.yaml, mistake.scxml)[place] or ("", "")
    source = FILES / ("project.toml" if file == "fsmkit.toml" else file)
    text = source.read_text(encoding="utf-8")
    assert was in text
    (folder / file).write_text(text.replace(was, wrong, 1), encoding="utf-8")
    code = execute(verb_for(file))
    err = capsys.readouterr().err
    assert code == (1 if "error[" in err else 0)
    cause, way_out = (w if isinstance(w, str) else w[place] for w in mistake[3:5])
    assert any(cause in line for line in lines_of(err, "cause")), err
    assert any(way_out in line for line in lines_of(err, "way out")), err
    assert mistake.place in err


@pytest.mark.parametrize("name", COMMANDS)
def test_a_mistake_of_the_command_line_is_told(
    name: str, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    del folder
    arguments, code, cause, way_out = COMMANDS[name]
    assert execute(arguments) == code
    err = " ".join(capsys.readouterr().err.split())
    assert cause in err
    assert way_out in err


def test_there_are_enough() -> None:
    assert len(MISTAKES) + len(COMMANDS) >= 97
    assert sum(m.yaml is not None and m.scxml is not None for m in MISTAKES.values()) >= 97


SET = """\
chart: A
events: {in: [set(v 0..9), post, wait(t 0..3), go]}
inputs: {lamp: bool}
initial: a
states: {a: {on: {set: b}}, b: {on: {post: a, wait: a, go: a}}}
"""


@pytest.mark.parametrize("target", ["interpreter", "python"])
def test_an_event_of_any_name_can_be_posted(
    target: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    chart = tmp_path / "set.yaml"
    chart.write_text(SET, encoding="utf-8")
    events = "post set v=3; post post; post wait 2; go; set lamp true; post set 4"
    assert execute(["run", str(chart), "--events", events, "--trace", "-t", target]) == 0
    steps = [line for line in capsys.readouterr().out.splitlines() if "> event" in line]
    assert steps == [
        "@0 > event set 3",
        "@0 > event post",
        "@0 > event wait 2",
        "@0 > event go",
        "@0 > event set 4",
    ]


@pytest.mark.parametrize("line", ["set v=3", "post", "wait"])
def test_the_way_to_post_is_told(
    line: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    chart = tmp_path / "set.yaml"
    chart.write_text(SET, encoding="utf-8")
    assert execute(["run", str(chart), "--events", line]) == 1
    assert f"to post the event: `post {line}`" in capsys.readouterr().err


def test_post_in_a_system(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "set.yaml").write_text(SET, encoding="utf-8")
    system = tmp_path / "s.yaml"
    system.write_text("system: S\nmachines: {m: set.yaml}\n", encoding="utf-8")
    assert execute(["run", str(system), "--events", "post m.set v=3; m.post; m.set 4"]) == 0
    told = capsys.readouterr().out
    assert [line for line in told.splitlines() if "0ms" in line] == [
        "m      0ms  start",
        "m      0ms  set v=3",
        "m      0ms  post",
        "m      0ms  set v=4",
    ]


def test_time_to_wait_has_a_unit(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    chart = tmp_path / "set.yaml"
    chart.write_text(SET, encoding="utf-8")
    assert execute(["run", str(chart), "--events", "wait 5sec"]) == 1
    assert "`sec` is not a unit; units are us, ms, s, m, h, d" in capsys.readouterr().err
    assert execute(["run", str(chart), "--events", "wait 1d"]) == 0


@pytest.mark.cc
def test_each_transition_that_is_never_taken_is_told_with_its_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "gate.yaml").write_text(
        "chart: G\nevents: {in: [go, no]}\ninitial: a\nstates:\n  a:\n    on:\n      go: b\n"
        "      no: a\n  b:\n    after: {1s: a}\n    on:\n      no: a\n",
        encoding="utf-8",
    )
    system = tmp_path / "s.yaml"
    system.write_text(
        "system: S\nmachines: {m: gate.yaml}\nenvironment: {may: [m.go]}\n", encoding="utf-8"
    )
    execute(["check", str(system)])
    told = capsys.readouterr().err
    gate = tmp_path / "gate.yaml"
    assert f"never takes 2 of its transitions: of `a` at {gate}:8, of `b` at {gate}:12" in told


LOOPS = {
    "two": (
        "  b: {always: c}\n  c: {always: b}\n",
        ["b -> c (loop.yaml:6)", "c -> b (loop.yaml:7)"],
    ),
    "itself": ("  b: {always: {target: b, do: n = 1}}\n", ["b -> b (loop.yaml:6)"]),
    "three, after a way to them": (
        "  b: {always: c}\n  c: {always: d}\n  d: {always: e}\n  e: {always: c}\n",
        ["c -> d (loop.yaml:7)", "d -> e (loop.yaml:8)", "e -> c (loop.yaml:9)"],
    ),
}


@pytest.mark.cc
@pytest.mark.parametrize("name", LOOPS)
def test_a_fault_of_microsteps_names_the_cycle(
    name: str,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    states, cycle = LOOPS[name]
    monkeypatch.chdir(tmp_path)
    head = "chart: Loop\nevents: {in: [go]}\ndata: {n: 0..99 = 0}\nstates:\n  a: {on: {go: b}}\n"
    Path("loop.yaml").write_text(head + states, encoding="utf-8")
    for arguments in (["run", "loop.yaml", "--events", "go"], ["check", "loop.yaml"]):
        assert execute(arguments) == 1
        told = capsys.readouterr()
        assert f"round and round: {', '.join(cycle)}" in told.out


@pytest.mark.parametrize(
    ("taken", "found"),
    [((), ()), ((1,), ()), ((1, 2, 3), ()), ((4, 1, 1), (1,)), ((1, 2, 1, 2), (1, 2))],
)
def test_what_ends_twice_is_a_round(taken: tuple[int, ...], found: tuple[int, ...]) -> None:
    assert final_cycle(taken) == found
