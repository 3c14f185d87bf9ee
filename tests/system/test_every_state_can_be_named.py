"""Every state can be named wherever `In` may stand, whatever else has its name."""

from __future__ import annotations

import random
from pathlib import Path

import pytest

import fsmkit
from fsmkit.system.of_one_chart import system_of_chart
from fsmkit.system.system import System
from tests.parameters import sampled

WORDS = ("a", "b", "m", "i", "left", "In_", "occurs_", "all_", "x1")
"""Names of states, data, events, operations, copies and machines alike."""
PART = """
chart: Part
data: {{{datum}: 0..3 = 0}}
events: {{in: [{event}]}}
initial: {first}
states:
  {first}: {{on: {{{event}: {second}}}}}
  {second}: {{on: {{{event}: {first}}}}}
"""


def part(draw: random.Random, words: list[str]) -> str:
    first, second = draw.sample(words, 2)
    datum, event = draw.sample(words, 2)
    return PART.format(datum=datum, event=event, first=first, second=second)


def chart(draw: random.Random, words: list[str], event: str) -> str:
    """Return a chart with copies, regions and data whose names are those of its states."""
    copied, plain, region, other = draw.sample(words, 4)
    return f"""
chart: {draw.choice(words)}
data: {{{draw.choice([plain, region, other])}: bool = false}}
inputs: {{{draw.choice([w for w in words if w not in (plain, region, other)])}2: bool}}
events: {{in: [go]}}
initial: {copied}
states:
  {copied}: {{use: part.yaml, bind: {{{event}: go}}, on: {{go: {plain}}}}}
  {plain}:
    regions:
      {region}: {{initial: r, states: {{r: {{on: {{go: s}}}}, s: {{}}}}}}
      {other}: {{states: {{{plain}9: {{}}}}}}
"""


def properties(states: list[str], forms: list[str]) -> str:
    lines = [
        f"  p{number}_{place}: {{reachable: '{form.replace('STATE', state)}'}}"
        for place, state in enumerate(states)
        for number, form in enumerate(forms)
    ]
    return "\n".join(["properties:", *lines, ""])


def observed(system: System) -> dict[str, set[tuple[int, int | None]]]:
    """Return the machines and states that the condition of each property reads."""
    return {
        each.name: {(atom.machine, atom.state) for _, atom in each.atoms}
        for each in system.properties
    }


def parts(folder: Path, seed: int) -> tuple[random.Random, list[str], str]:
    """Write a part; return what draws names, the names, and the event of the part."""
    draw = random.Random(seed)
    words = list(WORDS)
    text = part(draw, words)
    (folder / "part.yaml").write_text(text)
    return draw, words, text.split("in: [")[1].split("]")[0]


@pytest.mark.parametrize("seed", sampled(range(60), every=4))
def test_in_the_properties_of_a_chart(seed: int, tmp_path: Path) -> None:
    draw, words, event = parts(tmp_path, seed)
    text = chart(draw, words, event)
    path = tmp_path / "chart.yaml"
    path.write_text(text)
    found = fsmkit.read_chart(path)
    states = [state.id for state in found.states[1:]]
    forms = ["In(STATE)", "not In( STATE ) or In(STATE)"]
    path.write_text(text + properties(states, forms))
    seen = observed(system_of_chart(fsmkit.read_chart(path)))
    for place, state in enumerate(states):
        number = found.state_index[state]
        for form in range(len(forms)):
            assert seen[f"p{form}_{place}"] == {(0, number)}, state


@pytest.mark.parametrize("seed", sampled(range(60), every=4))
def test_in_the_properties_of_a_system_with_arrays(seed: int, tmp_path: Path) -> None:
    draw, words, event = parts(tmp_path, seed)
    (tmp_path / "chart.yaml").write_text(chart(draw, words, event))
    found = fsmkit.read_chart(tmp_path / "chart.yaml")
    states = [state.id for state in found.states[1:]]
    one, many, index = draw.sample(words, 3)
    every = f"all({index} in 0..1: {many}[{index}].In(STATE))"
    forms = [f"{one}.In(STATE)", f"{many}[1].In(STATE)", every]
    wanted = [{0}, {2}, {1, 2}]
    text = f"system: S\nmachines: {{{one}: chart.yaml, '{many}[{index} in 0..1]': chart.yaml}}\n"
    path = tmp_path / "all.system.yaml"
    path.write_text(text + "environment: {may: []}\n" + properties(states, forms))
    seen = observed(fsmkit.read_system(path))
    for place, state in enumerate(states):
        number = found.state_index[state]
        for form, machines in enumerate(wanted):
            assert seen[f"p{form}_{place}"] == {(m, number) for m in machines}, state
