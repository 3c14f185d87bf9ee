from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path

import pytest

from fsmkit.cli import execute
from fsmkit.diagnostics import Findings, FsmkitError
from fsmkit.export.uppaal.network import Declared, Edge, Network, Sort
from fsmkit.export.uppaal.translate import translate
from fsmkit.export.uppaal.writing import write
from fsmkit.system.any_file import load_any
from fsmkit.system.system import System
from fsmkit.system.system_file import load_system
from fsmkit.verify.engines.python.oracle import Oracle
from fsmkit.verify.resources.deadline import Deadline
from fsmkit.verify.statespace.closed_system import close
from tests.export.agreement import CELL, disturbed
from tests.export.agreement import loaded as loaded_file
from tests.export.uppaal_cell import agreement
from tests.export.uppaal_compared import compared
from tests.export.uppaal_format import broken_rules
from tests.export.uppaal_meaning import Meaning
from tests.export.uppaal_reading import read
from tests.export.uppaal_rules import problems
from tests.verify.random_systems import random_system
from tests.verify.systems import SYSTEMS

MACHINES = Path(__file__).parents[2] / "machines"
SMALL = ["fischer/fischer", "fischer/hasty", "philosophers/table", "philosophers/ordered_table"]
DRAWN = [*SMALL, "production_cell/feeder", "production_cell/molder",
         "production_cell/pairs/feeder_belt-feeder"]  # fmt: skip
SAYABLE = sorted(set(SYSTEMS) - {"shared"})
"""One of the systems has a float."""
RANDOM = int(os.environ.get("FSMKIT_UPPAAL_SYSTEMS", "4"))
"""Random systems to compare; ``FSMKIT_UPPAAL_SYSTEMS=60`` takes some minutes."""
FORMS = pytest.mark.parametrize("paced", [False, True], ids=["urgent channel", "paced"])
TIMES = pytest.mark.parametrize("untimed", [False, True], ids=["discrete", "untimed"])


def loaded(folder: Path, files: dict[str, str]) -> System:
    for name, text in files.items():
        (folder / f"{name}.yaml").write_text(text)
    findings = Findings()
    return load_system(folder / f"{next(iter(files))}.yaml", findings)


def of_chart(folder: Path, text: str) -> Network:
    (folder / "chart.yaml").write_text(text)
    network = translate(close(load_any(folder / "chart.yaml", Findings())))
    assert list(problems(network)) == []
    return network


@FORMS
@TIMES
@pytest.mark.parametrize("name", SMALL)
def test_the_network_reaches_what_the_explorer_does(name: str, untimed: bool, paced: bool) -> None:
    closed = close(load_any(MACHINES / f"{name}.yaml", Findings()), untimed=untimed)
    states, evaluated = compared(closed, paced=paced)
    assert states > 10
    assert evaluated == 3


@pytest.mark.slow
@FORMS
def test_the_same_of_the_train_gate(paced: bool) -> None:
    closed = close(load_any(MACHINES / "train_gate/train_gate.yaml", Findings()), keeps_dead=True)
    states, evaluated = compared(closed, paced=paced)
    assert (states, evaluated) == (59, 3)


def without_urgent_channels(network: Network) -> Network:
    """Return a network as uppaal-to-tchecker reads it."""
    declared = (
        replace(one, sort=Sort.BROADCAST) if one.sort is Sort.URGENT_BROADCAST else one
        for one in network.declarations
        if isinstance(one, Declared)
    )
    return replace(network, declarations=tuple(declared))


@pytest.mark.parametrize("name", ["kitchen"])
def test_a_reader_that_drops_urgent_channels_reads_the_flat_form_right(
    tmp_path: Path, name: str
) -> None:
    closed = close(loaded(tmp_path, SYSTEMS[name]))

    def reached(*, paced: bool, dropped: bool) -> set[tuple[int, ...]]:
        network = translate(closed, flat=True, paced=paced, draw=False)
        read_ = without_urgent_channels(network) if dropped else network
        meaning = Meaning(read_, closed.unit)
        return {meaning.without_time(s) for s in meaning.reached(10**5)}

    right = reached(paced=False, dropped=False)
    assert reached(paced=True, dropped=True) == right
    assert reached(paced=False, dropped=True) > right


@pytest.mark.cc
@pytest.mark.parametrize(("name", "least"), [("feeder", 400), ("molder", 400), ("supervisor", 60)])
def test_the_same_number_of_states_of_charts_of_the_cell(name: str, least: int) -> None:
    found = agreement(loaded_file(CELL / f"{name}.yaml"))
    assert found.theirs == found.ours > least


@pytest.mark.slow
@pytest.mark.cc
@pytest.mark.parametrize("pair", ["extraction_belt-sorter", "molder-extractor"])
def test_the_same_of_pairs_that_nobody_disturbs(pair: str) -> None:
    """What a sensor has just told the sorter is no deadlock: it has still to act on it."""
    found = agreement(disturbed(loaded_file(CELL / f"pairs/{pair}.yaml"), ""))
    assert found.theirs == found.ours > 400
    assert found.evaluated >= 6
    assert not found.differing


