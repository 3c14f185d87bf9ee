"""A cache of compiled programs in a folder of the user's own.

Cached programs are executed, so an entry is valid only if nobody else can have written it. Folder,
entry and files must belong to this user and be writable by this user only, and nobody else may be
able to replace a folder above. An entry is a folder with its files and their hashes in `SUMS`. It
is created under a temporary name and renamed in one step, so it is complete. An entry that does not
match its hashes is created again. A user of an entry holds a lock on it, which prevents its
removal.
"""

from __future__ import annotations

import fcntl
import hashlib
import json
import os
import re
import shutil
import stat
import tempfile
import time
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

from fsmkit.diagnostics.parsing import parse_json

LIMIT = 256 << 20
"""Bytes that are kept; beyond that the entries go that were used the longest ago."""
SUMS = "sums.json"
MOST_SUMS = 1 << 20
"""Bytes of a file of hashes; an entry has a few files."""
ORDER = "order.json"
"""The order that a program found for its next run: only read, so it has no hash."""
NAME = re.compile(r"(core-)?[0-9a-f]{32}")
UNFINISHED = re.compile(r"\.(new|old)-.*|(core-)?[0-9a-f]{32}\.[0-9]+|core-.*")
"""Remains of an interrupted build, of this version or an earlier one."""
ABANDONED = 60
"""Seconds after which what nobody holds was left by one who was interrupted."""
TRIES = 3


class UnusableError(Exception):
    """The reason why a folder is not used as a cache."""


def cache_folder() -> Path:
    """Return the folder of the cache: in XDG_CACHE_HOME, else in ~/.cache.

    Raises `UnusableError` if this user has no home.
    """
    base = Path(os.environ.get("XDG_CACHE_HOME", ""))
    try:
        home = base if base.is_absolute() else Path.home() / ".cache"
    except RuntimeError as error:
        raise UnusableError("this user has no home folder") from error
    return home / "fsmkit" / "explorer"


@dataclass(frozen=True, slots=True)
class Entry:
    """A cached program: its name, its bytes, its last use (seconds since 1970)."""

    name: str
    size: int
    used: float


class Cache:
    """A folder that is safe to use as a cache."""

    def __init__(self, folder: Path) -> None:
        """Create the folder if necessary. Raises `UnusableError` if it cannot be used."""
        self.folder = folder
        try:
            folder.mkdir(mode=0o700, parents=True, exist_ok=True)
            _require_own(folder)
            if not os.access(folder, os.W_OK | os.X_OK):
                raise UnusableError("it cannot be written")
        except OSError as error:
            raise UnusableError(_reason(error)) from error

    # --- use -----------------------------------------------------------------------------------

    def find(self, name: str, hold: ExitStack) -> Path | None:
        """Return the folder of a valid entry; None without one.

        The entry is not removed until ``hold`` is closed.
        """
        entry = self.folder / name
        with ExitStack() as mine:
            if not mine.enter_context(_lock(entry, fcntl.LOCK_SH)) or not is_whole(entry):
                return None
            hold.enter_context(mine.pop_all())
        with suppress(OSError):
            os.utime(entry)
        return entry

    def add(self, name: str, files: Mapping[str, Path], hold: ExitStack) -> Path:
        """Store copies of files as an entry, and return its folder.

        Raises `OSError` if there is no space, and leaves nothing behind then.
        """
        made = Path(tempfile.mkdtemp(prefix=".new-", dir=self.folder))
        try:
            with _lock(made, fcntl.LOCK_SH):
                sums = {}
                for file, source in files.items():
                    shutil.copyfile(source, made / file)
                    (made / file).chmod(0o700)
                    sums[file] = _hash(made / file)
                (made / SUMS).write_text(json.dumps(sums), encoding="utf-8")
                (made / SUMS).chmod(0o600)
                self._name(made, self.folder / name)
        finally:
            shutil.rmtree(made, ignore_errors=True)
        found = self.find(name, hold)
        self.prune()
        if found is None:
            raise OSError(None, "what was written does not read back")
        return found

    def _name(self, made: Path, entry: Path) -> None:
        """Rename a new entry to its final name, unless another process was first."""
        for _ in range(TRIES):
            with suppress(OSError):
                made.rename(entry)
                return
            if is_whole(entry):
                return
            self._remove(entry)

    # --- keeping it small ------------------------------------------------------------------------

    def entries(self) -> tuple[Entry, ...]:
        """Return the entries, the most recently used one first."""
        found = []
        for path in self._paths():
            if NAME.fullmatch(path.name):
                with suppress(OSError):
                    used = path.lstat().st_mtime
                    found.append(Entry(path.name, _size(path), used))
        return tuple(sorted(found, key=lambda entry: (-entry.used, entry.name)))

    def prune(self, limit: int = LIMIT, *, broken: bool = False) -> tuple[Entry, ...]:
        """Remove the oldest entries until ``limit`` bytes are left; return the removed ones.

        Remains of interrupted builds are removed, too. With ``broken``, all entries are read, and
        invalid ones removed. Entries in use remain.
        """
        for path in self._paths():
            if UNFINISHED.fullmatch(path.name) and not NAME.fullmatch(path.name):
                with suppress(OSError):
                    if time.time() - path.lstat().st_mtime > ABANDONED:
                        self._remove(path)
        entries = self.entries()
        total = sum(entry.size for entry in entries)
        gone = []
        for entry in reversed(entries):
            path = self.folder / entry.name
            unfit = not path.is_dir() or (broken and not is_whole(path))
            if (total > limit or unfit) and self._remove(path):
                total -= entry.size
                gone.append(entry)
        return tuple(gone)

    def _paths(self) -> list[Path]:
        with suppress(OSError):
            return sorted(self.folder.iterdir())
        return []

    def _remove(self, path: Path) -> bool:
        """Remove an entry that nobody uses; return whether it is gone."""
        if path.is_symlink() or not path.is_dir():
            with suppress(OSError):
                path.unlink()
                return True
            return False
        with _lock(path, fcntl.LOCK_EX) as alone:
            if not alone:
                return False
            aside = path
            with suppress(OSError):
                aside = path.rename(self.folder / f".old-{path.name[-32:]}-{os.getpid()}")
            shutil.rmtree(aside, ignore_errors=True)
            return not path.exists()


