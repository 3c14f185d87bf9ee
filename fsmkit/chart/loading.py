"""From a path to a Chart: reading, following ``extends``, elaborating."""

from __future__ import annotations

import os
from contextvars import ContextVar
from dataclasses import replace
from itertools import islice
from pathlib import Path
from typing import Protocol

from fsmkit.chart.chart import Chart
from fsmkit.chart.elaborate import elaborate
from fsmkit.chart.passes.plan_invocations import has_invokes, invoked_sources, is_service
from fsmkit.diagnostics import Findings, FsmkitError, Text, fail
from fsmkit.diagnostics.paths import is_file
from fsmkit.diagnostics.suggestions import suggest
from fsmkit.document.document import DocInvoke, DocState, Document, DocUse
from fsmkit.document.front_ends import ObjectReader, Reader, reader_for
from fsmkit.document.project import resolve_name
from fsmkit.document.python_objects import import_object, is_reference
from fsmkit.document.walk import states
from fsmkit.plugins import plugin_for, plugins

LARGEST_FILE = 64 * 1024 * 1024
"""Bytes; anything larger is a mistake, and reading it would only exhaust the memory."""
MOST_BESIDE = 1_000
"""The most files that are searched for a similar name to suggest."""


class Texts(Protocol):
    """Files as an editor has them, and a cache of parsed files."""

    def content(self, path: Path) -> bytes | None:
        """Return the content of an unsaved file, or None if the disk has it."""
        ...

    def known(self, path: Path, content: bytes) -> tuple[Document, Findings] | None:
        """Return the cached document and findings of that content at that path, if any."""
        ...

    def keep(self, path: Path, content: bytes, document: Document, findings: Findings) -> None:
        """Cache a parsed document with its findings."""
        ...


TEXTS: ContextVar[Texts | None] = ContextVar("texts", default=None)
"""The open files of an editor, which take precedence over the disk."""


MOST_NESTED = 16
"""Charts that invoke or use each other; each of the two kinds goes less deep (`chart`)."""

Stamp = tuple[int, int] | None
"""Modification time of a file in nanoseconds, and its size; None if the file is missing."""
READ: ContextVar[dict[Path, Stamp] | None] = ContextVar("read", default=None)
"""The files that were read, as they were then, while that is of interest."""


def stamp(path: Path) -> Stamp:
    """Return when a file was changed, and its size."""
    try:
        state = path.stat()
    except (OSError, ValueError):
        return None
    return state.st_mtime_ns, state.st_size


def load(path: str | Path) -> Chart:
    """Return the chart of a file; raise `FsmkitError` with all findings if it has an error."""
    return load_with_findings(path, Findings())


def load_with_findings(path: str | Path, findings: Findings, *, strict: bool = False) -> Chart:
    """Return the chart of a file and leave warnings in ``findings``.

    ``strict``: what SCXML would make an error at run time is an error here.
    """
    return elaborated(read_documents(Path(path), findings), findings, strict=strict)


def elaborated(
    documents: tuple[Document, ...], findings: Findings, *, strict: bool = False
) -> Chart:
    """Return the chart of the first document; its bases follow it."""
    chart = elaborate(documents, findings, strict=strict)
    findings.stop_on_errors()
    if chart is None:
        raise FsmkitError(findings)
    return chart


def read_documents(
    path: Path,
    findings: Findings,
    invokers: tuple[Path, ...] = (),
    at: Text | None = None,
    first: Document | None = None,
    used: UsedCharts | None = None,
) -> tuple[Document, ...]:
    """Return the document of a file and, after it, those it extends, nearest first.

    What they invoke and use is read with them; ``invokers`` are the files in which this one is
    invoked or used, and ``at`` is the place that names it. ``first``: the file's own, where it is
    read already. ``used``: the charts that were read for others which use them, too.
    """
    if len(invokers) > MOST_NESTED:
        raise fail(
            "too-deep",
            f"`{path.name}` lies within {len(invokers)} charts that invoke or use each other",
            at,
            help=f"keep to {MOST_NESTED} levels",
        )
    chain = read_chain(path, findings, at, first)
    here = (*invokers, real(path))
    used = {} if used is None else used
    return tuple(with_invoked(document, findings, here, used) for document in chain)


