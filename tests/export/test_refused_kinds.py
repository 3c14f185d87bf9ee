"""A kind of property that no notation has heard of is refused by each, beside its name."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import cast

import pytest

from fsmkit.chart import statements as stmt
from fsmkit.diagnostics import FsmkitError, Span
from fsmkit.export.exporter import Exporter, ExportOptions
from fsmkit.export.uppaal.recorder import Recorder
from fsmkit.plugins import plugin
from fsmkit.system.properties.property import Kind, OverGraph
from tests.verify.conftest import Load
from tests.verify.systems import AXIS, DRIVE, DRIVER

UNHEARD = Kind("unheard", OverGraph("unheard-of"))
REFUSED = {
    "jani": "is not carried over: `unheard` is no formula over states",
    "promela": "not carried over: `unheard` is no formula of linear time",
    "cspm": "`unheard` is no set of traces",
    "uppaal": "UPPAAL has no query for `unheard`: use `fsmkit check`",
    "uppaal-flat": "UPPAAL has no query for `unheard`: use `fsmkit check`",
}


@pytest.mark.parametrize("notation", REFUSED)
def test_an_unknown_kind_is_refused(
    load: Load, notation: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PATH", "")  # neither a compiler nor Graphviz is needed
    system = load(drive=DRIVE, axis=AXIS, driver=DRIVER)
    known = next(p for p in system.properties if p.condition is not None)
    asked = replace(known, name="strange", kind=UNHEARD)
    options = ExportOptions()
    text = plugin(Exporter, notation).export(replace(system, properties=(asked,)), options).text
    (finding,) = options.findings
    assert finding.rule.name == "property-not-exported"
    assert "strange" in finding.message
    assert finding.help == "`fsmkit check --property strange` decides it"
    lines = text.split("\n")
    (place,) = [n for n, line in enumerate(lines) if REFUSED[notation] in line]
    assert "strange" in "".join(lines[place - 2 : place + 1])


@dataclass(frozen=True)
class Require:
    """A statement that no notation knows."""

    span: Span
    word = "require"


def test_uppaal_names_a_statement_that_it_does_not_know(load: Load) -> None:
    chart = load(drive=DRIVE, axis=AXIS, driver=DRIVER).machines[0].chart
    place = chart.root.span
    assert place is not None
    rewriter = object.__new__(Recorder)
    with pytest.raises(FsmkitError, match="the statement `require` is not translated") as caught:
        rewriter._statement(cast("stmt.Statement", Require(place)))
    (finding,) = caught.value.diagnostics
    assert finding.rule.name == "not-in-uppaal"
    assert finding.primary is not None
    assert finding.primary.span == place
