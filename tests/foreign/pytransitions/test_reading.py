"""What is read from machines of the library, and what is said of them."""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator
from contextlib import redirect_stderr, redirect_stdout
from enum import Enum
from functools import partial
from io import StringIO
from pathlib import Path
from typing import Any

import pytest
from transitions import Machine, State
from transitions.extensions import HierarchicalMachine
from transitions.extensions.nesting import NestedState
from transitions.extensions.states import Timeout, add_state_features

import fsmkit
from fsmkit.chart.chart import Chart
from fsmkit.cli import execute as run_command
from fsmkit.diagnostics import Findings, FsmkitError, Severity
from fsmkit.document.document import Kind, Trigger
from fsmkit.foreign.pytransitions import chart_of
from tests.foreign.pytransitions.machines import behaviour

PLAIN: dict[str, Any] = {
    "queued": True,
    "ignore_invalid_triggers": True,
    "auto_transitions": False,
    "initial": "a",
}


def found_in(configuration: dict[str, Any]) -> list[tuple[str, str, str]]:
    """Return rule, message, and the text that each finding points at."""
    findings = Findings()
    try:
        chart_of(configuration, findings=findings)
    except FsmkitError:
        assert findings.has_errors
    found = []
    for one in findings:
        span = None if one.primary is None else one.primary.span
        text = "" if span is None else span.source.text[span.start : span.end]
        assert one.help or one.severity is not Severity.ERROR, one
        found.append((one.rule.name, one.message, text))
    return found


def step(trigger: str, source: Any, dest: Any, **more: Any) -> dict[str, Any]:
    return {"trigger": trigger, "source": source, "dest": dest, **more}


REGIONS = {
    "name": "p",
    "parallel": [
        {"name": "l", "initial": "1", "children": ["1", "2"]},
        {"name": "r", "initial": "1", "children": ["1", "2"]},
    ],
}
WRONG: dict[str, tuple[dict[str, Any], str, str]] = {
    "no states": ({"transitions": []}, "missing-key", "{"),
    "an unknown state": (
        {"states": ["a"], "transitions": [["go", "a", "bb"]]},
        "unknown-name",
        '"bb"',
    ),
    "an unknown source": (
        {"states": ["a"], "transitions": [["go", "x", "a"]]},
        "unknown-name",
        '"x"',
    ),
    "no destination": (
        {"states": ["a"], "transitions": [{"trigger": "go", "source": "a"}]},
        "missing-key",
        '{"trigger": "go", "source": "a"}',
    ),
    "a state twice": ({"states": ["a", "b", "a"]}, "duplicate-state", '"a"'),
    "a state without a name": ({"states": ["a", {"on_enter": "x"}]}, "missing-key", ""),
    "an unknown initial child": (
        {"states": ["a", {"name": "b", "initial": "z", "children": ["1"]}]},
        "unknown-name",
        '"z"',
    ),
    "no initial state": ({"states": ["a"], "initial": None}, "beyond-statecharts", "null"),
    "ordered transitions of one state": (
        {"states": ["a"], "ordered_transitions": True},
        "beyond-statecharts",
        "true",
    ),
    "a flag that is none": ({"states": ["a"], "queued": "perhaps"}, "unexpected-value", ""),
    "a timeout that is none": (
        {"states": ["a", {"name": "b", "timeout": "soon"}]},
        "unexpected-value",
        '"soon"',
    ),
    "an unknown key": ({"states": ["a"], "transition": []}, "unknown-key", '"transition"'),
    "one region from outside": (
        {"states": ["a", REGIONS], "transitions": [["go", "a", "p_l_2"]]},
        "beyond-statecharts",
        '["go", "a", "p_l_2"]',
    ),
    "a region again": (
        {"states": ["a", REGIONS], "transitions": [["go", "p_l", "="]]},
        "beyond-statecharts",
        '["go", "p_l", "="]',
    ),
    "from one region to another": (
        {"states": ["a", REGIONS], "transitions": [["go", "p_l_1", "p_r_2"]]},
        "beyond-statecharts",
        '["go", "p_l_1", "p_r_2"]',
    ),
    "a region left beside another": (
        {"states": ["a", REGIONS], "transitions": [["go", "p_l_1", "a"], ["go", "p_r_1", "p_r_2"]]},
        "beyond-statecharts",
        '["go", "p_l_1", "a"]',
    ),
    "one of two steps": (
        {"states": ["a", REGIONS], "transitions": [["go", "p", None], ["go", "p_r_1", "p_r_2"]]},
        "beyond-statecharts",
        '["go", "p", null]',
    ),
    "a grandchild": (
        {
            "states": ["a", {"name": "b", "children": [{"name": "1", "children": ["x", "y"]}]}],
            "transitions": [["go", "b", "b_1_x"]],
        },
        "beyond-statecharts",
        '["go", "b", "b_1_x"]',
    ),
    "some of the regions": (
        {"states": ["a", {"name": "b", "initial": ["1", "2"], "children": ["1", "2", "3"]}]},
        "beyond-statecharts",
        '"b"',
    ),
    "several initial states": (
        {"states": ["a", "b"], "initial": ["a", "b"]},
        "beyond-statecharts",
        "",
    ),
    "one initial region": (
        {"states": ["a", REGIONS], "initial": "p_l_1"},
        "beyond-statecharts",
        "",
    ),
    "twice in the description of a parallel state": (
        {
            "states": [
                "a",
                {**REGIONS, "transitions": [["go", "l_1", "l_2"], ["go", "l_2", "l_1"]]},
            ]
        },
        "beyond-statecharts",
        '["go", "l_1", "l_2"]',
    ),
    "an outer state first": (
        {
            "states": [
                "a",
                {
                    "name": "b",
                    "children": [{"name": "1", "children": ["x", "y"]}, "2"],
                    "transitions": [["go", "1", "2"]],
                },
            ],
            "transitions": [["go", "b_1_x", "b_1_y"]],
        },
        "beyond-statecharts",
        '["go", "1", "2"]',
    ),
    "prepared conditions": (
        {
            "states": ["a", "b"],
            "transitions": [step("go", "a", "b", prepare="measure", conditions="ok")],
        },
        "callback-left-out",
        '"measure"',
    ),
    "finalized events": (
        {"states": ["a"], "finalize_event": ["tidy"]},
        "callback-left-out",
        '"tidy"',
    ),
    "callbacks before unknown exits": (
        {
            "states": [
                "a",
                {
                    "name": "b",
                    "children": [{"name": "1", "on_exit": "x"}, {"name": "2", "on_exit": "y"}],
                },
            ],
            "transitions": [step("go", "b", "a", before="tell")],
        },
        "callback-order",
        '{"trigger": "go", "source": "b", "dest": "a", "before": "tell"}',
    ),
    "both regions tell": (
        {
            "states": ["a", REGIONS],
            "transitions": [
                step("go", "p_l_1", "p_l_2", before="x"),
                step("go", "p_r_1", "p_r_2", before="y"),
            ],
        },
        "callback-order",
        '{"trigger": "go", "source": "p_l_1", "dest": "p_l_2", "before": "x"}',
    ),
    "settings": (
        {"states": ["a"], "queued": False, "auto_transitions": True},
        "machine-setting",
        "",
    ),
}


