"""CSPm: read by the rules of CSP, what is written has the steps and verdicts of the explorer."""

from __future__ import annotations

import os
import re
from collections.abc import Mapping
from contextlib import redirect_stdout
from dataclasses import dataclass, replace
from io import StringIO
from pathlib import Path

import pytest

from fsmkit.cli import execute
from fsmkit.diagnostics import Findings, FsmkitError
from fsmkit.export import explored
from fsmkit.export.collect import network_of
from fsmkit.export.cspm.alphabet import Alphabet
from fsmkit.export.cspm.assertions import assertions_of
from fsmkit.export.cspm.identifiers import comment, format_names
from fsmkit.export.cspm.model import write_model
from fsmkit.export.exporter import ExportOptions
from fsmkit.export.formula import Form
from fsmkit.export.transition_system import START, TICK, _label
from fsmkit.system.any_file import load_any
from fsmkit.system.properties.kinds import deadlock_free
from fsmkit.system.system import System
from fsmkit.verify.engines.python.oracle import explore_in_python
from fsmkit.verify.statespace.actions import Mover
from fsmkit.verify.statespace.closed_system import ClosedSystem
from fsmkit.verify.statespace.exploration import Exploration
from fsmkit.verify.statespace.global_steps import GlobalSteps, State
from tests.export.cspm_format import broken_rules
from tests.export.cspm_meaning import Event, Meaning, bisimilar, relabelled
from tests.verify.conftest import Load
from tests.verify.random_systems import random_system
from tests.verify.systems import SYSTEMS

MONITORED = """
system: Watched
machines: {ping: ping.yaml, pong: pong.yaml}
connect: [ping.ping -> pong.ping, pong.pong -> ping.pong]
environment: {may: [ping.go], will: [pong]}
properties:
  served: {monitor: watch.yaml, watch: [ping.ping -> served, occurs(ping.pong) -> back]}
  busy: {reachable: ping.In(busy)}
"""
PARTNERS = ["ping", "pong"]
WATCH = """
chart: Watch
data: {n: 0..2 = 0}
events: {in: [served, back]}
initial: quiet
states:
  quiet:
    on:
      served:
        - {if: n < 2, do: n += 1}
        - {target: error}
      back: {if: n > 0, do: n -= 1}
  error: {}
"""

ENDING = """
system: Ending
machines: {caller: caller.yaml, called: called.yaml}
connect: [caller.ring -> called.ring, caller.ring -> called.again, called.over -> caller.over]
environment: {may: [caller.dial], will: [caller]}
properties:
  over: {reachable: called.In(over)}
  D: deadlock_free
"""
CALLER = """
chart: Caller
events: {in: [dial, over], out: [ring]}
data: {calls: 0..3 = 0}
initial: idle
states:
  idle:
    rest: true
    on: {dial: {do: send ring}, over: {if: calls < 3, do: calls += 1}}
"""
CALLED = """
chart: Called
capacity: {queue: 3}
data: {n: 0..1 fault = 0}
events: {in: [ring, again], out: [over]}
initial: first
states:
  first:
    on: {ring: second, again: {do: n += 1}}
  second: {on: {again: over, ring: {do: n += 1}}, after: {10ms: first}}
  over: {final: true, entry: send over}
"""

MACHINES = Path(__file__).parents[2] / "machines"
RANDOM = int(os.environ.get("FSMKIT_CSPM_SYSTEMS", "5"))
"""So many random systems; those that are refused, or too large to be read here, are skipped."""
Graph = list[list[tuple[str, int]]]


def explorers(closed: ClosedSystem, most: int) -> Graph:
    """Return the graph of the explorer, 0 before the start; time passes where all is quiet."""
    steps = GlobalSteps(closed)
    order: list[State] = []
    numbers: dict[State, int] = {}

    def number_of(state: State) -> int:
        if state not in numbers:
            order.append(state)
            numbers[state] = len(order)
            assert len(order) <= most
        return numbers[state]

    graph = [[(START, number_of(edge.to)) for edge in steps.initial()]]
    while len(graph) <= len(order):
        state = order[len(graph) - 1]
        edges = list(steps.successors(state))
        shown = steps.snapshots(state)
        arrows = [(_label(closed, shown, edge), number_of(edge.to)) for edge in edges]
        busy = any(edge.mover is Mover.INTERNAL for edge in edges)
        if closed.unit and not busy and all(label != TICK for label, _ in arrows):
            arrows.append((TICK, numbers[state]))
        graph.append(arrows)
    return graph


@dataclass(frozen=True)
class Compared:
    """What was compared: states, and verdicts by property."""

    states: int
    verdicts: Mapping[str, bool]


