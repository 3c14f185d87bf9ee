"""The clients of a session, which receive its messages as JSON."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

Send = Callable[[bytes], None]


@dataclass(slots=True)
class Client:
    """A client that observes the session, and may give commands."""

    send: Send
    may_command: bool


class Clients:
    """All clients, by number."""

    def __init__(self) -> None:
        self._all: dict[int, Client] = {}
        self._next = 1

    def __getitem__(self, number: int) -> Client:
        """Return a client; raises `KeyError` for one that left."""
        return self._all[number]

    def numbers(self) -> list[int]:
        """Return the numbers of all."""
        return list(self._all)

    def number_of(self, client: Client) -> int:
        """Return the number of a client, or 0 for one that left."""
        return next((number for number, each in self._all.items() if each is client), 0)

    def join(self, send: Send, *, may_command: bool) -> int:
        """Take a client in; return its number."""
        number, self._next = self._next, self._next + 1
        self._all[number] = Client(send, may_command)
        return number

    def leave(self, number: int) -> None:
        """Forget a client."""
        self._all.pop(number, None)

    def send(self, texts: Sequence[bytes]) -> None:
        """Send messages to all, as an array; each text is one message, or several by commas."""
        if texts:
            text = b"[" + b",".join(texts) + b"]"
            for client in self._all.values():
                client.send(text)
