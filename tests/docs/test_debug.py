"""The page on debugging: its settings are JSON, and it names all that can be launched and typed."""

from __future__ import annotations

import json
import re
from pathlib import Path

import msgspec

from fsmkit.inspector.dap.console import LINES
from fsmkit.inspector.dap.launching import Launch
from fsmkit.inspector.dap.stops import counting

PAGE = (Path(__file__).parents[2] / "docs/how-to/debug.md").read_text(encoding="utf-8")


def test_the_settings_are_json_and_what_is_launched_is_taken() -> None:
    manifest, launch = (
        json.loads(text) for text in re.findall(r"```json\n(.*?)```", PAGE, re.DOTALL)
    )
    (debugger,) = manifest["contributes"]["debuggers"]
    assert [debugger["runtime"], *debugger["runtimeArgs"]] == ["fsmkit", "dap"]
    for configuration in launch["configurations"]:
        assert configuration["type"] == debugger["type"]
        assert msgspec.convert(configuration, Launch).program


def test_each_key_of_a_launch_is_described() -> None:
    rows = re.findall(r"^\| `(\w+)` \|", PAGE, re.MULTILINE)
    assert rows == [field.encode_name for field in msgspec.structs.fields(Launch)]


def test_the_console_is_shown_as_it_is() -> None:
    assert f"```\n{LINES}\n```" in PAGE


def test_hit_counts_that_are_named_count() -> None:
    (row,) = (line for line in PAGE.splitlines() if line.startswith("| hit count"))
    for count in re.findall(r"`([^`]+)`", row):
        assert counting(count)
