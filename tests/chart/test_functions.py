"""Functions, conversions, numbered members and local variables: meaning, findings, notations."""

from __future__ import annotations

import pytest

from fsmkit.chart.chart import Chart
from fsmkit.chart.elaborate import elaborate
from fsmkit.diagnostics import Findings, Source
from fsmkit.document.document import Document
from fsmkit.document.front_ends import FrontEnd
from fsmkit.language import EnumType, Storage, Variable
from fsmkit.language.functions.narrowing import narrow_range
from fsmkit.language.statements.tree import Return
from fsmkit.language.walk import nodes
from fsmkit.plugins import plugin
from fsmkit.runtime.script import run_script

CHART = """
chart: M
types:
  Fault: [none, hot = 4, lost = 0x10, gone]
  Err: [bad = -2, worse]
  Percent: 0..100
  Wrap: 0..7 wrap
constants: {{K: "next(3)"}}
functions:
  next(i 0..7) -> 0..7: 0 if i == 7 else i + 1
  twice(i 0..7) -> 0..7: next(next(i))
  quot(a 0..9, b 0..9) -> 0..9: a / b
  above(b uint8[4], limit uint8) -> 0..4: |
    var many 0..4 = 0
    for x in b {{ let over = x > limit; if over {{ many += 1 }} }}
    return many
  warm() -> bool: temp > 10 and In(a)
  {functions}
data:
  n: 0..9 = 0
  s: uint8[4] = [1, 20, 30, 40]
  code: Fault
  w: duration = 5ms
  f: float64 = 2.5
inputs: {{temp: 0..100}}
operations: ["op(x 0..9) -> 0..9"]
events: {{in: [go, "num(x -500..500)"]}}
initial: a
states:
  a:
    on:
      go: {{do: "{content}"}}
      num: {{do: "{content}"}}
"""


def read(text: str, notation: str = "yaml") -> Document:
    findings = Findings()
    document = plugin(FrontEnd, notation).read(Source(f"m.{notation}", text), findings)
    assert document is not None
    findings.stop_on_errors()
    return document


def chart_with(content: str, functions: str = "") -> Chart:
    findings = Findings()
    chart = elaborate((read(CHART.format(content=content, functions=functions)),), findings)
    findings.stop_on_errors()
    assert chart is not None
    return chart


def logged(content: str, *lines: str) -> list[str]:
    """Return what a machine logs, and the errors it raises, for ``go`` or for what is given."""
    trace = run_script(chart_with(content), ["start 0", *(lines or ("post go",)), "run 1"])
    return [line.removeprefix("log ") for line in trace if line.startswith(("log ", "error"))]


@pytest.mark.parametrize(
    ("content", "told"),
    [
        ('log \\"x\\", next(6), next(7), twice(6), K', ["x 7 0 0 4"]),
        ('log \\"x\\", above(s, 25)', ["x 2"]),
        ('log \\"x\\", int(Fault.lost), int(In(a)), int(w), ms(w), int(f)', ["x 16 1 5 5 2"]),
        ('log \\"x\\", Fault(4), Fault(5, Fault.gone), Err(-1)', ["x 4 17 -1"]),
        ('log \\"x\\", Percent(300), uint8(300), Wrap(9), Percent(-2.5)', ["x 100 44 1 0"]),
        ('log \\"x\\", bool(3), bool(0.0), code', ["x 1 0 0"]),
        ('for e in Err { log \\"x\\", e }', ["x -2", "x -1"]),
        ('for i in 2..4 { log \\"x\\", i }', ["x 2", "x 3", "x 4"]),
        ('for x, i in s { if i == 3 { log \\"x\\", x } }', ["x 40"]),
        ('let a = n + 1; var b 0..3 = 1; b += a; log \\"x\\", a, b', ["x 1 2"]),
    ],
)
def test_meaning(content: str, told: list[str]) -> None:
    assert logged(content) == told


def test_a_failure_in_a_function_fails_the_expression() -> None:
    trace = run_script(
        chart_with('n = quot(4, n); log \\"after\\"'), ["start 0", "post go", "run 1"]
    )
    assert any("error.execution" in line for line in trace)
    assert not any(line.startswith("log") for line in trace)


def test_a_number_of_no_member_fails() -> None:
    chart = chart_with("code = Fault(event.x)".replace("event.x", "n + 1"))
    trace = run_script(chart, ["start 0", "post go", "run 1"])
    assert any("error.execution" in line for line in trace)


def test_numbers_of_members() -> None:
    fault = chart_with("n = 1").types[0]
    assert isinstance(fault, EnumType)
    assert fault.numbers == (0, 4, 16, 17)
    assert (fault.number("gone"), fault.member(16), fault.bounds) == (17, "lost", (0, 17))
    assert not fault.is_counted
    assert EnumType("E", ("a", "b")).is_counted


def test_what_a_function_reads_is_read_by_its_caller() -> None:
    chart = chart_with("if warm() { n = 1 }")
    read_ = {
        part.name for part in nodes(chart.transitions[1].content) if isinstance(part, Variable)
    }
    assert "temp" in read_


def test_locals_are_no_data() -> None:
    chart = chart_with("let a = 3; for i in 0..3 { n = i } n = a".replace("} n", "}; n"))
    assert {d.name for d in chart.data} == {"n", "s", "code", "w", "f"}
    places = [p for p in nodes(chart.transitions[1].content) if isinstance(p, Variable)]
    assert {p.name for p in places if p.storage is Storage.LOCAL} == {"a", "i"}


