"""Every place of a chart, a system and a deployment where a text can stand."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from xml.sax.saxutils import quoteattr

Texts = Mapping[str, str]
Files = dict[str, str]


class Asked(dict[str, str]):
    """Texts by place; a place that is not given holds its own name. Notes all that are asked."""

    def __missing__(self, place: str) -> str:
        self[place] = place.replace(" ", "_")
        return self[place]


def _json(text: str) -> str:
    return json.dumps(text)


def named(text: str, end: str = ".yaml") -> str:
    """Return a text as the name of a file, shortened to what a file system takes of it."""
    plain = text.replace("/", "_").replace("\0", "_").encode("utf-8", "replace")[:200]
    return plain.decode("utf-8", "ignore") + end


def in_yaml(at: Texts) -> Files:
    """Return a chart in YAML, and its base."""
    q = {place: _json(at[place]) for place in (
        "chart", "doc", "enumeration", "member", "record", "part", "constant", "data", "input",
        "output", "operation", "parameter", "event", "out event", "internal event", "field",
        "state", "state doc", "region", "lonely state", "transition", "base chart", "final",
        "history", "trap",
    )}  # fmt: skip
    label, symbol, send = (_json(at[p]) for p in ("label", "symbol", "send"))
    do = f"n = 0; log {label}, n; sy = {symbol}; send go after 1s as {at['send']}; send out2(k = 1)"
    del send
    base = f"""\
chart: {q["base chart"]}
doc: {q["doc"]}
events: {{in: [halt]}}
initial: idle
states:
  idle: {{doc: {q["state doc"]}, on: {{halt: idle}}}}
"""
    chart = f"""\
chart: {q["chart"]}
extends: {_json(named(at["base file"]))}
doc: {q["doc"]}
types:
  {q["enumeration"]}: [{q["member"]}, jam]
  {q["record"]}: {{{q["part"]}: int32}}
constants: {{{q["constant"]}: 3}}
data:
  n: 0..9 = 0
  sy: symbol = "start"
  kind: {q["enumeration"]}
  whole: {q["record"]}
  {q["data"]}: 0..9 = 0
inputs: {{{q["input"]}: bool}}
outputs: {{{q["output"]}: 0..9 = 0}}
operations:
  - {_json(f"{at['operation']}({at['parameter']} int32) -> 0..2")}
events:
  in: [go, {q["event"]}, {_json(f"e2({at['field']} 0..1)")}]
  out: [{q["out event"]}, out2(k 0..1)]
  internal: [{q["internal event"]}]
initial: {q["state"]}
states:
  {q["state"]}:
    doc: {q["state doc"]}
    entry: {_json(do)}
    invariant: n >= 0
    on:
      go: {{id: {q["transition"]}, target: {q["region"]}, if: {_json(f"sy == {symbol} or n == 0")}}}
  {q["lonely state"]}: {{on: {{go: {q["state"]}}}}}
  {q["region"]}:
    regions:
      r1:
        initial: a
        states:
          a: {{on: {{go: {q["final"]}}}}}
          {q["final"]}: {{final: true}}
          {q["history"]}: {{history: shallow, default: a}}
      r2: {{initial: b, states: {{b: {{on: {{e2: {q["history"]}}}, after: {{1s: {q["trap"]}}}}}}}}}
  {q["trap"]}: {{}}
"""
    return {named(at["file"]): chart, named(at["base file"]): base}


def in_scxml(at: Texts) -> Files:
    """Return a chart in SCXML."""
    a = {place: quoteattr(at[place]) for place in (
        "chart", "data", "label", "send", "state", "event", "raised", "part", "final", "transition",
        "variable", "target event", "history", "trap",
    )}  # fmt: skip
    symbol = quoteattr("'" + at["symbol"].replace("\\", "\\\\").replace("'", "\\'") + "'")
    chart = f"""\
<scxml xmlns="http://www.w3.org/2005/07/scxml" xmlns:fk="urn:fsmkit:scxml" version="1.0"
  name={a["chart"]} datamodel="ecmascript">
  <datamodel><data id="n" expr="1"/><data id={a["data"]} expr="2"/><data id="s" expr={symbol}/>
  </datamodel>
  <state id={a["state"]}>
    <onentry>
      <log label={a["label"]} expr="n"/>
      <raise event={a["raised"]}/>
      <send event={a["event"]} id={a["send"]} delay="1s"><param name={a["part"]} expr="n"/></send>
    </onentry>
    <transition event={a["event"]} target={a["final"]}/>
    <transition event="go" target="p"/>
  </state>
  <parallel id="p">
    <state id="q"><history id={a["history"]}><transition target="q1"/></history>
      <state id="q1"><transition event="go" cond="n == 1" target="t"/></state></state>
    <state id="r"><onexit><cancel sendid={a["send"]}/></onexit></state>
  </parallel>
  <state id="t"><transition event={a["target event"]} target={a["history"]}/>
    <transition event="go" target={a["trap"]}/></state>
  <state id={a["trap"]}/>
  <final id={a["final"]}/>
