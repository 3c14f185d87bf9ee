from __future__ import annotations

from fsmkit.verify.system_session import SystemSession
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
