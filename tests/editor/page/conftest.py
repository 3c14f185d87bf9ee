"""The browser of the page's tests."""

from tests.inspector.conftest import browser

__all__ = ["browser"]
