"""The page of `fsmkit serve`: joins HTML, CSS and JavaScript to one file with its policy.

Browsers read the files without a build step. Strings from charts are inserted by `textContent`
only, and drawings through a list of elements and attributes.
"""

from __future__ import annotations

import re
from base64 import b64encode
from dataclasses import dataclass
from functools import cache
from hashlib import sha256
from pathlib import Path

HERE = Path(__file__).parent
SCRIPTS = (
    "dom.js",
    "words.js",
    "model.js",
    "outline.js",
    "look.js",
    "view.js",
    "forms.js",
    "panels.js",
    "history.js",
    "sequence.js",
    "plant.js",
    "keys.js",
    "page.js",
)
"""The scripts of the page in order, after the transport."""
STYLES = ("page.css", "plant.css")
SPARED = re.compile(r"^[ \t]*(?:(?://.*|/\*(?:[^*]|\*(?!/))*\*/)?\n|(?=\S))", re.MULTILINE)
"""Lines that are comments or blank, and the indentation of others."""
PLANT = ("plant.js", "plant.css")
SOCKET = "socket.js"
"""The transport of `fsmkit serve`."""


@dataclass(frozen=True, slots=True)
class Page:
    """One file of HTML, and the Content-Security-Policy under which it works."""

    text: bytes
    policy: str


@cache
def page() -> Page:
    """Return the page of a server: no other file is wanted, no script but its own is run."""
    return assemble_page(socket_transport())


def socket_transport() -> str:
    """Return the transport of a server."""
    return _read(SOCKET)


def assemble_page(
    transport: str, *, is_spared: bool = False, script: str = "", style: str = ""
) -> Page:
    """Return the page with a transport, a script that defines the object ``transport``.

    ``is_spared``: for a page that is sent around, remove comments, indentation and the code for
    pictures of plants; its transport has a replacement. ``script`` and ``style`` follow the own
    ones.
    """
    parts = [[n for n in names if not (is_spared and n in PLANT)] for names in (SCRIPTS, STYLES)]
    own_script, own_style = ("".join(map(_read, names)) for names in parts)
    script, style = own_script + script, own_style + style
    if is_spared:
        script, style = (SPARED.sub("", text) for text in (script, style))
    script = transport + script
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
