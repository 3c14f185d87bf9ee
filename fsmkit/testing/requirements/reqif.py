"""Requirements in ReqIF 1.2 (OMG): `.reqif`, and `.reqifz`, a zip archive of these."""

from __future__ import annotations

import html
import re
import zipfile
import zlib
from collections.abc import Iterator, Mapping
from io import BytesIO

from fsmkit.diagnostics import Findings, FsmkitError, Source, Span
from fsmkit.scxml.nodes import Element, decode, read_nodes
from fsmkit.testing.requirements.requirement import (
    MOST,
    Requirement,
    as_broken,
    broken,
    one_line,
    start_of,
)

LARGEST = 64 * 1024 * 1024
"""Bytes of all files of an archive together, unpacked."""
MEMBERS = 1000
"""Files in an archive."""
IDS = ("reqif.foreignid", "id", "req id", "reqid", "identifier", "object identifier")
TEXTS = ("reqif.text", "text", "description", "object text", "reqif.name", "name", "title")
HEADING = "reqif.chaptername"
"""Names of attributes, in lower case; those of the ReqIF implementation guide come first."""
MARKUP = re.compile(r"<!--.*?-->|<!\[CDATA\[(.*?)\]\]>|<[^>]*>", re.DOTALL)


def read_archive(content: bytes, name: str) -> tuple[Requirement, ...]:
    """Return the requirements of all `.reqif` files of an archive.

    Raises `FsmkitError` (``broken-requirements``) for an archive that is broken, encrypted or
    larger than 64 MiB unpacked, whatever its directory claims.
    """
    findings = Findings()
    shown = Source(name, "")
    found: list[Requirement] = []
    try:
        with zipfile.ZipFile(BytesIO(content)) as archive:
            members = archive.infolist()
            if len(members) > MEMBERS:
                raise _Unusable(f"it has more than {MEMBERS:,} files")
            inside = [one for one in members if one.filename.lower().endswith((".reqif", ".xml"))]
            if not inside:
                raise _Unusable("it has no `.reqif` file")
            left = LARGEST
            for member in inside:
                with archive.open(member) as file:
                    data = file.read(left + 1)
                left -= len(data)
                if left < 0:
                    raise _Unusable(f"it unpacks to more than {LARGEST >> 20} MiB")
                found += read(data, f"{name}/{member.filename}")
    except _Unusable as error:
        broken(findings, f"the archive cannot be used: {error}", start_of(shown), ADVICE)
    except (
        *(zipfile.BadZipFile, zlib.error, EOFError, OSError, RuntimeError, NotImplementedError),
        *(ValueError, OverflowError),
    ) as error:
        message = f"the archive cannot be unpacked: {error or type(error).__name__}"
        broken(findings, message, start_of(shown), ADVICE)
    if findings.has_errors:
        raise FsmkitError(findings)
    return tuple(found)


ADVICE = "export it again, or name the `.reqif` file that it holds"


class _Unusable(Exception):  # noqa: N818  (control flow of this module)
    """The reason why an archive is rejected."""


def read(content: bytes, name: str) -> tuple[Requirement, ...]:
    """Return the requirements of a file; raises `FsmkitError` (``broken-requirements``).

    The id of an object is its attribute `ReqIF.ForeignID` or `ID`, else its `IDENTIFIER`. Objects
    that only have the name of a chapter are omitted.
    """
    findings = Findings()
    source = decode(content, name, findings)
    root = None if source is None else read_nodes(source, findings)
    if source is None or root is None:
        raise as_broken(findings, "ReqIF file")
    if root.name != "REQ-IF":
        broken(
            findings, f"`<{root.name}>` is not ReqIF", root.span, "export it as ReqIF 1.0 to 1.2"
        )
        raise FsmkitError(findings)
    names = _attribute_names(root)
    words = {_id(one): _long_name(one) for one in _all(root, "ENUM-VALUE")}
    objects = list(_all(root, "SPEC-OBJECT"))
    if len(objects) > MOST:
        broken(findings, f"it has more than {MOST:,} objects", root.span, "export fewer documents")
        raise FsmkitError(findings)
    found: list[Requirement] = []
    for one in objects:
        cells = dict(_values(one, names, words))
        lower = {name.lower(): name for name in cells}
        id_name = next((lower[n] for n in IDS if n in lower and cells[lower[n]]), None)
        id_ = _id(one) if id_name is None else cells[id_name]
        text_name = next((lower[n] for n in TEXTS if n in lower and cells[lower[n]]), None)
        if text_name is None and cells.get(lower.get(HEADING, "")):
            continue
        if not id_:
            broken(findings, "the object has no identifier", one.span, "export it again")
            continue
        text = _long_name(one) if text_name is None else cells[text_name]
        more = [(n, c) for n, c in cells.items() if c and n not in (id_name, text_name)]
        found.append(Requirement(id_, text, one.span, tuple(more)))
    if findings.has_errors:
        raise FsmkitError(findings)
    return tuple(found)


def _all(root: Element, name: str) -> Iterator[Element]:
    """Yield the elements of a name at any depth, in document order."""
    pending = [root]
    while pending:
        element = pending.pop()
        if element.name == name:
            yield element
        pending += reversed(element.children)


def _attribute_names(root: Element) -> Mapping[str, str]:
    """Return the long names of attribute definitions by identifier."""
    found: dict[str, str] = {}
    pending = [root]
    while pending:
        element = pending.pop()
        if element.name.startswith("ATTRIBUTE-DEFINITION-") and not element.name.endswith("-REF"):
            found[_id(element)] = _long_name(element) or _id(element)
        pending += element.children
    return found


def _values(
    one: Element, names: Mapping[str, str], words: Mapping[str, str]
) -> Iterator[tuple[str, str]]:
    """Yield the attributes of an object: name and value."""
    for values in (child for child in one.children if child.name == "VALUES"):
        for value in values.children:
            definition = next((c for c in value.children if c.name == "DEFINITION"), None)
            refers = "" if definition is None else _content(definition)
            yield names.get(refers, refers), _value(value, words)


def _value(value: Element, words: Mapping[str, str]) -> str:
    plain = value.get("THE-VALUE")
    if plain is not None:
        return one_line(plain.value)
    for child in value.children:
        if child.name == "THE-VALUE":
            return _plain(child.inner)
        if child.name == "VALUES":
            refers = (_content_of(reference) for reference in child.children)
            return ", ".join(words.get(one, one) for one in refers)
    return ""


def _plain(inner: Span) -> str:
    """Return the text of XHTML, without its markup."""
    written = inner.source.text[inner.start : inner.end]
    return one_line(html.unescape(MARKUP.sub(lambda found: f" {found[1] or ''} ", written)))


def _content(parent: Element) -> str:
    return next((_content_of(child) for child in parent.children), "")


def _content_of(element: Element) -> str:
    return element.text.value.strip()


def _id(element: Element) -> str:
    given = element.get("IDENTIFIER")
    return "" if given is None else given.value.strip()


def _long_name(element: Element) -> str:
    given = element.get("LONG-NAME")
    return "" if given is None else one_line(given.value)
