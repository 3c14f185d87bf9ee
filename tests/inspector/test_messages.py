"""The protocol says of a macrostep what its trace says, whatever the chart."""

from __future__ import annotations

from functools import cache

import jsonschema
import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from devtools.differential import random_case
from fsmkit.language import FLOAT64, INT64, EnumType, Field, RecordType, Type, Value
from fsmkit.language.types import ArrayType
from fsmkit.runtime.interpreter.snapshot import Macrostep
from fsmkit.runtime.interpreter.trace import active_leaves, trace_lines
from fsmkit.runtime.live.lines import lines_of
from fsmkit.runtime.live.messages import Step, from_json, schema, to_json
from fsmkit.runtime.live.steps import state_of, step_of
from fsmkit.runtime.live.values import from_json as value_from
from fsmkit.runtime.live.values import to_json as value_to
from fsmkit.runtime.script import Player, script_texts

SEED = 41
SOME = [range(15), pytest.param(range(15, 60), marks=pytest.mark.slow)]
"""Numbers of random charts."""


@cache
def macrosteps(number: int) -> tuple[Player, list[Macrostep]]:
    case = random_case(SEED, number)
    player = Player(case.chart)
    played = (done for line in script_texts(case.script) for done in player.play(line))
    return player, [done for done in played if isinstance(done, Macrostep)]


@pytest.mark.parametrize("numbers", SOME)
def test_a_step_says_what_the_trace_says(numbers: range) -> None:
    validator = jsonschema.Draft202012Validator(schema())
    for number in numbers:
        player, done = macrosteps(number)
        chart = player.chart
        for n, macrostep in enumerate(done):
            step = from_json(to_json(step_of(chart, "m", n, macrostep)))
            assert isinstance(step, Step)
            before = active_leaves(chart, macrostep.before)
            finished = ["finished"] if macrostep.before.finished else []
            lines = list(lines_of(chart, step, before + finished))
            assert lines == list(trace_lines(chart, (macrostep,))), (number, step)
            if number < 6:
                validator.validate(msgspec.json.decode(to_json(step)))


@pytest.mark.parametrize("numbers", SOME)
def test_what_changed_and_the_state_before_give_the_state_after(numbers: range) -> None:
    for number in numbers:
        player, done = macrosteps(number)
        for n, macrostep in enumerate(done):
            step = step_of(player.chart, "m", n, macrostep)
            before, after = (
                state_of(player.chart, "m", n, snapshot, 0)
                for snapshot in (macrostep.before, macrostep.after)
            )
            values = {**before.data, **before.outputs}
            changes = {} if isinstance(step.set, msgspec.UnsetType) else step.set
            assert repr({**values, **changes}) == repr({**after.data, **after.outputs})
            for key in ("timers", "queue", "deferred"):
                told = getattr(step, key)
                assert (getattr(before, key) if told is msgspec.UNSET else told) == getattr(
                    after, key
                )


COLOUR = EnumType("Colour", ("red", "green"))
PAIR = RecordType("Pair", (Field("a", INT64), Field("b", ArrayType(COLOUR, 2))))


@pytest.mark.parametrize(
    ("type_", "value", "told"),
    [
        (INT64, 2**53 - 1, 2**53 - 1),
        (INT64, 2**53, {"int": "9007199254740992"}),
        (INT64, -(2**63), {"int": "-9223372036854775808"}),
        (FLOAT64, float("inf"), {"float": "inf"}),
        (COLOUR, 1, "green"),
        (PAIR, (3, (0, 1)), {"a": 3, "b": ["red", "green"]}),
    ],
)
def test_values_come_back(type_: Type, value: Value, told: object) -> None:
    assert value_to(value, type_) == told
    assert value_from(told, type_) == value


@given(
    st.recursive(
        st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=4),
        lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=4), inner),
        max_leaves=6,
    )
)
def test_what_is_no_value_is_refused_in_words(found: object) -> None:
    for type_ in (INT64, FLOAT64, COLOUR, PAIR):
        try:
            value_from(found, type_)
        except ValueError as error:
            assert str(error)  # noqa: PT017  (either is right)


def test_kinds_and_keys_of_later_versions_are_passed_over() -> None:
    told = b'{"k":"lost","n":1,"at":2,"count":3,"where":"ring","later":[{}]}'
    assert to_json(from_json(told)) == b'{"k":"lost","n":1,"at":2,"count":3,"where":"ring"}'
    with pytest.raises(ValueError, match="later"):
        from_json(b'{"k":"later"}')
