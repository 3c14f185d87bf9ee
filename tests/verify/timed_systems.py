"""Random systems with timers, as files: a few states, delays, delayed events and messages each."""

from __future__ import annotations

from random import Random

from hypothesis import HealthCheck, settings
from hypothesis import strategies as st

DELAYS = (0, 40, 80, 120, 200)
"""Milliseconds; multiples of 40, so that time can pass by fractions of their common divisor."""
TOP, NAMES = 2, ("a", "b")


def drawn(examples: int) -> settings:
    """Return the settings of a test that draws so many systems, the same in each run."""
    return settings(
        max_examples=examples,
        deadline=None,
        derandomize=True,
        suppress_health_check=[HealthCheck.too_slow, HealthCheck.filter_too_much],
    )


@st.composite
def machines(draw: st.DrawFn, name: str, *, alone: bool, environment: bool) -> str:
    """Draw a chart: ``go`` comes from outside, ``in0`` and ``in1`` from the other machine.

    That of an ``environment`` has delays that are intervals.
    """
    count = draw(st.integers(2, 3))
    states = [f"s{n}" for n in range(count)]
    lines = [f"chart: {name.upper()}", f"data: {{n: 0..{TOP} = 0}}"]
    lines.append("events: {in: [go, in0, in1], out: [out0, out1], internal: [later]}")
    lines += ["initial: s0", "states:"]
    for state in states:
        lines += [f"  {state}:", f"    rest: {str(draw(st.booleans())).lower()}", "    on:"]
        heard = [e for e in ("go", "in0", "in1", "later") if draw(st.integers(0, 3))] or ["go"]
        lines += [f"      {event}: {draw(_reactions(states, alone))}" for event in heard]
        timeouts = draw(st.lists(st.sampled_from(DELAYS[1:]), max_size=2, unique=True))
        if timeouts:
            lines.append("    after:")
            for ms in timeouts:
                least = draw(st.sampled_from([d for d in DELAYS if d < ms]))
                span = f"{least}ms.." if environment and draw(st.booleans()) else ""
                ends = not span or draw(st.integers(0, 2)) > 0
                greatest = f"{ms}ms" if ends else ""
                lines.append(f"      {span}{greatest}: {draw(_reactions(states, alone))}")
        if draw(st.integers(0, 4)) == 0:
            every = draw(st.sampled_from(DELAYS[1:]))
            lines += ["    every:", f"      {every}ms: {draw(_reactions(states, alone))}"]
    return "\n".join(lines) + "\n"


@st.composite
def _reactions(draw: st.DrawFn, states: list[str], alone: bool) -> str:
    """Draw a transition, with a guard now and then, and what it does."""
    deeds = []
    kinds = ["count", "reset", "later", "later", "cancel", "nothing", "nothing"]
    for kind in draw(
        st.lists(st.sampled_from(kinds + ([] if alone else ["send"] * 3)), max_size=2)
    ):
        match kind:
            case "count":
                deeds.append(f"n = n < {TOP} ? n + 1 : 0")
            case "reset":
                deeds.append("n = 0")
            case "later":
                deeds.append(f"send later after {draw(st.sampled_from(DELAYS))}ms as x")
            case "cancel":
                deeds.append("cancel x")
            case "send":
                deeds.append(f"send out{draw(st.integers(0, 1))}")
            case _:
                pass
    parts = [f"do: '{'; '.join(deeds)}'"] if deeds else []
    if draw(st.integers(0, 4)):
        parts.append(f"target: {draw(st.sampled_from(states))}")
    if draw(st.integers(0, 3)) == 0:
        parts.append(f"if: n < {TOP}")
    return "{" + ", ".join(parts) + "}" if parts else "{do: n = n}"


@st.composite
def systems(draw: st.DrawFn) -> dict[str, str]:
    """Draw a system of one or two machines, and what may happen to them, as files."""
    names = NAMES[: draw(st.integers(1, 2))]
    will = [name for name in names if draw(st.integers(0, 2)) == 0]
    files = {
        name: draw(machines(name, alone=len(names) == 1, environment=name in will))
        for name in names
    }
    wires = [
        f"{one}.out{port} -> {other}.in{draw(st.integers(0, 1))}"
        for one, other in (("a", "b"), ("b", "a"))
        for port in (0, 1)
        if len(names) == 2 and draw(st.integers(0, 3))
    ]
    may = [f"{name}.go" for name in names if draw(st.integers(0, 3))] or [f"{names[0]}.go"]
    system = [
        "system: Random",
        f"machines: {{{', '.join(f'{name}: {name}.yaml' for name in names)}}}",
        f"connect: [{', '.join(dict.fromkeys(wires))}]",
        f"environment: {{may: [{', '.join(may)}], will: [{', '.join(will)}]}}",
        "properties:",
        *(f"  {name}{n}: {{reachable: {name}.n == {n} and {name}.In(s1)}}"
          for name in names for n in range(TOP + 1)),
        "  D: deadlock_free",
        "  L: livelock_free",
    ]  # fmt: skip
    return {"system": "\n".join(system) + "\n", **files}


