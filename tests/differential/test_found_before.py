"""What random charts have found, kept: every runtime gives the one trace that is right."""

from __future__ import annotations

from pathlib import Path

import pytest

from devtools.runtimes import harnesses
from fsmkit.chart.chart import Chart
from fsmkit.chart.loading import load
from fsmkit.testing.harness.harness import Harness

FROM_WITHIN = """\
chart: FromWithin
events: {in: [go, back]}
initial: outside
states:
  outer:
    initial: both
    states:
      both:
        regions:
          one:
            initial: s6
            states: {s6: {}, s7: {}}
          two:
            initial: s10
            states:
              s10: {on: {back: memory}}
      memory: {history: deep, default: s10}
  outside: {on: {go: s7}}
"""
SHARED_ANCESTOR = """\
chart: SharedAncestor
events: {in: [go, leave, again]}
states:
  top:
    states:
      middle:
        entry: log "in"
        states:
          a: {on: {go: b, again: memory}}
          b: {on: {leave: out}}
      memory: {history: deep, default: a}
  out: {on: {go: a}}
"""
NUMBERS = """\
chart: Numbers
data:
  small: -2..7 wrap = 5
  word: uint32 = 9
  wide: uint64 = 0
  short: int16 = 3
  far: uint64 = 4
outputs:
  clipped: 0..4000 = 0
  is_less: bool = false
states:
  only:
    entry:
      - small = -(-small)
      - clipped = -word
      - wide -= 1
      - is_less = clipped + short > wide
      - far = -short * short
    on: {error: {do: log "error"}}
"""
LATER_AT_FIRST = """\
chart: LaterAtFirst
events: {internal: [tick]}
states:
  compound:
    initial: {target: last, do: send tick after 20ms}
    states:
      last: {final: true}
"""
PAYLOADS = """\
chart: Payloads
types:
  Pair: {a: 0..9, b: bool}
data:
  pair: Pair
  bytes: uint8[3] = 1
  word: symbol = "idle"
events:
  in:
    - all(pair Pair, bytes uint8[3], word symbol)
  out:
    - told(pair Pair, bytes uint8[3], word symbol)
states:
  only:
    on:
      all:
        do: |
          pair = event.pair
          bytes = event.bytes
          word = event.word
          send told(pair = pair, bytes = bytes, word = word)
"""
NO_VALUE = """\
<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" datamodel="ecmascript" initial="a">
  <datamodel>
    <data id="n" expr="3"/>
    <data id="first" expr="{x: 1}.x"/>
    <data id="second" expr="new Date()"/>
  </datamodel>
  <script>n = 4</script>
  <state id="a"/>
</scxml>
"""

