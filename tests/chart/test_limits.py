"""Everything declared is counted against one limit, lowered here so that the charts are small."""

from __future__ import annotations

from pathlib import Path

import pytest

from devtools.sizes import BY_NAME
from fsmkit.chart import limits
from fsmkit.diagnostics import FsmkitError
from fsmkit.loading import load


@pytest.mark.parametrize("kind", ["data", "inputs", "operations", "fields", "strings"])
def test_one_more_than_the_limit_is_rejected(
    kind: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(limits, "MOST_DECLARED", 60)
    load(BY_NAME[kind](60).write(tmp_path))
    with pytest.raises(FsmkitError, match="too-large") as caught:
        load(BY_NAME[kind](62).write(tmp_path))
    assert "but at most 60 are allowed" in str(caught.value)
