"""Random machines of the library, run by itself and as the charts that they are read into."""

from __future__ import annotations

import copy
from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from typing import Any

from transitions import Machine
from transitions.extensions import HierarchicalMachine

from devtools.random_charts.choices import Choices, SeededChoices
from fsmkit.chart.chart import Chart
from fsmkit.diagnostics import Findings, FsmkitError
from fsmkit.foreign.pytransitions import chart_of
from fsmkit.runtime.script import SeededHost
from fsmkit.testing.harness.harness import INTERPRETER

Configuration = dict[str, Any]
TRIGGERS = ("e0", "e1", "e2", "e3")
CONDITIONS = ("c0", "c1", "c2")
CALLBACKS = tuple(f"f{number}" for number in range(6))
SETTINGS: Configuration = {
    "queued": True,
    "ignore_invalid_triggers": True,
    "auto_transitions": False,
}


@dataclass(frozen=True)
class Comparison:
    """A machine run both ways: lines of what was called and where it was, trigger by trigger."""

    library: list[str]
    chart: list[str]
    configuration: Configuration
    rules: set[str]
    """Of the findings."""


def random_configuration(choices: Choices) -> Configuration:
    """Return arguments of a `Machine`, or of a `HierarchicalMachine` if a state has children."""
    return _Author(choices).configuration()


