"""Format SCXML files.

The order of elements has a meaning and is kept. Names, values, text, comments and entities are
copied from the file. White space between elements, within tags and in expressions changes, and the
order of some attributes.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field

from lxml import etree

from fsmkit.diagnostics import Findings, Source, fail
from fsmkit.editor.formatting.spacing import normalize_spaces, words_of
from fsmkit.scxml.nodes import read_nodes
from fsmkit.yaml.layout import STEP, WIDTH

TOKEN = re.compile(
    r"""(?P<comment><!--.*?-->)
    |(?P<text><!\[CDATA\[.*?\]\]>)
    |(?P<pi><\?.*?\?>)
    |(?P<doctype><!DOCTYPE(?:[^\[>"']|"[^"]*"|'[^']*'|\[(?:[^\]"']|"[^"]*"|'[^']*')*\])*>)
    |(?P<close></[^>]*>)
    |(?P<open><(?:[^>"']|"[^"]*"|'[^']*')*>)
    |(?P<blank>\s+(?=<|\Z))
    |(?P<chars>[^<]+)
    """,
    re.VERBOSE | re.DOTALL,
)
ATTRIBUTE = re.compile(r"""([^\s=]+)\s*=\s*("[^"]*"|'[^']*')""")
NAME = re.compile(r"<\s*([^\s/>]+)")
FIRST = ("version", "id", "name", "event", "fk:after", "fk:every", "cond", "target")
"""Attributes in this order before all others, which stay in theirs."""
EXPRESSIONS = frozenset({"cond", "location", "array", "fk:guard", "fk:cond", "fk:invariant"})
SIGNATURE = "signature"


@dataclass(slots=True)
class _Element:
    """An element, a comment or an instruction, and the white space before it."""

    kind: str
    raw: str
    start: int
    lines_before: int
    """Line ends in the white space before it."""
    end: int = 0
    attributes: list[tuple[str, str]] = field(default_factory=list)
    children: list[_Element] = field(default_factory=list)
    is_verbatim: bool = False
    """Whether it holds text: then all within its tags stays as it is."""
    body: tuple[int, int] = (0, 0)

    @property
    def name(self) -> str:
        """The name of the element, with its prefix."""
        match = NAME.match(self.raw)
        return "" if match is None else match[1]


def format_xml(text: str, name: str) -> str:
    """Return an SCXML file in its usual layout; XML of another kind as it is.

    Raises:
        FsmkitError: Where the text cannot be read; ``not-formatted`` where it cannot be laid out.

    """
    findings = Findings()
    read_nodes(Source(name, text), findings)
    findings.stop_on_errors()
    parts = _parsed(text)
    root = next((part for part in parts if part.kind == "open"), None)
    if root is None:
        return text
    attributes = dict(root.attributes)
    is_ours = attributes.get("datamodel", "").strip("\"'") == "fsmkit"
    lines: list[str] = []
    for part in parts:
        lines += _laid_out(part, "", text, is_code=is_ours, first=not lines)
    made = "\n".join(lines) + "\n"
    _require_same(text, made, name)
    return made


def _parsed(text: str) -> list[_Element]:
    """Return the top-level nodes of a well-formed document."""
    top: list[_Element] = []
    open_: list[_Element] = []
    lines_before = 0
    for match in TOKEN.finditer(text):
        kind, raw = match.lastgroup or "", match[0]
        if kind == "blank":
            lines_before = raw.count("\n")
            continue
        if kind == "close":
            element = open_.pop()
            element.end, element.body = match.end(), (element.body[0], match.start())
        elif kind in ("chars", "text"):
            for element in open_[-1:]:
                element.is_verbatim = True
        else:
            part = _Element(kind, raw, match.start(), lines_before, match.end())
            (open_[-1].children if open_ else top).append(part)
            if kind == "open":
                part.attributes = ATTRIBUTE.findall(raw[len(part.name) + 1 :])
                part.is_verbatim = any(key == "xml:space" for key, _ in part.attributes)
                part.body = (match.end(), match.end())
                if not raw.endswith("/>"):
                    open_.append(part)
        lines_before = 0
    return top


def _laid_out(
    part: _Element, margin: str, text: str, *, is_code: bool, first: bool
) -> Iterator[str]:
    """Yield the lines of a part; an empty one before it where the file has one."""
    if part.lines_before > 1 and not first:
        yield ""
    if part.kind == "comment":
        yield from _comment(part, margin, text)
        return
    if part.kind != "open":
        yield margin + part.raw
        return
    tag = _tag(part, margin, is_code=is_code)
    body = text[part.body[0] : part.body[1]]
    if part.is_verbatim:
        whole = "\n".join(tag) + ">" + body + f"</{part.name}>"
        yield from whole.split("\n")
    elif not part.children:
        yield from tag[:-1]
        yield tag[-1] + "/>"
    else:
        yield from tag[:-1]
        yield from _inside(part, tag[-1] + ">", margin, text, is_code=is_code)
        yield f"{margin}</{part.name}>"


def _inside(
    part: _Element, opening: str, margin: str, text: str, *, is_code: bool
) -> Iterator[str]:
    """Yield the end of the start tag and the children; a comment may end a line."""
    lines = [opening]
    for number, child in enumerate(part.children):
        if child.kind == "comment" and not child.lines_before and "\n" not in child.raw:
            lines[-1] += " " + child.raw
        else:
            lines += _laid_out(child, margin + STEP, text, is_code=is_code, first=not number)
    yield from lines


def _comment(part: _Element, margin: str, text: str) -> Iterator[str]:
    """Yield a comment; its further lines keep their distance from the first."""
    first, *rest = part.raw.split("\n")
    column = part.start - (text.rfind("\n", 0, part.start) + 1)
    shift = len(margin) - column
    yield margin + first
    for line in rest:
        if not line.strip():
            yield ""
        else:
            blanks = len(line) - len(line.lstrip(" "))
            yield " " * max(0, blanks + shift) + line.lstrip(" ")


def _tag(part: _Element, margin: str, *, is_code: bool) -> list[str]:
    """Return the lines of a start tag without its end: attributes fill lines."""
    rank = {name: n for n, name in enumerate(FIRST)}
    named = [one for one in part.attributes if one[0].startswith("xmlns")]
    others = [one for one in part.attributes if not one[0].startswith("xmlns")]
    others.sort(key=lambda one: rank.get(one[0], len(rank)))
    lines = [f"{margin}<{part.name}"]
    indent = " " * (len(lines[0]) + 1)
    for number, (name, value) in enumerate((*named, *others)):
        word = f"{name}={_value(name, value) if is_code else value}"
        if number and len(lines[-1]) + 1 + len(word) + 2 > WIDTH:
            lines.append(indent + word)
        else:
            lines[-1] += f" {word}"
    return lines


def _value(name: str, quoted: str) -> str:
    """Return a value in its quotes, with the white space of its kind."""
    quote, text = quoted[0], quoted[1:-1]
    if not _is_code(name) or "\n" in text or "&" in text or not text.strip():
        return quoted
    made = normalize_spaces(text.strip())
    if name == SIGNATURE:
        head, bracket, rest = text.partition("(")
        made = head.rstrip() + normalize_spaces(bracket + rest) if bracket else text
    return quote + made + quote if words_of(made) == words_of(text) else quoted


def _is_code(name: str) -> bool:
    return name in EXPRESSIONS or name.endswith("expr") or name == SIGNATURE


# --- the same before and after --------------------------------------------------------------------


def _require_same(before: str, after: str, name: str) -> None:
    old, new = _tree(before), _tree(after)
    if old is None or new is None or list(old) != list(new):
        raise fail(
            "not-formatted",
            f"`{name}` would have another meaning or lack a comment",
            help="this is a bug of fsmkit; the file is left as it is",
        )


def _tree(text: str) -> Iterator[tuple[object, ...]] | None:
    """Yield all nodes of a document, white space between them aside."""
    parser = etree.XMLParser(resolve_entities=False, no_network=True, huge_tree=True)
    try:
        root = etree.fromstring(text.encode("utf-8", "surrogatepass"), parser)
    except (etree.XMLSyntaxError, ValueError):
        return None
    return map(_node, root.getroottree().iter())


def _node(node: etree._Element) -> tuple[object, ...]:
    tag: object = node.tag  # of a comment it is a function
    if not isinstance(tag, str):
        return ("beside", "".join((node.text or "").split()), (node.tail or "").strip())
    attributes = {
        str(key): words_of(str(value)) if _is_code(str(key).rpartition("}")[2]) else value
        for key, value in node.attrib.items()
    }
    text = node.text or ""
    return (
        tag,
        attributes,
        text if text.strip() else "",
        (node.tail or "").strip(),
        len(node),
    )
