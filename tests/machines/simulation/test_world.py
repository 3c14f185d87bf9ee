"""What surrounds the plant: operator, camera, schedules of faults."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from machines.production_cell.simulation import camera, faults, panel
from machines.production_cell.simulation.camera import (
    BAD,
    GOOD,
    UNKNOWN,
    CameraState,
    Estimate,
    Judgement,
)
from machines.production_cell.simulation.faults import Action, FaultError, Trigger
from machines.production_cell.simulation.panel import Operator, OperatorState
from machines.production_cell.simulation.signals import BUTTONS

# --- operator -------------------------------------------------------------------------------------


def work(
    rule: Operator,
    milliseconds: int,
    lamp: int = 0,
    blocks: int = 0,
    supervisor: str = "producing",
    estop: Callable[[int], bool] = lambda _: False,
) -> tuple[list[int], list[tuple[int, str]]]:
    """The times at which blocks were laid down, and buttons pressed."""
    state = OperatorState()
    laid: list[int] = []
    pressed: list[tuple[int, str]] = []
    held: tuple[int, ...] = ()
    for now in range(1, milliseconds + 1):
        seen = {"lamp": lamp, "blocks": blocks + len(laid), "estop": int(estop(now))}
        state, block = panel.step(rule, state, now, seen, supervisor)
        if block:
            laid.append(now)
        levels = panel.buttons(state)
        if levels != held and any(levels):
            pressed.append((now, BUTTONS[levels.index(1)]))
        held = levels
    return laid, pressed


def test_blocks_are_laid_down_only_while_the_lamp_is_on_and_up_to_so_many() -> None:
    rule = Operator(blocks=3)
    assert work(rule, 5000, lamp=0)[0] == []
    laid, _ = work(rule, 5000, lamp=1)
    assert len(laid) == 3
    assert laid[0] >= rule.reaction
    assert work(rule, 5000, lamp=1, blocks=3)[0] == []


@pytest.mark.parametrize(
    ("supervisor", "button", "after"),
    [
        ("standing_by", "start", 500),
        ("faulted", "reset", 3000),
        ("fallen", "reset", 3000),
        ("interrupted", "resume", 2000),
    ],
)
def test_what_the_rules_demand(supervisor: str, button: str, after: int) -> None:
    _, pressed = work(Operator(), after + 50, supervisor=supervisor)
    assert pressed == [(after + 1, button)]
    assert work(Operator(), after - 50, supervisor=supervisor)[1] == []


def test_the_emergency_chain_is_closed_and_then_reset() -> None:
    rule = Operator(release_after=1000)
    pressed = work(rule, 2900, supervisor="fallen", estop=lambda now: 500 <= now < 1500)[1]
    assert pressed == [(2500, "reset")]


def test_a_script_presses_buttons_at_its_times() -> None:
    rule = Operator(script=((100, "pause"), (400, "stop")))
    assert work(rule, 1000)[1] == [(100, "pause"), (400, "stop")]


# --- camera ---------------------------------------------------------------------------------------


def test_verdicts_depend_on_seed_block_and_pass_alone() -> None:
    rule = Judgement(seed=5, bad=0.3, unreadable=0.1)
    table = [[rule.verdict(block, passed) for passed in range(200)] for block in range(5)]
    assert table == [[rule.verdict(block, passed) for passed in range(200)] for block in range(5)]
    flat = [verdict for line in table for verdict in line]
    assert 0.25 < flat.count(BAD) / len(flat) < 0.35
    assert 0.06 < flat.count(UNKNOWN) / len(flat) < 0.14
    other = Judgement(seed=6, bad=0.3, unreadable=0.1)
    assert [other.verdict(0, n) for n in range(200)] != table[0]


def test_a_verdict_takes_its_time_and_goes_with_the_block() -> None:
    rule, state = Judgement(bad=0.0, unreadable=0.0), CameraState()
    verdicts = []
    for now in range(33, 330, 33):
        state = camera.picture(rule, state, now, (7, 0), 0)
        verdicts.append(state.verdict)
    assert verdicts[:4] == [0, 0, 0, 0]
    assert verdicts[4:] == [GOOD] * 5
    assert camera.picture(rule, state, 400, (0, 0), 0).verdict == 0


def test_a_block_that_comes_round_again_is_judged_anew() -> None:
    state = CameraState()
    for view in ((7, 0), (0, 0), (7, 0)):
        state = camera.picture(Judgement(), state, 33, view, 0)
    assert state.passed == ((7, 2),)


def test_where_a_block_is_that_went_out_of_view() -> None:
    rule = Judgement(bad=1.0, latency=0)
    state = camera.picture(rule, CameraState(), 33, (7, 4), 5000)
    assert camera.at_sorter(state.sightings, 5000) == Estimate()
    found = camera.at_sorter(state.sightings, 5996)
    assert (found.block, found.is_sighted, found.is_reject) == (7, True, True)
    assert camera.at_sorter(state.sightings, 6996) == Estimate()
    assert camera.at_sorter(state.sightings, 5996, drift=0.3) == Estimate()
    later = camera.picture(rule, state, 66, (8, 0), 7000)
    assert [s.block for s in later.sightings] == [8]


# --- faults ---------------------------------------------------------------------------------------


def test_each_fault_by_name_has_its_actions() -> None:
    assert faults.read("") == ()
    (jam,) = faults.read("jam")
    assert jam.trigger == Trigger(0, "feeder", "pushing", 1, 20)
    assert jam.actions == (
        Action(0, "plant", "jam.feeder", 1),
        Action(5000, "plant", "jam.feeder", 0),
    )
    (kill,) = faults.read("kill")
    assert kill.trigger == Trigger(60_000)
    assert kill.actions == (Action(0, "kill", "b"), Action(3000, "restart", "b"))
    (loss,) = faults.read("loss")
    assert loss.actions == (Action(0, "boards", "link.loss", 0.1),)
    for name in faults.DEFAULTS:
        assert faults.read(name)


def test_a_file_of_faults(tmp_path: Path) -> None:
    path = tmp_path / "faults.yaml"
    path.write_text("- {at: 2, fault: estop, for: 1}\n- {at: 1, fault: lost_block, slot: m}\n")
    estop, lost = faults.read(str(path))
    assert estop.trigger == Trigger(2000)
    assert estop.actions == (Action(0, "estop", "", 1), Action(1000, "estop", "", 0))
    assert lost.trigger == Trigger(1000, slot="m")
    assert lost.actions == (Action(0, "plant", "take.m", 1),)


def test_a_fault_waits_for_the_second_time_that_a_state_is_entered(tmp_path: Path) -> None:
    path = tmp_path / "faults.yaml"
    path.write_text(
        "- {when: feeder.state == pushing, nth: 2, after: 20ms, fault: jam, for: 500ms}\n"
        "- {at: 3, when: ' rotator.state==idle ', after: 0.5, fault: estop}\n"
    )
    jam, estop = faults.read(str(path))
    assert jam.trigger == Trigger(0, "feeder", "pushing", 2, 20)
    assert [action.step for action in jam.actions] == [0, 500]
    assert estop.trigger == Trigger(3000, "rotator", "idle", 1, 500)


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("[{fault: jamb}]", "is no fault"),
        ("[{fault: jam, axis: elbow}]", "no axis `elbow`"),
        ("[{fault: jam, slot: m}]", "no field `slot`"),
        ("[{fault: loss, share: much}]", "could not convert"),
        ("fault: jam", "a list of faults"),
        ("[{fault: [jam]}]", "is no fault"),
        ("[{fault: jam, when: feeder}]", "is not of the form"),
        ("[{fault: jam, when: [1]}]", "is not of the form"),
        ("[{fault: jam, when: elbow.state == up}]", "no machine `elbow`"),
        ("[{fault: jam, nth: 2}]", "beside `when`"),
        ("[{fault: jam, when: feeder.state == idle, nth: 0}]", "1 or more"),
        ("[{fault: jam, at: -1}]", "is no time"),
        ("[{fault: jam, for: .nan}]", "is no time"),
        ("[{fault: jam, after: soon}]", "could not convert"),
        ("[{fault: jam, after: [1]}]", "is no time"),
        ("[", "while parsing"),
    ],
)
def test_what_is_no_schedule_is_told_of(tmp_path: Path, text: str, told: str) -> None:
    path = tmp_path / "faults.yaml"
    path.write_text(text)
    with pytest.raises(FaultError, match=told):
        faults.read(str(path))


def test_an_unknown_fault_names_those_there_are() -> None:
    with pytest.raises(FaultError, match="jam, lost_block"):
        faults.read("flood")


def test_a_fault_that_cannot_occur_in_the_run_is_rejected(tmp_path: Path) -> None:
    faults.check_times(faults.read("estop"), 60_001)
    faults.check_times(faults.read("jam"), 21)  # its state may be entered at once
    with pytest.raises(FaultError, match="`estop` occurs after 60 s, but the run ends after 30 s"):
        faults.check_times(faults.read("estop"), 30_000)
    path = tmp_path / "faults.yaml"
    path.write_text("- {fault: jam, when: feeder.state == pushing, at: 2, after: 500ms}\n")
    with pytest.raises(FaultError, match=r"`jam feeder` occurs after 2\.5 s"):
        faults.check_times(faults.read(str(path)), 2500)
