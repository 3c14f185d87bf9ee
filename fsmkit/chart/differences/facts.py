"""A chart as facts that are compared: names and texts without locations and numbers."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from fsmkit.chart.chart import Chart
from fsmkit.chart.views.chart_json import chart_document
from fsmkit.chart.views.origins import Origins

Json = dict[str, Any]
DECLARATIONS = {
    "types": "type", "constants": "constant", "data": "data", "inputs": "input",
    "outputs": "output", "operations": "operation", "functions": "function", "events": "event",
    "properties": "property",
}  # fmt: skip
"""The lists of declarations, and what one of each is."""
OWN = ("name", "base", "abstract", "doc", "req", "script", "environment")
"""Keys of the chart itself."""
OMITTED = ("at", "origin", "index", "initial", "transitions", "children", "parent", "id", "source")
"""Keys that are compared otherwise, or that have no meaning."""
LINKS = ("at", "origin", "index", "source", "events")
"""Keys of a transition that are compared otherwise; ``descriptors`` has its events as written."""
CHART = ""
"""The name of the root state."""


@dataclass(frozen=True, slots=True)
class StateFacts:
    """A state: its number in the chart, its parent, and its keys."""

    index: int
    id: str
    parent: str
    children: tuple[str, ...]
    keys: Mapping[str, Any]
    at: Json | None = None


@dataclass(frozen=True, slots=True)
class TransitionFacts:
    """A transition: its number in the chart, the state that it leaves, and its keys."""

    index: int
    source: str
    keys: Mapping[str, Any]
    at: Json | None = None


@dataclass(frozen=True, slots=True)
class Facts:
    """The compared parts of a chart."""

    own: Mapping[str, Any]
    declarations: Mapping[str, Mapping[str, Mapping[str, Any]]]
    """By list and name."""
    states: Mapping[str, StateFacts]
    transitions: tuple[TransitionFacts, ...]
    places: Mapping[tuple[str, str], Json]
    """Where a declaration is, by list and name."""


def facts_of(chart: Chart) -> Facts:
    """Return the facts of a chart."""
    written = chart_document(chart, Origins({}, {}, {}, {}))
    return _facts(written)


def _facts(read: Json) -> Facts:
    root = read["states"][0]["id"]

    def named(state: str | None) -> str:
        return CHART if state in (None, root) else str(state)

    declarations: dict[str, dict[str, Json]] = {}
    places: dict[tuple[str, str], Json] = {}
    for list_ in DECLARATIONS:
        declarations[list_] = {}
        for each in read[list_]:
            key = each["name"]
            declarations[list_][key] = _without(each, (*OMITTED, "name"))
            if "at" in each:
                places[list_, key] = each["at"]
    initial = {each["initial"]: named(each["id"]) for each in read["states"]}
    starts = {
        named(each["source"]): each for each in read["transitions"] if each["index"] in initial
    }
    states = {
        named(each["id"]): StateFacts(
            number, named(each["id"]), named(each["parent"]), tuple(each["children"]),
            {**_without(each, OMITTED), **_start(starts.get(named(each["id"])))}, each.get("at"),
        )
        for number, each in enumerate(read["states"])
    }  # fmt: skip
    order = [number for each in read["states"] for number in each["transitions"]]
    transitions = tuple(
        TransitionFacts(
            number,
            named(each["source"]),
            _without(each, ("at", "origin", "index", "source", "events")),
            each.get("at"),
        )
        for number in order
        for each in [read["transitions"][number]]
    )
    own = {key: read[key] for key in OWN}
    own |= {f"capacity {key}": value for key, value in read["capacities"].items()}
    own["invocations"] = [_without(each, ("at",)) for each in read["invocations"]]
    return Facts(own, declarations, states, transitions, places)


def _start(initial: Json | None) -> Json:
    """Return the keys of a state about its initial transition."""
    if initial is None:
        return {}
    content = {"initial content": initial["content"]} if initial["content"] else {}
    return {"initial": " ".join(initial["targets"]), **content}


def _without(part: Any, omitted: tuple[str, ...]) -> Any:
    """Return a part without some keys, and without locations anywhere in it."""
    match part:
        case dict():
            kept = ((k, v) for k, v in part.items() if k not in omitted)
            return {key: _without(value, ("at", "origin")) for key, value in kept}
        case list():
            return [_without(each, ("at", "origin")) for each in part]
        case _:
            return part


# --- renames --------------------------------------------------------------------------------------


def renamed(facts: Facts, kind: str, old: str, new: str) -> Facts:
    """Return the facts after a state (``kind`` is ``state``) or a declaration was renamed."""
    word = re.compile(rf"(?<![\w.]){re.escape(old)}(?![\w])")
    if kind == "state":
        inside = re.compile(rf"\bIn\({re.escape(old)}\)")
        targets = re.compile(rf"(?<!\S){re.escape(old)}(?!\S)")

        def text(value: str, key: str) -> str:
            if key in ("targets", "initial"):
                return targets.sub(lambda _: new, value)
            return inside.sub(lambda _: f"In({new})", value)

        def name(state: str) -> str:
            return new if state == old else state
    else:

        def text(value: str, key: str) -> str:
            is_name_of_state = key in ("targets", "initial", "doc")
            return value if is_name_of_state else word.sub(lambda _: new, value)

        def name(state: str) -> str:
            return state

    def part(value: Any, key: str = "") -> Any:
        match value:
            case str():
                return text(value, key)
            case list():
                return [part(each, key) for each in value]
            case dict():
                return {k: part(each, k) for k, each in value.items()}
            case _:
                return value

    declarations = {
        list_: {new if list_ == kind and k == old else k: part(v) for k, v in entries.items()}
        for list_, entries in facts.declarations.items()
    }
    states = {
        name(key): StateFacts(
            each.index, name(each.id), name(each.parent), tuple(map(name, each.children)),
            part(each.keys), each.at,
        )
        for key, each in facts.states.items()
    }  # fmt: skip
    transitions = tuple(
        TransitionFacts(each.index, name(each.source), part(each.keys), each.at)
        for each in facts.transitions
    )
    return Facts(part(facts.own), declarations, states, transitions, facts.places)
