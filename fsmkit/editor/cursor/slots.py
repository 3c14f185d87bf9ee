"""Slots: the permitted contents at a cursor."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum

from fsmkit.document.keys import Key, Keys


class What(Enum):
    """The kind of text that a place takes."""

    KEY = "a key"
    ELEMENT = "an element"
    WORD = "one of some words"
    STATE = "states"
    INHERITED_STATE = "an inherited state"
    INITIAL = "states below the current one"
    EVENT = "incoming events"
    OVERRIDE = "an inherited transition"
    EXPRESSION = "an expression"
    STATEMENTS = "statements"
    DELAY = "a delay"
    TYPE = "a type, and a start value"
    SIGNATURE = "a signature"
    FILE = "a file"
    CONSTANT = "a constant of the chart of a machine"
    WIRE = "a connection"
    POSSIBLE = "an event or input of a machine, or a machine"
    CONDITION = "a condition over machines"
    MACHINE = "machines"
    PORT = "an input, an event or an operation of a machine"
    STEP = "a step of a test"
    TESTED_STATE = "a state of the chart under test"
    TESTED_CALL = "an operation of the chart under test"
    TESTED_EVENT = "an event that the chart under test sends"
    TESTED_CONDITION = "a condition over the chart under test"
    NOTHING = "a new name, or prose"


@dataclass(frozen=True, slots=True)
class Slot:
    """The position of a cursor.

    ``text`` is the word before the cursor, ``state`` the enclosing state, ``events`` those of the
    enclosing transition, ``machine`` the enclosing entry.
    """

    what: What
    text: str = ""
    table: Keys = field(default_factory=dict)
    given: frozenset[str] = frozenset()
    """Keys that are there already."""
    words: tuple[str, ...] = ()
    state: str = ""
    events: tuple[str, ...] | None = None
    machine: str = ""
    suffixes: tuple[str, ...] = ()
    row: Key | None = None
