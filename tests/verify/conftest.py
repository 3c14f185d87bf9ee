from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from pathlib import Path

import pytest

from fsmkit.diagnostics import Findings
from fsmkit.system.any_file import load_any
from fsmkit.system.system import System
from fsmkit.verify.engines.c import engine

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


@pytest.fixture(scope="module")
def own_cache(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """Keep compiled explorers in a cache of the module's own."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_CACHE_HOME", str(tmp_path_factory.mktemp("cache")))
        yield


@pytest.fixture(scope="module")
def quickly_compiled() -> Iterator[None]:
    """Compile explorers quickly, for many that explore little; wants a cache of its own."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(engine, "FLAGS", ("-O0", *(f for f in engine.FLAGS if f != "-O2")))
        yield
