"""Requirements in a folder of Doorstop: one YAML file for each item, named by its id."""

from __future__ import annotations

import os
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
    form = _text(keys.get("itemformat"))
    if form not in ("", "yaml"):
        at = keys["itemformat"].span
        broken(findings, f"items in the format `{form}` are not read", at, "use `itemformat: yaml`")
        return
    prefix = _text(keys.get("prefix"))
    for path in sorted(folder.glob("*.yml")):
        if path.name == SETTINGS or not path.stem.startswith(prefix):
            continue
        entries = _entries(path, findings)
        if not entries or not all(
            _text(entries.get(key)) in ("", "true") for key in ("active", "normative")
        ):
            continue
        texts = [one_line(_text(entries.get(key))) for key in TEXTS]
        more = [
            (key, one_line(_text(node)))
            for key, node in entries.items()
            if key not in TEXTS and _text(node)
        ]
        place = entries.get("text") or next(iter(entries.values()))
        at = start_of(place.span.source)
        yield Requirement(path.stem, next(filter(None, texts), ""), at, tuple(more))


def _entries(path: Path, findings: Findings) -> dict[str, Node]:
    """Return the entries of a file of YAML; empty after a finding."""
    own = Findings()
    source = decode(read_bytes(path), str(path), own)
    root = None if source is None else read_nodes(source, own)
    if own.has_errors:
        findings.extend(as_broken(own, "item").diagnostics)
    elif source is not None and not isinstance(root, Mapping):
        broken(findings, "the item has no keys", start_of(source), "write `text: ...`")
    return {key.value: node for key, node in root.entries} if isinstance(root, Mapping) else {}


def _text(node: Node | None) -> str:
    return node.text.value.strip() if isinstance(node, Scalar) else ""
