"""The index of a workspace: open files, files on disk, and all uses of names."""

from __future__ import annotations

import os
from collections import OrderedDict
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

from fsmkit.chart.loading import TEXTS
from fsmkit.diagnostics import Findings, Text
from fsmkit.document.document import Document
from fsmkit.editor.index.binding_uses import binding_uses
from fsmkit.editor.index.chart_names import ChartNames, Declared, chart_names
from fsmkit.editor.index.chart_uses import chart_uses
from fsmkit.editor.index.files import File, Kind, beside, is_named_like_one, normal, read_file
from fsmkit.editor.index.symbols import Occurrence, Role, Symbol, Uses
from fsmkit.editor.index.system_uses import (
    Scanner,
    SystemNames,
    board_names,
    board_uses,
    deployment_names,
    deployment_uses,
    system_names,
    system_uses,
    text_of,
    under,
)

MOST_FILES = 5_000
"""Maximum number of files in a workspace."""
LARGEST = 4 * 1024 * 1024
"""Maximum size of an unopened file, in bytes."""
SKIPPED = frozenset(("node_modules", "build", "dist", "__pycache__", "venv", "target"))
"""Folders that are passed over, as hidden ones are."""
MOST_READ = 512
"""Maximum number of stored documents."""
DEEPEST = 32
"""Bases of a chart, one upon the other, that are followed."""


