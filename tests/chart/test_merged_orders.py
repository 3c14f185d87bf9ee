"""The order of transitions in merges: that of a version, or a conflict."""

from itertools import combinations, permutations

from fsmkit.chart.merging.documents import merged
from fsmkit.diagnostics import Findings, Source
from fsmkit.document.document import Document
from fsmkit.yaml.reader import read_document

LINES = {
    "a": "{on: go, if: v == 1, target: s}",
    "b": "{on: go, if: v == 2, target: s}",
    "c": "{on: '*', if: v == 3, target: s}",
    "X": "{on: go.on, if: v == 4, target: s}",
    "Y": "{on: go, if: v == 5, target: s}",
    "W": "{after: 5s, target: s}",
    "Z": "{every: 5s, target: s}",
}


def chart(order: str) -> Document:
    lines = "".join(f"      - {LINES[name]}\n" for name in order)
    text = f"chart: X\ndata: {{v: 0..9}}\nstates:\n  s:\n    transitions:\n{lines}"
    findings = Findings()
    document = read_document(Source("x.yaml", text), findings)
    assert document is not None
    assert not findings.has_errors
    return document


def names(document: Document) -> str:
    (state,) = document.root.children
    found = {repr((t.trigger, t.guard and str(t.guard), t.delay and str(t.delay))): name
             for name in LINES for t in chart(name).root.children[0].transitions}  # fmt: skip
    return "".join(
        found[repr((t.trigger, t.guard and str(t.guard), t.delay and str(t.delay)))]
        for t in state.transitions
    )


def pairs(order: str) -> set[tuple[str, str]]:
    return set(combinations(order, 2))


def changed(new: str) -> list[str]:
    """Return the orders of a, b, c with a new transition at each position."""
    orders = ["".join(one) for one in permutations("abc") if one != ("c", "b", "a")]
    return [order[:at] + new + order[at:] for order in orders for at in range(4)]


def test_competing_transitions_keep_the_order_of_a_version() -> None:
    count = 0
    for new, other in (("X", "Y"), ("W", "Z")):
        versions = [(one, chart(one)) for one in changed(other)[::3]]
        for ours in changed(new):
            document = chart(ours)
            for theirs, there in versions:
                merge = merged(chart("abc"), document, there)
                assert merge is not None
                if merge.conflicts:
                    continue
                count += 1
                result = names(merge.document)
                assert sorted(result) == sorted({*ours, *theirs})
                known = pairs(ours) | pairs(theirs)
                timed = set("WZ")
                for pair in pairs(result):
                    is_competing = not timed & {*pair} or {*pair} == timed
                    if is_competing and pair[::-1] in known:
                        assert pair in known, (ours, theirs, result)
                    if {*pair} <= set("abc") and pair not in pairs("abc"):
                        assert pair in known, (ours, theirs, result)
    assert count > 100


def test_a_new_transition_merges_where_the_other_version_keeps_the_order() -> None:
    for ours in changed("X"):
        for theirs in ("abc", "abcY", "abcW"):
            for one, other in ((ours, theirs), (theirs, ours)):
                merge = merged(chart("abc"), chart(one), chart(other))
                assert merge is not None
                assert not merge.conflicts, (one, other)
                assert pairs(ours) <= pairs(names(merge.document)), (one, other)


def test_new_transitions_follow_those_of_their_kind_and_ours_come_first() -> None:
    for ours, theirs, result in (
        ("abcX", "abcY", "abcXY"), ("abcY", "abcX", "abcYX"), ("abcX", "abcW", "abcXW"),
        ("abcW", "abcX", "abcXW"), ("abcW", "abcZ", "abcWZ"), ("Xabc", "Yabc", "XYabc"),
        ("bacX", "abcY", "bacXY"), ("abcX", "bacY", "bacXY"), ("bacW", "abcY", "bacYW"),
        ("abcW", "bacY", "bacYW"), ("abcX", "bacW", "bacXW"), ("Wabc", "Xabc", "WXabc"),
    ):  # fmt: skip
        merge = merged(chart("abc"), chart(ours), chart(theirs))
        assert merge is not None
        assert names(merge.document) == result, (ours, theirs)
