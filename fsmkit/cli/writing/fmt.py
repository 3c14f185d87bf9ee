"""``fsmkit fmt``: files in their usual layout."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import click

from fsmkit.chart.chart import Chart
from fsmkit.chart.loading import TEXTS, read_bytes
from fsmkit.cli.common.console import out, print_json, report, result
from fsmkit.cli.common.many_files import models
from fsmkit.cli.common.revisions import ReplacedContent
from fsmkit.cli.common.verbs import verb
from fsmkit.cli.common.writing import write_files
from fsmkit.diagnostics import Diagnostic, Findings, FsmkitError, fail
from fsmkit.diagnostics.as_json import as_json as data_of
from fsmkit.document.front_ends import Reader
from fsmkit.editor.formatting import format_source
from fsmkit.plan.lower import lower
from fsmkit.plan.plan import Plan
from fsmkit.plugins import plugin_for
from fsmkit.system.any_file import read_with_boards
from fsmkit.system.deployment.deployment import Deployment
from fsmkit.system.system import System

BYTE_ORDER_MARK = b"\xef\xbb\xbf"
EPILOG = """\b
Examples:
  fsmkit fmt gate.yaml
  fsmkit fmt --check .
"""


@verb(EPILOG)
@click.argument("files", nargs=-1, required=True, type=click.Path(path_type=Path))
@click.option(
    "--check", "is_check", is_flag=True, help="Write nothing; exit with 1 if a file would change."
)
@click.option("--json", "as_json", is_flag=True, help="Print one JSON document.")
def command(files: tuple[Path, ...], is_check: bool, as_json: bool) -> int:
    """Format charts, systems and deployments.

    Comments stay. A file is written only if its meaning is the same before and after.
    """
    changed: dict[Path, bytes] = {}
    wrong: list[Diagnostic] = []
    named = tuple(dict.fromkeys(file for path in files for file in models(path)))
    for file in named:
        try:
            before = read_bytes(file)
            after = _formatted(file, before)
        except FsmkitError as error:
            wrong += error.diagnostics
            continue
        if after != before:
            changed[file] = after
    if not is_check:
        write_files(changed)
    report(wrong)
    if as_json:
        told = {"changed": [str(file) for file in changed], "files": len(named)}
        print_json({**told, "findings": [data_of(finding) for finding in wrong]})
    else:
        for file in changed:
            result.print(f"{'would change' if is_check else 'formatted'} {file}", markup=False)
        out.print(f"{len(named) - len(changed)} of {len(named)} files as they were", style="dim")
    return int(bool(wrong) or (is_check and bool(changed)))


def _formatted(file: Path, content: bytes) -> bytes:
    """Return the content of a file in its usual layout.

    Raises `FsmkitError` with why the file cannot be read; ``not-formatted`` where it would change
    its meaning, or is not in UTF-8.
    """
    plugin_for(Reader, file)
    bare = content.removeprefix(BYTE_ORDER_MARK)
    mark = content[: len(content) - len(bare)]
    try:
        text = bare.decode("utf-8")
    except UnicodeDecodeError as error:
        message = f"`{file}` is not in UTF-8"
        raise fail("not-formatted", message, help="save the file as UTF-8") from error
    made = mark + format_source(text, str(file)).encode("utf-8")
    if made != content and _meaning(file, content) != _meaning(file, made):
        raise fail(
            "not-formatted",
            f"`{file}` would have another meaning",
            help="this is a bug of fsmkit; the file is left as it is",
        )
    return made


def _meaning(file: Path, content: bytes) -> object:
    """Return the content of a file without locations; for an invalid file, the broken rules."""
    token = TEXTS.set(ReplacedContent(file, content))
    try:
        found = read_with_boards(file, Findings())
    except FsmkitError as error:
        return frozenset(one.rule.name for one in error.diagnostics)
    finally:
        TEXTS.reset(token)
    match found:
        case Chart():
            return found, _plan(found)
        case Deployment():
            # options of links are texts with places, which the layout compares
            return replace(found, foreign=())
        case System():
            properties = [replace(one, text="") for one in found.properties]  # `text` is layout
            plans = tuple(_plan(machine.chart) for machine in found.machines)
            return replace(found, properties=tuple(properties)), plans
        case _:
            return type(found)


def _plan(chart: Chart) -> Plan | None:
    return None if chart.abstract else lower(chart)
