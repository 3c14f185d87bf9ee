"""What an editor asks for and is shown: a chart alone."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import fsmkit
from fsmkit.inspector import charts
from fsmkit.inspector.dap.adapter import LIVE, OF_ADAPTER, OF_INSPECTION, OF_SESSION
from fsmkit.inspector.hub import Hub
from fsmkit.inspector.simulation import Simulation
from fsmkit.inspector.sources import Entry
from fsmkit.inspector.sources.recording import Recording
from fsmkit.system.of_one_chart import system_of
from tests.inspector.conftest import GATE, Client, elaborated
from tests.inspector.dap.editor import Editor, Json
from tests.inspector.dap.test_framing import KEYS
from tests.inspector.following import Elsewhere

PARALLEL = """\
chart: Pair
types:
  Point: {x: 0..9, y: 0..9}
data:
  place: Point
  many: 0..9[3] = 0
events: {in: [go(n 0..9), stop], internal: [inner]}
initial: both
states:
  both:
    entry: place.x = 1; place.y = 2
    regions:
      left:
        initial: a
        states:
          a: {on: {go: {target: b, do: place.x = event.n}}}
          b: {always: [{if: "many[1] == 3", target: c}]}
          c: {entry: "many[2] = 7"}
      right:
        initial: d
        states:
          d: {on: {go: {target: e, do: "many[1] = 3; raise inner"}}}
          e: {on: {inner: f}}
          f: {}
    on: {stop: over}
  over: {final: true}
"""


@pytest.fixture(autouse=True, scope="module")
def undrawn() -> Iterator[None]:
    """Draw nothing, as where there is no Graphviz."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(charts, "MOST_DRAWN", 0)
        yield


@pytest.fixture
def editor(gate: Path) -> Editor:
    """Stand at the start of a gate."""
    editor = Editor()
    editor.launch(gate, speed=0)
    return editor


@pytest.fixture
def pair(tmp_path: Path) -> Editor:
    """Stand at the start of a chart with two regions."""
    path = tmp_path / "pair.yaml"
    path.write_text(PARALLEL, encoding="utf-8")
    editor = Editor()
    editor.launch(path, speed=0)
    return editor


def line_of(words: str, text: str = GATE) -> int:
    """Return the line in which words stand first."""
    return next(n for n, line in enumerate(text.splitlines(), 1) if words in line)


def lines(editor: Editor, path: Path, *wanted: Json) -> list[Json]:
    """Set the breakpoints of a file."""
    source = {"path": str(path)}
    found: list[Json] = editor.get("setBreakpoints", source=source, breakpoints=list(wanted))[
        "breakpoints"
    ]
    return found


# --- the course of a session ---------------------------------------------------------------------


def test_a_session_begins_with_initialized_and_a_stop(gate: Path) -> None:
    editor = Editor()
    body = editor.get("initialize", adapterID="fsmkit")
    assert body["supportsStepBack"] is True
    assert [each["filter"] for each in body["exceptionBreakpointFilters"]] == [
        *("fault", "property", "lost", "error")
    ]
    editor.get("launch", program=str(gate))
    kinds = [message.get("event") or message["command"] for message in editor.messages]
    assert kinds == ["initialize", "launch", "initialized"]
    editor.get("configurationDone")
    (stopped,) = editor.events("stopped")
    assert stopped == {
        "reason": "entry",
        "description": "start, in closed",
        "threadId": 1,
        "allThreadsStopped": True,
    }
    assert editor.get("threads") == {"threads": [{"id": 1, "name": "Gate"}]}
    assert [message["seq"] for message in editor.messages] == [*range(1, len(editor.messages) + 1)]


def test_without_a_stop_on_entry_it_runs(gate: Path) -> None:
    editor = Editor()
    assert editor.launch(gate, stopOnEntry=False) == {}
    editor.get("pause")
    assert editor.events("stopped")[-1]["reason"] == "pause"


