"""Fixes that findings carry: edits of the source, with a title.

The stage that reports a finding also builds its fix. The functions here know the layout of YAML
entries and of XML attributes and elements, so they can add, remove and replace them.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from fsmkit.diagnostics.source import Source, Span, Text

OPENING, CLOSING = "{[(", "}])"
KEY = re.compile(r"""(?:"[^"]*"|'[^']*'|[^\s{}\[\],:#][^{}\[\],:#]*?)\s*:(?=\s|$)""")
TAG = re.compile(r"</?([\w:.-]+)(?:[^>\"']|\"[^\"]*\"|'[^']*')*?(/?)>", re.DOTALL)
ATTRIBUTE = re.compile(r"\s+[\w:.-]+\s*=\s*(?:\"[^\"]*\"|'[^']*')")


@dataclass(frozen=True, slots=True)
class Edit:
    """A replacement of the source at a location. An empty location inserts."""

    span: Span
    text: str


@dataclass(frozen=True, slots=True)
class Fix:
    """A fix of a finding. `check --fix` applies it if ``is_sure``."""

    title: str
    edits: tuple[Edit, ...]
    is_sure: bool = False


def span_of(at: Span | Text) -> Span:
    """Return the location of a text, or the location itself."""
    return at.span if isinstance(at, Text) else at


def _escape_xml(text: str) -> str:
    """Escape a string for XML. `xml.sax.saxutils` would import half of the standard library."""
    for char, entity in (("&", "&amp;"), ("<", "&lt;"), (">", "&gt;"), ('"', "&quot;")):
        text = text.replace(char, entity)
    return text


def is_xml(source: Source) -> bool:
    """Return whether a source is XML, by its first character."""
    return source.text.lstrip()[:1] == "<"


def apply_edits(text: str, edits: Iterable[Edit]) -> str:
    """Apply edits to a string; an edit that overlaps an earlier one is skipped."""
    end = len(text)
    for edit in sorted(set(edits), key=lambda e: (-e.span.start, -e.span.end)):
        if edit.span.end <= end:
            text = text[: edit.span.start] + edit.text + text[edit.span.end :]
            end = edit.span.start
    return text


def replace_text(at: Span | Text, text: str, *, sure: bool = False) -> tuple[Fix, ...]:
    """Return the fix that replaces the source at a location by `text`."""
    span = span_of(at)
    written = _escape_xml(text) if is_xml(span.source) else text
    title = f"Write `{text}`" if text else "Remove it"
    return (Fix(title, (Edit(span, written),), sure),)


def replace_wrong_name(name: str, at: Span | Text, wrong: str) -> tuple[Fix, ...]:
    """Return the fix that replaces the name `wrong` by `name`."""
    span = span_of(at)
    written = span.source.text[span.start : span.end]
    places = [m.span() for m in re.finditer(rf"(?<![\w.]){re.escape(wrong)}(?!\w)", written)]
    if written == wrong:
        places = [(0, len(written))]
    if len(places) != 1:
        return ()
    start, end = places[0]
    here = Span(span.source, span.start + start, span.start + end)
    return (Fix(f"Write `{name}`", (Edit(here, name),)),)


# --- removing -------------------------------------------------------------------------------------


def remove_entry(at: Span | Text, *, whole: bool = False) -> tuple[Fix, ...]:
    """Return the fix that removes the entry, attribute or element at a location.

    ``whole``: the location is a name (in XML within an attribute), and the whole element is
    removed.
    """
    span = span_of(at)
    found = _in_xml(span, whole=whole) if is_xml(span.source) else _in_yaml(span)
    return () if found is None else (Fix("Remove it", (Edit(found, ""),)),)


def _in_xml(span: Span, *, whole: bool) -> Span | None:
    text = span.source.text
    start = text.rfind("<", 0, span.start + 1)
    tag = TAG.match(text, start) if start >= 0 else None
    if tag is None or tag.end() < span.start:
        return None
    for attribute in ATTRIBUTE.finditer(text, tag.start(), tag.end()):
        if not whole and attribute.start() < span.start < attribute.end():
            return Span(span.source, attribute.start(), attribute.end())
    end = tag.end() if tag[2] else _end_of_element(text, tag)
    if end is None:
        return None
    line = text.rfind("\n", 0, start) + 1
    after = text.find("\n", end)
    after = len(text) if after < 0 else after + 1
    if not text[line:start].strip() and not text[end:after].strip():
        return Span(span.source, line, after)
    return Span(span.source, start, end)


def _end_of_element(text: str, opening: re.Match[str]) -> int | None:
    depth = 0
    for tag in TAG.finditer(text, opening.start()):
        if tag[0].startswith("</"):
            depth -= 1
        elif not tag[2]:
            depth += 1
        if depth == 0:
            return tag.end()
    return None


