"""Completion of texts that are typed into the drawing, by the language server's completion."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from fsmkit.diagnostics import Source
from fsmkit.editor.analysis import Analyses
from fsmkit.editor.cursor.slots import Slot, What
from fsmkit.editor.index.files import normal
from fsmkit.editor.index.workspace import Workspace

PLACES = {
    "event": What.EVENT,
    "guard": What.EXPRESSION,
    "statements": What.STATEMENTS,
    "delay": What.DELAY,
    "state": What.STATE,
    "type": What.TYPE,
    "signature": What.SIGNATURE,
}
"""The kinds of texts by their names in messages."""
MOST = 50
"""Maximum number of completions in a list."""


def completions(
    source: Source, what: What, text: str, state: str = "", events: tuple[str, ...] | None = None
) -> list[dict[str, Any]] | None:
    """Return the completions of a text that ends at the cursor; None without the extra `lsp`.

    Args:
        source: The source of the chart.
        what: The kind of the text.
        text: The text before the cursor.
        state: The state that the text is in.
        events: The events of the transition that the text is in.

    Returns:
        For each its ``label``, ``detail`` and ``insert``, the text that replaces the last
        ``length`` characters.

    """
    try:
        from lsprotocol import types

        from fsmkit.editor.context import Context
        from fsmkit.editor.features.completion import completion_of
    except ImportError:
        return None
    path = Path(normal(Path(source.name)))
    workspace = Workspace()
    workspace.set_text(path, source.text.encode("utf-8", "surrogatepass"))
    slot = Slot(what, text, state=state, events=events)
    found = []
    for item in completion_of(Context(workspace, Analyses(workspace)), path, slot):
        edit = item.text_edit
        if not isinstance(edit, types.TextEdit):
            continue
        length = edit.range.end.character - edit.range.start.character
        word = text[len(text) - length :].lower() if length else ""
        if word in item.label.lower():
            rank = (not item.label.lower().startswith(word), item.sort_text or item.label)
            shown = {"label": item.label, "detail": item.detail or "", "insert": edit.new_text}
            found.append((rank, {**shown, "length": length}))
    return [one for _, one in sorted(found, key=lambda pair: pair[0])[:MOST]]
