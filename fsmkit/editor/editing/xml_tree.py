"""An SCXML file as a tree that can be changed: what does not change keeps its bytes."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

from lxml import etree

from fsmkit.diagnostics import Findings, FsmkitError, Source
from fsmkit.scxml.context import Context
from fsmkit.scxml.names import EXTENSION, PREFIX, SCXML
from fsmkit.scxml.nodes import Element, read_nodes
from fsmkit.yaml.layout import STEP

COMMENT = re.compile(r"<!--.*?-->", re.DOTALL)
NAMESPACE = re.compile(r'\sxmlns(?::[\w.-]+)?="[^"]*"')
ESCAPES = {"&": "&amp;", "<": "&lt;", '"': "&quot;", "\n": "&#10;", "\t": "&#9;", "\r": "&#13;"}
TEXT_LINE = "\ue00a"
"""A line end within a text, which is not followed by a margin."""


@dataclass(eq=False, slots=True)
class Tag:
    """An element: of the file (``old``), or new (``new``), with the text around it.

    ``lead`` is the text between its predecessor and it, ``behind`` a comment at the end of its
    line. ``attributes`` are changed values by their written names, None for removed ones.
    """

    word: str
    old: Element | None = None
    new: str = ""
    lead: str = ""
    behind: str = ""
    start: int = 0
    opened: int = 0
    """The end of the start tag."""
    end: int = 0
    name: str = ""
    """The written name, with its prefix; another one than in the file renames the element."""
    attributes: dict[str, str | None] = field(default_factory=dict)
    children: list[Tag] = field(default_factory=list)
    loaded: tuple[Tag, ...] = ()
    closing: str = ""
    """The text between the last child and the end tag."""
    above: list[str] = field(default_factory=list)
    """Comments of removed parts, which go above it."""
    is_open: bool = False
    """Whether a new element has children of the file."""


class XmlTree:
    """The elements of an SCXML file."""

    def __init__(self, source: Source) -> None:
        """Read the elements of a source, which the reader reads without an error."""
        findings = Findings()
        root = read_nodes(source, findings)
        if root is None:
            raise FsmkitError(findings)
        self.source, self.text = source, source.text
        self.context = Context(source, findings, root.namespace)
        self.scxml, self.prefix = self._prefixes(root)
        self.needs_prefix = False
        self.root = self._load(root)

    def _prefixes(self, root: Element) -> tuple[str, str]:
        """Return the written prefixes of SCXML and of the extension; empty if missing."""
        opening = self.text[root.span.start : root.inner.start]
        name = re.match(r"<([\w.-]+:)?", opening)
        scxml = "" if name is None or name[1] is None else name[1][:-1]
        found = re.search(rf"""xmlns:([\w.-]+)\s*=\s*["']{re.escape(EXTENSION)}["']""", opening)
        return scxml, "" if found is None else found[1]

    def _load(self, old: Element) -> Tag:
        text = self.text
        opened = old.inner.start
        end = opened
        if not text.startswith("/>", opened - 2) or old.inner.end > opened:
            end = text.find(">", old.inner.end) + 1
        name = re.compile(r"<([^\s/>]+)").match(text, old.span.start)
        tag = Tag(
            self.context.word(old), old, start=old.span.start, opened=opened, end=end,
            name="" if name is None else name[1],
        )  # fmt: skip
        at = opened
        for child in old.children:
            inner = self._load(child)
            self._between(tag, text[at : inner.start], inner)
            tag.children.append(inner)
            at = inner.end
        rest = text[at : old.inner.end]
        if tag.children:
            behind = self._behind(rest)
            tag.children[-1].behind = rest[:behind]
            rest = rest[behind:]
        tag.closing = rest
        tag.loaded = tuple(tag.children)
        return tag

    def _between(self, tag: Tag, between: str, inner: Tag) -> None:
        behind = self._behind(between) if tag.children else 0
        if tag.children:
            tag.children[-1].behind = between[:behind]
        inner.lead = between[behind:]

    def _behind(self, between: str) -> int:
        """Return the length of comments that end the line of the element before them."""
        line = between.split("\n", 1)[0]
        if "\n" not in between or not COMMENT.search(between):
            return 0
        at = 0
        for match in COMMENT.finditer(between):
            if match.start() > len(line) or "\n" in between[at : match.start()]:
                break
            at = match.end()
        return at

    # --- comments -----------------------------------------------------------------------------

    def own_remarks(self, tag: Tag) -> list[str]:
        """Return the comments of an element, without those of its children."""
        found = [*tag.above, *COMMENT.findall(tag.lead), *COMMENT.findall(tag.behind)]
        return [*found, *COMMENT.findall(tag.closing)]

    def remarks(self, tag: Tag) -> list[str]:
        """Return the comments of an element and of all inside it."""
        found = self.own_remarks(tag)
        for child in tag.children:
            found += self.remarks(child)
        return found

    # --- writing ------------------------------------------------------------------------------

    def written(self) -> str:
        """Return the text of the file."""
        if self.needs_prefix and not self.prefix:
            self.root.attributes[f"xmlns:{PREFIX}"] = EXTENSION
        tag = self.root
        return self.text[: tag.start] + self._element(tag, "", 0) + self.text[tag.end :]

    def is_clean(self, tag: Tag) -> bool:
        """Return whether an element and all inside it stay as they are."""
        if tag.old is None or tag.attributes or tag.above or tag.name != self._old_name(tag):
            return False
        return len(tag.children) == len(tag.loaded) and all(
            new is old and self.is_clean(new)
            for new, old in zip(tag.children, tag.loaded, strict=True)
        )

    def _old_name(self, tag: Tag) -> str:
        return re.split(r"[\s/>]", self.text[tag.start + 1 : tag.opened], maxsplit=1)[0]

    def margin(self, tag: Tag) -> int:
        """Return the column of an element of the file."""
        return tag.start - (self.text.rfind("\n", 0, tag.start) + 1)

    def _element(self, tag: Tag, pad: str, shift: int) -> str:
        """Return the text of an element at a margin; its lines moved by ``shift``."""
        if tag.old is None:
            if not tag.is_open:
                lines = tag.new.split("\n")
                written_text = "\n".join(
                    [lines[0], *(pad + line if line else line for line in lines[1:])]
                )
                return written_text.replace(TEXT_LINE, "\n")
            body = "".join(self._child(tag, child, pad + STEP) for child in tag.children)
            return f"{tag.new}{body}\n{pad}</{tag.name}>"
        if self.is_clean(tag):
            return self._moved(tag.start, tag.end, shift, tag)
        opening = self._opening(tag)
        is_empty = self.text.startswith("/>", tag.opened - 2) and tag.opened == tag.end
        if not tag.children:
            if is_empty:
                return opening
            if tag.loaded and not tag.closing.strip():
                return f"{opening[:-1].rstrip()}/>"
            if not tag.loaded:
                return (
                    opening
                    + self._moved(tag.opened, tag.end - len(self._old_name(tag)) - 3, shift, tag)
                    + f"</{tag.name}>"
                )
            return f"{opening}{_moved_lines(tag.closing, shift)}</{tag.name}>"
        if is_empty:
            opening = f"{opening[:-2].rstrip()}>"
        inner = self._inner(tag, pad, shift)
        body = "".join(self._child(tag, child, inner) for child in tag.children)
        closing = _moved_lines(tag.closing, shift)
        if not tag.loaded or "\n" not in closing:
            closing = f"{closing.rstrip()}\n{pad}" if "\n" in body else closing
        return f"{opening}{body}{closing}</{tag.name}>"

    def _inner(self, tag: Tag, pad: str, shift: int) -> str:
        """Return the margin of the children of an element."""
        for child in tag.loaded:
            if "\n" in child.lead:
                blanks = child.lead.rpartition("\n")[2]
                if not blanks.strip():
                    return (
                        blanks[: max(0, len(blanks) + shift)] if shift < 0 else blanks + " " * shift
                    )
        return pad + STEP

    def _child(self, parent: Tag, tag: Tag, pad: str) -> str:
        lead = tag.lead
        is_here = any(tag is one for one in parent.loaded)
        shift = 0
        if tag.old is not None:
            column = self.margin(tag)
            shift = len(pad) - column if not is_here or "\n" in lead else 0
        above = "".join(f"\n{pad}{remark}" for remark in tag.above)
        if not is_here:
            comments = "".join(f"\n{pad}{remark}" for remark in COMMENT.findall(lead))
            lead = f"{comments}{above}\n{pad}"
        elif above:
            head, _, last = _moved_lines(lead, shift).rpartition("\n")
            lead = f"{head}{above}\n{pad if not last.strip() else last}"
        else:
            lead = _moved_lines(lead, shift)
        return lead + self._element(tag, pad, shift) + tag.behind

    def _opening(self, tag: Tag) -> str:
        """Return the start tag, with changed attributes."""
        old = tag.old
        if old is None:
            raise TypeError("an element of the file")
        text = self.text
        edits: list[tuple[int, int, str]] = []
        last = tag.start + 1 + len(self._old_name(tag))
        given = dict(tag.attributes)
        for attribute in old.attributes:
            start = attribute.span.start
            end = attribute.value.span.end + 1
            if not attribute.value.value:
                end = (
                    text.find(text[attribute.value.span.start - 1], attribute.value.span.start) + 1
                )
            last = max(last, end)
            name = text[start : attribute.span.end]
            if name not in given:
                continue
            value = given.pop(name)
            if value is None:
                before = text[tag.start : start]
                edits.append((tag.start + len(before.rstrip()), end, ""))
            else:
                quote = text[end - 1]
                edits.append(
                    (
                        end - 1 - (end - 1 - attribute.value.span.start),
                        end - 1,
                        _escaped(value, quote),
                    )
                )
        for name, value in given.items():
            if value is not None:
                edits.append((last, last, f' {name}="{_escaped(value)}"'))
        written_text = text[tag.start : tag.opened]
        for start, end, new in sorted(edits, key=lambda e: (e[0], e[1]), reverse=True):
            written_text = written_text[: start - tag.start] + new + written_text[end - tag.start :]
        return f"<{tag.name}{written_text[1 + len(self._old_name(tag)) :]}"

    def _moved(self, start: int, end: int, shift: int, tag: Tag) -> str:
        """Return a part of the file with moved lines, except lines of texts and of values."""
        text = self.text[start:end]
        if not shift or "\n" not in text:
            return text
        fixed = list(_fixed(tag.old)) if tag.old is not None else []
        written_text: list[str] = []
        at = start
        for number, line in enumerate(text.split("\n")):
            is_fixed = any(first < at <= last for first, last in fixed)
            written_text.append(line if not number or is_fixed else _moved_line(line, shift))
            at += len(line) + 1
        return "\n".join(written_text)

    # --- new elements -------------------------------------------------------------------------

    def fragment(self) -> etree._Element:
        """Return an element with the prefixes of the file, in which new ones are built."""
        spaces: Any = {self.scxml or None: SCXML, self.prefix or PREFIX: EXTENSION}
        return etree.Element(f"{{{SCXML}}}scxml", nsmap=spaces)

    def serialized(self, element: etree._Element) -> str:
        """Return the text of a new element."""
        for inner in element.iter():
            if inner.text and inner.text.strip():
                inner.text = inner.text.replace("\n", TEXT_LINE)
        etree.indent(element, STEP)
        element.tail = None
        text = etree.tostring(element, encoding="unicode")
        head, close, rest = text.partition(">")
        text = NAMESPACE.sub("", head) + close + rest
        if re.search(rf"[<\s]{re.escape(self.prefix or PREFIX)}:", text):
            self.needs_prefix = True
        return text

    def tags(self, parent: etree._Element) -> list[Tag]:
        """Return the children of a fragment as new elements."""
        found: list[Tag] = []
        for child in parent:
            qualified = etree.QName(child)
            is_ours = qualified.namespace == EXTENSION
            word = f"{PREFIX}:{qualified.localname}" if is_ours else qualified.localname
            found.append(Tag(word, new=self.serialized(child)))
        return found

    def attribute(self, name: str) -> str:
        """Return the written name of an attribute, `fk:name` or `name`."""
        if not name.startswith(f"{PREFIX}:"):
            return name
        self.needs_prefix = True
        return f"{self.prefix or PREFIX}:{name.removeprefix(f'{PREFIX}:')}"

    def element_name(self, name: str) -> str:
        """Return the written name of an element of SCXML."""
        return f"{self.scxml}:{name}" if self.scxml else name

    def set(self, tag: Tag, name: str, value: str | None) -> None:
        """Set an attribute of an element of the file; None removes it."""
        old = tag.old
        if old is None:
            raise TypeError("an element of the file")
        is_ours = name.startswith(f"{PREFIX}:")
        local = name.removeprefix(f"{PREFIX}:")
        if old.namespace == EXTENSION:
            is_ours = False
        given = old.get(local, EXTENSION if is_ours else "")
        if value is None and given is None:
            return
        written = local if not is_ours else self.attribute(name)
        tag.attributes[written] = value


def _fixed(element: Element) -> Iterator[tuple[int, int]]:
    """Yield the ranges of texts and of values, in which white space may matter."""
    if element.text.value.strip():
        yield element.inner.start, element.inner.end
    for attribute in element.attributes:
        yield attribute.value.span.start, attribute.value.span.end
    for child in element.children:
        yield from _fixed(child)


def _moved_lines(text: str, shift: int) -> str:
    """Move all lines but the first."""
    if not shift or "\n" not in text:
        return text
    first, *rest = text.split("\n")
    return "\n".join(
        [
            first,
            *(_moved_line(line, shift, is_last=n == len(rest)) for n, line in enumerate(rest, 1)),
        ]
    )


def _moved_line(line: str, shift: int, *, is_last: bool = False) -> str:
    if not line and not is_last:
        return line
    if shift > 0:
        return " " * shift + line
    blanks = len(line) - len(line.lstrip(" "))
    return line[min(blanks, -shift) :]


def _escaped(value: str, quote: str = '"') -> str:
    text = "".join(ESCAPES.get(char, char) for char in value)
    return text.replace("&quot;", '"').replace("'", "&apos;") if quote == "'" else text
