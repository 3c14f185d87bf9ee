"""Builds the programs of the boards: charts to C, C to `board_a` and `board_b`.

    python build.py [FOLDER] [--by-position]    # build/cell unless another is named

``--by-position``: an estimate switches the sorter, which the board has two wires more for.
Compiles the deployment with its links and the wires of each board, and calls `$CC`.
Nothing is done again where no source is newer than the programs.
"""

from __future__ import annotations

import argparse
import os
import shlex
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import yaml

import fsmkit
from fsmkit.chart.chart import Chart
from fsmkit.language import EnumType

BOARDS = Path(__file__).resolve().parent
CELL = BOARDS.parent
OUT = CELL.parents[1] / "build" / "cell"
PACKAGE = Path(fsmkit.__file__).parent
RUNTIME = PACKAGE / "runtime" / "c"
ZEROMQ = PACKAGE / "carriers/zeromq/c"
WIRES = PACKAGE / "carriers/wires/c"
MACHINES = {
    "a": ("supervisor", "feeder_belt", "feeder", "molder", "extractor"),
    "b": ("extraction_belt", "sorter", "camera", "rotator"),
}
COMMON = ("main", "server", "board", "text", "recorder")
CONTROLLER = ("profile", "pid", "drive")
LINKS = tuple(f"fsm_link_{part}" for part in ("zmq", "hello", "gate", "keys", "endpoint"))
WARNINGS = ("-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Wshadow", "-Werror")


CLI = "from fsmkit.cli import main; main()"


class BuildError(Exception):
    """Something that is needed is not there, or did not do; the text says what."""


def build(
    out: Path = OUT,
    compiler: str | None = None,
    options: tuple[str, ...] = (),
    *,
    by_position: bool = False,
) -> None:
    """Build both boards as ``out/board_a`` and ``out/board_b``, or raise `BuildError`."""
    cc = shlex.split(compiler or os.environ.get("CC", "cc"))
    if shutil.which(cc[0]) is None:
        raise BuildError(f"no C compiler: install `{cc[0]}`, or name one in CC")
    if all(is_current(out / f"board_{node}") for node in MACHINES) and not options:
        return
    generated = out / "generated"
    generate(generated, by_position=by_position)
    for node in MACHINES:
        link(cc, node, generated / node, out / f"board_{node}", options)


def is_current(program: Path) -> bool:
    """Return whether a program is newer than all of its sources."""
    if not program.exists():
        return False
    made = program.stat().st_mtime
    return all(path.stat().st_mtime <= made for path in sources())


def sources() -> Iterator[Path]:
    """Yield the files that a change of makes the programs old."""
    for folder, patterns in (
        (CELL, ("*.yaml", "*.scxml", "plant/*.yaml", "boards/*", "controller/*.[ch]")),
        (RUNTIME, ("**/*.[ch]",)),
        (PACKAGE, ("codegen/c/**/*.py", "codegen/system/**/*.py", "system/**/*.py")),
        (PACKAGE / "carriers", ("wires/**/*.py", "wires/c/*.[ch]", "zeromq/c/*.[ch]")),
    ):
        for pattern in patterns:
            yield from (path for path in folder.glob(pattern) if path.is_file())


def generate(out: Path, *, by_position: bool = False) -> None:
    """Write the machines, what joins them, their links, their wires, and the names of faults."""
    out.mkdir(parents=True, exist_ok=True)
    described = write_by_position(out) if by_position else CELL
    compiled(described / "deployment.yaml", "--out", str(out), "--with", "trace")
    ring = {
        machine.name: machine.chart for machine in fsmkit.read_system(CELL / "ring.yaml").machines
    }
    for node, names in MACHINES.items():
        compiled(described / f"boards/board_{node}.io.yaml", "--out", str(out / node))
        text = fault_names([ring[name] for name in names])
        (out / node / "faults.h").write_text(text, encoding="utf-8")


ESTIMATE = {
    "estimator.sighted": "{digital_in: 9, register: {at: 0x10, shift: 9}}",
    "estimator.reject": "{digital_in: 10, register: {at: 0x10, shift: 10}}",
}