def test_requests_come_in_their_order(gate: Path) -> None:
    editor = Editor()
    assert editor.refused("launch", program=str(gate))["rule"] == "wrong-command"
    editor.get("initialize")
    assert "nothing runs yet" in editor.refused("threads")["message"]
    assert "no session runs" in editor.refused("attach")["message"]
    assert "there is no request" in editor.refused("foo")["message"]
    assert "names no program" in editor.refused("launch")["message"]
    editor.get("launch", program=str(gate))
    assert "already started" in editor.refused("launch", program=str(gate))["message"]


def test_a_chart_that_cannot_be_read_is_refused_with_all_findings(tmp_path: Path) -> None:
    path = tmp_path / "bad.yaml"
    path.write_text("chart: B\nstates: {a: {on: {go: {nowhere}}}, b: {entry: x = {}}}\n")
    editor = Editor()
    editor.get("initialize")
    answer = editor.ask("launch", program=str(path))
    assert not answer["success"]
    assert answer["body"]["error"]["format"] == "{text}"
    assert "bad.yaml:2" in answer["body"]["error"]["variables"]["text"]
    assert all("rule" in finding for finding in answer["body"]["findings"])
    assert editor.refused("launch", program="none.yaml", cwd=str(tmp_path))["rule"] == (
        "unreadable-file"
    )
    assert editor.refused("launch", program="a\0b")["rule"]
    assert editor.refused("launch", program=str(path), seed=-1)["rule"] == "wrong-command"


def test_no_module_is_imported(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "evil.py").write_text("open('owned', 'w')\nmachine = 1\n")
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(str(tmp_path))
    editor = Editor()
    editor.get("initialize")
    assert editor.refused("launch", program="evil:machine")["rule"] == "unknown-suffix"
    assert not (tmp_path / "owned").exists()


def test_it_ends(editor: Editor) -> None:
    editor.get("terminate")
    assert editor.events("terminated") == [{}]
    editor.get("disconnect")
    assert editor.adapter.is_over
    count = len(editor.messages)
    editor.adapter.receive(b'{"seq": 99, "type": "request", "command": "threads"}')
    assert len(editor.messages) == count


def test_at_the_end_of_all_machines_to_go_on_ends_the_session(pair: Editor) -> None:
    pair.type("stop")
    assert pair.stack() == [f"over:{line_of('  over:', PARALLEL)}", "Pair (finished):1"]
    pair.get("continue", threadId=1)
    assert pair.events("terminated") == [{}]


# --- going on and back ---------------------------------------------------------------------------


def test_forward_and_back(editor: Editor) -> None:
    editor.type("open")
    assert editor.events("stopped")[-1]["description"] == "open, closed -> opening"
    assert editor.stack() == [f"opening:{line_of('  opening:')}", "Gate:1"]
    assert editor.values("Outputs") == {"motor": "true"}
    assert editor.values("Timers") == {"after T_OPEN (4s) of opening": "at 4s, in 4s"}
    assert editor.stop("next")["description"] == "after T_OPEN (4s), opening -> wide"
    assert editor.values("Data") == {"count": "1", "fault_code": "none"}
    assert editor.stop("next")["description"] == "no timer is armed: post an event"
    assert editor.stop("stepBack")["description"] == "open, closed -> opening"
    assert editor.values("Data") == {"count": "0", "fault_code": "none"}
    assert editor.stop("next")["reason"] == "step"
    top, *_ = editor.frames()
    assert editor.stop("restartFrame", frameId=top["id"])["reason"] == "restart"
    assert editor.stack()[0].startswith("wide")
    assert editor.stop("reverseContinue")["reason"] == "step"
    assert editor.stack() == ["Gate (not started):1"]


def test_an_event_that_nothing_takes(editor: Editor) -> None:
    editor.type("close")
    assert editor.events("stopped")[-1]["description"] == "close, ignored in closed"
    assert editor.values("Event") == {"cause": "event close"}


