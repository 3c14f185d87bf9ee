"""What a client says and is told; whatever it does, the machine is the interpreter's."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, precondition, rule

import fsmkit
from fsmkit.inspector import charts
from fsmkit.inspector.hub import Hub
from fsmkit.runtime.live.messages import from_json
from fsmkit.runtime.script import Player, script_texts
from tests import needs
from tests.inspector.conftest import GATE, Client, elaborated

CELL = Path(__file__).parents[2] / "machines/production_cell/cell.yaml"


def test_a_client_is_told_all_and_then_each_step(client: Client) -> None:
    hello, state, mode = client.told
    assert (hello["k"], hello["name"], hello["machines"][0]["m"]) == ("hello", "Gate", "Gate")
    assert (state["on"], state["data"]) == (["closed"], {"count": 0, "fault_code": "none"})
    assert (mode["mode"], mode["n"]) == ("paused", 1)
    assert client.result("post", m="Gate", event="open") == "queued"
    post, step = client.told[-3:-1]
    assert (post["k"], post["n"], post["event"]) == ("post", 2, ["open"])
    assert (step["n"], step["cause"]) == (3, ["event", "open"])
    assert step["do"] == [["-", "closed"], ["t", 1], ["+", "opening"]]
    assert step["set"] == {"motor": True}
    assert step["timers"] == [[2, 4000]]


def test_a_running_session_goes_on_by_real_time(client: Client) -> None:
    client.result("post", m="Gate", event="open")
    client.result("run", speed=2)
    for _ in range(199):
        client.hub.advance(10_000)
    assert client.last("step")["cause"] == ["event", "open"]
    client.hub.advance(10_000)
    assert client.last("step")["at"] == 4000
    assert client.last("mode")["mode"] == "running"
    client.result("pause")
    assert client.last("mode")["why"] == ["asked"]


def test_a_session_keeps_its_speed(client: Client) -> None:
    client.result("run")
    assert client.last("mode").get("speed", 1.0) == 1
    client.result("run", speed=20)
    client.result("pause")
    client.result("run")
    assert client.last("mode")["speed"] == 20


def test_entries_that_are_sent_again_are_announced(client: Client) -> None:
    client.result("post", m="Gate", event="open")
    count = len(client.told)
    answer = client.result("history", **{"from": 2, "last": 9})
    assert answer == {"first": 2, "last": 3}
    assert client.told[count] == {"k": "again", "first": 2, "last": 3}
    assert [message["n"] for message in client.told[count + 1 : -1]] == [2, 3]


def test_as_fast_as_can_be_ends_where_nothing_is_due(client: Client) -> None:
    client.result("post", m="Gate", event="open")
    client.result("run", speed=0)
    client.hub.advance(1)
    assert client.last("step")["at"] == 4000
    assert client.last("mode")["why"] == ["idle"]


@pytest.mark.parametrize(
    "point",
    [
        {"on": "entered", "what": "wide"},
        {"on": "left", "what": "opening"},
        {"on": "taken", "what": 2},
        {"on": "sent", "what": "opened"},
        {"on": "condition", "what": "count == 1"},
        {"on": "condition", "what": "In(wide)"},
        {"on": "left", "what": "opening", "if": "count > 0"},
    ],
)
def test_breakpoints_stop(client: Client, point: dict[str, Any]) -> None:
    number = client.result("break", m="Gate", **point)
    client.result("post", m="Gate", event="open")
    client.result("run", speed=0)
    client.hub.advance(1)
    assert client.last("mode")["why"] == ["breakpoint", number]
    assert client.last("step")["on"] == ["wide"]
    client.result("unbreak", number=number)
    client.result("post", m="Gate", event="close")
    assert client.last("step")["on"] == ["closed"]


def test_a_breakpoint_that_is_not_hit_does_not_stop(client: Client) -> None:
    client.result("break", m="Gate", on="left", what="opening", **{"if": "count > 1"})
    client.result("break", m="Gate", on="entered", what="wide", after=1)
    client.result("post", m="Gate", event="open")
    client.result("run", speed=0)
    client.hub.advance(1)
    assert client.last("mode")["why"] == ["idle"]


def test_why_an_event_does_nothing(client: Client) -> None:
    client.result("set", m="Gate", input="blocked", value=True)
    told = client.result("why", m="Gate", event="open")
    assert told["would"] == "no"
    (row,) = told["looked"]
    assert row["guard"] == "not blocked"
    assert row["values"] == {"blocked": True}
    assert row["holds"] is False
    told = client.result("why", m="Gate", event="close")
    assert told["because"] == "no active state has a transition for it"
    client.result("set", m="Gate", input="blocked", value=False)
    client.result("post", m="Gate", event="open")
    assert client.result("why", m="Gate", event="fault")["would"] == "?"
    assert client.result("why", m="Gate", event="fault", **{"with": {"code": "none"}})["would"] == (
        "no"
    )
    events = {e["event"]: e["would"] for e in client.result("events", m="Gate")}
    assert events == {"open": "no", "close": "no", "fault": "?"}


def test_watches_are_typed_and_evaluated_without_python(client: Client) -> None:
    assert client.result("watch", expression="count + 1") == {"value": 1, "type": "1..101"}
    assert client.result("watch", expression="In(closed)")["value"] is True
    answer = client.say("watch", expression="__import__('os')")
    assert answer["k"] == "refused"
    assert client.say("watch", expression="count +" + " 1 +" * 900 + " 1")["k"] == "refused"


def test_back_and_another_way(client: Client) -> None:
    client.result("post", m="Gate", event="open")
    client.result("step", how="timer")
    head = client.last("mode")["head"]
    assert client.result("back", count=3) == head - 3
    assert client.last("state")["on"] == ["closed"]
    client.result("set", m="Gate", input="blocked", value=True)
    client.result("post", m="Gate", event="open")
    assert client.last("step")["do"] == [["unhandled", "open"]]
    assert client.result("branches") == [{"branch": 0, "first": 0, "head": head}]
    client.result("fork", branch=0)
    assert client.last("state")["on"] == ["wide"]


@pytest.mark.parametrize("kind", ["script", "pytest"])
def test_it_is_saved_and_does_so_again(client: Client, kind: str, tmp_path: Path) -> None:
    client.result("post", m="Gate", event="open")
    client.result("step", how="timer")
    client.result("set", m="Gate", input="blocked", value=True)
    client.result("post", m="Gate", event="close")
    text = client.result("save", **{"as": kind})
    if kind == "script":
        lines = text.splitlines()
        player = Player(client.hub.simulation.charts[0])
        for line in script_texts(lines):
            player.play(line)
        assert client.hub.moment is not None
        assert player.snapshot.configuration == client.hub.moment.snapshots[0].configuration
        return
    found: dict[str, Any] = {}
    exec(compile(text, str(tmp_path / "test_saved.py"), "exec"), found)
    found["test_it_does_so_again"]()
    found["TRACE"][-1] = "= nowhere"
    with pytest.raises(AssertionError):
        found["test_it_does_so_again"]()


@pytest.mark.external
def test_what_is_saved_as_messages_can_be_read(client: Client) -> None:
    client.result("post", m="Gate", event="open")
    lines = client.result("save", **{"as": "live"}).splitlines()
    told = [message for line in lines for message in as_list(json.loads(line))]
    assert [m["k"] for m in told[:2]] == ["hello", "chart"]
    assert [m["n"] for m in told[2:]] == [0, 1, 2, 3]
    for message in told:
        from_json(json.dumps(message))


def test_another_seed_is_saved_too(tmp_path: Path) -> None:
    path = tmp_path / "dice.yaml"
    path.write_text(DICE, encoding="utf-8")
    traces = set()
    for seed in range(1, 9):
        client = Client(Hub(fsmkit.read_chart(path), file=path, seed=seed))
        for _ in range(4):
            client.result("post", m="Dice", event="roll")
        found: dict[str, Any] = {}
        text = client.result("save", **{"as": "pytest"})
        exec(compile(text, "test_saved.py", "exec"), found)
        found["test_it_does_so_again"]()
        traces.add(tuple(found["TRACE"]))
    assert len(traces) > 4


DICE = """\
chart: Dice
operations: ["eyes() -> 1..6"]
data: {sum: 0..100 = 0}
events: {in: [roll]}
initial: rolling
states: {rolling: {on: {roll: {do: sum = sum + eyes()}}}}
"""


def test_a_large_chart_is_not_drawn() -> None:
    states = "".join(f"  s{n}: {{on: {{go: s{n + 1}}}}}\n" for n in range(charts.MOST_DRAWN))
    text = f"chart: Long\nevents: {{in: [go]}}\ninitial: s0\nstates:\n{states}"
    last = f"  s{charts.MOST_DRAWN}:\n"
    client = Client(Hub(elaborated(text + last)))
    client.result("chart", chart=client.told[0]["machines"][0]["chart"])
    told = client.last("chart")
    assert len(told["states"]) == charts.MOST_DRAWN + 2
    assert "svg" not in told
    assert told["undrawn"] == (
        f"A drawing has at most {charts.MOST_DRAWN} states, "
        f"and this has {charts.MOST_DRAWN + 1}: fold some."
    )


def test_branches_share_a_limit(gate: Path) -> None:
    client = Client(Hub(fsmkit.read_chart(gate), limit=40_000))
    for _ in range(12):
        for _ in range(20):
            client.result("post", m="Gate", event="open")
        client.result("back", count=10)
    others = client.result("branches")
    assert others
    history = client.hub.view.history
    assert sum(branch.size for branch in history.others.values()) <= 40_000


def as_list(found: Any) -> list[Any]:
    return found if isinstance(found, list) else [found]


@pytest.mark.parametrize(
    ("command", "rule"),
    [
        ({"do": "stepp"}, "wrong-command"),
        ({"do": "post", "m": "Gat", "event": "open"}, "unknown-name"),
        ({"do": "post", "m": "Gate", "event": "opne"}, "unknown-name"),
        ({"do": "post", "m": "Gate", "event": "opened"}, "unknown-name"),
        ({"do": "post", "m": "Gate", "event": "fault", "with": {"code": "no"}}, "wrong-value"),
        ({"do": "post", "m": "Gate", "event": "fault"}, "wrong-value"),
        ({"do": "post", "m": 3, "event": "fault"}, "wrong-command"),
        ({"do": "set", "m": "Gate", "input": "blocked", "value": "x"}, "wrong-value"),
        ({"do": "run", "speed": -1}, "wrong-command"),
        ({"do": "run", "speed": 1e30}, "wrong-command"),
        ({"do": "break", "on": "entered", "what": "nowhere"}, "unknown-name"),
        ({"do": "break", "on": "taken", "what": 99}, "wrong-command"),
        ({"do": "break", "on": "condition", "what": "count"}, "type-mismatch"),
        ({"do": "unbreak", "number": 1}, "wrong-command"),
        ({"do": "micro", "n": 99}, "wrong-command"),
        ({"do": "chart", "chart": "0"}, "wrong-command"),
        ({"do": "save", "as": "exe"}, "wrong-command"),
        ({"do": "fork", "branch": 7}, "wrong-command"),
    ],
)
def test_what_cannot_be_obeyed_is_refused(
    client: Client, command: dict[str, Any], rule: str
) -> None:
    before = (client.hub.n, client.hub.moment)
    answer = client.say(**command)
    assert answer["k"] == "refused"
    assert answer["rule"] == rule, answer
    assert (client.hub.n, client.hub.moment) == before


@pytest.mark.parametrize(
    "text",
    ["", "{", "[]", "3", '{"do": "pause"}', "[" * 50_000, '{"id":1,"do":"pause"}' + " " * 70_000],
)
def test_what_is_no_command_is_refused(client: Client, text: str) -> None:
    client.hub.receive(client.number, text)
    assert client.told[-1]["k"] == "refused"
    assert client.told[-1]["rule"] == "wrong-command"


def test_who_only_looks_on_changes_nothing(gate: Path) -> None:
    hub = Hub(fsmkit.read_chart(gate))
    guest = Client(hub, may_command=False)
    assert guest.told[0]["readonly"]
    assert guest.say("post", m="Gate", event="open")["k"] == "refused"
    assert guest.say("back")["k"] == "refused"
    assert guest.result("watch", expression="count")["value"] == 0
    hub.leave(guest.number)
    hub.advance(1)


def test_two_clients_are_told_the_same(client: Client) -> None:
    other = Client(client.hub)
    first = len(client.told)
    other_first = len(other.told)
    client.result("post", m="Gate", event="open")
    told = [m for m in client.told[first:] if m["k"] != "done"]
    assert other.told[other_first:] == told


def test_the_cell_is_told_machine_by_machine() -> None:
    hub = Hub(fsmkit.read_system(CELL), file=CELL)
    client = Client(hub)
    client.result("run", speed=0, until="feeder.In(pushing)")
    for _ in range(50):
        hub.advance(1)
    assert client.last("mode")["why"][0] == "idle"
    client.result("post", m="plant", event="press_start")
    client.result("run", speed=0, until="feeder.In(pressing)")
    for _ in range(50):
        hub.advance(1)
    assert client.last("mode")["why"] == ["until", "feeder.In(pressing)"]
    assert {m["m"] for m in client.told if m["k"] == "step"} > {"feeder", "plant"}
    passed = [m for m in client.told if m["k"] == "pass"]
    assert passed
    assert {m["how"] for m in passed} <= {"queued", "refused"}
    assert [m["n"] for m in client.told if m["k"] == "step"] == sorted(
        m["n"] for m in client.told if m["k"] == "step"
    )


def test_a_history_has_its_limit(gate: Path) -> None:
    hub = Hub(fsmkit.read_chart(gate), limit=60_000)
    client = Client(hub)
    for _ in range(300):
        for event in ("open", "close"):
            client.result("post", m="Gate", event=event)
            client.result("step", how="timer")
    assert client.last("mode")["first"] > 0
    assert hub.view.history.branch.size <= 60_000
    middle = (client.last("mode")["first"] + client.last("mode")["head"]) // 2
    assert client.result("seek", n=middle) == middle
    assert client.result("seek", n=0) > 0
    assert client.say("save", **{"as": "script"})["k"] == "refused"


CHART = elaborated(GATE)


class Anything(RuleBasedStateMachine):
    """Post, set, run, seek and fork in any order: a model keeps the commands that survive."""

    def __init__(self) -> None:
        super().__init__()
        self.client = Client(Hub(CHART))

    @rule(event=st.sampled_from(["open", "close"]))
    def post(self, event: str) -> None:
        self.client.result("post", m="Gate", event=event)

    @rule(code=st.sampled_from(["none", "jam"]))
    def post_fault(self, code: str) -> None:
        self.client.result("post", m="Gate", event="fault", **{"with": {"code": code}})

    @rule(value=st.booleans())
    def set_input(self, value: bool) -> None:
        self.client.result("set", m="Gate", input="blocked", value=value)

    @rule(how=st.sampled_from(["macro", "timer", "tick"]))
    def step(self, how: str) -> None:
        self.client.result("step", how=how)

    @rule(time=st.integers(1, 5_000_000))
    def run_for(self, time: int) -> None:
        self.client.result("run", speed=1)
        self.client.hub.advance(time)
        self.client.result("pause")

    @rule(count=st.integers(-3, 12))
    def back(self, count: int) -> None:
        self.client.result("back", count=count)

    @rule(at=st.integers(0, 20_000))
    def seek(self, at: int) -> None:
        self.client.result("seek", at=at)

    @precondition(lambda self: self.client.hub.view.history.others)
    @rule(data=st.data())
    def fork(self, data: st.DataObject) -> None:
        others = [each["branch"] for each in self.client.result("branches")]
        self.client.result("fork", branch=data.draw(st.sampled_from(others)))

    @invariant()
    def what_is_in_view_is_what_was_told(self) -> None:
        """The entries of the branch, made again by a player, lead to what is in view."""
        hub = self.client.hub
        text = self.client.say("save", **{"as": "script"})
        assert text["k"] == "done", text
        if hub.n != hub.view.history.head:
            return
        player = Player(CHART)
        for line in script_texts(text["result"].splitlines()):
            player.play(line)
        assert hub.moment is not None
        mine = hub.moment.snapshots[0]
        assert (player.snapshot.configuration, player.snapshot.data, player.snapshot.timers) == (
            mine.configuration,
            mine.data,
            mine.timers,
        )


TestAnything = pytest.mark.slow(Anything.TestCase)
TestAnything.settings = settings(max_examples=60, stateful_step_count=25, deadline=None)


@pytest.mark.external
def test_a_drawing_leaves_out_what_is_inherited() -> None:
    feeder = Path(__file__).parents[2] / "machines/production_cell/feeder.yaml"
    client = Client(Hub(fsmkit.read_chart(feeder)))
    hash_ = client.last("hello")["machines"][0]["chart"]
    client.say("chart", chart=hash_)
    whole = client.last("chart")
    assert whole["hides"] == ["inherited", "watchdogs"]
    refused = client.say("chart", chart=hash_, hide=["inherted"])
    assert "`inherited`" in refused["help"]
    refused = client.say("chart", chart=hash_, fold=["homin"])
    assert "did you mean `homing`?" in refused["help"]
    needs.need("svg" in whole, "dot")
    client.say("chart", chart=hash_, hide=["watchdogs"], fold=["homing", "operational"])
    assert "states inside</text>" in client.last("chart")["svg"]
    client.say("chart", chart=hash_, hide=["watchdogs"])
    svg = client.last("chart")["svg"]
    watchdogs = {
        each["index"] for each in whole["transitions"] if f'"t{each["index"]}"' in whole["svg"]
    }
    watchdogs = {t for t in watchdogs if f'id="t{t}"' not in svg and f"a_t{t}" not in svg}
    chart = fsmkit.read_chart(feeder)
    assert watchdogs == {t.index for t in chart.transitions if t.watchdog}
    client.say("chart", chart=hash_, hide=["inherited", "watchdogs"])
    assert 'class="edge transition own' in client.last("chart")["svg"]
    assert 'class="edge transition inherited t1"' not in client.last("chart")["svg"]


def test_time_moves_to_a_timer_that_is_named(client: Client) -> None:
    client.say("post", m="Gate", event="open")
    assert client.result("step", how="time", at=3_999) == 0
    assert client.last("mode")["at"] == 3_999
    assert client.result("step", how="time", at=4_000) == 1
    assert client.last("step")["on"] == ["wide"]


def test_entries_are_found(client: Client) -> None:
    for _ in range(300):
        client.say("post", m="Gate", event="open")
        client.say("step", how="timer")
        client.say("post", m="Gate", event="close")
    head = client.last("mode")["head"]
    find = {"on": "entered", "m": "Gate", "what": "wide"}
    first = client.result("find", **find, **{"from": 0})["n"]
    assert client.result("find", **find, **{"from": first - 1}) == {"n": first}
    assert client.result("find", **find, **{"from": first})["n"] > first
    last = client.result("find", **find, **{"from": head + 9, "back": True})["n"]
    assert first < last <= head
    assert client.result("find", **find, **{"from": last}) == {}

    def all_of(back: bool, **what: Any) -> int:
        at = head + 1 if back else 0
        while "n" not in (told := client.result("find", **what, **{"from": at, "back": back})):
            at = told["from"]
        return int(told["n"])

    condition = {"on": "condition", "what": "count == 100"}
    hundredth = all_of(False, **condition)
    assert hundredth == all_of(True, **condition)
    assert client.result("find", **condition, **{"from": 0, "back": True}) == {}
    client.say("seek", n=hundredth)
    assert client.result("watch", expression="count") == {"value": 100, "type": "0..100"}
    assert "`wide`" in client.say("find", on="entered", m="Gate", what="wid", **{"from": 0})["help"]


def test_a_source_is_opened_and_no_other_file(gate: Path) -> None:
    opened: list[tuple[Path, int]] = []
    hub = Hub(fsmkit.read_chart(gate), editor=lambda file, line: opened.append((file, line)))
    client = Client(hub)
    client.result("open", file=str(gate), line=21)
    assert opened == [(gate, 21)]
    assert client.say("open", file="/etc/passwd", line=1)["k"] == "refused"
    looking_on = Client(hub, may_command=False)
    assert looking_on.say("open", file=str(gate), line=21)["k"] == "refused"
    assert "open" not in Client(Hub(fsmkit.read_chart(gate))).last("hello")["can"]
    assert len(opened) == 1


def test_breakpoints_are_those_of_all_clients(gate: Path) -> None:
    hub = Hub(fsmkit.read_chart(gate))
    one, other = Client(hub), Client(hub)
    assert not any(message["k"] == "points" for message in other.told)
    number = one.result("break", on="entered", m="Gate", what="wide", **{"if": "count > 2"})
    point = {"number": number, "on": "entered", "m": "Gate", "what": "wide", "if": "count > 2"}
    assert {**point, "every": 1} == other.last("points")["points"][0]
    assert Client(hub).last("points") == other.last("points")
    other.result("unbreak", number=number)
    assert one.last("points")["points"] == []