@pytest.mark.parametrize("name", WRONG)
def test_is_said_with_its_place(name: str) -> None:
    configuration, rule, place = WRONG[name]
    found = found_in({**PLAIN, **configuration})
    fitting = [one for one in found if one[0] == rule]
    assert fitting, found
    assert not place or any(place.strip('"') in one[2] for one in fitting), fitting


def test_a_plain_machine_has_no_findings() -> None:
    configuration = {
        **PLAIN,
        "states": ["a", "b"],
        "transitions": [["go", "a", "b"], ["back", "b", "a"]],
    }
    assert found_in(configuration) == []


# --- what is read -----------------------------------------------------------------------------


def steps(chart: Chart, state: str) -> list[tuple[str, str]]:
    found = []
    for index in chart.states[chart.state_index[state]].transitions:
        transition = chart.transitions[index]
        targets = [chart.states[target].id for target in transition.targets]
        found.append((",".join(transition.descriptors), " ".join(targets)))
    return found


class Matter:
    is_hot = True

    @property
    def mass(self) -> int:
        raise AssertionError("a property is not to be asked")

    def boil(self) -> None: ...

    def on_enter_gas(self) -> None: ...

    def ready(self) -> bool:
        return True


class Phase(Enum):
    solid = 1
    gas = 2


def test_conditions_are_operations_or_inputs() -> None:
    machine = Machine(
        Matter(),
        states=["solid", "gas"],
        initial="solid",
        transitions=[
            step(
                "boil_off",
                "solid",
                "gas",
                conditions=["is_hot", "ready"],
                unless="mass",
                after="boil",
            )
        ],
    )
    chart = chart_of(machine)
    assert [(one.name, str(one.type)) for one in chart.inputs] == [
        ("is_hot", "bool"),
        ("mass", "bool"),
    ]
    results = {one.name: one.result for one in chart.operations}
    assert results["boil"] is None
    assert str(results["ready"]) == "bool"
    assert "on_enter_gas" in results  # the library finds that method by its name


