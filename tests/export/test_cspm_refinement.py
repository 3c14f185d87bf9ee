"""Refinement in CSPm: the assertion that is written holds where `refine` says so."""

from __future__ import annotations

from contextlib import redirect_stderr, redirect_stdout
from io import StringIO
from pathlib import Path

import pytest

from fsmkit.chart.loading import load_with_findings
from fsmkit.cli import execute
from fsmkit.diagnostics import Findings
from fsmkit.export.cspm.comparison import comparison
from fsmkit.export.cspm.refinement_model import write_refinement
from fsmkit.export.exporter import ExportOptions
from fsmkit.verify.properties.refinement import refines
from tests.export.cspm_meaning import Meaning
from tests.verify.properties.test_refinement import ALLOWED, BASE, REFUSED

CELL = Path(__file__).parents[2] / "machines/production_cell"


def evaluated(text: str) -> bool:
    """Return what the only assertion says."""
    meaning = Meaning(text)
    (assertion,) = meaning.script.assertions
    return meaning.holds(assertion, 10**5)


@pytest.mark.parametrize("name", [*ALLOWED, *REFUSED])
def test_small_charts(tmp_path: Path, name: str) -> None:
    refine, more = {**ALLOWED, **REFUSED}[name]
    (tmp_path / "base.yaml").write_text(BASE)
    text = f"chart: Derived\nextends: base.yaml\n{more}\nrefine:\n{refine}\n"
    (tmp_path / "derived.yaml").write_text(text)
    derived, base = (
        load_with_findings(tmp_path / f"{name}.yaml", Findings()) for name in ("derived", "base")
    )
    for one, other in ((derived, base), (base, derived), (base, base)):
        found = refines(one, other)
        assert not found.doubt
        assert (
            evaluated(write_refinement(comparison(one, other, ExportOptions())))
            is not found.violated
        )


KINDS = {
    "sometimes": "s: {rest: true, sometimes: {target: t}}\n  t: {on: {e: s}}",
    "sometimes in a region": """s:
    regions:
      l: {initial: l1, states: {l1: {sometimes: l2}, l2: {on: {e: l1}}}}
      r: {initial: r1, states: {r1: {sometimes: {if: n == 0, target: r2}}, r2: {on: {e: r1}}}}""",
    "sometimes that sends": "s: {sometimes: {do: 'send o(k = n); n = 1 - n'}, on: {e: s}}",
    "sometimes and defer": "s: {defer: [e], sometimes: {target: t}}\n  t: {on: {e: s}}",
    "sometimes to the end": "s: {sometimes: {target: t}}\n  t: {final: true, entry: send o(k = 1)}",
    "an interval": "s: {after: {1s..2s: {target: t, do: send o(k = 1)}}}\n  t: {on: {e: s}}",
    "a raised event": "s: {sometimes: {do: raise e(k = 1)}, on: {e: {do: send o(k = event.k)}}}",
    "a fault": "s: {sometimes: {do: 'n += 1; send o(k = n)'}, on: {e: s}}",
}


@pytest.mark.parametrize("kind", KINDS)
def test_each_kind_of_chart_refines_itself(tmp_path: Path, kind: str) -> None:
    declared = "events: {in: [e(k 0..1)], out: [o(k 0..1)]}\ndata: {n: 0..1 fault = 0}"
    text = f"chart: Kind\n{declared}\ninitial: s\nstates:\n  {KINDS[kind]}\n"
    (tmp_path / "kind.yaml").write_text(text)
    chart = load_with_findings(tmp_path / "kind.yaml", Findings())
    found = refines(chart, chart)
    assert (found.violated, found.doubt) == (False, "")
    assert evaluated(write_refinement(comparison(chart, chart, ExportOptions())))


@pytest.mark.slow
@pytest.mark.parametrize("name", ["belt", "rotator"])
def test_modules_of_the_cell(name: str) -> None:
    base = str(CELL / "module.scxml")
    with redirect_stdout(StringIO()) as out:
        code = execute(["export", str(CELL / f"{name}.yaml"), "--to", "cspm", "--refines", base])
    assert code == 0
    assert f"assert MODULE [T= {name.upper()}\n" in out.getvalue()
    assert not evaluated(out.getvalue())


def test_other_notations_have_no_refinement() -> None:
    arguments = ["export", str(CELL / "belt.yaml"), "--to", "promela"]
    with redirect_stderr(StringIO()) as err:
        assert execute([*arguments, "--refines", str(CELL / "module.scxml")]) == 2
    assert "--refines needs --to cspm" in " ".join(err.getvalue().split())
