"""Bytes of a file, of a pipe, or of standard input."""

from __future__ import annotations

import os
import select
import stat
import sys

from fsmkit.runtime.tracing.transports import MOST_READ, ended, wrong_endpoint


class FileSource:
    """The bytes of a file; reading a pipe does not block."""

    def __init__(self, path: str) -> None:
        self._path = path
        try:
            self._descriptor = os.dup(sys.stdin.fileno()) if path == "-" else _opened(path)
            mode = os.fstat(self._descriptor).st_mode
        except OSError as error:
            raise ended(
                f"`{path}` cannot be read: {error.strerror or error}", "give a file of a trace"
            ) from error
        if stat.S_ISDIR(mode):
            self.close()
            raise wrong_endpoint(f"`{path}` is a folder", "give a file of a trace")
        self._is_regular = stat.S_ISREG(mode)

    def read(self) -> bytes | None:
        """Return the available bytes; None at the end."""
        try:
            if not self._is_regular and not select.select([self._descriptor], [], [], 0)[0]:
                return b""
            return os.read(self._descriptor, MOST_READ) or None
        except BlockingIOError:
            return b""
        except OSError as error:
            raise ended(f"`{self._path}` cannot be read: {error.strerror or error}") from error

    def close(self) -> None:
        """Close it."""
        os.close(self._descriptor)


def _opened(path: str) -> int:
    if "\0" in path:
        raise wrong_endpoint("a path holds no zero byte", "give a file of a trace")
    return os.open(path, os.O_RDONLY | os.O_NONBLOCK)