@FORMS
@TIMES
@pytest.mark.parametrize("name", ["livelock", "deadlock", "ring", "kitchen", "losing", "drive"])
def test_the_same_of_the_systems_of_the_explorer(
    tmp_path: Path, name: str, untimed: bool, paced: bool
) -> None:
    states, _ = compared(close(loaded(tmp_path, SYSTEMS[name]), untimed=untimed), paced=paced)
    assert states > 0


@pytest.mark.slow
@FORMS
@TIMES
@pytest.mark.parametrize("seed", range(RANDOM))
def test_the_same_of_random_systems(tmp_path: Path, seed: int, untimed: bool, paced: bool) -> None:
    try:
        system = loaded(tmp_path, random_system(seed))
        closed = close(system, untimed=untimed, keeps_dead=True)  # a network resets nothing
    except FsmkitError:
        return  # a property names an element that no chart holds
    if Oracle(closed).run(livelock=False, deadline=Deadline(2)).end.value != "complete":
        return  # too large for a quick comparison
    compared(closed, paced=paced)


@pytest.mark.external
@pytest.mark.parametrize("flat", [False, True], ids=["readable", "flat"])
@pytest.mark.parametrize("name", DRAWN)
def test_what_is_written_reads_back(name: str, flat: bool) -> None:
    closed = close(load_any(MACHINES / f"{name}.yaml", Findings()))
    network = translate(closed, flat=flat, paced=flat)
    text = write(network)
    assert read(text) == network
    assert list(problems(network)) == []
    assert list(broken_rules(text)) == []
    if flat:
        assert "void" not in text
        assert "urgent broadcast" not in text
        assert "bool environment_waits" not in text


PLAIN = "chart: Lamp\ninitial: dark\nevents: {in: [go]}\nstates: {dark: {on: {go: lit}}, lit: {}}\n"


@pytest.mark.external
@pytest.mark.parametrize("form", ["uppaal", "uppaal-flat"])
@pytest.mark.parametrize("name", ["plain", "production_cell/supervisor", *SAYABLE])
def test_files_keep_the_rules_of_the_format(tmp_path: Path, name: str, form: str) -> None:
    file, out = MACHINES / f"{name}.yaml", tmp_path / "out.xml"
    if name in SYSTEMS:
        loaded(tmp_path, SYSTEMS[name])
        file = tmp_path / f"{next(iter(SYSTEMS[name]))}.yaml"
    elif name == "plain":
        file = tmp_path / "plain.yaml"
        file.write_text(PLAIN)
    assert execute(["export", str(file), "--to", form, "--out", str(out)]) == 0
    assert list(broken_rules(out.read_text())) == []
    assert list(problems(read(out.read_text()))) == []


BROKEN = {
    "No declaration for": ("<location ", "<place/><location "),
    "already defined": ('id="id1"', 'id="id0"'),
    "does not follow the DTD": ("</nta>", "<queries/></nta>"),
    "references an unknown": ('ref="id0"', 'ref="id77"'),
    "the first lines": ("DTD Flat System 1.6", "DTD"),
    "labels": ('kind="assignment"', 'kind="guard"'),
    "an empty": ("moves!", ""),
}


@pytest.mark.external
@pytest.mark.parametrize("told", BROKEN)
def test_the_rules_of_the_format_are_asked(tmp_path: Path, told: str) -> None:
    closed = close(loaded(tmp_path, SYSTEMS["livelock"]))
    text = write(translate(closed, flat=True, paced=True))
    old, new = BROKEN[told]
    assert list(broken_rules(text)) == []
    assert any(told in rule for rule in broken_rules(text.replace(old, new, 1)))


@pytest.mark.external
def test_the_verb_writes_a_file(tmp_path: Path) -> None:
    out = tmp_path / "fischer.xml"
    file = str(MACHINES / "fischer/fischer.yaml")
    assert execute(["export", file, "--to", "uppaal", "--out", str(out)]) == 0
    network = read(out.read_text())
    assert [t.instance for t in network.templates] == ["p_1", "p_2"]
    assert [q.formula for q in network.queries][1] == "E<> (p_2.critical && p_1.waits)"


@pytest.mark.external
def test_a_timer_is_a_clock_with_an_invariant(tmp_path: Path) -> None:
    (template,) = of_chart(
        tmp_path,
        "chart: Lamp\nevents: {in: [press]}\ninitial: dark\nstates:\n"
        "  dark: {on: {press: lit}}\n  lit: {after: {3s: dark}}\n",
    ).templates
    dark, lit = template.locations
    assert (dark.name, dark.invariant) == ("dark", ())
    assert (lit.name, lit.invariant) == ("lit", ("t <= 3000",))
    press, timeout = template.edges
    assert (press.comment, press.update) == ("press", ("t = 0",))
    assert (timeout.guard, timeout.target) == (("t >= 3000",), dark.id)


