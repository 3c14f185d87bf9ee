"""Writing of elements and attributes with lxml."""

from __future__ import annotations

import re
from collections.abc import Iterable

from lxml import etree

from fsmkit.diagnostics import Text, fail
from fsmkit.scxml.names import EXTENSION, SCXML

NOT_XML = re.compile("[^\t\n\r\u0020-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
"""Characters that no XML text can hold (XML 1.0, 2.2)."""


def extension(name: str) -> str:
    """Return a name of the extension namespace."""
    return f"{{{EXTENSION}}}{name}"


FILES = frozenset({"src", extension("extends")})
"""Attributes that name files: a changed character would name another file."""
PROSE = frozenset({extension("doc"), "reason"})
"""Texts for people, which may lose what XML cannot hold."""
VERBATIM = frozenset({"label", "content"})
"""Texts that a machine passes on as they are; all others are code."""


def ours(element: etree._Element, name: str) -> str:
    """Return the name of an attribute of ours: without a prefix on elements of ours."""
    is_ours = etree.QName(element).namespace == EXTENSION
    return name if is_ours else extension(name)


def add(parent: etree._Element, name: str, text: Text | str | None = None) -> etree._Element:
    """Append an element, of SCXML unless its name says otherwise."""
    qualified = name if name.startswith("{") else f"{{{SCXML}}}{name}"
    element = etree.SubElement(parent, qualified)
    if text is not None:
        element.text = _allowed(name, text)
    return element


def put(element: etree._Element, name: str, value: Text | str | None) -> None:
    """Set an attribute unless it has no value; `FsmkitError` if it would read as absent."""
    if isinstance(value, Text) and name != "label" and not value.value.strip():
        raise fail(
            "not-expressible",
            f"`{name}` is empty, which SCXML cannot say",
            value,
            help="write something there, or remove it",
        )
    if isinstance(value, Text) and name in FILES and NOT_XML.search(value.value):
        raise fail(
            "not-expressible",
            f"the name of a file, {value.value!r}, has characters that XML cannot hold",
            value,
            help="rename the file",
        )
    if value is not None:
        element.set(name, _allowed(name, value))


def joined(names: Iterable[Text]) -> str | None:
    """Return names as one attribute; `FsmkitError` for one that is not a single word."""
    found = tuple(names)
    for name in found:
        if len(name.value.split()) != 1:
            raise fail(
                "not-expressible",
                f"`{name}` has white space in it, which SCXML cannot say here",
                name,
                help="write a name that is one word",
            )
    return " ".join(name.value for name in found) or None


def _allowed(name: str, value: Text | str) -> str:
    """Return a text that XML can contain; `FsmkitError` if it would change."""
    text = str(value)
    if not NOT_XML.search(text):
        return text
    if name in PROSE:
        return NOT_XML.sub("\N{REPLACEMENT CHARACTER}", text)
    if name in VERBATIM:
        raise fail(
            "not-expressible",
            f"{text!r} has characters that XML cannot hold",
            value if isinstance(value, Text) else None,
            help="remove them, or keep the chart in YAML",
        )
    return ESCAPED.sub(_escape, text)


ESCAPED = re.compile(rf"\\.|{NOT_XML.pattern}", re.DOTALL)
"""An escape sequence or a character that XML cannot contain, in a string of code."""


def _escape(found: re.Match[str]) -> str:
    """Escape a character as programming languages do: in code it occurs only in strings."""
    last = found[0][-1]
    return f"\\u{ord(last):04x}" if NOT_XML.match(last) else found[0]
