from __future__ import annotations

import json
from pathlib import Path

import pytest

from fsmkit.chart.drawing.graphviz import bundled
from fsmkit.cli import execute
from tests.needs import need

CELL = Path(__file__).parents[2] / "machines/production_cell"
FEEDER = str(CELL / "feeder.yaml")


def test_prints_dot(capsys: pytest.CaptureFixture[str]) -> None:
    assert execute(["draw", FEEDER, "--active", "pushing, error"]) == 0
    text = capsys.readouterr().out
    assert text.startswith('digraph "Feeder" {')
    assert text.count("#ffd66b") == 2


def test_writes_texts(tmp_path: Path) -> None:
    outs = [tmp_path / f"new/feeder.{suffix}" for suffix in ("dot", "mmd", "puml")]
    assert execute(["draw", FEEDER, *(word for out in outs for word in ("--out", str(out)))]) == 0
    first = [out.read_text().splitlines()[0] for out in outs]
    assert first == ['digraph "Feeder" {', "---", "@startuml"]


@pytest.mark.external
@pytest.mark.usefixtures("dot")
@pytest.mark.parametrize(
    ("suffix", "head"), [("svg", b"<?xml"), ("png", b"\x89PNG"), ("pdf", b"%PDF")]
)
def test_writes_pictures(suffix: str, head: bytes, tmp_path: Path) -> None:
    out = tmp_path / f"feeder.{suffix}"
    assert execute(["draw", FEEDER, "--out", str(out)]) == 0
    assert out.read_bytes().startswith(head)


def test_json(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "feeder.mmd"
    assert execute(["draw", FEEDER, "--json", "--out", str(out)]) == 0
    assert json.loads(capsys.readouterr().out) == {"chart": "Feeder", "files": [str(out)]}


@pytest.mark.parametrize(
    ("missing", "messages"),
    [
        (None, ("a PNG needs Graphviz's `dot`, which is not installed", "draw `.svg`, or install")),
        ("no module is here", ("drawings need Graphviz: `dot` is not installed, and no module",)),
    ],
)
def test_without_graphviz(
    missing: str | None,
    messages: tuple[str, ...],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    if missing is None:
        need(bundled.missing_part() is None, "Graphviz as WebAssembly (`make graphviz`)")
    monkeypatch.setattr(bundled, "missing_part", lambda: missing)
    outs = [tmp_path / "a.mmd", tmp_path / "a.png"]
    assert execute(["draw", FEEDER, "--out", str(outs[0]), "--out", str(outs[1])]) == 1
    printed = capsys.readouterr().err
    assert all(message in printed for message in messages)
    assert not any(out.exists() for out in outs)


@pytest.mark.parametrize(
    ("arguments", "code", "rule", "advice"),
    [
        (["--active", "pushin"], 2, "unknown-name", "did you mean `pushing`?"),
        (["--out", "a.gif"], 2, "unknown-suffix", ".svg"),
        (["--out", "/dev/null/a.mmd"], 1, "unwritable-output", "--out"),
    ],
)
def test_what_goes_wrong(
    arguments: list[str], code: int, rule: str, advice: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert execute(["draw", FEEDER, *arguments]) == code
    printed = capsys.readouterr().err
    assert rule in printed
    assert advice in printed


@pytest.mark.slow
def test_a_picture_has_a_limit(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Graphviz does not end in a reasonable time; a text is written whatever its size."""
    states = "".join(f"  s{n}: {{on: {{go: s{n + 1}}}}}\n" for n in range(2_000))
    chart = tmp_path / "large.yaml"
    chart.write_text(
        f"chart: Large\nevents: {{in: [go]}}\ninitial: s0\nstates:\n{states}  s2000: {{}}\n",
        encoding="utf-8",
    )
    assert execute(["draw", str(chart), "--out", str(tmp_path / "large.svg")]) == 1
    assert "2,001 states are too many for a picture" in capsys.readouterr().err
    assert execute(["draw", str(chart), "--out", str(tmp_path / "large.dot")]) == 0
