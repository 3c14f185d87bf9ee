"""Lists, mappings and texts as lines of YAML: in flow style or blocks, quoted where needed."""

from __future__ import annotations

import json
import re
import textwrap
from collections.abc import Iterator
from dataclasses import dataclass

WIDTH = 100
STEP = "  "
LONGEST_KEY = 1000
"""Characters of a line that are a key without `?` in front: 1,024 at most (YAML 1.2, 7.4.2)."""


@dataclass(frozen=True, slots=True)
class Prose:
    """A description: long lines may be wrapped, and it may end in a new line."""

    text: str


@dataclass(frozen=True, slots=True)
class Short:
    """A list or mapping in flow style if its line has at most ``width`` characters."""

    value: dict[str, Tree] | list[Tree]
    width: int = WIDTH


Tree = str | Prose | Short | dict[str, "Tree"] | list["Tree"]


def render(tree: dict[str, Tree]) -> str:
    """Return a mapping as YAML, its larger parts set apart by blank lines."""
    text = ""
    was_large = False
    for key, value in tree.items():
        part = "\n".join(entry_lines(key, value, ""))
        is_large = "\n" in part and not isinstance(value, Prose)
        text += ("\n" if text and (was_large or is_large) else "") + part + "\n"
        was_large = is_large
    return text


def entry_lines(key: str, value: Tree, margin: str) -> Iterator[str]:
    """Yield the lines of an entry of a mapping, in a block at a margin."""
    head = f"{margin}{scalar(key)}:"
    if len(head) > LONGEST_KEY:
        yield f"{margin}? {scalar(key)}"
        head = f"{margin}:"
    flow = _flow(value) if isinstance(value, Short) else None
    if isinstance(value, Short) and flow is not None and len(head) + 1 + len(flow) <= value.width:
        yield f"{head} {flow}"
        return
    bare = value.value if isinstance(value, Short) else value
    if isinstance(bare, dict | list):
        if not bare:
            yield f"{head} {'{}' if isinstance(bare, dict) else '[]'}"
            return
        yield head
        yield from _lines(bare, margin + STEP)
    else:
        first, *rest = text_lines(bare, margin + STEP, len(head) + 1)
        yield f"{head} {first}" if first else head
        yield from rest


def item_lines(item: Tree, margin: str) -> Iterator[str]:
    """Yield the lines of an item of a list, in a block at a margin."""
    return _lines([item], margin)


def _lines(tree: dict[str, Tree] | list[Tree], margin: str) -> Iterator[str]:
    if isinstance(tree, dict):
        for key, value in tree.items():
            yield from entry_lines(key, value, margin)
        return
    for item in tree:
        flow = _flow(item) if isinstance(item, Short) else None
        bare = item.value if isinstance(item, Short) else item
        if (
            flow is not None
            and isinstance(item, Short)
            and len(margin) + 2 + len(flow) <= item.width
        ):
            yield f"{margin}- {flow}"
        elif isinstance(bare, dict | list):
            lines = list(_lines(bare, margin + STEP))
            empty = "{}" if isinstance(bare, dict) else "[]"
            opening = lines[0].removeprefix(margin + STEP) if lines else empty
            yield f"{margin}- {opening}"
            yield from lines[1:]
        else:
            first, *rest = text_lines(bare, margin + STEP, len(margin) + 2)
            yield f"{margin}- {first}"
            yield from rest


def text_lines(value: str | Prose, margin: str, column: int) -> list[str]:
    """Return a text as the rest of a line, or as a block on the lines that follow."""
    text = value if isinstance(value, str) else value.text
    if not text:
        return ['""']
    if "\n" in text:
        text += "\n" if isinstance(value, Prose) else ""
        return _literal(text, margin) or [quoted(text)]
    if isinstance(value, Prose) and column + len(text) > WIDTH:
        return _folded(text, margin) or [scalar(text)]
    return [scalar(text)]


def _literal(text: str, margin: str) -> list[str] | None:
    """Return a text of several lines as a block, if it can be one (YAML 1.2, 8.1)."""
    body, lines = text.removesuffix("\n"), text.removesuffix("\n").split("\n")
    if not lines[0] or lines[0][0].isspace() or body.endswith("\n") or not lines[-1].strip():
        return None
    if any(UNPRINTABLE.search(line) for line in lines):
        return None
    head = "|" if text.endswith("\n") else "|-"
    return [head, *(margin + line if line else "" for line in lines)]


def _folded(text: str, margin: str) -> list[str] | None:
    lines = textwrap.wrap(text, WIDTH - len(margin), break_long_words=False, break_on_hyphens=False)
    if " ".join(lines) != text or UNPRINTABLE.search(text):
        return None
    return [">-", *(margin + line for line in lines)]


def _flow(tree: Tree) -> str | None:
    """Return a tree in flow style, or None where a text in it needs quotes there."""
    match tree:
        case str():
            return tree if is_plain(tree, in_flow=True) else None
        case Prose(text):
            return text if is_plain(text, in_flow=True) else None
        case Short(value):
            return _flow(value)
        case dict():
            pairs = [(_flow(key), _flow(value)) for key, value in tree.items()]
            if any(key is None or value is None for key, value in pairs):
                return None
            return f"{{{', '.join(f'{key}: {value}' for key, value in pairs)}}}"
        case list():
            items = [_flow(item) for item in tree]
            return None if None in items else f"[{', '.join(i for i in items if i is not None)}]"


INDICATORS = "!&*\"'[]{}|>%@`#,"
"""No plain text starts with one of these (YAML 1.2, 5.3)."""
UNPRINTABLE = re.compile(
    r"[^\x20-\x7e\xa0-\u2027\u202a-\ud7ff\ue000-\ufefe\uff00-\ufffd\U00010000-\U0010ffff]"
)
SPLIT = re.compile(r": | #|:$|^[-?:]( |$)|^\s|\s$|^(---|\.\.\.)|^$")
FLOW_SPLIT = re.compile(r"[,?\[\]{}]|^[-:]|:[,\[\]{}]")


def is_plain(text: str, *, in_flow: bool = False) -> bool:
    """Return whether a text reads back unchanged without quotes, in flow style or outside it."""
    return not (
        UNPRINTABLE.search(text)
        or text[:1] in INDICATORS
        or SPLIT.search(text)
        or text in ("<<", "=")
        or (in_flow and FLOW_SPLIT.search(text))
    )


def scalar(text: str, *, in_flow: bool = False) -> str:
    """Return a text as a scalar of one line, quoted only where it must be."""
    return text if is_plain(text, in_flow=in_flow) else quoted(text)


def quoted(text: str) -> str:
    """Return a quoted text, in single quotes where that saves escapes."""
    if UNPRINTABLE.search(text):
        # JSON is a subset of YAML, except that it writes astral characters as surrogates
        return UNPRINTABLE.sub(_escaped, json.dumps(text, ensure_ascii=False))
    if '"' in text or "\\" in text:
        return "'" + text.replace("'", "''") + "'"
    return f'"{text}"'


def _escaped(match: re.Match[str]) -> str:
    code = ord(match[0])
    return f"\\u{code:04x}" if code < 0x10000 else f"\\U{code:08x}"
