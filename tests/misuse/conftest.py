"""How much misuse there is: a little, or a million events for each runtime (`make misuse`)."""

from __future__ import annotations

import os
from pathlib import Path

HERE = Path(__file__).parent
ABUSED = HERE / "abused.yaml"
IS_LONG = bool(os.environ.get("FSMKIT_MISUSE"))
EVENTS = 1_000_000 if IS_LONG else 4_000
