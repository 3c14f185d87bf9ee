"""The supervisor alone: what ends an emergency stop, and what it does when nobody answers."""

from __future__ import annotations

from pathlib import Path

import pytest

import fsmkit
from fsmkit import Session

CHART = Path(__file__).parents[2] / "machines/production_cell/supervisor.yaml"
READY = {"homing_1": 2, "homing_2": 3, "homing_3": 1, "homing_4": 2}
"""For how many modules each stage of homing waits."""


@pytest.fixture
def session() -> Session:
    """A supervisor that has given its first permits."""
    session = Session(fsmkit.read_chart(CHART))
    session.advance("500ms")
    assert session.active == ("homing_1",)
    return session


def home(session: Session, until: str = "standing_by") -> None:
    """Let modules get ready, up to a stage."""
    for stage, count in READY.items():
        if stage == until:
            break
        assert session.active == (stage,)
        for _ in range(count):
            session.dispatch("is_ready")
    assert session.active == (until,)


def fault(session: Session) -> object:
    return session.outputs["fault_code"]


def sent(session: Session) -> list[str]:
    return [message.event for message in session.sent]


def test_an_emergency_stop_lasts_until_reset(session: Session) -> None:
    home(session)
    session.dispatch("press_estop")
    assert sent(session)[-1] == "estop"
    session.dispatch("press_reset")  # the relay has not fallen yet
    session.advance("1h")
    assert session.active == ("fallen",)
    assert "reset" not in sent(session)
    session.dispatch("press_reset")
    assert sent(session)[-3:] == ["estop_clear", "reset", "home_1"]
    home(session)


@pytest.mark.parametrize("stage", [*READY, "draining"])
def test_what_does_not_get_ready_is_a_fault(session: Session, stage: str) -> None:
    """Whoever was to answer may have lost the permit, or its board."""
    if stage == "draining":
        home(session)
        session.dispatch("press_start")
        session.dispatch("press_stop")
    else:
        home(session, stage)
    session.advance(9_999)
    assert session.active == (stage,)
    session.advance(1)
    assert session.active == ("faulted",)
    assert fault(session) == "not_ready"
    assert sent(session)[-1] == "pause"


def test_the_first_fault_is_told_until_all_begins_anew(session: Session) -> None:
    home(session)
    session.dispatch("has_fault", code="jam")
    session.dispatch("has_fault", code="lost")
    assert fault(session) == "jam"
    session.dispatch("press_reset")
    assert sent(session)[-2:] == ["pause", "estop"]
    assert fault(session) == "jam"
    session.advance("500ms")
    assert sent(session)[-3:] == ["estop_clear", "reset", "home_1"]
    assert fault(session) == "none"


def test_one_module_too_many_is_no_fault_of_the_supervisor(session: Session) -> None:
    home(session)
    assert session.dispatch("is_ready")
    assert session.active == ("standing_by",)