def compared(system: System, *, untimed: bool, silent: bool = False, most: int = 4000) -> Compared:
    """Demand that the reading of the CSPm is bisimilar to the explorer, and checkers alike."""
    network = network_of(system, ExportOptions(untimed=untimed, silent=silent, most=most))
    alphabet = Alphabet(network)
    names = {
        name: f"{network.automata[event.machine].name}: {event.label}"
        for event, name in alphabet.events.items()
    }
    text = write_model(network)
    assert list(broken_rules(text)) == []
    meaning = Meaning(text)

    def label(event: Event) -> str:
        if event[0] in names:
            return names[event[0]]
        assert len(event) == (1 if event[0] == "tock" else 2)
        return TICK if event[0] == "tock" else START

    ours = explorers(network.closed, most)
    theirs = meaning.graph(meaning.reference("SYSTEM", []), most + 1)
    theirs_ = relabelled(theirs, label)
    assert len(theirs_) == len(ours) == network.states + 1
    assert bisimilar(ours, theirs_)
    return Compared(network.states, evaluated(network.closed, meaning, alphabet))


def evaluated(closed: ClosedSystem, meaning: Meaning, alphabet: Alphabet) -> dict[str, bool]:
    """Demand that the assertions say what the explorer says; return what they say."""
    found, _ = explore_in_python(closed)
    unseen, *others = meaning.script.assertions
    *properties, divergence = others[: -2 if closed.unit else -1]
    if closed.unit:
        assert meaning.holds(others[-1], 10**5) is (found.livelock is None)
    assert meaning.holds(unseen, 10**5)
    assert meaning.holds(divergence, 10**5) is (found.livelock is None)
    verdicts = {"livelock": found.livelock is None}
    carried = [
        one for one in assertions_of(alphabet.network, alphabet.names, None) if one.is_carried
    ]
    for one, assertion in zip(carried, properties, strict=True):
        wanted = is_seen(closed, found, one.claim.property.name) is (one.claim.form is Form.REACHED)
        assert meaning.holds(assertion, 10**5) is wanted, one.claim.property.name
        verdicts[one.claim.property.name] = wanted
    return verdicts


def is_seen(closed: ClosedSystem, found: Exploration, name: str) -> bool:
    """Whether the explorer marks a state for a property."""
    (number,) = [n for n, p in enumerate(closed.system.properties) if p.name == name]
    property_ = closed.system.properties[number]
    mark = 0 if property_.kind is deadlock_free.KIND else 1 + number
    return found.mark(mark) is not None


def read(path: Path) -> System:
    return load_any(path, Findings())


@pytest.fixture(autouse=True)
def _in_python(monkeypatch: pytest.MonkeyPatch) -> None:
    """Small systems are explored sooner than a core is compiled for them."""
    monkeypatch.setattr(explored, "compiler", lambda: None)


@pytest.mark.slow
@pytest.mark.parametrize("untimed", [False, True], ids=["discrete", "untimed"])
@pytest.mark.parametrize("name", SYSTEMS)
def test_systems(load: Load, name: str, untimed: bool) -> None:
    compared(load(**SYSTEMS[name]), untimed=untimed)


@pytest.mark.slow
@pytest.mark.parametrize("untimed", [False, True], ids=["discrete", "untimed"])
@pytest.mark.parametrize(
    "name", ["fischer/fischer", "fischer/hasty", "philosophers/table", "philosophers/ordered_table"]
)
def test_examples(name: str, untimed: bool) -> None:
    found = compared(read(MACHINES / f"{name}.yaml"), untimed=untimed)
    assert found.verdicts["livelock"]
    assert len(found.verdicts) > 1


@pytest.mark.slow
@pytest.mark.parametrize(
    "name", ["supervisor", "molder", "rotator", "pairs/supervisor", "rest/giver", "rest/taker"]
)
def test_charts_of_the_cell(name: str) -> None:
    compared(read(MACHINES / f"production_cell/{name}.yaml"), untimed=True)


@pytest.mark.parametrize("untimed", [False, True], ids=["discrete", "untimed"])
@pytest.mark.parametrize("seed", range(RANDOM))
def test_random_systems(load: Load, seed: int, untimed: bool) -> None:
    try:
        system = load(**random_system(seed))
        network_of(system, ExportOptions(untimed=untimed, most=1500))
    except FsmkitError:
        return  # nothing to compare: it is no system, or too large
    compared(system, untimed=untimed)


@pytest.mark.parametrize("untimed", [False, True], ids=["discrete", "untimed"])
def test_monitors_see_first(load: Load, untimed: bool) -> None:
    files = {"watched": MONITORED, "watch": WATCH, **{k: SYSTEMS["livelock"][k] for k in PARTNERS}}
    found = compared(load(**files), untimed=untimed)
    assert "busy" in found.verdicts
    assert "served" in found.verdicts


