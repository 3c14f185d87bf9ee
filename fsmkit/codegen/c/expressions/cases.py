"""Cases of a switch in C."""

from __future__ import annotations

from fsmkit.emit import Emitter


class case:  # noqa: N801  (reads as a keyword)
    """One case of a switch over transitions."""

    def __init__(self, out: Emitter, transition: int, comment: str) -> None:
        self._out = out
        self._label = f"case {transition + 1}u: /* {comment} */"

    def __enter__(self) -> None:
        self._out.open(self._label)

    def __exit__(self, *_: object) -> None:
        self._out.close("    break;")


class default(case):  # noqa: N801
    """The default of a switch."""

    def __init__(self, out: Emitter) -> None:
        super().__init__(out, 0, "")
        self._label = "default:"
