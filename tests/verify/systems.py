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

NODE = """
chart: Node
constants: {FIRST: false, AT: 0, T_HOLD: 10ms}
outputs: {at: 0..9 = 0}
inputs: {before: 0..9}
events: {in: [token, ask], out: [token_on]}
initial: begins
states:
  begins:
    choice:
      - {if: FIRST, target: holds, do: at = AT}
      - {target: waits, do: at = AT}
  waits: {rest: true, on: {token: holds}}
  holds:
    rest: true
    on: {ask: {if: before < 9, target: leaves}}
  leaves: {after: {T_HOLD: {target: waits, do: send token_on}}}
"""

RING = """
system: Ring
machines:
  "node[i in 0..2]":
    chart: node.yaml
    with: {FIRST: i == 1, AT: i, T_HOLD: 10ms + 5ms * i}
connect:
  - node[i].token_on -> node[(i + 1) % 3].token
  - node[i].at -> node[(i+1)%3].before
environment: {may: ["node[i].ask"]}
properties:
  one: {invariant: "count(i in node: node[i].In(holds) or node[i].In(leaves)) <= 1"}
  never_two: {never: "any(i in 0..2: any(j in node: i < j and node[i].In(holds) and node[j].In(holds)))"}
  numbered: {invariant: "all(i in 0..2: node[i].In(begins) or node[(i+1)%3].before == i)"}
  last: {reachable: "node[2].In(holds) and node[1 + 1].at == 2"}
  D: deadlock_free
"""  # noqa: E501

WRITER = """
chart: Writer
types: {Mode: [off, on]}
constants: {MINE: 0, OTHER: 1}
data: {turn: 0..2 = 2, mode: Mode = off, seen: "int8[3] = 0", load: float64 = 0.5, own: 0..3 = 0}
events: {in: [go]}
initial: first
states:
  first:
    entry: turn = MINE; seen[turn] += 1
    always: {if: turn == OTHER, target: second}
    on: {go: {if: own < 2, do: turn = (turn + 1) % 3; own += 1; mode = Mode.on}}
  second:
    entry: load = 1.5 - load; mode = Mode.off
    after: {20ms: {target: third, do: turn = MINE}}
  third:
    rest: true
    sometimes: {if: mode == Mode.on and load > 1, target: first}
"""

LOOKER = """
chart: Looker
data: {turn: 0..2 = 0, seen: "int8[3] = 0"}
initial: idle
states:
  idle:
    rest: true
    always:
      - {if: "seen[0] > 1", target: alarm}
      - {if: turn == 2, target: notes}
  notes:
    rest: true
    entry: seen[2] = 1
    always: {if: turn != 2, target: idle}
  alarm: {final: true}
"""

SHARED = """
system: Shared
machines:
  looker: looker.yaml
  "w[i in 0..1]": {chart: writer.yaml, with: {MINE: i, OTHER: 1 - i}}
shared: {turn: 0..2 = 1, mode: Mode = on, seen: "int8[3] = [0, 0, 0]", load: float64 = 1}
environment: {may: ["w[i].go"]}
properties:
  both: {never: "w[0].In(second) and w[1].In(second)"}
  turn: {reachable: turn == 2 and mode == Mode.on}
  same: {invariant: "w[0].turn == w[1].turn and w[1].turn == looker.turn"}
  noted: {reachable: "seen[2] == 1 and seen[0] == 2"}
  D: deadlock_free
"""

PLANT = """
chart: Plant
outputs: {warm: bool = false}
events: {in: [heat], out: [ready, cold]}
initial: work
states:
  work:
    regions:
      heater:
        initial: off_
        states:
          off_: {rest: true, on: {heat: heating}}
          heating:
            after:
              20ms..40ms: {target: off_, do: warm = true; send ready}
              30ms: {if: warm, target: off_, do: send cold}
      door:
        initial: shut
        states:
          shut: {after: {10ms..50ms: open_}}
          open_: {after: {0ms..20ms: {if: not warm, target: shut}}}
"""

COOK = """
chart: Cook
inputs: {warm: bool}
events: {in: [ready, cold], out: [heat]}
initial: waits
states:
  waits: {after: {50ms: {target: hopes, do: send heat}}}
  hopes:
    on: {ready: eats, cold: waits}
    after: {40ms: gone}
  eats: {rest: true, always: {if: not warm, target: gone}}
  gone: {rest: true}
"""

