"""Checks of paths that were read from a file, or typed."""

from __future__ import annotations

import os.path
from pathlib import Path


def path_exists(path: Path) -> bool:
    """Return whether a path exists; false for a name that no file can have.

    `Path.exists` of Python before 3.14 raises `OSError` for a name that is too long.
    """
    return os.path.exists(path)  # noqa: PTH110


def is_file(path: Path) -> bool:
    """Return whether a file is at a path; false for a name that no file can have."""
    return os.path.isfile(path)  # noqa: PTH113
