"""Elements and attributes of lxml, named as the writer names them."""

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
"""Attributes that name files: another character there would be another file."""


def ours(element: etree._Element, name: str) -> str:
    """Return the name of an attribute of ours: without a prefix on elements of ours."""
    is_ours = etree.QName(element).namespace == EXTENSION
    return name if is_ours else extension(name)


def add(parent: etree._Element, name: str, text: str | None = None) -> etree._Element:
    """Append an element, of SCXML unless its name says otherwise."""
    qualified = name if name.startswith("{") else f"{{{SCXML}}}{name}"
    element = etree.SubElement(parent, qualified)
    if text is not None:
        element.text = _allowed(text)
    return element


def put(element: etree._Element, name: str, value: Text | str | None) -> None:
    """Set an attribute, unless there is no value; `FsmkitError` for one that reads as none."""
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
        element.set(name, _allowed(str(value)))


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


def _allowed(text: str) -> str:
    return NOT_XML.sub("\N{REPLACEMENT CHARACTER}", text)
