"""Diagnostics as text, in the shape rustc and ruff made familiar."""

from __future__ import annotations

from collections.abc import Iterator

from fsmkit.diagnostics.diagnostic import Diagnostic, Label

WIDEST = 160
"""A longer source line is cut around the place, so that a megabyte of guard prints in a line."""


def render(diagnostic: Diagnostic) -> str:
    """Return the full, multi-line form of a diagnostic."""
    return "\n".join(_lines(diagnostic))


def _lines(diagnostic: Diagnostic) -> Iterator[str]:
    head = f"{diagnostic.severity.value}[{diagnostic.rule.code}]"
    yield f"{head} {diagnostic.rule.name}: {diagnostic.message}"
    labels = [*([diagnostic.primary] if diagnostic.primary else []), *diagnostic.secondary]
    numbers = [label.span.source.position(label.span.start)[0] for label in labels]
    gutter = " " * len(str(max(numbers, default=0)))
    for label in labels:
        first = label is diagnostic.primary
        yield from _snippet(label, "-->" if first else ":::", "^" if first else "-", gutter)
    if diagnostic.help is not None:
        yield f"{gutter} = help: {diagnostic.help}"


def _snippet(label: Label, arrow: str, mark: str, gutter: str) -> Iterator[str]:
    source, span = label.span.source, label.span
    line, column = source.position(span.start)
    text = source.line(line)
    width = max(1, min(span.end - span.start, len(text) - column + 1))
    yield f"{gutter}{arrow} {source.name}:{line}:{column}"
    cut = max(0, column - 1 - WIDEST // 2) if len(text) > WIDEST else 0
    shown = text[cut : cut + WIDEST].expandtabs(1)
    width = max(1, min(width, len(shown) - (column - 1 - cut)))
    yield f"{gutter} |"
    yield f"{line:>{len(gutter)}} | {_printable(shown)}"
    yield f"{gutter} | {' ' * (column - 1 - cut)}{mark * width} {label.text}".rstrip()


def _printable(text: str) -> str:
    return "".join(char if char.isprintable() else "\N{REPLACEMENT CHARACTER}" for char in text)
