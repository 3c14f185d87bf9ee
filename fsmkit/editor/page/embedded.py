"""The page of `fsmkit edit` inside an editor: edits change the open document, not the file.

The editor shows the page and passes messages on as notifications `fsmkit/page/...`. It applies the
edits to its document, so its own undo takes them back, and unsaved text is edited as it is.
"""

from __future__ import annotations

import asyncio
import time
from collections.abc import Awaitable, Callable
from functools import cache
from pathlib import Path
from typing import Any

from lsprotocol import types
from pygls.lsp.server import LanguageServer

from fsmkit.diagnostics import Edit, FsmkitError
from fsmkit.editor.checking.background import CheckResult
from fsmkit.editor.context import path_of
from fsmkit.editor.editing import operations as op
from fsmkit.editor.editing.applying import text_edits
from fsmkit.editor.editing.renaming import Renaming
from fsmkit.editor.editing.session import EditSession
from fsmkit.editor.editing.values import rejected
from fsmkit.editor.page import HERE, edit_page
from fsmkit.editor.page.following import verdicts_of
from fsmkit.editor.page.hub import EditHub
from fsmkit.editor.positions import lines_of

TICK = 0.016
"""Seconds between two looks at the clock while a chart runs."""
MOST_PAGES = 8
Work = Callable[..., Awaitable[Any]]
"""Runs a call in the thread that reads the index."""
Encoding = Callable[[], types.PositionEncodingKind]
"""Returns the encoding of columns."""


class DocumentSession(EditSession):
    """Edits a document that an editor has open.

    Args:
        path: The file of the document.
        document: Returns the text of the document.
        send: Sends edits of the document to the editor, which applies them later.

    """

    def __init__(
        self, path: Path, document: Callable[[], str], send: Callable[[tuple[Edit, ...]], None]
    ) -> None:
        self._document = document
        self._send = send
        self._sent: bytes | None = None
        """The text that the document will have."""
        super().__init__(path)

    @property
    def can_undo(self) -> bool:
        """Whether an edit can be undone: the editor knows."""
        return True

    @property
    def can_redo(self) -> bool:
        """Whether an edit can be done again: the editor knows."""
        return True

    def undo(self) -> None:
        """Reject: the editor has the history."""
        raise rejected("the editor has the history of the text", help="undo it there")

    redo = undo

    def renaming(self, operation: op.RenameSymbol) -> Renaming:
        """Return the changes for a new name; reject those of other files, which may be open."""
        found = super().renaming(operation)
        others = self.other_files(found)
        if others:
            raise rejected(
                f"other files refer to `{operation.name}`: {', '.join(others)}",
                help="rename it in the text with the editor's command, which changes all files",
            )
        return found

    def refresh(self) -> bool:
        """Load the document if it has another text than this session gave it."""
        found = self._bytes()
        if self._sent is not None:
            if found == self._disk:
                return False
            is_ours = found == self._sent
            self._sent, self._disk = None, self._sent
            if is_ours:
                return False
        return super().refresh()

    def is_saved(self) -> bool:
        """Return whether the file has the text of this session."""
        try:
            found = self.path.read_bytes()
        except OSError:
            return False
        return found.replace(b"\r\n", b"\n") == self.text.encode("utf-8", "replace")

    def drop_edit(self) -> None:
        """Return to the text of the document, which did not accept an edit."""
        self._sent = None
        self._disk = self._bytes() or b""
        self._set(self._disk.decode())

    def _bytes(self) -> bytes | None:
        return self._document().replace("\r\n", "\n").encode("utf-8", "replace")

    def _write(self, text: str) -> None:
        self._send(text_edits(self.source, text))
        self._sent = text.encode()


class EmbeddedPage:
    """A page inside the editor, and the hub that it speaks with.

    ``notify`` sends a notification and ``request_edit`` a workspace edit, from any thread. All
    methods run in the thread that reads the index.
    """

    def __init__(
        self,
        path: Path,
        document: Callable[[], str],
        *,
        notify: Callable[[str], None],
        request_edit: Callable[[tuple[Edit, ...]], None],
        is_readonly: bool,
    ) -> None:
        """Read the document."""
        self.path = path
        self._notify = notify
        self._may_command = not is_readonly
        self._client: int | None = None
        self.editing = DocumentSession(path, document, request_edit)
        self.hub = EditHub(self.editing)

    def join(self) -> None:
        """Send the whole state to the page, which was loaded."""
        if self._client is not None:
            self.hub.leave(self._client)
        self._client = self.hub.join(
            lambda text: self._notify(text.decode()), may_command=self._may_command
        )

    def receive(self, text: str) -> None:
        """Execute a command of the page."""
        if self._client is not None:
            draw = self.hub.drawing(text)
            if draw is not None:
                draw()
            self.hub.receive(self._client, text)

    def follow(self) -> None:
        """Show the text of the document if somebody else changed it."""
        if self.editing.refresh():
            self.hub.changed()

    def show_check(self, found: CheckResult) -> None:
        """Show the verdicts of a check, if the file that was checked has the text of the page."""
        if self.editing.is_saved():
            self.hub.show_verdicts(verdicts_of(found))

    def reject_edit(self) -> None:
        """Show the text of the document, which did not accept an edit."""
        self.editing.drop_edit()
        self.hub.changed()