def test_functions_are_told_apart() -> None:
    def one() -> None: ...

    entered: list[Any] = [lambda: None, lambda: None, partial(print, "x")]
    described: list[Any] = ["a", State("b", on_enter=entered)]
    calls: list[Any] = [one, one, "one"]
    machine = Machine(
        states=described,
        initial="a",
        transitions=[step("go", "a", "b", before=calls)],
    )
    names = [operation.name for operation in chart_of(machine).operations]
    assert sorted(names) == ["lambda", "lambda_2", "one", "one_2", "print"]


def test_enumerations_are_names() -> None:
    freezing: list[Any] = ["freeze", Phase.gas, Phase.solid]
    machine = Machine(states=Phase, initial=Phase.gas, transitions=[freezing])
    chart = chart_of(machine)
    assert [state.id for state in chart.states[1:]] == ["solid", "gas"]
    assert steps(chart, "gas") == [("freeze", "solid")]


def test_automatic_triggers_are_left_out_unless_something_is_called() -> None:
    machine = Machine(states=["a", "b"], initial="a")
    assert not chart_of(machine).transitions[1:]
    machine.before_to_b("tell")
    assert steps(chart_of(machine), "a") == [("to_b", "b")]


def test_a_state_without_an_initial_child_can_be_active_alone() -> None:
    machine = HierarchicalMachine(
        states=["a", {"name": "b", "children": ["1", "2"]}],
        initial="a",
        transitions=[["go", "a", "b"], ["on", "b", "b_1"], ["on", "b_1", "b_2"]],
    )
    chart = chart_of(machine)
    assert [state.id for state in chart.states[1:]] == ["a", "b", "b_alone", "b_1", "b_2"]
    assert steps(chart, "b") == [("on", "b_1")]
    assert chart.transitions[chart.states[2].transitions[0]].internal
    machine.add_transition("first", "a", "b_2")
    machine.remove_transition("go")
    assert "b_alone" not in chart_of(machine).state_index


def test_a_custom_separator() -> None:
    class Nested(NestedState):
        separator = "/"

    class Own(HierarchicalMachine):
        state_cls = Nested

    machine = Own(
        states=["a_b", {"name": "c", "initial": "1", "children": ["1"]}],
        initial="a_b",
        transitions=[["go", "a_b", "c/1"]],
    )
    assert [state.id for state in chart_of(machine).states[1:]] == ["a_b", "c", "c_1"]


def test_timeouts_are_timers() -> None:
    @add_state_features(Timeout)
    class Timed(Machine):
        pass

    machine = Timed(states=["a", {"name": "b", "timeout": 1.5, "on_timeout": "late"}], initial="a")
    chart = chart_of(machine)
    (timer,) = (t for t in chart.transitions if t.trigger is Trigger.AFTER)
    assert timer.delay == 1500
    assert [operation.name for operation in chart.operations] == ["late"]


def test_final_states_end_where_nothing_leads_out() -> None:
    machine = Machine(
        states=["a", State("b", final=True), State("c", final=True)],
        initial="a",
        transitions=[["go", "a", "b"], ["end", "a", "c"], ["again", "c", "a"]],
    )
    chart = chart_of(machine)
    b, c = (chart.states[chart.state_index[name]] for name in "bc")
    assert (b.kind, b.rest) == (Kind.FINAL, False)
    assert (c.kind, c.rest) == (Kind.ATOMIC, True)


def test_names_that_a_chart_cannot_have() -> None:
    machine = Machine(
        states=["Really Hot", "if"],
        initial="Really Hot",
        transitions=[step("cool.down", "Really Hot", "if", before=["log", "pkg.mod.call"])],
    )
    chart = chart_of(machine)
    assert [state.id for state in chart.states[1:]] == ["Really_Hot", "if"]
    assert chart.events[0].name == "cool_down"
    assert [operation.name for operation in chart.operations] == ["log_", "pkg_mod_call"]


def test_an_object_that_is_no_machine() -> None:
    with pytest.raises(FsmkitError) as caught:
        chart_of(Matter(), "matter")
    assert caught.value.diagnostics[0].rule.name == "no-machine"


# --- from files and modules -------------------------------------------------------------------

