"""Rewritings: random machines do as charts what a reference of the foreign rules does.

``python -m devtools.foreign rewritings`` tries 2,000 machines for each set of rules.
"""

from __future__ import annotations

import pytest

from devtools.foreign import machines
from devtools.foreign.__main__ import COMBINATIONS
from devtools.foreign.machines import difference
from fsmkit.diagnostics import FsmkitError

MACHINES = 15


@pytest.mark.slow
@pytest.mark.parametrize("rules", COMBINATIONS, ids="+".join)
def test_random_machines(rules: tuple[str, ...]) -> None:
    assert [each for seed in range(MACHINES) if (each := difference(seed, rules))] == []


@pytest.mark.parametrize("rule", ["R1", "R2", "R7", "R9", "R11"])
def test_the_reference_needs_the_rewriting(rule: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Without the rewriting, some machine differs: the comparison can fail."""
    names = {
        "R1": "local_transitions", "R2": "resting_composites", "R9": "ordered_candidates",
    }  # fmt: skip
    name = names.get(rule, "chained_reactions")
    monkeypatch.setattr(machines, name, lambda document, *_: document)
    rules = ("R7", "R11") if rule == "R7" else (rule,)
    found = False
    for seed in range(40):
        try:
            found = found or difference(seed, rules) is not None
        except FsmkitError:
            found = True
    assert found
