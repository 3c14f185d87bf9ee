"""Properties are evaluated by the generated C with the values that the interpreter computes."""

from __future__ import annotations

from pathlib import Path

import pytest

from fsmkit.diagnostics import Findings
from fsmkit.system.any_file import load_any
from fsmkit.verify.explore import ExplorationOptions, check

HEAD = """
chart: Values
events: {in: [go]}
environment: {may: [go]}
data:
  n: uint32 = 5
  b: int32 = -2147483648
  u: uint64 = 18446744073709551615
  w: int64 = -9223372036854775808
  k: uint8 = 3
  s: int16 = -2
  a: "0..3[4] = 2"
  i: 0..5 = 1
  f: float64 = 1.5
functions:
  twice(x uint32) -> uint32: |
    let y = x * 2
    if y < x { return 0 }
    return y
  low(x uint64) -> 0..9: min(x, 9)
  small(x 0..5 fault) -> 0..5: x
  short(x 0..99) -> 0..5 fault: Small(x)
types: {Small: 0..5 fault}
"""
SIGNED, UNSIGNED = ("b", "w", "k", "s", "i"), ("n", "u", "k", "i")
CONDITIONS = [
    *("~n == 4294967290", "-n == 4294967291", "abs(b) < 0", "abs(w) < 0", "-w == w", "~s == 1"),
    *("~u == 0", "-u == 1", "u + 1 == 0", "n - 6 == 4294967295", "b - 1 > 0", "w - 1 > 0"),
    *("u > 5", "u / 2 > 5", "u % 10 == 5", "min(u, 7) == 7", "max(u, 7) > 7", "float64(u) > 1.0"),
    *("u >> 60 == 15", "w >> 62 == -2", "s >> 1 == -1", "k << 31 == 2147483648", "n << 33 == 10"),
    *("u > w", "w < u", "u != w", "n > b", "s < k", "k == n - 2", "b < s"),
    *("s / k == 0", "s % k == -2", "b / k == -715827882", "k / i == 3", "k / (i - 1) == 0"),
    *("a[i] == 2", "a[i + 3] == 2", "a[k] + a[0] == 4", "(k | 4) == 7", "(s & 7) == 6"),
    *("(i > 0) == (k > 1)", "k > 2 and (i < 1 or f > 1.0)", "(i if f < 2.0 else k) == 1"),
    *("twice(n) == 10", "twice(n + 4294967290) == 0", "low(u) == 9", "low(u / k) == 9"),
    *("small(k) == 3", "small(n + 1) == 5", "not (small(n + 1) == 5)", "small(n + 1) < 9 or k > 0"),
    *("k > 0 or small(n + 1) < 9", "short(k + 40) == 5", "short(k + 40) < 6", "short(k) == 3"),
    *("f * k == 4.5", "f / 0.0 > 1.0", "f < k", "not In(s0)", "In(s0) and f != 0.5"),
]


@pytest.mark.slow
@pytest.mark.cc
@pytest.mark.usefixtures("require_tool")
def test_conditions_have_the_values_of_the_interpreter(tmp_path: Path) -> None:
    """Wrapping results, 64 bits without a sign, failing divisions and indices, mixed signs."""
    compared = [f"{x} {op} {y}" for x in SIGNED for op in ("<", "==") for y in SIGNED if x != y]
    wrapped = [f"{op}{x} > 2" for op in "-~" for x in UNSIGNED]
    conditions = [*CONDITIONS, *compared, *wrapped]
    properties = "".join(f'  p{n}: {{never: "{c}"}}\n' for n, c in enumerate(conditions))
    path = tmp_path / "values.yaml"
    states = "initial: s0\nstates:\n  s0: {on: {go: s0}}\n"
    path.write_text(f"{HEAD}properties:\n{properties}{states}")
    verdicts = []
    for engine in ("c", "python"):
        findings = Findings()
        report = check(load_any(path, findings), findings, options=ExplorationOptions(engine))
        assert "replay-differs" not in {d.rule.name for d in report.findings}
        verdicts.append([result.verdict for result in report.results])
    of_c, of_python = (found[-len(conditions) :] for found in verdicts)
    assert len(set(of_c)) == 2
    pairs = zip(conditions, of_c, of_python, strict=True)
    assert not [condition for condition, one, other in pairs if one != other]
