"""Nodes that freeze: their machines stop, others notice it; the same in both engines."""

from __future__ import annotations

import pytest

from fsmkit.diagnostics import Findings, FsmkitError, Severity
from fsmkit.export.exporter import Exporter, ExportOptions
from fsmkit.plugins import plugin
from fsmkit.system.system import state_properties
from fsmkit.verify.engines.c.engine import compiler
from fsmkit.verify.explore import ExplorationOptions, check
from fsmkit.verify.report.verdict import Report
from fsmkit.verify.resources.time import Time
from tests.verify.conftest import Load
from tests.verify.engines.test_engines import both
from tests.verify.random_systems import load_files, random_freezing

ENGINES = ["python", *(["c"] if compiler() is not None else [])]

MANNERS = [False, True]
MANNER_NAMES = ["discrete", "untimed"]

pytestmark = [pytest.mark.cc, pytest.mark.usefixtures("own_cache", "quickly_compiled")]


PRESS = """
chart: Press
capacity: {queue: 4}
events: {in: [close], out: [closed]}
initial: open
states:
  open: {rest: true, on: {close: closing}}
  closing: {after: {20ms: {target: open, do: send closed}}}
"""

ROBOT = """
chart: Robot
capacity: {queue: 4}
events: {in: [start, closed, press_lost], out: [close]}
outputs: {motor: bool = false}
initial: idle
states:
  idle:
    rest: true
    on:
      start: {target: waits, do: "motor = true; send close"}
      REACTION
  waits:
    rest: true
    on:
      closed: {target: idle, do: motor = false}
      REACTION
    after: {40ms: late}
  late:
    rest: true
    on:
      closed: {target: recovered, do: motor = false}
      REACTION
  recovered: {rest: true}
"""
REACTION = "press_lost: {target: stopped, do: motor = false}"

CELL = """
system: Cell
machines: {press: press.yaml, robot: robot.yaml}
SCHEDULE
connect: [robot.close -> press.close, press.closed -> robot.closed]
environment:
  may: [robot.start]
  freezes:
    node: {machines: [press], silent: [robot.press_lost], within: 10ms..30ms CONTINUES}
properties:
  stops: {within: [node.In(frozen), 30ms, not robot.motor or node.In(running)]}
  later: {within: [node.In(stopped), 60ms, not robot.motor]}
  meets_late: {reachable: robot.In(recovered)}
  freezes_in_work: {reachable: "node.In(frozen) and press.In(closing)"}
"""


def cell(
    *, reacts: bool, continues: str = ", continues: 50ms", schedule: str = ""
) -> dict[str, str]:
    robot = ROBOT.replace("REACTION", REACTION if reacts else "")
    robot += "  stopped: {rest: true}\n" if reacts else ""
    system = CELL.replace("CONTINUES", continues).replace("SCHEDULE", schedule)
    return {"cell": system, "press": PRESS, "robot": robot}


def checked(load: Load, engine: str, files: dict[str, str], *, untimed: bool = False) -> Report:
    """Return a report of which each path was performed again by all that can."""
    time: Time = "untimed" if untimed else "discrete"
    report = check(
        load(**files), Findings(), options=ExplorationOptions(engine, time=time, timeout=60)
    )
    for result in report.results:
        if result.trace is not None:
            again = ("interpreter", "generated C") if engine == "c" else ("interpreter",)
            assert result.trace.replayed == again, result.trace.differs
    return report


def verdicts(report: Report) -> dict[str, str]:
    return {result.name: result.verdict.value for result in report.results}


@pytest.mark.parametrize("engine", ENGINES)
def test_a_receiver_that_ignores_silence_is_found(load: Load, engine: str) -> None:
    report = checked(load, engine, cell(reacts=False))
    found = verdicts(report)
    assert (found["stops"], found["later"]) == ("violated", "violated")
    assert found["freezes_in_work"] == "holds"
    (late,) = [result for result in report.results if result.name == "later"]
    assert late.trace is not None
    causes = [(step.machine, step.cause) for step in late.trace.steps]
    assert ("node", "freezes") in causes
    assert ("node", "is found silent") in causes
    assert ("node", "stays frozen") in causes
    told = "the node node (press) may freeze at any time, and continues within 50ms or never"
    assert told in report.assumptions


