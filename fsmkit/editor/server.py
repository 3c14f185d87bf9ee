"""The language server: features bound to requests; state is one index and the open texts."""

from __future__ import annotations

import asyncio
import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from lsprotocol import types
from pygls.exceptions import JsonRpcException
from pygls.lsp.server import LanguageServer

import fsmkit
from fsmkit.editor.analysis import Analyses
from fsmkit.editor.context import Context, path_of, uri_of
from fsmkit.editor.features import completion as completing
from fsmkit.editor.features import hover as hovering
from fsmkit.editor.features import navigation, outline
from fsmkit.editor.features import rename as renaming
from fsmkit.editor.features.diagnostics import diagnostics_of
from fsmkit.editor.index.files import Kind
from fsmkit.editor.index.workspace import Workspace

PAUSE = 0.08
"""Seconds after the last key before findings are looked for."""
PAUSE_FOR_OTHERS = 0.4
"""Seconds before open files that depend on a changed one follow."""
DECLARED = re.compile(r"<\?xml[^>]*?encoding\s*=\s*[\"']([A-Za-z0-9._-]+)[\"']")
TRIGGERS = [".", " ", ">", "<", '"', ":", "[", "{", "(", ",", "/"]
WATCHED = "**/*.{yaml,yml,scxml,xml}"


def content_of(path: Path, text: str) -> bytes:
    """Return the bytes that a file with a text would have; XML may name its encoding."""
    if not path.name.lower().endswith((".yaml", ".yml")):
        match = DECLARED.match(text.lstrip("\ufeff")[:1000])
        if match is not None:
            try:
                return text.encode(match[1])
            except (LookupError, UnicodeError):
                pass
    return text.encode("utf-8", errors="replace")


class Server(LanguageServer):
    """The server, and what it has of the editor."""

    def __init__(self) -> None:
        """Answer for no folder yet."""
        super().__init__("fsmkit", fsmkit.__version__)
        workspace = Workspace()
        self.context = Context(workspace, Analyses(workspace))
        self.snippets = False
        self.published: dict[Path, dict[Path, list[types.Diagnostic]]] = {}
        """Findings by the file that was read and the file that each is in."""
        self.pending: dict[Path, asyncio.TimerHandle] = {}

    # --- texts ------------------------------------------------------------------------------------

    def take(self, uri: str) -> Path | None:
        """Take the text of an open document into the index."""
        path = path_of(uri)
        if path is not None:
            text = self.workspace.get_text_document(uri).source
            self.context.workspace.set_text(path, content_of(path, text))
        return path

    def later(self, path: Path, pause: float, act: Callable[[Path], None]) -> None:
        """Act on a file after a pause; what was to come for it before does not."""
        before = self.pending.pop(path, None)
        if before is not None:
            before.cancel()
        loop = asyncio.get_running_loop()
        self.pending[path] = loop.call_later(pause, self._act, path, act)

    def _act(self, path: Path, act: Callable[[Path], None]) -> None:
        self.pending.pop(path, None)
        act(path)

    # --- findings ---------------------------------------------------------------------------------

    def diagnose(self, path: Path) -> None:
        """Publish what is found in a file; the open files that depend on it follow."""
        self.publish(path)
        workspace = self.context.workspace
        for other in tuple(workspace.open):
            if other != path and path in workspace.depends_on(other):
                self.later(other, PAUSE_FOR_OTHERS, self.publish)

    def publish(self, path: Path) -> None:
        """Publish what is found in a file, in whichever file that is."""
        if path not in self.context.workspace.open:
            found: dict[Path, list[types.Diagnostic]] = {}
        else:
            analysis = self.context.analyses.of(path)
            found = diagnostics_of(self.context, analysis.findings, path)
        before = self.published.get(path, {})
        self.published[path] = found
        for changed in {*before, *found, path}:
            if before.get(changed) != found.get(changed) or changed == path:
                self.show(changed)

    def show(self, path: Path) -> None:
        """Send all findings that are in a file, each once."""
        unique: dict[Any, types.Diagnostic] = {}
        for by_file in self.published.values():
            for diagnostic in by_file.get(path, ()):
                start, end = diagnostic.range.start, diagnostic.range.end
                key = (diagnostic.code, diagnostic.message, start.line, start.character)
                unique[(*key, end.line, end.character)] = diagnostic
        uri = uri_of(path)
        document = self.workspace.text_documents.get(uri)
        self.text_document_publish_diagnostics(
            types.PublishDiagnosticsParams(
                uri,
                list(unique.values()),
                version=None if document is None else document.version,
            )
        )

    def forget(self, path: Path) -> None:
        """Take back what was found in a file that is closed."""
        before = self.published.pop(path, {})
        for changed in before:
            self.show(changed)


