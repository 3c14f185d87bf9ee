"""Tell what is odd in a used chart once, at its own lines, with the copies that it is odd in."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from fsmkit.chart.chart import Chart
from fsmkit.diagnostics import Findings
from fsmkit.diagnostics.diagnostic import Diagnostic


def check_copies(
    chart: Chart, check: Callable[[Chart, Findings], None], findings: Findings
) -> None:
    """Add what checks find in a chart; of one place in a used chart only the first of its copies.

    The copies are named where the same is not found in all of them.
    """
    if not chart.copies:
        check(chart, findings)
        return
    found = Findings()
    check(chart, found)
    own = {source.name for source in chart.sources}
    used: dict[str, list[str]] = {}
    for copy in chart.copies:
        if copy.source is not None:
            used.setdefault(copy.source.name, []).append(copy.name)
    told: dict[object, Diagnostic] = {}
    times: dict[object, set[str]] = {}
    order: list[object] = []
    for one in found:
        place = None if one.primary is None else one.primary.span
        is_inner = place is not None and place.source.name not in own
        key: object = (one.rule.name, place) if is_inner else one
        if key not in told:
            told[key] = one
            order.append(key)
        times.setdefault(key, set()).update(
            name for name in _copies_in(one, chart)
        )
    for key in order:
        one = told[key]
        names = sorted(times[key])
        place = None if one.primary is None else one.primary.span
        all_names = used.get("" if place is None else place.source.name, [])
        if isinstance(key, tuple) and names and len(names) < len(all_names):
            listed = ", ".join(f"`{name}`" for name in names)
            word = "copy" if len(names) == 1 else "copies"
            one = replace(one, message=f"{one.message} (in {word} {listed})")
        findings.extend((one,))


def _copies_in(one: Diagnostic, chart: Chart) -> list[str]:
    """Return the copies whose names a message holds."""
    return [copy.name for copy in chart.copies if f"`{copy.name}." in one.message]
