"""Checks: one rule per file, discovered automatically. Each module has ``check(chart, findings)``.

A check warns of legal constructs that are probably mistakes. It must be precise: users ignore a
rule after its first wrong warning.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from importlib import import_module
from pathlib import Path

from fsmkit.chart.chart import Chart
from fsmkit.diagnostics import Findings

Check = Callable[[Chart, Findings], None]


def run_checks(chart: Chart, findings: Findings) -> None:
    """Run every check on a chart."""
    for check in checks():
        check(chart, findings)


@cache
def checks() -> tuple[Check, ...]:
    """Return every check, in order of its name."""
    names = sorted(path.stem for path in Path(__file__).parent.glob("[a-z]*.py"))
    return tuple(import_module(f"{__name__}.{name}").check for name in names)
