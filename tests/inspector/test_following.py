"""What runs elsewhere is shown as it comes; the view stops, and the machine never does."""

from __future__ import annotations

import pytest

from fsmkit.diagnostics import fail
from fsmkit.inspector.following import SIGNALS_EVERY
from fsmkit.inspector.history import FOLDED_EVERY
from fsmkit.inspector.hub import Hub
from fsmkit.inspector.playing import CLOCK_EVERY
from fsmkit.inspector.sources import Followed
from fsmkit.inspector.view import STATE_EVERY
from tests.inspector.conftest import GATE, Client, elaborated
from tests.inspector.following import Elsewhere

CHART = elaborated(GATE)
TICK = 16_000


@pytest.fixture
def far() -> Elsewhere:
    """Run a gate elsewhere."""
    return Elsewhere(CHART)


@pytest.fixture
def client(far: Elsewhere) -> Client:
    """Look at a gate that runs elsewhere."""
    return Client(Hub(far, session="s"))


def test_it_is_a_source(far: Elsewhere) -> None:
    assert isinstance(far, Followed)


def test_what_comes_is_shown_and_numbered(far: Elsewhere, client: Client) -> None:
    assert client.told[0]["time"] == "live"
    assert client.last("mode")["mode"] == "following"
    assert not {"post", "set"} & set(client.told[0]["can"])
    far.happen()
    far.happen("open", until=4000)
    client.hub.advance(TICK)
    told = [m for m in client.told if m["k"] in ("step", "post")]
    assert [m["n"] for m in told] == [1, 2, 3, 4]
    assert told[-1]["at"] == 4000
    assert told[-1]["on"] == ["wide"]
    assert client.result("watch", expression="count")["value"] == 1
    assert client.result("micro", n=4)[0]["entered"] == ["wide"]


def test_back_freezes_and_follow_goes_on(far: Elsewhere, client: Client) -> None:
    far.happen()
    far.happen("open")
    client.hub.advance(TICK)
    assert client.result("back", count=2) == 1
    assert client.last("mode")["mode"] == "frozen"
    assert client.last("state")["on"] == ["closed"]
    steps = len([m for m in client.told if m["k"] == "step"])
    far.happen(until=4000)
    client.hub.advance(CLOCK_EVERY)
    assert len([m for m in client.told if m["k"] == "step"]) == steps
    assert client.last("mode")["head"] == 4
    assert client.last("mode")["n"] == 1
    assert client.result("watch", expression="motor")["value"] is False
    assert client.result("forward", count=1) == 2
    assert client.result("step") == 1
    assert client.last("step")["on"] == ["opening"]
    client.result("follow")
    assert client.last("mode")["mode"] == "following"
    assert client.last("state")["on"] == ["wide"]
    assert client.last("mode")["n"] == 4


def test_run_and_pause_are_follow_and_freeze(far: Elsewhere, client: Client) -> None:
    client.result("pause")
    assert client.last("mode")["mode"] == "frozen"
    far.happen()
    client.hub.advance(TICK)
    assert client.last("mode")["n"] == 0
    client.result("run")
    assert (client.last("mode")["mode"], client.last("mode")["n"]) == ("following", 1)


@pytest.mark.parametrize(
    "point",
    [
        {"on": "entered", "what": "opening"},
        {"on": "taken", "what": 1},
        {"on": "event", "what": "open"},
        {"on": "condition", "what": "motor"},
        {"on": "condition", "what": "In(opening)"},
    ],
    ids=str,
)
def test_a_breakpoint_freezes_the_view(
    far: Elsewhere, client: Client, point: dict[str, object]
) -> None:
    number = client.result("break", m="Gate", **point)
    far.happen()
    far.happen("open", until=4000)
    far.happen("close")
    client.hub.advance(TICK)
    mode = client.last("mode")
    assert (mode["mode"], mode["why"], mode["n"]) == ("frozen", ["breakpoint", number], 3)
    assert client.last("step")["on"] == ["opening"]
    client.hub.advance(CLOCK_EVERY)
    assert client.last("mode")["head"] == 6
    assert client.result("watch", expression="In(opening)")["value"] is True
    assert far.now.snapshots[0].configuration == {0, CHART.state_index["closed"]}


def test_commands_go_there_only_if_the_host_lets_them(far: Elsewhere, client: Client) -> None:
    for do, given in (("post", {"event": "open"}), ("set", {"input": "blocked", "value": True})):
        answer = client.say(do, m="Gate", **given)
        assert answer["k"] == "refused"
        assert "fork" in answer["help"]
    assert not far.taken
    willing = Elsewhere(CHART, frozenset(["post"]))
    client = Client(Hub(willing))
    assert "post" in client.told[0]["can"]
    assert client.result("post", m="Gate", event="open") == "sent"
    assert client.say("set", m="Gate", input="blocked", value=True)["k"] == "refused"
    assert client.say("post", m="Gate", event="opne")["rule"] == "unknown-name"
    assert [each[0] for each in willing.taken] == ["post"]
    assert client.hub.n == 0


