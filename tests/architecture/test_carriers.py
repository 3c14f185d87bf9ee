"""No file outside of a carrier's folder names the carrier: a change of it touches one folder."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

PACKAGE = Path(__file__).parents[2] / "fsmkit"
CARRIERS = PACKAGE / "carriers"
NAMES = {path.parent.name for path in CARRIERS.glob("*/plugin.py")} - {"wires"}
WORDS = re.compile(
    r"\b(CAN|DBC|DDS|ROS|ZeroMQ|ament|cantools|cyclonedds|dbc|dds|rcl\w*|ros|ros2|socketcan|zmq)\b"
    r"|fsm_(can|io|dds|ros|rclc)|fsm_link_(zmq|net|can|dds|ros|rclc|local)"
)
"""Words of carriers in strings and docstrings; `can` is looked for alone, for it is a verb as well,
and `wires` are the connections of a system, too."""
ALLOWED = {
    "cli/writing/convert.py": "its help: DBC files are what it reads besides charts",
    "cli/deploying/io.py": "the verb is of wires alone",
    "cli/deploying/trace.py": "its help: `zmq:` is a transport of traces",
    "runtime/health.py": "nodes answer how they are over ZeroMQ, whatever carries their frames",
    "runtime/tracing/transports/zmq/plugin.py": "a transport of traces",
    "runtime/tracing/transports/zmq/subscription.py": "a transport of traces",
    "system/deployment/carrier.py": "the kind of links where a deployment names none",
}
"""Files that may name a carrier, and why."""


def named(path: Path) -> Iterator[str]:
    """Yield the lines of a module that name a carrier: imports, strings, docstrings."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        match node:
            case ast.ImportFrom(module=str(module)) if f"{module}.".startswith("fsmkit.carriers."):
                yield f"{node.lineno}: imports {module}"
            case ast.Constant(value=str(text)) if text in NAMES or WORDS.search(text):
                yield f"{node.lineno}: {text[:60]!r}"


@pytest.mark.slow
def test_nothing_else_names_a_carrier() -> None:
    paths = [path for path in PACKAGE.rglob("*.py") if not path.is_relative_to(CARRIERS)]
    found = {path.relative_to(PACKAGE).as_posix(): list(named(path)) for path in paths}
    found = {name: lines for name, lines in found.items() if lines}
    assert {name: lines for name, lines in found.items() if name not in ALLOWED} == {}
    assert ALLOWED.keys() - found.keys() == set(), "they name no carrier any more"
