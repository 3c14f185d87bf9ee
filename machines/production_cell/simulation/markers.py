"""Reads the number of a block off a picture of it: ArUco markers, rendered and found by OpenCV.

An extra: without the package opencv-python-headless (the extra `camera`) blocks are seen for what
they are.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import lru_cache

import numpy as np
import numpy.typing as npt

from .camera import Detector

MARKERS = 1000
"""Different markers; numbers of blocks begin anew after so many."""
SIDE, WIDTH, HEIGHT = 48, 160, 120
"""The sizes of a marker and of a picture, in pixels."""
PIXEL = 5
"""The length of a pixel, in 0.1 mm."""
NOISE = 12.0
"""The noise of a pixel, in shades of 256."""
LONGEST = 0.015
"""A picture may take so long, in s, in a run that follows a clock."""
Picture = npt.NDArray[np.uint8]


@lru_cache(maxsize=MARKERS)
def _marker(number: int) -> Picture:
    import cv2

    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_5X5_1000)
    return np.asarray(cv2.aruco.generateImageMarker(dictionary, number, SIDE), np.uint8)


def render(block: int, position: int, chance: np.random.Generator) -> Picture:
    """Return the picture of a block that lies so far from the middle, in 0.1 mm."""
    picture = np.full((HEIGHT, WIDTH), 200.0)
    left = (WIDTH - SIDE) // 2 + position // PIXEL
    top = (HEIGHT - SIDE) // 2
    if 0 <= left <= WIDTH - SIDE:
        picture[top : top + SIDE, left : left + SIDE] = _marker(block % MARKERS)
    noisy = picture + chance.normal(0.0, NOISE, picture.shape)
    return np.clip(noisy, 0, 255).astype(np.uint8)


def detector(seed: int) -> Detector:
    """Return what reads blocks off noisy pictures. Raises ImportError without OpenCV."""
    import cv2

    chance = np.random.default_rng(seed)
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_5X5_1000)
    reader = cv2.aruco.ArucoDetector(dictionary)

    def detect(block: int, position: int) -> int:
        _, found, _ = reader.detectMarkers(render(block, position, chance))
        numbers = [] if found is None else np.ravel(found).tolist()
        return int(numbers[0]) if len(numbers) == 1 else 0

    return detect


class Bounded:
    """A detector that skips a picture for each `LONGEST` by which the previous one was too slow.

    So the run keeps to its clock; a skipped picture has no result. ``skipped``: their number.
    """

    def __init__(self, detect: Detector, clock: Callable[[], float] = time.perf_counter) -> None:
        self._detect, self._clock = detect, clock
        self._over = 0.0
        self.skipped = 0

    def __call__(self, block: int, position: int) -> int:
        """Return the number of the block, 0 if it was not found or not looked for."""
        if self._over > 0:
            self._over -= LONGEST
            self.skipped += 1
            return 0
        begin = self._clock()
        found = self._detect(block, position)
        self._over = self._clock() - begin - LONGEST
        return found
