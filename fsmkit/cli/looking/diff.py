"""``fsmkit diff``: what differs between two charts, by meaning."""

from __future__ import annotations

import difflib
import json
from pathlib import Path
from typing import Any

import click

from fsmkit.chart.chart import Chart
from fsmkit.chart.differences.compare import Change, Detail, differences
from fsmkit.cli.common.console import print_json, report, result
from fsmkit.cli.common.options import Reading, option_value, path_option, reading_options
from fsmkit.cli.common.revisions import with_content, with_revision
from fsmkit.cli.common.verbs import verb
from fsmkit.cli.common.writing import write_files
from fsmkit.diagnostics import FsmkitError, fail
from fsmkit.system.any_file import read, system_within
from fsmkit.system.views.difference_drawing import draw_differences

EPILOG = """\b
Examples:
  fsmkit diff old.yaml new.yaml
  fsmkit diff old.yaml new.scxml --draw changes.svg
  fsmkit diff --git HEAD~1 gate.yaml
  git difftool --extcmd 'fsmkit diff' -- gate.yaml
"""
GIT_ARGUMENTS = 7
"""Git calls a driver with path, old file, hash and mode, and new file, hash and mode."""
NOTHING = Path("/dev/null")
SIGNS = {"added": "+", "removed": "-", "moved": ">", "changed": "~", "renamed": "="}


@verb(EPILOG, Model=("parameters",))
@click.argument(
    "files", nargs=-1, required=True, metavar="OLD NEW", type=click.Path(path_type=Path)
)
@click.option("--git", "revision", metavar="REV", help="Compare NEW with this revision of it.")
@path_option("--draw", help="Draw both charts with the differences in colours: an svg file.")
@click.option("--json", "as_json", is_flag=True, help="Print one JSON document.")
@reading_options
def command(
    files: tuple[Path, ...],
    revision: str | None,
    draw: Path | None,
    as_json: bool,
    reading: Reading,
) -> int:
    """Compare two charts by meaning.

    States, transitions and declarations are added, removed, moved, changed or renamed. Inheritance
    is resolved first. Comments, the layout of the text and the notation do not count. The exit code
    is 1 if the charts differ. With seven arguments it is a diff driver for git, and ends with 0.
    """
    if draw is not None and draw.suffix.lower() != ".svg":
        with option_value():
            raise fail(
                "unknown-suffix",
                f"differences are drawn as `.svg`, not as `{draw.suffix}`",
                help="choose a file with the suffix .svg",
            )
    if len(files) == GIT_ARGUMENTS and revision is None:
        return _driver(files, reading)
    if len(files) != (2 if revision is None else 1):
        wanted = "two files" if revision is None else "one file with --git"
        raise click.UsageError(f"diff compares {wanted}, and {len(files)} were given")
    new = _chart(files[-1], reading)
    if revision is None:
        old = _chart(files[0], reading)
    else:
        with with_revision(files[0], revision) as path:
            old = _chart(path, reading)
    changes = differences(old, new)
    if draw is not None:
        write_files({draw: draw_differences(old, new, changes)})
    if as_json:
        document = {"old": old.name, "new": new.name, "differences": [*map(_json, changes)]}
        print_json({**document, **({"files": [str(draw)]} if draw is not None else {})})
    else:
        _print(changes)
    return 1 if changes else 0


def _chart(path: Path, reading: Reading) -> Chart:
    findings = reading.findings()
    model = read(path, findings, strict=reading.strict, parameters=reading.parameters)
    if not isinstance(model, Chart):
        raise fail(
            "not-a-chart",
            f"`{system_within(model).name}` is a system, and diff compares charts",
            help="compare the charts of its machines",
        )
    report(each for each in findings if each.severity.value == "error")
    return model


def _driver(arguments: tuple[Path, ...], reading: Reading) -> int:
    """Print the differences of a file that git compares; of a file that is no chart, its lines."""
    path, old, _, _, new, _, _ = arguments
    result.print(f"diff {path}", markup=False, soft_wrap=True)
    try:
        charts = []
        for each in (old, new):
            if each == NOTHING:
                result.print("the file is new" if each is old else "the file was removed")
                return 0
            with with_content(path, each.read_bytes()) as there:
                charts.append(_chart(there, reading))
        _print(differences(*charts))
    except FsmkitError as error:
        result.print(f"not compared by meaning: {error.diagnostics[0].message}", markup=False)
        one, other = (each.read_text(errors="replace").splitlines() for each in (old, new))
        for line in difflib.unified_diff(one, other, f"a/{path}", f"b/{path}", lineterm=""):
            result.print(line, markup=False, soft_wrap=True)
    return 0


def _print(changes: tuple[Change, ...]) -> None:
    for each in changes:
        result.print(f"{SIGNS[each.kind]} {sentence(each)}", markup=False, soft_wrap=True)
    count = len(changes)
    result.print(f"{count} difference{'s' * (count != 1)}" if changes else "no differences")


def sentence(change: Change) -> str:
    """Return a change as one line."""
    what = f"{change.kind} {change.what} `{change.name}`"
    keys = {detail.key: detail for detail in change.details}
    if change.kind == "renamed":
        return f"{what} (was `{keys['name'].old}`)"
    if change.kind in ("added", "removed"):
        within = f" in `{keys['parent'].new}`" if "parent" in keys else ""
        return what + within + (f" [{keys['guard'].new}]" if "guard" in keys else "")
    if not change.details:
        return what
    return f"{what}: {'; '.join(map(_detail, change.details))}"


def _detail(detail: Detail) -> str:
    old, new = (_shown(value) for value in (detail.old, detail.new))
    key = detail.key.removesuffix("_us").replace("descriptors", "events")
    return f"{key} {old} to {new}"


def _shown(value: Any) -> str:
    match value:
        case None | [] | "":
            return "nothing"
        case str():
            return f"`{value}`"
        case list() if all(isinstance(each, str) for each in value):
            return f"`{'; '.join(value)}`"
        case _:
            return f"`{json.dumps(value, ensure_ascii=False)}`"


def _json(change: Change) -> dict[str, Any]:
    places = {"old_at": change.old_at, "new_at": change.new_at}
    return {
        "change": change.kind,
        "what": change.what,
        "name": change.name,
        "details": [{"key": d.key, "old": d.old, "new": d.new} for d in change.details],
        **{key: place for key, place in places.items() if place is not None},
    }
