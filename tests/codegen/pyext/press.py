"""A chart with values of every type, a host for it, and a script that runs on any machine of it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

PRESS = """\
chart: Press
doc: Presses things.
types:
  Colour: [red, green, blue]
  Spot: {x: int16, y: int16}
data:
  count: uint8 = 0
  largest: uint64 = 0
  least: int64 = 0
  colour: Colour = Colour.red
  spot: Spot
  last: int16[3] = 0
  label: symbol = "none"
  spare: float32 = 0.25
  pause: duration = 5ms
  weight: 0..500 = 0
  errno: bool = false
inputs: {loaded: bool, level: 0..1000}
outputs: {shown: float64 = 0.5}
operations:
  - goto(position 0..4000, speed 0..100)
  - at_limit() -> bool
  - measure(offset int16) -> 0..500
  - title(of Colour) -> symbol
  - mark(spot Spot, last int16[3])
events:
  in:
    - arrived
    - reset
    - boom
    - wait
    - ask(by 0..10) -> int32
    - is_blue() -> bool
    - paint(colour Colour, label symbol)
    - put(big uint64, small int64, ratio float64, is_it bool)
    - place(spot Spot, last int16[3])
  out:
    - pushed(count uint8)
    - moved(spot Spot, label symbol)
capacity: {queue: 4}
initial: idle
states:
  idle:
    on:
      arrived: {if: loaded, target: pushing}
      ask: {do: reply event.by * 2}
      is_blue: {do: reply colour == Colour.blue}
      paint: {do: colour = event.colour; label = event.label; label = title(colour)}
      put: {do: largest = event.big; least = event.small; shown = event.ratio; errno = event.is_it}
      place:
        do: >-
          spot = event.spot; last = event.last; mark(spot, last);
          send moved(spot = spot, label = label)
      boom: measuring
      wait: waiting
  pushing:
    entry: goto(2800, 100); count += 1
    exit: send pushed(count = count)
    after: {100ms: idle}
    every: {30ms: {if: at_limit(), do: count += 1}}
    on: {reset: done}
  measuring:
    entry: count += 1; weight = measure(-3); log "measured", weight, loaded, last
    on: {reset: idle}
  waiting:
    after: {10ms: measuring}
    on: {reset: idle}
  done: {final: true}
"""

Made = Callable[..., Any]


class Host:
    """Records its calls; its answers can be set, or be an exception."""

    def __init__(self) -> None:
        self.told: list[tuple[Any, ...]] = []
        self.answer: Any = 7
        self.is_at_limit: Any = False

    def goto(self, position: int, speed: int) -> None:
        self.told.append(("goto", position, speed))

    def at_limit(self) -> Any:
        return self.is_at_limit

    def measure(self, offset: int) -> Any:
        self.told.append(("measure", offset))
        if isinstance(self.answer, BaseException):
            raise self.answer
        return self.answer() if callable(self.answer) else self.answer

    def title(self, of: int) -> str:
        return f"colour {of}"

    def mark(self, spot: Any, last: Any) -> None:
        self.told.append(("mark", tuple(spot), tuple(last)))

    def send_pushed(self, count: int) -> None:
        self.told.append(("pushed", count))

    def send_moved(self, spot: Any, label: str) -> None:
        self.told.append(("moved", tuple(spot), label))


def seen(machine: Any) -> tuple[Any, ...]:
    """Return the observable state of a machine."""
    names = ("count", "largest", "least", "colour", "label", "spare", "pause", "weight", "errno")
    more = ("loaded", "level", "shown", "running", "finished", "fault", "reply")
    values = tuple(getattr(machine, name) for name in (*names, *more))
    parts = (tuple(machine.spot), tuple(machine.last))
    return (*values, *parts, machine.active(), machine.next_deadline())


def script(machine: Any, host: Host) -> list[object]:
    """Drive a machine; return everything that it answers."""
    found: list[object] = [seen(machine)]
    machine.log = lambda *values: host.told.append(("log", *values))

    def note(*answers: object) -> None:
        found.append((answers, seen(machine)))

    note(machine.dispatch_arrived(), machine.post_arrived(), machine.run(5))
    machine.start(now=1000)
    note(machine.dispatch_arrived(), machine.dispatch("reset"))
    machine.loaded = True
    machine.level = 1000
    note(machine.post("arrived"), machine.post_reset(), machine.post_boom(), machine.post_wait())
    note(machine.post_wait(), machine.run(1001))
    machine.start(2**32 - 20)
    note(machine.post_arrived(), machine.run(-20))
    host.is_at_limit = True
    note(machine.run(2**32 + 15), machine.is_in("pushing"), machine.is_in("idle"))
    note(machine.run(200), machine.dispatch_ask(3), machine.reply, machine.dispatch_ask(by=10))
    note(machine.dispatch("is_blue"), machine.reply)
    note(machine.dispatch("paint", 2, "new \N{SNOWMAN}"), machine.dispatch_is_blue(), machine.reply)
    note(machine.dispatch_put(2**64 - 1, -(2**63), 1.5, True))
    note(machine.dispatch_put(big=0, small=5, ratio=2, is_it=False))
    note(
        machine.dispatch_place((-32768, 32767), [1, 2, 3]), machine.post("place", (0, 1), (2, 3, 4))
    )
    machine.spot, machine.last, machine.label = [5, 6], [7, 8, 9], "mine"
    machine.pause, machine.spare, machine.colour = 7, 0.5, 1
    note(machine.run(210), machine.dispatch("boom", now=300), machine.dispatch("reset", now=301))
    note(machine.dispatch("wait"), machine.next_deadline(), machine.run(311))
    machine.start()
    note(machine.dispatch_arrived(), machine.dispatch_reset(), machine.post_arrived())
    machine.start(7)
    note(machine.NAME, machine.STATES, machine.EVENTS, machine.OPERATIONS)
    found.append(host.told)
    return found