def test_microsteps(pair: Editor) -> None:
    pair.type("post go 5")
    pair.stop("stepBack")
    (queued,) = pair.values("Queue").values()
    assert queued == "go n=5"
    told = pair.stop("stepIn")
    assert told["description"] == "microstep: go, transition 3, transition 6, d a -> b e"
    assert pair.stack()[:2] == ["transition 3: go of a:16", "transition 6: go of d:22"]
    assert [name.split(":")[0] for name in pair.stack()[2:]] == [
        *("b", "region left", "e", "region right", "both", "Pair")
    ]
    assert pair.scope("Data")["many"]["value"] == "[0 3 0]"
    assert (
        "step out"
        in pair.refused(
            "setVariable", variablesReference=pair.reference("Data"), name="many", value="[1 1 1]"
        )["help"]
    )
    assert "transition 4" in pair.stop("stepIn")["description"]
    assert pair.stack()[1].startswith("c:")
    assert "inner, transition 7, e -> f" in pair.stop("stepIn")["description"]
    assert "transition 4" in pair.stop("stepBack")["description"]
    assert "transition 3" in pair.stop("stepBack", granularity="instruction")["description"]
    assert pair.stop("stepOut")["description"] == "go, a d -> c f"
    assert "transition 4" in pair.stop("stepBack", granularity="instruction")["description"]
    pair.stop("next")
    assert pair.stack()[0].startswith("c:")


def test_it_runs_in_real_time_and_pauses(gate: Path) -> None:
    editor = Editor()
    editor.launch(gate, speed=2)
    editor.type("open")
    editor.run(1_000_000)
    assert editor.frames()[0]["name"] == "opening"
    stopped = editor.stop("pause")
    assert (stopped["reason"], stopped["description"]) == ("pause", "paused")
    editor.run(1_000_001)
    assert editor.frames()[0]["name"] == "wide"


def test_another_client_moves_the_view(editor: Editor) -> None:
    hub = editor.adapter.hub
    assert hub is not None
    client = hub.join(lambda _: None)
    hub.receive(client, '{"id": 1, "do": "post", "m": "Gate", "event": "open"}')
    editor.adapter.look()
    assert editor.events("stopped")[-1]["description"] == "open, closed -> opening"
    hub.receive(client, '{"id": 1, "do": "run"}')
    editor.adapter.look()
    assert editor.events("continued") == [{"threadId": 1, "allThreadsContinued": True}]
    hub.receive(client, '{"id": 1, "do": "pause"}')
    editor.adapter.look()
    assert editor.events("stopped")[-1]["reason"] == "pause"


def test_an_editor_that_leaves_takes_its_breakpoints_along(gate: Path) -> None:
    hub = Hub(fsmkit.read_chart(gate), file=gate)
    editor = Editor(hub)
    editor.get("initialize")
    editor.get("attach")
    assert lines(editor, gate, {"line": line_of("  wide:")})[0]["verified"]
    editor.get("setExceptionBreakpoints", filters=["lost"])
    editor.get("disconnect")
    client = Client(hub)
    client.result("post", m="Gate", event="open")
    client.result("run", speed=0)
    hub.advance(1)
    assert client.last("mode")["why"] == ["idle"]
    assert client.say("unbreak", number=1)["k"] == "refused"


def test_the_console_has_the_trace_if_it_is_wanted(gate: Path) -> None:
    editor = Editor()
    editor.launch(gate, trace=True)
    editor.type("open")
    assert editor.output().splitlines() == [
        *("@0 > event open", "- closed", "t 1", "+ opening", "= opening")
    ]


def test_a_session_that_runs_is_joined(gate: Path) -> None:
    hub = Hub(fsmkit.read_chart(gate), file=gate)
    editor = Editor(hub, may_command=False)
    editor.get("initialize")
    assert "runs here already" in editor.refused("launch", program=str(gate))["message"]
    editor.get("attach")
    editor.get("configurationDone")
    assert editor.stack()[0].startswith("closed")
    assert "read-only" in editor.refused("next", threadId=1)["message"]
    assert editor.adapter.hub is None


