"""What regions of a parallel state do together, on every runtime: order, deferral, histories.

The cases of deferral, which are those of the interpreter, follow UML 2.5.1, Deferred Events, and
the subjects of PSSM's tests Deferred 001 to 007; "one region defers what another would take" is its
Deferred 004-A.
"""

from __future__ import annotations

from pathlib import Path

import pytest

from devtools.differential import Case, compare_all, target_names
from devtools.runtimes import harness
from fsmkit.chart.loading import load
from fsmkit.runtime.script import run_script

CHARTS = Path(__file__).parent / "charts"
CASES = sorted((Path(__file__).parents[1] / "runtime" / "cases").glob("*.case"))

# Of the first two the content runs as the atomic states selected it (Appendix D): that of `s3`
# before that of `p`, which `s9` selects; that of `s2`, which `s6` selects, before that of `s10`.
# In the third `s8` goes to a history of `s3`, which stands for `s8`: the domain is `s7`, and though
# addAncestorStatesToEnter adds `s4` with the region `s9` and its default `s12`, they lie above the
# domain, where `s13` stays active (SCXML 3.11: of a compound state one child is active).
FOUND = {
    "content_order.scxml": ("post a", "= s3 s9", "@1 > event a / t 2 / t 1 / = s3 s9 / d h 12"),
    "order_disputed.scxml": (
        "post a",
        "= s6 s10",
        "@1 > event a / t 1 / t 4 / = s6 s10 / d h 37 / d b 30 / d v0 2 / d v1 1 / d v2 1",
    ),
    "two_histories.scxml": (
        "post b",
        (
            "@0 > start / + s2 / - s2 / raise b / t 1 / + s3 / + s4 / + s7 / + s8 / + s9 / + s13 / "
            "- s8 / t 5 / + s8 / unhandled done.state.s9 / = s8 s13"
        ),
        "@1 > event b / - s8 / t 5 / + s8 / = s8 s13 / d h 0 / d b 30 / d v0 0 / d v1 0 / d v2 0",
    ),
    "defer_in_a_region.yaml": (
        "post call;post done",
        "= w h / @1 > event call / = w h",
        "@1 > event done / - w / t 2 / + x / = x h / @1 > event call / t 5 / = x h / d n 0 / d m 1",
    ),
}


def found_script(name: str) -> tuple[str, ...]:
    return ("start 0", *FOUND[name][0].split(";"), "run 1", "dump")


@pytest.mark.parametrize("name", FOUND)
def test_found_by_others(name: str) -> None:
    _, before, after = FOUND[name]
    trace = " / ".join(run_script(load(CHARTS / name), found_script(name)))
    assert trace.endswith(f"{before} / {after}")


@pytest.mark.slow
@pytest.mark.external
@pytest.mark.parametrize("target", [name for name in target_names() if name != "transitions"])
def test_every_runtime(target: str, tmp_path: Path) -> None:
    cases = [Case((), load(CHARTS / name), found_script(name), name) for name in FOUND]
    for path in CASES:
        chart, _, rest = path.read_text(encoding="utf-8").partition("\n--- script\n")
        (tmp_path / f"{path.stem}.yaml").write_text(chart, encoding="utf-8")
        script = tuple(line for line in rest.partition("\n--- trace\n")[0].splitlines() if line)
        cases.append(Case((), load(tmp_path / f"{path.stem}.yaml"), script, path.stem))
    totals = compare_all(cases, [harness(target)])
    for name, found in totals.divergences:
        pytest.fail(f"{name}: {found}")
    assert (totals.charts, totals.rejected) == (len(cases), 0)
