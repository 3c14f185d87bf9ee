"""``fsmkit fmt``: files are written only if they change, and only if they mean the same."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from fsmkit.cli import execute

SPOILT = "chart:   A\nstates: {a: {}}\ninitial: a\n"
USUAL = "chart: A\ninitial: a\nstates: {a: {}}\n"


def test_a_file_is_written_once(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "a.yaml"
    file.write_bytes(b"\xef\xbb\xbf" + SPOILT.replace("\n", "\r\n").encode())
    assert execute(["fmt", "--check", str(file)]) == 1
    assert f"would change {file}" in capsys.readouterr().out
    assert file.read_bytes().startswith(b"\xef\xbb\xbfchart:   A\r\n")
    assert execute(["fmt", str(file)]) == 0
    assert f"formatted {file}" in capsys.readouterr().out
    assert file.read_bytes() == b"\xef\xbb\xbf" + USUAL.replace("\n", "\r\n").encode()
    before = file.stat().st_mtime_ns
    assert execute(["fmt", "--check", str(file)]) == execute(["fmt", str(file)]) == 0
    assert file.stat().st_mtime_ns == before


def test_folders_are_searched_and_broken_files_are_reported(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for name, text in {"a": SPOILT, "b": "chart: [\n", "c": USUAL, "d": "other:   1\n"}.items():
        (tmp_path / f"{name}.yaml").write_text(text)
    assert execute(["fmt", "--json", str(tmp_path)]) == 1
    told = json.loads(capsys.readouterr().out)
    assert told["changed"] == [str(tmp_path / "a.yaml")]
    assert [one["rule"] for one in told["findings"]] == ["broken-yaml"]
    assert told["files"] == 3
    assert (tmp_path / "a.yaml").read_text() == USUAL
    assert (tmp_path / "b.yaml").read_text() == "chart: [\n"
    assert (tmp_path / "d.yaml").read_text() == "other:   1\n"


def test_a_chart_with_an_error_is_formatted_all_the_same(tmp_path: Path) -> None:
    file = tmp_path / "a.yaml"
    file.write_text(SPOILT.replace("a: {}", "a: {on: {go: nowhere}}"))
    assert execute(["fmt", str(file)]) == 0
    assert file.read_text() == USUAL.replace("a: {}", "a: {on: {go: nowhere}}")


def test_a_file_that_would_mean_another_thing_is_left_as_it_is(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "a.yaml"
    file.write_text(SPOILT)
    monkeypatch.setattr(
        "fsmkit.cli.writing.fmt.format_source", lambda text, _: text.replace("{a:", "{b:")
    )
    assert execute(["fmt", str(file)]) == 1
    assert "not-formatted" in capsys.readouterr().err
    assert file.read_text() == SPOILT


def test_other_encodings_and_suffixes_are_errors(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "a.yaml"
    file.write_text(SPOILT, encoding="utf-16")
    assert execute(["fmt", str(file)]) == 1
    assert "save the file as UTF-8" in capsys.readouterr().err
    text = tmp_path / "a.txt"
    text.write_text(SPOILT)
    assert execute(["fmt", str(text)]) == 1
    assert "unknown-suffix" in capsys.readouterr().err