def _in_yaml(span: Span) -> Span | None:
    source, text = span.source, span.source.text
    flow = _in_brackets(text, span.start)
    if flow is not None:
        return Span(source, *flow)
    line = text.rfind("\n", 0, span.start) + 1
    end = text.find("\n", span.start)
    end = len(text) if end < 0 else end
    written = text[line:end]
    indent = len(written) - len(written.lstrip(" "))
    dash = re.match(r" *((?:- +)+)", written)
    column = indent if dash is None else dash.end()
    is_key = KEY.match(text, line + column) is not None
    after = _end_of_block(text, end, column if is_key else indent)
    following = re.match(rf" {{{column}}}(?=\S)", text[after:])
    if dash is not None and is_key and following is not None:
        return Span(source, line + column, after + column)
    return Span(source, line, after)


def _end_of_block(text: str, end: int, indent: int) -> int:
    """Return the end of the lines that belong to an entry: those indented further than `indent`."""
    at = end + 1
    while at < len(text):
        stop = text.find("\n", at)
        stop = len(text) if stop < 0 else stop
        line = text[at:stop]
        if line.strip() and len(line) - len(line.lstrip(" ")) <= indent:
            return at
        if not line.strip():
            rest = text[stop:].lstrip("\n")
            if not rest.startswith(" " * (indent + 1)):
                return at
        at = stop + 1
    return len(text)


def _in_brackets(text: str, place: int) -> tuple[int, int] | None:
    """Return the item of an inline list around an offset, with one comma, as a range of offsets."""
    line = text.rfind("\n", 0, place) + 1
    depth, start = 0, place
    while start > line:
        char = text[start - 1]
        if char in CLOSING:
            depth += 1
        elif char in OPENING:
            if depth == 0:
                break
            depth -= 1
        elif char == "," and depth == 0 and _is_open(text[line:start]):
            break
        start -= 1
    if start == line:
        return None
    depth, end = 0, place
    while end < len(text):
        char = text[end]
        if char in OPENING:
            depth += 1
        elif char in CLOSING:
            if depth == 0:
                break
            depth -= 1
        elif char == "," and depth == 0:
            break
        end += 1
    if text[end : end + 1] == ",":
        end += 1
        while text[start : start + 1] == " ":
            start += 1
        while text[end : end + 1] == " ":
            end += 1
    elif text[start - 1] == ",":
        start -= 1
    return start, end


def _is_open(text: str) -> bool:
    return sum(text.count(c) for c in OPENING) > sum(text.count(c) for c in CLOSING)


# --- adding ---------------------------------------------------------------------------------------


def add_attribute(at: Span | Text, name: str, value: str, *, sure: bool = False) -> tuple[Fix, ...]:
    """Return the fix that adds an attribute to the element at a location."""
    span = span_of(at)
    text = span.source.text
    match = re.compile(r"<[\w:.-]+").match(text, max(0, text.rfind("<", 0, span.start + 1)))
    if match is None:
        return ()
    here = Span(span.source, match.end(), match.end())
    written = f' {name}="{_escape_xml(value)}"'
    return (Fix(f'Add `{name}="{value}"`', (Edit(here, written),), sure),)


def add_key(at: Span | Text, key: str, value: str, keys: Iterable[str] = ()) -> tuple[Fix, ...]:
    """Return the fix that adds a key to an entry.

    Args:
        at: The location of the entry: its name, or its first line.
        key: The new key; in XML the attribute ``fk:key``.
        value: Its value.
        keys: Keys that an entry without a name may start with.

    """
    span = span_of(at)
    text = span.source.text
    if is_xml(span.source):
        bare = value.strip("[]").replace(",", "")
        is_ours = text.startswith("<fk:", max(0, text.rfind("<", 0, span.start + 1)))
        return add_attribute(span, key if is_ours else f"fk:{key}", bare)
    added = _key_insertion(text, span.start, f"{key}: {value}", frozenset(keys))
    if added is None:
        return ()
    place, written = added
    edit = Edit(Span(span.source, *place), written)
    return (Fix(f"Add `{key}: {value}`", (edit,)),)


