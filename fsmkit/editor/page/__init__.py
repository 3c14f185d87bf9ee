"""The page of `fsmkit edit`: the page of `fsmkit serve` with an editor of the chart."""

from __future__ import annotations

from functools import cache
from pathlib import Path

from fsmkit.inspector.page import Page, assemble_page, socket_transport

HERE = Path(__file__).parent


@cache
def edit_page(transport: str = "") -> Page:
    """Return the page with the part of the editor; by default its transport is a server's."""
    script, style = ((HERE / name).read_text(encoding="utf-8") for name in ("edit.js", "edit.css"))
    return assemble_page(transport or socket_transport(), script=script, style=style)
