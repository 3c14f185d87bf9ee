"""Writing results to files: all of them or none."""

from __future__ import annotations

import os
import shutil
import stat
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path

import click

from fsmkit.diagnostics import FsmkitError, fail
from fsmkit.diagnostics.interrupts import hold_interrupts


def write_files(files: Mapping[Path, str | bytes], folder: Path | None = None) -> None:
    """Write all files and create folders as needed; if one cannot be written, change none.

    Each content is first written to a temporary name beside its path, then all are renamed, so
    that a reader never sees a partial file. A link is followed; a device or a pipe is written
    directly. Strings are UTF-8 with unchanged line ends.

    Args:
        files: The content of each file.
        folder: The folder given by the user, if fsmkit chose the file names. Links that lead out of
            it are not followed.

    Raises:
        FsmkitError: ``unwritable-output``; files and folders are unchanged.

    """
    if folder is not None:
        for path in files:
            _require_within(folder, path)
    contents = {path: _encoded(text) for path, text in files.items()}
    streams = {path for path in contents if _is_stream(path)}
    kept: list[Path] = []
    with ExitStack() as undo:
        ready = [
            (place, _write_beside(place, content, undo))
            for path, content in contents.items()
            if path not in streams
            for place in [_behind_links(path)]
        ]
        for path in streams:
            with _os_errors_as_findings(path), path.open("wb") as stream:
                stream.write(contents[path])
        for path, temporary in ready:
            with _os_errors_as_findings(path), hold_interrupts():
                before = _put_aside(path, undo)
                temporary.replace(path)
                undo.callback(_restore, path, before)
                kept.extend(() if before is None else (before,))
        with hold_interrupts():
            undo.pop_all()  # nothing failed: nothing is undone
            for before in kept:
                with suppress(OSError):
                    before.unlink()


def _require_within(folder: Path, path: Path) -> None:
    leads_to = Path(os.path.realpath(path))
    if not leads_to.is_relative_to(os.path.realpath(folder)):
        raise fail(
            "unwritable-output",
            f"cannot write `{path}`: a link leads from there to `{leads_to}`",
            help="remove the link, or choose another folder",
        )


def _encoded(content: str | bytes) -> bytes:
    return content.encode() if isinstance(content, str) else content


def _is_stream(path: Path) -> bool:
    """Whether a path is of something that no other file may take the place of (`/dev/null`)."""
    try:
        mode = path.stat().st_mode
    except (OSError, ValueError):  # nothing is there, or nothing that can be written
        return False
    return not stat.S_ISREG(mode) and not stat.S_ISDIR(mode)


def _behind_links(path: Path) -> Path:
    try:
        return Path(os.path.realpath(path)) if path.is_symlink() else path
    except (OSError, ValueError):  # reported when it is written
        return path


def _write_beside(path: Path, content: bytes, undo: ExitStack) -> Path:
    with _os_errors_as_findings(path):
        if str(path) == "-":
            raise OSError(None, "it does not name a file here; `/dev/stdout` prints")
        _make_folder(path.parent, undo)
        if path.is_dir():
            raise IsADirectoryError(None, "is a directory")
        with hold_interrupts():
            handle, name = tempfile.mkstemp(prefix=f".{path.name[:40]}-", dir=path.parent)
            temporary = Path(name)
            undo.callback(temporary.unlink, missing_ok=True)
            file = undo.enter_context(os.fdopen(handle, "wb"))
        with file:
            file.write(content)
        temporary.chmod(_mode(path))
    return temporary


def _make_folder(folder: Path, undo: ExitStack) -> None:
    for missing in reversed([p for p in (folder, *folder.parents) if not p.exists()]):
        with hold_interrupts():
            missing.mkdir(exist_ok=True)
            undo.callback(_remove_folder, missing)


def _mode(path: Path) -> int:
    """Return the access rights of the existing file, or those of a new one."""
    with suppress(OSError):
        return path.stat().st_mode & 0o7777
    mask = os.umask(0)
    os.umask(mask)
    return 0o666 & ~mask


def _put_aside(path: Path, undo: ExitStack) -> Path | None:
    """Give a file that is there a second name, so that bringing it back needs no room."""
    if not path.exists():
        return None
    handle, name = tempfile.mkstemp(prefix=f".{path.name[:40]}-", dir=path.parent)
    os.close(handle)
    before = Path(name)
    undo.callback(before.unlink, missing_ok=True)
    before.unlink()
    try:
        before.hardlink_to(path)
    except OSError:  # a file system without links
        shutil.copy2(path, before)
    return before


def _restore(path: Path, before: Path | None) -> None:
    with suppress(OSError):
        if before is None:
            path.unlink(missing_ok=True)
        else:
            before.replace(path)


def _remove_folder(folder: Path) -> None:
    with suppress(OSError):
        folder.rmdir()


@contextmanager
def _os_errors_as_findings(path: Path) -> Iterator[None]:
    """Convert an error of the operating system to a diagnostic about that file."""
    try:
        yield
    except FsmkitError:
        raise
    except (OSError, ValueError) as error:
        strerror = getattr(error, "strerror", None)
        reason = (strerror or str(error) or type(error).__name__).lower()
        raise fail(
            "unwritable-output",
            f"cannot write `{path}`: {reason}",
            help=f"choose another place{_by_option(path)}, or check the permissions and the free "
            "space",
        ) from error


def _by_option(path: Path) -> str:
    """Return the option that names a file or its folder, as text for a message; may be empty."""
    context = click.get_current_context(silent=True)
    if context is None:
        return ""
    for holds in (lambda given: given == path, lambda given: given in path.parents):
        for option in context.command.params:
            given = context.params.get(option.name or "")
            named = given if isinstance(given, tuple) else (given,)
            is_path = isinstance(option, click.Option) and isinstance(option.type, click.Path)
            if is_path and any(
                isinstance(each, str | Path) and holds(Path(each)) for each in named
            ):
                return f" with `{max(option.opts, key=len)}`"
    return ""
