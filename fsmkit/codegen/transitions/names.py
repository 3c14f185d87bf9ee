"""Names of a chart for the library and for a model class."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass

from fsmkit.chart.chart import Chart
from fsmkit.codegen.python.names import Names, distinct, identifier, name_of_class
from fsmkit.emit import snake
from fsmkit.plan import Plan

SEPARATORS = "/|:>~"
"""Separators between a state and its parent; the first that no state contains is used."""
MODEL = frozenset({"state", "trigger", "may_trigger", "to", "machine", "is_in", "log", "begin"})
"""The attributes that a model has from the library or from the generated class."""
PREFIXES = (
    *("guard_", "do_", "enter_", "exit_", "recall_", "forget_"),
    *("send_", "is_", "may_"),
)


@dataclass(frozen=True, slots=True)
class ModelNames:
    """The generated names of the parts of a chart. Tuples are by index."""

    names: Names
    separator: str
    paths: tuple[str, ...]
    """The names of states with all their ancestors."""
    initial: str
    """The state before the start, and the trigger that leaves it."""
    start: str
    always: str
    """The trigger of the transitions without an event."""
    timed: Mapping[int, str]
    """The triggers of timed transitions."""

    def quoted(self, state: int) -> str:
        """Return the name of a state for the library, as a literal."""
        return text(self.paths[state])


def model_names(plan: Plan) -> ModelNames:
    """Return the names for a chart. Clashing names get underscores at the end."""
    chart = plan.chart
    ids = [state.id for state in chart.states[1:]]
    separator = next(
        (each for each in SEPARATORS if not any(each in name for name in ids)),
        "\N{RIGHTWARDS ARROW}",
    )
    chains = (reversed(chain) for chain in plan.chains)
    paths = tuple(separator.join(chart.states[state].id for state in chain) for chain in chains)
    (initial,) = distinct(["initial"], ids)
    triggers = [event.name for event in chart.events]
    timed = [t for t in chart.transitions if t.has_timer]
    own = ["start", "_always", *(f"_{t.trigger.value}_{t.index}" for t in timed)]
    start, always, *chosen = distinct(own, triggers)
    own_names = _names(chart, {*triggers, start, always, *chosen})
    by_timer = {t.index: name for t, name in zip(timed, chosen, strict=True)}
    by_index = {t.index: by_timer[t.timer] for t in chart.transitions if t.timer is not None}
    return ModelNames(own_names, separator, paths, initial, start, always, by_index)


def _names(chart: Chart, triggers: set[str]) -> Names:
    machine = name_of_class(chart.name)
    states = distinct([identifier(state.id) for state in chart.states])
    taken = MODEL | triggers
    variables = [v.name for group in (chart.data, chart.inputs, chart.outputs) for v in group]
    attributes = distinct([_public(name) for name in variables], taken)
    operations = [operation.name for operation in chart.operations]
    methods = distinct([_public(name) for name in operations], taken | set(attributes))
    return Names(
        machine=machine,
        states=states,
        bare=states,
        events=distinct([identifier(event.name) for event in chart.events]),
        types=tuple(event.type for event in chart.events),
        transitions=tuple(f"{states[t.source]}_{t.index}" for t in chart.transitions),
        variables=dict(zip(variables, attributes, strict=True)),
        operations=dict(zip(operations, methods, strict=True)),
        timers={},
    )


def _public(name: str) -> str:
    """Return a name that no generated method has."""
    found = identifier(name)
    return f"v_{found}" if found.startswith(("_", *PREFIXES)) else found


def file_name(chart: Chart) -> str:
    """Return the name of the module: ``feeder_machine.py``."""
    return f"{snake(chart.name)}_machine.py"


def text(value: str) -> str:
    """Return a text as a literal of Python."""
    return json.dumps(value, ensure_ascii=False)
