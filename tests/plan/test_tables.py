"""The tables of a Plan: a path read code by code enters what the operations enter."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import pytest

from devtools.differential import random_case
from fsmkit.document.document import Kind
from fsmkit.plan import Branch, Content, Enter, Plan, Restore, lower
from fsmkit.plan.operations import Ops
from fsmkit.plan.restoring import restored_regions
from fsmkit.plan.selection import Selection
from fsmkit.plan.tables import EnterRecorded, Skip, SkipUnless, Tables, tables_of

CHARTS = 16
Recorded = Mapping[int, int | None]
"""By history: the child that it recorded, None for nothing."""


def entered(plan: Plan, ops: Ops, recorded: Recorded) -> Iterator[object]:
    """Yield the states, the contents and the restored regions of operations, in order."""
    for op in ops:
        match op:
            case Enter(state, defaults):
                yield from (state, *map(Content, defaults))
            case Content():
                yield op
            case Branch(history, first, second):
                yield from entered(plan, second if recorded[history] is None else first, recorded)
            case Restore(history, _):
                if plan.chart.states[history].kind is Kind.DEEP_HISTORY:
                    yield EnterRecorded(history, tuple(restored_regions(plan, op)))
                    continue
                (resume,) = plan.resumed(op)
                for child, inner in resume.cases:
                    if child == recorded[history]:
                        yield from entered(plan, inner, recorded)


def read(tables: Tables, at: int, recorded: Recorded) -> Iterator[object]:
    """Yield the same of the path that starts at an index."""
    steps = {code: step for step, code in tables.paths.specials.items()}
    codes = tables.paths.codes
    while codes[at] != 0:
        match step := steps.get(codes[at], codes[at]):
            case Skip(count):
                at += count
            case SkipUnless(history, _, state, count):
                held = recorded[history]
                at += 0 if held is not None and state in (None, held) else count
            case _:
                yield step
        at += 1


def choices(plan: Plan) -> Iterator[Recorded]:
    """Yield records of histories: nothing, then each child of their parents."""
    children = {h: [None, *plan.substates[plan.parents[h]]] for h in plan.every_history}
    for turn in range(max(map(len, children.values()), default=1)):
        yield {history: each[turn % len(each)] for history, each in children.items()}


@pytest.mark.parametrize("number", range(0, CHARTS, 4))
def test_a_path_enters_what_its_operations_enter(number: int) -> None:
    for each in range(number, number + 4):
        plan = lower(random_case(23, each).chart)
        tables = tables_of(plan, Selection(plan, plan.variants, is_uniform=True))
        for transition in tables.taken:
            for variant in plan.variants[transition.index]:
                if transition.index not in tables.numbers or plan.reactions[transition.index] == ():
                    continue
                if variant.domain is None:
                    continue
                at = tables.path_at(variant.entry, variant.domain) + tables.is_compact
                for recorded in choices(plan):
                    expected = [*entered(plan, variant.entry, recorded)]
                    assert [*read(tables, at, recorded)] == expected


@pytest.mark.parametrize("number", range(0, CHARTS, 4))
def test_each_number_takes_the_transition_of_its_row(number: int) -> None:
    for each in range(number, number + 4):
        plan = lower(random_case(23, each).chart)
        tables = tables_of(plan, Selection(plan, plan.variants, is_uniform=True))
        assert all(
            index + 1 in tables.numbers[transition.index]
            for index, transition in enumerate(tables.taken)
        )
        if tables.is_compact:
            rows = [row for own in tables.rows for row in own]
            assert [row.transition for row in rows] == [*tables.taken[: len(rows)]]
