"""Requirements in a folder of Doorstop: one file for each item, named by its id.

An item is a YAML file. In a document with ``itemformat: markdown`` it is a Markdown file: its keys
are in YAML between two lines ``---``, its text follows.
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from pathlib import Path

from fsmkit.chart.loading import read_bytes
from fsmkit.diagnostics import Findings, FsmkitError, Source
from fsmkit.testing.requirements.requirement import (
    MOST,
    Requirement,
    as_broken,
    broken,
    one_line,
    start_of,
)
from fsmkit.yaml.encoding import decode
from fsmkit.yaml.nodes import Mapping, Node, Scalar, read_nodes

SETTINGS = ".doorstop.yml"
TEXTS = ("text", "header")
YAML, MARKDOWN = "yaml", "markdown"
SUFFIXES = {YAML: (".yml", ".yaml"), MARKDOWN: (".md",)}
BOUNDARY = re.compile(r"^-{3,}[ \t]*$", re.MULTILINE)
HEADER = re.compile(r"\s*^#[ \t]+(.*)$", re.MULTILINE)
"""A heading of the first level before all other content is the item's header, not its text."""


def read_folder(folder: Path) -> tuple[Requirement, ...]:
    """Return the active, normative items of all documents in a folder and below.

    Raises:
        FsmkitError: ``broken-requirements`` if no document is there, or an item cannot be read.

    """
    findings = Findings()
    documents = sorted(Path(at) for at, _, names in os.walk(folder) if SETTINGS in names)
    if not documents:
        at = start_of(Source(str(folder), ""))
        advice = f"name the folder that holds `{SETTINGS}`"
        broken(findings, f"`{folder}` is no document of Doorstop", at, advice)
        raise FsmkitError(findings)
    found: list[Requirement] = []
    for document in documents:
        found += _document(document, findings)
        if len(found) > MOST:
            at = start_of(Source(str(document), ""))
            broken(findings, f"there are more than {MOST:,} items", at, "name fewer folders")
            break
    if findings.has_errors:
        raise FsmkitError(findings)
    return tuple(found)


def _document(folder: Path, findings: Findings) -> Iterator[Requirement]:
    settings = _entries(folder / SETTINGS, findings).get("settings")
    given = settings.entries if isinstance(settings, Mapping) else ()
    keys = {key.value: node for key, node in given}
    form = _text(keys.get("itemformat")) or YAML
    if form not in SUFFIXES:
        at = keys["itemformat"].span
        advice = f"use `itemformat: {YAML}` or `itemformat: {MARKDOWN}`"
        broken(findings, f"items in the format `{form}` are not read", at, advice)
        return
    prefix = _text(keys.get("prefix"))
    for path in sorted(folder.iterdir()):
        if path.suffix not in SUFFIXES[form] or path.name == SETTINGS:
            continue
        if not path.stem.startswith(prefix):
            continue
        body: dict[str, str] = {}
        entries = _markdown(path, findings, body) if form == MARKDOWN else _entries(path, findings)
        if not entries or not all(
            _text(entries.get(key)) in ("", "true") for key in ("active", "normative")
        ):
            continue
        texts = [one_line(body.get(key, _text(entries.get(key)))) for key in TEXTS]
        more = [
            (key, one_line(_text(node)))
            for key, node in entries.items()
            if key not in TEXTS and _text(node)
        ]
        place = entries.get("text") or next(iter(entries.values()))
        at = start_of(place.span.source)
        yield Requirement(path.stem, next(filter(None, texts), ""), at, tuple(more))


def _markdown(path: Path, findings: Findings, body: dict[str, str]) -> dict[str, Node]:
    """Return the entries before the text of a Markdown item; put its text into the body."""
    own = Findings()
    source = decode(read_bytes(path), str(path), own)
    if source is None:
        findings.extend(as_broken(own, "item").diagnostics)
        return {}
    start = BOUNDARY.match(source.text)
    end = None if start is None else BOUNDARY.search(source.text, start.end())
    if start is None or end is None:
        advice = "write the keys of the item between two lines `---` at its start"
        broken(findings, "the item has no front matter", start_of(source), advice)
        return {}
    content = source.text[end.end() :]
    header = HEADER.match(content)
    body["header"] = "" if header is None else header[1]
    body["text"] = content if header is None else content[header.end() :]
    # without the boundaries, but with the lines of the file
    lines = source.text[start.end() : end.start()]
    return _read_entries(Source(source.name, lines), findings)


def _entries(path: Path, findings: Findings) -> dict[str, Node]:
    """Return the entries of a file of YAML; empty after a finding."""
    own = Findings()
    source = decode(read_bytes(path), str(path), own)
    if source is None:
        findings.extend(as_broken(own, "item").diagnostics)
        return {}
    return _read_entries(source, findings)


def _read_entries(source: Source, findings: Findings) -> dict[str, Node]:
    """Return the entries of a text in YAML; empty after a finding."""
    own = Findings()
    root = read_nodes(source, own)
    if own.has_errors:
        findings.extend(as_broken(own, "item").diagnostics)
    elif not isinstance(root, Mapping):
        broken(findings, "the item has no keys", start_of(source), "write `text: ...`")
    return {key.value: node for key, node in root.entries} if isinstance(root, Mapping) else {}


def _text(node: Node | None) -> str:
    return node.text.value.strip() if isinstance(node, Scalar) else ""