@dataclass
class Workspace:
    """Folders, the unsaved contents of open files, and parsed files."""

    folders: tuple[Path, ...] = ()
    open: dict[Path, bytes] = field(default_factory=dict)
    _disk: dict[Path, tuple[tuple[int, int], File]] = field(default_factory=dict)
    _opened: dict[Path, tuple[bytes, File]] = field(default_factory=dict)
    _good: dict[Path, File] = field(default_factory=dict)
    _names: dict[Path, tuple[tuple[File, ...], ChartNames]] = field(default_factory=dict)
    _systems: dict[Path, tuple[tuple[File, ...], SystemNames]] = field(default_factory=dict)
    _uses: dict[Path, tuple[tuple[File, ...], Uses]] = field(default_factory=dict)
    _listed: tuple[Path, ...] | None = None
    _read: OrderedDict[tuple[str, bytes], tuple[Document, Findings]] = field(
        default_factory=OrderedDict
    )
    _using: list[Path] = field(default_factory=list)
    """Charts of which the used ones are being found, each in the one before."""
    _fresh: set[Path] | None = None
    """Files read while the disk counts as unchanged."""

    def copy(self) -> Workspace:
        """Return an index of the same texts, in which others can be tried."""
        return Workspace(
            self.folders,
            dict(self.open),
            dict(self._disk),
            dict(self._opened),
            dict(self._good),
            dict(self._names),
            dict(self._systems),
            dict(self._uses),
            self._listed,
        )

    # --- files ------------------------------------------------------------------------------------

    def set_text(self, path: Path, content: bytes | None) -> None:
        """Set the unsaved content of a file; None: use the disk."""
        if content is None:
            self.open.pop(path, None)
            self._opened.pop(path, None)
        else:
            self.open[path] = content
        if self._listed is not None and path not in self._listed:
            self._listed = (*self._listed, path)

    def forget_listing(self) -> None:
        """Look at the folders again, since files came or went."""
        self._listed = None

    def forget(self) -> None:
        """Read all again: where the files are that others name may have changed."""
        self.forget_listing()
        self._disk.clear()
        self._opened.clear()

    def paths(self) -> tuple[Path, ...]:
        """Return all files that may be ours."""
        if self._listed is None:
            found = dict.fromkeys(self.open)
            for folder in self.folders:
                for path in _below(folder):
                    found[path] = None
                    if len(found) >= MOST_FILES:
                        break
            self._listed = tuple(found)
        return self._listed

    @contextmanager
    def steady(self) -> Iterator[None]:
        """Assume that the disk does not change: no file's time is read twice."""
        before = self._fresh
        self._fresh = set() if before is None else before
        try:
            yield
        finally:
            self._fresh = before

    def file(self, path: Path) -> File | None:
        """Return the present version of a file; None if it is missing or too large."""
        content = self.open.get(path)
        if content is not None:
            kept = self._opened.get(path)
            if kept is None or kept[0] != content:
                kept = self._opened[path] = content, read_file(path, content)
                self._remember(kept[1])
            return kept[1]
        known = self._disk.get(path)
        if known is not None and self._fresh is not None:
            if path in self._fresh:
                return known[1]
            self._fresh.add(path)
        try:
            about = path.stat()
            stamp = about.st_mtime_ns, about.st_size
            if known is not None and known[0] == stamp:
                return known[1]
            if about.st_size > LARGEST or not path.is_file():
                return None
            found = read_file(path, path.read_bytes())
        except (OSError, ValueError):
            self._disk.pop(path, None)
            return None
        self._disk[path] = stamp, found
        self._remember(found)
        return found

    def _remember(self, file: File) -> None:
        if not file.is_broken and file.kind is not Kind.OTHER:
            self._good[file.path] = file

    def readable(self, path: Path) -> File | None:
        """Return a file as it is now, or where it does not parse as it last did."""
        found = self.file(path)
        if found is not None and found.is_broken:
            return self._good.get(path, found)
        return found

    def files(self) -> Iterator[File]:
        """Yield all files that are ours, as they last parsed."""
        for path in self.paths():
            found = self.readable(path)
            if found is not None and found.kind is not Kind.OTHER:
                yield found

    # --- reading with unsaved texts (`fsmkit.chart.loading.Texts`) --------------------------

    def content(self, path: Path) -> bytes | None:
        """Return the content of a file that is open."""
        return self.open.get(path) or self.open.get(Path(normal(path))) if self.open else None

    def known(self, path: Path, content: bytes) -> tuple[Document, Findings] | None:
        """Return the stored parse of a content."""
        key = str(path), content
        found = self._read.get(key)
        if found is not None:
            self._read.move_to_end(key)
        return found

    def keep(self, path: Path, content: bytes, document: Document, findings: Findings) -> None:
        """Store the parse of a content."""
        self._read[str(path), content] = document, findings
        while len(self._read) > MOST_READ:
            self._read.popitem(last=False)

    @contextmanager
    def unsaved(self) -> Iterator[None]:
        """Let readers see the texts that are open in place of the disk's."""
        token = TEXTS.set(self)
        try:
            yield
        finally:
            TEXTS.reset(token)

    # --- names ------------------------------------------------------------------------------------

    def chain(self, path: Path) -> tuple[File, ...]:
        """Return the files of a chart and its bases, nearest first, as far as they exist."""
        found: list[File] = []
        while len(found) < DEEPEST:
            file = self.readable(path)
            if file is None or file.document is None or any(f.path == path for f in found):
                break
            found.append(file)
            if file.document.extends is None:
                break
            path = beside(path, file.document.extends.value)
        return tuple(found)

    def chart(self, path: Path) -> ChartNames | None:
        """Return the names of a chart; None where it cannot be read."""
        chain = self.chain(path)
        if not chain:
            return None
        basis = self._basis(chain[0])
        kept = self._names.get(path)
        if kept is None or not same(kept[0], basis):
            pairs = [(f.path, f.document) for f in chain if f.document is not None]
            kept = self._names[path] = basis, chart_names(pairs)
            self._use(kept[1])
        return kept[1]

    def _use(self, names: ChartNames) -> None:
        """Find the charts used by states; recursive uses are ignored."""
        if len(self._using) >= DEEPEST or names.path in self._using:
            return
        self._using.append(names.path)
        try:
            for state, parts in names.state_parts.items():
                for path, part in parts:
                    if part.use is None or part.use.chart is None:
                        continue
                    file = beside(path, part.use.chart.value)
                    used = None if file in self._using else self.chart(file)
                    if used is not None:
                        names.used.setdefault(state, used)
        finally:
            self._using.pop()

    def system(self, path: Path) -> SystemNames | None:
        """Return the names of a system, a deployment or a board."""
        file = self.readable(path)
        if file is None or file.root is None:
            return None
        basis = self._basis(file)
        kept = self._systems.get(path)
        if kept is None or not same(kept[0], basis):
            names = self._system(file)
            if names is None:
                return None
            kept = self._systems[path] = basis, names
        return kept[1]

    def _system(self, file: File) -> SystemNames | None:
        if file.root is None:
            return None
        match file.kind:
            case Kind.SYSTEM:
                return system_names(file.path, file.root, self._charts(file))
            case Kind.DEPLOYMENT:
                return deployment_names(file.path, file.root, self._of(file, "system"))
            case Kind.BOARD:
                return board_names(file.path, file.root, self._of(file, "deployment"))
            case _:
                return None

    def _of(self, file: File, key: str) -> SystemNames | None:
        text = text_of(under(file.root, key))
        path = None if text is None else beside(file.path, text.value)
        return None if path is None or path == file.path else self.system(path)

    def _charts(self, file: File) -> _ChartOf:
        return _ChartOf(self, file)

    def _basis(self, file: File) -> tuple[File, ...]:
        """Return a file and all files that determine the meaning of its names."""
        found: dict[Path, File] = {}
        left = [file]
        while left:
            one = left.pop()
            if one.path in found:
                continue
            found[one.path] = one
            for _, path in one.named:
                other = self.readable(path)
                if other is not None:
                    left.append(other)
        return tuple(found.values())

    def depends_on(self, path: Path) -> frozenset[Path]:
        """Return the files that determine the meaning of a file, including itself."""
        file = self.readable(path)
        return frozenset() if file is None else frozenset(f.path for f in self._basis(file))

    def dependents(self, path: Path) -> tuple[Path, ...]:
        """Return the files whose meaning depends on a file, without itself."""
        with self.steady():
            return tuple(
                file.path
                for file in self.files()
                if file.path != path and path in self.depends_on(file.path)
            )

    # --- occurrences ------------------------------------------------------------------------------

    def uses(self, path: Path) -> Uses:
        """Return the names in a file."""
        file = self.readable(path)
        if file is None:
            return Uses()
        basis = self._basis(file)
        kept = self._uses.get(path)
        if kept is None or not same(kept[0], basis):
            kept = self._uses[path] = basis, self._uses_of(file)
        return kept[1]

    def _uses_of(self, file: File) -> Uses:
        if file.document is not None:
            names = self.chart(file.path)
            if names is None:
                return Uses()
            found = {text.value: self.chart(path) for text, path in file.named}
            invoked = {text: chart for text, chart in found.items() if chart is not None}
            return chart_uses(file.path, file.document, names, invoked)
        if file.root is None:
            return Uses()
        if file.kind is Kind.SUITE:
            from fsmkit.editor.index.suite_uses import suite_uses  # it needs the test runner

            chart = text_of(under(file.root, "chart"))
            system = self._of(file, "system")
            scanner = Scanner(file.path, system or SystemNames(file.path))
            about = None if chart is None else self.chart(beside(file.path, chart.value))
            return suite_uses(file.root, scanner, about, system)
        if file.kind is Kind.BINDING:
            bound = text_of(under(file.root, "chart"))
            known = None if bound is None else self.chart(beside(file.path, bound.value))
            return binding_uses(file.path, file.root, known)
        names_ = self.system(file.path)
        if names_ is None:
            return Uses()
        match file.kind:
            case Kind.SYSTEM:
                return system_uses(file.path, file.root, names_, self._charts(file))
            case Kind.DEPLOYMENT:
                return deployment_uses(file.path, file.root, names_)
            case Kind.BOARD:
                return board_uses(file.path, file.root, names_)
            case _:
                return Uses()

    def all_uses(self) -> Iterator[tuple[Path, Uses]]:
        """Yield the names in each file."""
        with self.steady():
            for file in self.files():
                yield file.path, self.uses(file.path)

    def at(self, path: Path, offset: int) -> tuple[Occurrence, ...]:
        """Return the occurrences at an offset of a file, the smallest first."""
        found = [o for o in self.uses(path).occurrences if o.span.start <= offset <= o.span.end]
        known = [o for o in found if o.symbols] or found
        order = {Role.MATCH: 1, Role.UNKNOWN: 2}
        return tuple(sorted(known, key=lambda o: (order.get(o.role, 0), o.span.end - o.span.start)))

    def linked_symbols(self, symbols: Iterable[Symbol]) -> frozenset[Symbol]:
        """Return the symbols that must have one name with the given ones."""
        with self.steady():
            neighbours: dict[Symbol, set[Symbol]] = {}
            for _, uses in self.all_uses():
                for occurrence in uses.occurrences:
                    if len(occurrence.symbols) > 1 and occurrence.role is not Role.MATCH:
                        for one in occurrence.symbols:
                            neighbours.setdefault(one, set()).update(occurrence.symbols)
                for one, other in uses.links:
                    neighbours.setdefault(one, set()).add(other)
                    neighbours.setdefault(other, set()).add(one)
        found: set[Symbol] = set()
        left = list(symbols)
        while left:
            symbol = left.pop()
            if symbol not in found:
                found.add(symbol)
                left += neighbours.get(symbol, ())
        return frozenset(found)

    def occurrences(
        self, symbols: Iterable[Symbol], roles: Iterable[Role] = tuple(Role)
    ) -> Iterator[tuple[Path, Occurrence]]:
        """Yield every place in the workspace where one of some symbols is named."""
        wanted, allowed = frozenset(symbols), frozenset(roles)
        for path, uses in self.all_uses():
            for occurrence in uses.occurrences:
                if occurrence.role in allowed and not wanted.isdisjoint(occurrence.symbols):
                    yield path, occurrence

    def declarations(self, path: Path, symbol: Symbol) -> tuple[Declared, ...]:
        """Return the declarations of a symbol as the chart of a file sees them, nearest first."""
        charts = [self.chart(path)]
        system = self.system(path)
        if system is not None:
            charts += system.charts()
        charts.append(self.chart(symbol.owner))
        for chart in charts:
            if chart is not None and symbol in chart.declared:
                return tuple(reversed(chart.declared[symbol]))
        return ()


@dataclass(frozen=True, slots=True)
class _ChartOf:
    """Gives the names of a chart by the text that names its file."""

    workspace: Workspace
    file: File

    def __call__(self, text: Text) -> ChartNames | None:
        """Return the names of a chart's file; None for other files."""
        return self.workspace.chart(beside(self.file.path, text.value))


def same(one: tuple[File, ...], other: tuple[File, ...]) -> bool:
    """Whether two tuples hold the very same files: no text has changed."""
    return len(one) == len(other) and all(a is b for a, b in zip(one, other, strict=True))


def _below(folder: Path) -> Iterator[Path]:
    for top, folders, names in os.walk(folder):
        folders[:] = sorted(f for f in folders if f not in SKIPPED and not f.startswith("."))
        for name in sorted(names):
            path = Path(top, name)
            if is_named_like_one(path):
                yield Path(normal(path))
