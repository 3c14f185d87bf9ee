"""``fsmkit paths``: where the files are that other tools need."""

from __future__ import annotations

from pathlib import Path

import click

from fsmkit.cli.common.console import err, print_json, result
from fsmkit.cli.common.options import OneOf
from fsmkit.cli.common.verbs import verb
from fsmkit.codegen.system.files import CLibrary
from fsmkit.document.project import project_of
from fsmkit.editor.schemas import FOLDER
from fsmkit.plugins import plugins
from fsmkit.runtime.library import C_LIBRARY

FOLDERS = {
    "cmake": C_LIBRARY / "cmake",
    "hosts": C_LIBRARY / "hosts",
    "include": C_LIBRARY,
    "links": C_LIBRARY / "links",
    "pkgconfig": C_LIBRARY / "pkgconfig",
    "schema": FOLDER,
    **{carrier.name: carrier.library for carrier in plugins(CLibrary)},
}
PATHS = dict(sorted(FOLDERS.items()))
EPILOG = """\b
Examples:
  cmake -S . -B build -Dfsmkit_DIR="$(fsmkit paths cmake)"
  export PKG_CONFIG_PATH="$(fsmkit paths pkgconfig)"
  cc -I"$(fsmkit paths hosts)" main.c generated/*.c
"""


@verb(EPILOG)
@click.argument("what", type=OneOf("folder", sorted(PATHS)), required=False)
@click.option(
    "--project",
    "is_project",
    is_flag=True,
    help="Print the project file that applies here.",
)
@click.option("--schema", "is_schema", is_flag=True, help="Print the folder of JSON Schemas.")
@click.option("--json", "as_json", is_flag=True, help="Print one JSON document.")
def command(what: str | None, is_project: bool, is_schema: bool, as_json: bool) -> int:
    """Print folders: CMake package, headers, hosts, links.

    The C of each carrier has the carrier's name. Without a name, prints all folders.
    """
    if is_project and is_schema:
        raise click.UsageError("--project and --schema do not go together")
    if is_schema:
        what = "schema"
    if is_project:
        return _print_project(as_json=as_json)
    if as_json:
        print_json({name: str(path) for name, path in PATHS.items() if what in (None, name)})
    elif what is not None:
        click.echo(PATHS[what])  # unstyled, for use in another command
    else:
        for name, path in PATHS.items():
            result.print(f"{name:10} {path}", markup=False, soft_wrap=True)
    return 0


def _print_project(*, as_json: bool) -> int:
    """Print the project file of this folder; return 1 if it does not exist."""
    project = project_of(Path.cwd())
    if as_json:
        print_json({"project": None if project is None else str(project.path)})
    elif project is None:
        err.print("there is no fsmkit.toml, and no pyproject.toml with tool.fsmkit, here or above")
    else:
        click.echo(project.path)
    return int(project is None)