# --- what is fit to be executed -------------------------------------------------------------------


def is_whole(entry: Path) -> bool:
    """Return whether an entry matches its hashes, and only this user can have written it.

    Only regular files are opened: a pipe would block, and a device may never end.
    """
    try:
        if not stat.S_ISDIR(entry.lstat().st_mode) or _other_writer(entry.lstat()):
            return False
        found = {path.name: path.lstat() for path in entry.iterdir()}
        if any(_other_writer(file) or not stat.S_ISREG(file.st_mode) for file in found.values()):
            return False
        if found[SUMS].st_size > MOST_SUMS:
            return False
        sums = parse_json((entry / SUMS).read_bytes())
        return (
            isinstance(sums, dict)
            and found.keys() - {ORDER} == {*sums, SUMS}
            and all(found[name].st_mode & stat.S_IXUSR for name in sums)
            and all(_hash(entry / name) == wanted for name, wanted in sums.items())
        )
    except (OSError, ValueError, KeyError):
        return False


def _other_writer(found: os.stat_result) -> str:
    """Return why others may have written a file; empty if they cannot have."""
    if stat.S_ISLNK(found.st_mode):
        return "it is a link"
    if found.st_uid != os.geteuid():
        return "it belongs to another user"
    if found.st_mode & (stat.S_IWGRP | stat.S_IWOTH):
        return "others can write it"
    return ""


def _require_own(folder: Path) -> None:
    """Reject a folder that others can write, or can replace by another."""
    why = _other_writer(folder.lstat())
    if why:
        raise UnusableError(why)
    for above in Path(os.path.realpath(folder)).parents:
        found = above.stat()
        if found.st_uid not in (0, os.geteuid()):
            raise UnusableError(f"`{above}`, above it, belongs to another user")
        if found.st_mode & stat.S_IWOTH and not found.st_mode & stat.S_ISVTX:
            raise UnusableError(f"others can write `{above}`, above it")


def _hash(file: Path) -> str:
    with file.open("rb") as opened:
        return hashlib.file_digest(opened, "sha256").hexdigest()


def _size(path: Path) -> int:
    if not path.is_dir():
        return path.lstat().st_size
    return sum(file.lstat().st_size for file in path.iterdir())


def _reason(error: OSError) -> str:
    return (error.strerror or type(error).__name__).lower()


@contextmanager
def _lock(folder: Path, kind: int) -> Iterator[bool]:
    """Lock a folder; False if it is missing or another process holds a conflicting lock.

    Without locks in the file system, nobody can hold one.
    """
    try:
        opened = os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW)
    except OSError:
        yield False
        return
    try:
        held = True
        try:
            fcntl.flock(opened, kind | fcntl.LOCK_NB)
            there = folder.stat(follow_symlinks=False)
            held = (there.st_dev, there.st_ino) == (
                os.fstat(opened).st_dev,
                os.fstat(opened).st_ino,
            )
        except (BlockingIOError, FileNotFoundError):
            held = False
        except OSError:
            pass
        yield held
    finally:
        os.close(opened)