def make_server() -> Server:
    """Return a server that answers each request it declares."""
    server = Server()
    _lifecycle(server)
    _documents(server)
    _questions(server)
    return server


def _lifecycle(server: Server) -> None:
    @server.feature(types.INITIALIZED)
    def initialized(_: types.InitializedParams) -> None:
        workspace = server.context.workspace
        folders = [path_of(folder.uri) for folder in server.workspace.folders.values()]
        if not folders and server.workspace.root_uri:
            folders = [path_of(server.workspace.root_uri)]
        workspace.folders = tuple(folder for folder in folders if folder is not None)
        workspace.forget_listing()
        server.context.encoding = types.PositionEncodingKind(server.workspace.position_encoding)
        document = server.client_capabilities.text_document
        item = document.completion.completion_item if document and document.completion else None
        server.snippets = bool(item and item.snippet_support)
        watching = server.client_capabilities.workspace
        files = watching.did_change_watched_files if watching else None
        if files is not None and files.dynamic_registration:
            _watch(server)

    @server.feature(types.WORKSPACE_DID_CHANGE_WORKSPACE_FOLDERS)
    def folders_changed(_: types.DidChangeWorkspaceFoldersParams) -> None:
        folders = (path_of(folder.uri) for folder in server.workspace.folders.values())
        workspace = server.context.workspace
        workspace.folders = tuple(dict.fromkeys(f for f in folders if f is not None))
        workspace.forget_listing()

    @server.feature(types.WORKSPACE_DID_CHANGE_WATCHED_FILES)
    def files_changed(_: types.DidChangeWatchedFilesParams) -> None:
        server.context.workspace.forget_listing()
        for path in tuple(server.context.workspace.open):
            server.later(path, PAUSE_FOR_OTHERS, server.publish)


def _watch(server: Server) -> None:
    options = types.DidChangeWatchedFilesRegistrationOptions(
        [types.FileSystemWatcher(glob_pattern=WATCHED)]
    )
    registration = types.Registration(
        "fsmkit-files", types.WORKSPACE_DID_CHANGE_WATCHED_FILES, options
    )
    server.client_register_capability(types.RegistrationParams([registration]))


def _documents(server: Server) -> None:
    @server.feature(types.TEXT_DOCUMENT_DID_OPEN)
    async def opened(params: types.DidOpenTextDocumentParams) -> None:
        path = server.take(params.text_document.uri)
        if path is not None:
            server.later(path, 0, server.diagnose)

    @server.feature(types.TEXT_DOCUMENT_DID_CHANGE)
    async def changed(params: types.DidChangeTextDocumentParams) -> None:
        path = server.take(params.text_document.uri)
        if path is not None:
            server.later(path, PAUSE, server.diagnose)

    @server.feature(types.TEXT_DOCUMENT_DID_SAVE)
    async def saved(params: types.DidSaveTextDocumentParams) -> None:
        path = server.take(params.text_document.uri)
        if path is not None:
            server.later(path, 0, server.diagnose)

    @server.feature(types.TEXT_DOCUMENT_DID_CLOSE)
    async def closed(params: types.DidCloseTextDocumentParams) -> None:
        path = path_of(params.text_document.uri)
        if path is not None:
            server.context.workspace.set_text(path, None)
            server.forget(path)


@contextmanager
def _refusals() -> Iterator[None]:
    """Answer a refusal as an error of the request, which editors show."""
    try:
        yield
    except renaming.RenameRefused as refused:
        raise JsonRpcException(str(refused), types.LSPErrorCodes.RequestFailed.value) from refused


def _is_ours(server: Server, path: Path | None) -> bool:
    file = None if path is None else server.context.workspace.file(path)
    return file is not None and file.kind is not Kind.OTHER