def test_after_a_loss_data_are_unknown_until_a_known_moment(far: Elsewhere, client: Client) -> None:
    far.happen()
    far.happen("open")
    far.lose(7)
    far.happen(until=4000)
    client.hub.advance(TICK)
    assert client.last("lost")["count"] == 7
    state = client.last("state")
    assert state["known"] is False
    late = Client(client.hub)
    kinds = [m["k"] for m in late.told]
    assert kinds == ["hello", "state", "lost", "mode"]
    assert late.last("state")["on"] == ["wide"]  # as the messages since have it
    assert late.last("state")["known"] is False
    assert "error" in late.result("watch", expression="count")
    assert late.result("why", m="Gate", event="open")["would"] == "?"
    assert {each["would"] for each in late.result("events", m="Gate")} == {"?"}
    assert late.say("micro", n=5)["k"] == "refused"
    assert late.say("fork")["k"] == "refused"
    far.know()
    client.hub.advance(TICK)
    assert "known" not in client.last("state")
    assert client.result("watch", expression="count")["value"] == 1
    assert client.result("seek", n=5) == 5
    assert client.last("state")["known"] is False
    assert client.result("seek", n=3) == 3
    assert "known" not in client.last("state")


def test_states_alone_are_followed_from_the_start() -> None:
    far = Elsewhere(CHART)
    far.begin, far.is_known = None, False
    client = Client(Hub(far))
    assert client.last("state")["known"] is False
    number = client.result("break", m="Gate", on="entered", what="wide")
    client.result("break", m="Gate", on="condition", what="count == 1")
    far.happen()
    far.happen("open", until=4000)
    client.hub.advance(TICK)
    assert client.last("mode")["why"] == ["breakpoint", number]
    assert client.result("seek", n=3) == 3
    assert client.last("state")["on"] == ["opening"]
    assert client.result("seek", at=4000) == 4


def test_many_unknown_entries_are_found_again(far: Elsewhere) -> None:
    client = Client(Hub(far))
    far.happen()
    far.lose(1)
    opened = []
    for turn in range(3):
        for _ in range(FOLDED_EVERY // 3):
            far.happen("close")  # which does nothing
        far.happen("open", until=(turn + 1) * 4000)
        client.hub.advance(TICK)
        opened.append(client.hub.n)
        far.happen("close")
    client.hub.advance(TICK)
    assert client.hub.view.history.branch.folded
    for n in opened:
        client.result("seek", n=n)
        assert client.last("state")["on"] == ["wide"]
        client.result("seek", n=n - 1)
        assert client.last("state")["on"] == ["opening"]
        client.result("seek", n=n + 2)
        assert client.last("state")["on"] == ["closed"]


def test_a_branch_goes_on_in_the_interpreter(far: Elsewhere, client: Client) -> None:
    far.happen()
    far.happen("open")
    client.hub.advance(TICK)
    client.result("back", count=1)
    client.result("fork")
    assert client.last("mode")["mode"] == "paused"
    assert client.last("mode")["branch"] == 1
    assert "post" in client.last("hello")["can"]
    far.happen(until=4000)
    client.hub.advance(TICK)
    assert client.last("mode")["branch"] == 1
    for _ in range(2):  # what is in the queue, then the timer
        client.result("step", how="timer")
    assert client.last("step")["on"] == ["wide"]
    client.result("post", m="Gate", event="close")
    assert client.last("step")["on"] == ["closed"]
    assert not far.taken
    assert [each["branch"] for each in client.result("branches")] == [0]
    client.result("follow")
    assert client.last("mode")["mode"] == "following"
    assert "branch" not in client.last("mode")
    assert client.last("state")["on"] == ["wide"]
    assert "post" not in client.last("hello")["can"]


def test_signals_are_sent_at_most_sixty_times_a_second(far: Elsewhere) -> None:
    far.sampled = {"position": 0.0, "speed": 1.5}
    client = Client(Hub(far))
    assert client.told[0]["signals"] == ["position", "speed"]
    for turn in range(1_000):  # a second, by the millisecond
        far.sampled["position"] = float(turn)
        client.hub.advance(1_000)
    told = [m for m in client.told if m["k"] == "signals"]
    assert 50 <= len(told) <= 60
    assert told[-1]["v"][1] == 1.5
    client.hub.advance(SIGNALS_EVERY)
    client.hub.advance(SIGNALS_EVERY)
    count = len([m for m in client.told if m["k"] == "signals"])
    client.hub.advance(SIGNALS_EVERY)  # nothing has changed
    assert len([m for m in client.told if m["k"] == "signals"]) == count


def test_a_source_that_ends_says_why(far: Elsewhere, client: Client) -> None:
    far.happen()
    client.hub.advance(TICK)
    far.error = fail("wrong-command", "the board is gone")
    client.hub.advance(TICK)
    mode = client.last("mode")
    assert (mode["mode"], mode["why"]) == (
        "frozen",
        ["fault", "wrong-command", "the board is gone"],
    )
    far.error = None
    far.happen("open")
    client.hub.advance(TICK)
    assert client.hub.n == 1
    client.result("follow")
    assert client.last("mode")["mode"] == "frozen"


def test_all_is_sent_again_now_and_then(far: Elsewhere, client: Client) -> None:
    far.happen()
    for _ in range(STATE_EVERY // 2):
        far.happen("close")
    client.hub.advance(TICK)
    assert any(m["n"] == STATE_EVERY for m in client.told if m["k"] == "state")


def test_the_oldest_entries_go(far: Elsewhere) -> None:
    client = Client(Hub(far, limit=200_000))
    far.happen()
    for turn in range(90):
        far.happen("open", until=(turn + 1) * 4000)
        far.happen("close")
        client.hub.advance(TICK)
    client.result("pause")
    first = client.last("mode")["first"]
    assert first > 0
    assert client.hub.view.history.branch.size <= 200_000
    assert client.result("seek", n=0) == first
    assert client.last("state")["on"]
