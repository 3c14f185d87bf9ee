"""The table of keys: the names of each key in YAML and SCXML, its form and its meaning.

Readers and writers of both notations, the JSON Schema, inheritance, `show` and its JSON follow
these rows. A key of a usual form is a row here, a field of the Document and perhaps a field of the
Chart. Only keys of the form `OWN` have a codec, which each notation defines.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import MISSING, dataclass, fields
from dataclasses import field as dataclass_field
from enum import Enum
from functools import cache
from typing import Any

from fsmkit.diagnostics import Text
from fsmkit.document.document import REPLACEABLE


class Form(Enum):
    """The form of a key's value; each notation reads and writes each form in one place."""

    TEXT = "an expression, a duration, a file"
    NAME = "a text that is not empty"
    PROSE = "a description"
    FLAG = "true or false"
    CHOICE = "one of some words; the first of them where it is absent"
    MARKS = "some of these words"
    NAMES = "a list of names"
    TARGETS = "one name, or a list of them"
    IDS = "ids of another tool, which a Chart keeps with their locations"
    STATEMENTS = "one handler"
    HANDLERS = "several handlers"
    ARGUMENTS = "name: expression"
    DATA = "name: type = start value"
    TABLE = "names and texts"
    RECORD = "a mapping with keys of its own"
    RECORDS = "names, and under each a text or a mapping with keys of its own"
    OWN = "what only a codec of its own can read"


PLAIN = (Form.NAME, Form.PROSE, Form.FLAG, Form.CHOICE, Form.IDS)
"""Forms that a Chart keeps as written, if it has a field of that name."""
NESTED = (Form.TABLE, Form.RECORD, Form.RECORDS)
"""Forms that a text cannot contain."""


class Inherit(Enum):
    """How a derived chart combines a value with that of its base."""

    REPLACE = "its own, where it has one"
    ADD = "what is inherited, then its own"
    OWN = "by a rule of its own, which inheritance holds"


@dataclass(frozen=True, slots=True)
class Key:
    """A row. ``field`` is the field in the part of the Document, by default the name.

    ``scxml`` is the attribute, with the prefix ``fk:`` if it belongs to the extension, or in angle
    brackets the element. By default it is the extension's attribute of this name; None for a codec.
    ``unless``: the field of the key that takes precedence if both are given. ``rows``: the keys of
    a record, or of each of several records.
    """

    name: str
    doc: str
    form: Form = Form.TEXT
    field: str = ""
    scxml: str | None = ""
    choices: Mapping[str, Any] = dataclass_field(default_factory=dict)
    unless: str = ""
    inherit: Inherit = Inherit.REPLACE
    rows: Mapping[str, Key] = dataclass_field(default_factory=dict)

    def __post_init__(self) -> None:
        """Fill in the defaults."""
        object.__setattr__(self, "field", self.field or self.name)
        if self.form is Form.OWN:
            object.__setattr__(self, "scxml", None)
            object.__setattr__(self, "inherit", Inherit.OWN)
        elif self.scxml == "":
            object.__setattr__(self, "scxml", f"fk:{self.name}")

    def is_given(self, part: Any) -> bool:
        """Return whether the value of a part of a Document differs from its default."""
        value = getattr(part, self.field)
        return bool(value != defaults(part.__class__)[self.field])

    def word(self, value: object) -> str:
        """Return the word of a choice for a value."""
        return next(word for word, meant in self.choices.items() if meant == value)


Keys = Mapping[str, Key]
"""The keys of one object by name, in the order in which they are written."""


@cache
def defaults(kind: Any) -> Mapping[str, object]:
    """Return what the fields of a dataclass are by default."""
    return {one.name: None if one.default is MISSING else one.default for one in fields(kind)}


def merge_fields(base: object, derived: object, rows: Keys) -> dict[str, Any]:
    """Return the fields of a part of a derived chart that inherit by the usual rules."""
    found: dict[str, Any] = {}
    for row in rows.values():
        if row.inherit is not Inherit.OWN:
            old, new = getattr(base, row.field), getattr(derived, row.field)
            found[row.field] = (*old, *new) if row.inherit is Inherit.ADD else new or old
    return found


def kept_keys(rows: Keys, kind: type[Any]) -> tuple[Key, ...]:
    """Return the keys whose value a part of a Chart holds as it was written."""
    names = {one.name for one in fields(kind)}
    return tuple(row for row in rows.values() if row.form in PLAIN and row.field in names)


def values(part: object, rows: Iterable[Key]) -> dict[str, Any]:
    """Return the values of keys, names without their locations and each id once."""
    found = {row.field: getattr(part, row.field) for row in rows}
    return {name: _value(one) for name, one in found.items()}


