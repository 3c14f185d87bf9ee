"""Find the key, attribute or element at an offset, with its row of the key table."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

from fsmkit.diagnostics import Source
from fsmkit.document.keys import Key
from fsmkit.editor.cursor.scxml_slots import scxml_slot
from fsmkit.editor.cursor.slots import Slot, What
from fsmkit.editor.cursor.yaml_frames import frames_at
from fsmkit.editor.cursor.yaml_slots import yaml_slot
from fsmkit.editor.index.files import SCXML_MARK, TOP_KEY, Kind, kind_of_keys

WORD = re.compile(r"[\w:.-]+")


@dataclass(frozen=True, slots=True)
class KeyAt:
    """A key and its place."""

    row: Key
    start: int
    end: int


def slot_at(path: Path, source: Source, offset: int) -> Slot:
    """Return the slot at an offset."""
    text = source.text
    if path.name.lower().endswith((".yaml", ".yml")):
        kind = kind_of_keys(set(TOP_KEY.findall(text)))
        return yaml_slot(frames_at(text, offset), kind)
    if SCXML_MARK.search(text) is None and text.strip():
        return Slot(What.NOTHING)
    return scxml_slot(text, offset)


def key_at(path: Path, source: Source, offset: int) -> KeyAt | None:
    """Return the known key at an offset, or None."""
    text = source.text
    start = end = offset
    while start > 0 and WORD.fullmatch(text[start - 1]):
        start -= 1
    while end < len(text) and WORD.fullmatch(text[end]):
        end += 1
    word = text[start:end].rstrip(":")
    if not word:
        return None
    slot = slot_at(path, source, start)
    row = slot.table.get(word) if slot.what is What.KEY else None
    return None if row is None or not row.doc else KeyAt(row, start, start + len(word))


def kind_at(path: Path, source: Source) -> Kind:
    """Return the kind of a file by its first lines."""
    if path.name.lower().endswith((".yaml", ".yml")):
        return kind_of_keys(set(TOP_KEY.findall(source.text)))
    return Kind.CHART if SCXML_MARK.search(source.text) is not None else Kind.OTHER
