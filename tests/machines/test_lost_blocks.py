"""A block that goes where no module takes it is missed by the module that had seen it."""

from __future__ import annotations

from pathlib import Path

import fsmkit
from fsmkit import Session

CELL = Path(__file__).parents[2] / "machines/production_cell"


def working(machine: str, **inputs: object) -> Session:
    """Return a belt or the sorter, homed and started, with such inputs."""
    chart = fsmkit.read_chart(CELL / f"{machine}.yaml")
    nothing = {operation.name: lambda *_: None for operation in chart.operations}
    session = Session(chart, nothing, inputs=inputs)
    for event in ("power_ok", "home_permit", "limit"):
        session.dispatch(event)
    session.advance("500ms")
    assert session.active == ("ready",)
    session.dispatch("start")
    return session


def sees(session: Session, **inputs: object) -> None:
    session.inputs.update(inputs)
    session.run()


def misses(session: Session) -> bool:
    return session.active == ("error",) and session.data["fault_code"] == "lost"


def arrive(session: Session, **inputs: object) -> None:
    """Let the belt come to the next slot."""
    sees(session, at="far", **inputs)
    session.dispatch("arrived")


def test_a_block_taken_from_the_entry_of_the_feeder_belt_is_missed() -> None:
    session = working("feeder_belt")
    sees(session, entry_occupied=True)
    assert session.active == ("idle",)
    sees(session, entry_occupied=False)
    assert misses(session)


def test_a_block_that_the_belt_carries_off_is_not_missed() -> None:
    session = working("feeder_belt")
    session.dispatch("pocket_free")
    sees(session, entry_occupied=True)
    assert session.active == ("indexing",)
    sees(session, entry_occupied=False)
    arrive(session, pocket_occupied=True)
    assert session.active == ("inviting",)


def test_who_takes_away_a_block_before_the_start_takes_nothing_that_is_missed() -> None:
    session = working("feeder_belt", entry_occupied=True)
    session.dispatch("stop")
    sees(session, at="home", entry_occupied=False)
    session.dispatch("start")
    assert not misses(session)


def test_blocks_on_the_extraction_belt_are_missed_where_they_were() -> None:
    for slot in ("entry", "middle"):
        # the last slot is lent, so that the belt stands still
        session = working("extraction_belt", exit_occupied=True, **{f"{slot}_occupied": True})
        assert session.active == ("idle",)
        sees(session, **{f"{slot}_occupied": False})
        assert misses(session), slot


def test_a_block_that_does_not_come_to_the_middle_is_missed() -> None:
    for comes in (True, False):
        session = working("extraction_belt", entry_occupied=True)
        assert session.active == ("indexing",)
        arrive(session, entry_occupied=False, middle_occupied=comes)
        assert misses(session) is not comes
        assert session.active == (("checking",) if comes else ("error",))


def test_a_block_that_the_sorter_throws_out_is_not_missed() -> None:
    session = working("extraction_belt", middle_occupied=True)
    assert session.active == ("checking",)
    sees(session, middle_occupied=False)
    session.dispatch("sort_clear")
    assert session.active == ("idle",)


def test_the_sorter_misses_a_block_that_it_is_to_judge() -> None:
    for there in (True, False):
        session = working("sorter", slot_occupied=False, retracted=True)
        sees(session, slot_occupied=there)
        session.dispatch("sort_check")
        assert misses(session) is not there
