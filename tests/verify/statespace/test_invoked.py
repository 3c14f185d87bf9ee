"""Charts that invoke others, explored with what they invoke: both engines find the same."""

from __future__ import annotations

import pytest

from fsmkit.diagnostics import Findings
from fsmkit.verify.explore import ExplorationOptions, check
from tests.verify.conftest import Load
from tests.verify.engines.test_engines import both

pytestmark = [pytest.mark.cc, pytest.mark.usefixtures("own_cache", "quickly_compiled")]


ONE = """
chart: One
capacity: {queue: 2}
data: {n: 0..1 = 0}
events: {in: [go, back, poke]}
initial: idle
states:
  idle: {on: {go: work}}
  work:
    invoke:
      id: kid
      autoforward: true
      with: {left: n}
      finalize: n = event.k
      content:
        chart: Kid
        capacity: {delayed: 1}
        data: {left: 0..1 = 0}
        operations: ['ask() -> bool']
        events: {in: [poke], out: [up(k 0..1), told]}
        initial: a
        states:
          a:
            after: {20ms: b}
            on:
              poke:
                do: 'if ask() {left = 1}; send up(k = left) to "#_parent" after 10ms; send told'
          b: {after: {20ms: over}, on: {poke: a}}
          over: {final: true, done: {with: {k: left}}}
    on: {back: idle, done.invoke.kid: idle, up: {if: n == 1, target: idle}}
    after: {50ms: idle}
"""
DEFERS = """
chart: Defers
events: {in: [go, poke]}
initial: idle
states:
  idle: {on: {go: work}}
  work:
    invoke: {id: kid, content: KID}
    on: {poke: {do: 'send poke to "#_kid"'}, go: {do: 'send go to "#_kid"'}, up: idle}
""".replace(
    "KID",
    "{chart: Kid, capacity: {queue: 2}, events: {in: [poke, go], out: [up]}, initial: a, states:"
    " {a: {defer: poke, on: {go: b}},"
    " b: {on: {poke: {target: a, do: 'send up to \"#_parent\"'}}}}}",
)
DEEP = """
chart: Deep
events: {in: [go, stop]}
initial: idle
states:
  idle: {on: {go: work}}
  work:
    invoke: {id: mid, content: MID}
    on: {stop: idle, up: idle}
    every: {20ms: {}}
""".replace(
    "MID",
    "{chart: Mid, events: {out: [up]}, initial: a, states: {a: {invoke: {id: low, content: LOW},"
    " after: {30ms: b}, on: {rise: b}}, b: {after: {10ms: {do: 'send up to \"#_parent\"'}}}}}",
).replace(
    "LOW",
    "{chart: Low, events: {out: [rise]}, initial: x, states: {x: {after: {10ms: {target: y,"
    " do: 'send rise to \"#_parent\" after 20ms'}}}, y: {}}}",
)  # fmt: skip
TWO = """
chart: Two
events: {in: [go, left, right], out: [ping]}
initial: idle
states:
  idle: {on: {go: work}}
  work:
    regions:
      first:
        initial: f
        states:
          f:
            invoke: {id: one, content: KID}
            on: {left: {do: 'send ping to "#_one"'}, done.invoke.one: g}
          g: {on: {left: f}}
      second:
        initial: s
        states:
          s:
            invoke: {id: two, content: KID}
            on: {right: {do: 'send ping to "#_two"'}, done.invoke.two: t}
          t: {on: {right: s}}
""".replace(
    "KID",
    "{chart: Kid, events: {in: [ping]}, initial: a, states: {a: {on: {ping: b}},"
    " b: {after: {20ms: over}}, over: {final: true}}}",
)
FAULTS = """
chart: Faults
events: {in: [go, poke]}
initial: idle
states:
  idle: {on: {go: work}}
  work:
    invoke: {id: kid, autoforward: true, content: KID}
""".replace(
    "KID",
    "{chart: Kid, data: {n: 0..2 fault = 0}, events: {in: [poke]}, initial: a,"
    " states: {a: {on: {poke: {do: n += 1}}}}}",
)
CHARTS = {"one": ONE, "defers": DEFERS, "deep": DEEP, "two": TWO, "faults": FAULTS}


@pytest.mark.slow
@pytest.mark.parametrize("untimed", [False, True], ids=["discrete", "untimed"])
@pytest.mark.parametrize("name", CHARTS)
def test_engines_agree_on_charts_that_invoke(load: Load, name: str, untimed: bool) -> None:
    both(load(**{name: CHARTS[name]}), untimed=untimed)


LEFT = """
chart: Left
data: {n: 0..2 = 0}
events: {in: [over], out: [start]}
initial: one
states:
  one: {after: {10ms: {target: two, do: send start}}}
  two: {on: {over: one}}
"""
RIGHT = """
chart: Right
events: {in: [start], out: [over]}
initial: idle
states:
  idle: {rest: true, on: {start: work}}
  work:
    rest: true
    invoke: {id: kid, content: {chart: Kid, events: {out: [ready]}, initial: a,
             states: {a: {after: {20ms: {do: 'send ready to "#_parent"'}}}}}}
    on: {ready: {target: idle, do: send over}}
    after: {40ms: idle}
"""
PAIR = """
system: Pair
machines: {left: left.yaml, right: right.yaml}
connect: [left.start -> right.start, right.over -> left.over]
properties:
  D: deadlock_free
  late: {never: left.In(two) and right.In(idle)}
  again: {leads_to: [left.In(two), left.In(one)]}
  works: {reachable: right.In(work)}
"""


@pytest.mark.parametrize("time", ["discrete", "untimed"])
def test_a_machine_of_a_system_may_invoke(load: Load, time: str) -> None:
    system = load(pair=PAIR, left=LEFT, right=RIGHT)
    both(system, untimed=time == "untimed")
    verdicts = []
    for engine in ("c", "python"):
        report = check(
            system,
            Findings(),
            options=ExplorationOptions(engine, time="untimed" if time == "untimed" else "discrete"),
        )
        verdicts.append({result.name: result.verdict for result in report.results})
        runtimes = ("interpreter", "generated C") if engine == "c" else ("interpreter",)
        traces = [result.trace for result in report.results if result.trace is not None]
        assert traces
        assert all(trace.replayed == runtimes for trace in traces), [t.differs for t in traces]
    assert verdicts[0] == verdicts[1]
    assert verdicts[0]["works"].value == "holds"
