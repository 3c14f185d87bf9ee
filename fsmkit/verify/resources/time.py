"""The models of time of an exploration."""

from __future__ import annotations

from typing import Literal, get_args

Time = Literal["zones", "discrete", "untimed"]
TIMES: tuple[Time, ...] = get_args(Time)
"""Dense; by the greatest common divisor of all delays; an armed timer may fire at any time."""
