"""The page on campaigns: its files are written, its command run, and prints that."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

PAGE = Path(__file__).parents[2] / "docs/how-to/campaigns.md"
SECONDS = re.compile(r"[\d.]+( s of work)?$| +$", re.MULTILINE)


@pytest.mark.slow
@pytest.mark.cc
def test_what_the_command_prints(tmp_path: Path) -> None:
    text, flags = PAGE.read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL
    for name, put in re.findall(r"Put this into `([^`]+)`:\n\n```yaml\n(.*?)^```$", text, flags):
        (tmp_path / name).write_text(put, encoding="utf-8")
    (console,) = re.findall(r"^```console\n\$ (.*?)\n(.*?)^```$", text, flags)
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    done = subprocess.run(
        console[0], shell=True, cwd=tmp_path, env=os.environ | {"PATH": path, "COLUMNS": "80"},
        capture_output=True, text=True, check=True,
    )  # fmt: skip
    words = [SECONDS.sub("", printed).split() for printed in (done.stdout, console[1])]
    assert words[0] == words[1]
