"""Open sources of trace bytes: ``SCHEME:ADDRESS``, each scheme a plug-in in a folder."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Protocol, runtime_checkable

from fsmkit.diagnostics import FsmkitError, fail
from fsmkit.diagnostics.suggestions import suggest
from fsmkit.plugins import plugins

MOST_READ = 1 << 16
"""Maximum number of bytes per read."""


class Source(Protocol):
    """A source of bytes."""

    def read(self) -> bytes | None:
        """Return the bytes that have arrived, without waiting; None at the end.

        Raises `FsmkitError` (``trace-ended``) if the end is a failure.
        """
        ...

    def close(self) -> None:
        """Give back sockets and files."""
        ...


@runtime_checkable
class Carrier(Protocol):
    """Opens sources of one kind."""

    name: str
    """The scheme."""
    form: str
    """Format of an address, for people."""
    framed: bool | None
    """Whether bytes can be lost, so that records come in frames; None: detected."""

    def open_source(self, address: str) -> Source:
        """Connect; `FsmkitError` where that fails."""
        ...


@dataclass(frozen=True, slots=True)
class Transport:
    """A carrier whose sources are of a class in a module that is imported when one is opened."""

    name: str
    form: str
    framed: bool | None
    module: str
    source_class: str

    def open_source(self, address: str) -> Source:
        """Connect; `FsmkitError` where that fails."""
        source: Source = getattr(import_module(self.module), self.source_class)(address)
        return source


@dataclass(frozen=True, slots=True)
class Opened:
    """A source, and whether its records come in frames."""

    source: Source
    framed: bool | None


def open_endpoint(endpoint: str) -> Opened:
    """Open ``SCHEME:ADDRESS``, ``-`` for standard input, or the path of a file.

    `FsmkitError` for an unknown scheme, a wrong address, or where nothing can be opened.
    """
    known = {carrier.name: carrier for carrier in plugins(Carrier)}
    scheme, colon, address = endpoint.partition(":")
    carrier = known.get(scheme) if colon else None
    if carrier is None:
        is_file = endpoint == "-"
        with suppress(OSError, ValueError):
            is_file = is_file or not colon or Path(endpoint).exists()
        if not is_file:
            forms = ", ".join(sorted(each.form for each in known.values()))
            raise wrong_endpoint(
                f"the transport `{scheme}` does not exist",
                suggest(scheme, list(known), f"use {forms}, -"),
            )
        carrier, address = known["file"], endpoint
    return Opened(carrier.open_source(address), carrier.framed)


def wrong_endpoint(message: str, help_: str | None) -> FsmkitError:
    """Return the error for an invalid endpoint."""
    return fail("wrong-endpoint", message, help=help_)


def ended(message: str, help_: str = "see that it runs, and try again") -> FsmkitError:
    """Return the error for a source that cannot be opened, or that failed."""
    return fail("trace-ended", message, help=help_)