UsedCharts = dict[Path, tuple[Document, ...]]
"""Used charts, each with its bases: read once, however many states they fill."""


def with_invoked(
    document: Document, findings: Findings, invokers: tuple[Path, ...], used: UsedCharts
) -> Document:
    """Return a document with the charts that its states invoke, and those that fill them."""

    def load_state(state: DocState) -> DocState:
        return replace(
            state,
            children=tuple(load_state(child) for child in state.children),
            invokes=tuple(load_invoke(invoke) for invoke in state.invokes),
            use=None if state.use is None else load_use(state.use),
        )

    def load_use(use: DocUse) -> DocUse:
        if use.chart is None:
            return use
        path = named_file(Path(document.source.name), use.chart.value)
        place = real(path)
        if place in invokers:
            around = " -> ".join(p.name for p in (*invokers[invokers.index(place) :], place))
            raise fail(
                "use-cycle",
                f"a chart is filled with itself: {around}",
                use.chart,
                help="remove one `use` of the cycle",
            )
        if place not in used:
            used[place] = read_documents(path, findings, invokers, use.chart, used=used)
        return replace(use, loaded=used[place])

    def load_invoke(invoke: DocInvoke) -> DocInvoke:
        if invoke.content is not None:
            inner = with_invoked(invoke.content, findings, invokers, used)
            bases = base_documents(inner, findings)
            return replace(invoke, loaded=(("", (inner, *bases)),))
        names = sources.get(invoke.span.start, ())
        found = [(name.value, load_source(name)) for name in names if is_service(invoke.type)]
        return replace(invoke, loaded=tuple((name, d) for name, d in found if d))

    def load_source(name: Text) -> tuple[Document, ...]:
        path = document.source.beside(name.value)
        if path is None:
            if document.datamodel != "fsmkit":
                return ()
            raise fail(
                "unloaded-source",
                f"`{name}` leaves the folder of the chart",
                name,
                help="invoke a chart in the folder of this one, or below it",
            )
        path = searched(Path(document.source.name), name.value.strip(), path)
        if real(path) in invokers:
            raise fail(
                "invocation-cycle",
                f"a chart invokes itself: {' -> '.join(p.name for p in (*invokers, path))}",
                name,
                help="remove one `invoke` of the cycle",
            )
        if document.datamodel != "fsmkit" and not is_file(path):
            return ()
        return read_documents(path, findings, invokers, name, used=used)

    sources = invoked_sources(document)
    if not has_invokes(document) and not has_uses(document):
        return document
    return replace(
        document,
        root=load_state(document.root),
        refine=tuple(load_state(state) for state in document.refine),
    )


def has_uses(document: Document) -> bool:
    """Whether another chart fills a state of a document."""
    return any(state.use is not None for state in states(document.root, *document.refine))


def base_documents(document: Document, findings: Findings) -> tuple[Document, ...]:
    """Return the base documents of a chart, read from their files."""
    if document.extends is None:
        return ()
    path = named_file(Path(document.source.name), document.extends.value)
    return read_documents(path, findings, at=document.extends)


def read_chain(
    path: Path, findings: Findings, at: Text | None = None, first: Document | None = None
) -> tuple[Document, ...]:
    """Return the document of a file and its bases, without the charts that they invoke."""
    documents: list[Document] = []
    seen: list[Path] = []
    while True:
        seen.append(real(path))
        document = first or read_document(path, findings, at=at)
        first = None
        documents.append(document)
        if document.extends is None:
            return tuple(documents)
        at = document.extends
        path = named_file(path, at.value)
        if real(path) in seen:
            chain = " -> ".join(p.name for p in [*seen[seen.index(real(path)) :], path])
            raise fail(
                "inheritance-cycle",
                f"a chart extends itself: {chain}",
                at,
                help="remove one `extends` of the cycle",
            )


