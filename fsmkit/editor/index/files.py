"""Files of the index: kind, content, and the files they name."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass, field
from enum import Enum
from functools import cached_property
from pathlib import Path

from fsmkit.diagnostics import Findings, FsmkitError, Source, Text
from fsmkit.document.document import Document
from fsmkit.document.front_ends import Reader
from fsmkit.document.project import resolve_name
from fsmkit.document.walk import states
from fsmkit.editor.index.system_uses import entries, text_of, under
from fsmkit.plugins import plugin_for
from fsmkit.scxml.reader import read_as_far
from fsmkit.yaml.nodes import Mapping, Node, read_nodes
from fsmkit.yaml.reader import read_chart

SUFFIXES = (".yaml", ".yml", ".scxml", ".xml")
TOP_KEY = re.compile(r"^([A-Za-z_]\w*)[ \t]*:", re.MULTILINE)
SCXML_MARK = re.compile(r"<(?:\w+:)?scxml\b")


class Kind(Enum):
    """The kind of a file."""

    CHART = "chart"
    SYSTEM = "system"
    DEPLOYMENT = "deployment"
    BOARD = "board"
    SUITE = "tests"
    BINDING = "binding"
    OTHER = "other"


def kind_of_keys(keys: set[str]) -> Kind:
    """Return the kind of a YAML file by its top-level keys; other files are ignored."""
    if {"tests", "cases"} <= keys:
        return Kind.SUITE
    if {"binding", "chart"} <= keys:
        return Kind.BINDING
    if "board" in keys and keys & {"deployment", "signals"}:
        return Kind.BOARD
    if {"nodes", "system"} <= keys:
        return Kind.DEPLOYMENT
    if "system" in keys:
        return Kind.SYSTEM
    return Kind.CHART if "chart" in keys or {"extends", "refine"} <= keys else Kind.OTHER


@dataclass(frozen=True)
class File:
    """A version of a file.

    ``document`` and ``root`` are its parsed content, or None if it does not parse.
    """

    path: Path
    source: Source
    kind: Kind
    document: Document | None = field(default=None, repr=False)
    root: Node | None = field(default=None, repr=False)

    @property
    def is_xml(self) -> bool:
        """Whether the notation is SCXML."""
        return not self.path.name.lower().endswith((".yaml", ".yml"))

    @property
    def is_broken(self) -> bool:
        """Whether nothing could be read."""
        return self.kind is not Kind.OTHER and self.document is None and self.root is None

    @cached_property
    def named(self) -> tuple[tuple[Text, Path], ...]:
        """The files that it names, with the texts that name them."""
        return tuple((text, beside(self.path, text.value)) for text in self._named())

    def _named(self) -> Iterator[Text]:
        if self.document is not None:
            if self.document.extends is not None:
                yield self.document.extends
            for state in states(self.document.root, *self.document.refine):
                if state.use is not None and state.use.chart is not None:
                    yield state.use.chart
                for invoke in state.invokes:
                    if invoke.src is not None:
                        yield invoke.src
            for one in self.document.properties:
                if one.kind.value == "monitor" and one.first is not None:
                    yield one.first
            return
        texts = [text_of(under(self.root, key)) for key in ("deployment", "system", "chart")]
        if self.kind in (Kind.BOARD, Kind.DEPLOYMENT, Kind.SUITE, Kind.BINDING):
            yield from (text for text in texts if text is not None)
        if self.kind is Kind.SYSTEM:
            for _, value in entries(under(self.root, "machines")):
                yield from _chart_of(value)
            for _, value in entries(under(self.root, "properties")):
                monitor = under(value, "monitor")
                if monitor is not None:
                    yield from _chart_of(monitor)


def _chart_of(node: Node) -> Iterator[Text]:
    text = text_of(under(node, "chart") if isinstance(node, Mapping) else node)
    if text is not None:
        yield text


def beside(path: Path, named: str) -> Path:
    """Return the file that a text in another one names, perhaps in a folder of the project."""
    name = named.strip().removeprefix("file:")
    own = path.parent / name
    with suppress(FsmkitError):  # errors in a project file are findings
        own = resolve_name(path, name, own)
    return Path(normal(own))


def normal(path: Path) -> str:
    """Return an absolute path without ``..`` and links; an invalid path is unchanged."""
    try:
        return str(path.resolve())
    except (OSError, ValueError, RuntimeError):
        return str(path)


def is_named_like_one(path: Path) -> bool:
    """Whether a file may be one of ours, by its suffix."""
    return path.name.lower().endswith(SUFFIXES)


def read_file(path: Path, content: bytes) -> File:
    """Return a file as far as it can be read; this never fails."""
    findings = Findings()
    source = None
    with suppress(FsmkitError):
        source = plugin_for(Reader, path).decode(content, str(path), findings)
    if source is None:
        text = content.decode("utf-8", errors="replace")
        source = Source(str(path), text.replace("\r\n", "\n"))
    if not path.name.lower().endswith((".yaml", ".yml")):
        if SCXML_MARK.search(source.text) is None:
            return File(path, source, Kind.OTHER)
        return File(path, source, Kind.CHART, read_as_far(source, findings))
    kind = kind_of_keys(set(TOP_KEY.findall(source.text)))
    if kind is Kind.OTHER and not source.text.lstrip().startswith("{"):
        return File(path, source, kind)
    root = read_nodes(source, findings)
    if isinstance(root, Mapping):
        kind = kind_of_keys({key.value for key, _ in root.entries})
    if kind is not Kind.CHART or not isinstance(root, Mapping):
        return File(path, source, kind, root=root)
    return File(path, source, kind, read_chart(root, findings), root)