def test_a_file_that_is_saved_anew_has_other_lines(gate: Path) -> None:
    hub = Hub(fsmkit.read_chart(gate), file=gate)
    editor = Editor(hub)
    editor.get("initialize")
    editor.get("attach")
    editor.get("configurationDone")
    editor.type("open")
    gate.write_text(GATE.replace("states:", "# a line more\nstates:"), encoding="utf-8")
    hub.reload(fsmkit.read_chart(gate))
    editor.adapter.look()
    stopped = editor.events("stopped")[-1]
    assert stopped["description"] == "the file was saved, and the same is done again"
    assert editor.stack()[0] == f"opening:{line_of('  opening:') + 1}"
    (row,) = lines(editor, gate, {"line": line_of("  wide:") + 1})
    editor.type("timer")
    assert editor.events("stopped")[-1]["hitBreakpointIds"] == [row["id"]]


def test_what_runs_elsewhere_is_followed_and_never_stopped(gate: Path) -> None:
    source = Elsewhere(fsmkit.read_chart(gate))
    hub = Hub(source)
    editor = Editor(hub)
    editor.get("initialize")
    editor.get("attach")
    editor.get("setFunctionBreakpoints", breakpoints=[{"name": "wide"}])
    editor.get("configurationDone")
    source.happen()
    source.happen("open", until=1000)
    hub.advance(20_000)
    editor.adapter.look()
    assert editor.events("stopped") == []
    source.happen(until=5000)
    source.happen("close")
    hub.advance(20_000)
    editor.adapter.look()
    (stopped,) = editor.events("stopped")
    assert (stopped["reason"], editor.frames()[0]["name"]) == ("function breakpoint", "wide")
    assert (
        "does not accept `post`"
        in editor.refused("evaluate", expression="open", context="repl")["message"]
    )
    assert editor.stop("stepBack")["reason"] == "step"
    editor.get("continue", threadId=1)
    assert editor.frames()[0]["name"] == "closed"
    assert editor.stop("pause")["description"] == "paused"


def test_states_are_shown_where_no_data_are_known(gate: Path) -> None:
    chart = fsmkit.read_chart(gate)
    done = Editor()
    done.launch(gate)
    done.type("open")
    hub = done.adapter.hub
    assert hub is not None
    told = (hub.view.course.messages(n) for n in range(1, hub.view.history.head + 1))
    entries = [Entry(None, tuple(messages)) for messages in told]
    begin = Simulation(system_of(chart)).begin()
    editor = Editor(Hub(Recording(system_of(chart), begin, entries, at_end=True)))
    editor.get("initialize")
    editor.get("attach")
    editor.get("configurationDone")
    assert editor.stack() == [f"opening:{line_of('  opening:')}", "Gate:1"]
    assert editor.values("Data") == {}
    assert "not known" in editor.refused("evaluate", expression="count")["message"]
    assert (
        "not known" in editor.refused("evaluate", expression="post open", context="repl")["message"]
    )
    assert editor.stop("stepBack")["description"] == "open is queued"


# --- breakpoints ---------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("words", "at", "stands"),
    [
        ("  closed:", "  closed:", "closed"),
        ("open: {target", "open: {target", "opening"),
        ("  opening:", "  opening:", "opening"),
        ("entry: motor", "entry: motor", "opening"),
        ("exit: motor", "exit: motor", "wide"),
        ("    after:", "T_OPEN: {target", "wide"),
        ("initial: closed", "  closed:", "closed"),
    ],
)
def test_a_line_stops_and_moves_down(
    editor: Editor, gate: Path, words: str, at: str, stands: str
) -> None:
    (found,) = lines(editor, gate, {"line": line_of(words)})
    assert found["verified"]
    assert found["line"] == line_of(at)
    assert found["source"]["path"] == str(gate)
    editor.type("open")
    if editor.events("stopped")[-1]["reason"] != "breakpoint":
        editor.run()
    stopped = editor.events("stopped")[-1]
    if stands != "closed":
        assert (stopped["reason"], stopped["hitBreakpointIds"]) == ("breakpoint", [found["id"]])
        assert editor.frames()[0]["name"] == stands
    else:
        assert stopped["reason"] == "pause"


