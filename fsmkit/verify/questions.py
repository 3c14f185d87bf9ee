"""Queries on a system at an instant: expressions, the effect of an event, and why it has none."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import fsmkit.language as lang
from fsmkit.chart.chart import Chart, Transition
from fsmkit.diagnostics import Findings, Source, Span, Text, fail
from fsmkit.language.walk import nodes
from fsmkit.runtime.interpreter.globals import Globals
from fsmkit.runtime.interpreter.index import index_of
from fsmkit.runtime.interpreter.selection import atomic_states, select_transitions
from fsmkit.runtime.interpreter.snapshot import Occurrence, Snapshot
from fsmkit.runtime.live.values import to_json
from fsmkit.runtime.script import is_received
from fsmkit.system.conditions import read_expression
from fsmkit.system.properties.condition import Atom
from fsmkit.system.system import System
from fsmkit.verify.engines.python.evaluate import World

WRONG = "wrong-command"
MOST_CHARACTERS = 2_000
"""A longer expression is rejected."""
Json = dict[str, Any]


@dataclass(frozen=True, slots=True)
class Expression:
    """A parsed expression over a system."""

    text: str
    tree: lang.Expr
    atoms: tuple[tuple[str, Atom], ...]
    """The meaning of the names in a condition over several machines."""
    value: Callable[[Sequence[Snapshot]], lang.Value]
    """Its value; `ContentError` or `RangeFault` where it has none."""


def read(
    system: System, text: str | Text, machine: int | None, expected: lang.Type | None
) -> Expression:
    """Parse an expression. ``machine``: its scope; None: names are ``machine.name``.

    Raises `FsmkitError` with the errors in it.
    """
    written = text
    if not isinstance(written, Text):
        written = Text(written, Span(Source("<expression>", written), 0, len(written)))
    if len(written.value) > MOST_CHARACTERS:
        raise fail(WRONG, f"the expression has more than {MOST_CHARACTERS} characters")
    findings = Findings()
    charts = tuple(each.chart for each in system.machines)
    if machine is None:
        condition = read_expression(written, system.machines, findings, expected)
        tree = None if condition is None else condition.expression
        atoms = () if condition is None else condition.atoms
    else:
        tree = lang.type_expression(written, _scope(charts[machine]), findings, expected)
        atoms = ()
    findings.stop_on_errors()
    if tree is None:
        raise fail(WRONG, f"`{text}` is not an expression")
    if any(isinstance(node, lang.EventField) for node in nodes(tree)):
        raise fail(WRONG, "there is no current event between steps", help="use variables and `In`")
    read_tree = tree

    def value(snapshots: Sequence[Snapshot]) -> lang.Value:
        return lang.evaluate(read_tree, World(charts, snapshots, owner=machine, atoms=atoms))

    return Expression(written.value, tree, atoms, value)


def _scope(chart: Chart) -> lang.Scope:
    """Return the names that an expression between steps can use."""
    storages = ((chart.data, lang.Storage.DATA), (chart.inputs, lang.Storage.INPUT), (chart.outputs, lang.Storage.OUTPUT))  # fmt: skip  # noqa: E501
    return lang.Scope(
        variables={v.name: (v.type, storage) for them, storage in storages for v in them},
        constants=dict(chart.constants),
        types={str(type_): type_ for type_ in chart.types},
        states=chart.active_index,
        tick=chart.capacities.tick,
    )


def holds(condition: Expression, snapshots: Sequence[Snapshot]) -> bool:
    """Whether a condition holds; one that cannot be evaluated does not."""
    try:
        return bool(condition.value(snapshots))
    except (lang.ContentError, lang.RangeFault):
        return False


def shown(expression: Expression, snapshots: Sequence[Snapshot]) -> Json:
    """Return the value of an expression, or why it has none."""
    try:
        value = expression.value(snapshots)
    except (lang.ContentError, lang.RangeFault) as error:
        return {"error": error.reason}
    return {"value": to_json(value, expression.tree.type), "type": str(expression.tree.type)}


# --- the effect of an event -----------------------------------------------------------------------


class UnknownError(Exception):
    """A guard needs a payload or a result of the host, which are not known before the step."""


class _GuardEvaluator(Globals):
    """A machine whose guards are evaluated without effects."""

    def __init__(
        self, chart: Chart, snapshot: Snapshot, event: int, payload: tuple[lang.Value, ...] | None
    ) -> None:
        super().__init__(chart, snapshot, _NoHost())
        self.event = Occurrence(event, payload or ())
        self.is_known = payload is not None

    def event_field(self, name: str) -> lang.Value:
        if not self.is_known:
            raise UnknownError
        return super().event_field(name)


class _NoHost:
    def call(self, operation: str, arguments: tuple[lang.Value, ...]) -> lang.Value | None:
        del operation, arguments
        raise UnknownError


def why(
    chart: Chart, snapshot: Snapshot, event: int, payload: tuple[lang.Value, ...] | None
) -> Json:
    """Return the effect of an event: the candidate transitions, and the values of their guards.

    ``would``: ``yes``, ``no``, ``deferred``, or ``?`` if it depends on a payload that is not given
    or on an operation of the host.
    """
    if not snapshot.running:
        return {"would": "no", "looked": [], "because": "the machine does not run"}
    dry = _GuardEvaluator(chart, snapshot, event, payload)
    try:
        enabled, is_deferred = select_transitions(dry, event)
        would = "yes" if enabled else "deferred" if is_deferred else "no"
    except UnknownError:
        would = "?"
    rows = list(_candidates(dry, event))
    if dry.fault is not None:
        return {"would": "fault", "looked": rows, "because": f"a guard ends in `{dry.fault}`"}
    because = "" if rows or would != "no" else "no active state has a transition for it"
    return {"would": would, "looked": rows, **({"because": because} if because else {})}


def _candidates(dry: _GuardEvaluator, event: int) -> Iterator[Json]:
    """Yield the candidates for an event from the leaves outwards, up to the first that is taken.

    The order is that of `select_transitions`, before conflicts are removed.
    """
    seen: set[int] = set()
    for leaf in atomic_states(dry):
        for state in dry.index.chain[leaf]:
            for transition in dry.index.by_event[state].get(event, ()):
                row = _candidate(dry, transition)
                if transition.index not in seen:
                    seen.add(transition.index)
                    yield row
                if row["holds"] is True:
                    break
            else:
                if event in dry.index.defers[state]:
                    break
                continue
            break


def _candidate(dry: _GuardEvaluator, transition: Transition) -> Json:
    """Return a transition with its guard and the values in it."""
    chart, guard = dry.chart, transition.guard
    row: Json = {"t": transition.index, "state": chart.states[transition.source].id, "holds": True}
    if guard is None:
        return row
    row["guard"] = lang.format_expression(guard, chart.capacities.tick)
    read = {node.name: node for node in nodes(guard) if isinstance(node, lang.Variable)}
    row["values"] = {
        name: to_json(dry.variable(name), node.type)
        for name, node in read.items()
        if name in index_of(chart).slots
    }
    try:
        row["holds"] = bool(lang.evaluate(guard, dry))
    except UnknownError:
        row["holds"] = "?"
    except (lang.ContentError, lang.RangeFault) as error:
        row |= {"holds": False, "error": error.reason}
    return row


def events(chart: Chart, snapshot: Snapshot | None) -> list[Json]:
    """Return the events that a machine receives, and whether each would have an effect now.

    For an unknown machine, None, it is ``?``.
    """
    return [
        {
            "event": event.name,
            "would": "?"
            if snapshot is None
            else why(chart, snapshot, event.index, _empty_payload(chart, event.index))["would"],
        }
        for event in chart.events
        if is_received(event)
    ]


def _empty_payload(chart: Chart, event: int) -> tuple[lang.Value, ...] | None:
    """Return the payload of an event without fields."""
    return None if chart.events[event].fields else ()
