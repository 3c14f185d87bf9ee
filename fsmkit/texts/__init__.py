"""The one door through which text of a chart enters text of another language.

A module for each language; `written` is the guard that keeps the door. Identifiers are made by
`fsmkit.emit` and by the tables of names of each language, of which every character is chosen.
"""

from fsmkit.texts.written import (
    Identifier,
    RawText,
    Written,
    guard,
    notating,
    plain,
    printing,
    telling,
)

__all__ = [
    "Identifier",
    "RawText",
    "Written",
    "guard",
    "notating",
    "plain",
    "printing",
    "telling",
]