def test_lines_that_stand_for_nothing(editor: Editor, gate: Path, tmp_path: Path) -> None:
    rows = lines(editor, gate, {"line": 999}, {"line": 22, "condition": "count >"})
    assert [row["verified"] for row in rows] == [False, False]
    assert "here or below" in rows[0]["message"]
    assert "expression" in rows[1]["message"]
    assert "no machine that runs" in lines(editor, tmp_path / "x.yaml", {"line": 1})[0]["message"]
    assert lines(editor, gate) == []


def test_conditions_counts_and_logs(editor: Editor, gate: Path) -> None:
    line = line_of("T_OPEN: {target")
    lines(
        editor,
        gate,
        {
            "line": line,
            "logMessage": "count is {count}, {fault_code}",
            "condition": "count > 1",
        },
        {"line": line, "hitCondition": "== 2"},
        {"line": line_of("  wide:"), "hitCondition": "% 3"},
    )
    reasons = []
    for _ in range(6):
        editor.type("open")
        reasons.append(editor.run()["reason"])
        editor.type("close")
    assert reasons == ["pause", "breakpoint", "breakpoint", "pause", "pause", "breakpoint"]
    assert editor.output() == "".join(f"count is {n}, none\n" for n in range(2, 7))


@pytest.mark.parametrize("hits", ["0", "many", "< 1", "-1", ">= x", "% 0"])
def test_a_count_that_is_none(editor: Editor, gate: Path, hits: str) -> None:
    (row,) = lines(editor, gate, {"line": 20, "hitCondition": hits})
    assert "counts no hits" in row["message"]


def test_names_of_states_and_events(editor: Editor) -> None:
    names = ["wide", "Gate.broken", "close", "opened", "wid"]
    rows = editor.get("setFunctionBreakpoints", breakpoints=[{"name": name} for name in names])
    verified = [row["verified"] for row in rows["breakpoints"]]
    assert verified == [True, True, True, True, False]
    assert "wide" in rows["breakpoints"][-1]["message"]
    editor.type("open")
    stopped = editor.run()
    assert stopped["reason"] == "function breakpoint"
    editor.type("close")
    assert editor.events("stopped")[-1]["hitBreakpointIds"] == [rows["breakpoints"][2]["id"]]


def test_data_that_change(pair: Editor) -> None:
    many = pair.scope("Data")["many"]["variablesReference"]
    info = pair.get("dataBreakpointInfo", variablesReference=many, name="[2]")
    assert (info["description"], info["accessTypes"]) == ("many[2]", ["write"])
    rows = pair.get("setDataBreakpoints", breakpoints=[{"dataId": info["dataId"]}])["breakpoints"]
    assert rows[0]["verified"]
    pair.type("post go 1")
    stopped = pair.events("stopped")[-1]
    assert (stopped["reason"], stopped["text"]) == ("data breakpoint", "many[2]")
    assert pair.get("dataBreakpointInfo", name="place.x + 1")["dataId"]
    assert pair.get("dataBreakpointInfo", name="no such")["dataId"] is None
    timers = pair.reference("Timers")
    assert pair.get("dataBreakpointInfo", variablesReference=timers, name="x")["dataId"] is None
    bad = pair.get("setDataBreakpoints", breakpoints=[{"dataId": "x"}, {"dataId": '["",""]'}])
    assert [row["verified"] for row in bad["breakpoints"]] == [False, False]


FAULTY = """\
chart: Faulty
capacity: {queue: 2}
data: {n: 0..3 fault = 0}
events: {in: [go, twice, inner]}
states:
  a:
    on:
      go: {do: n = n + 1}
      twice: {do: send inner to self; send inner to self; send inner to self}
    invariant: n < 2
"""


