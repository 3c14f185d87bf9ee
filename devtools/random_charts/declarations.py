"""Random declarations: types, constants, variables, operations, events."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import fsmkit.language as lang
from devtools.random_charts.choices import Choices
from devtools.random_charts.content import SENT, TURNS, Event
from devtools.random_charts.vocabulary import Named, Operation, literal, literal_array
from fsmkit.document.document import Direction

COLOR = lang.EnumType("Color", ("red", "green", "blue"))
PAIR = lang.RecordType(
    "Pair",
    (
        lang.Field("a", lang.IntType(0, 9)),
        lang.Field("b", lang.BOOL),
        lang.Field("c", lang.MACHINE_INTEGERS["int16"]),
    ),
)
BYTES = lang.ArrayType(lang.MACHINE_INTEGERS["uint8"], 3)
"""Types of payloads; a variable of each exists if a payload needs it."""
RANGES = (
    lang.IntType(0, 9),
    lang.IntType(0, 3),
    lang.IntType(-5, 5),
    lang.IntType(0, 4000),
    lang.IntType(1, 6),
    lang.IntType(0, 3, lang.Overflow.WRAP),
    lang.IntType(-2, 7, lang.Overflow.WRAP),
    lang.IntType(-100000, 100000),
    lang.IntType(0, 20, lang.Overflow.FAULT),
)
INPUTS: tuple[lang.Type, ...] = (lang.BOOL, lang.IntType(0, 9), lang.IntType(0, 4000), COLOR)
OUTPUTS: tuple[lang.Type, ...] = (lang.BOOL, lang.IntType(0, 4000), COLOR, lang.IntType(-5, 5))
REPLIES: tuple[lang.Type, ...] = (lang.IntType(0, 3), lang.BOOL)
ELEMENTS: tuple[lang.Type, ...] = (
    lang.IntType(0, 9),
    lang.MACHINE_INTEGERS["uint8"],
    lang.BOOL,
    lang.MACHINE_INTEGERS["int16"],
    COLOR,
)


@dataclass(frozen=True, slots=True)
class Declared:
    """The declarations of a random chart. Variables are ``(name, type, start value)``."""

    types: tuple[lang.EnumType | lang.RecordType, ...]
    constants: tuple[tuple[str, int], ...]
    data: tuple[tuple[str, lang.Type, str | None], ...]
    inputs: tuple[tuple[str, lang.Type, str], ...]
    outputs: tuple[tuple[str, lang.Type, str], ...]
    operations: tuple[Operation, ...]
    events: tuple[Event, ...]

    @property
    def variables(self) -> tuple[Named, ...]:
        """All variables, as expressions know them."""
        written = tuple(Named(name, type_) for name, type_, _ in (*self.data, *self.outputs))
        read = tuple(Named(name, type_, writable=False) for name, type_, _ in self.inputs)
        counters = tuple(
            Named(name, lang.IntType(0, 100), writable=False) for name in (SENT, TURNS)
        )
        return (*written, *read, *counters)


def declare(choices: Choices) -> Declared:
    """Return random declarations; the first event is always received and has no payload."""
    operations = tuple(_operation(choices, n) for n in range(choices.integer(0, 3)))
    events = _events(choices)
    fields = [f.type for e in events for f in e.fields]
    fields += [f.type for o in operations for f in o.parameters]
    return Declared(
        (COLOR, PAIR),
        (("K0", choices.integer(0, 5)),) if choices.chance(30) else (),
        _data(choices, needed=fields),
        tuple((f"i{n}", choices.pick(INPUTS), "") for n in range(choices.integer(0, 2))),
        tuple(
            (f"o{n}", type_, literal(choices, type_))
            for n in range(choices.integer(0, 2))
            for type_ in (choices.pick(OUTPUTS),)
        ),
        operations,
        events,
    )


def _data(
    choices: Choices, needed: Sequence[lang.Type]
) -> tuple[tuple[str, lang.Type, str | None], ...]:
    """Return variables; one of each ``needed`` type of whose values there are no literals."""
    found: list[tuple[str, lang.Type, str | None]] = []
    for n in range(choices.integer(0, 5)):
        type_ = _scalar(choices)
        found.append((f"v{n}", type_, literal(choices, type_)))
    if choices.chance(35):
        array = lang.ArrayType(choices.pick(ELEMENTS), choices.integer(1, 4))
        found.append(("a", array, literal_array(choices, array)))
        if choices.chance(60):
            found.append(("item", array.element, literal(choices, array.element)))
    if choices.chance(25):
        found.append(("w", lang.DURATION, literal(choices, lang.DURATION)))
    if PAIR in needed or choices.chance(20):
        found.append(("r", PAIR, None))
    if BYTES in needed:
        found.append(("bytes", BYTES, literal_array(choices, BYTES)))
    return tuple(found)


def _scalar(choices: Choices) -> lang.Type:
    kind = choices.integer(0, 19)
    if kind < 9:
        return RANGES[kind]
    if kind < 12:
        return lang.BOOL
    if kind < 17:
        return choices.pick(tuple(lang.MACHINE_INTEGERS.values()))
    if kind == 17:
        return COLOR
    return lang.SYMBOL if kind == 18 else choices.pick((lang.FLOAT64, lang.FLOAT64, lang.FLOAT32))


def _field_types() -> tuple[lang.Type, ...]:
    return (
        *(
            lang.IntType(0, 9),
            lang.BOOL,
            COLOR,
            lang.IntType(-5, 5),
            lang.MACHINE_INTEGERS["int16"],
        ),
        *(lang.IntType(0, 4000), lang.SYMBOL, PAIR, BYTES),
    )


def _fields(choices: Choices, most: int) -> tuple[lang.Field, ...]:
    count = choices.integer(0, most)
    return tuple(lang.Field(f"p{n}", choices.pick(_field_types())) for n in range(count))


def _operation(choices: Choices, number: int) -> Operation:
    results: tuple[lang.Type | None, ...] = (
        None,
        lang.BOOL,
        lang.IntType(0, 9),
        COLOR,
        None,
        lang.IntType(-5, 5),
    )
    return Operation(f"op{number}", _fields(choices, 2), choices.pick(results))


def _events(choices: Choices) -> tuple[Event, ...]:
    received = frozenset({Direction.IN})
    events = [Event("e0", (), received)]
    for n in range(1, choices.integer(1, 4)):
        name = choices.pick((f"e{n}", f"e{n}", f"group.g{n}"))
        reply = choices.pick(REPLIES) if choices.chance(40) else None
        events.append(Event(name, _fields(choices, 2), received, reply))
    inner, out = frozenset({Direction.INTERNAL}), frozenset({Direction.OUT})
    count = choices.integer(0, 2)
    events += [Event(f"n{n}", _fields(choices, 1), inner) for n in range(count)]
    count = choices.integer(0, 2)
    events += [Event(f"out{n}", _fields(choices, 2), out) for n in range(count)]
    if choices.chance(10):
        both = frozenset({Direction.IN, Direction.OUT})
        events.append(Event("both", _fields(choices, 1), both))
    return tuple(events)
