"""The language of Graphviz: statements with attributes, and labels in its HTML-like markup."""

from __future__ import annotations

import html
import re
from collections.abc import Iterable, Mapping, Sequence

Cell = tuple[str, Mapping[str, str]]
"""Markup, and the attributes of its cell."""
UNPRINTABLE = re.compile(r"[\x00-\x08\x0b\x0c\x0e-\x1f\x7f-\x9f\ud800-\udfff\ufffe\uffff]")


def statement(head: str, **attributes: str | float) -> str:
    """Return a statement with attributes; a value in ``<>`` is a label in markup."""
    pairs = (f"{key}={_value(value)}" for key, value in attributes.items())
    return f"{head} [{', '.join(pairs)}];"


def _value(value: str | float) -> str:
    text = str(value)
    return text if text.startswith("<") and text.endswith(">") else quoted(text)


def quoted(text: str) -> str:
    """Return a text in double quotes: Graphviz reads entities of HTML there, too."""
    clean = UNPRINTABLE.sub("\N{REPLACEMENT CHARACTER}", text).replace("&", "&amp;")
    return '"' + clean.replace("\\", "\\\\").replace('"', '\\"').replace("\n", "\\n") + '"'


def escaped(text: str) -> str:
    """Return a text for a label in markup; white space at its start is kept."""
    clean = html.escape(UNPRINTABLE.sub("\N{REPLACEMENT CHARACTER}", text)).replace("\n", " ")
    if not clean.strip("]"):  # a label of these alone is a syntax error of Graphviz
        clean = clean.replace("]", "&#93;")
    margin = len(clean) - len(clean.lstrip(" "))
    return "&#160;" * margin + clean[margin:]


def font(text: str, color: str, size: int) -> str:
    """Return markup in a colour and size (in points)."""
    return f'<font color="{color}" point-size="{size}">{text}</font>'


def left(texts: tuple[str, ...]) -> str:
    """Return lines, aligned at the left."""
    return "".join(f'{escaped(text)}<br align="left"/>' for text in texts)


def label_with_title(
    title: str,
    rows: Iterable[Cell],
    align: str,
    *,
    above: Sequence[Cell] = (),
    below: Sequence[Cell] = (),
    room: int = 0,
) -> str:
    """Return a label: a title, with optional rows below it, each with attributes.

    ``above`` and ``below``: cells side by side above the title and below all rows. ``room``: free
    points at the top.
    """
    cells = "".join(
        f'<tr><td align="left" balign="left"{_attributes(more)}>{body}</td></tr>'
        for body, more in rows
    )
    if not (cells or above or below or room):
        return f"<{title}>"
    free = f'<tr><td height="{room}"></td></tr>' if room else ""
    return (
        f'<<table border="0" cellborder="0" cellspacing="0" cellpadding="1">{free}'
        f'{_beside(above)}<tr><td align="{align}">{title}</td></tr>{cells}{_beside(below)}</table>>'
    )


def _beside(cells: Sequence[Cell]) -> str:
    """Return a row of cells side by side; empty without cells."""
    if not cells:
        return ""
    row = "".join(f"<td{_attributes(more)}>{body}</td>" for body, more in cells)
    inner = f'<table border="0" cellborder="0" cellspacing="3"><tr>{row}</tr></table>'
    return f"<tr><td>{inner}</td></tr>"


def _attributes(attributes: Mapping[str, str]) -> str:
    return "".join(f' {key}="{escaped(value)}"' for key, value in attributes.items())