def faulty(tmp_path: Path, *filters: str) -> Editor:
    path = tmp_path / "faulty.yaml"
    path.write_text(FAULTY, encoding="utf-8")
    editor = Editor()
    chosen = {"filters": list(filters)}
    editor.launch(path, lambda: editor.get("setExceptionBreakpoints", **chosen), speed=0)
    return editor


def test_exceptions_stop(tmp_path: Path) -> None:
    editor = faulty(tmp_path, "property", "lost", "fault")
    reasons = []
    editor.type("twice")
    assert editor.events("stopped")[-1]["text"] == "lost"
    editor.run()
    for _ in range(4):
        editor.type("post go")
        stopped = editor.events("stopped")[-1]
        reasons.append((stopped["reason"], stopped.get("text")))
    broken = [("step", None), ("exception", "a.invariant"), ("step", None)]
    assert reasons == [*broken, ("exception", "go, in a: fault range Faulty")]
    info = editor.get("exceptionInfo", threadId=1)
    assert info["exceptionId"] == "range Faulty"
    assert editor.stack()[-1].startswith("Faulty (fault range)")


def test_exceptions_that_are_not_wanted_do_not_stop(tmp_path: Path) -> None:
    editor = faulty(tmp_path)
    for event in ("twice", "go", "go"):
        editor.type(f"post {event}")
    assert {stopped["reason"] for stopped in editor.events("stopped")} == {"entry", "step"}
    assert "did not stop" in editor.refused("exceptionInfo", threadId=1)["message"]
    rows = editor.get("setExceptionBreakpoints", filters=["all"])["breakpoints"]
    assert "there is no filter" in rows[0]["message"]


def test_back_to_the_last_breakpoint(editor: Editor, gate: Path) -> None:
    (found,) = lines(editor, gate, {"line": line_of("  wide:")})
    for _ in range(2):
        editor.type("open")
        editor.run()
        editor.type("close")
    stopped = editor.stop("reverseContinue")
    assert (stopped["reason"], stopped["hitBreakpointIds"]) == ("breakpoint", [found["id"]])
    assert editor.values("Data")["count"] == "2"
    editor.stop("reverseContinue")
    assert editor.values("Data")["count"] == "1"


def test_lines_where_breakpoints_can_be(editor: Editor, gate: Path) -> None:
    source = {"path": str(gate)}
    body = editor.get("breakpointLocations", source=source, line=line_of("  closed:"), endLine=20)
    assert body["breakpoints"] == [{"line": 18, "column": 3}, {"line": 20, "column": 7}]
    assert editor.get("breakpointLocations", source={"path": "/no"}, line=1)["breakpoints"] == []


# --- values --------------------------------------------------------------------------------------


def test_nested_values_are_shown_and_set(pair: Editor) -> None:
    data = pair.scope("Data")
    assert (data["place"]["value"], data["place"]["type"]) == ("[1 2]", "Point")
    assert data["place"]["namedVariables"] == 2
    assert data["many"]["indexedVariables"] == 3
    place = data["place"]["variablesReference"]
    assert pair.parts(place)["y"]["evaluateName"] == "place.y"
    found = pair.get("setVariable", variablesReference=place, name="y", value="many[0] + 8")
    assert found["value"] == "8"
    assert pair.parts(place)["y"]["value"] == "8"
    whole = pair.get(
        "setVariable", variablesReference=pair.reference("Data"), name="many", value="[4 5 6]"
    )
    assert whole["value"] == "[4 5 6]"
    page = pair.get("variables", variablesReference=whole["variablesReference"], start=1, count=1)
    assert [row["name"] for row in page["variables"]] == ["[1]"]
    pair.stop("stepBack")
    assert pair.scope("Data")["many"]["value"] == "[0 0 0]"