def plain_values(part: object, rows: Iterable[Key]) -> dict[str, Any]:
    """Return the values of keys for JSON: ids as a list of strings."""
    found = values(part, rows)
    return {
        name: [text.value for text in one] if isinstance(one, tuple) else one
        for name, one in found.items()
    }


def _value(value: object) -> object:
    if isinstance(value, tuple):
        return tuple(dict.fromkeys(value))
    return value.value if isinstance(value, Text) else value


def marks(part: object, rows: Iterable[Key]) -> list[str]:
    """Return the flags that are set, the choices that are not the first, and the names given."""
    found: list[str] = []
    for row in rows:
        value = getattr(part, row.field)
        match row.form:
            case Form.FLAG if value:
                found.append(row.name)
            case Form.CHOICE if row.word(value) != next(iter(row.choices)):
                found.append(row.word(value))
            case Form.NAME if value is not None:
                found.append(f"{row.name} {value}")
            case Form.IDS if value:
                found.append(f"{row.name} {' '.join(one.value for one in value)}")
            case _:
                pass
    return found


def table(*rows: Key) -> Keys:
    """Return keys by name."""
    return {row.name: row for row in rows}


def named(**docs: str) -> Keys:
    """Return keys by name, each with its documentation; `with_` is the key `with`."""
    return table(*(Key(name.rstrip("_"), doc) for name, doc in docs.items()))


_OWN, _FLAG = Form.OWN, Form.FLAG
_BY_RULE = Inherit.OWN
REQ = Key("req", "ids of the requirements that it implements", Form.IDS, inherit=Inherit.ADD)
"""The key of charts, states, transitions and operations; `fsmkit trace-requirements` reads it."""

