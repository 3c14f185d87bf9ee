"""``fsmkit``, and ``python -m fsmkit``: the command line, which an interrupt ends from here on.

What follows is imported within `main`, as it takes a while in which nothing would answer an
interrupt but a traceback.
"""

import atexit
import os
import signal
import sys
import threading
from contextlib import suppress
from types import FrameType


def _leave(number: int, frame: FrameType | None) -> None:
    del frame
    os._exit(128 + number)  # nothing was begun


def _open_closed_streams() -> None:
    """Connect each standard stream that the caller closed to the null device.

    Python has no object for a closed stream, and the next file that is opened would get its
    number: a result could then end up inside a chart.
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
    """Whether no other thread runs on, and nobody measures this process until its very end."""
    monitoring = getattr(sys, "monitoring", None)  # from Python 3.12 on
    watched = monitoring is not None and any(map(monitoring.get_tool, range(6)))
    return not (watched or sys.gettrace() or sys.getprofile() or threading.active_count() > 1)


def _end(code: int) -> None:
    """End as Python does, but leave the memory to the system.

    To free what a chart of 10,000 states holds took a second, and the modules of a verb some
    hundredths. What libraries want to do at the end, such as to remove folders, is done.
    """
    atexit._run_exitfuncs()  # noqa: SLF001  (as `multiprocessing` ends its processes)
    for stream in (sys.stdout, sys.stderr):
        with suppress(OSError, ValueError):  # closed, or nobody reads it; that was reported
            stream.flush()
    os._exit(code)


if __name__ == "__main__":
    main()
