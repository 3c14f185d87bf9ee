"""The page of `fsmkit serve`: HTML, CSS and JavaScript in, one file and its policy out.

The files are what a browser reads; nothing builds them. Whatever a chart says is text in them:
`textContent` alone, and drawings through a list of elements and attributes.
"""

from __future__ import annotations

from base64 import b64encode
from dataclasses import dataclass
from functools import cache
from hashlib import sha256
from pathlib import Path

HERE = Path(__file__).parent
SCRIPTS = ("dom.js", "model.js", "drawing.js", "panels.js", "plant.js", "page.js")
"""In the order in which they stand on the page."""
STYLES = ("page.css", "plant.css")


@dataclass(frozen=True, slots=True)
class Page:
    """One file of HTML, and the Content-Security-Policy under which it works."""

    text: bytes
    policy: str


@cache
def page() -> Page:
    """Return the page: no other file is wanted, and no script but its own is run."""
    script = "".join(_read(name) for name in SCRIPTS)
    style = "".join(_read(name) for name in STYLES)
    text = _read("index.html").replace("/*STYLE*/", style).replace("/*SCRIPT*/", script)
    policy = (
        f"default-src 'none'; script-src '{_digest(script)}'; style-src '{_digest(style)}'; "
        "connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
    )
    return Page(text.encode(), policy)


def _read(name: str) -> str:
    return (HERE / name).read_text(encoding="utf-8")


def _digest(text: str) -> str:
    return f"sha256-{b64encode(sha256(text.encode()).digest()).decode()}"