class EmbeddedPages:
    """The pages of a language server. Requests and notifications name a page by its number."""

    def __init__(self, server: LanguageServer, work: Work, encoding: Encoding) -> None:
        """Bind the requests of the editor."""
        self._server, self._work, self._encoding = server, work, encoding
        self._applying = asyncio.Lock()
        self._pages: dict[int, EmbeddedPage] = {}
        self._last = 0
        self._clock: asyncio.Task[None] | None = None
        for name, act in (
            ("open", self._open),
            ("join", self._join),
            ("receive", self._receive),
            ("close", self._close),
        ):
            _bind(server, f"fsmkit/page/{name}", act)

    async def changed(self, path: Path) -> None:
        """Show the text of a changed document in its pages."""
        for page in [*self._pages.values()]:
            if page.path == path:
                await self._work(page.follow)

    async def checked(self, path: Path, found: CheckResult) -> None:
        """Show the verdicts of a check in the pages of its file."""
        for page in [*self._pages.values()]:
            if page.path == path:
                await self._work(page.show_check, found)

    async def _open(self, params: Any) -> dict[str, Any]:
        """Return the number and the HTML of a new page of a document, or an error."""
        uri = str(getattr(params, "uri", ""))
        path = path_of(uri)
        if path is None:
            return {"error": "this is not a file"}
        if len(self._pages) >= MOST_PAGES:
            return {"error": f"{MOST_PAGES} pages are open: close one"}
        self._last += 1
        number, loop = self._last, asyncio.get_running_loop()

        def notify(text: str) -> None:
            message = {"page": number, "text": text}
            loop.call_soon_threadsafe(self._server.protocol.notify, "fsmkit/page/messages", message)

        def request_edit(edits: tuple[Edit, ...]) -> None:
            asyncio.run_coroutine_threadsafe(self._apply(number, uri, edits), loop)

        def opened() -> EmbeddedPage:
            return EmbeddedPage(
                path,
                lambda: self._server.workspace.get_text_document(uri).source,
                notify=notify,
                request_edit=request_edit,
                is_readonly=bool(getattr(params, "readonly", False)),
            )

        try:
            self._pages[number] = await self._work(opened)
        except (FsmkitError, OSError) as error:
            return {"error": str(error)}
        if self._clock is None:
            self._clock = asyncio.create_task(self._run())
        return {"page": number, "html": webview_page()}

    async def _join(self, params: Any) -> None:
        page = self._pages.get(getattr(params, "page", 0))
        if page is not None:
            await self._work(page.join)

    async def _receive(self, params: Any) -> None:
        page = self._pages.get(getattr(params, "page", 0))
        if page is not None:
            await self._work(page.receive, str(getattr(params, "text", "")))

    async def _close(self, params: Any) -> None:
        self._pages.pop(getattr(params, "page", 0), None)
        if not self._pages and self._clock is not None:
            self._clock.cancel()
            self._clock = None

    async def _apply(self, number: int, uri: str, edits: tuple[Edit, ...]) -> None:
        """Let the editor apply edits to its document, if it has the text they were made for."""
        async with self._applying:
            document = self._server.workspace.get_text_document(uri)
            is_applied = document.source.replace("\r\n", "\n") == edits[0].span.source.text
            if is_applied:
                changes = [
                    types.TextEdit(
                        lines_of(one.span.source, self._encoding()).range(
                            one.span.start, one.span.end
                        ),
                        one.text,
                    )
                    for one in edits
                ]
                named = types.OptionalVersionedTextDocumentIdentifier(uri, document.version)
                change = types.WorkspaceEdit(
                    document_changes=[types.TextDocumentEdit(named, changes)]
                )
                params = types.ApplyWorkspaceEditParams(change, "Edit the drawing")
                found = await self._server.workspace_apply_edit_async(params)
                is_applied = found.applied
        page = self._pages.get(number)
        if not is_applied and page is not None:
            await self._work(page.reject_edit)

    async def _run(self) -> None:
        """Let real time pass for the charts that run."""
        last = time.monotonic_ns()
        while True:
            await asyncio.sleep(TICK)
            now = time.monotonic_ns()
            for page in [*self._pages.values()]:
                if page.hub.view.is_running:
                    await self._work(page.hub.advance, (now - last) // 1000)
            last = now


def _bind(server: LanguageServer, method: str, act: Callable[[Any], Awaitable[Any]]) -> None:
    @server.feature(method)
    async def answered(params: Any) -> Any:
        return await act(params)


@cache
def webview_page() -> str:
    """Return the page with messages of the editor as its transport, under its own policy."""
    page = edit_page((HERE / "webview.js").read_text(encoding="utf-8"))
    policy = page.policy.replace("connect-src 'self'", "connect-src 'none'")
    policy = policy.replace("; frame-ancestors 'none'", "")
    meta = f'<meta http-equiv="Content-Security-Policy" content="{policy}">'
    return page.text.decode().replace("<head>", f"<head>\n{meta}", 1)
