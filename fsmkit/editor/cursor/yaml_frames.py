"""The keys above a place in YAML that need not parse: by indentation, braces and dashes."""

from __future__ import annotations

import re
from dataclasses import dataclass, field

KEY = re.compile(
    r"""(?P<key>"(?:\\.|[^"\\])*"|'(?:''|[^'])*'|[^\s#'"{}\[\],&*!|>%@`-][^#{}\[\]]*?|-[^\s][^#{}\[\]:]*?)"""
    r"""\s*:(?=\s|$)"""
)
BLOCK = re.compile(r":\s+[|>][-+0-9]*\s*(?:#.*)?$")
DASH = re.compile(r"-(?:\s+|$)")
ITEM = "-"
"""The frame of an item of a list."""


@dataclass(frozen=True, slots=True)
class Frame:
    """An enclosing key or list item; ``siblings``: the keys beside it."""

    name: str
    siblings: frozenset[str] = frozenset()
    values: dict[str, str] = field(default_factory=dict, compare=False)
    """The values of one-line siblings."""


@dataclass(frozen=True, slots=True)
class Frames:
    """The position of a cursor: enclosing keys, whether it is in a key, and the text before it."""

    path: tuple[Frame, ...]
    text: str
    is_key: bool
    siblings: frozenset[str] = frozenset()
    values: dict[str, str] = field(default_factory=dict, compare=False)


@dataclass(frozen=True, slots=True)
class _Line:
    """A line: the columns of its dashes and of its key, and the key."""

    dashes: tuple[int, ...]
    column: int
    key: str | None
    rest: int
    """The column after the key and its colon; without a key, that of the text."""


def unquoted(key: str) -> str:
    """Return a key without its quotes."""
    return key[1:-1] if key[:1] in "\"'" and len(key) > 1 and key[-1] == key[0] else key


def _line(text: str) -> _Line:
    at = len(text) - len(text.lstrip(" "))
    dashes: list[int] = []
    while (match := DASH.match(text, at)) is not None:
        dashes.append(at)
        at = match.end()
    match = KEY.match(text, at)
    if match is None:
        return _Line(tuple(dashes), at, None, at)
    return _Line(tuple(dashes), at, unquoted(match["key"]), match.end())


def frames_at(text: str, offset: int) -> Frames:
    """Return the frames at an offset."""
    before = text[:offset].split("\n")
    after = text[offset:].split("\n")
    lines = [line.rstrip("\r") for line in before]
    current, number = lines[-1], len(lines) - 1
    block = _block(lines)
    if block is not None:
        line = _line(lines[block])
        path = _above(lines, block, line, after)
        own = Frame(line.key or "", *_beside(lines, block, line.column, after))
        return Frames((*path, own), "\n".join(lines[block + 1 :]), is_key=False)
    start = _flow(lines)
    if start is not None:
        return _in_flow(lines, start, after)
    line = _line(current)
    if line.key is not None and len(current) >= line.rest:
        path = _above(lines, number, line, after)
        siblings, values = _beside(lines, number, line.column, after)
        return Frames(
            (*path, Frame(line.key, siblings, values)),
            current[line.rest :].lstrip(),
            is_key=False,
        )
    written = current[line.column :]
    if not written and not line.dashes:
        line = _Line((), len(current), None, len(current))
    path = _above(lines, number, line, after)
    siblings, values = _beside(lines, number, line.column, after)
    return Frames(path, written.strip(), is_key=True, siblings=siblings, values=values)


def _block(lines: list[str]) -> int | None:
    """Return the line whose key has the block scalar in which the last line is."""
    current = lines[-1]
    indent = len(current) - len(current.lstrip(" "))
    if current.strip() == "":
        indent = len(current)
    for number in range(len(lines) - 2, -1, -1):
        line = lines[number]
        if not line.strip():
            continue
        found = _line(line)
        own = len(line) - len(line.lstrip(" "))
        if BLOCK.search(line) and found.key is not None and found.column < max(indent, 1):
            return number if indent > found.column else None
        if own < indent:
            indent = own
        if own == 0:
            return None
    return None


def _above(lines: list[str], number: int, line: _Line, after: list[str]) -> tuple[Frame, ...]:
    """Return the frames that hold a line, the outermost first."""
    found: list[Frame] = []
    limit = line.column
    for dash in reversed(line.dashes):
        found.append(Frame(ITEM))
        limit = dash + 1
        is_item = dash
    is_item = line.dashes[0] if line.dashes else -1
    for above in range(number - 1, -1, -1):
        text = lines[above]
        if not text.strip() or text.lstrip().startswith("#"):
            continue
        other = _line(text)
        if 0 <= is_item <= (other.dashes[0] if other.dashes else -1):
            continue
        if (
            other.key is not None
            and other.column < limit
            and not (is_item >= 0 and other.dashes and other.dashes[-1] == is_item)
        ):
            siblings, values = _beside(lines, above, other.column, after)
            found.append(Frame(other.key, siblings, values))
            limit, is_item = other.column, -1
        for dash in reversed(other.dashes):
            if dash < limit and dash != is_item:
                found.append(Frame(ITEM))
                limit, is_item = dash + 1, dash
        if limit <= 0:
            break
    return tuple(reversed(found))


