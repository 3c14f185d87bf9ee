"""Everything declared is counted against one limit, lowered here so that the charts are small."""

from __future__ import annotations

from pathlib import Path

import pytest

from devtools.sizes import BY_NAME
from fsmkit.chart import limits
from fsmkit.chart.loading import load
from fsmkit.diagnostics import FsmkitError

LARGEST = {
    "data": ("DECLARED", 60),
    "inputs": ("DECLARED", 60),
    "constants": ("DECLARED", 60),
    "members": ("DECLARED", 60),
    "operations": ("DECLARED", 60),
    "functions": ("DECLARED", 60),
    "properties": ("DECLARED", 60),
    "invocations": ("DECLARED", 60),
    "fields": ("FIELDS", 60),
    "record_fields": ("FIELDS", 60),
    "parameters": ("FIELDS", 60),
    "states": ("STATES", 60),
    "events": ("EVENTS", 57),  # with those of errors
    "strings": ("NUMBERED", 55),  # with the empty string and the names of four events
    "transitions": ("NUMBERED", 59),  # with the initial one
}
"""The limit of each counted thing, and the size that has 60 of what is limited."""


@pytest.mark.parametrize("kind", LARGEST)
def test_one_more_than_the_limit_is_rejected(
    kind: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    limit, size = LARGEST[kind]
    monkeypatch.setattr(limits, f"MOST_{limit}", 60)
    load(BY_NAME[kind](size).write(tmp_path))
    with pytest.raises(FsmkitError, match="too-large") as caught:
        load(BY_NAME[kind](size + 1).write(tmp_path))
    assert "there are 61 " in str(caught.value)
    assert "but at most 60 are allowed" in str(caught.value)


def recorded(histories: int, regions: int) -> str:
    """Return a chart with deep histories, each of which records all regions and their parent."""
    rows = "".join(f"      r{n}: {{states: {{a{n}: {{}}}}}}\n" for n in range(regions))
    listed = "".join(f"    h{n}: {{history: deep, default: p}}\n" for n in range(histories))
    return (
        f"chart: Deep\nevents: {{in: [go]}}\ninitial: c\nstates:\n c:\n  initial: p\n  states:\n"
        f"{listed}    p:\n     regions:\n{rows}"
    )


def test_what_histories_record_is_counted(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "deep.yaml"
    monkeypatch.setattr(limits, "MOST_NUMBERED", 5 + 1 + 6 * (5 + 1))
    path.write_text(recorded(6, 5), encoding="utf-8")
    load(path)
    path.write_text(recorded(7, 5), encoding="utf-8")
    with pytest.raises(FsmkitError, match="there are 48 regions and regions recorded by histories"):
        load(path)


def test_invoked_machines_are_counted_at_all_levels(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for level in range(3):
        slots = "".join(
            f"  s{n}: {{invoke: {{id: i{n}, src: c{level + 1}.yaml}}}}\n" for n in range(3)
        )
        text = f"chart: C{level}\ncapacity: {{queue: 4}}\ninitial: s0\nstates:\n{slots}"
        (tmp_path / f"c{level}.yaml").write_text(text, encoding="utf-8")
    (tmp_path / "c3.yaml").write_text("chart: End\nstates: {a: {}}\n", encoding="utf-8")
    monkeypatch.setattr(limits, "MOST_DECLARED", 3 + 9 + 27)
    load(tmp_path / "c0.yaml")
    monkeypatch.setattr(limits, "MOST_DECLARED", 3 + 9 + 26)
    with pytest.raises(FsmkitError, match="there are 39 invoked machines of all levels"):
        load(tmp_path / "c0.yaml")
