"""Bindings that are broken or do not fit: each has its rule, its place and a way out."""

from __future__ import annotations

from pathlib import Path

import pytest

from fsmkit.codegen.existing_c.reader import beside, read_binding
from fsmkit.diagnostics import Findings, FsmkitError
from tests.codegen.existing_c.conftest import Judge

WHOLE = """\
include: [pump.h, <math.h>]
context: {type: struct  board, member: parts.pump}
constants: {LIMIT: PUMP_LIMIT, T_OPEN: 50, COLD: PUMP_COLD}
types:
  Fault: {type: pump_fault, members: {none: PUMP_OK, hot: PUMP_HOT}}
  Sample: {type: struct frame, fields: {amps: a.milli, tags: "t"}}
operations:
  set: pump_set(ctx, amps)
  healthy: {call: pump_ok(), trusted: true}
  keep: pump_keep(sample)
sends: {done: f(m), failed: g(fault)}
inputs: {temp: ctx->temp}
outputs: {level: ctx->level, lamp: {set: light(value)}, levels: ctx->levels}
names: {type Fault: pump_fault_code, event go: start_up, member Fault.hot: PUMP_TOO_HOT}
exports: enum
"""


def test_a_whole_binding_fits(judge: Judge) -> None:
    assert judge(WHOLE) == [
        (
            "unbound-name",
            "the host writes the rest itself: operation `name_of`, input `name`",
            1,
        )
    ]


@pytest.mark.parametrize(
    ("text", "rule", "message", "line"),
    [
        ("constants: {LIMITS: X}", "unknown-name", "no constant `LIMITS`", 3),
        ("constants: {GAIN: X}", "unfit-binding", "`GAIN` is of the type", 3),
        ("operations: {\n  sett: f()}", "unknown-name", "no operation `sett`", 4),
        ("operations: {set: f(ctx)}", "unfit-binding", "needs a `context`", 3),
        ("operations: {name_of: f()}", "unfit-binding", "the result of `name_of`", 3),
        ("operations: {set: {call: f(), trusted: true}}", "unfit-binding", "no result", 3),
        ("operations: {set: {trusted: true}}", "broken-binding", "`set` needs `call`", 3),
        ("sends: {go: f()}", "unfit-binding", "does not leave", 3),
        ("sends: {gone: f()}", "unknown-name", "no event that leaves", 3),
        ("inputs: {level: f()}", "unknown-name", "no input `level`", 3),
        ("inputs: {name: f()}", "unfit-binding", "`name` is of the type symbol", 3),
        ("inputs: {temp: {get: f(), trusted: maybe}}", "unexpected-value", "`maybe`", 3),
        ("inputs: {temp: {fetch: f()}}", "unknown-key", "no key `fetch`", 3),
        ("outputs: {level: x.y, lamp: x . y}", "bound-twice", "`level` and `lamp`", 3),
        ("outputs: {lamp: {set: f()}}", "unfit-binding", "nothing with `value`", 3),
        ("outputs: {levels: {set: f(value)}}", "unfit-binding", "is an array", 3),
        ("types: {Faul: {type: t}}", "unknown-name", "no type `Faul`", 3),
        ("types: {Fault: {members: {}}}", "broken-binding", "needs `type`", 3),
        ("types: {Fault: {type: t, members: {none: A}}}", "unfit-binding", "`hot`", 3),
        ("types: {Fault: {type: t, members: {none: A, hot: A}}}", "bound-twice", "`A`", 3),
        ("types: {Fault: {type: 't*', members: {}}}", "binding-syntax", "a type of C", 3),
        ("types: {Sample: {type: t, fields: {amps: a}}}", "unfit-binding", "`tags`", 3),
        ("types: {Sample: {type: t, fields: {amps: a, tags: a}}}", "bound-twice", "`a`", 3),
        ("types: {Sample: {type: t, fields: {amps: a, tags: b, x: c}}}", "unknown-name", "`x`", 3),
        ("types: {Deep: {type: t, fields: {inner: a}}}", "unfit-binding", "not copied", 3),
        ("include: ['a\"b.h']", "binding-syntax", "the name of a header", 3),
        ("include: [{a: b}]", "unexpected-shape", "must be a text", 3),
        ("context: {type: t}", "broken-binding", "either `member` or `expression`", 3),
        ("context: {type: t, member: a, expression: b}", "broken-binding", "either", 3),
        ("names: {type Nope: x}", "unknown-name", "no type `Nope`", 3),
        ("names: {Fault: x}", "broken-binding", "no kind and name", 3),
        ("names: {type Fault: 1x}", "binding-syntax", "an identifier", 3),
        ("exports: all", "unexpected-value", "`all`", 3),
        ("extends: nothing.c.yaml", "unreadable-file", "nothing.c.yaml", 3),
        ("extends: pump.c.yaml", "inheritance-cycle", "extends itself", 3),
        ("operations: [a, b]", "unexpected-shape", "keys with values", 3),
    ],
)  # fmt: skip
def test_what_is_wrong_has_a_rule_and_a_place(
    text: str, rule: str, message: str, line: int, judge: Judge
) -> None:
    (found,) = [each for each in judge(text) if each[0] != "unbound-name"]
    assert found[0] == rule
    assert message in found[1]
    assert found[2] == line


@pytest.mark.parametrize(
    ("head", "message"),
    [
        ("binding: Pump\n", "needs `binding` and `chart`"),
        ("chart: pump.yaml\n", "needs `binding` and `chart`"),
        ("binding: Pumps\nchart: pump.yaml\n", "the chart is `Pump`"),
        ("binding: Pump\nchart: other.yaml\n", "there is no chart `other.yaml`"),
        ("binding: Pump\nchart: pump.c.yaml\n", "the chart is `pump.yaml`"),
    ],
)
def test_a_binding_is_of_one_chart(head: str, message: str, judge: Judge) -> None:
    ((rule, told, _),) = [each for each in judge("", head) if each[0] != "unbound-name"]
    assert rule == "broken-binding"
    assert message in told


def test_a_binding_says_what_its_base_does_not(tmp_path: Path) -> None:
    base, own = tmp_path / "base.c.yaml", tmp_path / "own.c.yaml"
    base.write_text(
        "binding: Base\nchart: base.yaml\ninclude: a.h\ncontext: {type: t, member: m}\n"
        "operations: {a: one(), b: two()}\nexports: none\n"
    )
    own.write_text(
        "binding: Own\nchart: own.yaml\nextends: base.c.yaml\ninclude: [b.h, a.h]\n"
        "operations: {b: three(), c: four()}\n"
    )
    found = read_binding(own, Findings())
    assert found.includes == ('"a.h"', '"b.h"')
    assert {name: bound.expression.text for name, bound in found.operations.items()} == {
        "a": "one()",
        "b": "three()",
        "c": "four()",
    }
    assert found.context is not None
    assert found.exports is not None
    assert found.name.value == "Own"


def test_it_lies_beside_the_chart_by_name(tmp_path: Path) -> None:
    chart = tmp_path / "pump.v2.scxml"
    assert beside(chart) is None
    (tmp_path / "pump.v2.c.yaml").write_text("")
    assert beside(chart) == tmp_path / "pump.v2.c.yaml"


def test_a_binding_that_is_no_text_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "x.c.yaml"
    path.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(FsmkitError):
        read_binding(path, Findings())
