"""Report exhausted memory, disk space, files or processes as findings, not as bugs."""

from __future__ import annotations

import errno

from fsmkit.diagnostics import FsmkitError, fail

OF_THE_MACHINE = {
    errno.ENOSPC: "disk space",
    errno.EDQUOT: "disk space of this user",
    errno.EFBIG: "room for a file of that size",
    errno.ENOMEM: "memory",
    errno.EAGAIN: "processes",
    errno.EMFILE: "open files of this process",
    errno.ENFILE: "open files",
}
SHOWN = 40
"""Characters of a name that is too long."""
BROKEN = {errno.EROFS, errno.EIO}
"""Errors of writing."""
WORDS = {"allocate memory": "memory", "failed to map": "memory", "start new thread": "threads"}
"""Messages of errors without a number."""


def exhausted(error: Exception) -> FsmkitError | None:
    """Return the diagnostic for an error that is the machine's; None if it is another."""
    what = "memory" if isinstance(error, MemoryError) else None
    reason = str(error)
    if isinstance(error, OSError) and error.errno is not None:
        reason = (error.strerror or "").lower()
        if error.errno == errno.ENAMETOOLONG:
            return _too_long(str(error.filename))
        what = OF_THE_MACHINE.get(error.errno)
        if error.errno in BROKEN:
            return _failed(f"the output cannot be written: {reason}")
    else:
        what = what or next((w for words, w in WORDS.items() if words in reason), None)
    if what is None:
        return None
    return _failed(f"the {what} is exhausted" + (f": {reason}" if reason else ""))


def _too_long(name: str) -> FsmkitError:
    return fail(
        "unreadable-file",
        f"the path `{name[:SHOWN]}...` has {len(name):,} characters, more than the system accepts",
        help="shorten it where it is written",
    )


def _failed(message: str) -> FsmkitError:
    return fail("exhausted", message, help="free some, or raise the limits (`ulimit -a`)")
