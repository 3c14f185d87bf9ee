from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path

import pytest

from fsmkit.diagnostics import Findings
from fsmkit.system.any_file import load_any
from fsmkit.system.system import System

Load = Callable[..., System]


@pytest.fixture
def load(tmp_path: Path) -> Load:
    """Write files and load the first of them; the name of a file is its keyword, dots as `_`."""

    def load_files(findings: Findings | None = None, /, **files: str) -> System:
        paths = [tmp_path / f"{name}.yaml" for name in files]
        for path, text in zip(paths, files.values(), strict=True):
            path.write_text(text, encoding="utf-8")
        return load_any(paths[0], findings if findings is not None else Findings())

    return load_files


def messages(findings: Findings) -> list[str]:
    return [f"{d.rule.name}: {d.message}" for d in findings]


def marks(values: Mapping[int, int]) -> list[int]:
    return sorted(values)
