"""Read a view: an SVG picture of a plant whose elements are bound to values of a session.

Any editor can draw the file. Attributes ``data-...`` bind an element; docs/reference/views.md
lists them. The page receives only elements and attributes of two lists, values without references
outside the picture, and the bindings as data. Everything else is omitted, with a finding. The page
filters the picture again.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from lxml import etree

from fsmkit.diagnostics import Findings, FsmkitError, Severity, Source, Span, fail
from fsmkit.diagnostics.suggestions import suggest
from fsmkit.runtime.script import is_received
from fsmkit.system.system import System

SVG = "http://www.w3.org/2000/svg"
MOST_BYTES = 1_000_000
MOST_ELEMENTS = 10_000
MOST_BOUND = 1_000
MOST_DEEP = 64
MOST_LONG = 20_000
"""Characters of a value."""
ELEMENTS = frozenset(
    ("svg", "g", "path", "polygon", "polyline", "ellipse", "circle", "rect", "line", "text",
     "tspan", "title")
)  # fmt: skip
DRAWN = frozenset(
    ("class", "transform", "d", "points", "cx", "cy", "r", "rx", "ry", "x", "y", "x1", "y1", "x2",
     "y2", "width", "height", "viewBox", "fill", "stroke", "stroke-width", "stroke-dasharray",
     "text-anchor", "font-family", "font-size", "font-weight", "font-style")
)  # fmt: skip
"""Attributes of appearance."""
VALUE = re.compile(r"[\w\s.,;#%()+\-/'\"]*", re.ASCII)
NUMBER = r"-?\d+(?:\.\d+)?"
NAME = r"[A-Za-z_][\w.\-]*"
WORD = re.compile(r"[A-Za-z][\w\-]*", re.ASCII)
MOVED = re.compile(
    rf"({NAME})\s+({NUMBER})\.\.({NUMBER})\s+({NUMBER})\.\.({NUMBER})(?:\s+({NUMBER})\s+({NUMBER}))?",
    re.ASCII,
)
CONDITION = re.compile(rf"({NAME})(?:\s*(!=|<=|>=|=|<|>)\s*([\w.\-]+))?", re.ASCII)
POSTED = re.compile(rf"({NAME})\.({NAME})", re.ASCII)
MOVES = ("x", "y", "rotate", "width", "height")
BOUND = frozenset(
    f"data-{name}"
    for name in (*MOVES, "text", "digits", "words", "show", "class", "machine", "post", "with",
                 "label", "group")
)  # fmt: skip
Json = dict[str, Any]


@dataclass(frozen=True, slots=True)
class Picture:
    """A picture that is safe to show, and its bindings, one for each bound element.

    The elements have the ids ``v0``, ``v1`` ... of their items.
    """

    svg: str
    items: tuple[Json, ...]

    def as_json(self) -> Json:
        """Return the message for a page."""
        return {"svg": self.svg, "items": list(self.items)}


def read_picture(path: Path, findings: Findings) -> Picture:
    """Read the view of a file; raises `FsmkitError` (``wrong-view``) if it is not a view."""
    try:
        with path.open("rb") as file:
            content = file.read(MOST_BYTES + 1)
    except OSError as error:
        raise fail("unreadable-file", f"{path}: {error.strerror or error}") from error
    return picture_of(content, path.name, findings)


def picture_of(content: bytes, name: str, findings: Findings) -> Picture:
    """Return the view of a file's content; each omitted part gets a warning."""
    if len(content) > MOST_BYTES:
        raise fail("wrong-view", f"`{name}` has more than {MOST_BYTES:,} bytes")
    parser = etree.XMLParser(
        resolve_entities=False, no_network=True, load_dtd=False, huge_tree=False,
        remove_comments=True, remove_pis=True,
    )  # fmt: skip
    try:
        root = etree.fromstring(content, parser)
    except (etree.XMLSyntaxError, ValueError) as error:
        raise fail("wrong-view", f"`{name}` is not XML: {error}") from error
    if b"<!DOCTYPE" in content:
        raise fail(
            "wrong-view", f"`{name}` declares a document type", help="remove `<!DOCTYPE ...>`"
        )
    if root.tag != f"{{{SVG}}}svg":
        raise fail(
            "wrong-view", f"`{name}` is not SVG: its root is `{etree.QName(root).localname}`"
        )
    text = content.decode(errors="replace")
    return _Maker(Source(name, text), findings).made(root)


