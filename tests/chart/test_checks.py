"""The checks: what each reports, and the idioms it leaves alone."""

from __future__ import annotations

from typing import Any

import pytest

HEAD = """
chart: M
data: {n: 0..9 = 0, a: bool = false, b: bool = false}
events: {in: [go, jam(x 0..9)]}
"""
CHOICE = "nondeterministic-choice"
DEFERRED = "deferred-elsewhere"
OUT = "after: {1s: to_use}"
OWN = "on: {go: {do: n -= 1}}"
TAKES = "{on: {go: {do: n += 1}}}"
READS = "use: {on: {go: {if: n > 0 and a and b, target: use}, jam: use}}"


def chart(states: str) -> str:
    return f"{HEAD}states:\n  {states}\n  {READS}\n  to_use: {{on: {{jam: use}}}}\n"


@pytest.mark.parametrize(
    ("states", "expected"),
    [
        ("s: {on: {go: to_use}}", []),
        ("s: {on: {go: to_use}}\n  lost: {}", ["unreachable-state"]),
        ("s: {on: {go: to_use}}\n  lost: {states: {inner: {}}}", ["unreachable-state"]),
        # an event that another region defers
        (f"s: {{{OUT}, regions: {{a: {{defer: go}}, b: {TAKES}}}}}", [DEFERRED]),
        (f"s: {{{OUT}, defer: go, regions: {{a: {{}}, b: {TAKES}}}}}", []),
        (f"s: {{{OUT}, regions: {{a: {{defer: jam}}, b: {TAKES}}}}}", []),
        (f"s: {{{OUT}, regions: {{a: {{defer: go, {OWN}}}, b: {TAKES}}}}}", []),
        (f"s: {{{OUT}, states: {{a: {{defer: go, on: {{jam: b}}}}, b: {TAKES}}}}}", []),
        # overlapping guards
        ("s: {on: {go: [{if: a, target: to_use}, {if: b, target: s}]}}", [CHOICE]),
        ("s: {on: {go: [{if: a, target: to_use}, {if: not a, target: s}]}}", []),
        ("s: {on: {go: [{if: a, target: to_use}, {if: not a and b, target: s}]}}", []),
        ("s: {on: {go: [{if: a and b, target: to_use}, {if: a, target: s}]}}", []),
        ("s: {on: {go: [{if: a, target: to_use}, {target: s}]}}", []),
        ("s: {on: {go: [{if: n < 3, target: to_use}, {if: n >= 3 and b, target: s}]}}", []),
        ("s: {on: {go: [{if: n <= 3, target: to_use}, {if: n >= 3, target: s}]}}", [CHOICE]),
        ("s: {on: {go: [{if: n == 1, target: to_use}, {if: n == 2, target: s}]}}", []),
        ("s: {on: {go: [{if: not (a or b), target: to_use}, {if: b, target: s}]}}", []),
        ("s: {on: {go: [{if: a, target: to_use}, {if: b, ordered: true, target: s}]}}", []),
        ("s: {always: [{if: a, target: to_use}, {if: b, target: s}]}", [CHOICE, "possible-loop"]),
        ("s: {choice: [{if: a, target: to_use}, {if: b, target: to_use}, {target: use}]}", []),
        # never taken
        ("s: {on: {go: [{target: to_use}, {if: a, target: s}]}}", ["dead-transition"]),
        ("s: {on: {go: [{if: a, target: to_use}, {if: a and b, target: s}]}}", ["dead-transition"]),
        ("s: {on: {'*': to_use, go: s}}", ["dead-transition"]),
        ("s: {on: {go: to_use, '*': s}}", []),
        # timeouts
        ("s: {after: {1s: {if: a, target: to_use}}}", ["timeout-with-guard"]),
        ("s: {after: {1s: [{if: a, target: to_use}, {if: not a, target: s}]}}", []),
        ("s: {after: {1s: [{if: a, target: to_use}, s]}}", []),
        ("s: {every: {1s: {if: a, target: to_use}}}", []),
        # endless
        ("s: {always: t}\n  t: {always: s}\n  u: {on: {go: [s, to_use]}}", None),
        ("s: {always: t, on: {go: to_use}}\n  t: {always: s}", ["endless-loop"]),
        ("s: {always: t}\n  t: {always: {if: a, target: to_use}}", []),
        ("s: {always: {do: n = 1}, on: {go: to_use}}", ["endless-loop"]),
    ],
)  # fmt: skip
def test_findings(yaml: Any, states: str, expected: list[str] | None) -> None:
    result = yaml(chart(states))
    if expected is not None:
        assert result.rules == expected
        assert result.maybe is not None


@pytest.mark.parametrize(
    ("sent", "cancelled", "help_"),
    [
        ("late", "late", None),
        ("late", "lat", "did you mean `late`?"),
        ("late", "'lat'", "did you mean `late`?"),
        ("late", "zzz", "give that id to the delayed `send`, or remove the `cancel`"),
    ],
)
def test_a_cancel_that_no_send_is_meant_by(
    yaml: Any, sent: str, cancelled: str, help_: str | None
) -> None:
    result = yaml(
        f"{HEAD}states:\n  use:\n    entry: send go after 5s as {sent}\n"
        f'    exit: "cancel {cancelled}"\n    on: {{go: {{if: n > 0 and a and b}}, jam: use}}\n'
    )
    found = [d for d in result.found if d.rule.name == "unknown-send"]
    assert [d.help for d in found] == ([] if help_ is None else [help_])
    for finding in found:
        span = finding.primary.span
        assert span.source.text[span.start : span.end] == cancelled.strip("'")
        edits = [edit.text for fix in finding.fixes for edit in fix.edits]
        assert edits == [sent] * finding.help.startswith("did you mean")


def test_a_computed_cancel_is_meant_where_one_of_its_ids_is(scxml: Any) -> None:
    text = (
        '<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" datamodel="ecmascript">'
        '<datamodel><data id="v" expr="\'b\'"/></datamodel><state id="s"><onentry>'
        '<send id="a" event="e" delay="1s"/><assign location="v" expr="\'{}\'"/>'
        '<cancel sendidexpr="v"/></onentry><transition event="e" target="s"/></state></scxml>'
    )
    assert "unknown-send" not in scxml(text.format("a")).rules
    assert "unknown-send" in scxml(text.format("c")).rules


def test_unused_events(yaml: Any) -> None:
    result = yaml(
        "chart: M\nevents: {in: [go, no], out: [said, unsaid], internal: [i]}\n"
        "states: {a: {entry: send said, on: {go: a}}}\n"
    )
    assert [d.message.split("`")[1] for d in result.found] == ["no", "i", "unsaid"] or sorted(
        d.message.split("`")[1] for d in result.found
    ) == ["i", "no", "unsaid"]


def test_unread_data(yaml: Any) -> None:
    result = yaml(
        "chart: M\ndata: {n: 0..9 = 0, m: 0..9 = 0}\nevents: {in: [go]}\n"
        "states: {a: {on: {go: {if: m < 3, do: n += 1; m += 1}}}}\n"
    )
    assert [d.message for d in result.found] == ["`n` is never read"]


def test_a_base_chart_is_left_alone(yaml: Any) -> None:
    result = yaml(
        "chart: M\nabstract: true\ndata: {n: 0..9 = 0}\nevents: {in: [go]}\n"
        "states: {a: {}, b: {}}\n"
    )
    assert result.rules == []