def write_by_position(out: Path) -> Path:
    """Write deployment and wires for a sorter that goes by an estimate; return their folder.

    The sorter reads two wires of the estimator, and nobody receives the camera's verdicts.
    """
    folder = out / "by_position"
    (folder / "boards").mkdir(parents=True, exist_ok=True)
    deployment = described("deployment.yaml")
    deployment["system"] = str(CELL / "ring_by_position.yaml")
    dumped(folder / "deployment.yaml", deployment)
    for node in MACHINES:
        board = described(f"boards/board_{node}.io.yaml")
        if node == "b":
            board["signals"] |= {n: yaml.load(t, yaml.BaseLoader) for n, t in ESTIMATE.items()}  # noqa: S506
            board["bind"]["sorter"] |= {
                "sighted": "estimator.sighted", "reject": "estimator.reject",
            }  # fmt: skip
            board["bind"]["camera"]["verdict"] = "nothing"
        dumped(folder / f"boards/board_{node}.io.yaml", board)
    return folder


def described(file: str) -> dict[str, Any]:
    """Read a file of the cell; every value stays as it is written (`off` is a word)."""
    found: dict[str, Any] = yaml.load((CELL / file).read_text(encoding="utf-8"), yaml.BaseLoader)  # noqa: S506
    return found


def dumped(path: Path, data: dict[str, Any]) -> None:
    """Write a file of words."""
    path.write_text(yaml.safe_dump(data, sort_keys=False), encoding="utf-8")


def compiled(file: Path, *options: str) -> None:
    """Run `fsmkit compile` on a file."""
    command = [sys.executable, "-c", CLI, "compile", str(file), *options]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise BuildError(done.stderr)


def fault_names(charts: list[Chart]) -> str:
    """Return a header with the names of faults."""
    types = [v.type for chart in charts for v in chart.data if v.name == "fault_code"]
    faults = next((t.members for t in types if isinstance(t, EnumType)), ())
    quoted = ", ".join(f'"{fault}"' for fault in faults)
    lines = [
        "/* faults.h: generated by build.py. */",
        f"#define BOARD_FAULT_NAMES {{{quoted}}}",
        "",
    ]
    return "\n".join(lines)


def link(
    cc: list[str], node: str, generated: Path, program: Path, options: tuple[str, ...]
) -> None:
    """Compile a board. Its machines log as instances, numbered in their order."""
    objects = program.parent / f"objects_{node}"
    objects.mkdir(parents=True, exist_ok=True)
    library = (RUNTIME / "hosts", RUNTIME / "links", WIRES, ZEROMQ)
    folders = [BOARDS, CELL / "controller", generated, *library]
    common = [*cc, "-std=c99", "-O2", *WARNINGS, *options, "-DFSM_LOGGED"]
    common += [f"-I{folder}" for folder in folders]
    jobs: list[tuple[Path, tuple[str, ...]]] = [
        (generated / f"{name}_trace.c", (f"-DFSM_INSTANCE(m)={number}u",))
        for number, name in enumerate(MACHINES[node])
    ]
    names = ["fsm", "fsm_trace", "fsm_io", f"board_{node}_io", f"ring_{node}"]
    names += [f"{name}_info" for name in MACHINES[node]]
    jobs += [(generated / f"{name}.c", ()) for name in names]
    jobs += [(RUNTIME / "links/fsm_link.c", ()), *((ZEROMQ / f"{name}.c", ()) for name in LINKS)]
    jobs += [(WIRES / f"{name}.c", ()) for name in ("fsm_io_map", "fsm_io_map_posix")]
    jobs += [(CELL / "controller" / f"{name}.c", ()) for name in CONTROLLER]
    jobs += [(BOARDS / f"{name}.c", ()) for name in (*COMMON, f"board_{node}")]
    jobs += [
        (RUNTIME / "hosts" / "posix" / f"{name}.c", ()) for name in ("fsm_notify", "fsm_posix")
    ]
    made = []
    for source, own in jobs:
        target = objects / f"{source.stem}.o"
        run([*common, *own, "-c", str(source), "-o", str(target)])
        made.append(str(target))
    run([*cc, *options, *made, "-lzmq", "-pthread", "-lm", "-o", str(program)])


def run(command: list[str]) -> None:
    """Run a compiler, which must be content."""
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode == 0:
        return
    hint = (
        "install libzmq3-dev (make tools)\n"
        if "zmq.h: No such file" in done.stderr or "-lzmq" in done.stderr
        else ""
    )
    raise BuildError(f"{hint}{shlex.join(command)}\n{done.stderr}")


def main() -> int:
    """Build into the folder named."""
    parser = argparse.ArgumentParser(description="Build the programs of the boards.")
    parser.add_argument("out", nargs="?", type=Path, default=OUT)
    parser.add_argument("--by-position", action="store_true")
    given = parser.parse_args()
    try:
        build(given.out, by_position=given.by_position)
    except BuildError as error:
        print(error, file=sys.stderr)
        return 1
    print(*(os.path.relpath(given.out / f"board_{node}") for node in MACHINES), sep="\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
