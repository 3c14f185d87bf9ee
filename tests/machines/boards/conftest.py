"""The boards, built with sanitizers."""

from __future__ import annotations

import importlib.util
import shutil
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.machines.boards.playing import CELL
from tests.needs import need

SANITIZED = ("-O1", "-g", "-fsanitize=address,undefined", "-fno-sanitize-recover=all")


@pytest.fixture(scope="session")
def programs(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """Return the programs of the boards, with sanitizers."""
    pytest.importorskip("zmq")
    spec = importlib.util.spec_from_file_location("cell_build", CELL / "boards" / "build.py")
    assert spec is not None
    assert spec.loader is not None
    build = importlib.util.module_from_spec(spec)
    sys.modules["cell_build"] = build
    spec.loader.exec_module(build)
    out = tmp_path_factory.mktemp("boards")
    try:
        build.build(out, options=SANITIZED)
    except build.BuildError as error:
        if "zmq.h: No such file" in str(error) or "no C compiler" in str(error):
            need(False, "libzmq" if "zmq.h" in str(error) else "cc")
        raise
    return {name: out / f"board_{name}" for name in ("a", "b")}


@pytest.fixture(scope="session")
def sockets() -> Iterator[Path]:
    """Return a folder with a short path, as sockets need one."""
    folder = Path(tempfile.mkdtemp(prefix="cell"))
    yield folder
    shutil.rmtree(folder, ignore_errors=True)