MODULE = """\
from transitions import Machine

machine = Machine(states=["a", "b"], initial="a", transitions=[["go", "a", "b"], ["go", "b", "a"]])
configuration = {"states": ["a", "b"], "initial": "a", "transitions": [["go", "a", "b"]]}
number = 7
"""


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    monkeypatch.chdir(tmp_path)
    before = set(sys.modules)
    (tmp_path / "door_of_tests.py").write_text(MODULE)
    yield tmp_path
    for name in set(sys.modules) - before:
        if name.endswith("_of_tests"):
            del sys.modules[name]


def run(*arguments: str) -> tuple[int, str]:
    output = StringIO()
    with redirect_stdout(output), redirect_stderr(output):
        code = run_command(list(arguments))
    assert "Traceback" not in output.getvalue()
    return code, output.getvalue()


@pytest.mark.cc
@pytest.mark.parametrize("reference", ["door_of_tests:machine", "door_of_tests.py:machine"])
def test_every_verb_takes_a_reference(here: Path, reference: str) -> None:
    code, output = run("show", reference)
    assert code == 0
    assert "on go -> b" in output
    assert run("check", reference)[0] == 0
    assert run("compile", reference, "--target", "python")[0] == 0
    assert run("compile", reference, "--target", "transitions")[0] == 0
    assert run("convert", reference, "--to", "yaml", "--out", "door.yaml")[0] == 0
    assert behaviour(fsmkit.read_chart("door.yaml")) == behaviour(fsmkit.read_chart(reference))
    assert here.joinpath("generated").is_dir()


def test_a_dictionary_can_be_named(here: Path) -> None:
    assert steps(fsmkit.read_chart("door_of_tests:configuration"), "a") == [("go", "b")]
    assert here.exists()


@pytest.mark.parametrize(
    ("reference", "message"),
    [
        ("door_of_tests:none", "`door_of_tests` has no `none`"),
        ("door_of_tests:number", "is a int, no machine"),
        ("nowhere_of_tests:machine", "No module named"),
        ("nowhere.py:machine", "cannot import"),
        ("broken_of_tests:machine", "ZeroDivisionError: division by zero, in "),
        ("leaving_of_tests:machine", "SystemExit: 3"),
        ("syntax_of_tests.py:machine", "SyntaxError"),
    ],
)
def test_what_goes_wrong_in_a_module_is_a_finding(here: Path, reference: str, message: str) -> None:
    (here / "broken_of_tests.py").write_text("x = 1\ny = x / 0\n")
    (here / "leaving_of_tests.py").write_text("import sys\nsys.exit(3)\n")
    (here / "syntax_of_tests.py").write_text("def (:\n")
    code, output = run("show", reference)
    assert code == 1
    assert message in " ".join(output.split())
    assert "no-machine" in output


@pytest.mark.parametrize(
    "text",
    [
        "chart: Derived\nextends: trap_of_tests.py:machine\nstates: {s: {}}\n",
        "chart: Derived\nextends: trap_of_tests:machine\nstates: {s: {}}\n",
        "system: S\nmachines: {m: 'trap_of_tests:machine'}\n",
    ],
)
def test_what_a_file_names_is_never_imported(here: Path, text: str) -> None:
    (here / "trap_of_tests.py").write_text("open('trapped', 'w').close()\nmachine = {}\n")
    (here / "derived.yaml").write_text(text)
    assert run("check", "derived.yaml")[0] == 1
    assert not (here / "trapped").exists()


def test_json_and_yaml_configurations(tmp_path: Path) -> None:
    configuration = {
        **PLAIN,
        "states": ["a", "b"],
        "transitions": [["go", "a", "b"], ["go", "b", "a"]],
    }
    (tmp_path / "door.json").write_text(json.dumps(configuration, indent=2))
    (tmp_path / "door.transitions.yaml").write_text(
        "states: [a, b]\ninitial: a\nqueued: true\nignore_invalid_triggers: true\n"
        "auto_transitions: false\n"
        "transitions:\n- {trigger: go, source: a, dest: b}\n- [go, b, a]\n"
    )
    first, second = (
        fsmkit.read_chart(tmp_path / name) for name in ("door.json", "door.transitions.yaml")
    )
    assert behaviour(first) == behaviour(second)
    assert first.name == "Door"


@pytest.mark.parametrize("text", ["", "[]", "3", "{", '{"states": 3}', '{"states": [[]]}', "[1, 2"])
def test_what_is_no_configuration(tmp_path: Path, text: str) -> None:
    path = tmp_path / "door.json"
    path.write_text(text)
    code, output = run("show", str(path))
    assert code == 1
    assert "error[" in output


def test_targets_name_what_is_read() -> None:
    code, output = run("targets")
    assert code == 0
    assert ".transitions.yaml" in output
