"""Tests of one's own charts: read from `*.test.yaml`, run on any runtime, their coverage counted.

A `Suite` comes in, the `Outcome` of each case goes out; an expectation is evaluated in the
interpreter, and another runtime must do line by line the same. `make_machine`, `calls` and
`assert_in` are for tests in Python; pytest has the first as the fixture ``machine``.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from fsmkit.testing.machines import assert_in, calls, make_machine

__all__ = ["assert_in", "calls", "make_machine"]


def __getattr__(name: str) -> Any:
    """Import what is asked for: the plug-in of pytest is imported by every run of it."""
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from importlib import import_module

    return getattr(import_module("fsmkit.testing.machines"), name)