@dataclass(slots=True)
class _Maker:
    """Copies the allowed elements."""

    source: Source
    findings: Findings
    items: list[Json] = field(default_factory=list)
    count: int = 0
    told: set[str] = field(default_factory=set)

    def made(self, root: etree._Element) -> Picture:
        copy_element = self.copy_element(root, 0)
        if copy_element is None or not copy_element.get("viewBox"):
            raise fail(
                "wrong-view", "the picture has no `viewBox`", self.span(root),
                help='write `viewBox="0 0 800 600"`: the page gives it its size',
            )  # fmt: skip
        for size in ("width", "height"):
            copy_element.attrib.pop(size, "")
        return Picture(etree.tostring(copy_element, encoding="unicode"), tuple(self.items))

    def span(self, element: etree._Element) -> Span:
        """Return the line of an element."""
        line = max(1, getattr(element, "sourceline", 1) or 1)
        lines = self.source.text.split("\n")
        begin = sum(len(each) + 1 for each in lines[: line - 1])
        length = len(lines[line - 1]) if line <= len(lines) else 0
        begin = min(begin, len(self.source.text))
        return Span(self.source, begin, min(begin + length, len(self.source.text)))

    def omit(self, what: str, element: etree._Element) -> None:
        if what not in self.told:
            self.told.add(what)
            self.findings.add(
                "wrong-view", f"the picture omits {what}", self.span(element),
                severity=Severity.WARNING,
            )  # fmt: skip

    def copy_element(self, element: etree._Element, depth: int) -> etree._Element | None:
        """Return an element with its allowed parts, or None if it is not allowed."""
        if not isinstance(element.tag, str):
            raise fail("wrong-view", "the picture has entities", self.span(element))
        name = etree.QName(element)
        self.count += 1
        if self.count > MOST_ELEMENTS or depth > MOST_DEEP:
            raise fail(
                "wrong-view",
                f"the picture has more than {MOST_ELEMENTS:,} elements, "
                f"or more than {MOST_DEEP} within each other",
                self.span(element),
            )
        if name.namespace != SVG or name.localname not in ELEMENTS:
            self.omit(f"the element `{name.localname}`", element)
            return None
        copy = etree.Element(name.text, nsmap={None: SVG})  # type: ignore[dict-item]
        given: dict[str, str] = {}
        for key, value in self.attributes(element):
            if key in BOUND:
                given[key] = value
            elif key in DRAWN and VALUE.fullmatch(value) and "url" not in value.lower():
                copy.set(key, value)
            elif key != "id":
                self.omit(f"the attribute `{key}`", element)
        if given:
            self.bind(element, copy, given)
        copy.text = element.text
        for child in element:
            made = self.copy_element(child, depth + 1)
            if made is not None:
                copy.append(made)
                made.tail = child.tail
            elif child.tail and len(copy):
                copy[-1].tail = (copy[-1].tail or "") + child.tail
            elif child.tail:
                copy.text = (copy.text or "") + child.tail
        return copy

    def attributes(self, element: etree._Element) -> Iterator[tuple[str, str]]:
        """Yield attributes; of ``style`` its declarations, as editors write them."""
        for key, value in ((str(k), str(v)) for k, v in element.attrib.items()):
            if len(value) > MOST_LONG:
                raise fail(
                    "wrong-view", f"`{key}` has {len(value):,} characters", self.span(element)
                )
            if key != "style":
                yield key, value
                continue
            for declaration in value.split(";"):
                name, _, said = declaration.partition(":")
                if name.strip() in DRAWN:
                    yield name.strip(), said.strip()

    # --- bindings ------------------------------------------------------------------------------

    def bind(self, element: etree._Element, copy: etree._Element, given: Mapping[str, str]) -> None:
        if len(self.items) >= MOST_BOUND:
            raise fail("wrong-view", f"more than {MOST_BOUND:,} elements are bound")
        item: Json = {"id": f"v{len(self.items)}"}
        for key, text in given.items():
            name = key.removeprefix("data-")
            try:
                read = _READERS.get(name)
                item[name] = _moved(text) if read is None else read(text)
            except ValueError as error:
                raise fail(
                    "wrong-view", f"`{key}` is {error}: `{text}`", self.span(element)
                ) from error
        for owner, needs in (("with", "post"), ("digits", "text"), ("words", "text")):
            if owner in item and needs not in item:
                raise fail("wrong-view", f"`data-{owner}` needs `data-{needs}`", self.span(element))
        copy.set("id", item["id"])
        self.items.append(item)


