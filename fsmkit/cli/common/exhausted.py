"""What the machine has no more of is no bug of ours: memory, disk space, files, processes."""

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
BROKEN = {errno.EROFS, errno.EIO}
"""What cannot be written at all."""
WORDS = {"allocate memory": "memory", "failed to map": "memory", "start new thread": "threads"}
"""What errors without a number say."""


def exhausted(error: Exception) -> FsmkitError | None:
    """Return the diagnostic for an error that is the machine's; None if it is another."""
    what = "memory" if isinstance(error, MemoryError) else None
    reason = str(error)
    if isinstance(error, OSError) and error.errno is not None:
        reason = (error.strerror or "").lower()
        what = OF_THE_MACHINE.get(error.errno)
        if error.errno in BROKEN:
            return _failed(f"what is to be written cannot be: {reason}")
    else:
        what = what or next((w for words, w in WORDS.items() if words in reason), None)
    if what is None:
        return None
    return _failed(f"there is no more {what}" + (f": {reason}" if reason else ""))


def _failed(message: str) -> FsmkitError:
    return fail("exhausted", message, help="free some, or raise the limits (`ulimit -a`)")
