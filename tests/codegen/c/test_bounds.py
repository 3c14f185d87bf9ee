"""Resource bounds of a generated machine: stack depth, library calls; and random calls of it."""

from __future__ import annotations

import re
import subprocess
from collections.abc import Callable, Mapping
from pathlib import Path

import pytest

from fsmkit.codegen.c.names import Names
from fsmkit.testing.evidence.any_host import CHOICES, TRIED, any_host
from tests.codegen.c.conftest import EVERY, SANITIZERS, machine_of
from tests.codegen.c.stack import CORTEX_M0, HOST, TARGETS, UnboundedError, deepest, frames

pytestmark = pytest.mark.cc

ROUNDS = 1_000_000
HELPERS = re.compile(r"mem(cpy|set|move|cmp)|__aeabi_\w+|__gnu_thumb1_case_\w+")
"""Functions that a compiler may call (the last: switches on a Cortex-M0)."""
MOST_STACK = {"x86-64 -O2": 1024, "Cortex-M3 -Os": 640, "Cortex-M0 -Os": 640}

Write = Callable[[Path, Mapping[str, str]], Path]
RequireTool = Callable[[str], str]


@pytest.mark.parametrize(
    ("name", "compiler"),
    [*((name, "clang") for name in EVERY), ("kinds", "gcc"), ("shop", "gcc")],
)
def test_random_calls_under_sanitizers(
    name: str, compiler: str, tmp_path: Path, write: Write, require_tool: RequireTool
) -> None:
    machine = machine_of(name)
    host = any_host(machine, ROUNDS)
    write(tmp_path, machine.files | {"any.h": CHOICES, "choices.c": TRIED, "host.c": host})
    sources = [file for file in machine.files if file.endswith(".c")]
    command = [require_tool(compiler), "-std=c99", *SANITIZERS, *sources, "choices.c", "host.c"]
    subprocess.run([*command, "-lm", "-o", "tried"], cwd=tmp_path, check=True)
    done = subprocess.run([tmp_path / "tried"], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")


@pytest.mark.external
@pytest.mark.parametrize("compiler", [HOST, CORTEX_M0], ids=["host", "arm"])
def test_no_library(
    compiler: tuple[str, ...], tmp_path: Path, write: Write, require_tool: RequireTool
) -> None:
    require_tool(compiler[0])
    nm = require_tool(f"{compiler[0].removesuffix('gcc')}nm")
    for name in EVERY:
        machine = machine_of(name)
        sources = [file for file in write_all(tmp_path, name, write) if file.endswith(".c")]
        folder = tmp_path / name
        subprocess.run([*compiler, "-std=c99", "-c", *sources], cwd=folder, check=True)
        objects = [Path(source).with_suffix(".o").name for source in sources]
        listed = subprocess.run(
            [nm, "-P", *objects], cwd=folder, capture_output=True, text=True, check=True
        ).stdout
        symbols = [line.split() for line in listed.splitlines() if not line.endswith(":")]
        defined = {symbol[0] for symbol in symbols if symbol[1] != "U"}
        needed = {symbol[0] for symbol in symbols if symbol[1] == "U"} - defined
        declared = "\n".join(text for file, text in machine.files.items() if file.endswith(".h"))
        provided = set(re.findall(rf"\b({prefixes(machine.names)}\w+)\(", declared))
        assert {s for s in needed - provided if not HELPERS.fullmatch(s)} == set()


def write_all(folder: Path, name: str, write: Write) -> list[str]:
    """Write the files of a machine into a folder of its own and return their names."""
    files = machine_of(name).files
    write(folder / name, files)
    return list(files)


def prefixes(names: Names) -> str:
    """Return the prefixes of a machine's names, as a regular expression."""
    return f"{names.prefix}_"


@pytest.mark.external
@pytest.mark.parametrize("target", TARGETS)
def test_stack(target: str, tmp_path: Path, require_tool: RequireTool) -> None:
    """No recursion, no frame whose size is known only at run time, and not much of it."""
    compiler = TARGETS[target]
    require_tool(compiler[0])
    for name in EVERY:
        folder = tmp_path / name
        folder.mkdir()
        found = deepest(folder, machine_of(name).files, compiler)
        assert {f"{name}_start", f"{name}_dispatch"} <= found.keys()
        assert 0 < max(found.values()) <= MOST_STACK[target], name


def test_recursion_is_found(tmp_path: Path, require_tool: RequireTool) -> None:
    require_tool("gcc")
    (tmp_path / "a.c").write_text(
        "int b(int n);\nint a(int n);\nint a(int n) { return n > 0 ? b(n - 1) + n : 0; }\n"
    )
    (tmp_path / "b.c").write_text(
        "int a(int n);\nint b(int n);\nint b(int n) { return a(n) * n; }\n"
    )
    found = frames(tmp_path, ["a.c", "b.c"], ("gcc", "-O0"))
    with pytest.raises(UnboundedError, match="a -> b -> a"):
        found.depth("a")