def _beside(
    lines: list[str], number: int, column: int, after: list[str]
) -> tuple[frozenset[str], dict[str, str]]:
    """Return the keys of the mapping that has a key at a column of a line, with short values."""
    found: dict[str, str] = {}

    def take(text: str) -> bool:
        """Take a line; False where the mapping ends."""
        if not text.strip() or text.lstrip().startswith("#"):
            return True
        line = _line(text)
        first = line.dashes[0] if line.dashes else line.column
        if line.key is not None and line.column == column:
            found[line.key] = text[line.rest :].strip()
            return not line.dashes
        return first >= column or line.column > column

    for above in range(number - 1, -1, -1):
        if _line(lines[number]).dashes and above == number - 1:
            break
        if not take(lines[above]):
            break
    whole = [*lines[number + 1 :], *after[1:]]
    for text in whole:
        if _line(text).dashes and _line(text).dashes[0] < column:
            break
        if not take(text):
            break
    return frozenset(found), found


# --- flow style -----------------------------------------------------------------------------------


def _flow(lines: list[str]) -> tuple[int, int] | None:
    """Return the line and column of the bracket in which the last line is."""
    for number in range(len(lines) - 1, max(-1, len(lines) - 40), -1):
        text = lines[number]
        line = _line(text)
        if number < len(lines) - 1 and line.key is None and not line.dashes:
            continue
        value = text[line.rest :]
        start = line.rest + len(value) - len(value.lstrip())
        if text[start : start + 1] in ("{", "["):
            left = "\n".join([text[start:], *lines[number + 1 :]])
            return (number, start) if _is_open(left) else None
        if line.key is not None or line.dashes:
            return None
    return None


def _is_open(text: str) -> bool:
    depth, quote = 0, ""
    for char in text:
        if quote:
            quote = "" if char == quote else quote
        elif char in "\"'":
            quote = char
        elif char in "{[":
            depth += 1
        elif char in "}]":
            depth -= 1
            if depth == 0:
                return False
    return depth > 0


@dataclass(slots=True)
class _Open:
    """An open bracket of flow style, with its content so far."""

    is_mapping: bool
    keys: dict[str, str] = field(default_factory=dict)
    key: str | None = None
    text: str = ""

    def end(self) -> None:
        if self.key is not None:
            self.keys[self.key] = self.text.strip()
        elif self.is_mapping and self.text.strip():
            self.keys[self.text.strip()] = ""
        self.key, self.text = None, ""


def _in_flow(lines: list[str], start: tuple[int, int], after: list[str]) -> Frames:
    number, column = start
    line = _line(lines[number])
    path = list(_above(lines, number, line, after))
    if line.key is not None:
        path.append(Frame(line.key, *_beside(lines, number, line.column, after)))
    written = "\n".join([lines[number][column:], *lines[number + 1 :]])
    stack: list[_Open] = []
    quote = ""
    for place, char in enumerate(written):
        top = stack[-1] if stack else None
        if quote:
            quote = "" if char == quote else quote
            if top is not None:
                top.text += char
        elif char in "\"'" and top is not None and not top.text.strip():
            quote = char
            top.text += char
        elif char in "{[" and (top is None or not top.text.strip()):
            stack.append(_Open(char == "{"))
        elif char in "}]" and stack:
            stack.pop()
            if stack:
                stack[-1].text += "…"
        elif top is None:
            continue
        elif char == ",":
            top.end()
        elif (
            char == ":"
            and top.is_mapping
            and top.key is None
            and (written[place + 1 : place + 2] in ("", " ", "\n"))
        ):
            top.key, top.text = unquoted(top.text.strip()), ""
        else:
            top.text += char
    if not stack:
        return Frames(tuple(path), "", is_key=False)
    for each in stack[:-1]:
        path += _frames_of(each)
    top = stack[-1]
    rest = _rest_of_flow(after)
    if top.is_mapping and top.key is None:
        keys = {**top.keys, **rest}
        return Frames(tuple(path), top.text.strip(), True, frozenset(keys), keys)
    own = Frame(top.key, frozenset(top.keys), {**top.keys, **rest}) if top.key is not None else None
    frames = (*path, own) if own is not None else (*path, Frame(ITEM))
    return Frames(frames, top.text.lstrip(), is_key=False)


def _frames_of(open_: _Open) -> list[Frame]:
    if not open_.is_mapping:
        return [Frame(ITEM)]
    return [Frame(open_.key or "", frozenset(open_.keys), dict(open_.keys))]


def _rest_of_flow(after: list[str]) -> dict[str, str]:
    """Return the keys that follow on the line in the same braces, roughly."""
    text = after[0].split("}")[0]
    found = re.findall(r"(?:^|,)\s*([A-Za-z_]\w*)\s*:\s*([^,]*)", text)
    return {key: value.strip() for key, value in found}
