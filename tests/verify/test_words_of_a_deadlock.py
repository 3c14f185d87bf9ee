"""What is said of a deadlock is true where an event of the environment can still come."""

from __future__ import annotations

from pathlib import Path

import pytest

from fsmkit.cli import execute

CHART = """
chart: Counter
data: {n: 0..2 wrap = 0}
events: {in: [tick]}
environment: {ENVIRONMENT}
initial: a
states:
  a: {on: {tick: {do: n += 1}}}
"""


@pytest.mark.parametrize(
    ("environment", "code", "words"),
    [
        ("may: [tick]", 1, "except for events under `may`"),
        ("will: [tick]", 0, ""),
        ("may: []", 1, "nothing can ever happen again"),
    ],
)
def test_an_event_that_may_come_is_named(
    environment: str, code: int, words: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "counter.yaml"
    path.write_text(CHART.replace("ENVIRONMENT", environment))
    assert execute(["check", str(path), "--engine", "python"]) == code
    assert words in capsys.readouterr().err