def _key_insertion(
    text: str, start: int, written: str, keys: frozenset[str]
) -> tuple[tuple[int, int], str] | None:
    """Return where to insert one more key of the entry at `start`, and the insertion."""
    if text[start : start + 1] == "{":
        return (start + 1, start + 1), f"{written}, "
    end = text.find("\n", start)
    end = len(text) if end < 0 else end
    match = KEY.match(text, start)
    if match is None or match.end() > end:
        return None
    name = match[0].rstrip()[:-1].strip()
    if name in keys:
        column = start - (text.rfind("\n", 0, start) + 1)
        return (start, start), f"{written}\n{' ' * column}"
    rest = text[match.end() : end]
    value = match.end() + len(rest) - len(rest.lstrip())
    bare = rest.partition(" #")[0].strip()
    if bare.startswith("{"):
        return (value + 1, value + 1), f"{written}, " if bare != "{}" else written
    if not bare:
        line = text.rfind("\n", 0, start) + 1
        column = start - line
        below = re.match(r"\n(?:\s*(?:#.*)?\n)*( *)\S", text[end:])
        inner = len(below[1]) if below is not None else 0
        if below is not None and text[end + below.end() - 1] == "-":
            return None
        return (end, end), f"\n{' ' * (inner if inner > column else column + 2)}{written}"
    if re.fullmatch(r"[\w. -]+", bare):
        return (value, value + len(bare)), f"{{target: {bare}, {written}}}"
    return None


def add_line(source: Source, line: str, title: str) -> tuple[Fix, ...]:
    """Return the fix that adds a line after the first key of a YAML source."""
    match = re.search(r"^[A-Za-z_]\w*\s*:.*$", source.text, re.MULTILINE)
    at = 0 if match is None else match.end()
    written = f"{line}\n" if match is None else f"\n{line}"
    return (Fix(title, (Edit(Span(source, at, at), written),)),)


def set_chart_key(source: Source, key: str, value: str) -> tuple[Fix, ...]:
    """Return the fix that sets a key of a chart."""
    text = source.text
    if is_xml(source):
        root = re.search(r"<(?:\w+:)?scxml\b(?:[^>\"']|\"[^\"]*\"|'[^']*')*>", text)
        if root is None:
            return ()
        name = key if key == "datamodel" else f"fk:{key}"
        known = re.compile(rf"\s{name}\s*=\s*[\"']([^\"']*)").search(text, *root.span())
        if known is not None:
            return replace_text(Span(source, *known.span(1)), value)
        return add_attribute(Span(source, *root.span()), name, value)
    known = re.search(rf"^{key}:[ \t]*([^\s#]+)", text, re.MULTILINE)
    if known is not None:
        return replace_text(Span(source, *known.span(1)), value)
    return add_line(source, f"{key}: {value}", f"Add `{key}: {value}`")


def add_nested_items(
    source: Source, outer: str, inner: str, items: Sequence[str]
) -> tuple[Edit, ...]:
    """Return the edit that adds items to a list under two nested keys of a YAML source."""
    text = source.text
    section = re.search(rf"^{outer}:[ \t]*(.*)$", text, re.MULTILINE)
    joined = ", ".join(items)
    if section is None:
        newline = "" if text.endswith("\n") else "\n"
        end = Span(source, len(text), len(text))
        return (Edit(end, f"{newline}\n{outer}: {{{inner}: [{joined}]}}\n"),)
    last = _end_of_block(text, text.find("\n", section.start()) % (len(text) + 1), 0)
    found = re.compile(rf"\b{inner}:[ \t]*(\[[ \t]*)?").search(text, section.start(), last)
    if found is not None and found[1]:
        more = "" if text[found.end() : found.end() + 1] == "]" else ", "
        return (Edit(Span(source, found.end(), found.end()), joined + more),)
    if found is not None:
        item = re.compile(r"\n( *)- ").match(text, text.find("\n", found.start()))
        if item is None:
            return ()
        at = text.find("\n", found.start())
        lines = "".join(f"\n{item[1]}- {one}" for one in items)
        return (Edit(Span(source, at, at), lines),)
    if section[1].startswith("{"):
        at = section.start(1) + 1
        more = "" if section[1].startswith("{}") else ", "
        return (Edit(Span(source, at, at), f"{inner}: [{joined}]{more}"),)
    at = section.end()
    return (Edit(Span(source, at, at), f"\n  {inner}: [{joined}]"),)


def add_list_item(source: Source, key: str, item: str) -> tuple[Edit, ...]:
    """Return the edit that adds an item to a list under a top-level key of a YAML source."""
    text = source.text
    found = re.search(rf"^{key}:[ \t]*(\[[ \t]*)?", text, re.MULTILINE)
    if found is None:
        newline = "" if text.endswith("\n") else "\n"
        last = Span(source, len(text), len(text))
        return (Edit(last, f"{newline}\n{key}:\n  - {item}\n"),)
    if found[1]:
        more = "" if text[found.end() : found.end() + 1] == "]" else ", "
        return (Edit(Span(source, found.end(), found.end()), f'"{item}"{more}'),)
    first = re.compile(r"[^\n]*\n(?:[ \t]*(?:#[^\n]*)?\n)*( *)- ").match(text, found.end())
    end = text.find("\n", found.end()) % (len(text) + 1)
    indent = "  " if first is None else first[1]
    return (Edit(Span(source, end, end), f"\n{indent}- {item}"),)
