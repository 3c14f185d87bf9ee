"""The priced parts: for each, a machine with it and a machine without it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

from benchmarks.overhead.pump import (
    CALLING,
    PLAIN,
    TAKEN,
    TIMED,
    Program,
    dispatched,
    pump,
    unguarded,
)

Pair = tuple[Program, Program]
LEAN = ("queue", "counters")
POSTED = (
    "for (unsigned i = 0; i < 2u; i++) { pump_event e = PUMP_NO_EVENT; "
    "e.event = (uint8_t)(i == 0u ? PUMP_EVENT_START : PUMP_EVENT_STOP); "
    "(void)pump_post(m, &e); pump_run(m, 0u); }"
)
EMPTIED = "fsm_records_rtt.up.read = fsm_records_rtt.up.write;"
"""What a debug probe does meanwhile."""
SAVED = "static uint8_t bytes[PUMP_SAVED_BYTES]; (void)pump_save(m, 0u, bytes);"
RESTORED = f"{SAVED} (void)pump_restore(m, 0u, bytes, sizeof bytes);"


@dataclass(frozen=True, slots=True)
class Part:
    """A part, where it is used and where it is not: the machine with it, then that without."""

    name: str
    event: str
    """Whose instructions are counted where it is used."""
    used: Callable[[], Pair]
    unused: Callable[[], Pair] | None
    """None: it is in every machine that is not made without it."""
    remark: str = ""


def _lean(text: str = PLAIN, *extras: str) -> Program:
    return pump(text, without=LEAN, extras=extras)


def _traced(*macros: str) -> Program:
    sources = ("pump_trace.c", "fsm_trace.c", "pump_info.c", "fsm.c")
    made = replace(_lean(PLAIN, "trace"), sources=sources)
    return replace(made, macros=macros)


def _recorded(level: int) -> Program:
    sources = ("pump_records.c", "fsm_records.c", "pump_info.c", "fsm.c")
    made = replace(_lean(PLAIN, "records"), sources=sources)
    return replace(made, macros=(f"-DFSM_TRACE_LEVEL={level}",)).doing(f"{TAKEN} {EMPTIED}", 2)


def _saving() -> Program:
    made = _lean(PLAIN, "save")
    return replace(made, sources=(*made.sources, "pump_info.c", "fsm_save.c"))


def _counters() -> Pair:
    ignored = dispatched("check")
    return pump(PLAIN, without=("queue",)).doing(ignored), _lean().doing(ignored)


def _queue() -> Pair:
    made = pump(PLAIN, without=("counters",)).calling("post", "run")
    return made.doing(POSTED, 2), _lean()


PARTS = (
    Part(
        "queue", "posted and run instead of dispatched",
        _queue,
        lambda: (pump(PLAIN, without=("counters",)), _lean()),
        "its RAM goes with `--without queue`",
    ),
    Part(
        "counters", "that enables nothing",
        _counters,
        None,
        "gone with `--without counters`",
    ),
    Part(
        "timers", "that arms a timer, or cancels one",
        lambda: (_lean(TIMED).calling("run", "next_deadline"), _lean()),
        lambda: (_lean(), replace(_lean(), sources=("pump.c",))),
    ),
    Part(
        "run-to-completion guard", "taken",
        lambda: (_lean(CALLING), unguarded(_lean(CALLING))),
        lambda: (_lean(), unguarded(_lean())),
    ),
    Part(
        "trace: ring of 64 transitions", "taken",
        lambda: (_traced().calling("fsm_trace_dump"), _lean()),
        lambda: (_lean(PLAIN, "trace"), _lean()),
    ),
    Part(
        "trace: log", "taken",
        lambda: (_traced("-DFSM_LOGGED", "-DFSM_TRACE_RECORDS=0"), _lean()),
        lambda: (_lean(PLAIN, "trace"), _lean()),
    ),
    Part(
        "records of level 1, ring of 1,024 bytes", "taken",
        lambda: (_recorded(1), _lean()),
        lambda: (_lean(PLAIN, "records"), _lean()),
    ),
    Part(
        "records of level 2, ring of 1,024 bytes", "taken",
        lambda: (_recorded(2), _lean()),
        lambda: (_lean(PLAIN, "records"), _lean()),
        "three records: the event, the transition, the end of the call",
    ),
    Part(
        "snapshots: save", "taken",
        lambda: (_saving().calling("save"), _lean()),
        lambda: (_saving(), _lean()),
    ),
    Part(
        "snapshots: save, restore", "taken",
        lambda: (_saving().calling("save", "restore"), _lean()),
        lambda: (_saving(), _lean()),
    ),
)  # fmt: skip


@dataclass(frozen=True, slots=True)
class Call:
    """The cost of a call that is not an event."""

    name: str
    with_it: Callable[[], Program]
    without_it: Callable[[], Program]


def _armed(turn: str) -> Program:
    return _lean(TIMED).doing(turn)


NOT_DUE = dispatched("start") + " pump_run(m, 1u);"
CALLS = (
    Call(
        "`run`, a timer is armed and not due",
        lambda: _armed(NOT_DUE), lambda: _armed(dispatched("start")),
    ),
    Call(
        "`run`, no timer is armed",
        lambda: _armed("pump_run(m, 1u);"), lambda: _armed(""),
    ),
    Call("`save`", lambda: _saving().doing(SAVED), lambda: _saving().doing("")),
    Call("`restore`", lambda: _saving().doing(RESTORED), lambda: _saving().doing(SAVED)),
)  # fmt: skip
