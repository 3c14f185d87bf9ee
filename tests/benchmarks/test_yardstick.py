"""The yardstick: fixed streams, and hand-written machines that do what the model does."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

from benchmarks.comparison import c_machines, python_machines
from benchmarks.comparison.__main__ import main
from benchmarks.comparison.figures import FSMKIT, LIMIT
from benchmarks.comparison.measure_c import Bench, prepare
from benchmarks.comparison.tools import run
from benchmarks.yardstick.charts import FOLDER, LETTERS, chart_file
from benchmarks.yardstick.model import Digests
from benchmarks.yardstick.streams import Stream, digests_of, make_stream

EXPECTED = {
    "A": Digests("2b0c98f1", "0a56e8ac", "00000000"),
    "B": Digests("8dd62096", "e2a29995", "0f38428c"),
    "C": Digests("ce5b4f02", "6f0db88e", "e41b12fb"),
}
"""The first 100,000 events. Figures of different days compare only if these never change."""
BY_HAND = {"A": ["table"], "B": ["small", "switch"], "C": ["regions"]}
WARNINGS = ("-std=c99", "-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Wshadow", "-Werror")


@pytest.fixture(scope="module", params=LETTERS)
def stream(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Stream:
    return make_stream(request.param, tmp_path_factory.mktemp("stream"), 100_000)


@pytest.mark.slow
def test_the_streams_never_change(stream: Stream) -> None:
    assert stream.digests == EXPECTED[stream.letter]
    assert digests_of(stream, stream.events) == stream.digests
    assert stream.file.read_bytes() == stream.events
    assert set(stream.events) == set(range(len(stream.names)))


@pytest.mark.cc
@pytest.mark.parametrize("letter", LETTERS)
def test_machines_in_c_do_what_the_model_does(
    letter: str, tmp_path: Path, require_tool: Callable[[str], str]
) -> None:
    require_tool("gcc")
    stream = make_stream(letter, tmp_path, 20_000)
    bench = Bench(tmp_path, pytest.fail)
    machines = c_machines.by_hand(letter)
    assert [machine.variant.name for machine in machines] == BY_HAND[letter]
    machines += c_machines.machines(chart_file(letter), c_machines.VARIANTS[:1])[0]
    found = set()
    for machine in machines:
        build = prepare(bench, machine, stream)
        macros = ("-DBENCH_VERIFY", "-DCOUNT=20000u")
        verifier = build.program("verify", build.sources(), *macros)
        found.add(Digests(*run([verifier, stream.file, "verify"], build.folder).split()))
    assert found == {stream.digests}


@pytest.mark.cc
@pytest.mark.parametrize("source", sorted(FOLDER.glob("by_hand/*.c")), ids=lambda path: path.stem)
def test_machines_by_hand_compile_without_a_warning(
    source: Path, tmp_path: Path, require_tool: Callable[[str], str]
) -> None:
    run([require_tool("gcc"), *WARNINGS, "-c", source, "-o", "machine.o"], tmp_path)


@pytest.mark.slow
def test_machines_in_python_do_what_the_model_does(stream: Stream, tmp_path: Path) -> None:
    events = stream.events[:20_000]
    expected = digests_of(stream, events)
    chart = chart_file(stream.letter)
    for machine in (
        python_machines.by_hand(stream, LIMIT),
        python_machines.by_fsmkit(chart, stream, tmp_path, FSMKIT),
    ):
        assert python_machines.is_correct(machine, events, expected), machine.name
        assert not python_machines.is_correct(machine, events, replace(expected, path="0" * 8))


@pytest.mark.slow
@pytest.mark.cc
def test_a_compiler_is_enough(
    tmp_path: Path, require_tool: Callable[[str], str],
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    for tool in ("gcc", "as", "ld", "size"):
        (tmp_path / tool).symlink_to(require_tool(tool))
    monkeypatch.setenv("PATH", str(tmp_path))
    assert main(["--only", "c", "--chart", "A", "--work", str(tmp_path / "work")]) == 0
    printed = capsys.readouterr().out
    assert "table (by hand)" in printed
    assert "WRONG" not in printed
    for tool in ("valgrind", "arm-none-eabi-gcc"):
        assert f"skipped: {tool} is not installed; `make tools` installs it" in printed