def _questions(server: Server) -> None:
    context = server.context

    @server.feature(
        types.TEXT_DOCUMENT_COMPLETION, types.CompletionOptions(trigger_characters=TRIGGERS)
    )
    def completion(params: types.CompletionParams) -> types.CompletionList:
        path = path_of(params.text_document.uri)
        found: list[types.CompletionItem] = []
        if path is not None:
            found = completing.completion(context, path, params.position, snippets=server.snippets)
        return types.CompletionList(is_incomplete=False, items=found)

    @server.feature(types.TEXT_DOCUMENT_HOVER)
    def hover(params: types.HoverParams) -> types.Hover | None:
        path = path_of(params.text_document.uri)
        if path is None or not _is_ours(server, path):
            return None
        return hovering.hover(context, path, params.position)

    @server.feature(types.TEXT_DOCUMENT_DEFINITION)
    def definition(params: types.DefinitionParams) -> list[types.Location]:
        path = path_of(params.text_document.uri)
        return [] if path is None else navigation.definition(context, path, params.position)

    @server.feature(types.TEXT_DOCUMENT_DECLARATION)
    def declaration(params: types.DeclarationParams) -> list[types.Location]:
        path = path_of(params.text_document.uri)
        return [] if path is None else navigation.declaration(context, path, params.position)

    @server.feature(types.TEXT_DOCUMENT_IMPLEMENTATION)
    def implementation(params: types.ImplementationParams) -> list[types.Location]:
        path = path_of(params.text_document.uri)
        return [] if path is None else navigation.implementation(context, path, params.position)

    @server.feature(types.TEXT_DOCUMENT_REFERENCES)
    def references(params: types.ReferenceParams) -> list[types.Location]:
        path = path_of(params.text_document.uri)
        if path is None:
            return []
        with_declaration = params.context.include_declaration
        return navigation.references(
            context, path, params.position, with_declaration=with_declaration
        )

    @server.feature(types.TEXT_DOCUMENT_PREPARE_RENAME)
    def prepare_rename(params: types.PrepareRenameParams) -> types.PrepareRenamePlaceholder | None:
        path = path_of(params.text_document.uri)
        if path is None or not _is_ours(server, path):
            return None
        with _refusals():
            found = renaming.prepare(context, path, params.position)
        return types.PrepareRenamePlaceholder(context.range(found.span), found.name)

    @server.feature(types.TEXT_DOCUMENT_RENAME, types.RenameOptions(prepare_provider=True))
    def rename(params: types.RenameParams) -> types.WorkspaceEdit | None:
        path = path_of(params.text_document.uri)
        if path is None or not _is_ours(server, path):
            return None
        context.workspace.forget_listing()
        with _refusals():
            made = renaming.renaming(context, path, params.position, params.new_name)
        versions = {}
        for other in made.places:
            document = server.workspace.text_documents.get(uri_of(other))
            versions[other] = None if document is None else document.version
        able = server.client_capabilities.workspace
        edits = able.workspace_edit if able else None
        return renaming.workspace_edit(
            context,
            made,
            versions,
            with_documents=bool(edits and edits.document_changes),
            with_annotations=bool(edits and edits.change_annotation_support),
        )

    @server.feature(types.TEXT_DOCUMENT_DOCUMENT_HIGHLIGHT)
    def highlight(params: types.DocumentHighlightParams) -> list[types.DocumentHighlight]:
        path = path_of(params.text_document.uri)
        return [] if path is None else navigation.highlights(context, path, params.position)

    @server.feature(types.TEXT_DOCUMENT_DOCUMENT_LINK)
    def links(params: types.DocumentLinkParams) -> list[types.DocumentLink]:
        path = path_of(params.text_document.uri)
        return [] if path is None else navigation.links(context, path)

    @server.feature(types.TEXT_DOCUMENT_DOCUMENT_SYMBOL)
    def symbols(params: types.DocumentSymbolParams) -> list[types.DocumentSymbol]:
        path = path_of(params.text_document.uri)
        return [] if path is None else outline.document_symbols(context, path)

    @server.feature(types.WORKSPACE_SYMBOL)
    def all_symbols(params: types.WorkspaceSymbolParams) -> list[types.WorkspaceSymbol]:
        return outline.workspace_symbols(context, params.query)

    @server.feature(types.TEXT_DOCUMENT_FOLDING_RANGE)
    def folding(params: types.FoldingRangeParams) -> list[types.FoldingRange]:
        path = path_of(params.text_document.uri)
        ours = path is not None and _is_ours(server, path)
        return outline.folding(context, path) if ours and path is not None else []

    @server.feature(types.TEXT_DOCUMENT_SELECTION_RANGE)
    def selection(params: types.SelectionRangeParams) -> list[types.SelectionRange]:
        path = path_of(params.text_document.uri)
        return [] if path is None else outline.selection(context, path, params.positions)
