"""The simulated axis of ``axis.c``, integer for integer: same laws, same names, same units."""

from __future__ import annotations

SCALE = 256
TOP_SPEED = 2048
ACCELERATION = 20
FAR_AWAY = -1_000_000


class Axis:
    """A trapezoidal velocity profile towards a target, one step a millisecond."""

    def __init__(self, counts: int) -> None:
        """Stand still at a position, in encoder counts."""
        self.position = counts * SCALE
        self.velocity = 0
        self.target = 0
        self.top_speed = 0
        self.enabled = self.moving = self.seeking = False

    def goto(self, counts: int, percent: int) -> None:
        """Start towards a position at a speed in percent."""
        self.target = counts * SCALE
        self.top_speed = TOP_SPEED * percent // 100
        self.moving, self.seeking = True, False

    def seek(self, percent: int) -> None:
        """Start towards the limit switch, which is at position zero."""
        self.goto(FAR_AWAY, percent)
        self.seeking = True

    def stop(self) -> None:
        """Stand still."""
        self.moving = self.seeking = False
        self.velocity = 0

    def step(self) -> str | None:
        """Advance by a millisecond; return ``arrived`` or ``limit`` when the motion ends."""
        if not self.moving or not self.enabled:
            return None
        if self.seeking and self.position <= 0:
            self.stop()
            self.position = 0
            return "limit"
        sign = -1 if self.target < self.position else 1
        distance = sign * (self.target - self.position)
        speed = sign * self.velocity
        must_brake = speed > 0 and speed * speed >= 2 * ACCELERATION * distance
        speed = min(speed + (-ACCELERATION if must_brake else ACCELERATION), self.top_speed)
        if must_brake and speed < ACCELERATION:
            speed = ACCELERATION
        if speed >= distance:
            self.position = self.target
            self.stop()
            return "arrived"
        self.velocity = sign * speed
        self.position += self.velocity
        return None

    def is_at(self, counts: int) -> bool:
        """Whether the axis is within two counts of a position."""
        return abs(self.position - counts * SCALE) <= 2 * SCALE