CHART = table(
    Key("chart", "the name of the chart", _OWN),
    Key("extends", "the file of its base, in YAML or SCXML", Form.NAME, inherit=_BY_RULE),
    Key("abstract", "true: only a base of other charts", _FLAG, inherit=_BY_RULE),
    Key("doc", "what it is for", Form.PROSE, scxml=None),
    REQ,
    Key(
        "datamodel", "fsmkit (unless given), ecmascript or null", Form.CHOICE, scxml=None,
        choices={name: name for name in ("fsmkit", "ecmascript", "null")}, inherit=_BY_RULE,
    ),
    Key(
        "binding", "early (unless given) or late", Form.CHOICE, "late_binding", "binding",
        choices={"early": False, "late": True},
    ),
    Key("types", "enumerations (lists of names) and records (fields and their types)", _OWN),
    Key("constants", "named values", _OWN),
    Key(
        "data", "variables: `type = start value`", Form.DATA, scxml="<datamodel>", inherit=_BY_RULE
    ),
    Key("inputs", "variables that the host writes", Form.DATA, scxml="<fk:input>",
        inherit=_BY_RULE),
    Key("outputs", "variables that the host reads", Form.DATA, scxml="<fk:output>",
        inherit=_BY_RULE),
    Key("operations", "what the host implements: `name(parameter type) -> type`", _OWN),
    Key("functions", "pure functions: `name(parameter type) -> type: value or statements`", _OWN),
    Key("events", "the events in, out and internal: `name(field type)`", _OWN),
    Key("capacity", "queue, internal, delayed, microsteps, tick", _OWN),
    Key(
        "script", "statements executed once, before the initial states are entered",
        Form.STATEMENTS, scxml=None, inherit=Inherit.ADD,
    ),
    Key("entries", "entry points, where another chart uses this one: name: target", _OWN),
    Key("properties", "what is to be checked of it: name: {kind: condition}", _OWN),
    Key("environment", "the external events and inputs when it is checked alone", _OWN),
    Key(
        "override", "inherited properties, or `environment`, that are replaced", Form.NAMES,
        "overrides", inherit=_BY_RULE,
    ),
    Key("initial", "the initial state or states", _OWN),
    Key("states", "the top-level states", _OWN),
    Key("refine", "changes of inherited states, by name, at any depth", _OWN),
)  # fmt: skip
STATE = table(
    Key("doc", "what it is for", Form.PROSE, scxml=None),
    REQ,
    Key("use", "the chart that fills the state: its file, or an object", _OWN),
    Key("with", "of the used chart: values of constants", _OWN),
    Key("start", "of the used chart: start values of data", _OWN),
    Key("bind", "of the used chart: what its names are here", _OWN),
    Key("exits", "of the used chart: where its final states lead", _OWN),
    Key("history", "shallow or deep", _OWN),
    Key("final", "true: it ends its parent", _OWN),
    Key("abstract", "true: a derived chart must fill it", _FLAG, inherit=_BY_RULE),
    Key("rest", "true: waiting here for ever is no deadlock", _FLAG),
    Key(
        "override", f"what is replaced without `super`: {', '.join(REPLACEABLE)}", Form.MARKS,
        "overrides", choices=dict.fromkeys(REPLACEABLE), inherit=_BY_RULE,
    ),
    Key("data", "variables declared here", Form.DATA, scxml="<datamodel>", inherit=Inherit.ADD),
    Key("defer", "events kept for later", Form.NAMES, inherit=Inherit.ADD),
    Key("invariant", "what holds while it is active", inherit=_BY_RULE),
    Key("entry", "what is done when it is entered", Form.HANDLERS, scxml="<onentry>",
        inherit=_BY_RULE),
    Key("exit", "what is done when it is left", Form.HANDLERS, scxml="<onexit>",
        inherit=_BY_RULE),
    Key("invoke", "invoked charts", _OWN),
    Key("done", "the payload of the parent's done event", _OWN),
    Key("initial", "the initial child or descendants; of a used chart, an entry point", _OWN),
    Key("default", "where a history leads the first time", _OWN),
    Key("on", "event: transition", _OWN),
    Key("always", "eventless transitions", _OWN),
    Key("after", "delay: transition, once", _OWN),
    Key("every", "delay: transition, again and again", _OWN),
    Key("sometimes", "transitions at any time, for charts of an environment", _OWN),
    Key("transitions", "transitions of any kind in one list, where their order matters", _OWN),
    Key("choice", "guarded targets, the last without a guard", _OWN),
    Key("states", "children, of which one is active", _OWN),
    Key("regions", "children, all of which are active", _OWN),
)  # fmt: skip
TRANSITION = table(
    Key("id", "its name, for overriding", Form.NAME, inherit=_BY_RULE),
    Key("override", "true, or the id of the inherited transition that it changes", Form.NAME,
        inherit=_BY_RULE),
    Key("first", "true: before the inherited transitions", _FLAG, inherit=_BY_RULE),
    Key(
        "type", "internal or external", Form.CHOICE, "internal", "type",
        choices={"external": False, "internal": True},
    ),
    Key("if", "the guard", Form.TEXT, "guard", "cond"),
    Key("target", "the state or states to enter", Form.TARGETS, "targets", "target"),
    Key("watchdog", "true: a timeout that only reports a fault", _FLAG),
    Key("ordered", "true: the order of overlapping transitions is intended", _FLAG),
    Key("do", "what is done", Form.STATEMENTS, "content", None, inherit=_BY_RULE),
    REQ,
)  # fmt: skip
LABEL = table(
    Key("on", "the event or events", _OWN),
    Key("after", "the delay, once", _OWN),
    Key("every", "the delay, again and again", _OWN),
    Key("always", "true: eventless", _OWN),
    Key("sometimes", "true: at any time", _OWN),
)
LABELLED = {**LABEL, **TRANSITION}
"""An entry of `transitions`: a trigger key, and the keys of any transition."""
INITIAL = table(
    Key("target", "the state or states to enter", Form.TARGETS, "targets"),
    Key("do", "what is done on the way", Form.STATEMENTS, "content"),
)
EVENTS = named(
    in_="received", out="sent out", internal="raised and taken by the chart itself"
)  # fmt: skip
CAPACITY = named(
    queue="events in the external queue",
    internal="events in the internal queue",
    delayed="delayed sends pending at once",
    microsteps="microsteps in one macrostep",
    tick="the unit of all times: a duration",
)
INVOKE = table(
    Key("id", "its name", Form.NAME, scxml="id"),
    Key("id_location", "where to store a made-up name", scxml="idlocation", unless="id"),
    Key("type", "the type of the invoked service", Form.NAME, scxml="type"),
    Key("type_expr", "the same, an expression", scxml="typeexpr", unless="type"),
    Key("src", "the file of the chart", Form.NAME, scxml="src"),
    Key("src_expr", "the same, an expression", scxml="srcexpr", unless="src"),
    Key("autoforward", "true: every external event is passed on", _FLAG, scxml="autoforward"),
    Key("with", "start values: name: expression", Form.ARGUMENTS, "arguments", None),
    Key("names", "variables passed by name", Form.NAMES, "name_list", "namelist"),
    Key("content", "the chart itself", _OWN),
    Key("content_expr", "an expression that gives the chart", scxml=None),
    Key(
        "finalize", "statements executed before an event of the invoked chart is handled",
        Form.STATEMENTS, scxml="<finalize>",
    ),
)  # fmt: skip
USE = table(
    Key("chart", "its file", Form.NAME, scxml="fk:src"),
    Key("reset", "true: default entry sets the start values of its data again", _FLAG),
)
USED = {"with": "constants", "start": "start", "bind": "bind"}
"""The keys of a using state that hold pairs of names and expressions, by field."""
EXIT = table(
    Key("if", "the guard", Form.TEXT, "guard", "fk:cond"),
    Key("target", "the state or states to enter", Form.TARGETS, "targets", "fk:target"),
    Key("do", "what is done", Form.STATEMENTS, "content", None),
)
DONE = table(
    Key("with", "name: expression", Form.ARGUMENTS, "done_data", None),
    Key("content", "an expression", Form.TEXT, "done_content", None),
)
PROPERTY = named(
    deadlock_free="no state is reached in which nothing can happen and some machine must",
    livelock_free="machines are never busy for ever without time passing",
    invariant="a condition that holds in all states",
    never="a condition that holds in no state",
    reachable="a condition that holds in some state",
    recoverable="a condition that can be reached again from every state",
    leads_to="two conditions: whenever the first holds, the second does then or later",
    within="two conditions, and between them the most time from the first to the second",
    monitor="the file of a chart that watches, and never comes to its state `error`",
)
"""The kinds of property; a test keeps them equal to those of `fsmkit.system.properties.kinds`."""
OPERATION = table(REQ)
WATCH = named(watch="of a monitor: what it sees, `source -> name`")
REQUIRED = table(Key("req", "ids of the requirements that it states", Form.IDS))
"""The key of a property, beside its kind."""
OWN_ENVIRONMENT = named(
    may="events that may come, and inputs that may change, at any time",
    will="events that come some time, if they stay possible",
)
"""The environment of a chart."""

