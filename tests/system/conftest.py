"""Systems from texts: as the tests of `verify` have them."""

from __future__ import annotations

from tests.verify.conftest import load  # noqa: F401