@pytest.mark.parametrize("engine", ENGINES)
def test_a_receiver_that_reacts_holds(load: Load, engine: str) -> None:
    found = verdicts(checked(load, engine, cell(reacts=True)))
    assert (found["stops"], found["later"], found["deadlock"]) == ("holds", "holds", "holds")


@pytest.mark.parametrize("engine", ENGINES)
def test_a_node_continues_late_with_its_old_inputs(load: Load, engine: str) -> None:
    late = verdicts(checked(load, engine, cell(reacts=False)))
    never = verdicts(checked(load, engine, cell(reacts=False, continues="")))
    at_once = verdicts(checked(load, engine, cell(reacts=False, continues=", continues: 10ms")))
    assert late["meets_late"] == "holds"
    assert never["meets_late"] == "violated"
    assert at_once["meets_late"] == "holds"  # it freezes more than once


@pytest.mark.parametrize("untimed", MANNERS, ids=MANNER_NAMES)
@pytest.mark.parametrize("schedule", ["", "schedule: {cyclic: [press, robot], period: 10ms}"])
def test_engines_agree_on_the_cell(load: Load, schedule: str, untimed: bool) -> None:
    for continues in ("", ", continues: 20ms"):
        files = cell(reacts=True, continues=continues, schedule=schedule)
        both(load(**files), untimed=untimed)


SENDER = """
chart: Sender
events: {in: [lost], out: [beat]}
initial: beats
states:
  beats: {rest: true, every: {10ms: {do: send beat}}, on: {lost: quiet}}
  quiet: {rest: true}
"""
HEARER = """
chart: Hearer
capacity: {queue: 3}
events: {in: [beat], out: [answer]}
initial: open
states:
  open: {rest: true, on: {beat: {do: send answer}}}
"""
BEATS = """
system: Beats
machines: {sender: sender.yaml, hearer: hearer.yaml}
connect: [sender.beat -> hearer.beat]
environment:
  freezes: {node: {machines: [NODE] SILENT CONTINUES}}
properties:
  freezes: {leads_to: [node.In(running), node.In(frozen)]}
  resumes: {leads_to: [node.In(frozen), node.In(running)]}
  gone: {reachable: node.In(stopped)}
"""


def beats(node: str, silent: str = "", continues: str = "") -> dict[str, str]:
    system = BEATS.replace("NODE", node).replace("SILENT", silent).replace("CONTINUES", continues)
    return {"beats": system, "sender": SENDER, "hearer": HEARER}


@pytest.mark.parametrize("engine", ENGINES)
def test_the_queue_of_a_node_fills_until_it_stops_for_good(load: Load, engine: str) -> None:
    def overflows(continues: str) -> bool:
        found = verdicts(checked(load, engine, beats("hearer", "", continues)))
        return found.get("hearer.overflow") == "violated"

    assert overflows(", continues: 50ms")
    assert not overflows(", continues: 20ms")
    assert not overflows("")


@pytest.mark.parametrize("engine", ENGINES)
def test_late_timers_fire_in_a_burst(load: Load, engine: str) -> None:
    for continues, overflows in (("50ms", True), ("20ms", False)):
        found = verdicts(checked(load, engine, beats("sender", "", f", continues: {continues}")))
        assert (found.get("hearer.overflow") == "violated") is overflows


@pytest.mark.parametrize("engine", ENGINES)
def test_nothing_says_that_a_node_freezes_or_continues_some_time(load: Load, engine: str) -> None:
    found = verdicts(checked(load, engine, beats("sender", "", ", continues: 20ms")))
    assert (found["freezes"], found["resumes"]) == ("violated", "violated")


