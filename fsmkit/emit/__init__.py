"""Print source of other languages: indentation, identifiers, and safe insertion of chart strings.

Each language has a module; `written` guards strings of charts. Identifiers are built here and by
the tables of names of each language, which choose every character.
"""

from fsmkit.emit.emitter import Emitter
from fsmkit.emit.identifiers import Namer, legal, snake
from fsmkit.emit.transliteration import transliterated
from fsmkit.emit.written import (
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
    "Emitter",
    "Identifier",
    "Namer",
    "RawText",
    "Written",
    "guard",
    "legal",
    "notating",
    "plain",
    "printing",
    "snake",
    "telling",
    "transliterated",
]
