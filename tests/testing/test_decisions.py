"""MC/DC of guards, against the definition by brute force."""

from __future__ import annotations

from itertools import product

from hypothesis import given
from hypothesis import strategies as st

from fsmkit.chart.analysis.decisions import MOST_CONDITIONS, Node, Outcomes, Shape, decision_paths
from fsmkit.testing.coverage.decisions import (
    covered_conditions,
    decided,
    deciding_conditions,
    numbers,
    stored_outcomes,
)


def numbered(shape: Shape) -> Shape:
    """Number the conditions from left to right."""
    count = iter(range(1000))

    def again(node: Shape) -> Shape:
        if isinstance(node, int):
            return next(count)
        return Node(node.op, tuple(again(each) for each in node.operands))

    return again(shape)


shapes = st.recursive(
    st.just(0),
    lambda inner: st.one_of(
        st.builds(lambda a: Node("not", (a,)), inner),
        st.builds(lambda a, b: Node("and", (a, b)), inner, inner),
        st.builds(lambda a, b: Node("or", (a, b)), inner, inner),
    ),
    max_leaves=7,
).map(numbered)


def outcomes_of(shape: Shape, values: tuple[bool, ...]) -> Outcomes:
    """Return the conditions that are evaluated where they have these values."""
    seen: dict[int, bool] = {}

    def value(number: int) -> bool:
        seen[number] = values[number]
        return values[number]

    decided(shape, value)
    return tuple(seen.get(n) for n in range(len(values)))


def decides(shape: Shape, outcomes: Outcomes, number: int) -> bool:
    """Whether another value of a condition can make another decision.

    What was not evaluated may have any value: short-circuit evaluation passed over it.
    """
    if outcomes[number] is None:
        return False
    choices = [(True, False) if o is None else (o,) for o in outcomes]
    for values in product(*choices):
        flipped = tuple(v != (n == number) for n, v in enumerate(values))
        if decided(shape, values.__getitem__) != decided(shape, flipped.__getitem__):
            return True
    return False


@given(shapes, st.data())
def test_what_is_unmasked_is_what_alone_makes_another_decision(
    shape: Shape, data: st.DataObject
) -> None:
    count = len(list(numbers(shape)))
    values = tuple(data.draw(st.lists(st.booleans(), min_size=count, max_size=count)))
    outcomes = outcomes_of(shape, values)
    expected = {number for number in range(count) if decides(shape, outcomes, number)}
    assert deciding_conditions(shape, outcomes) == expected


def test_a_condition_is_covered_by_two_values_that_decide() -> None:
    shape = Node("and", (0, Node("or", (1, 2))))
    assert covered_conditions(shape, 3, [(True, True, None)]) == (False, False, False)
    assert covered_conditions(shape, 3, [(True, True, None), (False, None, None)]) == (
        True,
        False,
        False,
    )
    assert covered_conditions(
        shape, 3, [(True, True, None), (False, None, None), (True, False, False)]
    ) == (True, True, False)
    # The third is true where the second is false, and false where the second is false.
    every = [(True, True, None), (False, None, None), (True, False, False), (True, False, True)]
    assert covered_conditions(shape, 3, every) == (True, True, True)


def test_of_many_conditions_each_counts_alone() -> None:
    count = MOST_CONDITIONS + 1
    outcomes = (True,) * (count - 1) + (None,)
    assert len(list(stored_outcomes(outcomes))) == count - 1
    assert list(stored_outcomes(outcomes[1:])) == [outcomes[1:]]
    assert covered_conditions(
        0, count, [*stored_outcomes(outcomes), *stored_outcomes((False,) * count)]
    ) == ((True,) * (count - 1) + (False,))


@given(shapes)
def test_ways_are_all_outcomes_and_their_numbers_are_sums(shape: Shape) -> None:
    """What generated code adds up leads to the values that the conditions had."""
    count = len(list(numbers(shape)))
    ways = decision_paths(shape, count)
    every = {outcomes_of(shape, values) for values in product((True, False), repeat=count)}
    assert set(ways.outcomes) == every
    assert len(ways.outcomes) == len(every)
    for number, outcomes in enumerate(ways.outcomes):
        missed = zip(ways.missed, outcomes, strict=True)
        assert sum(add_coverage for add_coverage, value in missed if value is False) == number
