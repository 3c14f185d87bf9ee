"""Keep the best known order of levels beside a cached program, for its next run."""

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
    """Return the stored order; empty without one."""
    order, _ = _read(program, machines)
    return tuple(order)


def keep_order(program: Path, diagram: Diagram) -> None:
    """Store the order of a diagram, unless a stored one took fewer nodes.

    Programs outside of the cache, and folders that are not writable, store none.
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
