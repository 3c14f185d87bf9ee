"""Text that a terminal obeys, or that UTF-8 cannot hold, in what commands print and write."""

from __future__ import annotations

import json
import os
import sys
from pathlib import Path

import pytest

from fsmkit.cli import execute
from fsmkit.cli.common.console import crash
from fsmkit.emit.lines import json_text

CHART = "chart: Gate\nevents: {in: [go]}\ninitial: a\nstates: {a: {on: {go: a}}}\n"
SIGNS = [*range(0x20), *range(0x7F, 0xA0), 0xAD, 0x61C, *range(0x200B, 0x2010)]
SIGNS += [*range(0x2028, 0x202F), *range(0x2060, 0x2070), 0xFEFF, 0xD800, 0xDFFF]


def test_json_holds_no_character_that_a_terminal_obeys() -> None:
    document = {f"k{code:x}{chr(code)}": [chr(code), f"x{chr(code)}y"] for code in SIGNS}
    text = json_text(document)
    assert text.replace("\n", "").isprintable()
    assert json.loads(text) == document
    assert "Tür" in json_text({"name": "Tür"})


def test_findings_as_json_are_printable(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "campaign.yaml"
    file.write_text('campaign: n\nruns:\n  - {check: "x\\u001b]0;t\\u009b31m\\u202ey"}\n')
    assert execute(["campaign", str(file), "--json"]) == 1
    printed = capsys.readouterr().out
    assert printed.replace("\n", "").isprintable()
    assert "\u202e" in json.loads(printed)["findings"][0]["message"]


@pytest.mark.skipif(sys.platform == "win32", reason="paths are text there")
@pytest.mark.parametrize(
    "command",
    [
        pytest.param(("simulate", "--out", "OUT/x.html"), marks=pytest.mark.external),
        ("compile", "--out", "OUT"),
        ("compile", "--target", "python", "--out", "OUT"),
        ("compile", "--target", "javascript", "--out", "OUT"),
        ("convert", "--to", "scxml", "--out", "OUT/x.scxml"),
        ("draw", "--out", "OUT/x.mmd"),
        ("show", "--json"),
        ("run", "--events", "go", "--json"),
    ],
)
def test_a_path_may_hold_bytes_that_are_no_text(command: tuple[str, ...], tmp_path: Path) -> None:
    folder = Path(os.fsdecode(os.fsencode(tmp_path) + b"/x\xff"))
    folder.mkdir()
    file = folder / os.fsdecode(b"g\xfe.yaml")
    file.write_text(CHART, encoding="utf-8")
    verb, *more = command
    assert execute([verb, str(file), *(w.replace("OUT", str(tmp_path)) for w in more)]) == 0


def test_a_report_of_a_bug_takes_any_message(capsys: pytest.CaptureFixture[str]) -> None:
    assert crash(ValueError("a \udcff b")) == 3
    place = Path(capsys.readouterr().err.split("the report is in ")[1].replace("\n", ""))
    assert "\\udcff" in place.read_text(encoding="utf-8")
    place.unlink()
