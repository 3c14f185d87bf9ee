"""Machines of one chart that a system gives other constants are written one by one."""

from __future__ import annotations

from pathlib import Path

from fsmkit.cli import execute
from tests.verify.systems import NODE, POST, RING, SINK, SOURCE


def test_charts_with_other_constants_are_named_as_the_machine(tmp_path: Path) -> None:
    (tmp_path / "ring.yaml").write_text(RING)
    (tmp_path / "node.yaml").write_text(NODE)
    assert execute(["compile", str(tmp_path / "ring.yaml"), "--out", str(tmp_path / "out")]) == 0
    written = {path.name for path in (tmp_path / "out").glob("n*.c")}
    assert written >= {"node.c", "node_1.c", "node_2.c"}


def test_connections_are_direct_in_what_is_written(tmp_path: Path) -> None:
    for name, text in {"post": POST, "source": SOURCE, "sink": SINK}.items():
        (tmp_path / f"{name}.yaml").write_text(text)
    assert execute(["compile", str(tmp_path / "post.yaml"), "--out", str(tmp_path / "out")]) == 0
    assert not list((tmp_path / "out").glob("connection*"))
