"""Properties of a network in JANI: what can be reached has the greatest probability 1, else 0."""

from __future__ import annotations

from fsmkit.diagnostics import Findings, FsmkitError
from fsmkit.export.exporter import leave_out
from fsmkit.export.formula import condition_of, deadlock, goal_of
from fsmkit.export.jani.identifiers import UNFORESEEN, Spelling
from fsmkit.export.jani.terms import Json, binary, conjunction, negated
from fsmkit.export.network import Network
from fsmkit.system.properties.property import AtStates, Builtin, OverGraph, Property
from fsmkit.texts import plain

FORESEEN = "foreseen"
"""The property that nothing happens which the explorer never saw."""


def properties_of(
    network: Network, spelling: Spelling, findings: Findings | None = None
) -> tuple[list[Json], list[str]]:
    """Return the properties, and remarks on those that are left out."""
    found: list[Json] = []
    remarks: list[str] = []
    properties = network.closed.system.properties
    for property_ in properties:
        values: dict[str, Json] | str
        try:
            values = _values(network, spelling, property_)
        except FsmkitError as error:
            values = error.diagnostics[0].message
        if isinstance(values, str):
            leave_out(property_, values, findings)
            name, text = plain(property_.name), plain(property_.text)
            remarks.append(f"Property `{name}` ({text}) is not carried over: {values}.")
            continue
        decided = property_.kind.decided
        unfair = isinstance(decided, OverGraph) and decided.is_fair
        note = " (no fairness: what is owed may never come)" if unfair else ""
        some = property_.is_wanted
        found.append(_property(property_.name, values, property_.text + note, some=some))
    name = FORESEEN
    while name in {property_.name for property_ in properties}:
        name += "_"
    found.append(_property(name, never(UNFORESEEN), "all that happens the explorer saw, too"))
    return found, remarks


def _values(network: Network, spelling: Spelling, property_: Property) -> dict[str, Json] | str:
    """Return when a property holds, or why that is not said."""
    match property_.kind.decided:
        case Builtin.DEADLOCK:
            return never(spelling.formula(deadlock(network)))
        case AtStates(negated=is_negated, wanted=is_wanted):
            condition = spelling.formula(condition_of(network, property_))
            if is_wanted:
                return sometimes(condition)
            return never(negated(condition) if is_negated else condition)
        case OverGraph(procedure="recoverable"):
            return never(never(spelling.formula(condition_of(network, property_))))
        case OverGraph(procedure="leads-to"):
            condition = spelling.formula(condition_of(network, property_))
            goal = spelling.formula(goal_of(network, property_))
            return never(conjunction((condition, _may_stay_away(goal))))
        case _:
            return f"`{property_.kind.key}` is no formula over states"


def never(bad: Json) -> dict[str, Json]:
    """Return that a state is never reached."""
    return {"op": "≤", "left": _probability("Pmax", bad), "right": 0}


def sometimes(good: Json) -> dict[str, Json]:
    """Return that a state can be reached."""
    return {"op": ">", "left": _probability("Pmax", good), "right": 0}


def _may_stay_away(good: Json) -> Json:
    """Return that some run never reaches a state."""
    return binary("<", _probability("Pmin", good), 1)


def _probability(op: str, state: Json) -> Json:
    return {"op": op, "exp": {"op": "F", "exp": state}}


def _property(name: str, values: dict[str, Json], note: str, *, some: bool = False) -> Json:
    """Return a property of all initial states, or of ``some`` of them."""
    fun = "∃" if some else "∀"
    return {
        "name": name,
        "expression": {"op": "filter", "fun": fun, "values": values, "states": {"op": "initial"}},
        "comment": note,
    }