@pytest.mark.parametrize("untimed", [False, True], ids=["discrete", "untimed"])
def test_the_queue_of_a_machine_that_stops_is_emptied(load: Load, untimed: bool) -> None:
    system = load(ending=ENDING, caller=CALLER, called=CALLED)
    network = network_of(system, ExportOptions(untimed=untimed))
    assert any(not local.running for local in network.automata[1].locals)
    assert "CALLED_QUEUE_CLOSED" in write_model(network)
    compared(system, untimed=untimed)


PINGS = """
system: Pings
machines: {e: pinger.yaml, s: ponger.yaml}
connect: [e.ping -> s.ping, s.back -> e.back]
properties:
  e: {reachable: s.last == 2}
  D: deadlock_free
"""
PINGER = """
chart: Pinger
events: {in: [back], out: [ping(k 0..2)]}
data: {n: 0..2 = 0}
initial: s
states:
  s: {rest: true, sometimes: {target: m, do: "send ping(k = n)"}}
  m: {on: {back: {target: s, do: "n = (n + 1) % 3"}}}
"""
PONGER = """
chart: Ponger
capacity: {queue: 8}
events: {in: [ping(k 0..2)], out: [back]}
data: {last: 0..2 = 0}
initial: e
states:
  e: {rest: true, on: {ping: {do: "last = event.k; send back"}}}
"""


def states_of_parts(meaning: Meaning) -> list[int]:
    """Return the states of each process of the composition, before the others restrict it."""
    parts = len(meaning.script.equations["PART"])
    return [
        len(meaning.graph(meaning.reference("PART", [number]), 10**5)) for number in range(parts)
    ]


@pytest.mark.parametrize("capacity", [8, 80, 250])
def test_a_queue_has_the_states_that_are_reached(load: Load, capacity: int) -> None:
    """A process over all words of three messages up to 8 would have 9,841 states."""
    ponger = PONGER.replace("queue: 8", f"queue: {capacity}")
    network = network_of(load(pings=PINGS, pinger=PINGER, ponger=ponger), ExportOptions())
    assert network.automata[1].queue == capacity
    meaning = Meaning(write_model(network))
    assert states_of_parts(meaning) == [7, 4, 4, 6]
    compared(load(pings=PINGS, pinger=PINGER, ponger=ponger), untimed=True)


@pytest.mark.cc
@pytest.mark.parametrize("name", ["csma_cd/csma_cd", "fddi/fddi", "gantry/gantry"])
def test_no_process_is_larger_than_the_system(name: str) -> None:
    network = network_of(read(MACHINES / f"{name}.yaml"), ExportOptions(untimed=True))
    assert sum(states_of_parts(Meaning(write_model(network)))) <= 2 * network.states


def test_a_content_that_was_not_seen_is_found(load: Load) -> None:
    """Without one of the contents the first assertion fails."""
    network = network_of(load(pings=PINGS, pinger=PINGER, ponger=PONGER), ExportOptions())
    pinger, ponger = network.automata
    assert len(ponger.contents) > 2
    for content in ponger.contents[1:]:
        rest = tuple(each for each in ponger.contents if each != content)
        without = replace(network, automata=(pinger, replace(ponger, contents=rest)))
        meaning = Meaning(write_model(without))
        assert not meaning.holds(meaning.script.assertions[0], 10**5)


def visible_names(folder: Path, text: str) -> dict[str, str]:
    """Return the names of `VISIBLE` that a chart is written with, and their comments."""
    (folder / "chart.yaml").write_text(text)
    written_ = write_model(network_of(read(folder / "chart.yaml"), ExportOptions(untimed=True)))
    assert list(broken_rules(written_)) == []
    block = written_.partition("datatype LABEL =\n")[2].partition("channel")[0]
    return dict(re.findall(r"(\w+)  -- (.*)", block))


REPRESENTED = """
chart: Arg
types: {{Fault: [none, jam, hot]}}
events: {{in: ["f({payload})"], out: ["g({payload})"]}}
initial: a
states:
  a: {{rest: true, on: {{f: {{target: b, do: "send g({fields})"}}}}}}
  b: {{rest: true, sometimes: {{if: {guard}, target: a}}}}
"""
ALIKE = {
    "k 0..2": {"f_k_0_to_2": "f(k = 0..2)"},
    "k -5..2": {"f_k_minus_5_to_2": "f(k = -5..2)"},
    "k bool": {"f_k_false_to_true": "f(k = false..true)"},
    "k Fault": {"f_k_none_to_hot": "f(k = none..hot)"},
    "k -1..-1": {"f_k_minus_1": "f(k = -1)"},
    "k 0..2, j 0..1000": {"f_k_0_to_2_j_0_to_1000": "f(k = 0..2, j = 0..1000)"},
}


