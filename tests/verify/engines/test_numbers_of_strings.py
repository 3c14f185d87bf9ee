"""Strings have one number each: in the machine, and in the code that drives it for the explorer."""

from __future__ import annotations

from pathlib import Path

import pytest

from fsmkit.diagnostics import Findings
from fsmkit.system.any_file import load_any
from fsmkit.verify.explore import ExplorationOptions, check

CHART = """
<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" name="Numbers" initial="a"
  datamodel="ecmascript">
  <datamodel><data id="D" expr="'2'"/><data id="E" expr="'3'"/></datamodel>
  <state id="a"><transition event="tick" target="b"/></state>
  <state id="b">
    <onentry><log expr="'RUNNING'"/><log expr="'STOPPED'"/></onentry>
    <transition cond="{guard}" target="a"/>
  </state>
</scxml>
"""


@pytest.mark.cc
@pytest.mark.usefixtures("require_tool")
@pytest.mark.parametrize("guard", ["nosuch", "D == 'RUNNING'", "E != D", "_event.name == 'tick'"])
def test_the_explorer_takes_no_string_for_another(guard: str, tmp_path: Path) -> None:
    """Live or dead: what is reset is reset to its own start value."""
    path = tmp_path / "numbers.scxml"
    path.write_text(CHART.format(guard=guard))
    reports = []
    for engine in ("c", "python"):
        findings = Findings()
        reports.append(
            check(
                load_any(path, findings),
                findings,
                options=ExplorationOptions(engine, time="discrete"),
            )
        )
        assert "replay-differs" not in {d.rule.name for d in (*findings, *reports[-1].findings)}
    by_c, by_python = reports
    assert by_c.exploration.states == by_python.exploration.states
    assert [r.verdict for r in by_c.results] == [r.verdict for r in by_python.results]
