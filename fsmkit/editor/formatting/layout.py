"""A concrete tree as lines: keys in order, flow style where it fits, comments in their places."""

from __future__ import annotations

from collections.abc import Iterator

from fsmkit.editor.formatting.concrete import HEADER, Block, Entry, Node, Scalar
from fsmkit.editor.formatting.shapes import SHAPES, Shape
from fsmkit.editor.formatting.shapes import Scalar as Kind
from fsmkit.editor.formatting.spacing import normalize_spaces, words_of
from fsmkit.yaml.layout import LONGEST_KEY, STEP, WIDTH, is_plain, quoted, scalar

AT_THE_TOP = ("# yaml-language-server:", "# fsmkit: allow-file", "# vim:", "# -*-", "#!")
"""Comments that always belong to the file."""


def lay_out(root: Block, shape: Shape) -> list[str]:
    """Return the lines of a file: one blank line between its larger parts."""
    lines = _head(root)
    was_large = False
    for number, entry in enumerate(_ordered(root, shape)):
        part, part_shape = _entry(entry, _below(shape, entry), ""), _below(shape, entry)
        is_large = len(part) > 1 and part_shape.text is not Kind.PROSE
        wanted = was_large or is_large or entry.blank
        if lines and lines[-1] and (wanted if number else entry.blank):
            lines.append("")
        lines += part
        was_large = is_large
    return [*lines, *_comments(root.tail, "")]


def _head(root: Block) -> list[str]:
    """Take the comments of the file from its first entry; return them and a blank line."""
    first = root.entries[0]
    above = first.above
    size = next((n for n in range(len(above), 0, -1) if above[n - 1] == ""), 0)
    size = max([size, *(n + 1 for n, line in enumerate(above) if line.startswith(AT_THE_TOP))])
    first.above = above[size:]
    first.blank = bool(first.blank and first.above and not size)
    if size and above[size - 1] == "":
        first.blank = True
    head = above[:size]
    return head[:-1] if head and not head[-1] else head


def _below(shape: Shape, entry: Entry) -> Shape:
    """Return the part that an entry is."""
    if entry.key is None:
        return SHAPES[shape.items] if shape.items else shape
    return SHAPES[shape.keys.get(entry.key.value, shape.each)]


def _ordered(block: Block, shape: Shape) -> list[Entry]:
    """Return the entries in the order of the keys.

    An unknown key stays behind its predecessor. Keys whose order matters stay together at the
    position of the first.
    """
    if not block.is_mapping or not shape.order:
        return block.entries
    places = {key: n for n, key in enumerate(shape.order)}
    group = min((places[key] for key in shape.ordered if key in places), default=0)
    ranked: list[tuple[int, int, Entry]] = []
    rank = -1
    for number, entry in enumerate(block.entries):
        name = "" if entry.key is None else entry.key.value
        rank = group if name in shape.ordered else places.get(name, rank)
        ranked.append((rank, number, entry))
    return [entry for _, _, entry in sorted(ranked, key=lambda one: one[:2])]


# --- blocks ---------------------------------------------------------------------------------------


def _block(block: Block, shape: Shape, margin: str) -> list[str]:
    lines: list[str] = []
    for number, entry in enumerate(_ordered(block, shape)):
        if number and entry.blank and lines[-1]:
            lines.append("")
        lines += _entry(entry, _below(shape, entry), margin)
    return [*lines, *_comments(block.tail, margin)]


def _comments(remarks: list[str], margin: str) -> Iterator[str]:
    for remark in remarks:
        yield margin + remark if remark else ""


def _entry(entry: Entry, shape: Shape, margin: str) -> list[str]:
    behind, above = list(entry.behind), list(entry.above)
    node = entry.node
    head = f"{margin}-" if entry.key is None else f"{margin}{_key(entry.key)}:"
    lines: list[str] = []
    rest: list[str] = []
    if entry.key is not None and len(head) > LONGEST_KEY:
        lines, head = [f"{margin}? {_key(entry.key)}"], f"{margin}:"
    flow = _flow(node, shape) if isinstance(node, Block) else None
    if flow is not None and len(head) + 1 + len(flow) <= WIDTH:
        first = f"{head} {flow}"
    elif isinstance(node, Block) and not node.entries:
        behind += node.opening
        above += [line.strip() for line in node.tail]
        first = f"{head} {'{}' if node.is_mapping else '[]'}"
    elif isinstance(node, Block):
        behind += node.opening
        inner = node.entries if not node.is_mapping else _ordered(node, shape)
        if entry.key is None:
            above += [line.strip() for line in behind]
            behind = []
            above += inner[0].above
            inner[0].above = []
            rest = _block(node, shape, margin + STEP)
            first = f"{head} {rest.pop(0)[len(margin + STEP) :]}"
        else:
            first, rest = head, _block(node, shape, margin + STEP)
    else:
        text, *rest = _text(node, shape, margin + STEP)
        first = f"{head} {text}" if text else head
    above += [line.strip() for line in behind[1:]]
    if behind and rest and isinstance(node, Scalar) and text[:1] not in ("|", ">"):
        rest[-1] += behind[0]  # a multi-line scalar cannot contain comments
    elif behind:
        first += behind[0]
    return [*_comments(above, margin), *lines, first, *rest]