def _moved(text: str) -> Json:
    found = MOVED.fullmatch(text.strip())
    if found is None or float(found[2]) == float(found[3]):
        raise ValueError("not of the form `NAME 0..1000 0..140`")
    low, high, begin, end = map(float, found.groups()[1:5])
    middle = [float(each) for each in found.groups()[5:] if each is not None]
    return {"of": found[1], "in": [low, high], "out": [begin, end], "about": middle}


def _condition(text: str) -> Json:
    found = CONDITION.fullmatch(text.strip())
    if found is None:
        raise ValueError("not of the form `NAME` or `NAME = VALUE`")
    return {"of": found[1], "is": found[2] or "", "value": found[3] or ""}


def _classes(text: str) -> list[Json]:
    made = []
    for each in filter(str.strip, text.split(";")):
        word, _, condition = each.partition(":")
        if WORD.fullmatch(word.strip()) is None:
            raise ValueError("not of the form `word: NAME = VALUE; ...`")
        made.append({"word": word.strip(), **_condition(condition)})
    return made


def _name(text: str) -> str:
    if re.fullmatch(NAME, text.strip(), re.ASCII) is None:
        raise ValueError("no name")
    return text.strip()


def _digits(text: str) -> int:
    if not re.fullmatch(r"[0-6]", text.strip()):
        raise ValueError("no number from 0 to 6")
    return int(text)


def _post(text: str) -> Json:
    found = POSTED.fullmatch(text.strip())
    if found is None:
        raise ValueError("not of the form `MACHINE.EVENT`")
    return {"m": found[1], "event": found[2]}


def _payload(text: str) -> Json:
    made: Json = {}
    for each in text.split():
        name, equals, value = each.partition("=")
        if not equals or not name.isidentifier():
            raise ValueError("not of the form `name=value name=value`")
        made[name] = _plain(value)
    return made


def _plain(value: str) -> Any:
    if value in ("true", "false"):
        return value == "true"
    if re.fullmatch(r"-?\d+", value):
        return int(value)
    return float(value) if re.fullmatch(NUMBER, value) else value


_READERS: Mapping[str, Callable[[str], Any]] = {
    "text": _name, "digits": _digits, "words": lambda text: text.split("|"), "show": _condition,
    "class": _classes, "machine": _name, "post": _post, "with": _payload, "label": str.strip,
    "group": str.strip,
}  # fmt: skip


def check_names(picture: Picture, system: System) -> None:
    """Raise `FsmkitError` (``unknown-name``) for an unknown machine or event.

    The page resolves names of values, because a plant sends its signals at run time.
    """
    charts = {machine.name: machine.chart for machine in system.machines}
    for item in picture.items:
        post = item.get("post")
        for name in (item.get("machine"), post and post["m"]):
            if name is not None and name not in charts:
                raise _unknown("machine", name, list(charts))
        if post is not None:
            events = [e.name for e in charts[post["m"]].events if is_received(e)]
            if post["event"] not in events:
                raise _unknown(f"event of `{post['m']}`", post["event"], events)


def _unknown(kind: str, name: str, known: list[str]) -> FsmkitError:
    help_ = suggest(name, known, f"use one of {', '.join(known[:12])}" if known else "")
    message = f"the view names the {kind} `{name}`, which there is not"
    return fail("unknown-name", message, help=help_ or None)
