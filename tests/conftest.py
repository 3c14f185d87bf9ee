"""Settings of all tests."""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable

import pytest
from hypothesis import settings

from fsmkit.texts import written

written.guards_notations = True
os.environ["FSMKIT_GUARD_NOTATIONS"] = "1"
written.is_strict = "FSMKIT_STRICT_TEXTS" in os.environ  # no raw text, however harmless
settings.register_profile("fsmkit", deadline=None)  # what runs the tests may be slow
settings.load_profile("fsmkit")


@pytest.fixture(scope="session")
def require() -> Callable[[bool, str], None]:
    """Skip the test where a tool is not there, or fail where all tools must be there."""

    def skip_without(is_there: bool, name: str) -> None:
        if not is_there:
            missing = f"`{name}` is not installed (make tools)"
            if os.environ.get("FSMKIT_REQUIRE_TOOLS"):
                pytest.fail(missing)
            pytest.skip(missing)

    return skip_without


@pytest.fixture(scope="session")
def require_tool(require: Callable[[bool, str], None]) -> Callable[[str], str]:
    """Give the path of a tool; without it skip the test, or fail where all tools must be there."""

    def path_of(name: str) -> str:
        path = shutil.which(name)
        require(path is not None, name)
        assert path is not None
        return path

    return path_of


@pytest.fixture(scope="session")
def dot(require_tool: Callable[[str], str]) -> str:
    """Give the path of Graphviz's layout program."""
    return require_tool("dot")
