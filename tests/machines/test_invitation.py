"""The feeder belt invites the operator to lay a block, and lends the slot in turn."""

from __future__ import annotations

from pathlib import Path

import fsmkit
from fsmkit import Session

CELL = Path(__file__).parents[2] / "machines/production_cell"
INVITATION = 1500
"""In ms."""


class Belt:
    """The feeder belt in production, and how operator, rotator and feeder use it."""

    def __init__(self) -> None:
        chart = fsmkit.read_chart(CELL / "feeder_belt.yaml")
        nothing = {operation.name: lambda *_: None for operation in chart.operations}
        self.session = Session(chart, nothing)
        for event in ("power_ok", "home_permit", "limit"):
            self.session.dispatch(event)
        self.session.advance(500)
        self.session.dispatch("start")

    @property
    def state(self) -> str:
        """The one that it is in."""
        (active,) = self.session.active
        return active

    @property
    def lamp(self) -> bool:
        """Whether the operator may lay a block."""
        return bool(self.session.outputs["lamp"])

    def sees(self, **inputs: object) -> None:
        """Change what sensors say."""
        self.session.inputs.update(inputs)
        self.session.run()

    def index(self) -> None:
        """Carry the block at the entry to the pocket; the feeder takes it from there at once."""
        self.sees(entry_occupied=True)
        self.session.dispatch("pocket_free")
        assert self.state == "indexing"
        self.sees(at="far", entry_occupied=False, pocket_occupied=True)
        self.session.dispatch("arrived")
        self.sees(at="home", pocket_occupied=False)


def test_the_operator_has_time_though_the_rotator_asks() -> None:
    belt = Belt()
    assert (belt.state, belt.lamp) == ("idle", True)
    belt.index()
    belt.session.dispatch("request")
    assert (belt.state, belt.lamp) == ("inviting", True)
    belt.session.advance(INVITATION - 1)
    assert (belt.state, belt.lamp) == ("inviting", True)
    belt.session.advance(1)
    assert (belt.state, belt.lamp) == ("granting", False)


def test_a_block_ends_the_invitation_and_the_rotator_is_next() -> None:
    belt = Belt()
    belt.index()
    belt.session.dispatch("request")
    belt.sees(entry_occupied=True)
    assert (belt.state, belt.lamp) == ("idle", False)
    belt.index()
    assert (belt.state, belt.lamp) == ("granting", False)
    belt.sees(entry_occupied=True)
    belt.session.dispatch("placed")
    belt.index()
    assert (belt.state, belt.lamp) == ("inviting", True)


def test_no_block_is_invited_into_a_full_ring_before_one_was_rejected() -> None:
    belt = Belt()
    for _ in range(7):
        belt.index()
    assert (belt.session.data["in_ring"], belt.state) == (7, "idle")
    belt.session.dispatch("request")
    assert (belt.state, belt.lamp) == ("granting", False)
    belt.sees(entry_occupied=True)
    belt.session.dispatch("placed")
    belt.session.dispatch("rejected")
    belt.index()
    assert (belt.session.data["in_ring"], belt.state) == (6, "inviting")


def test_what_the_rotator_lays_is_not_counted_twice() -> None:
    belt = Belt()
    belt.index()
    belt.session.advance(INVITATION)
    belt.session.dispatch("request")
    assert belt.state == "granting"
    belt.sees(entry_occupied=True)
    belt.session.dispatch("placed")
    assert belt.session.data["in_ring"] == 1


def test_a_pause_begins_the_invitation_anew() -> None:
    belt = Belt()
    belt.index()
    belt.session.advance(INVITATION - 1)
    belt.session.dispatch("pause")
    assert not belt.lamp
    belt.session.dispatch("resume")
    assert (belt.state, belt.lamp) == ("inviting", True)
    belt.session.advance(INVITATION)
    assert belt.state == "idle"
