"""Reserved words as names, a part of ``python -m tests.injection.words``: each is only a name."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.injection.outputs import OUTPUTS
from tests.injection.words import NOTATIONS, tried

FEW = 12
"""So many words of a notation; all: ``python -m tests.injection.words``."""
TRIED = [
    ("members", "c", "machines in C"),
    ("in_events", "c", "cases"),
    ("charts", "c of a system", "cases"),
    ("fields", "javascript", "JavaScript"),
    ("data", "promela", "Promela"),
    ("data", "uppaal flat", "UPPAAL"),
]
"""Some kinds of names, through some outputs, as the words of some notation."""


@pytest.mark.slow
@pytest.mark.external
@pytest.mark.parametrize(("kind", "output", "notation"), TRIED)
def test_a_reserved_word_is_a_name(kind: str, output: str, notation: str, tmp_path: Path) -> None:
    (found,) = (each for each in OUTPUTS if each.name == output)
    tally = tried(kind, sorted(NOTATIONS[notation])[-FEW:], [found], tmp_path)
    assert not tally.wrong, "\n".join(tally.wrong)
    assert tally.right
    assert not tally.rejected


@pytest.mark.slow
@pytest.mark.cc
def test_letters_beyond_ascii_stay_distinct_in_models(tmp_path: Path) -> None:
    (jani,) = (each for each in OUTPUTS if each.name == "jani")
    tally = tried("states", NOTATIONS["letters"], [jani], tmp_path)
    assert not tally.wrong
    text = next(tmp_path.rglob("*.jani")).read_text(encoding="utf-8")
    assert "oeffnen" in text
    assert "pusk" in text
