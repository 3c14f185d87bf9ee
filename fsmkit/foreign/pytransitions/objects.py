"""A machine of the library, or a dictionary that configures one, as the text of a configuration.

Findings then point at lines of that text. Nothing of the machine is called: its states, events and
transitions are only read.
"""

from __future__ import annotations

import inspect
import json
import sys
from collections.abc import Callable, Iterable, Iterator
from enum import Enum
from functools import partial
from typing import Any

from fsmkit.diagnostics import Findings, Source
from fsmkit.foreign.pytransitions.spec import GENERAL, HANDLERS

PARTS = ("conditions", "unless", "before", "after", "prepare")


def source_of(found: object, name: str, findings: Findings) -> Source | None:
    """Return the configuration of a machine, or None after saying why not."""
    core = sys.modules.get("transitions.core")
    write: Callable[[Any, _Callables], dict[str, Any]] | None = None
    if isinstance(found, dict):
        write = _plain
    elif core is not None and isinstance(found, core.Machine):
        write = _machine
    if write is not None:
        callables = _Callables()
        write(found, callables)  # to know all texts, before a function is called like one
        return Source(name, text_of(write(found, _Callables(callables.texts))))
    findings.add(
        "no-machine",
        f"`{name}` is a {type(found).__name__}, no machine of `transitions`",
        None,
        help="name a `Machine`, or the dictionary that configures one",
    )
    return None


def text_of(configuration: dict[str, Any]) -> str:
    """Return a configuration as JSON, each state and transition on a line."""
    lines = []
    for key, value in configuration.items():
        if key in ("states", "transitions") and isinstance(value, list) and value:
            items = ",\n".join(f"    {_json(item)}" for item in value)
            lines.append(f"  {_json(key)}: [\n{items}\n  ]")
        else:
            lines.append(f"  {_json(key)}: {_json(value)}")
    return "{\n" + ",\n".join(lines) + "\n}\n"


def _json(value: object) -> str:
    return json.dumps(value, ensure_ascii=False)


class _Callables:
    """Names for functions: different ones for different functions, and none that is a text."""

    def __init__(self, texts: Iterable[str] = ()) -> None:
        self.texts = set(texts)
        self._named: list[tuple[object, str]] = []

    def name(self, function: object) -> str:
        if isinstance(function, str):
            self.texts.add(function)
            return function
        for known, name in self._named:
            if _is_same(known, function):
                return name
        inner = function
        while isinstance(inner, partial):
            inner = inner.func
        plain = str(getattr(inner, "__name__", type(inner).__name__)).strip("<>")
        taken = {name for _, name in self._named} | self.texts
        name, number = plain, 1
        while name in taken:
            number += 1
            name = f"{plain}_{number}"
        self._named.append((function, name))
        return name


def _is_same(one: object, other: object) -> bool:
    is_method = inspect.ismethod(one) and inspect.ismethod(other)
    return one is other or (is_method and one == other)


def _machine(machine: Any, callables: _Callables) -> dict[str, Any]:
    separator = getattr(machine.state_cls, "separator", None)
    is_nested = separator is not None
    found: dict[str, Any] = {}
    if machine.name:
        found["name"] = machine.name.removesuffix(": ")
    if is_nested:
        found["separator"] = separator
    found["initial"] = _names(machine.initial)
    found["queued"] = bool(machine.has_queue)
    found["auto_transitions"] = bool(machine.auto_transitions)
    found["ignore_invalid_triggers"] = bool(machine.ignore_invalid_triggers)
    for key in GENERAL:
        if functions := getattr(machine, key):
            found[key] = [callables.name(each) for each in functions]
    found["states"] = [_state(name, s, callables) for name, s in machine.states.items()]
    steps = list(_steps(machine.events, machine, callables))
    found["transitions"] = steps
    if inputs := sorted(_attributes(machine, [*steps, *_within(found["states"])])):
        found["inputs"] = inputs
    return found


def _state(name: str, state: Any, callables: _Callables) -> dict[str, Any]:
    found: dict[str, Any] = {"name": name}
    for key in HANDLERS:
        if functions := getattr(state, key, None):
            found[key] = [callables.name(each) for each in functions]
    if getattr(state, "final", False):
        found["final"] = True
    if getattr(state, "timeout", 0):
        found["timeout"] = state.timeout
    if getattr(state, "initial", None):
        found["initial"] = _names(state.initial)
    if getattr(state, "events", None):
        found["transitions"] = list(_steps(state.events, None, callables))
    if getattr(state, "states", None):
        found["children"] = [_state(n, each, callables) for n, each in state.states.items()]
    return found


def _steps(events: Any, machine: Any | None, callables: _Callables) -> Iterator[dict[str, Any]]:
    for event in events.values():
        if machine is not None and machine.auto_transitions and _is_automatic(event, machine):
            continue
        for transitions in event.transitions.values():
            for each in transitions:
                yield _step(event.name, each, callables)


def _step(trigger: str, transition: Any, callables: _Callables) -> dict[str, Any]:
    found = {"trigger": trigger, "source": transition.source, "dest": transition.dest}
    parts = {
        "conditions": [one.func for one in transition.conditions if one.target],
        "unless": [one.func for one in transition.conditions if not one.target],
        **{key: getattr(transition, key) for key in PARTS[2:]},
    }
    for key, functions in parts.items():
        if functions:
            found[key] = [callables.name(function) for function in functions]
    return found


def _is_automatic(event: Any, machine: Any) -> bool:
    """Whether an event is one of those that lead from anywhere to one state."""
    attribute = machine.model_attribute
    prefix = "to_" if attribute == "state" else f"to_{attribute}_"
    return all(
        event.name == f"{prefix}{each.dest}"
        and not (each.conditions or each.before or each.after or each.prepare)
        for transitions in event.transitions.values()
        for each in transitions
    )


def _within(states: list[dict[str, Any]]) -> Iterator[dict[str, Any]]:
    for state in states:
        yield from state.get("transitions", ())
        yield from _within(state.get("children", []))


def _attributes(machine: Any, steps: list[dict[str, Any]]) -> set[str]:
    """Return the conditions that are attributes or properties of a model, not methods."""
    names = {name for step in steps for key in PARTS[:2] for name in step.get(key, ())}
    return {
        name
        for name in names
        for model in machine.models
        if _is_attribute(inspect.getattr_static(model, name, None))
    }


def _is_attribute(found: object) -> bool:
    is_method = callable(found) or isinstance(found, staticmethod | classmethod)
    return found is not None and not is_method


def _names(names: Any) -> Any:
    """Return the names of states given as string, enumeration or object."""
    if isinstance(names, list | tuple):
        return [_names(each) for each in names]
    name = getattr(names, "name", names)
    return name if name is None or isinstance(name, str) else str(name)


def _plain(value: Any, callables: _Callables) -> Any:
    """Return a configuration with names in place of objects."""
    match value:
        case dict():
            return {str(key): _plain(each, callables) for key, each in value.items()}
        case list() | tuple():
            return [_plain(each, callables) for each in value]
        case None | bool() | int() | float() | str():
            return value
        case Enum():
            return value.name
        case _ if callable(value):
            return callables.name(value)
        case _:
            return _names(value)
