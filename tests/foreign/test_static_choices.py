"""R10: paths of condition connectors, beside a reference that evaluates all guards first.

``python -m devtools.foreign rewritings`` compares 2,000 random nets.
"""

from __future__ import annotations

import pytest

from devtools.foreign.choice_nets import comparison
from fsmkit.diagnostics import Text
from fsmkit.foreign.rewriting import static_choices

SOME = [60, pytest.param(400, marks=pytest.mark.slow)]


@pytest.mark.parametrize("nets", SOME)
def test_guards_come_before_actions(nets: int) -> None:
    rewritten = 0
    for number in range(nets):
        difference, rewritings = comparison(number)
        assert difference is None
        rewritten += len(rewritings)
    assert rewritten > nets


def test_the_comparison_can_fail(monkeypatch: pytest.MonkeyPatch) -> None:
    """Some net differs if the guards behind a choice are dropped."""

    def first_guard(first: Text | None, second: Text | None) -> Text | None:
        return first if second is None else first or second

    monkeypatch.setattr(static_choices, "_both", first_guard)
    assert any(comparison(number)[0] is not None for number in range(40))
