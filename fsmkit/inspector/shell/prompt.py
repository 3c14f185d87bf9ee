"""The terminal of a shell: a line with history and completion, and the state below it."""

from __future__ import annotations

import asyncio
import os
import signal
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from types import FrameType

from prompt_toolkit import PromptSession
from prompt_toolkit.completion import CompleteEvent, Completer, Completion
from prompt_toolkit.document import Document
from prompt_toolkit.history import FileHistory, History, InMemoryHistory
from prompt_toolkit.patch_stdout import patch_stdout

from fsmkit.diagnostics import Diagnostic, FsmkitError
from fsmkit.inspector.hub import Hub
from fsmkit.inspector.server import LiveServer, serve_hub
from fsmkit.inspector.shell.completion import LAST, candidates
from fsmkit.inspector.shell.names import Names
from fsmkit.inspector.shell.outline import bottom_line
from fsmkit.inspector.shell.shell import Shell

LONGEST = 10_000
"""Maximum length of a line; a longer paste is not a command."""


class _Completer(Completer):
    def __init__(self, names: Names) -> None:
        self._names = names

    def get_completions(
        self, document: Document, complete_event: CompleteEvent
    ) -> Iterable[Completion]:
        """Yield how the line can go on."""
        del complete_event
        text = document.text_before_cursor
        found = LAST.search(text)
        begun = len(found.group()) if found else 0
        for word, remark in candidates(self._names, text[-LONGEST:]):
            yield Completion(word, -begun, display_meta=remark)


class _History(FileHistory):
    """Lines in a file; a full disk loses them, not the session."""

    def store_string(self, string: str) -> None:
        """Keep a line."""
        with suppress(OSError):
            super().store_string(string)


def history_of(environment: Callable[[str], str | None] = os.environ.get) -> History:
    """Return the previous lines: from XDG_STATE_HOME, ~/.local/state, or empty."""
    try:
        base = Path(environment("XDG_STATE_HOME") or "")
        folder = (base if base.is_absolute() else Path.home() / ".local/state") / "fsmkit"
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        file = folder / "run_history"
        file.touch(mode=0o600)
        with file.open("r+b"):
            return _History(str(file))
    except (OSError, RuntimeError, ValueError):
        return InMemoryHistory()


class Serving:
    """The page of a session, served in the loop that reads the lines."""

    def __init__(self) -> None:
        self._task: asyncio.Task[None] | None = None
        self._address = ""

    async def serve(self, hub: Hub) -> str:
        """Serve a hub from the first call on; return the address. `FsmkitError` for no port."""
        if self._task is None or self._task.done():
            ready: asyncio.Future[str] = asyncio.get_running_loop().create_future()
            task = asyncio.create_task(serve_hub(LiveServer(hub), ready.set_result))
            await asyncio.wait((ready, task), return_when=asyncio.FIRST_COMPLETED)
            if not ready.done():
                task.result()
            self._task, self._address = task, await ready
        return self._address

    async def close(self) -> None:
        """Serve no more."""
        if self._task is not None:
            self._task.cancel()
            with suppress(asyncio.CancelledError):
                await self._task


async def converse(
    shell: Shell, report: Callable[[Iterable[Diagnostic]], None], history: History
) -> None:
    """Read lines and obey them until the end of input; a wrong line is reported and forgotten.

    Control-C forgets the line, or stops the command that runs; control-D leaves.
    """
    session: PromptSession[str] = PromptSession(
        history=history,
        completer=_Completer(shell.names),
        bottom_toolbar=lambda: [("", bottom_line(shell.hub))],
        complete_while_typing=False,
    )
    shell.on_change = session.app.invalidate
    while not shell.is_done:
        try:
            with patch_stdout(raw=True):
                line = await session.prompt_async("> ")
        except KeyboardInterrupt:
            continue
        except EOFError:
            return
        try:
            with _interrupts(shell):
                await shell.obey(line[:LONGEST])
        except FsmkitError as error:
            report(error.diagnostics)


@contextmanager
def _interrupts(shell: Shell) -> Iterator[None]:
    """Let Ctrl+C pause the session after the current step."""

    def stop(number: int, frame: FrameType | None) -> None:
        del number, frame
        shell.is_interrupted = True

    before = signal.signal(signal.SIGINT, stop)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)
