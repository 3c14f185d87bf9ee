"""Walks: scripts of any length that prefer rare states, to cover most of a chart.

A random script mostly posts events without effect, and stays in states that are hard to leave.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator

from devtools.random_charts.choices import Choices
from devtools.random_charts.scripts import CLOCK, value
from fsmkit.chart.chart import Chart
from fsmkit.document.document import Direction
from fsmkit.runtime import interpreter
from fsmkit.runtime.script import Player, script_texts

TRIED = 8
"""Number of continuations compared; the one to the least visited states is taken."""


def walk(choices: Choices, chart: Chart, steps: int) -> tuple[list[str], list[str]]:
    """Return a script of so many macrosteps or a few more, and its trace on the interpreter."""
    player = Player(chart)
    script: list[str] = []
    trace: list[str] = []
    visits: Counter[str] = Counter()
    while sum(each.startswith("@") for each in trace) < steps:
        for _ in range(100):
            tried = [_tried(chart, player, list(_next(choices, chart, player)))
                     for _ in range(TRIED if choices.chance(80) else 1)]  # fmt: skip
            lines, told, player = min(tried, key=lambda one: _rarity(visits, one[1]))
            script += lines
            trace += told
            visits.update(told)
    return script, trace


def _tried(chart: Chart, player: Player, lines: list[str]) -> tuple[list[str], list[str], Player]:
    """Return lines, their trace, and the player afterwards."""
    tried = Player(chart)
    tried.snapshot, tried.now, tried.host.state = player.snapshot, player.now, player.host.state
    told = [each for line in script_texts(lines) for each in tried.trace(line)]
    return lines, told, tried


def _rarity(visits: Counter[str], told: list[str]) -> int:
    """Return the number of visits of the rarest line of a trace, including its last state."""
    return min((visits[each] for each in told if each[:1] in "t="), default=sum(visits.values()))


def _next(choices: Choices, chart: Chart, player: Player) -> Iterator[str]:
    """Yield one to three lines: inputs, an event that something waits for, time."""
    if not player.snapshot.running:
        yield f"start {player.now % CLOCK}"
        return
    for variable in chart.inputs:
        if choices.chance(30):
            yield f"input {variable.name} {value(choices, variable.type)}"
    deadline = interpreter.next_deadline(player.snapshot)
    events = [e for e in chart.events if Direction.IN in e.directions]
    if not events or (deadline is not None and choices.chance(25)):
        due = player.now + choices.pick((0, 3, 700)) if deadline is None else deadline
        yield f"run {max(player.now, due + choices.pick((0, 0, -1, 3))) % CLOCK}"
        return
    waited = {
        event
        for state in player.snapshot.configuration
        for index in chart.states[state].transitions
        for event in chart.transitions[index].events
    }
    wanted = [event for event in events if event.index in waited]
    event = choices.pick(wanted if wanted and choices.chance(90) else events)
    fields = " ".join(value(choices, field.type) for field in event.fields)
    yield f"{choices.pick(('post', 'post', 'dispatch'))} {event.name} {fields}".rstrip()
    yield f"run {player.now % CLOCK}"
