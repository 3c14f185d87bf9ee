"""Random nets of condition connectors, and a reference that evaluates all guards first (R10)."""

from __future__ import annotations

from devtools.foreign.qm_models import chart_calls
from devtools.random_charts.choices import Choices, SeededChoices
from fsmkit.chart.elaborate import elaborate
from fsmkit.diagnostics import Findings, Source
from fsmkit.foreign.imports import Recorder, Rewriting
from fsmkit.foreign.rewriting.static_choices import static_choices
from fsmkit.yaml.reader import read_document

Leg = tuple[str, str, str]
"""A guard, a target and an operation."""
Net = dict[str, list[Leg]]


def random_net(choices: Choices) -> Net:
    """Return the transitions of two states and three choices; those of choices point onwards."""
    places = ["a", "b", "c0", "c1", "c2"]
    found: Net = {}
    for number, name in enumerate(places):
        targets = places if number < 2 else ["a", "b", *places[number + 1 :]]
        found[name] = [
            (choices.pick(("x == 0", "x != 0", "y == 0", "y != 0", "")), choices.pick(targets),
             f"{name}_{leg}")
            for leg in range(choices.integer(1, 3))
        ]  # fmt: skip
    return found


def text_of(net: Net) -> str:
    """Return the chart; an operation with an odd last digit sets x, another one y."""
    names = [leg[2] for legs in net.values() for leg in legs]
    lines = [
        "chart: Net",
        "data: {x: int32 = 0, y: int32 = 0}",
        f"operations: [{', '.join(names)}]",
    ]
    lines += ["events: {in: [e]}", "initial: a", "states:"]
    for place, legs in net.items():
        items = []
        for guard, target, name in legs:
            condition = f'if: "{guard}", ' if guard else ""
            sets = "x = 1 - x" if int(name[-1]) % 2 else "y = 1 - y"
            items.append(f'{{{condition}target: {target}, do: "{name}(); {sets}"}}')
        key = "choice: " if place.startswith("c") else "on: {e: "
        lines.append(f"  {place}: {{{key}[{', '.join(items)}]{'' if key[0] == 'c' else '}'}}}")
    return "\n".join(lines)


def reference_calls(net: Net, events: int) -> list[list[str]]:
    """Return the calls for each event: guards along a path first, then its actions."""
    at, values = "a", {"x": 0, "y": 0}
    found: list[list[str]] = [[]]

    def holds(guard: str) -> bool:
        return not guard or (values[guard[0]] == 0) == ("==" in guard)

    def path(place: str) -> list[tuple[str, str]] | None:
        for guard, target, name in net[place]:
            if holds(guard):
                rest = path(target) if target.startswith("c") else []
                if rest is not None:
                    return [(name, target), *rest]
        return None

    for _ in range(events):
        steps = path(at) or []
        for name, target in steps:
            at = target
            key = "x" if int(name[-1]) % 2 else "y"
            values[key] = 1 - values[key]
        found.append([name for name, _ in steps])
    return found


def difference(number: int) -> str | None:
    """Return the difference between a random net by the reference and as a chart."""
    return comparison(number)[0]


def comparison(number: int) -> tuple[str | None, list[Rewriting]]:
    """Return the difference of a random net, if any, and the rewritings of its transitions."""
    net = random_net(SeededChoices(f"r10 {number}"))
    findings, recorder = Findings(), Recorder()
    document = read_document(Source("net.yaml", text_of(net)), findings)
    findings.stop_on_errors()
    if document is None:
        return "no chart", []
    chart = elaborate((static_choices(document, recorder, findings),), findings)
    findings.stop_on_errors()
    if chart is None:
        return "no chart", []
    expected, called = reference_calls(net, 20), chart_calls(chart, ["e"] * 20)
    same = expected == called
    return None if same else f"net {number}: {expected}, not {called}", recorder.rewritten
