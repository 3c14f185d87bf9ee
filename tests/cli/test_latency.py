"""`fsmkit latency`: percentiles of loops, a picture, and files that are something else."""

from __future__ import annotations

import json
from importlib.util import find_spec
from pathlib import Path

import pytest
from lxml import etree

from fsmkit.cli import execute
from fsmkit.diagnostics import FsmkitError
from fsmkit.runtime.latency import draw_latencies, read_latency
from tests.needs import need

LOOP = {
    "kind": "fsm_posix",
    "period_ns": 1000000,
    "cycles": 1000,
    "overruns": 3,
    "missed": 3,
    "worst_jitter_ns": 1500000,
    "reasons": {"woken late": 2, "step long": 0, "preempted": 1, "page fault": 0},
    "jitter_ns": [[10000, 10500, 990], [100000, 104000, 9], [1500000, 1550000, 1]],
}
CYCLICTEST = {
    "rt_test_version:": "2.40",
    "thread": {
        "0": {"histogram": {"9": 600, "20": 300}, "cycles": 900, "max": 20},
        "1": {"histogram": {"9": 98, "7": 1}, "cycles": 100, "max": 77777},
    },
}


def written(path: Path, document: object) -> Path:
    path.write_text(document if isinstance(document, str) else json.dumps(document), "utf-8")
    return path


def test_percentiles(tmp_path: Path) -> None:
    loop = read_latency(written(tmp_path / "a.json", LOOP))
    assert [loop.percentile(p) for p in (5000, 9900, 9990, 10000)] == [
        10499,
        10499,
        103999,
        1500000,
    ]
    other = read_latency(written(tmp_path / "b.json", CYCLICTEST))
    assert other.cycles == 1000
    assert [other.percentile(p) for p in (1, 5000, 9900)] == [7999, 9999, 20999]
    assert other.percentile(10000) == 77_777_000  # beyond the histogram


def test_the_table_and_what_a_program_prints_after_the_report(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    loop = written(tmp_path / "loop[red].json", json.dumps(LOOP) + "\n[1, 2, 3]\n")
    other = written(tmp_path / "cyclictest.json", CYCLICTEST)
    assert execute(["latency", str(loop), str(other)]) == 0
    out = capsys.readouterr().out
    assert "loop[red]".ljust(11) + "   1,000  10.5  10.5  104.0   1,500.0         3" in out
    assert "overruns of loop[red]: woken late 2, preempted 1" in out
    assert execute(["latency", str(loop), "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert document["reports"][0]["late_ns"] == {"p50": 10499, "p99": 10499, "p99.9": 103999}


@pytest.mark.external
def test_the_picture(tmp_path: Path) -> None:
    need(find_spec("matplotlib") is not None, "matplotlib")
    reports = [
        read_latency(written(tmp_path / "$a&<b>.json", LOOP)),
        read_latency(written(tmp_path / "b.json", CYCLICTEST)),
    ]
    picture = draw_latencies(reports, "svg")
    assert etree.fromstring(picture).tag.endswith("svg")
    assert picture == draw_latencies(reports, "svg")


@pytest.mark.parametrize(
    "document",
    [
        "",
        "[]",
        "{",
        "[" * 100_000,
        {"kind": "fsm_posix"},
        LOOP | {"jitter_ns": [[1, 1, 5]]},
        LOOP | {"jitter_ns": [[9, 10, 5], [1, 2, 3]]},
        LOOP | {"jitter_ns": [["a", 2, 3]]},
        LOOP | {"reasons": 7},
        CYCLICTEST | {"thread": {"0": {"max": 3}}},
        CYCLICTEST | {"thread": []},
    ],
)
def test_other_content_is_refused(document: object, tmp_path: Path) -> None:
    with pytest.raises(FsmkitError) as refused:
        read_latency(written(tmp_path / "x.json", document))
    assert refused.value.diagnostics[0].rule.name == "bad-latency-report"


def test_refusals_of_the_verb(tmp_path: Path) -> None:
    loop = str(written(tmp_path / "loop.json", LOOP))
    assert execute(["latency", loop, "--out", "late.txt"]) == 2
    assert execute(["latency", str(tmp_path / "none.json")]) == 1
