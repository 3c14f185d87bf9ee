"""``--watch``: a verb runs again after a change of a file it read, and goes on after errors."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from threading import Event, Thread
from typing import Any

import pytest

from fsmkit.chart.loading import Stamp, stamp
from fsmkit.cli import execute
from fsmkit.cli.common import watching
from fsmkit.cli.common.interrupts import start_time

BASE = "chart: Base\ninitial: a\nstates: {a: {}}\n"
DERIVED = "chart: D\nextends: base.yaml\n"


def edits(
    *steps: Callable[[Mapping[Path, Stamp]], object],
) -> Callable[[Mapping[Path, Stamp]], None]:
    """Return what stands for waiting: each time a step, and after them an interrupt."""
    left = list(steps)

    def wait(stamps: Mapping[Path, Stamp]) -> None:
        if not left:
            raise KeyboardInterrupt
        left.pop(0)(stamps)
        assert watching.has_changed(stamps)

    return wait


def test_a_verb_runs_again_when_a_base_changes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    base, derived = tmp_path / "base.yaml", tmp_path / "d.yaml"
    base.write_text(BASE)
    derived.write_text(DERIVED)

    def rename(stamps: Mapping[Path, Stamp]) -> None:
        assert set(stamps) == {base, derived}
        base.write_text(BASE.replace("a", "other"))

    def break_it(stamps: Mapping[Path, Stamp]) -> None:
        del stamps
        base.write_text("chart: [")

    def mend(stamps: Mapping[Path, Stamp]) -> None:
        del stamps
        base.write_text(BASE.replace("a:", "mended:").replace(": a", ": mended"))

    monkeypatch.setattr(watching, "wait", edits(break_it, mend, rename))
    assert execute(["draw", "--watch", str(derived)]) == 130
    told = capsys.readouterr()
    assert told.out.count("digraph") == 2
    assert "mended" in told.out
    assert "broken-yaml" in told.err
    assert told.err.count("watching") == 4
    before = time.monotonic()
    assert start_time() >= before  # the clock of the repetitions ended with them


def test_folders_and_the_project_file_are_watched(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "charts" / "in").mkdir(parents=True)
    (tmp_path / "charts" / "a.yaml").write_text(BASE.replace("{a: {}}", "{a: {rest: true}}"))
    (tmp_path / "fsmkit.toml").write_text("")

    def add(stamps: Mapping[Path, Stamp]) -> None:
        assert tmp_path / "fsmkit.toml" in stamps
        (tmp_path / "charts" / "in" / "b.yaml").write_text("chart: [")

    def set_up(stamps: Mapping[Path, Stamp]) -> None:
        del stamps
        (tmp_path / "fsmkit.toml").write_text('exclude = ["charts/in"]\n')

    monkeypatch.setattr(watching, "wait", edits(add, set_up))
    monkeypatch.setattr("fsmkit.cli.proving.check.evaluate_file", _unexplored)
    assert execute(["check", "--watch", str(tmp_path / "charts")]) == 130
    assert capsys.readouterr().err.count("not-a-chart") == 4


def _unexplored(file: Path, **more: Any) -> None:
    from fsmkit.diagnostics import fail

    del more
    raise fail("not-a-chart", f"`{file}` is not explored here")


@pytest.mark.parametrize("has_package", [True, False])
def test_a_change_ends_the_wait(
    has_package: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    if has_package:
        pytest.importorskip("watchfiles")
    else:
        monkeypatch.setitem(sys.modules, "watchfiles", None)
    file, done = tmp_path / "a.yaml", Event()
    file.write_text(BASE)
    stamps = {file: stamp(file), tmp_path / "missing.yaml": None}

    def change() -> None:
        while not done.wait(0.01):
            if stamp(file) == stamps[file]:
                file.write_text(f"{BASE}# changed\n")

    thread = Thread(target=change)
    thread.start()
    watching.wait(stamps)
    done.set()
    thread.join()
    assert watching.has_changed(stamps)


def test_json_is_one_document(capsys: pytest.CaptureFixture[str]) -> None:
    for verb in ("check", "draw", "compile", "test"):
        assert execute([verb, "--watch", "--json", "a.test.yaml"]) == 2
        assert "--watch does not go with --json" in capsys.readouterr().err
