from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from fsmkit.cli import USAGE, execute
from fsmkit.cli.common.editor import editor
from fsmkit.diagnostics import FsmkitError


@pytest.mark.parametrize(
    ("command", "words"),
    [
        ("{python} -g {{file}}:{{line}}", ["-g", "{file}:7"]),
        ("{python} +{{line}}", ["+7", "{file}"]),
        ("{python} '; rm -rf {{line}}'", ["; rm -rf 7", "{file}"]),
    ],
)
def test_words_are_filled_in_and_no_shell_reads_them(
    command: str, words: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    started: list[list[str]] = []

    def start(words: list[str], **_: Any) -> None:
        started.append(words)

    monkeypatch.setattr(subprocess, "Popen", start)
    file = tmp_path / "-{line} a.yaml"
    editor(command.format(python=sys.executable))(file, 7)
    assert started == [[sys.executable, *(word.replace("{file}", str(file)) for word in words)]]


@pytest.mark.parametrize("command", ["", "no-such-editor {file}", "code '"])
def test_a_command_that_cannot_be_is_an_option_used_wrongly(command: str, tmp_path: Path) -> None:
    with pytest.raises(FsmkitError):
        editor(command)
    chart = tmp_path / "a.yaml"
    chart.write_text("chart: A\ninitial: a\nstates:\n  a:\n", encoding="utf-8")
    assert execute(["serve", str(chart), "--open-with", command]) == USAGE
