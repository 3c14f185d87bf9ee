"""The commands of the protocol `fsmkit.live`; each gets one response."""

from __future__ import annotations

from typing import Any

import msgspec
from msgspec import Struct

from fsmkit.diagnostics import FsmkitError, fail

MOST_BYTES = 65_536
"""Maximum size of a command, in bytes."""


class Command(Struct, frozen=True, tag_field="do", kw_only=True):
    """A command of a client; the response repeats its ``id``."""

    id: int


class _Numbered(Struct):
    id: int


class Post(Command, frozen=True, tag="post", kw_only=True, rename={"payload": "with"}):
    """Put an event in the queue of a machine; ``with``: its fields by name."""

    m: str
    event: str
    payload: dict[str, Any] = {}


class SetInput(Command, frozen=True, tag="set", kw_only=True):
    """Give an input another value."""

    m: str
    input: str
    value: Any


class Returns(Command, frozen=True, tag="returns", kw_only=True):
    """Give the results of an operation from here on, one a call; the last one stays."""

    m: str
    operation: str
    results: list[Any]


class Change(Command, frozen=True, tag="change", kw_only=True):
    """Give a datum another value by hand, which no host can: a script cannot do it again."""

    m: str
    data: str
    value: Any


class Run(Command, frozen=True, tag="run", kw_only=True):
    """Go on; ``speed``: simulated seconds in a second, 0 for as fast as can be.

    Without it the session keeps its speed.
    """

    speed: float | None = None
    until: str = ""
    """A condition at which it stops, once."""


class Pause(Command, frozen=True, tag="pause"):
    """Pause the session."""


class StepOn(Command, frozen=True, tag="step", kw_only=True):
    """Advance by one step (``macro``), to the next deadline (``timer``), or one tick (``tick``).

    ``time``: advance to the time ``at`` (ticks), including timers that expire then.
    """

    how: str = "macro"
    at: int = 0


class Back(Command, frozen=True, tag="back", kw_only=True):
    """Move the view to an earlier step.

    ``to``: the last entry that hit any breakpoint or fault (``breakpoint``), or a kind of
    breakpoint described by ``m`` and ``what``.
    """

    count: int = 1
    to: str = ""
    m: str = ""
    what: str | int = ""


class Forward(Command, frozen=True, tag="forward", kw_only=True):
    """Look at a later step."""

    count: int = 1


class Seek(Command, frozen=True, tag="seek", kw_only=True):
    """Look at a step, by number or as the last one at a time (ticks)."""

    n: int | None = None
    at: int | None = None


class Break(Command, frozen=True, tag="break", kw_only=True, rename={"guard": "if"}):
    """Stop where something happens: see `breakpoints`.

    It lets pass ``after`` times, then counts each ``every``-th one, so many ``times`` (0: always).
    With ``log``, a text with expressions in braces, it sends that and does not stop.
    """

    on: str
    m: str = ""
    what: str | int = ""
    guard: str = ""
    after: int = 0
    every: int = 1
    times: int = 0
    log: str = ""


class Unbreak(Command, frozen=True, tag="unbreak", kw_only=True):
    """Remove a breakpoint."""

    number: int


class Watch(Command, frozen=True, tag="watch", kw_only=True):
    """Return the value of an expression at the step in view; ``m``: whose names it has."""

    expression: str
    m: str = ""


class Why(Command, frozen=True, tag="why", kw_only=True, rename={"payload": "with"}):
    """Return the effect of an event at the step in view, and the guards that block it."""

    m: str
    event: str
    payload: dict[str, Any] | None = None


class Events(Command, frozen=True, tag="events", kw_only=True):
    """Return for each event that a machine receives whether it would do something now."""

    m: str


class Micro(Command, frozen=True, tag="micro", kw_only=True):
    """Return the microsteps of a step."""

    n: int


class ChartRequest(Command, frozen=True, tag="chart", kw_only=True):
    """Send a chart by its hash; ``hide``: transitions that the drawing omits.

    These are ``inherited`` ones, and ``watchdogs``: timeouts that only report a fault. ``fold``:
    composite states drawn as boxes without content. Without it a small chart has none, and a large
    chart its outer ones, which the result names. ``drawn`` false: omit the drawing, which takes a
    second for a large chart.
    """

    chart: str
    hide: list[str] = []
    fold: list[str] | None = None
    drawn: bool = True


class Find(Command, frozen=True, tag="find", kw_only=True, rename={"guard": "if", "first": "from"}):
    """Return the next hit after the entry ``from``, or the last before it (``back``).

    The hit is described as in ``break``. The result is ``{"n": entry}``, ``{"from": entry}`` to
    continue the search from, or nothing.
    """

    on: str
    m: str = ""
    what: str | int = ""
    guard: str = ""
    first: int
    back: bool = False


class History(Command, frozen=True, tag="history", kw_only=True, rename={"first": "from"}):
    """Send the entries from a step on again."""

    first: int = 1
    last: int | None = None


class Branches(Command, frozen=True, tag="branches"):
    """Return the branches that were left by a command at a step of the past."""


class Fork(Command, frozen=True, tag="fork", kw_only=True):
    """Switch to the end of another branch; without a number, start one here in the interpreter."""

    branch: int | None = None


class Follow(Command, frozen=True, tag="follow"):
    """Move to the newest entry of an external program and follow it."""


class Open(Command, frozen=True, tag="open", kw_only=True):
    """Open a source of the charts at a line, in an editor on the machine of the session."""

    file: str
    line: int = 1


class PictureRequest(Command, frozen=True, tag="picture"):
    """Return the picture of the plant and its bindings; null if the session has none."""


class Save(Command, frozen=True, tag="save", kw_only=True, rename={"kind": "as"}):
    """Return the session as ``script``, ``pytest``, ``c``, ``sequence`` or ``live``."""

    kind: str


AnyCommand = (
    Post | SetInput | Returns | Change | Run | Pause | StepOn | Back | Forward | Seek | Break
    | Unbreak | Watch | Why | Events | Micro | Find | ChartRequest | History | Branches | Fork
    | Follow | Save | Open | PictureRequest
)  # fmt: skip
CHANGING = (
    Post, SetInput, Returns, Change, Run, Pause, StepOn, Back, Forward, Seek, Break, Unbreak, Fork,
    Follow, Open,
)  # fmt: skip
"""Commands that affect other clients; a read-only client must not give them."""
NAMES = [
    "post", "set", "returns", "change", "run", "pause", "step", "back", "forward", "seek", "break",
    "unbreak", "watch", "why", "events", "micro", "find", "chart", "history", "branches", "fork",
    "follow", "save", "open", "picture",
]  # fmt: skip
_decoder: msgspec.json.Decoder[AnyCommand] = msgspec.json.Decoder(AnyCommand)


def read_command(text: str | bytes) -> AnyCommand:
    """Parse a command; raises `FsmkitError` (``wrong-command``) if it is invalid."""
    if len(text) > MOST_BYTES:
        raise wrong(f"the command has more than {MOST_BYTES} bytes")
    try:
        return _decoder.decode(text)
    except (ValueError, RecursionError) as error:
        raise wrong(f"this is not a command: {error}") from error


def id_of(text: str | bytes) -> int:
    """Return the number of a command that is otherwise wrong; 0 if it has none."""
    try:
        return msgspec.json.decode(text, type=_Numbered).id
    except (ValueError, RecursionError):
        return 0


def wrong(message: str, help_: str | None = None) -> FsmkitError:
    """Return the error for a command that cannot be obeyed."""
    return fail("wrong-command", message, help=help_)