def test_inputs_are_set_and_move_the_machine(editor: Editor) -> None:
    inputs = editor.reference("Inputs")
    editor.get("setVariable", variablesReference=inputs, name="blocked", value="true")
    assert editor.values("Inputs") == {"blocked": "true"}
    assert "script" in editor.type("save script") or editor.type("save script").startswith("start")
    for name, value in (("blocked", "7"), ("nothing", "1")):
        assert editor.refused("setVariable", variablesReference=inputs, name=name, value=value)[
            "rule"
        ]
    outputs = editor.reference("Outputs")
    assert (
        "cannot be set"
        in editor.refused("setVariable", variablesReference=outputs, name="motor", value="true")[
            "message"
        ]
    )


def test_data_set_by_hand_are_in_no_script(editor: Editor) -> None:
    data = editor.reference("Data")
    editor.get("setVariable", variablesReference=data, name="fault_code", value="jam")
    assert editor.values("Data")["fault_code"] == "jam"
    assert editor.refused("evaluate", expression="save script", context="repl")["rule"] == (
        "wrong-command"
    )
    assert '"data":{"fault_code":"jam"}' in editor.type("save live")
    for value in ("9", "Fault.none + 1", "blocked", ""):
        assert editor.refused(
            "setVariable", variablesReference=data, name="fault_code", value=value
        )


def test_a_saved_session_is_launched(editor: Editor, gate: Path) -> None:
    editor.type("open")
    given = {"variablesReference": editor.reference("Data"), "name": "count", "value": "7"}
    editor.get("setVariable", **given)
    editor.stop("next")
    saved = gate.with_name("session.live")
    saved.write_text(editor.type("save live"), encoding="utf-8")
    again = Editor()
    assert again.launch(saved, speed=0)["description"] == "not started"
    assert again.run()["description"] == "the record ends here"
    assert again.values("Data") == editor.values("Data") == {"count": "8", "fault_code": "none"}
    again.stop("stepBack")
    assert again.values("Data")["count"] == "7"
    other = Editor()
    other.launch(gate, replay=str(saved))
    assert other.stack() == ["Gate (not started):1"]


def test_expressions_and_commands(editor: Editor) -> None:
    assert editor.get("evaluate", expression="count + 1", context="watch") == {
        "result": "1",
        "type": "1..101",
        "variablesReference": 0,
    }
    assert editor.get("evaluate", expression="In(closed)", context="hover")["result"] == "true"
    assert editor.refused("evaluate", expression="open", context="watch")["rule"]
    assert editor.refused("evaluate", expression="__import__('os')", context="repl")["rule"]
    assert editor.refused("evaluate", expression="  ", context="repl")["rule"]
    assert editor.refused("evaluate", expression="fault code=x", context="repl")["rule"] == (
        "wrong-script-line"
    )
    assert "yes      open" in editor.type("events")
    editor.type("set blocked true")
    assert editor.type("why open") == (
        "open: no\n  closed, transition 1 if not blocked: does not hold [blocked = true]"
    )
    assert "Gate: closed" in editor.type("state")
    editor.type("back 99")
    editor.type("seek 1")
    editor.type("open")
    assert editor.type("fork").startswith("0: steps")
    editor.type("timer")
    assert editor.frames()[0]["name"] == "wide"
    editor.type("fork 0")
    assert editor.values("Inputs") == {"blocked": "true"}
    for wrong in (
        "run x",
        "seek x",
        "go until",
        "go fast",
        "fork 77",
        "save x",
        "set motor 1",
        "post nothing",
    ):
        assert editor.refused("evaluate", expression=wrong, context="repl")["rule"]
    assert "post EVENT" in editor.type("help")


def test_the_console_runs_until_a_condition(editor: Editor) -> None:
    editor.type("open")
    editor.type("go until In(wide)")
    assert editor.events("continued")
    hub = editor.adapter.hub
    assert hub is not None
    hub.advance(1)
    editor.adapter.look()
    stopped = editor.events("stopped")[-1]
    assert (stopped["reason"], stopped["description"]) == (
        "breakpoint",
        "the condition became true",
    )


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("fau", ["fault", "fault_code"]),
        ("post cl", ["close"]),
        ("set b", ["blocked"]),
        ("fault j", ["jam"]),
        ("count + In(w", []),
        ("count == 1 and blo", ["blocked"]),
        ("save p", ["pytest"]),
    ],
)
def test_completions(editor: Editor, text: str, expected: list[str]) -> None:
    found = editor.get("completions", text=text, column=len(text) + 1)["targets"]
    assert [row["label"] for row in found] == expected


