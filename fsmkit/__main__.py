"""``fsmkit``, and ``python -m fsmkit``: the command line, which an interrupt ends from here on.

What follows is imported within `main`, as it takes a while in which nothing would answer an
interrupt but a traceback.
"""

import os
import signal
from types import FrameType


def _leave(number: int, frame: FrameType | None) -> None:
    del frame
    os._exit(128 + number)  # nothing was begun


def main() -> None:
    """Run the command line and exit."""
    signal.signal(signal.SIGINT, _leave)
    signal.signal(signal.SIGTERM, _leave)
    from fsmkit.cli import main as run

    run()


if __name__ == "__main__":
    main()
