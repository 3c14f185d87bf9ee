"""Messages as lines of JSON."""

from __future__ import annotations

from collections.abc import Iterable
from typing import BinaryIO

from fsmkit.runtime.live.messages import AnyMessage, to_json


def write(messages: Iterable[AnyMessage], out: BinaryIO) -> None:
    """Write a line for each."""
    out.writelines(to_json(message) + b"\n" for message in messages)