def drawn_system(seed: int, *, delays_events: bool = False) -> dict[str, str]:
    """Draw a system of some thousands of states: two controllers, and a plant with intervals.

    If it ``delays_events``, several may be pending, of which each has a clock.
    """
    random = Random(seed)
    charts = {name: _drawn_chart(random, name, delays_events) for name in ("a", "b", "plant")}
    wires = [
        f"{one}.out{port} -> {other}.in{random.randrange(2)}"
        for one in charts
        for other in charts
        for port in (0, 1)
        if one != other and random.random() < 0.5
    ]
    goal, other = (f"In(s{random.randrange(4)})" for _ in range(2))
    system = [
        "system: Drawn",
        "machines: {a: a.yaml, b: b.yaml, plant: plant.yaml}",
        f"connect: [{', '.join(wires)}]",
        f"environment: {{may: [a.go], will: [{random.choice(('', 'b.go'))}], world: [plant]}}",
        "properties:",
        f"  r0: {{recoverable: a.{goal}}}",
        f"  r1: {{recoverable: a.{other} and b.{goal}}}",
        f"  l0: {{leads_to: [a.{goal}, b.{other}]}}",
        f"  l1: {{leads_to: [plant.{other}, plant.{goal}]}}",
    ]
    return {"system": "\n".join(system) + "\n", **charts}


def _drawn_chart(random: Random, name: str, delays_events: bool) -> str:
    """Draw a chart of four states with a timer each, two in `a`; in `plant` they are intervals."""

    def reaction() -> str:
        deeds = random.choice(["n = n < 2 ? n + 1 : 0", "send out0", "send out1", "", *later])
        do = f", do: '{deeds}'" if deeds else ""
        return f"{{target: s{random.randrange(4)}{do}}}"

    later = [f"send later after {ms}ms" for ms in (70, 200)] * delays_events
    received = ("go", "in0", "in1") + ("later",) * delays_events
    lines = [f"chart: {name.capitalize()}", "data: {n: 0..2 = 0}", "capacity: {queue: 3}"]
    lines.append("events: {in: [go, in0, in1], out: [out0, out1], internal: [later]}")
    lines += ["initial: s0", "states:"]
    for state in range(4):
        events = [event for event in received if random.random() < 0.6]
        delays = random.sample((70, 110, 200, 450), 1 + (name == "a"))
        spans = [f"{delay}..{3 * delay}ms" if name == "plant" else f"{delay}ms" for delay in delays]
        spans = [span.replace("..", "ms..") for span in spans]
        lines += [f"  s{state}:", "    rest: true"]
        lines += ["    on:"] * bool(events) + [f"      {event}: {reaction()}" for event in events]
        lines += ["    after:"] + [f"      {span}: {reaction()}" for span in spans]
    return "\n".join(lines) + "\n"


HEATER = """
chart: Heater
events: {in: [press, cut], out: [hot]}
initial: "off"
states:
  "off": {rest: true, on: {press: warming}}
  warming: {after: {100ms: nearly}, on: {cut: "off"}}
  nearly: {after: {50ms..80ms: {target: "on", do: send hot}}}
  "on": {after: {40ms: "off"}}
"""

HEATING = """
system: Heating
machines: {heater: heater.yaml}
environment: {may: [heater.press, heater.cut], will: [heater]}
"""

BETWEEN = """
chart: Between
doc: >
  `y` overtakes `x` if `b` comes less than 40 ms after `a`, and `r` overtakes `q` if it comes more
  than 0 ms after it. For both it must come between two multiples of 40 ms.
events: {in: [a, b], internal: [p, q, r, x, y]}
data: {x_seen: bool = false, q_seen: bool = false, y_first: bool = false, r_first: bool = false}
initial: all
states:
  all:
    initial: before
    states:
      before: {rest: true, on: {a: {target: first, do: send x after 80ms; send p after 40ms}}}
      first: {rest: true, on: {b: {target: second, do: send y after 40ms; send q after 80ms}}}
      second: {rest: true}
    on:
      p: {do: send r after 40ms}
      q: {do: q_seen = true}
      r: {do: r_first = not q_seen}
      x: {do: x_seen = true}
      y: {do: y_first = not x_seen}
"""

OVERTAKING = """
system: Overtaking
machines: {between: between.yaml}
environment: {may: [between.a, between.b]}
properties: {both: {reachable: between.y_first and between.r_first}}
"""

FOLLOWED = """
chart: Followed
doc: Two timers that one machine armed 20 ms apart, in an order that the other one chooses.
events: {in: [a, b], internal: [x, y]}
initial: s
states:
  s:
    on:
      a: {do: send x after 80ms}
      b: {do: send y after 40ms}
      x: xx
      y: yy
  xx: {rest: true}
  yy: {rest: true}
"""

SPINS = """
chart: Spins
events: {in: [go, stop], internal: [again]}
initial: still
states:
  still: {rest: true, on: {go: {target: spinning, do: send again after 0ms}}}
  spinning:
    on:
      again: {do: send again after 0ms}
    after: {40ms: still}
"""