@pytest.mark.parametrize("text", ["a" * 100_000, "post " * 20_000, "[" * 100_000, "😀" * 100_000])
def test_completions_in_a_long_line_take_time_in_proportion(editor: Editor, text: str) -> None:
    for column in (1, len(text) + 1, 10**9):
        assert isinstance(editor.get("completions", text=text, column=column)["targets"], list)


def test_sources(editor: Editor, gate: Path) -> None:
    (source,) = editor.get("loadedSources")["sources"]
    assert source == {"name": "gate.yaml", "path": str(gate)}
    gate.unlink()
    (source,) = editor.get("loadedSources")["sources"]
    number = source["sourceReference"]
    assert editor.get("source", sourceReference=number)["content"] == GATE
    assert editor.frames()[0]["source"] == {"name": "gate.yaml", "sourceReference": number}
    (row,) = editor.get(
        "setBreakpoints", source={"sourceReference": number}, breakpoints=[{"line": 18}]
    )["breakpoints"]
    assert row["verified"]
    assert editor.refused("source", sourceReference=7)["rule"]


def test_counting_from_zero_in_utf16_and_uris(tmp_path: Path) -> None:
    path = tmp_path / "wide.yaml"
    path.write_text('chart: W\ninitial: "\U0001f600"\nstates: {"\U0001f600": {}, b: {}}\n')
    editor = Editor()
    editor.get("initialize", linesStartAt1=False, columnsStartAt1=False, pathFormat="uri")
    editor.get("launch", program=str(path))
    editor.get("configurationDone")
    (frame, _) = editor.frames()
    assert frame["source"]["path"] == path.as_uri()
    assert frame["line"] == 2
    source = {"path": path.as_uri()}
    rows = editor.get("setBreakpoints", source=source, breakpoints=[{"line": 2, "column": 15}])
    assert rows["breakpoints"][0]["column"] == 19
    found = editor.get("breakpointLocations", source=source, line=2)["breakpoints"]
    assert [each["column"] for each in found] == [10, 19]


# --- whatever is asked ---------------------------------------------------------------------------

SMALL: st.SearchStrategy[Any] = (
    st.integers(-2, 12)
    | st.none()
    | st.sampled_from(
        [
            *("", "open", "count", "true", "repl", "watch", "instruction", "fault", "jam", "[1 2]"),
            *("post open", "run", "back 2", "save live", "why fault", "{", "\ud800", "x" * 300),
        ]
    )
    | st.just({"path": "gate.yaml"})
    | st.just({"sourceReference": 1})
    | st.lists(st.fixed_dictionaries({"line": st.integers(-3, 40), "name": st.just("wide")}))
    | st.lists(st.sampled_from(["fault", "lost", "x"]))
)
REQUESTS = sorted({*OF_ADAPTER, *OF_SESSION, *OF_INSPECTION} - {"disconnect", "launch", LIVE})
CHART = elaborated(GATE)


@settings(max_examples=60)
@given(
    st.lists(
        st.tuples(st.sampled_from(REQUESTS), st.dictionaries(KEYS, SMALL, max_size=5)),
        min_size=1,
        max_size=15,
    )
)
def test_whatever_is_asked_is_answered_once(asked: list[tuple[str, Json]]) -> None:
    hub = Hub(CHART)
    editor = Editor(hub)
    editor.get("initialize")
    editor.get("attach")
    for command, arguments in asked:
        assert editor.answers(command, arguments) == 1, (command, arguments)
        hub.advance(100_000)
        editor.adapter.look()
