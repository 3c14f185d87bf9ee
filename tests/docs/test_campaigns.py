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
    text = PAGE.read_text(encoding="utf-8")
    for put in re.finditer(
        r"Put this into `([^`]+)`:\n\n```yaml\n(.*?)^```$", text, re.MULTILINE | re.DOTALL
    ):
        (tmp_path / put[1]).write_text(put[2], encoding="utf-8")
    (console,) = re.findall(r"^```console\n\$ (.*?)\n(.*?)^```$", text, re.MULTILINE | re.DOTALL)
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    done = subprocess.run(
        console[0], shell=True, cwd=tmp_path, env=os.environ | {"PATH": path, "COLUMNS": "80"},
        capture_output=True, text=True, check=True,
    )  # fmt: skip
    words = [SECONDS.sub("", printed).split() for printed in (done.stdout, console[1])]
    assert words[0] == words[1]