def _key(key: Scalar) -> str:
    """Return a key on one line."""
    if "\n" in key.raw or key.style in ("|", ">"):
        return quoted(key.value)
    return key.raw


# --- texts ----------------------------------------------------------------------------------------


def _text(one: Scalar, shape: Shape, margin: str) -> list[str]:
    """Return a text: the rest of its line, and the lines below it."""
    if one.style in ("|", ">"):
        return _literal(one, shape, margin)
    first, *rest = _line(one, shape).split("\n")
    return [first.rstrip() if rest else first, *(_continued(line, margin) for line in rest)]


def _continued(line: str, margin: str) -> str:
    """Return a line of a folded scalar, whose surrounding white space is insignificant."""
    return margin + line.lstrip() if line.strip() else ""


def _line(one: Scalar, shape: Shape) -> str:
    """Return a scalar on one line, with the white space of its kind."""
    if "\n" in one.raw:
        return one.raw
    changed = _spaced(one.value, shape.text)
    if changed == one.value:
        return one.raw
    if not one.style:
        return scalar(changed, in_flow=one.in_flow)
    if one.raw == one.style + one.value + one.style and one.style not in changed:
        return one.style + changed + one.style
    return one.raw


def _spaced(text: str, kind: Kind) -> str:
    """Return a text with the white space of its kind; as it is where its tokens would change."""
    made = text
    if kind is Kind.CODE:
        made = normalize_spaces(text)
    elif kind is Kind.SIGNATURE:
        name, bracket, fields = text.partition("(")
        made = name.rstrip() + normalize_spaces(bracket + fields) if bracket else text
    return made if words_of(made) == words_of(text) else text


def _literal(one: Scalar, shape: Shape, margin: str) -> list[str]:
    header = HEADER.match(one.raw)
    if header is None:
        return [quoted(one.value)]
    body = one.raw.split("\n")[1:]
    chomping = header[2].strip("0123456789")
    if chomping == "+":
        if one.value.endswith("\n\n") or not one.value.strip("\n"):
            return [quoted(one.value)]
        chomping = ""
    first = next((line for line in body if line.strip()), "")
    begin = next((line for line in one.value.split("\n") if line.strip()), "")
    indent = len(first) - len(first.lstrip(" ")) - (len(begin) - len(begin.lstrip(" ")))
    inner = [line[indent:] for line in body]
    if not any(line.strip() for line in inner):
        return [quoted(one.value)]
    if one.style == "|":
        inner = _spaced("\n".join(inner), shape.text).split("\n")
    sign = "2" if begin.startswith((" ", "\t")) or any(ch.isdigit() for ch in header[2]) else ""
    return [f"{one.style}{sign}{chomping}", *(margin + line if line else "" for line in inner)]


# --- flow style -----------------------------------------------------------------------------------


def _flow(node: Node, shape: Shape) -> str | None:
    """Return a node in flow style; None where it is not written so."""
    if isinstance(node, Scalar):
        return _flow_text(node, shape)
    is_short = shape.short_mapping if node.is_mapping else shape.short_list
    if not (node.is_flow or (is_short and node.entries)) or node.tail or node.opening:
        return None
    parts: list[str] = []
    for entry in _ordered(node, shape):
        part = _flow(entry.node, _below(shape, entry))
        if part is None or entry.above or entry.behind:
            return None
        if entry.key is not None:
            is_long = "\n" in entry.key.raw
            key = _key(entry.key) if is_long else _flow_text(entry.key, SHAPES["plain"])
            if key is None:
                return None
            part = f"{key}: {part}" if part else key
        parts.append(part)
    text = ", ".join(parts)
    return f"{{{text}}}" if node.is_mapping else f"[{text}]"


def _flow_text(one: Scalar, shape: Shape) -> str | None:
    if one.style in ("|", ">"):
        lines = _literal(one, shape, "")
        return lines[0] if len(lines) == 1 else None
    if "\n" in one.raw:
        return None
    text = _line(one, shape)
    is_kept = text == one.raw and (one.in_flow or one.style)
    is_safe = is_kept or text[:1] in "\"'" or is_plain(text, in_flow=True) or not text
    return text if is_safe else None
