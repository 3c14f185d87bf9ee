"""``fsmkit run`` without events: what to do is read line by line."""

from __future__ import annotations

from typing import Protocol, TextIO

from fsmkit.cli.console import report, result
from fsmkit.diagnostics import FsmkitError


class Conversant(Protocol):
    """What can be told what to do, and asked how it is."""

    help: str

    def do(self, item: str) -> None:
        """Do one thing; `FsmkitError` where it cannot be understood."""
        ...

    def answer(self, question: str) -> bool:
        """Answer a question; False if it is none."""
        ...


def converse(partner: Conversant, file: TextIO) -> None:
    """Read what to do until the end; on a terminal a wrong line is told and forgotten."""
    is_terminal = file.isatty()
    if is_terminal:
        result.print("type an event, or help", style="dim")
    while True:
        if is_terminal:
            result.print("> ", end="")
        line = file.readline()
        word = line.strip()
        if not line or word in ("quit", "exit"):
            return
        try:
            if word in ("help", "?"):
                result.print(partner.help, markup=False)
            elif not partner.answer(word):
                partner.do(word)
        except FsmkitError as error:
            if not is_terminal:
                raise
            report(error.diagnostics)