KITCHEN = """
system: Kitchen
machines: {cook: cook.yaml, plant: plant.yaml}
connect: [cook.heat -> plant.heat, plant.ready -> cook.ready, plant.cold -> cook.cold,
          plant.warm -> cook.warm]
environment: {will: [plant]}
properties:
  eaten: {reachable: cook.In(eats)}
  gone: {reachable: cook.In(gone)}
  open: {never: plant.In(open_) and plant.warm}
"""

SOURCE = """
chart: Source
types: {Kind: [first, last]}
events: {in: [answer], out: ["job(n 0..3, kind Kind)"]}
data: {n: 0..3 = 0, answers: 0..9 = 0}
initial: sends
states:
  sends:
    every:
      10ms:
        if: n < 3
        do: n += 1; send job(n = n, kind = Kind.first if n < 3 else Kind.last)
    on: {answer: {do: answers += 1}}
"""

SINK = """
chart: Sink
types: {Kind: [first, last]}
events: {in: ["job(kind Kind, n 0..3)"], out: [answer]}
data: {seen: 0..3 = 0, sum: 0..9 = 0, late: 0..9 = 0}
initial: works
states:
  works:
    rest: true
    on:
      job:
        - {if: event.kind == Kind.last, target: ends, do: "sum += event.n; send answer"}
        - {do: "seen += 1; sum += event.n; send answer"}
    every: {15ms: {if: late < 3, do: late += 1}}
  ends: {rest: true}
"""

POST = """
system: Post
machines: {source: source.yaml, sink: sink.yaml}
connect:
  - source.job -> sink.job: {kind: lossy, capacity: 2, delay: 15ms}
  - sink.answer -> source.answer: {kind: queued, capacity: 1}
properties:
  all: {reachable: sink.sum == 6}
  one_lost: {reachable: sink.In(ends) and sink.sum == 4}
  last_lost: {reachable: source.n == 3 and sink.sum == 3 and sink.late == 3}
  two_lost: {invariant: not (sink.In(ends) and sink.sum == 3)}
  in_order: {invariant: sink.seen <= source.n}
"""

LOSING = POST.replace(", capacity: 2, delay: 15ms", ", loss: 2").replace("Post", "Losing")

DOOR = """
chart: Door
types: {Light: [red, amber, green]}
inputs: {blocked: bool, temp: -400..1000, light: Light}
outputs: {hot: bool = false}
data: {seen: "-400..1000 = 0"}
events: {in: [go], out: [arrived]}
capacity: {queue: 2}
initial: shut
states:
  shut:
    rest: true
    on: {go: [{if: not blocked and light == Light.green, target: moving}, {do: send arrived}]}
  moving:
    entry: seen = temp
    after: {20ms: {target: open, do: send arrived}}
    always: {if: blocked, target: shut, do: send arrived}
  open: {rest: true, always: {if: temp > 800, target: shut, do: hot = true}}
"""

GUEST = """
chart: Guest
events: {in: [arrived], out: [go]}
initial: waiting
states:
  waiting: {rest: true, after: {30ms: {target: asking, do: send go}}}
  asking: {on: {arrived: waiting}}
"""

FREE = """
system: Free
machines: {door: door.yaml, guest: guest.yaml}
connect: [guest.go -> door.go, door.arrived -> guest.arrived]
environment: {may: [door.blocked, door.temp, "door.light in {red, green}"]}
properties:
  cool: {never: door.hot}
  odd: {never: "door.seen == 777"}
  warm: {never: "door.In(open) and door.seen < -399 and door.hot"}
  lit: {never: door.light == Light.amber}
"""

SYSTEMS: dict[str, dict[str, str]] = {
    "livelock": {"rally": LIVELOCK, "ping": PING, "pong": PONG},
    "deadlock": {"stuck": DEADLOCK, "left": LEFT, "right": RIGHT},
    "shared": {"shared": SHARED, "looker": LOOKER, "writer": WRITER},
    "kitchen": {"kitchen": KITCHEN, "cook": COOK, "plant": PLANT},
    "post": {"post": POST, "source": SOURCE, "sink": SINK},
    "losing": {"losing": LOSING, "source": SOURCE, "sink": SINK},
    "ring": {"ring": RING, "node": NODE},
    "drive": {"drive": DRIVE, "driver": DRIVER, "axis": AXIS},
    "free": {"free": FREE, "door": DOOR, "guest": GUEST},
}
