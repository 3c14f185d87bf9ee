"""The layout of ``fsmkit fmt``, as edits."""

from __future__ import annotations

from pathlib import Path

from lsprotocol import types

from fsmkit.diagnostics import FsmkitError
from fsmkit.editor.context import Context


def formatting(context: Context, path: Path) -> list[types.TextEdit]:
    """Return the edit that lays a file out; none where it is so already, or cannot be read."""
    from fsmkit.formatting import formatted

    lines = context.lines(path)
    if lines is None:
        return []
    with context.workspace.unsaved():
        try:
            made = formatted(lines.text, str(path))
        except FsmkitError:
            return []
    return [] if made == lines.text else [types.TextEdit(lines.whole, made)]
