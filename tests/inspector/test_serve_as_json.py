"""A program that starts `fsmkit serve --json` reads the address while the server runs."""

from __future__ import annotations

import json
import subprocess
import sys
import urllib.request
from pathlib import Path

import pytest

from tests.inspector.conftest import GATE


@pytest.mark.cc
def test_the_address_arrives_in_a_pipe(tmp_path: Path) -> None:
    (tmp_path / "gate.yaml").write_text(GATE, encoding="utf-8")
    command = [sys.executable, "-m", "fsmkit", "serve", "gate.yaml", "--json"]
    with subprocess.Popen(command, cwd=tmp_path, stdout=subprocess.PIPE, text=True) as server:
        try:
            assert server.stdout is not None
            text = ""
            for line in server.stdout:
                text += line
                if line == "}\n":
                    break
            with urllib.request.urlopen(json.loads(text)["address"], timeout=60) as page:
                assert b"<html" in page.read()
        finally:
            server.terminate()
