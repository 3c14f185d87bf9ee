"""``fsmkit cache``: list and delete the compiled explorers that `check` stores."""

from __future__ import annotations

import time

import click
from rich.markup import escape

from fsmkit.cli.common.console import print_json, report, result
from fsmkit.cli.common.verbs import verb
from fsmkit.diagnostics import Findings
from fsmkit.verify.engines.c.cache import LIMIT, Cache, Entry, UnusableError, cache_folder

EPILOG = """\b
Examples:
  fsmkit cache
  fsmkit cache --clear
"""
SHOWN = 20
"""Maximum number of listed programs, the last used first."""


@verb(EPILOG)
@click.option(
    "--prune", is_flag=True, help="Remove damaged programs, and the oldest beyond the limit."
)
@click.option("--clear", is_flag=True, help="Remove every program that is not in use.")
@click.option("--json", "as_json_document", is_flag=True, help="Print one JSON document.")
def command(prune: bool, clear: bool, as_json_document: bool) -> int:
    """List or remove the compiled explorers that `check` keeps.

    The cache holds at most 256 MB; the least recently used programs are removed first. Exit code
    1: `check` does not use the folder because it is not writable or others can write it.
    """
    if prune and clear:
        raise click.UsageError("--prune and --clear do not go together")
    try:
        folder = cache_folder()
        cache = Cache(folder)
    except UnusableError as error:
        told = Findings()
        told.add(
            "cache-not-used",
            f"compiled explorers are not stored: {error}",
            None,
            help="make the folder your own and keep others from writing it (`chmod go-w`), or name "
            "another in XDG_CACHE_HOME",
        )
        report(told)
        return 1
    gone = cache.prune(0 if clear else LIMIT, broken=prune) if prune or clear else ()
    kept = cache.entries()
    if as_json_document:
        print_json(
            {
                "folder": str(folder),
                "bytes": _total(kept),
                "limit": LIMIT,
                "removed": [entry.name for entry in gone],
                "entries": [{"name": e.name, "bytes": e.size, "used": e.used} for e in kept],
            }
        )
        return 0
    if prune or clear:
        result.print(f"removed {len(gone)}, {_megabytes(_total(gone))}")
    result.print(
        f"{escape(str(folder))}: {len(kept)} compiled, {_megabytes(_total(kept))} of "
        f"{_megabytes(LIMIT)}"
    )
    for entry in kept[:SHOWN]:
        used = time.strftime("%Y-%m-%d %H:%M", time.localtime(entry.used))
        result.print(f"  {used}  {entry.size / 1e3:9,.0f} kB  {entry.name}", style="dim")
    if len(kept) > SHOWN:
        result.print(f"  {len(kept) - SHOWN:,} used earlier: `--json` lists all", style="dim")
    return 0


def _total(entries: tuple[Entry, ...]) -> int:
    return sum(entry.size for entry in entries)


def _megabytes(size: int) -> str:
    return f"{size / (1 << 20):,.1f} MB"
