"""An editor in the process: it gives the adapter requests, and keeps what it is told."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

from fsmkit.inspector.dap.adapter import Adapter
from fsmkit.inspector.hub import Hub

Json = dict[str, Any]


class Editor:
    """A client of the protocol; time passes when a test says so."""

    def __init__(self, hub: Hub | None = None, **options: Any) -> None:
        self.messages: list[Json] = []
        self.adapter = Adapter(self._take, hub=hub, **options)
        self._seq = 0

    def _take(self, message: Json) -> None:
        self.messages.append(json.loads(json.dumps(message)))

    def ask(self, command: str, **arguments: Any) -> Json:
        """Make a request; return the response."""
        self._seq += 1
        request = {"seq": self._seq, "type": "request", "command": command}
        self.adapter.receive(json.dumps({**request, "arguments": arguments}).encode())
        (answer,) = [
            message
            for message in self.messages
            if message["type"] == "response" and message["request_seq"] == self._seq
        ]
        assert answer["command"] == command
        return answer

    def answers(self, command: str, arguments: Any) -> int:
        """Make a request of any kind; return how many responses there are."""
        before = self._responses
        self._seq += 1
        request = {"seq": self._seq, "type": "request", "command": command}
        self.adapter.receive(json.dumps({**request, "arguments": arguments}).encode())
        return self._responses - before

    @property
    def _responses(self) -> int:
        return sum(message["type"] == "response" for message in self.messages)

    def get(self, command: str, **arguments: Any) -> Json:
        """Make a request that succeeds; return the body of the response."""
        answer = self.ask(command, **arguments)
        assert answer["success"], answer
        body: Json = answer["body"]
        return body

    def refused(self, command: str, **arguments: Any) -> Json:
        """Make a request that does not succeed; return its first finding."""
        answer = self.ask(command, **arguments)
        assert not answer["success"], answer
        finding: Json = answer["body"]["findings"][0]
        assert answer["message"] == finding["message"]
        return finding

    def launch(self, program: Path | str, *setting: Callable[[], object], **more: Any) -> Json:
        """Begin a session, with what is set before it runs; return where it stops."""
        self.get("initialize", adapterID="fsmkit")
        self.get("launch", program=str(program), **more)
        for each in setting:
            each()
        self.get("configurationDone")
        return self.events("stopped")[-1] if self.events("stopped") else {}

    def events(self, name: str) -> list[Json]:
        """Return the bodies of the events of a name."""
        found = (message for message in self.messages if message["type"] == "event")
        return [message["body"] for message in found if message["event"] == name]

    def output(self) -> str:
        """Return all that was printed."""
        return "".join(body["output"] for body in self.events("output"))

    def stop(self, command: str, **arguments: Any) -> Json:
        """Make a request after which it stops at once; return the event."""
        before = len(self.events("stopped"))
        self.get(command, threadId=1, **arguments)
        (event,) = self.events("stopped")[before:]
        return event

    def run(self, microseconds: int = 0) -> Json:
        """Go on until it stops; with a time only so long."""
        before = len(self.events("stopped"))
        self.get("continue", threadId=1)
        hub = self.adapter.hub
        assert hub is not None
        for _ in range(1_000):
            if not hub.is_running:
                break
            hub.advance(microseconds or 1_000_000)
            self.adapter.look()
            if microseconds:
                return {}
        (event,) = self.events("stopped")[before:]
        return event

    # --- what is shown ---------------------------------------------------------------------------

    def frames(self, thread: int = 1) -> list[Json]:
        """Return a stack."""
        found: list[Json] = self.get("stackTrace", threadId=thread)["stackFrames"]
        return found

    def stack(self, thread: int = 1) -> list[str]:
        """Return the names in a stack, with their lines."""
        return [f"{frame['name']}:{frame['line']}" for frame in self.frames(thread)]

    def scope(self, name: str, thread: int = 1) -> dict[str, Json]:
        """Return the variables of a scope."""
        (reference,) = [
            scope["variablesReference"]
            for scope in self.get("scopes", frameId=self.frames(thread)[0]["id"])["scopes"]
            if scope["name"] == name
        ]
        return self.parts(reference)

    def parts(self, reference: int) -> dict[str, Json]:
        """Return what a reference holds."""
        found = self.get("variables", variablesReference=reference)["variables"]
        return {variable["name"]: variable for variable in found}

    def values(self, name: str, thread: int = 1) -> dict[str, str]:
        """Return the values of a scope as texts."""
        return {name: row["value"] for name, row in self.scope(name, thread).items()}

    def reference(self, name: str, thread: int = 1) -> int:
        """Return the reference of a scope."""
        scopes = self.get("scopes", frameId=self.frames(thread)[0]["id"])["scopes"]
        found: int = next(s["variablesReference"] for s in scopes if s["name"] == name)
        return found

    def type(self, line: str, thread: int = 1) -> str:
        """Type a line in the console; return what it prints."""
        frame = self.frames(thread)[0]["id"]
        found: str = self.get("evaluate", expression=line, frameId=frame, context="repl")["result"]
        return found
