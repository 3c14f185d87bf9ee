"""Frozen dataclasses that are made fast behave as those that are not."""

from __future__ import annotations

import pickle
from dataclasses import FrozenInstanceError, dataclass, field, replace

import pytest

from fsmkit.diagnostics.fast_init import fast_init


@fast_init
@dataclass(frozen=True, slots=True)
class Pair:
    """Two values, the second of which is checked."""

    first: int
    second: str = "two"
    place: int = field(default=0, compare=False)

    def __post_init__(self) -> None:
        if not self.second:
            raise ValueError(self.first)


@fast_init
@dataclass(frozen=True, slots=True)
class Derived(Pair):
    """One with the same fields."""


def test_it_is_made_as_before() -> None:
    made = Pair(1, place=7)
    assert (made.first, made.second, made.place) == (1, "two", 7)
    assert repr(made) == "Pair(first=1, second='two', place=7)"
    assert made == Pair(first=1)
    assert hash(made) == hash(Pair(1))
    assert made != Derived(1)
    assert replace(made, first=3) == Pair(3)
    assert pickle.loads(pickle.dumps(made)).place == 7
    assert Derived(2, "b").second == "b"
    with pytest.raises(ValueError, match="1"):
        Pair(1, "")
    with pytest.raises(TypeError):
        Pair()  # type: ignore[call-arg]


def test_it_stays_frozen() -> None:
    with pytest.raises(FrozenInstanceError):
        Pair(1).first = 2  # type: ignore[misc]


def test_fields_that_are_not_plain_are_refused() -> None:
    @dataclass(frozen=True, slots=True)
    class Listed:
        values: list[int] = field(default_factory=list)

    @dataclass(frozen=True, slots=True, kw_only=True)
    class Named:
        value: int

    for kind in (Listed, Named):
        with pytest.raises(TypeError, match="keyword-only"):
            fast_init(kind)
