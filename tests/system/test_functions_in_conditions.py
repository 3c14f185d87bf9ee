"""Functions of charts in properties: of a chart's own and of a system's, in both engines."""

from __future__ import annotations

from pathlib import Path

import pytest

import fsmkit
from fsmkit.diagnostics import FsmkitError

CHART = """
chart: M
constants: {LIMIT: 5}
types: {Kind: [small, middle = 3, large = 7], Pair: {a: 0..9, b: bool}}
functions:
  share(part 0..9, whole 0..9) -> 0..900: 100 * part / whole
  half(part 0..9) -> 0..900: share(part, 2)
  hot(limit 0..9) -> bool: n > limit and In(b)
  above(b2 uint8[2], limit uint8) -> 0..2: |
    var many 0..2 = 0
    for x, at in b2 { let over = x > limit and at < 2; if over { many += 1 } }
    return many
  kind(k 0..9) -> Kind: |
    for each in Kind { if int(each) >= k { return each } }
    return Kind(k, Kind.small)
  first(q Pair) -> 0..9: q.a
  size() -> float64: 0.5 * n
data: {n: 0..9 = 0, s: "uint8[2] = [1, 2]", p: Pair, t: "uint8[2] = [7, 7]"}
events: {in: [go, "set(to 0..3)"]}
initial: a
states:
  a:
    on:
      go: {if: n < 7, target: b, do: n += 1; p.a = n}
      set: {do: "s[0] = event.to; s[1] = event.to + n / 3"}
  b: {on: {go: a}}
"""
HOLD = {
    "share(n, 9) > 80": "never",
    "share(n, n) > 100": "never",  # of nothing there is no share: it is not evaluated
    "half(n) > 350": "never",
    "hot(6)": "reachable",
    "hot(7)": "never",
    "above(s, 2) == 2": "reachable",
    "above(s, 5) > 0": "never",
    "above(t, 6) == 2": "invariant",
    "kind(n) == Kind.large": "reachable",
    "kind(8) == Kind.small": "invariant",
    "first(p) == n": "invariant",
    "size() > 3.4": "reachable",
    "size() > 3.5": "never",
    "In(b) and share(n, 1) == 100 * n or In(a)": "invariant",
}
Verdict = fsmkit.Verdict


def checked(path: Path, engine: str) -> tuple[int, dict[str, Verdict]]:
    report = fsmkit.check(path, engine=engine, time="discrete")
    return report.exploration.states, {r.name: r.verdict for r in report.results if r.kind}


@pytest.fixture
def chart(tmp_path: Path) -> Path:
    properties = "".join(
        f"  p{number}: {{{kind}: {condition!r}}}\n"
        for number, (condition, kind) in enumerate(HOLD.items())
    )
    path = tmp_path / "m.yaml"
    path.write_text(f"{CHART}properties:\n{properties}", encoding="utf-8")
    return path


@pytest.mark.cc
def test_both_engines_judge_a_chart_by_its_functions(chart: Path) -> None:
    states, by_python = checked(chart, "python")
    assert len(by_python) == len(HOLD)
    assert set(by_python.values()) == {Verdict.HOLDS}
    assert checked(chart, "c") == (states, by_python)


@pytest.mark.cc
def test_a_system_calls_functions_of_its_machines(chart: Path) -> None:
    system = chart.parent / "s.yaml"
    system.write_text(
        """
        system: S
        machines: {"m[i in 0..1]": m.yaml}
        environment: {may: ["m[0].go", "m[0].set", "m[1].go"]}
        properties:
          q1: {never: "m[0].share(m[0].n, 9) > 70"}
          q2: {never: "m[0].hot(6) and m[1].hot(6)"}
          q3: {never: "m[0].above(m[0].s, 9) > 0 or m[1].above(m[0].t, 7) > 0"}
          q4: {reachable: "m[0].half(m[1].n) == 350"}
        """,
        encoding="utf-8",
    )
    _, by_python = checked(system, "python")
    wanted = {"q1": Verdict.VIOLATED, "q2": Verdict.VIOLATED, "q3": Verdict.HOLDS}
    assert wanted.items() <= by_python.items()
    assert by_python["q4"] is Verdict.HOLDS
    assert by_python["m[1].p4"] is Verdict.HOLDS
    _, by_c = checked(system, "c")
    assert by_c == by_python


@pytest.mark.parametrize(
    ("condition", "message"),
    [
        ("shar(n, 2) > 3", "unknown operation `shar`"),
        ("share(n) > 3", "takes 2 arguments, not 1"),
        ("share(true, n) > 3", "share"),
    ],
)
def test_wrong_calls_are_told(tmp_path: Path, condition: str, message: str) -> None:
    path = tmp_path / "m.yaml"
    path.write_text(f'{CHART}properties: {{p: {{never: "{condition}"}}}}\n', encoding="utf-8")
    with pytest.raises(FsmkitError) as caught:
        fsmkit.check(path, engine="python")
    assert message in str(caught.value)
