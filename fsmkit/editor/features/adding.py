"""Edits that add a declaration to a chart, in either notation."""

from __future__ import annotations

from fsmkit.diagnostics import Edit, FsmkitError, Source
from fsmkit.editor.editing.applying import apply
from fsmkit.editor.editing.operations import Declare

ESCAPED = {"&": "&amp;", "<": "&lt;", '"': "&quot;"}


def escape_xml(text: str) -> str:
    """Escape a string for an attribute or an element."""
    return "".join(ESCAPED.get(char, char) for char in text)


def declaration(source: Source, section: str, name: str, value: str) -> tuple[Edit, ...]:
    """Return the edits that declare a name; empty if the chart has no suitable location.

    Args:
        source: The source of the chart.
        section: ``constants``, ``data``, ``inputs``, ``functions``, ``operations``, ``in`` or
            ``internal``.
        name: The name; for functions, operations and events the signature.
        value: The value, the type with the initial value, or the body; may be empty.

    """
    try:
        return apply(source, Declare(section, name, value))
    except FsmkitError:
        return ()
