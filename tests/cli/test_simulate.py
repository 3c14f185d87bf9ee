"""``fsmkit simulate``: one file, its policy, scenarios, and what is refused."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from fsmkit.cli import execute
from tests.inspector.conftest import GATE, undrawn  # noqa: F401

PAIR = """\
system: Pair
machines: {"m[i in 0..1]": gate.yaml}
connect: ["m[0].opened -> m[1].open"]
environment: {may: ["m[0].open"]}
"""


@pytest.fixture(autouse=True)
def files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    Path("gate.yaml").write_text(GATE, encoding="utf-8")
    Path("pair.yaml").write_text(PAIR, encoding="utf-8")
    return tmp_path


def test_a_page_says_how_large_it_is(capsys: pytest.CaptureFixture[str]) -> None:
    assert execute(["simulate", "gate.yaml", "--out", "gate.html", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    size = Path("gate.html").stat().st_size
    assert told == {
        "name": "Gate", "file": "gate.html", "machines": 1, "scenarios": 0, "bytes": size,
    }  # fmt: skip
    text = Path("gate.html").read_text(encoding="utf-8")
    assert text.count("<script>") == 1
    assert "default-src 'none'; script-src 'sha256-" in text
    assert "http" not in text.replace("http-equiv", "").replace("http://www.w3.org/", "")


def test_no_place_of_this_machine_is_in_the_page(files: Path) -> None:
    assert execute(["simulate", str(files / "pair.yaml"), "--out", "pair.html"]) == 0
    assert str(files) not in Path("pair.html").read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("chart", "script", "actions"),
    [
        (
            "gate.yaml",
            "# a comment\nstart 0\ninput blocked true\npost fault jam\nrun 1000\n",
            [
                {"do": "start"},
                {"do": "set", "m": "Gate", "input": "blocked", "value": True},
                {"do": "post", "m": "Gate", "event": "fault", "with": {"code": "jam"}},
                {"do": "run", "at": 1000},
            ],
        ),
        (
            "pair.yaml",
            "start\npost m[0].fault code=lost\nrun 5\n",
            [
                {"do": "start"},
                {"do": "post", "m": "m[0]", "event": "fault", "with": {"code": "lost"}},
                {"do": "run", "at": 5},
            ],
        ),
    ],
)
def test_scripts_are_scenarios(chart: str, script: str, actions: list[object]) -> None:
    Path("jam.txt").write_text(script, encoding="utf-8")
    assert execute(["simulate", chart, "--out", "x.html", "--script", "jam.txt"]) == 0
    text = Path("x.html").read_text(encoding="utf-8")
    assert json.dumps(actions, separators=(",", ":")) in text


@pytest.mark.parametrize(
    ("chart", "script", "message"),
    [
        ("gate.yaml", "start 5\n", "starts at 0"),
        ("gate.yaml", "start 0\ndispatch open\n", "no line `dispatch`"),
        ("gate.yaml", "start 0\npost opne\n", "there is no event `opne`"),
        ("gate.yaml", "", "nothing in"),
        ("pair.yaml", "start\nwait 5\n", "no line `wait`"),
        ("pair.yaml", "start\npost m[2].open\n", "no event of a machine|no machine"),
    ],
)
def test_what_no_page_does_is_refused(
    chart: str, script: str, message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    Path("bad.txt").write_text(script, encoding="utf-8")
    assert execute(["simulate", chart, "--out", "x.html", "--script", "bad.txt"]) == 1
    told = capsys.readouterr().err
    assert any(part in told for part in message.split("|")), told
    assert not Path("x.html").exists()


def test_a_condition_that_is_none_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    assert execute(["simulate", "gate.yaml", "--out", "x.html", "--break", "cuont == 1"]) != 0
    assert "cuont" in capsys.readouterr().err
    assert execute(["simulate", "gate.yaml"]) == 2
