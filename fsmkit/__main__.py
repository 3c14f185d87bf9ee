"""``fsmkit``, and ``python -m fsmkit``: run the command line, which an interrupt ends.

`main` imports the other modules, because an interrupt during these imports must not print a
traceback.
"""

import atexit
import os
import signal
import sys
import threading
from contextlib import suppress
from types import FrameType


def _leave(number: int, frame: FrameType | None) -> None:
    """End the process at a signal that comes before the command line is loaded."""
    del frame
    os._exit(128 + number)  # nothing was started


def _open_closed_streams() -> None:
    """Connect each standard stream that the caller closed to the null device.

    Python has no object for a closed stream. The next opened file would get its number, so that
    output could end up in a chart.
    """
    for number, name, mode in ((0, "stdin", "r"), (1, "stdout", "w"), (2, "stderr", "w")):
        if getattr(sys, name) is None:
            null = os.open(os.devnull, os.O_RDWR)
            if null != number:
                os.dup2(null, number)
                os.close(null)
            setattr(sys, name, open(number, mode, encoding="utf-8", closefd=False))  # noqa: SIM115


def main() -> None:
    """Run the command line and exit."""
    signal.signal(signal.SIGINT, _leave)
    signal.signal(signal.SIGTERM, _leave)
    _open_closed_streams()
    from fsmkit.cli import main as run

    try:
        run()
    except SystemExit as end:
        if isinstance(end.code, int) and _nothing_waits():
            _end(end.code)
        raise


def _nothing_waits() -> bool:
    """Return whether no other thread runs, and no tool measures this process to its very end."""
    monitoring = getattr(sys, "monitoring", None)  # from Python 3.12 on
    watched = monitoring is not None and any(map(monitoring.get_tool, range(6)))
    return not (watched or sys.gettrace() or sys.getprofile() or threading.active_count() > 1)


def _end(code: int) -> None:
    """Exit like Python, but leave freeing the memory to the system.

    Freeing a chart of 10,000 states took a second, and the modules of a verb some hundredths. Exit
    functions of libraries, such as removal of folders, run.
    """
    atexit._run_exitfuncs()  # noqa: SLF001  (as `multiprocessing` ends its processes)
    for stream in (sys.stdout, sys.stderr):
        with suppress(OSError, ValueError):  # closed or without a reader, which was reported
            stream.flush()
    os._exit(code)


if __name__ == "__main__":
    main()
