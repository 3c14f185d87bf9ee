"""The language server: features bound to requests; state is one index and the open texts."""

from __future__ import annotations

import asyncio
import re
import threading
from collections.abc import Callable, Coroutine, Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TypeVar
from uuid import uuid4

from lsprotocol import types
from pygls.exceptions import JsonRpcException
from pygls.lsp.server import LanguageServer

import fsmkit
from fsmkit.chart.chart import Chart
from fsmkit.diagnostics import Severity
from fsmkit.editor.analysis import Analyses
from fsmkit.editor.checking.background import Background, CheckResult
from fsmkit.editor.checking.verdicts import counterexample, replay, verdict_diagnostics, words
from fsmkit.editor.context import Context, path_of, uri_of
from fsmkit.editor.drawing import drawing
from fsmkit.editor.features import actions, formatting, lenses, navigation, outline, tokens
from fsmkit.editor.features import completion as completing
from fsmkit.editor.features import hover as hovering
from fsmkit.editor.features import rename as renaming
from fsmkit.editor.features.diagnostics import diagnostics_of
from fsmkit.editor.index.files import Kind
from fsmkit.editor.index.workspace import Workspace
from fsmkit.editor.page.embedded import EmbeddedPages

PAUSE = 0.08
"""Seconds after the last key press before a file is analysed."""
PAUSE_FOR_OTHERS = 0.4
"""Seconds before open files that depend on a changed one follow."""
DECLARED = re.compile(r"<\?xml[^>]*?encoding\s*=\s*[\"']([A-Za-z0-9._-]+)[\"']")
TRIGGERS = [".", " ", ">", "<", '"', ":", "[", "{", "(", ",", "/"]
STACK = 16 * 1024 * 1024
"""Bytes for the thread that reads the index, which recurses into states and expressions."""
Result = TypeVar("Result")
Answer = TypeVar("Answer", bound=Callable[..., Any])
Found = dict[Path, list[types.Diagnostic]]
Act = Callable[[Path], Coroutine[Any, Any, None]]
VERDICTS = Path("verdicts")
"""Suffix of a file's key for the findings of its check."""
WATCHED = ("**/*.{yaml,yml,scxml,xml}", "**/{fsmkit,pyproject}.toml")


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
    """The language server, and its state of the editor."""

    def __init__(self) -> None:
        """Answer for no folder yet."""
        super().__init__("fsmkit", fsmkit.__version__)
        workspace = Workspace()
        self.context = Context(workspace, Analyses(workspace))
        self.snippets = False
        self.published: dict[Path, dict[Path, list[types.Diagnostic]]] = {}
        """Findings by the file that was read and the file that each is in."""
        self.pending: dict[Path, asyncio.TimerHandle] = {}
        self.background = Background()
        self.checked: dict[Path, CheckResult] = {}
        self.checks_when = "onSave"
        self.tasks: set[asyncio.Task[None]] = set()
        threading.stack_size(STACK)
        self.worker = ThreadPoolExecutor(1, "fsmkit")
        """The only thread that reads the index. The event loop only receives and sends messages, so
        that a cancelled request ends immediately."""
        self.pages = EmbeddedPages(self, self.work, lambda: self.context.encoding)

    async def work(self, act: Callable[..., Result], *given: object) -> Result:
        """Run a call in the thread that reads the index; return its result."""
        return await asyncio.get_running_loop().run_in_executor(self.worker, act, *given)

    # --- texts ------------------------------------------------------------------------------------

    def take(self, uri: str) -> Path | None:
        """Put the content of an open document into the index, before later requests."""
        path = path_of(uri)
        if path is not None:
            text = self.workspace.get_text_document(uri).source
            self.worker.submit(self.context.workspace.set_text, path, content_of(path, text))
        return path

    def schedule(self, path: Path, pause: float, act: Act) -> None:
        """Schedule an action on a file; it replaces the pending one."""
        before = self.pending.pop(path, None)
        if before is not None:
            before.cancel()
        loop = asyncio.get_running_loop()
        self.pending[path] = loop.call_later(pause, self._act, path, act)

    def _act(self, path: Path, act: Act) -> None:
        self.pending.pop(path, None)
        self.start_task(act(path))

    # --- findings ---------------------------------------------------------------------------------

    def start_task(self, work: Coroutine[Any, Any, None]) -> None:
        """Start a task beside the requests."""
        task = asyncio.get_running_loop().create_task(work)
        self.tasks.add(task)
        task.add_done_callback(self.tasks.discard)

    async def warm_up(self) -> None:
        """Read the workspace, a file at a time, so that the first request finds it read."""
        workspace = self.context.workspace
        for path in await self.work(workspace.paths):
            await self.work(workspace.uses, path)

    # --- checks -----------------------------------------------------------------------------------

    async def check(self, path: Path) -> CheckResult | None:
        """Check a file in the background; verdicts become findings."""
        files = await self.work(self.context.workspace.depends_on, path)
        token = f"fsmkit-check-{uuid4()}"
        shows = self.client_capabilities.window
        is_shown = bool(shows and shows.work_done_progress)
        if is_shown:
            try:
                await self.work_done_progress.create_async(token)
            except JsonRpcException:
                is_shown = False
        if is_shown:
            title = f"fsmkit check {path.name}"
            self.work_done_progress.begin(
                token, types.WorkDoneProgressBegin(title, cancellable=True)
            )
            self.background.token = token

        def report_progress(figures: Mapping[str, Any]) -> None:
            if is_shown:
                text = f"{figures['states']:,} states, depth {figures['depth']}"
                self.work_done_progress.report(token, types.WorkDoneProgressReport(message=text))

        found = await self.background.check(path, files, report_progress)
        if is_shown:
            done = "ended" if found is None else str(found.report.get("verdict", "error"))
            self.work_done_progress.end(token, types.WorkDoneProgressEnd(message=done))
        if found is not None:
            self.checked[path] = found
            await self.republish(path)
            await self.pages.checked(path, found)
        return found

    async def republish(self, path: Path) -> None:
        """Show the findings of a file with its verdicts, and the lenses anew."""
        key = path / VERDICTS
        checked = self.checked.get(path)
        before = self.published.get(key, {})
        found: Found = {}
        if checked is not None:
            found = await self.work(verdict_diagnostics, self.context, checked)
        self.published[key] = found
        for changed in {*before, *found}:
            self.show(changed)
        able = self.client_capabilities.workspace
        if able is not None and able.code_lens is not None and able.code_lens.refresh_support:
            self.workspace_code_lens_refresh(None)

    async def edited(self, path: Path) -> None:
        """Drop check results that depend on an edited file, and stop such a check."""
        if (running := self.background.path) is not None:
            files = await self.work(self.context.workspace.depends_on, running)
            if (path == running or path in files) and self.background.path == running:
                self.background.end()
        for other, checked in tuple(self.checked.items()):
            if path in checked.files and self.checked.pop(other, None) is not None:
                await self.republish(other)

    async def diagnose(self, path: Path) -> None:
        """Publish the diagnostics of a file, and of open files that depend on it."""
        await self.publish(path)
        for other in await self.work(self._depending, path):
            self.schedule(other, PAUSE_FOR_OTHERS, self.publish)

    def _depending(self, path: Path) -> list[Path]:
        workspace = self.context.workspace
        others = (other for other in tuple(workspace.open) if other != path)
        return [other for other in others if path in workspace.depends_on(other)]

    def _found(self, path: Path) -> Found:
        if path not in self.context.workspace.open:
            return {}
        return diagnostics_of(self.context, self.context.analyses.analysis(path).findings, path)

    async def publish(self, path: Path) -> None:
        """Publish the diagnostics found in a file, by their own files."""
        found = await self.work(self._found, path)
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
        """Remove the diagnostics of a closed file."""
        before = self.published.pop(path, {})
        for changed in before:
            self.show(changed)


