"""Comments at all columns around the entries that an operation changes or removes."""

from collections import Counter
from itertools import product

import pytest

from fsmkit.diagnostics import FsmkitError, Source
from fsmkit.diagnostics.fixes import apply_edits
from fsmkit.document.document import Trigger
from fsmkit.editor.editing import operations as op
from fsmkit.editor.editing.applying import apply, read
from fsmkit.editor.editing.documents import transformed
from fsmkit.editor.formatting.concrete import remarks

BEFORE = {
    "plain": "entry: log(1)",
    "literal": "entry: |\n  log(1)\n  log(2)",
    "folded": "doc: >\n  one\n  two",
    "block": "on:\n  go:\n    target: b\n    do: |\n      log(1)\n      log(2)",
    "nothing": "",
}
CHANGED = {
    "one line": "initial: c",
    "next line": "initial:\n  # zero\n  c",
    "block": "initial:\n  target: c\n  do: |\n    log(1)\n    log(2)",
    "flow": "initial: {target: c, do: log(1)}",
}
OPERATIONS = (
    op.SetInitial("a", ()),
    op.SetInitial("a", ("d",)),
    op.SetKey("a", "doc", ("words",)),
    op.SetHandler("a", "exit", ("log(5)\nlog(6)",)),
    op.MoveState("a", "b"),
    op.MoveState("c", "b"),
    op.RemoveState("a"),
)
COLUMNS = (0, 4, 8)


def _indented(text: str, margin: int) -> str:
    return "".join(f"{' ' * margin}{line}\n" for line in text.splitlines())


def _check(text: str, operation: op.Operation) -> bool:
    """Check the meaning and the comments of an edit; return whether the operation fits."""
    source = Source("x.yaml", text)
    old = read(source)
    try:
        new = transformed(old, operation)
    except FsmkitError:
        return False
    result = Source("x.yaml", apply_edits(text, apply(source, operation)))
    assert read(result) == new
    before, after = Counter(remarks(source)), Counter(remarks(result))
    assert after <= before if isinstance(operation, op.RemoveState) else after == before
    return True


@pytest.mark.parametrize("before", BEFORE)
@pytest.mark.parametrize("changed", CHANGED)
def test_comments_between_keys_of_a_state_stay(before: str, changed: str) -> None:
    count = 0
    for first, second in product(COLUMNS, repeat=2):
        above = f"{' ' * first}# one\n{' ' * second}# two\n"
        behind = f"{' ' * second}# three\n{' ' * first}# four\n"
        text = (
            "chart: X\nevents: {in: [go]}\ninitial: a\nstates:\n  a:\n"
            f"{_indented(BEFORE[before], 4)}{above}{_indented(CHANGED[changed], 4)}{behind}"
            f"    states:\n      c: {{}}\n      d:\n{' ' * second}# five\n        exit: log(7)\n"
            f"{behind.replace('#', '# at')}  b: {{}}\n"
        )
        count += sum(_check(text, operation) for operation in OPERATIONS)
    assert count >= 5 * len(COLUMNS) ** 2


@pytest.mark.parametrize("last", ["", "outputs: {o: bool}\n"])
@pytest.mark.parametrize("before", ["data:\n  v: 0..9\n", "doc: |\n  one\n  two\n", "doc: one\n"])
def test_comments_between_sections_stay(before: str, last: str) -> None:
    for first, second in product((0, 1, 2, 4), repeat=2):
        gap = f"{' ' * first}# one\n{' ' * second}# two\n"
        for section in ("inputs: {i: bool}\n", "inputs:\n  i: bool\n"):
            text = f"chart: X\nstates: {{a: {{}}}}\n{before}{gap}{section}{gap.upper()}{last}"
            assert _check(text, op.SetKey(op.CHART, "inputs", ()))
            assert _check(text, op.SetKey(op.CHART, "inputs", ("i: bool", "j: bool")))
            assert _check(text, op.RemoveState("a"))
            assert _check(text, op.SetKey(op.CHART, "doc", ("other",)))


@pytest.mark.parametrize("sign", ["- # one", "-\n        # one", "- # one\n\n        # two"])
@pytest.mark.parametrize("item", ["{on: go, target: b}", "on: go\n        target: b"])
def test_comments_between_a_sign_and_its_item_stay(sign: str, item: str) -> None:
    text = (
        "chart: X\nevents: {in: [go]}\nstates:\n  a:\n    transitions:\n"
        f"      {sign}\n        {item}\n      - {{after: 5s, target: a}}\n  b: {{}}\n"
    )
    for operation in (
        op.SetGuard("a", 0, "1 < 2"),
        op.SetTarget("a", 0, ()),
        op.SetContent("a", 0, "log(1)\nlog(2)"),
        op.SetTrigger("a", 0, Trigger.AFTER, "3s"),
        op.MoveTransition("a", 0, 1),
        op.SetSource("a", 0, "b"),
        op.SetKey("a", "doc", ("words",)),
        op.MoveState("a", "b"),
    ):
        assert _check(text, operation)
