"""``fsmkit paths``: where the files are that other tools need."""

from __future__ import annotations

from pathlib import Path

import click

from fsmkit.cli.common.console import print_json, result
from fsmkit.cli.common.options import OneOf

RUNTIME = Path(__file__).parents[1] / "runtime" / "c"
PATHS = {
    "cmake": RUNTIME / "cmake",
    "hosts": RUNTIME / "hosts",
    "include": RUNTIME,
    "links": RUNTIME / "links",
    "pkgconfig": RUNTIME / "pkgconfig",
}
EPILOG = """\b
Examples:
  cmake -S . -B build -Dfsmkit_DIR="$(fsmkit paths cmake)"
  export PKG_CONFIG_PATH="$(fsmkit paths pkgconfig)"
  cc -I"$(fsmkit paths hosts)" main.c generated/*.c
"""


@click.command(epilog=EPILOG)
@click.argument("what", type=OneOf("folder", sorted(PATHS)), required=False)
@click.option("--json", "as_json", is_flag=True, help="Print one JSON document.")
def command(what: str | None, as_json: bool) -> int:
    """Print the folder of the CMake package, of pkg-config's file, of headers, hosts or links.

    Without a name all of them.
    """
    if as_json:
        print_json({name: str(path) for name, path in PATHS.items() if what in (None, name)})
    elif what is not None:
        click.echo(PATHS[what])  # as it is: it goes into another command
    else:
        for name, path in PATHS.items():
            result.print(f"{name:10} {path}", markup=False, soft_wrap=True)
    return 0
