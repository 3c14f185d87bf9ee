"""Settings of all tests."""

from __future__ import annotations

from hypothesis import settings

settings.register_profile("fsmkit", deadline=None)  # what runs the tests may be slow
settings.load_profile("fsmkit")
