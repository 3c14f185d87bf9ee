"""The messages of the protocol `fsmkit.live`, version 1, from a session to its clients.

Each is a JSON object whose ``k`` names its kind. States, events, data and machines are named,
transitions, which have no name, numbered; times are ticks. A client passes over keys and kinds
that it does not know: new ones do not change the version.
"""

from __future__ import annotations

from typing import Annotated, Any

import msgspec
from msgspec import UNSET, Meta, Struct, UnsetType

from fsmkit.emit import plain

PROTOCOL = 1
SUBPROTOCOL = "fsmkit.live.1"
"""The name of the protocol in the handshake of a WebSocket; it changes with `PROTOCOL`."""

Json = Any
"""A value as `values.to_json` writes it."""
Row = list[Json]
"""An effect: the words of its line in a trace; see `steps.rows_of`."""
Ticks = Annotated[int, Meta(description="ticks of the session")]
Number = Annotated[int, Meta(description="steps since the start of the session")]


class Message(Struct, frozen=True, omit_defaults=True, tag_field="k", forbid_unknown_fields=False):
    """A message to a client."""


class Named(Struct, frozen=True):
    """A machine of the session and the hash of its chart."""

    m: str
    chart: Annotated[str, Meta(pattern="^[0-9a-f]{16}$")]


class Hello(Message, frozen=True, tag="hello", kw_only=True):
    """The session: sent first, and again when a machine is added or removed."""

    protocol: int
    session: str
    name: str
    """Name of the chart or system."""
    time: str
    """``simulated``, ``recorded`` or ``live``."""
    tick_us: int
    at: Ticks
    n: Number
    can: list[str]
    """The commands that this source obeys."""
    machines: list[Named]
    readonly: bool = False
    signals: list[str] = []
    """Names of the sampled values of a plant."""
    seed: int = 1
    """Seed of the results of operations, in the interpreter."""
    file: str = ""
    """In files: where the chart or the system was read from, from there on."""
    client: int = 0
    """The number of the client that this is sent to."""


class State(Message, frozen=True, tag="state", kw_only=True):
    """All of a machine: at the start, every so many steps, after a gap, after ``seek``."""

    m: str
    n: Number
    at: Ticks
    on: list[str]
    """The active states in document order, without the root."""
    data: dict[str, Json]
    inputs: dict[str, Json]
    outputs: dict[str, Json]
    queue: list[Row]
    deferred: list[Row]
    timers: list[tuple[int | str, int]]
    """The transition or delayed event of each timer, and its deadline."""
    status: str
    """``before`` (the start), ``running``, ``finished`` or ``fault``."""
    fault: str = ""
    invoked: dict[str, list[str]] = {}
    known: bool = True
    """False: data, inputs, outputs, queues and timers are as they were last known, if ever."""


class Part(Struct, frozen=True, omit_defaults=True, kw_only=True):
    """The part of a step that an invoked machine took."""

    at: Ticks
    cause: Row
    do: list[Row]
    on: list[str]
    """Its active leaves afterwards, and ``finished`` if it is."""


class Step(Message, frozen=True, tag="step", kw_only=True):
    """A macrostep, with all state that it changed."""

    m: str
    n: Number
    at: Ticks
    cause: Row
    do: list[Row]
    on: list[str] | UnsetType = UNSET
    set: dict[str, Json] | UnsetType = UNSET
    """Data and outputs that changed."""
    timers: list[tuple[int | str, int]] | UnsetType = UNSET
    queue: list[Row] | UnsetType = UNSET
    deferred: list[Row] | UnsetType = UNSET
    status: str | UnsetType = UNSET
    fault: str | UnsetType = UNSET


class Set(Message, frozen=True, tag="set", kw_only=True):
    """Inputs and data that changed, by a client or by a wire from another machine; no step.

    Or results of operations, by a client.
    """

    m: str
    n: Number
    at: Ticks
    inputs: dict[str, Json]
    data: dict[str, Json] = {}
    """Data that a client changed by hand."""
    results: dict[str, list[Json]] = {}
    """The next results of an operation, one per call; the last one repeats."""
    by: int = 0
    """The number of that client, where there were several."""


class Post(Message, frozen=True, tag="post", kw_only=True):
    """An event that a client put in the queue of a machine, or that found no room there."""

    m: str
    n: Number
    at: Ticks
    event: Row
    how: str
    """``queued``, or ``refused`` because the queue is full."""
    by: int = 0
    """The number of that client, where there were several."""


class Pass(
    Message, frozen=True, tag="pass", kw_only=True, rename={"source": "from", "target": "to"}
):
    """An event from machine to machine; ``from`` and ``to`` are a machine and its event."""

    n: Number
    at: Ticks
    source: tuple[str, str]
    target: tuple[str, str]
    values: list[Json]
    how: str
    """``queued``, or ``refused`` because the queue is full."""


