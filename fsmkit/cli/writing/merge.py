"""``fsmkit merge``: two versions of a chart with a common ancestor, merged by meaning."""

from __future__ import annotations

import sys
from pathlib import Path

import click

from fsmkit.chart.chart import Chart
from fsmkit.chart.differences.compare import differences
from fsmkit.chart.loading import TEXTS, read_bytes
from fsmkit.cli.common.console import err, print_json, report, result
from fsmkit.cli.common.options import option_value, path_option
from fsmkit.cli.common.revisions import ReplacedContent
from fsmkit.cli.common.verbs import verb
from fsmkit.cli.common.writing import write_files
from fsmkit.diagnostics import Findings, FsmkitError, Source, fail
from fsmkit.diagnostics.as_json import as_json as data_of
from fsmkit.editor.editing.merging import MARKER_SIZE, Checked, MergedText, merge_texts
from fsmkit.system.any_file import read_with_boards
from fsmkit.system.views.difference_drawing import draw_differences

EPILOG = """\b
Examples:
  fsmkit merge base.yaml ours.yaml theirs.yaml --out gate.yaml
  git config merge.fsmkit.driver 'fsmkit merge %O %A %B --out %A --path %P'
"""
SIDES = ("base", "ours", "theirs")


@verb(EPILOG)
@click.argument("base", type=click.Path(path_type=Path))
@click.argument("ours", type=click.Path(path_type=Path))
@click.argument("theirs", type=click.Path(path_type=Path))
@path_option("-o", "--out", help="Write this file instead of printing.")
@click.option(
    "--path",
    type=click.Path(path_type=Path),
    help="Name the merged file; its bases are read from beside it (default: OURS).",
)
@click.option(
    "--marker-size",
    type=click.IntRange(1, 1000),
    default=MARKER_SIZE,
    show_default=True,
    help="Characters of a conflict marker.",
)
@path_option("--draw", help="Draw the changes of both: FILE-ours.svg and FILE-theirs.svg.")
@click.option("--json", "as_json", is_flag=True, help="Print one JSON document.")
def command(
    base: Path,
    ours: Path,
    theirs: Path,
    out: Path | None,
    path: Path | None,
    marker_size: int,
    draw: Path | None,
    as_json: bool,
) -> int:
    """Merge two versions of a chart by meaning.

    States, transitions and declarations are merged one by one, so changes of neighbouring lines do
    not conflict. The layout and the comments of OURS stay. The exit code is 1 if there are
    conflicts; the file then has git's conflict markers. Systems and other files are merged by
    their lines. It is a merge driver for git.
    """
    if draw is not None and draw.suffix.lower() != ".svg":
        with option_value():
            raise fail(
                "unknown-suffix",
                f"differences are drawn as `.svg`, not as `{draw.suffix}`",
                help="choose a file with the suffix .svg",
            )
    contents = [read_bytes(each) for each in (base, ours, theirs)]
    name = path or ours
    is_dos = b"\r\n" in contents[1]
    texts = [one.decode("utf-8", "surrogateescape").replace("\r\n", "\n") for one in contents]
    names = [f"base:{name}", str(name), f"theirs:{name}"]
    if path is None:
        names = [str(each) for each in (base, ours, theirs)]
    old, here, there = (Source(*each) for each in zip(names, texts, strict=True))
    merged = merge_texts(
        old, here, there, lambda text: _checked(name, text), marker_size=marker_size
    )
    text = merged.text.replace("\n", "\r\n") if is_dos else merged.text
    files: dict[Path, str | bytes] = {}
    if out is not None:
        files[out] = text.encode("utf-8", "surrogateescape")
    if draw is not None:
        files |= _drawings(draw, [_checked(name, each).chart for each in texts])
    write_files(files)
    report((*merged.conflicts, *merged.warnings))
    if as_json:
        print_json(_document(merged, text if out is None else None, files))
    elif out is None:
        sys.stdout.buffer.write(text.encode("utf-8", "surrogateescape"))
    elif merged.conflicts:
        err.print(f"{name}: merged with conflicts", markup=False, soft_wrap=True)
    else:
        how = "by meaning" if merged.is_by_meaning else "by its lines"
        result.print(f"{name}: merged {how}", markup=False, soft_wrap=True)
    return 1 if merged.conflicts else 0


def _checked(path: Path, text: str) -> Checked:
    """Return the findings of a text that the file has instead of its own."""
    token = TEXTS.set(ReplacedContent(path, text.encode("utf-8", "surrogateescape")))
    findings = Findings()
    try:
        model = read_with_boards(path, findings)
    except FsmkitError as error:
        return Checked(error.diagnostics)
    finally:
        TEXTS.reset(token)
    return Checked(tuple(findings), model if isinstance(model, Chart) else None)


def _drawings(draw: Path, charts: list[Chart | None]) -> dict[Path, str | bytes]:
    """Return the drawings of the changes of both versions."""
    drawn: dict[Path, str | bytes] = {}
    base = charts[0]
    for side, chart in zip(SIDES[1:], charts[1:], strict=True):
        if base is None or chart is None:
            raise fail(
                "not-a-chart",
                f"{'base' if base is None else side} is not a chart without errors",
                help="omit --draw",
            )
        drawing = draw_differences(base, chart, differences(base, chart))
        drawn[draw.with_name(f"{draw.stem}-{side}.svg")] = drawing
    return drawn


def _document(merged: MergedText, text: str | None, files: dict[Path, str | bytes]) -> object:
    return {
        "merged": not merged.conflicts,
        "by": "meaning" if merged.is_by_meaning else "lines",
        "conflicts": [data_of(each) for each in merged.conflicts],
        "findings": [data_of(each) for each in merged.warnings],
        "files": [str(each) for each in files],
        **({} if text is None else {"text": text}),
    }
