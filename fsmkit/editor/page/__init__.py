"""The page of `fsmkit edit`: the page of `fsmkit serve` with an editor of the chart."""

from __future__ import annotations

from functools import cache
from pathlib import Path

from fsmkit.inspector.page import Page, assemble_page, socket_transport

HERE = Path(__file__).parent


@cache
def edit_page() -> Page:
    """Return the page of a server with the part of the editor."""
    script, style = ((HERE / name).read_text(encoding="utf-8") for name in ("edit.js", "edit.css"))
    return assemble_page(socket_transport(), script=script, style=style)
