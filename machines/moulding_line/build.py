"""Builds the node `press` in C: ``python -m machines.moulding_line.build FOLDER``.

Compiles the deployment, the descriptors of its topics (``idlc``) and the program. Needs a C
compiler, libzmq and Cyclone DDS with their header files.
"""

from __future__ import annotations

import os
import shlex
import subprocess
from pathlib import Path

import click

import fsmkit

HERE = Path(__file__).parent
RUNTIME = Path(fsmkit.__file__).parent / "runtime" / "c"
CARRIERS = Path(fsmkit.__file__).parent / "carriers"
LINKS = {
    RUNTIME / "links": ("fsm_link", "fsm_link_fan"),
    CARRIERS / "can/c": ("fsm_can", "fsm_can_bus", "fsm_link_can"),
    CARRIERS / "ros/c/dds": ("fsm_link_dds", "fsm_dds_domain"),
    CARRIERS / "zeromq/c": tuple(
        f"fsm_link_{part}" for part in ("zmq", "hello", "gate", "keys", "endpoint")
    ),
}
"""Sources of the library, by folder."""
WARNINGS = ("-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Wshadow", "-Werror")


def build(out: Path, deployment: Path = HERE / "deployment.yaml") -> Path:
    """Build the program into a folder; return its path. Raises `click.ClickException`."""
    for path, text in fsmkit.compile(deployment).items():
        (out / path).parent.mkdir(parents=True, exist_ok=True)
        (out / path).write_text(text, encoding="utf-8")
    made = out / "made"
    made.mkdir(exist_ok=True)
    for idl in sorted((out / "idl").iterdir()):
        _run(["idlc", "-t", "-o", str(made), idl.name], idl.parent)
    cc = shlex.split(os.environ.get("CC", "cc"))
    descriptors = sorted(made.glob("*.c"))
    _run([*cc, "-c", "-O2", *map(str, descriptors)], made)
    folders = [out / "press", made, RUNTIME / "hosts", CARRIERS / "ros/c", *LINKS]
    sources = [HERE / "press.c", *sorted((out / "press").glob("*.c"))]
    sources += [folder / f"{name}.c" for folder, names in LINKS.items() for name in names]
    sources += [source.with_suffix(".o") for source in descriptors]
    flags = ["-std=c99", "-O2", *WARNINGS, "-pthread", *(f"-I{folder}" for folder in folders)]
    program = out / "press_in_c"
    _run([*cc, *flags, *map(str, sources), "-lzmq", "-lddsc", "-o", str(program)], out)
    return program


def _run(command: list[str], folder: Path) -> None:
    try:
        subprocess.run(command, cwd=folder, check=True)
    except FileNotFoundError:
        raise click.ClickException(f"`{command[0]}` is missing") from None
    except subprocess.CalledProcessError as error:
        raise click.ClickException(f"`{command[0]}` ended with {error.returncode}") from None


@click.command()
@click.argument("out", type=click.Path(file_okay=False, path_type=Path))
def main(out: Path) -> None:
    """Build the node `press` into the folder OUT."""
    click.echo(build(out.resolve()))


if __name__ == "__main__":
    main()