def make_server() -> Server:
    """Return a server that answers each request it declares."""
    server = Server()
    _lifecycle(server)
    _documents(server)
    _questions(server)
    _shown(server)
    _commands(server)
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
        server.start_task(server.warm_up())

    @server.feature(types.WORKSPACE_DID_CHANGE_CONFIGURATION)
    def configured(params: types.DidChangeConfigurationParams) -> None:
        _configure(server, params.settings)

    @server.feature(types.SHUTDOWN)
    def shut_down(_: None) -> None:
        server.background.end()
        server.worker.shutdown(wait=False, cancel_futures=True)

    @server.feature(types.WINDOW_WORK_DONE_PROGRESS_CANCEL)
    def cancelled(params: types.WorkDoneProgressCancelParams) -> None:
        if params.token == server.background.token:
            server.background.end()

    @server.feature(types.WORKSPACE_DID_CHANGE_WORKSPACE_FOLDERS)
    def folders_changed(_: types.DidChangeWorkspaceFoldersParams) -> None:
        folders = (path_of(folder.uri) for folder in server.workspace.folders.values())
        workspace = server.context.workspace
        workspace.folders = tuple(dict.fromkeys(f for f in folders if f is not None))
        workspace.forget_listing()

    @server.feature(types.WORKSPACE_DID_CHANGE_WATCHED_FILES)
    def files_changed(params: types.DidChangeWatchedFilesParams) -> None:
        workspace = server.context.workspace
        is_project = any(change.uri.endswith(".toml") for change in params.changes)
        server.worker.submit(workspace.forget if is_project else workspace.forget_listing)
        for path in tuple(server.context.workspace.open):
            server.schedule(path, PAUSE_FOR_OTHERS, server.publish)


