"""The best order of levels that a program found, kept beside it in the cache for its next run."""

from __future__ import annotations

import json
import os
import tempfile
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path

from fsmkit.diagnostics.parsing import parse_json
from fsmkit.verify.engines.c.cache import ORDER, SUMS
from fsmkit.verify.statespace.symbolic_search import Diagram


def kept_order(program: Path, machines: int) -> tuple[int, ...]:
    """Return the order that is kept; empty where there is none."""
    order, _ = _read(program, machines)
    return tuple(order)


def keep_order(program: Path, diagram: Diagram) -> None:
    """Keep the order of a diagram, unless one is kept that took fewer nodes.

    A program that is not in the cache has none, and a folder that cannot be written keeps none.
    """
    _, made = _read(program, len(diagram.order))
    if not (program.parent / SUMS).is_file() or 0 < made <= diagram.made:
        return
    with suppress(OSError):
        number, path = tempfile.mkstemp(prefix=".new-", dir=program.parent.parent)
        with os.fdopen(number, "w", encoding="utf-8") as file:
            json.dump({"order": diagram.order, "made": diagram.made}, file)
        Path(path).replace(program.parent / ORDER)


def _read(program: Path, machines: int) -> tuple[Sequence[int], int]:
    with suppress(OSError, ValueError, TypeError, KeyError):
        kept = parse_json((program.parent / ORDER).read_bytes())
        order, made = kept["order"], kept["made"]
        if sorted(order) == list(range(machines)) and type(made) is int:
            return order, made
    return (), 0
