"""Offsets and positions, in each encoding of columns."""

from __future__ import annotations

import pytest
from lsprotocol.types import Position, PositionEncodingKind

from fsmkit.editor.positions import Lines

TEXT = "a: 'ä𝄞x'\r\nb: 1\rc: 2\n\nd"
COLUMNS = {
    PositionEncodingKind.Utf8: 10,
    PositionEncodingKind.Utf16: 7,
    PositionEncodingKind.Utf32: 6,
}


@pytest.mark.parametrize("encoding", COLUMNS)
def test_positions_and_offsets_are_inverse(encoding: PositionEncodingKind) -> None:
    lines = Lines(TEXT, encoding)
    assert lines.position(TEXT.index("x")) == Position(0, COLUMNS[encoding])
    for offset in range(len(TEXT) + 1):
        position = lines.position(offset)
        if TEXT[offset - 1 : offset + 1] != "\r\n" and TEXT[offset : offset + 1] not in "\r\n":
            assert lines.offset(position) == offset
    assert [lines.position(TEXT.index(c)).line for c in "bcd"] == [1, 2, 4]


def test_what_lies_beyond_is_kept_within() -> None:
    lines = Lines("ab\ncd", PositionEncodingKind.Utf16)
    assert lines.offset(Position(0, 99)) == 2
    assert lines.offset(Position(99, 0)) == 5
    assert lines.position(99) == Position(1, 2)
