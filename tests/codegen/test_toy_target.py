"""A target from outside is found, compiled with, held to the interpreter, and edits nothing."""

from __future__ import annotations

import importlib.metadata
from collections.abc import Iterator
from pathlib import Path
from random import Random

import pytest

import fsmkit
from fsmkit import plugins
from fsmkit.testing.harness.harness import INTERPRETER, harness
from tests.codegen import toy_target

FILE = Path(toy_target.__file__)
CHARTS = 40


class EntryPoint:
    """As an installed package has one in the group `fsmkit.plugins`."""

    def load(self) -> toy_target.Awk:
        return toy_target.PLUGIN


@pytest.fixture(autouse=True)
def installed(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    monkeypatch.setattr(plugins, "_may_be_registered", lambda: True)
    monkeypatch.setattr(
        importlib.metadata, "entry_points", lambda group: [EntryPoint()] if group else []
    )
    for cached in (plugins._all, plugins._of_kind):
        cached.cache_clear()
    yield
    for cached in (plugins._all, plugins._of_kind):
        cached.cache_clear()


def flat(random: Random) -> str:
    """Return a chart of states, events and sends."""
    states = [f"s{n}" for n in range(random.randint(1, 6))]
    events = [f"e{n}" for n in range(random.randint(1, 4))]
    lines = [
        "chart: Flat",
        f"events: {{in: [{', '.join(events)}], out: [x, y]}}",
        f"initial: {random.choice(states)}",
    ]
    lines.append("states:")
    for state in states:
        heard = [event for event in events if random.random() < 0.6]
        reactions = []
        for event in heard:
            target = f"target: {random.choice(states)}" if random.random() < 0.8 else "do: send y"
            do = ", do: [send x, send y]" if target[0] == "t" and random.random() < 0.3 else ""
            reactions.append(f"{event}: {{{target}{do}}}")
        lines.append(
            f"  {state}: {{on: {{{', '.join(reactions)}}}}}" if heard else f"  {state}: {{}}"
        )
    return "\n".join(lines) + "\n"


def script(random: Random, chart: fsmkit.Chart) -> list[str]:
    events = [event.name for event in chart.events if event.name in ("e0", "e1", "e2", "e3")]
    lines, now = ["start 0"], 0
    for _ in range(30):
        match random.randrange(4):
            case 0:
                now += random.randrange(50)
                lines.append(f"run {now}")
            case 1:
                lines.append(f"ask {random.choice(events)}")
            case _:
                lines.append(f"post {random.choice(events)}")
    return [*lines, f"run {now}"]


@pytest.mark.cc
def test_random_charts_do_as_in_the_interpreter(tmp_path: Path) -> None:
    awk = harness("awk")
    for seed in range(CHARTS):
        random = Random(seed)
        path = tmp_path / f"{seed}.yaml"
        path.write_text(flat(random))
        chart = fsmkit.read_chart(path)
        lines = script(random, chart)
        assert awk.run(chart, lines) == INTERPRETER.run(chart, lines), path.read_text()


def test_it_is_a_target_as_any_other(tmp_path: Path) -> None:
    path = tmp_path / "flat.yaml"
    path.write_text(flat(Random(1)))
    assert fsmkit.compile(path, "awk")["Flat.awk"].startswith("BEGIN {")
    path.write_text("chart: Timed\ninitial: a\nstates: {a: {after: {3s: b}}, b: {}}\n")
    with pytest.raises(fsmkit.FsmkitError, match=r"flat\.yaml:3:"):
        fsmkit.compile(path, "awk")


def test_it_is_small_and_one_file() -> None:
    assert FILE.read_text().count("\n") <= 200
