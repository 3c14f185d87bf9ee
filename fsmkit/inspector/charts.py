"""Describe charts in messages: drawings, and the fields of forms for events."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import fsmkit.language as lang
from fsmkit.chart.chart import Chart, Data, Transition, result_types
from fsmkit.chart.drawing.graphviz.engine import why_no_drawing
from fsmkit.chart.drawing.states.boxes import composites, shown
from fsmkit.chart.drawing.states.folding import ALL
from fsmkit.chart.drawing.states.labels import label
from fsmkit.diagnostics import FsmkitError
from fsmkit.diagnostics.as_json import location
from fsmkit.diagnostics.suggestions import suggest
from fsmkit.document.document import Origin, Trigger
from fsmkit.emit.svg import STYLE
from fsmkit.inspector.commands import wrong
from fsmkit.runtime.live.messages import ChartOf
from fsmkit.runtime.live.steps import hash_of
from fsmkit.runtime.live.values import to_json
from fsmkit.runtime.script import is_received
from fsmkit.system.views.drawing import draw, folds_named

Json = dict[str, Any]
DrawnBy = Callable[[Chart, frozenset[int]], str]
"""Draws a chart with some folded states, and returns SVG."""
MOST_DRAWN = 500
"""Maximum number of drawn states: Graphviz takes a second for them, minutes for ten times."""


HIDDEN: dict[str, Callable[[Transition], bool]] = {
    "inherited": lambda transition: transition.origin is Origin.INHERITED,
    "watchdogs": lambda transition: transition.watchdog,
}
"""Groups of transitions that a drawing can omit."""


def chart_message(
    chart: Chart,
    hide: Sequence[str] = (),
    fold: Sequence[str] = (),
    *,
    is_drawn: bool = True,
    drawn: DrawnBy | None = None,
) -> ChartOf:
    """Return a chart as a message, drawn without the parts named by ``hide`` if possible.

    ``fold``: states whose substates are omitted. ``drawn``: draws the chart, instead of a whole
    layout. Raises `FsmkitError` for names that cannot be
    hidden (``wrong-command``) or folded (``unknown-name``).
    """
    folds = folds_named(chart, fold)
    for name in hide:
        if name not in HIDDEN:
            help_ = suggest(name, HIDDEN, f"use one of {', '.join(HIDDEN)}")
            raise wrong(f"there is nothing `{name}` to be hidden", help_)
    svg, undrawn = _drawn(_without(chart, hide), folds, drawn) if is_drawn else ("", "")
    return ChartOf(
        chart=hash_of(chart),
        name=chart.name,
        states=[
            {
                "id": state.id,
                "kind": state.kind.value,
                "parent": None if state.parent is None else chart.states[state.parent].id,
                "origin": state.origin.value,
                "at": location(state.span),
                **({"doc": state.doc} if state.doc else {}),
            }
            for state in chart.states
        ],
        transitions=[_transition(chart, each) for each in chart.transitions],
        events=[
            {
                "name": event.name,
                "fields": _fields(event.fields),
                "received": is_received(event),
                **({"at": location(event.span)} if event.span is not None else {}),
            }
            for event in chart.events
        ],
        data=[_variable(each) for each in chart.data],
        inputs=[_variable(each) for each in chart.inputs],
        outputs=[_variable(each) for each in chart.outputs],
        operations=[
            {"name": name, "type": type_json(type_)} for name, type_ in result_types(chart).items()
        ],
        constants=[
            {"name": name, "value": to_json(constant.value, constant.type)}
            for name, constant in chart.constants
        ],
        sources=[{"name": source.name, "text": source.text} for source in chart.sources],
        hides=[name for name, is_it in HIDDEN.items() if any(map(is_it, chart.transitions))],
        folds=[chart.states[state].id for state in sorted(composites(chart))],
        folded=[chart.states[state].id for state in sorted(folds)],
        svg=svg,
        undrawn=undrawn,
    )


def _transition(chart: Chart, transition: Transition) -> Json:
    is_timed = transition.trigger in (Trigger.AFTER, Trigger.EVERY)
    return {
        "index": transition.index,
        "source": chart.states[transition.source].id,
        "targets": [chart.states[target].id for target in transition.targets],
        "events": [chart.events[event].name for event in transition.events],
        "label": " ".join(label(chart, transition).lines),
        "origin": transition.origin.value,
        "at": location(transition.span),
        **({"delay": transition.delay} if is_timed else {}),
    }


def _fields(fields: tuple[lang.Field, ...]) -> list[Json]:
    return [{"name": field.name, "type": type_json(field.type)} for field in fields]


def _variable(variable: Data) -> Json:
    return {
        "name": variable.name,
        "type": type_json(variable.type),
        "at": location(variable.span),
    }


def type_json(type_: lang.Type) -> Json:
    """Return a type for a form: its name, its kind, its bounds, members or parts, a value of it."""
    start = to_json(lang.default_value(type_), type_)
    found: Json = {"name": str(type_), "kind": _kind(type_), "start": start}
    match type_:
        case lang.IntType(lo, hi):
            return {**found, "lo": to_json(lo), "hi": to_json(hi)}
        case lang.EnumType(_, members):
            numbers = {} if type_.is_counted else {"numbers": list(type_.numbers)}
            return {**found, "members": list(members), **numbers}
        case lang.ArrayType(element, length):
            return {**found, "of": type_json(element), "length": length}
        case lang.RecordType(_, fields):
            return {**found, "fields": _fields(fields)}
        case _:
            return found


def _kind(type_: lang.Type) -> str:
    match type_:
        case lang.IntType():
            return "int"
        case lang.FloatType():
            return "float"
        case lang.EnumType():
            return "enum"
        case lang.ArrayType():
            return "array"
        case lang.RecordType():
            return "record"
        case _:
            return str(type_)


def _without(chart: Chart, hide: Sequence[str]) -> Chart:
    """Return a chart whose states list no transition that is hidden: those are not drawn."""
    if not hide:
        return chart
    hidden = {t.index for t in chart.transitions if any(HIDDEN[name](t) for name in hide)}
    states = (
        replace(state, transitions=tuple(t for t in state.transitions if t not in hidden))
        for state in chart.states
    )
    return replace(chart, states=tuple(states))


def _drawn(chart: Chart, fold: frozenset[int], drawn: DrawnBy | None = None) -> tuple[str, str]:
    """Return the drawing and an empty string; or an empty string and why drawing failed."""
    count = len(shown(chart, fold)) - 1  # without the root
    if count > MOST_DRAWN:
        return "", f"A drawing has at most {MOST_DRAWN} states, and this has {count:,}: fold some."
    try:
        if drawn is not None:
            found: str | bytes = drawn(chart, fold)
        else:
            found = draw(chart, Path("drawing.svg"), unfolded=(ALL,), fold=fold)
    except FsmkitError as error:
        return "", why_no_drawing() or error.diagnostics[0].message
    svg = found.decode("utf-8") if isinstance(found, bytes) else found
    return svg.replace(STYLE, ""), ""  # the page has colours of its own
