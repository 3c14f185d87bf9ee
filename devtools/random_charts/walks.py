"""Walks: scripts of any length that look where the machine is, so that they get around in a chart.

A random script posts mostly what nothing takes, and ends in the first state without a way out.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator

from devtools.random_charts.choices import Choices
from devtools.random_charts.scripts import CLOCK, value
from fsmkit.chart.chart import Chart
from fsmkit.document.document import Direction
from fsmkit.runtime import interpreter
from fsmkit.runtime.interpreter.snapshot import Timeout
from fsmkit.runtime.interpreter.trace import active_leaves
from fsmkit.runtime.script import Player, script_texts


def walk(choices: Choices, chart: Chart, steps: int) -> tuple[list[str], list[str]]:
    """Return a script of so many macrosteps or a few more, and its trace on the interpreter."""
    player = Player(chart)
    script: list[str] = []
    trace: list[str] = []
    done = 0
    visits: Counter[str] = Counter()
    """How often each state has been entered, and each transition taken; the rarest are sought."""
    while done < steps:
        if not player.snapshot.running:
            lines: tuple[str, ...] = (f"start {player.now % CLOCK}",)
        else:
            lines = tuple(_next(choices, chart, player, visits))
        script += lines
        for line in script_texts(lines):
            told = list(player.trace(line))
            trace += told
            done += sum(each.startswith("@") for each in told)
            visits.update(each for each in told if each[:2] in ("+ ", "t "))
    return script, trace


def _next(
    choices: Choices, chart: Chart, player: Player, visits: Counter[str]
) -> Iterator[str]:
    """Yield one or two lines: mostly something that an active state waits for."""
    if chart.inputs and choices.chance(60):
        changed = choices.pick(chart.inputs)
        yield f"input {changed.name} {value(choices, changed.type)}"
    counts: dict[int | None, int] = {}
    for index in (t for s in player.snapshot.configuration for t in chart.states[s].transitions):
        for event in chart.transitions[index].events:
            if Direction.IN in chart.events[event].directions:
                tries = visits[f"{chart.events[event].name} {_where(chart, player)}"]
                rarity = tries + _rarity(chart, index, visits)
                counts[event] = min(rarity, counts.get(event, rarity))
    deadline = interpreter.next_deadline(player.snapshot)
    if deadline is not None:
        what = player.snapshot.timers[0].what if player.snapshot.timers else None
        counts[None] = _rarity(chart, what.transition, visits) if isinstance(what, Timeout) else 0
    if choices.chance(4) or not counts:
        events = [e.index for e in chart.events if Direction.IN in e.directions]
        chosen = choices.pick(events) if events else None
    else:
        wanted = list(counts)
        rarest = min(wanted, key=counts.__getitem__)
        chosen = rarest if choices.chance(88) else choices.pick(wanted)
    if chosen is None:
        due = player.now if deadline is None else deadline
        yield f"run {max(player.now, due + choices.pick((0, 0, -1, 3))) % CLOCK}"
        return
    event = chart.events[chosen]
    visits[f"{event.name} {_where(chart, player)}"] += 1
    fields = " ".join(value(choices, field.type) for field in event.fields)
    yield f"{choices.pick(('post', 'post', 'dispatch'))} {event.name} {fields}".rstrip()
    if choices.chance(60):
        yield f"run {player.now % CLOCK}"


def _where(chart: Chart, player: Player) -> str:
    return " ".join(active_leaves(chart, player.snapshot))


def _rarity(chart: Chart, index: int, visits: Counter[str]) -> int:
    """Return how often the rarest of what a transition leads to has been reached."""
    transition = chart.transitions[index]
    reached = [visits[f"+ {chart.states[target].id}"] for target in transition.targets]
    return min(reached, default=visits[f"t {index}"])