@pytest.mark.parametrize(
    ("functions", "rule"),
    [
        ("bad(i 0..7) -> 0..7: i + 1", "value-out-of-range"),
        ("bad(i 0..7): i", "missing-type"),
        ("bad(i 0..7) -> bool: i", "type-mismatch"),
        ("bad(i 0..7) -> 0..9: op(i)", "impure-function"),
        ("bad(i 0..7) -> 0..9: bad(i)", "unknown-name"),
        ("bad(n 0..7) -> 0..9: n", "duplicate-name"),
        ("bad(i 0..7) -> uint8[2]: i", "invalid-type"),
        ("bad() -> 0..9: 'n = 1; return n'", "impure-function"),
        ("bad() -> 0..9: 'raise go; return 1'", "impure-function"),
        ("bad(i 0..7) -> 0..9: 'if i > 3 { return 1 }'", "missing-return"),
        ("bad(i 0..7) -> 0..9: 'i = 3; return i'", "not-assignable"),
        ("next(i 0..7) -> 0..9: i", "duplicate-name"),
    ],
)
def test_wrong_functions(functions: str, rule: str) -> None:
    findings = Findings()
    text = CHART.format(content="n = 1", functions=functions)
    document = plugin(FrontEnd, "yaml").read(Source("m.yaml", text), findings)
    if document is not None:
        elaborate((document,), findings)
    assert rule in {d.rule.name for d in findings}, [d.message for d in findings]
    assert findings.has_errors


@pytest.mark.parametrize(
    ("content", "rule"),
    [
        ("let n = 1", "duplicate-name"),
        ("let a = 1; let a = 2", "duplicate-name"),
        ("if n > 1 { let a = 1 }; n = a", "unknown-name"),
        ("let a = 1; a = 2", "not-assignable"),
        ("var a", "missing-type"),
        ("var a uint8[3] = 0", "invalid-type"),
        ("return 1", "outside-language"),
        ("for i in 0..100000 { n = 1 }", "loop-too-long"),
        ("for i in 3..1 { n = 1 }", "invalid-type"),
        ("code = Fault(99)", "value-out-of-range"),
        ("n = int(w, 3)", "wrong-arguments"),
        ("n = ms(n)", "type-mismatch"),
        ("code = Fault(w)", "type-mismatch"),
        ("n = quot(1)", "wrong-arguments"),
    ],
)
def test_wrong_content(content: str, rule: str) -> None:
    findings = Findings()
    elaborate((read(CHART.format(content=content, functions="")),), findings)
    assert rule in {d.rule.name for d in findings}, [d.message for d in findings]
    assert findings.has_errors


@pytest.mark.parametrize(
    "members", ["[a, b = 1.5]", "[a = 1, b = 1]", "[a, b = 0x80000000]", "[a = 3, b = 2, c]"]
)
def test_wrong_members(members: str) -> None:
    text = f"chart: M\ntypes: {{F: {members}}}\ninitial: a\nstates: {{a: {{}}}}\n"
    findings = Findings()
    elaborate((read(text),), findings)
    assert [d.rule.name for d in findings if d.rule.name == "member-number"] == ["member-number"]


def test_both_notations_say_the_same() -> None:
    content = "let a = 1; var b 0..3 = 0; for i in 0..3 { b += i }; n = next(b)"
    document = read(CHART.format(content=content, functions=""))
    yaml, scxml = plugin(FrontEnd, "yaml"), plugin(FrontEnd, "scxml")
    text = yaml.write(document)
    again = read(scxml.write(read(text)), "scxml")
    assert yaml.write(again) == text
    assert again == read(text)
    assert isinstance(again.functions[0].body[0], Return)


def test_results_that_are_tried() -> None:
    text = CHART.replace('-> 0..9"]', '-> 0..9 from {{3, n0, 3}}"]').replace("K:", "n0: 7, K:")
    document = read(text.format(content="n = 1", functions=""))
    findings = Findings()
    chart = elaborate((document,), findings)
    assert chart is not None
    assert chart.operations[0].tried == (3, 7)
    scxml = plugin(FrontEnd, "scxml").write(document)
    assert plugin(FrontEnd, "yaml").write(read(scxml, "scxml")) == plugin(FrontEnd, "yaml").write(
        document
    )


@pytest.mark.parametrize("results", ["{10}", "{}", "{true}"])
def test_wrong_results(results: str) -> None:
    text = CHART.replace('-> 0..9"]', f'-> 0..9 from {{{results}}}"]')
    findings = Findings()
    elaborate((read(text.format(content="n = 1", functions="")),), findings)
    assert findings.has_errors


def test_tests_narrow_ranges() -> None:
    chart = chart_with("n = 1", "down(i 0..9) -> 0..9: i - 1 if i > 0 and i < 5 else 9")
    (function,) = [f for f in chart.functions if f.name == "down"]
    assert narrow_range(function.body[0].value) == (0, 9)


def test_nested_calls_are_typed_once() -> None:
    lines = ["f0(x 0..9) -> 0..9: x"]
    lines += [f"f{n}(x 0..9) -> 0..9: f{n - 1}(f{n - 1}(x))" for n in range(1, 60)]
    functions = "\n  ".join(lines)
    chart = chart_with("n = f59(n)", functions)
    assert chart.functions[-1].cost > 2**59
