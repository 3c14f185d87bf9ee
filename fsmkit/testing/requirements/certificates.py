"""Certificates of `fsmkit certify`, as far as the matrix shows them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from fsmkit.chart.loading import read_bytes
from fsmkit.diagnostics import FsmkitError, Source, Span, fail
from fsmkit.diagnostics.parsing import parse_json
from fsmkit.emit import guard

RESULTS = ("complete", "partial", "different")


@dataclass(frozen=True, slots=True)
class Certificate:
    """A certificate: a chart, a target, and whether all steps were equal."""

    file: str
    chart: str
    fingerprint: str
    target: str
    compiler: str
    result: str
    steps: int
    differences: int

    def __post_init__(self) -> None:
        guard(self, "file", "chart", "target", "compiler", "result")


def read_certificate(path: Path) -> Certificate:
    """Return a certificate; raises `FsmkitError` (``broken-certificate``)."""
    return certificate_of(read_document(path), path)


def read_document(path: Path) -> Mapping[str, Any]:
    """Return the document of a certificate; raises `FsmkitError` (``broken-certificate``)."""
    content = read_bytes(path)
    try:
        root = parse_json(content)
    except ValueError as error:
        raise _broken(path, content, f"is not JSON: {error}") from error
    if not isinstance(root, dict):
        raise _broken(path, content, "is not an object")
    certificate_of(root, path, content)
    return root


def certificate_of(root: Mapping[str, Any], path: Path, content: bytes = b"") -> Certificate:
    """Return a certificate of its document; raises `FsmkitError` (``broken-certificate``)."""
    match dict(root):
        case {
            "chart": str(chart), "fingerprint": str(digest), "target": str(target),
            "compiler": str(compiler), "result": str(result), "steps": int(steps),
            "differences": list(differences),
        } if result in RESULTS:  # fmt: skip
            return Certificate(
                str(path), chart, digest, target, compiler, result, steps, len(differences)
            )
    raise _broken(path, content, "is not a certificate of `fsmkit certify`")


def _broken(path: Path, content: bytes, reason: str) -> FsmkitError:
    source = Source(str(path), content.decode(errors="replace"))
    at = Span(source, 0, min(1, len(source.text)))
    return fail("broken-certificate", f"`{path}` {reason}", at, help="run `fsmkit certify` again")
