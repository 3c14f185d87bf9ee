from __future__ import annotations

from fsmkit.runtime.system_session import SystemSession
from tests.verify.conftest import Load
from tests.verify.systems import SYSTEMS


def test_runs_a_system_on_the_clock(load: Load) -> None:
    session = SystemSession(load(**SYSTEMS["drive"]))
    session.start()
    assert session.active("driver") == ("idle",)
    assert session.post("driver", "begin")
    session.run(299)
    assert session.active("axis") == ("quickly",)
    happened = session.run(300)
    assert session.now == 300
    assert session.is_in("driver", "done")
    assert session.value("axis", "at_end") is True
    assert {(h.machine, h.macrostep.at) for h in happened} == {("axis", 300), ("driver", 300)}


def test_answers_operations(load: Load) -> None:
    answers = {"driver": {"careful": lambda _: True}}
    session = SystemSession(load(**SYSTEMS["drive"]), answers)
    session.start()
    session.post("driver", "begin")
    session.run(10_000)
    assert session.active("driver") == ("given_up",)
    assert session.value("driver", "tries") == 2


def test_shared_data_are_the_same_everywhere(load: Load) -> None:
    session = SystemSession(load(**SYSTEMS["shared"]))
    session.start()
    assert session.value("w[1]", "seen") == [1, 1, 0]
    assert session.value("looker", "seen") == [1, 0, 0]  # it does not name the second
    assert session.active("w[0]") == ("second",)
    session.run(20)
    assert session.active("w[0]") == ("third",)
    assert [session.value(name, "turn") for name in ("looker", "w[0]", "w[1]")] == [0, 0, 0]
    session.run(60)
    assert session.active("w[1]") == ("third",)
    assert [session.value(name, "load") for name in ("w[0]", "w[1]")] == [1.0, 1.0]


def test_delays_that_are_intervals_are_chosen_by_a_seed(load: Load) -> None:
    def opened(seed: int) -> int:
        session = SystemSession(load(**SYSTEMS["kitchen"]), seed=seed)
        session.start()
        while not session.run(session.now + 1):
            pass
        return session.now

    times = [opened(seed) for seed in range(20)]
    assert times == [opened(seed) for seed in range(20)]
    assert len(set(times)) > 3
    assert all(10 <= time <= 50 for time in times)
