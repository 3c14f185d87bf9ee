"""When Python searches for garbage in circles."""

from __future__ import annotations

import gc
from collections.abc import Iterator
from contextlib import contextmanager

COLLECT_AFTER = 100_000
"""Objects between two searches for garbage in circles, of which a chart holds next to none.

Objects that outlived a search are searched five times more seldom than by default.
"""


@contextmanager
def uncollected() -> Iterator[None]:
    """Search for none in a verb that reads, writes and ends: nearly all it makes lives until then.

    The searches took a fifth of the time in which a chart of 10,000 states was compiled.
    """
    was_enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was_enabled:
            gc.freeze()  # what was made is old at once: else the next object has it all searched
            gc.enable()
            gc.unfreeze()
