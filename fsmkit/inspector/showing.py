"""Sessions of Python programs, shown in a page while the program runs: `fsmkit.live`."""

from __future__ import annotations

import asyncio
import secrets
import sys
import threading
from typing import Self

from fsmkit.inspector.hub import Hub
from fsmkit.inspector.server import LiveServer, serve_hub
from fsmkit.inspector.sources.program import ProgramSource
from fsmkit.runtime.session import Session
from fsmkit.runtime.system_session import SystemSession

COMMANDS = frozenset(["post", "set"])


class Shown:
    """A session that is shown until `close`, or until the program ends."""

    def __init__(self, source: ProgramSource, server: LiveServer) -> None:
        self.address = ""
        """Address of the page; it grants read access."""
        self._source = source
        self._server = server
        self._ready = threading.Event()
        self._stop = asyncio.Event()
        self._error: BaseException | None = None
        self._loop: asyncio.AbstractEventLoop | None = None
        self._thread = threading.Thread(target=self._serve, name="fsmkit.live", daemon=True)

    def begin(self) -> Self:
        """Serve in a thread of its own; `FsmkitError` (``port-not-free``) where that fails."""
        self._thread.start()
        self._ready.wait()
        if self._error is not None:
            raise self._error
        return self

    def _serve(self) -> None:
        try:
            asyncio.run(self._main())
        except BaseException as error:  # noqa: BLE001  (raised in the thread of the program)
            self._error = error
        finally:
            self._ready.set()

    async def _main(self) -> None:
        self._loop = asyncio.get_running_loop()
        await serve_hub(self._server, self._found, stop=self._stop)

    def _found(self, address: str) -> None:
        self.address = address
        self._ready.set()

    def obey(self) -> int:
        """Execute the queued commands of clients (``commands=True``); return their number.

        Call it in the thread that uses the session, before `run`.
        """
        return self._source.obey()

    def close(self) -> None:
        """Show it no longer."""
        self._source.close()
        if self._loop is not None and self._thread.is_alive():
            self._loop.call_soon_threadsafe(self._stop.set)
            self._thread.join()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def show(
    session: Session | SystemSession, *, port: int = 0, commands: bool = False, quiet: bool = False
) -> Shown:
    """Show a session of this program in a local page, and print its address.

    A separate thread serves the page, and the program never waits for it. Steps appear live.
    Looking back, or a breakpoint, freezes the view, never the machine.

    Args:
        session: The session to show from now on.
        port: The port; 0 for any free one.
        commands: Whether clients may post events and set inputs; the program must then call
            `Shown.obey` in its loop.
        quiet: Do not print the address; it is in `Shown.address`.

    Raises:
        FsmkitError: ``port-not-free``.

    """
    source = ProgramSource(session, COMMANDS if commands else frozenset())
    hub = Hub(source, session=secrets.token_hex(4))
    try:
        shown = Shown(source, LiveServer(hub, port=port)).begin()
    except BaseException:
        source.close()
        raise
    if not quiet:
        sys.stdout.write(f"{source.system.name}: {shown.address}\n")
        sys.stdout.flush()
    return shown
