"""Six cases of the gate, in less than twenty lines, fail readably for its mutants."""

from __future__ import annotations

from pathlib import Path

import pytest

from fsmkit.chart.elaborate import elaborate
from fsmkit.chart.loading import read_documents
from fsmkit.cli import execute
from fsmkit.diagnostics import Findings
from fsmkit.document.front_ends import FrontEnd
from fsmkit.plan.fingerprint import fingerprint
from fsmkit.plugins import plugin
from fsmkit.verify.mutants.operators import mutations

PAGE = Path(__file__).parents[2] / "docs/how-to/test-your-chart.md"
GATE = PAGE.read_text(encoding="utf-8").split("```yaml\n")[1].split("```")[0]
TESTS = """\
tests: Gate
chart: gate.yaml
before: [set blocked false]
cases:
  opens: [post request, expect: {in: opening, only: true, called: motor(1)}, wait 9999ms,
          post limit, expect: {in: open, only: true, called: motor(0), sent: opened}]
  closes: [post request; post limit; wait 2999ms, expect: {in: open}, wait 1ms,
           expect: {in: closing, only: true, called: motor(-1)},
           wait 9999ms; post limit, expect: {in: closed, only: true, called: motor(0)}]
  is asked again: [post request; post limit; wait 3s; post request,
   expect: {in: opening, only: true, called: [motor(1), motor(0), motor(-1), motor(0), motor(1)]}]
  is blocked: [post request; post limit; wait 3s; set blocked true, expect: {in: opening}]
  gives up opening: [post request; wait 9999ms, expect: {in: opening},
                     wait 1ms, expect: {in: stuck, only: true, called: motor(0)}]
  gives up closing: [post request; post limit; wait 12999ms, expect: {in: closing}, wait 1ms,
                     expect: {in: stuck}]
"""


def run(folder: Path, gate: str) -> int:
    (folder / "gate.yaml").write_text(gate)
    (folder / "gate.test.yaml").write_text(TESTS)
    return execute(["test", str(folder)])


@pytest.mark.slow
def test_mutants_of_the_gate_fail(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert TESTS.count("\n") < 20
    assert run(tmp_path, GATE) == 0
    assert "6 passed" in capsys.readouterr().out
    documents = read_documents(tmp_path / "gate.yaml", Findings())
    chart = elaborate(documents, Findings())
    assert chart is not None
    killed, alive = {}, []
    for mutation in mutations(documents, chart):
        changed = elaborate(mutation.documents, Findings())
        if changed is None or fingerprint(changed) == fingerprint(chart):
            continue
        code = run(tmp_path, plugin(FrontEnd, "yaml").write(mutation.documents[0]))
        told = capsys.readouterr()
        if code == 0:
            alive.append(f"{mutation.operator}: {mutation.what}")
            continue
        assert code == 1
        assert "failed-test" in told.err
        assert "gate.test.yaml:" in told.err
        killed[f"{mutation.operator}: {mutation.what}"] = told.err
    assert len(killed) >= 10
    assert alive == []
