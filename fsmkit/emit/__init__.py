"""Indented text and identifiers; knows no language but the names a language reserves."""

from fsmkit.emit.emitter import Emitter
from fsmkit.emit.identifiers import Namer, legal, snake
from fsmkit.emit.transliteration import transliterated

__all__ = ["Emitter", "Namer", "legal", "snake", "transliterated"]
