"""A client of the language server, over standard input and output, for tests that wait."""

from __future__ import annotations

import asyncio
import sys
import threading
from collections.abc import Callable, Coroutine
from pathlib import Path
from typing import Any

from lsprotocol import types
from pygls.lsp.client import LanguageClient

from fsmkit.editor.context import path_of, uri_of
from fsmkit.editor.positions import Lines

WAIT = 120
"""Seconds; only a server that hangs is waited for so long."""
MARK = "¦"


class Editor:
    """An editor that opens files, asks, and keeps what the server publishes."""

    def __init__(self, folder: Path, *, encoding: str = "utf-16") -> None:
        """Start a server for a folder."""
        self.encoding = types.PositionEncodingKind(encoding)
        self.published: dict[Path, list[types.Diagnostic]] = {}
        self.count: dict[Path, int] = {}
        self.messages: list[str] = []
        self.texts: dict[Path, str] = {}
        self.versions: dict[Path, int] = {}
        self.changed = threading.Condition()
        self.loop = asyncio.new_event_loop()
        self.thread = threading.Thread(target=self.loop.run_forever, daemon=True)
        self.thread.start()
        self.client = LanguageClient("tests", "1")
        self._bind()
        self.capabilities = self._wait(self._start(folder))

    def _bind(self) -> None:
        @self.client.feature(types.TEXT_DOCUMENT_PUBLISH_DIAGNOSTICS)  # type: ignore[untyped-decorator]
        def publish(params: types.PublishDiagnosticsParams) -> None:
            path = path_of(params.uri)
            assert path is not None
            with self.changed:
                self.published[path] = list(params.diagnostics)
                self.count[path] = self.count.get(path, 0) + 1
                self.changed.notify_all()

        @self.client.feature(types.WINDOW_LOG_MESSAGE)  # type: ignore[untyped-decorator]
        def log(params: types.LogMessageParams) -> None:
            self.messages.append(params.message)

        @self.client.feature(types.WINDOW_SHOW_MESSAGE)  # type: ignore[untyped-decorator]
        def show(params: types.ShowMessageParams) -> None:
            self.messages.append(params.message)

    async def _start(self, folder: Path) -> types.ServerCapabilities:
        await self.client.start_io(sys.executable, "-m", "fsmkit", "lsp")
        found = await self.client.initialize_async(
            types.InitializeParams(
                capabilities=types.ClientCapabilities(
                    general=types.GeneralClientCapabilities(position_encodings=[self.encoding]),
                    workspace=types.WorkspaceClientCapabilities(
                        workspace_edit=types.WorkspaceEditClientCapabilities(
                            document_changes=True,
                            change_annotation_support=types.ChangeAnnotationsSupportOptions(),
                        )
                    ),
                ),
                root_uri=uri_of(folder),
                workspace_folders=[types.WorkspaceFolder(uri_of(folder), folder.name)],
            )
        )
        self.client.initialized(types.InitializedParams())
        return found.capabilities

    def _wait(self, work: Coroutine[Any, Any, Any]) -> Any:
        return asyncio.run_coroutine_threadsafe(work, self.loop).result(WAIT)

    def ask(self, request: Callable[[Any], Any], params: Any) -> Any:
        """Return the answer to a request."""

        async def asked() -> Any:
            return await request(params)

        return self._wait(asked())

    def tell(self, notify: Callable[[Any], Any], params: Any) -> None:
        """Send a notification."""
        done = threading.Event()

        def told() -> None:
            notify(params)
            done.set()

        self.loop.call_soon_threadsafe(told)
        assert done.wait(WAIT)

    def close(self) -> None:
        """End the server."""
        self._wait(self.client.shutdown_async(None))
        self.tell(lambda _: self.client.exit(None), None)
        self._wait(self.client.stop())  # type: ignore[no-untyped-call]
        self.loop.call_soon_threadsafe(self.loop.stop)
        self.thread.join(WAIT)
        self.loop.close()

    # --- texts ------------------------------------------------------------------------------------

    def open(self, path: Path, text: str | None = None) -> list[types.Diagnostic]:
        """Open a file, or give it another text; return what is published of it then."""
        text = path.read_text(encoding="utf-8") if text is None else text
        with self.changed:
            before = self.count.get(path, 0)
        if path in self.versions:
            self.change(path, text)
        else:
            self.versions[path] = 1
            item = types.TextDocumentItem(uri_of(path), "yaml", 1, text)
            self.tell(self.client.text_document_did_open, types.DidOpenTextDocumentParams(item))
        self.texts[path] = text
        with self.changed:
            assert self.changed.wait_for(lambda: self.count.get(path, 0) > before, WAIT)
            return self.published[path]

    def change(self, path: Path, text: str) -> None:
        """Give an open file another text."""
        self.texts[path] = text
        self.versions[path] += 1
        identifier = types.VersionedTextDocumentIdentifier(self.versions[path], uri_of(path))
        change = types.TextDocumentContentChangeWholeDocument(text)
        self.tell(
            self.client.text_document_did_change,
            types.DidChangeTextDocumentParams(identifier, [change]),
        )

    def shut(self, path: Path) -> None:
        """Close a file."""
        del self.versions[path]
        identifier = types.TextDocumentIdentifier(uri_of(path))
        self.tell(self.client.text_document_did_close, types.DidCloseTextDocumentParams(identifier))

    def lines(self, path: Path) -> Lines:
        """Return the lines of a file as it is open here, else as it is on the disk."""
        text = self.texts.get(path)
        return Lines(path.read_text(encoding="utf-8") if text is None else text, self.encoding)

    def at(self, path: Path, piece: str, into: int = 0) -> dict[str, Any]:
        """Return the parameters that name the place where a piece of a file's text begins."""
        lines = self.lines(path)
        return {
            "text_document": types.TextDocumentIdentifier(uri_of(path)),
            "position": lines.position(lines.text.index(piece) + into),
        }

    def marked(self, path: Path, text: str) -> dict[str, Any]:
        """Give a file a text with a mark, and return the parameters that name the place of it."""
        place = text.index(MARK)
        self.open(path, text.replace(MARK, ""))
        return {
            "text_document": types.TextDocumentIdentifier(uri_of(path)),
            "position": self.lines(path).position(place),
        }

    def labels(self, path: Path, text: str) -> list[str]:
        """Return what is proposed at the mark in a text, in order."""
        params = types.CompletionParams(**self.marked(path, text))
        found = self.ask(self.client.text_document_completion_async, params)
        return [item.label for item in sorted(found.items, key=lambda i: i.sort_text or i.label)]

    def places(self, found: Any) -> list[tuple[str, int]]:
        """Return locations as names of files and lines from one."""
        return [
            (Path(str(path_of(each.uri))).name, each.range.start.line + 1) for each in found or ()
        ]

    def applied(self, edit: types.WorkspaceEdit) -> dict[Path, str]:
        """Return the texts that the edit of an answer makes, as an editor would."""
        edits: dict[str, list[Any]] = {u: list(found) for u, found in (edit.changes or {}).items()}
        for change in edit.document_changes or ():
            assert isinstance(change, types.TextDocumentEdit)
            edits.setdefault(change.text_document.uri, []).extend(change.edits)
        made = {}
        for uri, found in edits.items():
            path = path_of(uri)
            assert path is not None
            lines = self.lines(path)
            text = lines.text
            for one in sorted(found, key=lambda e: -lines.offset(e.range.start)):
                start, end = lines.offset(one.range.start), lines.offset(one.range.end)
                text = text[:start] + one.new_text + text[end:]
            made[path] = text
        return made