WAITS = """
chart: Waits
events: {in: [answer], out: [ask]}
initial: asks
states:
  asks: {after: {10ms: {target: waits, do: send ask}}}
  waits: {REST on: {answer: asks}}
"""
ANSWERS = """
chart: Answers
events: {in: [ask], out: [answer]}
initial: open
states:
  open: {on: {ask: {do: send answer}}}
"""
ASKED = """
system: Asked
machines: {waits: waits.yaml, answers: answers.yaml}
connect: [waits.ask -> answers.ask, answers.answer -> waits.answer]
environment: {freezes: {node: {machines: [answers]}}}
properties: {gone: {reachable: node.In(stopped)}}
"""


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("untimed", MANNERS, ids=MANNER_NAMES)
def test_who_waits_for_a_stopped_node_is_a_deadlock(load: Load, engine: str, untimed: bool) -> None:
    for rest, expected in (("", "violated"), ("rest: true, ", "holds")):
        files = {"asked": ASKED, "waits": WAITS.replace("REST", rest), "answers": ANSWERS}
        assert verdicts(checked(load, engine, files, untimed=untimed))["deadlock"] == expected


WATCHER = """
chart: Watcher
events: {in: [freezes, beat]}
initial: quiet
states:
  quiet: {on: {freezes: frozen}}
  frozen: {on: {beat: error}}
  error: {rest: true}
"""


@pytest.mark.parametrize("engine", ENGINES)
def test_a_monitor_watches_a_node(load: Load, engine: str) -> None:
    def found(continues: str) -> str:
        files = beats("sender", "", continues)
        files["beats"] += (
            "  mute: {monitor: watcher.yaml, watch: "
            "[occurs(node.freezes) -> freezes, sender.beat -> beat]}\n"
        )
        return verdicts(checked(load, engine, {**files, "watcher": WATCHER}))["mute"]

    assert found("") == "holds"
    assert found(", continues: 20ms") == "violated"


@pytest.mark.slow
@pytest.mark.parametrize("seed", [3, 6, 8, 22])
def test_engines_agree_on_random_nodes(seed: int) -> None:
    for untimed in MANNERS:
        both(load_files(random_freezing(seed)), untimed=untimed)


def many(count: int) -> dict[str, str]:
    """Return a system in which some machines freeze together, and each is found silent."""
    lines = ["system: Many", "machines:", f'  "a[i in 0..{count - 1}]": sender.yaml']
    lines += ["  b: hearer.yaml", f'  "c[i in 0..{count - 1}]": sender.yaml']
    lines += ["environment:", "  freezes:"]
    lines += ['    node: {machines: ["a[i]"], silent: ["c[i].lost"], within: 10ms}']
    lines += ["properties: {gone: {reachable: node.In(stopped)}}"]
    return {"many": "\n".join(lines) + "\n", "sender": SENDER, "hearer": HEARER}


@pytest.mark.parametrize("count", [1, 2, 20])
def test_a_node_has_many_machines(load: Load, count: int) -> None:
    report = check(
        load(**many(count)),
        Findings(),
        options=ExplorationOptions(time="untimed", timeout=60),
        properties=frozenset({"gone"}),
    )
    assert verdicts(report)["gone"] == "holds"


# --- what is not explored, and other outputs ------------------------------------------------------


def test_dense_time_becomes_discrete_with_a_note(load: Load) -> None:
    findings = Findings()
    check(load(**cell(reacts=True)), findings)
    (note,) = [found for found in findings if found.rule.name == "discrete-time"]
    assert "the node `node` may freeze" in note.message


@pytest.mark.parametrize("notation", ["cspm", "jani", "promela", "uppaal", "uppaal-flat"])
def test_exports_that_cannot_say_it_name_the_key(load: Load, notation: str) -> None:
    options = ExportOptions(untimed=True)
    with pytest.raises(FsmkitError) as raised:
        plugin(Exporter, notation).export(load(**cell(reacts=True)), options)
    assert "`freezes` is not" in str(raised.value)
    assert "node: {machines" in str(raised.value)


def test_labelled_transition_systems_contain_it(load: Load) -> None:
    found = plugin(Exporter, "aut").export(load(**cell(reacts=True)), ExportOptions(untimed=True))
    for cause in ("freezes", "continues", "stays frozen", "is found silent", "may freeze again"):
        assert f'"node: {cause}"' in found.text, cause


