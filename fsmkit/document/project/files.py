"""From a path to its project file, and to the charts that it names."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path

from fsmkit.diagnostics import Findings, FsmkitError, fail
from fsmkit.diagnostics.paths import is_file, path_exists
from fsmkit.document.project.project import OWN, PYPROJECT, Project, read_project


def project_of(file: Path) -> Project | None:
    """Return the project of a file or a folder: of the nearest project file above it.

    Raises:
        FsmkitError: With what is wrong in the project file.

    """
    try:
        here = file.resolve()
    except (OSError, RuntimeError, ValueError):  # links in circles; no path at all
        return None
    for folder in (here, *here.parents):
        for name in (OWN, PYPROJECT):
            found = _project(folder / name)
            if found is not None:
                return found
    return None


def _project(path: Path) -> Project | None:
    try:
        state = path.stat()
    except (OSError, ValueError):
        return None
    return _read(path, state.st_mtime_ns, state.st_size)


@lru_cache(maxsize=64)
def _read(path: Path, changed: int, size: int) -> Project | None:
    """Return the project of a file; time and size are there to read it again when it changes."""
    del changed, size
    if not is_file(path):
        return None
    try:
        text = path.read_text(encoding="utf-8")
    except OSError as error:
        if path.name == PYPROJECT:
            return None
        reason = (error.strerror or type(error).__name__).lower()
        raise fail("unreadable-file", f"cannot read `{path}`: {reason}") from error
    except UnicodeDecodeError as error:
        if path.name == PYPROJECT:
            return None
        raise fail("broken-project", f"`{path}` is not in UTF-8") from error
    findings = Findings()
    found = read_project(path, text, findings)
    if findings.has_errors:
        raise FsmkitError(findings)
    return found


def resolve_name(file: Path, name: str, own: Path) -> Path:
    """Return the file that another one names: beside it, or else in a folder of the project.

    Args:
        file: The file that names another.
        name: The relative path as it is written.
        own: Where it leads from ``file``.

    Returns:
        ``own`` if something is there, or nothing in any folder either.

    Raises:
        FsmkitError: With what is wrong in the project file.

    """
    if path_exists(own) or Path(name).is_absolute():
        return own
    project = project_of(file)
    folders = () if project is None else project.search
    return next((folder / name for folder in folders if path_exists(folder / name)), own)
