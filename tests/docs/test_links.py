"""The page on links: its files are written, its commands run."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.docs.test_hosts_and_boards import BLOCK, PUT
from tests.runtime.links.conftest import has_libzmq

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs/how-to/links.md").read_text(encoding="utf-8")
REFERENCE = (ROOT / "docs/reference/links.md").read_text(encoding="utf-8")


@pytest.mark.slow
@pytest.mark.cc
def test_what_the_commands_print(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, require_tool: Callable[[str], str]
) -> None:
    require_tool("cc")
    pytest.importorskip("zmq")
    if not has_libzmq():
        require_tool("libzmq")
    monkeypatch.setenv("PATH", f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}")
    end = 0
    commands = []
    for block in BLOCK.finditer(PAGE):
        if put := PUT.search(PAGE[end : block.start()]):
            (tmp_path / put[1]).write_text(block[3], encoding="utf-8")
        if block[2] == "console":
            commands += re.split(r"^\$ ", block[3], flags=re.MULTILINE)[1:]
        end = block.end()
    assert len(commands) == 3
    for command in commands:
        line, _, expected = command.partition("\n")
        done = subprocess.run(
            ["/bin/sh", "-c", f"exec 2>&1; {line}"],
            cwd=tmp_path,
            capture_output=True,
            text=True,
            check=False,
            stdin=subprocess.DEVNULL,
            timeout=120,
        )
        assert done.stdout == expected, line


def test_the_reference_names_all_that_is_counted() -> None:
    header = (ROOT / "fsmkit/runtime/c/links/fsm_link.h").read_text(encoding="utf-8")
    found = set(re.findall(r"^    (FSM_LINK_\w+),", header, re.MULTILINE))
    counted = found - {"FSM_LINK_READY", "FSM_LINK_TIMEOUT", "FSM_LINK_BEYOND"}
    assert counted == set(re.findall(r"^\| `(FSM_LINK_\w+)` \|", REFERENCE, re.MULTILINE))
