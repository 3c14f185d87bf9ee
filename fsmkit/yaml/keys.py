"""The keys of charts, states and transitions: what the reader accepts and the schema offers.

Each table says for people what a key holds; `fsmkit.yaml.schema` makes the JSON Schema of them.
"""

from __future__ import annotations

CHART = {
    "chart": "the name of the chart",
    "doc": "what it is for",
    "extends": "the file of its base, in YAML or SCXML",
    "abstract": "true: not to be compiled by itself",
    "datamodel": "fsmkit (unless given), ecmascript or null",
    "binding": "early (unless given) or late",
    "types": "enumerations (lists of names) and records (fields and their types)",
    "constants": "named values",
    "data": "variables: `type = start value`",
    "inputs": "variables that the host writes",
    "outputs": "variables that the host reads",
    "operations": "what the host implements: `name(parameter type) -> type`",
    "events": "the events in, out and internal: `name(field type)`",
    "capacity": "queue, internal, delayed, microsteps, tick",
    "script": "statements executed once, before the initial states are entered",
    "initial": "the initial state or states",
    "states": "the top-level states",
    "refine": "changes of inherited states, by name, at any depth",
}
STATE = {
    "doc": "what it is for",
    "initial": "the initial child or descendants",
    "states": "children, of which one is active",
    "regions": "children, all of which are active",
    "history": "shallow or deep",
    "default": "where a history leads the first time",
    "choice": "guarded targets, the last without a guard",
    "final": "true: it ends its parent",
    "done": "the payload of the parent's done event",
    "abstract": "true: a derived chart must fill it",
    "rest": "true: waiting here for ever is no deadlock",
    "data": "variables declared here",
    "entry": "what is done when it is entered",
    "exit": "what is done when it is left",
    "on": "event: transition",
    "always": "eventless transitions",
    "after": "delay: transition, once",
    "every": "delay: transition, again and again",
    "sometimes": "transitions at any time, for charts of an environment",
    "transitions": "transitions of any kind in one list, where their order matters",
    "defer": "events kept for later",
    "invoke": "invoked charts",
    "invariant": "what holds while it is active",
    "override": "what is replaced without `super`: entry, exit, initial, default",
}
TRANSITION = {
    "target": "the state or states to enter",
    "if": "the guard",
    "do": "what is done",
    "type": "internal or external",
    "id": "its name, for overriding",
    "watchdog": "true: a timeout that only reports a fault",
    "ordered": "true: the order of overlapping transitions is meant",
    "first": "true: before the inherited transitions",
    "override": "true, or the id of the inherited transition that it changes",
}
LABEL = {
    "on": "the event or events",
    "after": "the delay, once",
    "every": "the delay, again and again",
    "always": "true: eventless",
    "sometimes": "true: at any time",
}
LABELLED = {**LABEL, **TRANSITION}
"""An entry of `transitions`: one of the first, and what any transition has."""
INITIAL = {"target": "the state or states to enter", "do": "what is done on the way"}
EVENTS = {"in": "received", "out": "sent out", "internal": "raised and taken by the chart itself"}
CAPACITY = {
    "queue": "events in the external queue",
    "internal": "events in the internal queue",
    "delayed": "delayed sends pending at once",
    "microsteps": "microsteps in one macrostep",
    "tick": "the unit of all times: a duration",
}
INVOKE = {
    "id": "its name",
    "id_location": "where to store a made-up name",
    "type": "the type of the invoked service",
    "type_expr": "the same, an expression",
    "src": "the file of the chart",
    "src_expr": "the same, an expression",
    "autoforward": "true: every external event is passed on",
    "with": "start values: name: expression",
    "names": "variables passed by name",
    "finalize": "statements executed before an event of the invoked chart is handled",
    "content": "the chart itself",
    "content_expr": "an expression that gives the chart",
}
SYSTEM = {
    "system": "the name of the system",
    "doc": "what it is for",
    "machines": "its machines and their charts",
    "shared": "data that several machines read or write",
    "connect": "how events and outputs go from machine to machine",
    "environment": "what may come from outside, and charts that act for it",
    "schedule": "the order in which machines run",
    "properties": "what is to be checked",
}
DEPLOYMENT = {
    "system": "the file of the system",
    "doc": "what it is for",
    "nodes": "the nodes and their machines",
    "links": "how nodes reach each other",
}
DONE = {"with": "name: expression", "content": "an expression"}

_PLACES = (
    (CHART, "a chart (at the left margin)"),
    (STATE, "a state"),
    (TRANSITION, "a transition"),
    (SYSTEM, "a system"),
    (DEPLOYMENT, "a deployment"),
)
BELONGS = {
    key: f"`{key}` belongs to {' or '.join(place for other, place in _PLACES if key in other)}"
    for table, _ in _PLACES
    for key in table
}
"""Where a key belongs that is not known where it stands."""