ASKED_AGAIN = """\
chart: AskedAgain
data: {d: int32 = 0}
events: {in: [go]}
states:
  work:
    on: {error.execution: {do: d = 1}}
    always: {if: 10 / d > 3, target: last}
    regions:
      one: {initial: a, states: {a: {}}}
      two: {initial: b, states: {b: {}}}
  last: {}
"""
ASKED_BY_TWO_EVENTS = """\
chart: AskedByTwoEvents
data: {first: int32 = 2}
events: {in: [both]}
states:
  outer:
    on: {error: {do: first = 4}}
    regions:
      middle:
        on: {"*": {if: 4 / first > 1, do: first -= 1}}
        regions:
          inner: {}
"""
APART = """\
chart: Apart
events: {in: [go]}
states:
  both:
    regions:
      one:
        initial: a
        states:
          a: {exit: log "leave a", on: {go: b}}
          b: {entry: log "enter b"}
      two:
        initial: c
        states:
          c:
            initial: d
            exit: log "leave c"
            on:
              go:
                target: e
                do:
                  - log "go 1"
                  - log "go 2"
                  - log "go 3"
            states: {d: {}, e: {entry: log "enter e"}}
      three:
        initial: f
        states:
          f: {on: {go: {target: g, do: log "go 4"}}}
          g: {entry: log "enter g"}
"""
FULL_AT_ONCE = """\
chart: FullAtOnce
capacity: {internal: 1}
data: {d: int32 = 0}
events: {internal: [x]}
states:
  a:
    entry: raise x
    always: {if: 10 / d > 3, target: b}
  b: {}
"""
QUIET = """\
chart: Quiet
events: {in: [go]}
states:
  a: {on: {go: end}}
  end: {final: true}
"""
CASES = {
    "a fault in a guard ends the step at once": (
        FULL_AT_ONCE,
        ("start 0",),
        ["raise x", "error error.execution", "full internal", "fault internal", "= a"],
    ),
    "a guard that failed is asked again": (
        ASKED_AGAIN,
        ("start 0",),
        [
            *("error error.execution", "t 1", "- b", "- two", "- a", "- one", "- work"),
            *("t 2", "+ last", "= last"),
        ],
    ),
    # straight code asks it on one event, the general selection on another
    "a guard that failed on one event is asked again on the next": (
        ASKED_BY_TWO_EVENTS,
        ("start 0", "post both", "post both", "post both", "run 1"),
        [
            *("@1 > event both", "error error.execution", "unhandled both"),
            *("error error.execution", "t 1", "t 1", "= inner"),
        ],
    ),
    # Appendix D, microstep: all are left, then all act, then all are entered
    "regions that move at once act before any is entered": (
        APART,
        ("start 0", "post go", "run 1"),
        [
            *("- f", "- d", "- c", "log leave c", "- a", "log leave a"),
            *("t 2", "t 5", "log go 1", "log go 2", "log go 3", "t 7", "log go 4"),
            *("+ b", "log enter b", "+ c", "+ e", "log enter e", "+ g", "log enter g", "= b e g"),
        ],
    ),
    "a chart that raises nothing comes to its end": (
        QUIET,
        ("start 0", "post go", "run 1", "post go"),
        ["@1 > event go", "- a", "t 1", "+ end", "- end", "= end finished", "full queue"],
    ),
    "a start value of no meaning leaves the script as it is": (
        NO_VALUE,
        ("start 0", "dump"),
        [
            *("@0 > start", "raise error.execution", "raise error.execution", "+ a"),
            *("unhandled error.execution", "unhandled error.execution", "= a"),
            *("d n 4", "d first 0", "d second 0"),
        ],
    ),
    "a script posts records, arrays and strings": (
        PAYLOADS,
        ("start 0", 'post all [7 1] [3, 4, 5] "never heard of"', "run 1"),
        ["t 1", 'out told [7 1] [3 4 5] "never heard of"', "= only"],
    ),
    # a history taken from within enters nothing beside the domain of the transition
    "another region stays as it is": (
        FROM_WITHIN,
        ("start 0", "post go", "run 1", "post back", "run 2"),
        ["@2 > event back", "- s10", "t 4", "+ s10", "= s7 s10"],
    ),
    "an active ancestor is not entered again": (
        SHARED_ANCESTOR,
        ("start 0", "post go", "post leave", "post go", "run 1", "post again", "run 2"),
        ["@2 > event again", "- a", "t 4", "+ b", "= b"],
    ),
    "numbers at the bounds of C": (
        NUMBERS,
        ("start 0", "dump"),
        [
            *("d small 5", "d word 9", "d wide 18446744073709551615", "d short 3"),
            *("d far 18446744073709551607", "d clipped 4000", "d is_less 0"),
        ],
    ),
    "the only delayed send is in the very first transition": (
        LATER_AT_FIRST,
        ("start 4294967290", "run 30"),
        ["@14 > event tick", "unhandled tick", "= last"],
    ),
}


def chart_of(text: str, folder: Path) -> Chart:
    path = folder / ("chart.scxml" if text.startswith("<") else "chart.yaml")
    path.write_text(text)
    return load(path)


@pytest.mark.slow
@pytest.mark.external
@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize("runtime", harnesses(), ids=lambda runtime: runtime.name)
def test_found_before(runtime: Harness, name: str, tmp_path: Path) -> None:
    text, script, end = CASES[name]
    trace = runtime.run(chart_of(text, tmp_path), script)
    assert trace[-len(end) :] == end
