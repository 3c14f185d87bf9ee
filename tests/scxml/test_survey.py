"""Passes of loose dialects leave a chart without shorthand alone: it is walked through once."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from fsmkit.chart.ecmascript.bound_arrays import bound_arrays
from fsmkit.chart.ecmascript.hoist_increments import hoist_increments
from fsmkit.chart.ecmascript.logged_calls import log_calls
from fsmkit.chart.ecmascript.spread_objects import spread_objects
from fsmkit.chart.ecmascript.spread_params import spread_params
from fsmkit.chart.ecmascript.string_methods import decide_methods
from fsmkit.chart.passes.as_globals import as_globals
from fsmkit.chart.passes.bind_late import bind_late, name_sends
from fsmkit.diagnostics import Findings, Source
from fsmkit.document.survey import Survey
from fsmkit.scxml.reader import read_document

PASSES: dict[str, Callable[[Survey], Survey]] = {
    "var x = 2; n = x": as_globals,
    "console.log(n)": log_calls,
    "w = ++n": hoist_increments,
    "n = o.a": lambda survey: spread_objects(survey, None),
    "l = [1]; l.push(n)": lambda survey: bound_arrays(survey, None, Findings()),
    "w = s.slice(1)": lambda survey: decide_methods(survey, None),
}
"""By a script that has what the pass lowers."""
DATA = {"n": "0", "l": "[1, 2]", "s": "'up'", "w": "''"}
ALWAYS: tuple[Callable[[Survey], Survey], ...] = (bind_late, name_sends, spread_params)


def survey_of(script: str) -> Survey:
    findings = Findings()
    given = {**DATA, "o": "{a: 1}"} if "o.a" in script else DATA
    data = "".join(f'<data id="{name}" expr="{init}"/>' for name, init in given.items())
    text = (
        '<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" datamodel="ecmascript" '
        f'name="M"><datamodel>{data}</datamodel><state id="a"><onentry><script>{script}</script>'
        '<send event="e" id="i"/></onentry></state></scxml>'
    )
    document = read_document(Source("m.scxml", text), findings)
    assert document is not None, list(findings)
    return Survey(document)


@pytest.mark.parametrize("script", PASSES)
def test_a_pass_changes_what_it_lowers_and_nothing_else(script: str) -> None:
    plain, shorthand = survey_of("n = 1"), survey_of(script)
    assert PASSES[script](plain) is plain
    changed = PASSES[script](shorthand)
    assert changed is not shorthand
    assert changed.document != shorthand.document
    assert changed.values != shorthand.values or changed.kinds != shorthand.kinds


def test_what_is_nowhere_written_changes_nothing() -> None:
    survey = survey_of("n = 1")
    for each in ALWAYS:
        assert each(survey) is survey