class _Author:
    def __init__(self, choices: Choices) -> None:
        self.choices = choices
        self.callback_chance = choices.pick((30, 0, 60))
        self.parallel: list[str] = []
        self.levels = ("abcd",) * 3 if choices.chance(10) else ("abcd", "klmn", "wxyz")

    def configuration(self) -> Configuration:
        is_nested = self.choices.chance(75)
        states = self._states(2 if is_nested else 0, self.choices.integer(2, 4), [])
        names = list(_names(states))
        outside = [name for name in names if not any(_is_in(name, p) for p in self.parallel)]
        found: Configuration = {
            **SETTINGS,
            "states": states,
            "initial": self.choices.pick(names if self.choices.chance(5) else outside),
            "transitions": self._transitions(names, self.choices.integer(2, 9), is_nested),
        }
        if self.choices.chance(10):
            found["ordered_transitions"] = True
        for key in ("before_state_change", "after_state_change", "on_final"):
            if self.choices.chance(12):
                found[key] = self._callbacks()
        return found

    def _states(self, depth: int, count: int, above: list[str]) -> list[Any]:
        return [self._state(name, depth, above) for name in self.levels[len(above)][:count]]

    def _state(self, name: str, depth: int, above: list[str]) -> Any:
        found: Configuration = {"name": name}
        for key in ("on_enter", "on_exit"):
            if self.choices.chance(self.callback_chance // 2):
                found[key] = self._callbacks()
        kind = self.choices.integer(0, 9) if depth > 0 else 0
        if kind >= 5:
            children = self._states(depth - 1, self.choices.integer(1, 3), [*above, name])
            if kind >= 7 and len(children) > 1:
                found["parallel"] = children
                self.parallel.append("_".join((*above, name)))
            else:
                found["children"] = children
                if self.choices.chance(65):
                    found["initial"] = self.levels[len(above) + 1][0]
            if self.choices.chance(15):
                inside = list(_names(children))
                found["transitions"] = self._transitions(inside, self.choices.integer(1, 2), True)
        elif self.choices.chance(12):
            found["final"] = True
        return name if len(found) == 1 else found

    def _transitions(self, names: list[str], count: int, is_nested: bool) -> list[Any]:
        found = []
        for _ in range(count):
            source: Any = self.choices.pick(names)
            wish = self.choices.integer(0, 11)
            if wish == 0:
                source = "*"
            elif wish == 1:
                source = list(self.choices.some(names, 3))
            dest: Any = self._dest(source, names, is_nested)
            step: Configuration = {
                "trigger": self.choices.pick(TRIGGERS),
                "source": source,
                "dest": dest,
            }
            for key in ("conditions", "unless"):
                if self.choices.chance(18):
                    step[key] = list(self.choices.some(CONDITIONS, 2))
            for key in ("before", "after"):
                if self.choices.chance(self.callback_chance):
                    step[key] = self._callbacks()
            if not {"conditions", "unless"} & set(step) and self.choices.chance(10):
                step["prepare"] = self._callbacks()
            is_plain = set(step) == {"trigger", "source", "dest"}
            found.append(list(step.values()) if is_plain and self.choices.chance(50) else step)
        return found

    def _dest(self, source: Any, names: list[str], is_nested: bool) -> Any:
        wish = self.choices.integer(0, 11)
        if wish == 0:
            return None
        if wish == 1:
            return "="
        if is_nested and isinstance(source, str) and wish < 11:
            parent = source.rpartition("_")[0]
            while parent in self.parallel:
                parent = parent.rpartition("_")[0]
            beside = [name for name in names if name.rpartition("_")[0] == parent]
            return self.choices.pick(beside or names)
        return self.choices.pick(names)

    def _callbacks(self) -> Any:
        found = self.choices.some(CALLBACKS, 2)
        return found[0] if len(found) == 1 else list(found)


def _names(states: list[Any], above: str = "") -> Iterator[str]:
    for state in states:
        if isinstance(state, str):
            yield above + state
        else:
            name = above + state["name"]
            yield name
            yield from _names(state.get("children", state.get("parallel", [])), f"{name}_")


def _is_in(name: str, above: str) -> bool:
    return name.startswith(f"{above}_")


# --- both ways --------------------------------------------------------------------------------


class Model:
    """Tells what the library calls, and answers as the host of every harness does."""

    state: Any

    def __init__(self) -> None:
        self.host: SeededHost | None = None
        self.told: list[str] = []
        for name in (*CONDITIONS, *CALLBACKS):
            setattr(self, name, partial(self._call, name))

    def _call(self, name: str) -> object:
        assert self.host is not None
        result = self.host.call(name, ())
        self.told.append(f"op {name}" if result is None else f"op {name} = {int(bool(result))}")
        return result


def machine_of(configuration: Configuration, model: object) -> Any:
    """Return the library's own machine."""
    own = copy.deepcopy(configuration)
    is_nested = any(
        isinstance(state, dict) and {"children", "parallel", "transitions"} & set(state)
        for state in own["states"]
    )
    return (HierarchicalMachine if is_nested else Machine)(model, **own)


def compare(configuration: Configuration, triggers: list[str]) -> Comparison | None:
    """Run a machine both ways; None where it is refused."""
    model = Model()
    machine = machine_of(configuration, model)
    findings = Findings()
    try:
        chart = chart_of(machine, findings=findings)
    except FsmkitError:
        return None
    model.host = SeededHost(chart)
    library = [_configuration(machine, model)]
    for trigger in triggers:
        model.told = []
        if trigger in machine.events or _knows(machine, trigger):
            model.trigger(trigger)  # type: ignore[attr-defined]
        library += [*model.told, _configuration(machine, model)]
    rules = {one.rule.name for one in findings}
    return Comparison(library, run_chart(chart, triggers), configuration, rules)


def _knows(machine: Any, trigger: str) -> bool:
    return isinstance(machine, HierarchicalMachine) and machine.has_trigger(trigger)


def run_chart(chart: Chart, triggers: list[str]) -> list[str]:
    """Return what the interpreter calls, and where it is."""
    known = [trigger for trigger in triggers if trigger in chart.event_index]
    trace = iter(INTERPRETER.run(chart, ["start 0", *(f"dispatch {t}" for t in known)]))
    steps: list[list[str]] = []
    here: list[str] = []
    for line in trace:
        if line.startswith("op "):
            here.append(line)
        elif line.startswith("="):
            active = sorted(name.removesuffix("_alone") for name in line.split()[1:])
            steps.append([*here, f"= {' '.join(name for name in active if name != 'finished')}"])
            here = []
    found = steps.pop(0)
    last = found[-1]
    for trigger in triggers:
        if trigger in chart.event_index and steps:
            step = steps.pop(0)
            last = step[-1]
            found += step
        else:
            found.append(last)
    return found


def _configuration(machine: Any, model: Model) -> str:
    del machine
    return f"= {' '.join(sorted(_flat(model.state)))}"


def _flat(states: Any) -> Iterator[str]:
    if isinstance(states, list):
        for state in states:
            yield from _flat(state)
    else:
        yield states


def random_comparison(seed: int, number: int) -> Comparison | None:
    """Return one example; the same for the same seed and number."""
    choices = SeededChoices(f"machines {seed}:{number}")
    configuration = random_configuration(choices)
    triggers = [choices.pick((*TRIGGERS, "next_state")) for _ in range(25)]
    return compare(configuration, triggers)


def behaviour(chart: Chart) -> dict[str, object]:
    """Return what a chart does, by names: the order of triggers of a state means nothing."""
    found: dict[str, object] = {}
    for state in chart.states:
        by_event: dict[str, list[object]] = {}
        for index in state.transitions:
            t = chart.transitions[index]
            targets = tuple(chart.states[target].id for target in t.targets)
            step = (str(t.guard), targets, t.internal, str(t.content), t.delay)
            by_event.setdefault(",".join(t.descriptors), []).append(step)
        initial = None if state.initial is None else chart.transitions[state.initial].targets
        handlers = (str(state.on_entry), str(state.on_exit))
        found[state.id] = (state.kind, state.parent, initial, handlers, state.rest, by_event)
    return found