@pytest.mark.parametrize("payload", ALIKE)
def test_an_event_for_several_payloads_says_so(tmp_path: Path, payload: str) -> None:
    fields = ", ".join(f"{name} = event.{name}" for name in re.findall(r"(\w+) [^,]+", payload))
    text = REPRESENTED.format(payload=payload, fields=fields, guard="true")
    found = visible_names(tmp_path, text)
    assert {name: text for name, text in found.items() if name != "leaves_b"} == ALIKE[payload]


def test_payloads_that_a_guard_tells_apart_are_intervals(tmp_path: Path) -> None:
    text = REPRESENTED.format(payload="k -9..9", fields="k = event.k", guard="true")
    text = text.replace("{f: {target", "{f: {if: event.k > 3, target")
    assert set(visible_names(tmp_path, text)) == {"f_k_4_to_9", "leaves_b"}


def test_names_keep_signs(tmp_path: Path) -> None:
    text = (
        "chart: Neg\nevents: {in: [m(k -2..2)]}\ndata: {last: -2..2 = 0}\ninitial: a\nstates:\n"
        "  a: {rest: true, on: {m: {target: b, do: last = event.k}}}\n"
        "  b: {rest: true, on: {m: {if: event.k == -last, target: a}}}\n"
    )
    found = visible_names(tmp_path, text)
    names = ["m_k_minus_2", "m_k_minus_1", "m_k_0", "m_k_1", "m_k_2"]
    assert found == dict(zip(names, (f"m(k = {k})" for k in range(-2, 3)), strict=True))


LATE = """
chart: Late
initial: s
states:
  s: {after: {0ms: t, 1s: s}}
  t: {after: {0ms: s}}
"""


def test_time_that_stands_still_is_asserted(tmp_path: Path) -> None:
    """No deadlock, yet `tock` never comes: the last assertion says so."""
    (tmp_path / "late.yaml").write_text(LATE)
    meaning = Meaning(write_model(network_of(read(tmp_path / "late.yaml"), ExportOptions())))
    *_, deadlock, time = meaning.script.assertions
    assert (deadlock[1], time[1]) == (":[deadlock free [F]]", "[FD=")
    assert meaning.holds(deadlock, 10**4)
    assert not meaning.holds(time, 10**4)
    (tmp_path / "late.yaml").write_text(LATE.replace("{0ms: t, 1s: s}", "{1s: t}"))
    meaning = Meaning(write_model(network_of(read(tmp_path / "late.yaml"), ExportOptions())))
    assert meaning.holds(meaning.script.assertions[-1], 10**4)


def test_a_comment_is_ascii_and_one_line() -> None:
    assert comment("a\nb  'jordb\xe6r', \u03b1\U0001f600") == (
        "a b 'jordb\\xe6r', \\u03b1\\U0001f600"
    )


def test_names_longer_than_a_line_are_listed() -> None:
    names = [letter * 100 for letter in "abc"]
    assert format_names(names, "  ") == f"{{{names[0]},\n   {names[1]},\n   {names[2]}}}"
    script = f"channel {names[0]} : {{0..1}}\nP = (({names[0]}.0 -> P)[[NAMES]])\n"
    pairs = [f"{names[0]} <- {names[0]}"] * 2
    assert not list(
        broken_rules(script.replace("[[NAMES]]", format_names(pairs, "  ", "[[", "]]")))
    )


SCRIPT = "channel go : {0..3}\nP(n) = (go.n -> P(n))\nassert P(0) :[deadlock free [F]]\n"
WRONG = {
    "not printable": SCRIPT.replace("channel", "-- \u2028\nchannel"),
    "needed": f'include "x.csp"\n{SCRIPT}',
    "closes nothing": SCRIPT.replace("3}", "3})"),
    "not closed": SCRIPT.replace("3}", "3"),
    "anew": SCRIPT.replace("P(", "head("),
    "not defined": SCRIPT.replace("P(n))", "Q(n))"),
}


@pytest.mark.parametrize("told", WRONG)
def test_the_rules_of_scripts_are_asked(told: str) -> None:
    assert list(broken_rules(SCRIPT)) == []
    assert any(told in rule for rule in broken_rules(WRONG[told]))


def test_the_page_shows_what_is_printed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Each command of the page prints what it shows."""
    text = (MACHINES.parent / "docs/how-to/cspm.md").read_text(encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    (tmp_path / "machines").symlink_to(MACHINES)
    shown = re.findall(r"^```console\n\$ fsmkit (.*?)\n(.*?)^```", text, re.MULTILINE | re.DOTALL)
    assert len(shown) == 2
    for command, printed in shown:
        with redirect_stdout(StringIO()) as out:
            assert execute(command.split()) == 0
        assert out.getvalue() == printed
    assert "P_2_idle_1 =\n       ([] e : P_2_TOLD @ (e -> P_2_UNSEEN))" in text
    meaning = Meaning((tmp_path / "hasty.csp").read_text(encoding="utf-8"))
    assert "P_2_idle_1" in meaning.script.equations
