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
def without_garbage_collection() -> Iterator[None]:
    """Suspend garbage collection in a verb that reads, writes and exits.

    Nearly all its objects live until then. Collections took a fifth of the time to compile a chart
    of 10,000 states.
    """
    was_enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was_enabled:
            gc.freeze()  # the objects get old, so that the next collection skips them
            gc.enable()
            gc.unfreeze()