</scxml>
"""
    return {named(at["file"], ".scxml"): chart}


def invoking(at: Texts) -> Files:
    """Return a chart that invokes another."""
    q = {p: _json(at[p]) for p in (
        "invocation", "inner chart", "inner state", "chart", "state", "trap",
    )}  # fmt: skip
    chart = f"""\
chart: {q["chart"]}
events: {{in: [go, stop]}}
initial: {q["state"]}
states:
  {q["state"]}:
    invoke: {{id: {q["invocation"]}, src: {_json(named(at["inner file"]))}, autoforward: true}}
    on: {{go: {q["state"]}, stop: {q["trap"]}, {_json("done.invoke." + at["invocation"])}: {{}}}}
  {q["trap"]}: {{}}
"""
    inner = f"""\
chart: {q["inner chart"]}
events: {{in: [go]}}
initial: {q["inner state"]}
states:
  {q["inner state"]}: {{on: {{go: over}}}}
  over: {{final: true}}
"""
    return {named(at["file"]): chart, named(at["inner file"]): inner}


def plain(at: Texts) -> Files:
    """Return a chart that the library `transitions` has an equivalent for."""
    q = {p: _json(at[p]) for p in ("chart", "doc", "state", "label", "data", "event", "id")}
    chart = f"""\
chart: {q["chart"]}
doc: {q["doc"]}
data: {{n: int32 = 0, {q["data"]}: bool = false}}
events: {{in: [go, {q["event"]}]}}
initial: a
states:
  a:
    entry: {_json("log " + q["label"] + ", n")}
    on: {{go: {{id: {q["id"]}, target: {q["state"]}}}}}
  {q["state"]}: {{on: {{go: a, {q["event"]}: a}}}}
"""
    return {named(at["file"]): chart}


def system(at: Texts) -> Files:
    """Return a system of two machines, with a variable that they share."""
    shared = at["shared"]
    more = f"data: {{{_json(shared)}: 0..1 = 0}}\n"
    whole = f"{_system(at)}shared: {{{_json(shared)}: 0..1 = 0}}\n"
    side = _side(_json(f"{shared} = 1; send ping(n = 3)")) + more
    return {named(at["file"]): whole, named(at["machine file"]): side}


def deployment(at: Texts) -> Files:
    """Return a deployment of a system of two machines."""
    q = {p: _json(at[p]) for p in ("machine", "node", "endpoint", "deployment doc")}
    text = f"""\
doc: {q["deployment doc"]}
system: {_json(named(at["system file"]))}
nodes:
  {q["node"]}: [{q["machine"]}]
  b: [right]
links:
  endpoints: {{{q["node"]}: {q["endpoint"]}, b: "tcp://127.0.0.1:5572"}}
"""
    return {
        named(at["file"]): text,
        named(at["system file"]): _system(at),
        named(at["machine file"]): _side("send ping(n = 3)"),
    }


def _side(do: str) -> str:
    return f"""\
chart: Side
inputs: {{other: bool}}
outputs: {{busy: bool = true}}
events: {{in: [go, pong(n 0..3)], out: [ping(n 0..3)]}}
initial: idle
states:
  idle:
    on:
      go: {{if: not other, do: {do}}}
      pong: {{do: busy = event.n > 1}}
"""


def _system(at: Texts) -> str:
    q = {p: _json(at[p]) for p in ("system", "machine", "property", "system doc", "monitored")}
    left, side = at["machine"], _json(named(at["machine file"]))
    return f"""\
system: {q["system"]}
doc: {q["system doc"]}
machines: {{{q["machine"]}: {side}, right: {side}}}
connect:
  - {{{_json(f"{left}.ping -> right.pong")}: {{kind: lossy, loss: 1}}}}
  - {_json(f"right.ping -> {left}.pong")}
  - {_json(f"{left}.busy -> right.other")}
  - {_json(f"right.busy -> {left}.other")}
environment: {{may: [{_json(f"{left}.go")}, right.go]}}
properties:
  {q["property"]}: {{reachable: right.busy}}
  {q["monitored"]}: {{never: not right.busy}}
"""


SHAPES: dict[str, Callable[[Texts], Files]] = {
    "yaml": in_yaml,
    "scxml": in_scxml,
    "invoking": invoking,
    "plain": plain,
    "system": system,
    "deployment": deployment,
}
"""How the files of each kind are made; the first of them is given to fsmkit."""
BENIGN = {"endpoint": "tcp://127.0.0.1:5571", "raised": "x", "member": "none", "send": "beat"}
"""What stands in places where their name cannot."""


def places(shape: str) -> tuple[str, ...]:
    """Return the places of a kind of files."""
    asked = Asked()
    SHAPES[shape](asked)
    return tuple(asked)


def files(shape: str, texts: Texts) -> Files:
    """Return the files of a kind with these texts in their places."""
    return SHAPES[shape](Asked({**BENIGN, **texts}))