def _configure(server: Server, settings: object) -> None:
    """Apply the settings for checks; unknown ones are ignored."""
    found = settings.get("fsmkit", settings) if isinstance(settings, dict) else None
    when = found.get("check") if isinstance(found, dict) else getattr(found, "check", None)
    if when in ("onSave", "onCommand", "off"):
        server.checks_when = str(when)


def _watch(server: Server) -> None:
    options = types.DidChangeWatchedFilesRegistrationOptions(
        [types.FileSystemWatcher(glob_pattern=pattern) for pattern in WATCHED]
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
            server.schedule(path, 0, server.diagnose)

    @server.feature(types.TEXT_DOCUMENT_DID_CHANGE)
    async def changed(params: types.DidChangeTextDocumentParams) -> None:
        path = server.take(params.text_document.uri)
        if path is not None:
            server.schedule(path, PAUSE, server.diagnose)
            await server.edited(path)
            await server.pages.changed(path)

    @server.feature(types.TEXT_DOCUMENT_DID_SAVE)
    async def saved(params: types.DidSaveTextDocumentParams) -> None:
        path = server.take(params.text_document.uri)
        if path is not None:
            server.schedule(path, 0, server.diagnose)
            if server.checks_when == "onSave" and await server.work(_is_checkable, server, path):
                server.start_task(_checked(server, path))

    @server.feature(types.TEXT_DOCUMENT_DID_CLOSE)
    async def closed(params: types.DidCloseTextDocumentParams) -> None:
        path = path_of(params.text_document.uri)
        if path is not None:
            server.worker.submit(server.context.workspace.set_text, path, None)
            server.forget(path)


@contextmanager
def _refusals() -> Iterator[None]:
    """Answer a refusal as an error of the request, which editors show."""
    try:
        yield
    except renaming.RenameError as refused:
        raise JsonRpcException(str(refused), types.LSPErrorCodes.RequestFailed.value) from refused


async def _checked(server: Server, path: Path) -> None:
    await server.check(path)


def _is_checkable(server: Server, path: Path) -> bool:
    """Whether a file can be explored: charts that are there to be extended cannot."""
    file = server.context.workspace.file(path)
    if file is None or file.kind not in (Kind.CHART, Kind.SYSTEM, Kind.DEPLOYMENT):
        return False
    findings = server.context.analyses.analysis(path).findings
    model = server.context.analyses.analysis(path).model
    is_abstract = isinstance(model, Chart) and model.abstract
    return (
        model is not None
        and not is_abstract
        and not any(f.severity is Severity.ERROR for f in findings)
    )


def _is_ours(server: Server, path: Path | None) -> bool:
    file = None if path is None else server.context.workspace.file(path)
    return file is not None and file.kind is not Kind.OTHER


def _answers(server: Server, method: str, options: object = None) -> Callable[[Answer], Answer]:
    """Let a function answer a request, in the turn of the thread that reads the index."""

    def bound(answer: Answer) -> Answer:
        @server.feature(method, options)
        async def answered(params: Any) -> Any:
            return await server.work(answer, params)

        return answer

    return bound


def _questions(server: Server) -> None:
    context = server.context

    @_answers(
        server, types.TEXT_DOCUMENT_COMPLETION, types.CompletionOptions(trigger_characters=TRIGGERS)
    )
    def completion(params: types.CompletionParams) -> types.CompletionList:
        path = path_of(params.text_document.uri)
        found: list[types.CompletionItem] = []
        if path is not None:
            found = completing.completion(context, path, params.position, snippets=server.snippets)
        return types.CompletionList(is_incomplete=False, items=found)

    @_answers(server, types.TEXT_DOCUMENT_HOVER)
    def hover(params: types.HoverParams) -> types.Hover | None:
        path = path_of(params.text_document.uri)
        if path is None or not _is_ours(server, path):
            return None
        return hovering.hover(context, path, params.position)

    @_answers(server, types.TEXT_DOCUMENT_DEFINITION)
    def definition(params: types.DefinitionParams) -> list[types.Location]:
        path = path_of(params.text_document.uri)
        return [] if path is None else navigation.definition(context, path, params.position)

    @_answers(server, types.TEXT_DOCUMENT_DECLARATION)
    def declaration(params: types.DeclarationParams) -> list[types.Location]:
        path = path_of(params.text_document.uri)
        return [] if path is None else navigation.declaration(context, path, params.position)

    @_answers(server, types.TEXT_DOCUMENT_IMPLEMENTATION)
    def implementation(params: types.ImplementationParams) -> list[types.Location]:
        path = path_of(params.text_document.uri)
        return [] if path is None else navigation.implementation(context, path, params.position)

    @_answers(server, types.TEXT_DOCUMENT_REFERENCES)
    def references(params: types.ReferenceParams) -> list[types.Location]:
        path = path_of(params.text_document.uri)
        if path is None:
            return []
        with_declaration = params.context.include_declaration
        return navigation.references(
            context, path, params.position, with_declaration=with_declaration
        )

    @_answers(server, types.TEXT_DOCUMENT_PREPARE_RENAME)
    def prepare_rename(params: types.PrepareRenameParams) -> types.PrepareRenamePlaceholder | None:
        path = path_of(params.text_document.uri)
        if path is None or not _is_ours(server, path):
            return None
        with _refusals():
            found = renaming.prepare(context, path, params.position)
        return types.PrepareRenamePlaceholder(context.range(found.span), found.name)

    @_answers(server, types.TEXT_DOCUMENT_RENAME, types.RenameOptions(prepare_provider=True))
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

    @_answers(server, types.TEXT_DOCUMENT_DOCUMENT_HIGHLIGHT)
    def highlight(params: types.DocumentHighlightParams) -> list[types.DocumentHighlight]:
        path = path_of(params.text_document.uri)
        return [] if path is None else navigation.highlights(context, path, params.position)

    @_answers(server, types.TEXT_DOCUMENT_DOCUMENT_LINK)
    def links(params: types.DocumentLinkParams) -> list[types.DocumentLink]:
        path = path_of(params.text_document.uri)
        return [] if path is None else navigation.links(context, path)

    @_answers(server, types.TEXT_DOCUMENT_DOCUMENT_SYMBOL)
    def symbols(params: types.DocumentSymbolParams) -> list[types.DocumentSymbol]:
        path = path_of(params.text_document.uri)
        return [] if path is None else outline.document_symbols(context, path)

    @_answers(server, types.WORKSPACE_SYMBOL)
    def all_symbols(params: types.WorkspaceSymbolParams) -> list[types.WorkspaceSymbol]:
        return outline.workspace_symbols(context, params.query)

    @_answers(server, types.TEXT_DOCUMENT_FOLDING_RANGE)
    def folding(params: types.FoldingRangeParams) -> list[types.FoldingRange]:
        path = path_of(params.text_document.uri)
        ours = path is not None and _is_ours(server, path)
        return outline.folding(context, path) if ours and path is not None else []

    @_answers(server, types.TEXT_DOCUMENT_SELECTION_RANGE)
    def selection(params: types.SelectionRangeParams) -> list[types.SelectionRange]:
        path = path_of(params.text_document.uri)
        return [] if path is None else outline.selection(context, path, params.positions)


def _shown(server: Server) -> None:
    """Register the features that editors show beside the source."""
    context = server.context

    @_answers(
        server,
        types.TEXT_DOCUMENT_CODE_ACTION,
        types.CodeActionOptions(code_action_kinds=actions.KINDS),
    )
    def code_action(params: types.CodeActionParams) -> list[types.CodeAction]:
        path = path_of(params.text_document.uri)
        if path is None or not _is_ours(server, path):
            return []
        roots = [p for p in context.workspace.open if path in context.workspace.depends_on(p)]
        is_requested = params.context.trigger_kind is types.CodeActionTriggerKind.Invoked
        return actions.code_actions(
            context, path, params.range, params.context.only, roots, is_requested=is_requested
        )

    @_answers(server, types.TEXT_DOCUMENT_SEMANTIC_TOKENS_FULL, tokens.legend())
    def all_tokens(params: types.SemanticTokensParams) -> types.SemanticTokens:
        path = path_of(params.text_document.uri)
        return types.SemanticTokens([]) if path is None else tokens.tokens(context, path)

    @_answers(server, types.TEXT_DOCUMENT_SEMANTIC_TOKENS_RANGE, tokens.legend())
    def some_tokens(params: types.SemanticTokensRangeParams) -> types.SemanticTokens:
        path = path_of(params.text_document.uri)
        if path is None:
            return types.SemanticTokens([])
        return tokens.tokens(context, path, params.range)

    @_answers(server, types.TEXT_DOCUMENT_CODE_LENS)
    def code_lens(params: types.CodeLensParams) -> list[types.CodeLens]:
        path = path_of(params.text_document.uri)
        if path is None:
            return []
        checked = server.checked.get(path)
        return lenses.lenses(context, path, None if checked is None else words(checked))

    @_answers(server, types.TEXT_DOCUMENT_FORMATTING)
    def format_document(params: types.DocumentFormattingParams) -> list[types.TextEdit]:
        path = path_of(params.text_document.uri)
        ours = path is not None and _is_ours(server, path)
        return formatting.formatting(context, path) if ours and path is not None else []

    @_answers(server, types.TEXT_DOCUMENT_RANGE_FORMATTING)
    def format_range(params: types.DocumentRangeFormattingParams) -> list[types.TextEdit]:
        path = path_of(params.text_document.uri)
        if path is None or not _is_ours(server, path):
            return []
        return formatting.formatting(context, path, params.range)

    @_answers(server, types.TEXT_DOCUMENT_INLAY_HINT)
    def inlay_hint(params: types.InlayHintParams) -> list[types.InlayHint]:
        path = path_of(params.text_document.uri)
        return [] if path is None else lenses.hints(context, path, params.range)


def _commands(server: Server) -> None:
    """Register the commands of lenses and of the extension."""

    @server.command("fsmkit.check")
    async def check(uri: str) -> dict[str, Any] | None:
        path = path_of(uri)
        if path is None or server.checks_when == "off":
            return None
        if not await server.work(_is_checkable, server, path):
            return None
        found = await server.check(path)
        if found is None:
            return None
        return {"verdict": found.report.get("verdict", "error"), "error": found.error}

    @server.command("fsmkit.counterexample")
    async def show(uri: str, name: str) -> Mapping[str, Any] | None:
        path = path_of(uri)
        checked = None if path is None else server.checked.get(path)
        if checked is None:
            return None
        return await server.work(counterexample, server.context, checked, name)

    @server.command("fsmkit.replay")
    async def play(uri: str, name: str) -> Mapping[str, Any] | None:
        path = path_of(uri)
        checked = None if path is None else server.checked.get(path)
        return None if checked is None else await server.work(replay, server.context, checked, name)

    @server.command("fsmkit.explain")
    def explain(code: str) -> str:
        return hovering.rule_explanation(code)

    @_answers(server, "fsmkit/draw")
    def picture(params: Any) -> dict[str, Any]:
        path = path_of(str(getattr(params, "uri", "")))
        if path is None:
            return {"error": "this is not a file"}
        folded = [str(name) for name in getattr(params, "folded", None) or ()]
        active = [str(name) for name in getattr(params, "active", None) or ()]
        return drawing(server.context, path, folded, active)