SYSTEM = named(
    system="the name of the system",
    doc="what it is for",
    req="ids of the requirements that it implements",
    parameters="names for values, which `--set` replaces",
    machines="its machines and their charts",
    shared="data that several machines read or write",
    connect="how events and outputs go from machine to machine",
    environment="external events and inputs, and charts that model them",
    schedule="the order in which machines run",
    properties="what is to be checked",
)
MACHINE = named(
    chart="its file",
    with_="values of its constants",
    start="start values of its data and inputs: name: value, or any",
)
CONNECTION = named(
    kind="direct, queued or lossy",
    capacity="messages that wait at most",
    loss="messages that are lost at most, or any",
    delay="how long a message travels",
    priority="on a bus that nodes share: 0 is the highest, before all without one",
)
ENVIRONMENT = named(
    may="events that may come, and inputs that may change, at any time",
    will="machines that act for it",
    world="the same: machines that are no part of the product",
    freezes="nodes that may freeze: their machines take no steps then",
)
FREEZE = named(
    machines="the machines of the node",
    silent="events by which machines of other nodes notice its silence",
    within="how long after it froze they notice it: at most, or from least to greatest",
    continues="how long after it froze it may still continue; without it, it never does",
)
SCHEDULE = named(
    cyclic="the machines in the order in which they run",
    period="the time from one cycle to the next",
    jitter="how much later a cycle may start",
)
MONITOR = {
    **named(monitor="the chart that watches", watch="what it sees of the machines"),
    **REQUIRED,
}
DEPLOYMENT = named(
    system="the file of the system",
    doc="what it is for",
    nodes="the nodes and their machines",
    links="how nodes reach each other",
    health="where each node answers how it is",
)
LINKS = table(
    Key("kind", "what carries the frames between nodes"),
    Key("endpoints", "where each node publishes", Form.TABLE),
    Key("curve", "the folder with the keys of the nodes"),
    Key("every", "levels are published in every so-many-th cycle"),
    Key("insecure", "true: beyond this computer without keys", Form.FLAG),
    Key(
        "watchdog",
        "the time from its last cycle until a node that hangs is silent; default 100ms",
    ),
    Key("foreign", "how the foreign nodes are reached", Form.RECORDS),
)
"""The keys of links that all carriers share; `system.deployment.keys` adds others."""
ADDRESS_KEYS = ("endpoints", "curve", "insecure")
"""The keys of endpoints and of their protection; a carrier that has endpoints lists them."""
NODE = named(machines="the machines of the node", foreign="what its programs speak")

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
"""Where a key belongs that is not valid in its object."""
BELONGS["type"] += "; a parallel state has `regions`, a final one `final: true`"
BELONGS["else"] = "write a list of transitions, of which the last has no `if`"
