"""The result of one property, whose path runs in the interpreter as it was found."""

from __future__ import annotations

from fsmkit.diagnostics import Findings
from fsmkit.system.system import System
from fsmkit.verify.explore import ExplorationOptions, check
from fsmkit.verify.report.verdict import Result


def result(system: System, name: str, options: ExplorationOptions) -> Result:
    report = check(system, Findings(), options=options)
    (found,) = [r for r in report.results if r.name == name]
    if found.trace is not None:
        assert not found.trace.differs
    return found
