"""Test charts: read `*.test.yaml`, run it on any runtime, and count coverage.

A `Suite` is run to the `Outcome` of each case. The interpreter evaluates expectations; any other
runtime must have the same trace. `make_machine`, `calls` and `assert_in` are for tests in Python;
pytest offers the first as the fixture ``machine``.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from fsmkit.testing.machines import assert_in, calls, make_machine

__all__ = ["assert_in", "calls", "make_machine"]


def __getattr__(name: str) -> Any:
    """Import a name on demand, because every run of pytest imports the plug-in."""
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from importlib import import_module

    return getattr(import_module("fsmkit.testing.machines"), name)