class Again(Message, frozen=True, tag="again", kw_only=True):
    """The entries that a client requested from the history follow, up to its ``done``."""

    first: Number
    last: Number


class Log(Message, frozen=True, tag="log", kw_only=True):
    """The text of a breakpoint that does not stop."""

    n: Number
    at: Ticks
    number: int
    """Number of the breakpoint."""
    text: str


class Lost(Message, frozen=True, tag="lost", kw_only=True):
    """Records are missing; the states are unknown until a ``state`` message arrives."""

    n: Number
    at: Ticks
    count: int
    where: str
    """``client`` (it read too slowly); of a target: ``ring``, ``frame`` or ``link``."""
    m: str = ""
    """The machine; empty: any machine."""


class Signals(Message, frozen=True, tag="signals", kw_only=True):
    """Sampled values of a plant, at most 60 times a second."""

    n: Number
    at: Ticks
    v: list[Json]
    """In the order of ``signals`` in ``hello``."""


class Mode(Message, frozen=True, tag="mode", kw_only=True):
    """Whether the session runs, and which step is in view."""

    mode: str
    """``running`` or ``paused``; for an external program ``following`` or ``frozen``."""
    n: Number
    """The step in view."""
    head: Number
    """The last step of this branch."""
    at: Ticks
    branch: int = 0
    """Number of branches that commands at past steps have started."""
    first: Number = 0
    """The first step that is still known."""
    speed: float = 1.0
    """Simulated seconds in a second; 0: as fast as can be."""
    why: list[Json] = []
    """``["breakpoint", 3]``, ``["fault", "range"]``, ``["property", "P2"]`` ..."""


class Broken(Message, frozen=True, tag="broken", kw_only=True):
    """The present errors of a watched file; the session continues with the previous version."""

    findings: list[dict[str, Json]]
    """As ``--json`` prints them; none: it is right again."""


class Points(Message, frozen=True, tag="points", kw_only=True):
    """All breakpoints of the session, whoever set them; sent when they change."""

    points: list[dict[str, Json]]
    """Each with its ``number`` and the fields of the command ``break``."""


class ChartOf(Message, frozen=True, tag="chart", kw_only=True):
    """A chart, once for each hash."""

    chart: str
    name: str
    states: list[dict[str, Json]]
    transitions: list[dict[str, Json]]
    events: list[dict[str, Json]]
    data: list[dict[str, Json]]
    inputs: list[dict[str, Json]]
    outputs: list[dict[str, Json]]
    constants: list[dict[str, Json]]
    sources: list[dict[str, str]]
    operations: list[dict[str, Json]] = []
    """Those that return something, with its type."""
    hides: list[str] = []
    """Parts that the drawing can omit; see the command ``chart``."""
    folds: list[str] = []
    """The states that a drawing can show as boxes without content."""
    folded: list[str] = []
    """The states that this drawing shows so."""
    svg: str = ""
    """A drawing with the ids `s12`, `t25`, `w25`; empty if it was not requested or failed."""
    undrawn: str = ""
    """Why there is no drawing; empty if there is one, or none was requested."""


class Done(Message, frozen=True, tag="done", kw_only=True):
    """The answer to a command that was obeyed."""

    re: int
    result: Json = None


class Refused(Message, frozen=True, tag="refused", kw_only=True):
    """The answer to a command that was not obeyed: a finding."""

    re: int
    rule: str
    message: str
    help: str = ""


AnyMessage = (
    Hello | State | Step | Set | Post | Pass | Again | Log | Lost | Signals | Mode | Broken | Points
    | ChartOf | Done | Refused
)  # fmt: skip
_encoder = msgspec.json.Encoder(enc_hook=plain)  # JSON quotes any text
_decoder: msgspec.json.Decoder[AnyMessage] = msgspec.json.Decoder(AnyMessage)


def to_json(message: AnyMessage) -> bytes:
    """Return a message as JSON, without a line feed."""
    return encoded(message)


def encoded(value: object) -> bytes:
    """Return data as JSON; bytes of a path that are no text become ``?``."""
    try:
        return _encoder.encode(value)
    except UnicodeEncodeError:
        return _encoder.encode(_encodable(msgspec.to_builtins(value, enc_hook=plain)))


def _encodable(value: object) -> object:
    """Return plain data whose strings UTF-8 can encode."""
    match value:
        case str():
            return value.encode("utf-8", "replace").decode()
        case dict():
            return {_encodable(key): _encodable(each) for key, each in value.items()}
        case list() | tuple():
            return [_encodable(each) for each in value]
        case _:
            return value


def from_json(text: bytes | str) -> AnyMessage:
    """Return the message of a text; `msgspec.ValidationError`, a `ValueError`, for none of ours."""
    return _decoder.decode(text)


def schema() -> dict[str, Any]:
    """Return the JSON Schema of all messages."""
    return msgspec.json.schema(AnyMessage)
