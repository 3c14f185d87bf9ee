"""Report a finding in a used chart once, at its own lines, and name the copies that have it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from fsmkit.chart.chart import Chart
from fsmkit.diagnostics import Findings
from fsmkit.diagnostics.diagnostic import Diagnostic
from fsmkit.document.document import Kind


def check_copies(
    chart: Chart, check: Callable[[Chart, Findings], None], findings: Findings
) -> None:
    """Add the findings of ``check``; for one location in a used chart only that of the first copy.

    The message names the copies if not all of them have the finding.
    """
    if not chart.copies:
        check(chart, findings)
        return
    found = Findings()
    check(chart, found)
    report_unbound(chart, found)
    own = {source.name for source in chart.sources}
    used: dict[str, list[str]] = {}
    for copy in chart.copies:
        if copy.source is not None:
            used.setdefault(copy.source.name, []).append(copy.name)
    first: dict[object, Diagnostic] = {}
    times: dict[object, set[str]] = {}
    order: list[object] = []
    for one in found:
        place = None if one.primary is None else one.primary.span
        is_inner = place is not None and place.source.name not in own
        key: object = (one.rule.name, place) if is_inner else one
        if key not in first:
            first[key] = one
            order.append(key)
        times.setdefault(key, set()).update(name for name in _copies_in(one, chart))
    for key in order:
        one = first[key]
        names = sorted(times[key])
        place = None if one.primary is None else one.primary.span
        all_names = used.get("" if place is None else place.source.name, [])
        if isinstance(key, tuple) and names and len(names) < len(all_names):
            listed = ", ".join(f"`{name}`" for name in names)
            word = "copy" if len(names) == 1 else "copies"
            one = replace(one, message=f"{one.message} (in {word} {listed})")
        findings.extend((one,))


def report_unbound(chart: Chart, findings: Findings) -> None:
    """Report exit points after which nothing can follow."""
    for copy in chart.copies:
        if "." in _outer(copy.name, chart):
            continue  # the used chart itself reports it
        done = chart.event_index.get(f"done.state.{copy.name}")
        ends = [chart.states[exit_] for exit_ in copy.exits]
        left = [state for state in ends if state.kind is Kind.FINAL]
        around = (copy.state, *chart.ancestors(copy.state))
        is_left = any(chart.states[state].transitions for state in around)
        is_taken = any(done in transition.events for transition in chart.transitions)
        if not left or is_left or is_taken:
            continue
        if any(_ends(chart, state) for state in around):
            continue
        names = ", ".join(f"`{state.id}`" for state in left)
        findings.add(
            "unbound-exit",
            f"nothing follows {names}",
            copy.span,
            secondary=[(left[0].span, "the exit point")],
            help=f"bind it under `exits`, or give `{copy.name}` a transition",
        )


def _outer(name: str, chart: Chart) -> str:
    """Return the name of a copy without the one that it lies in and the index of an array."""
    for copy in chart.copies:
        if name.startswith(f"{copy.name}."):
            return name.removeprefix(f"{copy.name}.") + "."
    return ""


def _ends(chart: Chart, state: int) -> bool:
    """Whether something takes the done event of a state around."""
    done = chart.event_index.get(f"done.state.{chart.states[state].id}")
    return done is not None and any(done in t.events for t in chart.transitions)


def _copies_in(one: Diagnostic, chart: Chart) -> list[str]:
    """Return the copies whose names a message holds."""
    return [copy.name for copy in chart.copies if f"`{copy.name}." in one.message]
