"""Find plug-ins.

A folder under ``fsmkit`` that holds a ``plugin.py`` is a plug-in. The module defines one constant,
``PLUGIN``. Other packages register theirs as entry points of the group ``fsmkit.plugins``. The
protocols are defined by their callers: `fsmkit.document.front_ends`, `fsmkit.codegen.target`,
`fsmkit.chart.drawing.drawing` and others. A plug-in module imports its implementation within its
methods, because all plug-ins are imported to find one.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from functools import cache
from importlib import import_module
from importlib.machinery import PathFinder
from pathlib import Path
from typing import Any, TypeVar

from fsmkit.diagnostics import Text, fail

GROUP = "fsmkit.plugins"
"""The group of entry points that plug-ins of other packages are registered in."""
POINTS = "entry_points.txt"


Kind = TypeVar("Kind")


def plugin(kind: type[Kind], name: str) -> Kind:
    """Return the plug-in of that protocol and name; `FsmkitError` that lists those there are."""
    found = {candidate.name: candidate for candidate in plugins(kind)}  # type: ignore[attr-defined]
    if name not in found:
        known = ", ".join(sorted(found))
        raise fail(
            "unknown-plugin", f"there is no {kind.__name__.lower()} `{name}`", help=f"use {known}"
        )
    return found[name]


def plugins(kind: type[Kind]) -> tuple[Kind, ...]:
    """Return every plug-in of a protocol, in order of name."""
    key: Any = kind
    return tuple(_of_kind(key))


def plugin_for(kind: type[Kind], path: Path, at: Text | None = None) -> Kind:
    """Return the plug-in of that protocol for a file's suffix; ``at``: location for findings."""
    by_suffix = {s: p for p in plugins(kind) for s in p.suffixes}  # type: ignore[attr-defined]
    fitting = [suffix for suffix in by_suffix if path.name.lower().endswith(suffix)]
    if not fitting:
        known = ", ".join(sorted(by_suffix))
        raise fail(
            "unknown-suffix",
            f"the suffix `{path.suffix.lower()}` of `{path.name}` is not that of a notation",
            at,
            help=f"use one of {known}",
        )
    return by_suffix[max(fitting, key=len)]


@cache
def _of_kind(kind: type[Any]) -> tuple[Any, ...]:
    """Return every plug-in of a protocol; cached, since checking members is slow."""
    return tuple(candidate for candidate in _every_plugin() if isinstance(candidate, kind))


@cache
def _every_plugin() -> tuple[Any, ...]:
    """Return every plug-in of fsmkit and of other packages, by name."""
    return tuple(sorted(_find(), key=lambda found: found.name))


def _find() -> Iterator[Any]:
    root = Path(__file__).parent
    for path in sorted(root.rglob("plugin.py")):
        module = ".".join((__package__ or "", *path.relative_to(root).with_suffix("").parts))
        yield import_module(module).PLUGIN
    if not _may_be_registered():
        return
    from importlib.metadata import entry_points  # and with it all of `email`

    for entry_point in entry_points(group=GROUP):
        yield entry_point.load()


def _may_be_registered() -> bool:
    """Whether a package may have registered a plug-in: whether an entry point names the group.

    Where packages are not all folders and files, as in archives, the answer is yes.
    """
    others = (finder for finder in sys.meta_path if finder is not PathFinder)
    if any(hasattr(finder, "find_distributions") for finder in others):
        return True
    for folder in dict.fromkeys(path or "." for path in sys.path):
        try:
            names = os.listdir(folder)  # noqa: PTH208  (in a fifth of the time of `Path`)
        except FileNotFoundError:
            continue
        except OSError:
            return True
        for name in names:
            if not name.endswith((".dist-info", ".egg-info", ".egg")):
                continue
            if name.endswith(".egg") or _names_group(os.path.join(folder, name, POINTS)):  # noqa: PTH118
                return True
    return False


def _names_group(file: str) -> bool:
    try:
        with open(file, "rb") as opened:  # noqa: PTH123
            return GROUP.encode() in opened.read()
    except OSError:  # most packages have none
        return False
