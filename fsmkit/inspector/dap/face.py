"""A client of the hub within the process: commands as calls, rejections as errors."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Any

import msgspec

from fsmkit.diagnostics import fail
from fsmkit.inspector.hub import Hub


class Face:
    """A client of a hub; ``told`` receives every message that is not a response."""

    def __init__(
        self, hub: Hub, told: Callable[[dict[str, Any]], None], *, may_command: bool = True
    ) -> None:
        self.hub = hub
        self._told = told
        self._id = 0
        self._answer: dict[str, Any] = {}
        self._client = hub.join(self._take, may_command=may_command)

    def close(self) -> None:
        """Leave the hub."""
        self.hub.leave(self._client)

    def do(self, do: str, **fields: Any) -> Any:
        """Execute a command and return its result; raises the finding if it is rejected."""
        self._id += 1
        given = {"id": self._id, "do": do, **fields}
        self.hub.receive(self._client, json.dumps(given))
        answer = self._answer
        if answer["k"] == "refused":
            raise fail(answer["rule"], answer["message"], help=answer.get("help") or None)
        return answer.get("result")

    def _take(self, text: bytes) -> None:
        found = msgspec.json.decode(text)
        for message in found if isinstance(found, list) else (found,):
            if message["k"] in ("done", "refused"):
                self._answer = message
            else:
                self._told(message)
