"""The expectations of the public suites.

A W3C test passes when it ends in its top-level state ``pass``. A scripted chart (SCION's format)
passes when the active atomic states are the expected ones at first and after each event.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any

from fsmkit.chart.chart import Chart, Transition
from fsmkit.chart.structure import is_internal
from fsmkit.diagnostics.parsing import parse_json
from fsmkit.document.document import Kind
from fsmkit.testing.conformance.conformance import ContradictsRecommendation, UnmetExpectation
from fsmkit.testing.harness.harness import Harness

PATIENCE = 600_000_000
"""Simulated microseconds after which a W3C test that has not ended is stuck."""

PARALLEL_DOMAIN = (
    "the script wants a parallel state for the domain of a transition, which by Appendix D "
    "(findLCCA) it never is; what happens is the script's own `legacySemantics`"
)


def ends_in_pass(chart: Chart, harness: Harness) -> None:
    """Let simulated time pass until the chart must have ended; that must be in ``pass``."""
    late = PATIENCE // chart.capacities.tick
    runs = [0, 0, 0, *(late * part // 10 for part in range(1, 11))]
    trace = harness.run(chart, ["start 0", *(f"run {at}" for at in runs)])
    end = ends_in(trace)
    if end == ("pass",):
        return
    if end is not None:
        raise UnmetExpectation(f"ends in {', '.join(end)}")
    stuck = configurations(trace)
    where = ", ".join(stuck[-1][1]) if stuck else "nothing"
    because = f" after the fault {faults(trace)[0]}" if faults(trace) else ""
    raise UnmetExpectation(f"does not end: it stays in {where}{because}")


def assessed_log(line: str) -> Callable[[Chart, Harness], None]:
    """Return the evaluation of a test whose log a person assesses."""

    def evaluate_line(chart: Chart, harness: Harness) -> None:
        trace = harness.run(chart, ["start 0", "run 0", "run 0"])
        if line not in trace:
            raise UnmetExpectation(f"the trace does not show `{line}`")

    return evaluate_line


def follow_script(script: dict[str, Any]) -> Callable[[Chart, Harness], None]:
    """Return the evaluation of a scripted chart.

    A script that uses a parallel state as the domain of a transition contradicts the
    recommendation. Three facts show it: the chart has a transition with that difference, the
    script has another behaviour for the same events (``legacySemantics``), and the chart follows
    that one.
    """

    def evaluate_script(chart: Chart, harness: Harness) -> None:
        lines, times = harness_lines(script, chart.capacities.tick)
        trace = configurations(harness.run(chart, lines))
        difference = first_difference(script, times, trace)
        if not difference:
            return
        legacy = script.get("legacySemantics")
        if (
            legacy is not None
            and any(nearest_is_parallel(chart, transition) for transition in chart.transitions)
            and harness_lines(legacy, chart.capacities.tick) == (lines, times)
            and not first_difference(legacy, times, trace)
        ):
            raise ContradictsRecommendation(PARALLEL_DOMAIN)
        raise UnmetExpectation(difference)

    return evaluate_script


def harness_lines(script: dict[str, Any], tick: int) -> tuple[list[str], list[int]]:
    """Return the lines for a harness, and the time of the start and of each event.

    Events are one millisecond apart, so that the time of a macrostep identifies its event.
    ``tick``: microseconds.
    """
    lines, times, now = ["start 0", "run 0"], [0], 0
    for entry in script["events"]:
        now += max(1, (int(entry.get("after", 0)) * 1000 + 1000) // tick)
        times.append(now)
        lines += [f"run {now}", f"post {entry['event']['name']}", f"run {now}"]
    return lines, times


def first_difference(
    script: dict[str, Any], times: Sequence[int], trace: Sequence[tuple[int, tuple[str, ...]]]
) -> str:
    """Return where the active atomic states are first others than the script's, or nothing."""
    names = [entry["event"]["name"] for entry in script["events"]]
    wanted = [script["initialConfiguration"]]
    wanted += [entry["nextConfiguration"] for entry in script["events"]]
    for step, (time, expected) in enumerate(zip(times, wanted, strict=True)):
        reached = [states for at, states in trace if at <= time]
        found = reached[-1] if reached else ()
        if sorted(found) != sorted(expected):
            after = f"after event {step} `{names[step - 1]}`" if step else "at first"
            return f"{after}: {_listed(found)} instead of {_listed(expected)}"
    return ""


def nearest_is_parallel(chart: Chart, transition: Transition) -> bool:
    """Whether the least common ancestor of source and targets is a parallel state."""
    if not transition.targets or is_internal(chart, transition):
        return False
    for ancestor in chart.ancestors(transition.source):
        if all(chart.is_descendant(target, ancestor) for target in transition.targets):
            return chart.states[ancestor].kind is Kind.PARALLEL
    return False


def _listed(states: Sequence[str]) -> str:
    return ", ".join(sorted(states)) or "nothing"


def read_script(path: Path) -> dict[str, Any] | None:
    """Return the script beside a chart, or None if the file is not a script."""
    try:
        script = parse_json(path.read_text(encoding="utf-8-sig"))
    except (OSError, ValueError):
        return None
    is_script = isinstance(script, dict) and {"initialConfiguration", "events"} <= set(script)
    return script if is_script else None


# --- results in a trace ---------------------------------------------------------------------------


def configurations(trace: Iterable[str]) -> list[tuple[int, tuple[str, ...]]]:
    """Return the time and the active atomic states after each macrostep."""
    found: list[tuple[int, tuple[str, ...]]] = []
    now = 0
    for line in trace:
        if line.startswith("@"):
            now = int(line[1:].partition(" ")[0])
        elif line == "=" or line.startswith("= "):
            found.append((now, tuple(name for name in line.split()[1:] if name != "finished")))
    return found


def ends_in(trace: Iterable[str]) -> tuple[str, ...] | None:
    """Return the atomic states in which the machine finished, if it did."""
    for line in trace:
        words = line.split()
        if words[:1] == ["="] and words[-1:] == ["finished"]:
            return tuple(words[1:-1])
    return None


def faults(trace: Iterable[str]) -> list[str]:
    """Return the reasons of faults."""
    return [line.removeprefix("fault ") for line in trace if line.startswith("fault ")]
