"""Random scripts for a chart: the calls of a host, line by line.

A script starts with ``start`` and ends with ``dump``. Times are ticks modulo 2^32; many scripts
start shortly before the clock wraps around.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from hypothesis import strategies as st

import fsmkit.language as lang
from devtools.random_charts.choices import Choices, DrawnChoices
from devtools.random_charts.vocabulary import SYMBOLS
from fsmkit.chart.chart import Chart, result_types
from fsmkit.document.document import Direction
from fsmkit.language.values import part_types
from fsmkit.plan.image import image_of

if TYPE_CHECKING:
    from hypothesis.strategies import DrawFn

CLOCK = 2**32
STARTS = (0, 1000, CLOCK - 30, CLOCK - 1, CLOCK // 2 - 20)
JUMPS = (0, 1, 1, 2, 5, 5, 10, 10, 20, 50, 120)
"""Ticks between two readings of the clock."""


@st.composite
def scripts(draw: DrawFn, chart: Chart, length: int = 90) -> tuple[str, ...]:
    """Draw a script of about that many lines at most."""
    return random_script(DrawnChoices(draw), chart, length)


def random_script(
    choices: Choices,
    chart: Chart,
    length: int = 90,
    *,
    is_saved: bool = False,
    jumps: Sequence[int] = JUMPS,
) -> tuple[str, ...]:
    """Return a script of at most about ``length`` lines.

    ``is_saved``: it saves and restores. ``jumps``: ticks between two readings of the clock. Less
    than 0 they turn it back, by `CLOCK_MARGIN` at most from its latest reading.
    """
    now = latest = choices.pick(STARTS)
    symbols: tuple[str, ...] = (*SYMBOLS, "unknown event")
    if is_saved:  # as bytes, which name the symbols of the chart alone
        symbols = image_of(chart).texts
    lines = []
    if choices.chance(50):
        lines.append(f"seed {choices.integer(0, 10_000)}")
    lines += _inputs(choices, chart, symbols)
    lines.append(f"start {now}")
    received = [e for e in chart.events if e.directions and e.directions != {Direction.OUT}]
    events = [e for e in received if Direction.IN in e.directions]
    # twice as often those that some transition names
    named = {index for t in chart.transitions if "*" not in t.descriptors for index in t.events}
    events += [e for e in events if e.index in named]
    returning = [*result_types(chart).items()]
    for _ in range(choices.integer(1, length)):
        kind = choices.integer(0, 9)
        # a step of an invoked machine is one effect of the interpreter, after that of posting
        if chart.operations and not chart.invocations and events and choices.chance(50):
            event = _event(choices, chart, choices.pick(events).index, symbols)
            lines.append(f"within {choices.integer(1, 2)} {event}")
        if returning and choices.chance(15):
            name, type_ = choices.pick(returning)
            count = choices.integer(1, 3)
            results = " ".join(value(choices, type_, symbols) for _ in range(count))
            lines.append(f"returns {name} {results}")
        if kind < 5 and events:
            lines.append(f"post {_event(choices, chart, choices.pick(events).index, symbols)}")
        elif kind == 7 and events and choices.chance(60):
            verb = "ask" if is_saved else "dispatch"
            lines.append(f"{verb} {_event(choices, chart, choices.pick(events).index, symbols)}")
        elif kind == 8 and not (is_saved and choices.chance(30)):
            lines += _inputs(choices, chart, symbols)
        elif kind == 9 and choices.chance(25):
            lines.append("dump")
        elif kind == 9 and choices.chance(15):
            latest = now
            lines.append(f"start {now % CLOCK}")
        elif kind >= 8 and is_saved:
            lines.append("save")
            passed = choices.pick((0, 0, 7, 1000, CLOCK // 2))
            now, latest = now + passed, latest + passed  # restored timers have the same time left
            lines.append(f"restore {now % CLOCK}")
        else:
            now = max(now + choices.pick(jumps), latest - lang.CLOCK_MARGIN)
            latest = max(latest, now)
            lines.append(f"run {now % CLOCK}")
    lines.append(f"run {(now + 60) % CLOCK}")
    lines.append("dump")
    return tuple(lines)


def _inputs(choices: Choices, chart: Chart, symbols: Sequence[str]) -> list[str]:
    if not chart.inputs:
        return []
    chosen = choices.pick(chart.inputs)
    return [f"input {chosen.name} {value(choices, chosen.type, symbols)}"]


def _event(choices: Choices, chart: Chart, index: int, symbols: Sequence[str]) -> str:
    event = chart.events[index]
    return " ".join((event.name, *(value(choices, field.type, symbols) for field in event.fields)))


def value(choices: Choices, type_: lang.Type, symbols: Sequence[str] = SYMBOLS) -> str:
    """Return a value of a type, as scripts and traces spell it."""
    match type_:
        case lang.BoolType():
            return str(choices.integer(0, 1))
        case lang.IntType(lo, hi):
            near = 0 if lo <= 0 <= hi else lo
            if choices.chance(15):
                return str(choices.pick((lo, hi)))
            return str(choices.integer(near, min(hi, near + 9)))
        case lang.EnumType(numbers=numbers):
            return str(choices.pick(numbers))
        case lang.FloatType():
            return choices.pick(("0", "1.5", "-2.25"))
        case lang.DurationType():
            return str(choices.integer(0, 1000))
        case lang.SymbolType():
            return f'"{choices.pick(symbols)}"'
        case lang.ArrayType() | lang.RecordType():
            return f"[{' '.join(value(choices, part, symbols) for part in part_types(type_))}]"
