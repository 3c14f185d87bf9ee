"""Small systems with known verdicts, shared by the tests of reader, oracle and engine."""

from __future__ import annotations

PING = """
chart: Ping
events: {in: [pong, go], out: [ping]}
initial: idle
states:
  idle: {rest: true, on: {go: {target: busy, do: send ping}}}
  busy: {on: {pong: {do: send ping}}}
"""

PONG = """
chart: Pong
events: {in: [ping], out: [pong]}
initial: here
states:
  here: {rest: true, on: {ping: {do: send pong}}}
"""

LIVELOCK = """
system: Rally
machines: {ping: ping.yaml, pong: pong.yaml}
connect: [ping.ping -> pong.ping, pong.pong -> ping.pong]
environment: {may: [ping.go]}
"""

LEFT = """
chart: Left
events: {in: [ready], out: [done]}
initial: waiting
states:
  waiting: {on: {ready: {target: over, do: send done}}}
  over: {rest: true}
"""

RIGHT = """
chart: Right
events: {in: [done], out: [ready]}
initial: waiting
states:
  waiting: {on: {done: {target: over, do: send ready}}}
  over: {rest: true}
"""

DEADLOCK = """
system: Stuck
machines: {left: left.yaml, right: right.yaml}
connect: [right.ready -> left.ready, left.done -> right.done]
properties:
  D: deadlock_free
  over: {reachable: left.In(over)}
"""

AXIS = """
chart: Axis
doc: Moves for 300 ms, or 500 ms when it is slow; sometimes it jams.
outputs: {at_end: bool = false}
events: {in: [move(slow bool), stop], out: [arrived]}
initial: still
states:
  still:
    rest: true
    on:
      move:
        - {if: event.slow, target: slowly, do: at_end = false}
        - {target: quickly, do: at_end = false}
  quickly:
    on: {stop: still}
    after: {300ms: {target: still, do: at_end = true; send arrived}}
    sometimes: {target: jammed}
  slowly:
    on: {stop: still}
    after: {500ms: {target: still, do: at_end = true; send arrived}}
  jammed: {rest: true, on: {stop: still}}
"""

DRIVER = """
chart: Driver
inputs: {there: bool}
data: {tries: 0..2 = 0, in_time: bool = true}
operations: [move(slow bool), careful() -> bool, stop()]
events: {in: [arrived, begin, pause]}
initial: idle
states:
  idle:
    rest: true
    on: {begin: moving}
  moving:
    entry: |
      if careful() { move(true) } else { move(false) }
    on:
      pause: {target: idle, do: stop()}
    always: {if: there, target: done}
    after:
      400ms: {target: again, watchdog: true}
  again:
    entry: stop()
    always:
      - {if: tries < 2, target: moving, do: tries += 1}
      - {target: given_up}
  given_up: {rest: true}
  done:
    rest: true
    on: {begin: {if: tries < 2, target: moving, do: tries = 0}}
"""

DRIVE = """
system: Drive
machines: {driver: driver.yaml, axis: axis.yaml}
connect:
  - driver.move -> axis.move
  - driver.stop -> axis.stop
  - axis.arrived -> driver.arrived
  - axis.at_end -> driver.there
environment: {may: [driver.begin, driver.pause], will: [axis]}
properties:
  tries: {invariant: driver.tries <= 2}
  never_twice: {never: driver.tries == 2}
  done: {reachable: driver.In(done) and axis.at_end}
  D: deadlock_free
"""

SYSTEMS: dict[str, dict[str, str]] = {
    "livelock": {"rally": LIVELOCK, "ping": PING, "pong": PONG},
    "deadlock": {"stuck": DEADLOCK, "left": LEFT, "right": RIGHT},
    "drive": {"drive": DRIVE, "driver": DRIVER, "axis": AXIS},
}