def named_file(file: Path, name: str) -> Path:
    """Return the file that another one names: beside it, or on its project's search path."""
    return searched(file, name, file.parent / name)


def searched(file: Path, name: str, own: Path) -> Path:
    """Return the path ``own`` if it exists, or the path that the file's project resolves."""
    texts = TEXTS.get()
    if texts is not None and texts.content(own) is not None:
        return own
    return resolve_name(file, name, own)


def real(path: Path) -> Path:
    """Return a path with its links resolved, as far as possible if it is invalid or circular."""
    try:
        return Path(os.path.realpath(path))
    except ValueError:  # a null character in the name
        return path


def read_document(path: Path, findings: Findings, *, at: Text | None = None) -> Document:
    """Return the document of one file; ``at`` is the place that named it, for the diagnostics.

    Only where nothing but the user named it, it may be an object of a module, which is imported.
    """
    if at is None and is_reference(str(path)):
        document = read_object(str(path), findings)
    else:
        document = _read_file(path, findings, at)
    findings.stop_on_errors()
    if document is None:
        raise FsmkitError(findings)
    return document


def _read_file(path: Path, findings: Findings, at: Text | None) -> Document | None:
    plugin_for(Reader, path, at)  # a wrong suffix is reported before the file is read
    content, texts = read_bytes(path, at), TEXTS.get()
    reader = reader_for(path, content, at)
    known = None if texts is None else texts.known(path, content)
    if known is not None:
        findings.extend(known[1])
        return known[0]
    own = Findings()
    source = reader.decode(content, str(path), own)
    document = None if source is None or own.has_errors else reader.read(source, own)
    findings.extend(own)
    findings.stop_on_errors()
    if source is None:
        raise FsmkitError(findings)
    if texts is not None and document is not None:
        texts.keep(path, content, document, own)
    return document


def read_object(reference: str, findings: Findings) -> Document | None:
    """Return the document of an object ``module:attribute``; its module is imported, and so run."""
    found = import_object(reference)
    for reader in plugins(ObjectReader):
        document = reader.read_object(found, reference, findings)
        if document is not None or findings.has_errors:
            return document
    return None


ROOT = "FSMKIT_ROOT"
"""The variable of the environment that names the only folder from which files are read."""


def read_bytes(path: Path, at: Text | None = None) -> bytes:
    """Return the content of a file, or raise a diagnostic with the reason why it is unreadable."""
    texts = TEXTS.get()
    unsaved = None if texts is None else texts.content(path)
    if unsaved is not None:
        return unsaved
    noted = READ.get()
    if noted is not None:
        noted.setdefault(path, stamp(path))
    root = os.environ.get(ROOT)
    try:
        if root and not path.resolve().is_relative_to(root):
            raise fail(
                "outside-root",
                f"`{path}` is outside of the root folder",
                at,
                help="name a file below the root",
            )
        with path.open("rb") as file:
            content = file.read(LARGEST_FILE + 1)
    except OSError as error:
        reason = (error.strerror or type(error).__name__).lower()
        raise fail(
            "unreadable-file",
            f"cannot read `{path}`: {reason}",
            at,
            help=suggest(path.name, _beside(path), "check the path and its permissions"),
        ) from error
    except ValueError as error:  # a null character in the name
        raise fail("unreadable-file", f"cannot read {str(path)!r}: {error}", at) from error
    if len(content) > LARGEST_FILE:
        raise fail("unreadable-file", f"`{path}` is larger than {LARGEST_FILE >> 20} MiB", at)
    return content


def _beside(path: Path) -> list[str]:
    """Return the names of the charts, systems and so on in the folder of a file."""
    try:
        names = [found.name for found in islice(path.parent.iterdir(), MOST_BESIDE)]
    except (OSError, ValueError):
        return []
    return [name for name in names if name.endswith((".yaml", ".yml", ".scxml", ".xml", ".json"))]
