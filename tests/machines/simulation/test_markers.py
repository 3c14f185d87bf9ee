"""ArUco markers on rendered pictures, read by OpenCV."""

from __future__ import annotations

import importlib.util

import numpy as np
import pytest

from machines.production_cell.simulation import markers
from tests.needs import need

pytestmark = pytest.mark.external


@pytest.fixture(autouse=True)
def opencv() -> None:
    need(importlib.util.find_spec("cv2") is not None, "opencv-python-headless")


@pytest.mark.slow
@pytest.mark.parametrize("position", [-200, 0, 130])
def test_blocks_are_read_off_noisy_pictures(position: int) -> None:
    detect = markers.detector(1)
    assert [detect(block, position) for block in range(1, 20)] == list(range(1, 20))


def test_a_block_out_of_the_picture_is_not_found() -> None:
    assert markers.detector(1)(7, 4000) == 0


def test_pictures_differ_by_their_noise_alone() -> None:
    one, other = (markers.render(7, 0, np.random.default_rng(seed)) for seed in (1, 2))
    assert (one != other).any()
    assert np.abs(one.astype(int) - other.astype(int)).max() < 12 * markers.NOISE


def test_pictures_that_take_too_long_are_left_out_and_counted() -> None:
    times = iter([0.0, 0.010, 1.0, 1.040, 2.0, 2.001])
    bounded = markers.Bounded(lambda block, _: block, lambda: next(times))
    assert [bounded(block, 0) for block in range(1, 6)] == [1, 2, 0, 0, 5]
    assert bounded.skipped == 2