LOOPS = {
    "numbers": "for i in 0..2 { list[i] = list[i + 1] }\nlist[3] = n",
    "numbers downwards": "for i in 1..3 { list[4 - i] = list[3 - i] }\nlist[0] = n",
    "members": "for c in Color { if c != blue { n = (n + 1) % 4 } }",
    "an array": "for v in list { if v > 1 { n = v - 1 } }\nlist[n] = (list[n] + 1) % 4",
    "an array with places": "for v, i in list { if v == n and i != n { n = i } }\nlist[n] = 3",
    "loops in loops": "for i in 0..1 { for j in 2..3 { if list[i] < list[j] { list[i] += 1 } } }\n"
    "list[3] = n; n = (n + 1) % 4",
}


@pytest.mark.parametrize("name", LOOPS)
def test_loops_with_local_variables(tmp_path: Path, name: str) -> None:
    body = "".join(f"          {line}\n" for line in LOOPS[name].split("\n"))
    (tmp_path / "chart.yaml").write_text(
        "chart: Loops\ntypes: {Color: [red, green, blue]}\nevents: {in: [e, f]}\n"
        'data: {n: 0..3 = 1, list: "0..3[4] = 0"}\n'
        f"initial: s\nstates:\n  s:\n    on:\n      e:\n        do: |\n{body}"
        '      f: {do: "n = (n + 1) % 4; list[n] = n"}\n'
    )
    system = load_any(tmp_path / "chart.yaml", Findings())
    assert compared(close(system, keeps_dead=True))[0] > 2


def test_a_loop_that_assigns_its_variable_is_refused(tmp_path: Path) -> None:
    text = (
        'chart: C\nevents: {in: [e]}\ndata: {list: "0..3[4] = 0"}\ninitial: s\nstates:\n'
        '  s: {on: {e: {do: "for v in list { v = 0 }"}}}\n'
    )
    with pytest.raises(FsmkitError):
        of_chart(tmp_path, text)


HEADER = "chart: C\nevents: {in: [e]}\n"
REFUSED = {
    "floats": (HEADER + "data: {x: float64 = 0}\ninitial: s\nstates:\n"
               "  s: {on: {e: {do: 'x = x + 0.5'}}}\n", "float64"),
    "wide": (HEADER + "data: {x: 0..9999999999 = 0}\ninitial: s\nstates:\n"
             "  s: {on: {e: {do: 'x = 7'}}}\n", "32 bits"),
    "deferral": (HEADER + "initial: s\nstates:\n  s: {defer: [e], after: {1s: r}}\n"
                 "  r: {on: {e: s}}\n", "defers"),
    "overflowing": (HEADER + "data: {x: int32 = 0}\ninitial: s\nstates:\n"
                    "  s: {on: {e: {do: 'x = x * 3'}}}\n", "32 bits"),
}  # fmt: skip


@pytest.mark.parametrize("name", REFUSED)
def test_what_cannot_be_said_is_refused_with_a_place(tmp_path: Path, name: str) -> None:
    text, why = REFUSED[name]
    with pytest.raises(FsmkitError, match=why) as caught:
        of_chart(tmp_path, text)
    (diagnostic,) = caught.value.diagnostics
    assert diagnostic.rule.name == "not-in-uppaal"
    assert diagnostic.primary is not None
    assert diagnostic.help


def sound() -> Network:
    return translate(close(load_any(MACHINES / "fischer/fischer.yaml", Findings())))


def with_edge(network: Network, **changes: object) -> Network:
    template = network.templates[0]
    edge: Edge = replace(template.edges[0], **changes)  # type: ignore[arg-type]
    changed = replace(template, edges=(edge, *template.edges[1:]))
    return replace(network, templates=(changed, *network.templates[1:]))


@pytest.mark.external
def test_the_rules_of_uppaal_are_checked() -> None:
    network = sound()
    clock = next(d.name for d in network.templates[0].declarations if isinstance(d, Declared)
                 and d.sort is Sort.CLOCK)  # fmt: skip
    broken = {
        "beside an urgent channel": with_edge(network, guard=(f"{clock} >= 1",), sync="hurry!"),
        "inside something else": with_edge(network, guard=(f"({clock} >= 1 || stable)",)),
        "is not declared": with_edge(network, update=("nobody = 1",)),
        "has no end": with_edge(network, target="id99"),
        "no whole number": with_edge(network, update=(f"{clock} = turn",)),
        "is no channel": with_edge(network, sync="now!"),
        "stores something": with_edge(network, guard=("turn = 1",)),
        "is no name": replace(network, declarations=(
            *network.declarations, Declared("state", Sort.BOOL, init=(0,)))),
        "declared twice": replace(network, declarations=(
            *network.declarations, Declared("turn", Sort.INT, 0, 1, init=(0,)))),
        "outside 0..3": replace(network, declarations=(
            *network.declarations, Declared("many", Sort.INT, 0, 3, init=(9,)))),
        "beyond 32 bits": replace(network, declarations=(
            *network.declarations, Declared("many", Sort.INT, 0, 2**40, init=(9,)))),
    }  # fmt: skip
    for told, one in broken.items():
        assert any(told in problem for problem in problems(one)), told


def test_a_file_that_is_none_is_told() -> None:
    with pytest.raises(ValueError, match="no XML"):
        read("<nta>")
