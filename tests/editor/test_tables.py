"""What the editor knows of keys is what the readers know."""

from __future__ import annotations

from fsmkit.editor.cursor.yaml_slots import EXPECTED, SUITE, TABLES
from fsmkit.testing.reading import EXPECTATIONS, KEYS


def test_keys_of_tests_are_those_that_are_read() -> None:
    assert tuple(EXPECTED) == EXPECTATIONS
    assert tuple(SUITE) == KEYS


def test_each_key_has_a_line_of_documentation() -> None:
    assert [row.name for table in TABLES.values() for row in table.values() if not row.doc] == []