def test_a_session_judges_no_property_of_a_node(load: Load) -> None:
    system = load(**cell(reacts=True))
    assert [each.name for each in state_properties(system)] == ["meets_late"]


# --- reading --------------------------------------------------------------------------------------


WRONG = {
    "press: {machines: [press]}": ("duplicate-name", "there is a machine `press`"),
    "node: {machines: []}": ("missing-key", "needs `machines`"),
    "node: {silent: [robot.press_lost], within: 10ms}": ("missing-key", "needs `machines`"),
    "node: {machines: [press], silent: [robot.press_lost]}": ("missing-key", "needs `within`"),
    "node: {machines: [pres]}": ("unknown-name", "there is no machine `pres`"),
    "node: {machines: [press, press]}": ("duplicate-connection", "frozen already"),
    "a: {machines: [press]}, b: {machines: [press]}": ("duplicate-connection", "frozen already"),
    "node: {machines: [press], silent: [robot], within: 1ms}": ("broken-connection", "an event is"),
    "node: {machines: [press], silent: [robot.lost], within: 1ms}": ("unknown-name", "`lost`"),
    "node: {machines: [press], silent: [robot.close], within: 1ms}": ("unknown-name", "`close`"),
    "node: {machines: [press], silent: [press.close], within: 1ms}": (
        "connection-mismatch",
        "frozen itself",
    ),
    "node: {machines: [press], continues: 0ms}": ("bad-delay", "must be positive"),
    "node: {machines: [press], continues: 1ms..2ms}": ("expression-syntax", ""),
    "node: {machines: [press], silent: [robot.press_lost], within: 20ms..10ms}": (
        "bad-delay",
        "its minimum must not exceed",
    ),
    "node: {machines: [press], within: 10ms}": ("missing-key", "needs `silent`"),
    "node: {machines: [press], silent: [robot.press_lost], within: soon}": ("", ""),
    "no name: {machines: [press]}": ("unexpected-shape", "not a valid node name"),
    "node: {machines: [press], silence: [robot.press_lost]}": ("unknown-key", "silence"),
    "node: press": ("unexpected-shape", ""),
}


@pytest.mark.parametrize("text", WRONG)
def test_wrong_nodes_are_reported_at_their_place(load: Load, text: str) -> None:
    files = cell(reacts=True)
    start = files["cell"].index("    node: {machines")
    end = files["cell"].index("\n", start)
    files["cell"] = files["cell"][:start] + "    {" + text + "}" + files["cell"][end:]
    if not text.startswith("node: {"):  # else properties name the node in spite of the error
        files["cell"] = files["cell"].partition("properties:")[0]
    with pytest.raises(FsmkitError) as raised:
        load(**files)
    rule, words = WRONG[text]
    errors = [found for found in raised.value.diagnostics if found.severity is Severity.ERROR]
    assert any(rule in found.rule.name and words in found.message for found in errors), errors
    assert all(found.primary is not None for found in errors)
    assert not any("`node`" in found.message and "no machine" in found.message for found in errors)


def test_intervals_of_a_frozen_machine_are_rejected(load: Load) -> None:
    files = cell(reacts=True)
    files["cell"] = files["cell"].replace("may: [", "will: [press]\n  may: [")
    load(**files)
    files["press"] = PRESS.replace("20ms", "10ms..20ms")
    with pytest.raises(FsmkitError, match="may freeze, and a delay of it is an interval"):
        load(**files)


def test_data_that_are_shared_with_the_node_are_rejected(load: Load) -> None:
    shared = (
        "chart: A\ndata: {n: 0..2 = 0}\ninitial: s\nstates: {s: {always: {if: n > 0, do: n = 0}}}\n"
    )
    text = "system: S\nmachines: {a: a.yaml, b: a.yaml}\nshared: {n: 0..2 = 0}\n"
    node = "environment: {freezes: {node: {machines: [%s]}}}\n"
    with pytest.raises(FsmkitError, match="shares `n`"):
        load(s=text + node % "a", a=shared)
    load(s=text + node % "a, b", a=shared)
