"""What the targets share: seeds, and running one of them.

A target takes bytes. Whatever they hold, it must end with a chart or with findings; any exception
but `FsmkitError` is a crash, and atheris writes the input down.

    python fuzz/fuzz_yaml.py -max_total_time=60 -timeout=5 -rss_limit_mb=1024 CORPUS
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path

import atheris

from fsmkit.diagnostics import Findings, FsmkitError, Source
from fsmkit.model.document import Document
from fsmkit.model.elaborate import elaborate

PROJECT = Path(__file__).parent.parent


def front_end(
    content: bytes,
    name: str,
    decode: Callable[[bytes, str, Findings], Source | None],
    read: Callable[[Source, Findings], Document | None],
) -> None:
    """Take bytes as far as they go: text, Document, Chart."""
    findings = Findings()
    try:
        source = decode(content, name, findings)
        document = None if source is None else read(source, findings)
        if document is not None and document.extends is None:
            chart = elaborate((document,), findings)
            assert chart is not None or findings.has_errors
        assert document is not None or findings.has_errors
    except FsmkitError:
        pass
    for found in findings:
        if found.primary is not None:
            span = found.primary.span
            assert 0 <= span.start <= span.end <= len(span.source.text) + 1, found


def fuzz(target: Callable[[bytes], None], suffix: str, seeds: tuple[str, ...] = ()) -> None:
    """Run a target with libFuzzer; its seeds are the charts of the project, and those given."""
    words = sys.argv[1:]
    corpus = next((Path(word) for word in words if not word.startswith("-")), None)
    if corpus is not None and corpus.suffix == "":
        corpus.mkdir(parents=True, exist_ok=True)
        for number, seed in enumerate(seeds):
            (corpus / f"seed_{number}").write_text(seed, encoding="utf-8")
        for folder in ("machines", "tests"):
            for number, path in enumerate(sorted((PROJECT / folder).rglob(f"*{suffix}"))):
                if path.stat().st_size < 16_384:
                    (corpus / f"{folder}_{number}").write_bytes(path.read_bytes())
    atheris.Setup(sys.argv, target)
    atheris.Fuzz()
