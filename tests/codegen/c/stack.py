"""The stack depth of a generated machine: the frame sizes of gcc, over all paths of calls.

`make stack` prints it for the charts of `conftest.CHARTS`, without the functions of the host.
"""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

HOST = ("gcc", "-O2")
CORTEX_M3 = ("arm-none-eabi-gcc", "-Os", "-mcpu=cortex-m3", "-mthumb")
CORTEX_M0 = ("arm-none-eabi-gcc", "-Os", "-mcpu=cortex-m0", "-mthumb")
TARGETS = {"x86-64 -O2": HOST, "Cortex-M3 -Os": CORTEX_M3, "Cortex-M0 -Os": CORTEX_M0}

NODE = re.compile(r'node: \{ title: "([^"]+)" label: "([^"\\]+)\\n[^"]*?(\d+) bytes \((\w+)\)')
EDGE = re.compile(r'edge: \{ sourcename: "([^"]+)" targetname: "([^"]+)"')
TABLE = re.compile(r"^static \w+ \*const \w+\[\d*\] = \{(.*?)\};", re.MULTILINE | re.DOTALL)
INDIRECT = "__indirect_call"


class UnboundedError(Exception):
    """The stack has no bound; the text says where."""


@dataclass(frozen=True, slots=True)
class Frames:
    """The bytes of each function's frame, and the functions it calls."""

    bytes: dict[str, int]
    calls: dict[str, frozenset[str]]

    def depth(self, name: str, path: tuple[str, ...] = ()) -> int:
        """Return the bytes from a function downwards; `UnboundedError` if it calls itself."""
        if name in path:
            raise UnboundedError(" -> ".join((*path, name)))
        below = (self.depth(called, (*path, name)) for called in self.calls.get(name, ()))
        return self.bytes.get(name, 0) + max(below, default=0)


def frames(folder: Path, sources: Iterable[str], compiler: tuple[str, ...]) -> Frames:
    """Compile and read; a call through a table may be one of any function in a table."""
    sizes: dict[str, int] = {}
    calls: dict[str, set[str]] = {}
    for source in sources:
        command = [*compiler, "-std=c99", "-fcallgraph-info=su", "-c", source]
        subprocess.run(command, cwd=folder, check=True, capture_output=True)
        graph = (folder / source).with_suffix(".ci").read_text(encoding="utf-8")
        own: dict[str, str] = {}
        for title, label, size, kind in NODE.findall(graph):
            if kind != "static":
                raise UnboundedError(f"{title}: its frame is {kind}")
            sizes[title] = int(size)
            own[label] = title
        text = (folder / source).read_text(encoding="utf-8")
        listed = {word for table in TABLE.findall(text) for word in re.findall(r"\w+", table)}
        behind = {own[name] for name in listed if name in own}
        for caller, called in EDGE.findall(graph):
            if called == INDIRECT and not behind:
                raise UnboundedError(f"{caller}: it calls what no table lists")
            calls.setdefault(caller, set()).update(behind if called == INDIRECT else {called})
    return Frames(sizes, {caller: frozenset(called) for caller, called in calls.items()})


def deepest(folder: Path, files: Mapping[str, str], compiler: tuple[str, ...]) -> dict[str, int]:
    """Return the depth below each function of the interface, in bytes."""
    for name, text in files.items():
        (folder / name).write_text(text, encoding="utf-8")
    found = frames(folder, [name for name in files if name.endswith(".c")], compiler)
    return {name: found.depth(name) for name in found.bytes if ":" not in name}


def main() -> int:
    """Print a line for each chart."""
    from tests.codegen.c.conftest import CHARTS, machine_of

    there = {name: c for name, c in TARGETS.items() if shutil.which(c[0])}
    sys.stdout.write(f"{'bytes of stack':16}" + "".join(f"{name:>16}" for name in there) + "\n")
    for chart in CHARTS:
        line = f"{chart:16}"
        for compiler in there.values():
            with tempfile.TemporaryDirectory() as folder:
                found = deepest(Path(folder), machine_of(chart).files, compiler)
            line += f"{max(found.values()):16}"
        sys.stdout.write(f"{line}\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
