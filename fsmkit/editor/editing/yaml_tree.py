"""A YAML file as a tree that can be changed: what does not change keeps its bytes.

Each entry of a block keeps the lines of its own: comments above it, its text, comments behind it.
Entries that are inserted take the layout of their siblings; entries that move take their lines
along.
"""

from __future__ import annotations

import difflib
import itertools
from collections.abc import Iterator
from dataclasses import dataclass, field

from fsmkit.diagnostics import Source
from fsmkit.editor.formatting import concrete as cst
from fsmkit.yaml.layout import (
    STEP,
    WIDTH,
    Prose,
    Short,
    Tree,
    entry_lines,
    item_lines,
    quoted,
    scalar,
    text_lines,
)


@dataclass(eq=False, slots=True)
class Node:
    """A node: of the file (``old``), or new (``tree``).

    ``value`` is the text of a scalar, ``items`` are the entries of a mapping or a list.
    """

    old: cst.Node | None = None
    tree: Tree | None = None
    value: str = ""
    items: list[Item] = field(default_factory=list)
    loaded: tuple[Item, ...] = ()
    is_block: bool = False
    """Whether a new mapping of given entries is a block."""

    @property
    def is_scalar(self) -> bool:
        """Whether it is a text."""
        return isinstance(self.old, cst.Scalar) or isinstance(self.tree, str | Prose)

    @property
    def is_mapping(self) -> bool:
        """Whether it is a mapping with entries that can be changed."""
        return isinstance(self.old, cst.Block) and self.old.is_mapping

    @property
    def is_list(self) -> bool:
        """Whether it is a list with items that can be changed."""
        return isinstance(self.old, cst.Block) and not self.old.is_mapping

    def get(self, key: str) -> Item | None:
        """Return the entry of a mapping with a key."""
        return next((item for item in self.items if item.key == key), None)

    def index(self, item: Item) -> int:
        """Return the position of an entry."""
        return next(n for n, one in enumerate(self.items) if one is item)


@dataclass(eq=False, slots=True)
class Item:
    """An entry of a mapping, or with no ``key`` of a list."""

    node: Node
    key: str | None = None
    old: cst.Entry | None = None
    margin: int | None = None
    """The column of the entry in a block of the file, from 0."""
    gap: str = ""
    """Blank lines before its comments."""
    start: int = 0
    """The offset of the first line of its comments, or of the entry behind a `- `."""
    end: int = 0
    above: list[str] = field(default_factory=list)
    """Comments of removed parts, which go above it."""


def new_item(key: str | None, tree: Tree) -> Item:
    """Return a new entry."""
    return Item(Node(tree=tree), key)


class YamlFile:
    """A YAML file that can be changed."""

    def __init__(self, source: Source) -> None:
        """Read the structure of a file, which `read_nodes` reads without an error."""
        self.source = source
        self.text = source.text
        root = cst.concrete(source)
        if not isinstance(root, cst.Block) or not root.is_mapping:
            raise TypeError("a file of ours is a mapping")
        self.root = self._load(root)

    # --- reading ------------------------------------------------------------------------------

    def _load(self, old: cst.Node) -> Node:
        if isinstance(old, cst.Scalar):
            return Node(old, value=old.value)
        node = Node(old)
        end = old.start
        for entry in old.entries:
            key = None if entry.key is None else entry.key.value
            item = Item(self._load(entry.node), key, entry)
            if not old.is_flow:
                item.margin = self._margin(entry)
                item.start, item.end = self._extent(entry)
                if node.items:
                    item.gap = self.text[end : item.start]
                    if item.gap.strip():  # a comment that no rule places: part of the entry before
                        item.gap = ""
                        node.items[-1].end = item.start
                end = item.end
            node.items.append(item)
        node.loaded = tuple(node.items)
        return node

    def _line(self, offset: int) -> int:
        return self.text.rfind("\n", 0, offset) + 1

    def _line_end(self, offset: int) -> int:
        at = self.text.find("\n", offset)
        return len(self.text) if at < 0 else at + 1

    def _margin(self, entry: cst.Entry) -> int:
        first = entry.start if entry.key is not None else self._dash(entry)
        return first - self._line(first)

    def _dash(self, entry: cst.Entry) -> int:
        """Return the offset of the sign before an item of a list."""
        at = entry.start
        while True:
            at = self.text.rfind("-", 0, at)
            line = self._line(at)
            before = self.text[line:at].strip(" -\ufeff")
            if not before:
                return at

    def _extent(self, entry: cst.Entry) -> tuple[int, int]:
        """Return the lines of an entry, with its comments."""
        first = entry.start if entry.key is not None else self._dash(entry)
        line = self._line(first)
        start = first if self.text[line:first].strip(" \ufeff") else line
        if entry.top is not None and start == line:
            start = min(start, self._line(entry.top))
        last = max(entry.node.end, entry.start)
        if entry.key is not None:
            last = max(last, entry.key.end)
        # behind a flow collection or a text nothing but a comment follows on its line
        end = self._line_end(max(first, last - 1) if last > first else last)
        if self.text[last - 1 : last] == "\n":
            end = last
        return start, max([end, *(self._line_end(one) for one in _bottoms(entry.node))])

    # --- changing -----------------------------------------------------------------------------

    def own_remarks(self, item: Item) -> list[str]:
        """Return the comments of an entry, without those of the entries inside it."""
        found = list(item.above)
        if item.old is not None:
            found += [one.strip() for one in (*item.old.above, *item.old.behind) if one]
        if isinstance(item.node.old, cst.Block):
            found += [one.strip() for one in (*item.node.old.opening, *item.node.old.tail) if one]
        return found

    def remarks(self, item: Item) -> list[str]:
        """Return the comments of an entry and of all inside it."""
        found = self.own_remarks(item)
        for inner in item.node.items:
            found += self.remarks(inner)
        return found

    def inner_remarks(self, item: Item) -> list[str]:
        """Return the comments inside the value of an entry, which a new value would lose."""
        found: list[str] = []
        if isinstance(item.node.old, cst.Block):
            found += [one.strip() for one in (*item.node.old.opening, *item.node.old.tail) if one]
        for inner in item.node.items:
            found += self.remarks(inner)
        return found

    def replace(self, item: Item, before: Tree | None, after: Tree) -> None:
        """Set the value of an entry to ``after``; what is equal in ``before`` stays as it is."""
        if not self._adapt(item.node, before, after):
            item.above += self.inner_remarks(item)
            item.node = Node(tree=after)

    def _adapt(self, node: Node, before: Tree | None, after: Tree) -> bool:
        """Change a node in place; return whether its kind allows it."""
        before = before.value if isinstance(before, Short) else before
        after = after.value if isinstance(after, Short) else after
        if before is not None and plain(before) == plain(after):
            return True
        match after:
            case str() if isinstance(node.old, cst.Scalar) and node.tree is None:
                node.value = after
                return True
            case Prose(text) if isinstance(node.old, cst.Scalar) and node.tree is None:
                node.value = text + ("\n" if "\n" in text else "")
                return "\n" in text or len(text) < WIDTH // 2
            case dict() if node.is_mapping and node.items and after:
                self._adapt_mapping(node, before if isinstance(before, dict) else {}, after)
                return True
            case list() if node.is_list and node.items and after:
                self._adapt_list(node, before if isinstance(before, list) else [], after)
                return True
            case _:
                return False

    def _adapt_mapping(self, node: Node, before: dict[str, Tree], after: dict[str, Tree]) -> None:
        names = {id(item): item.key for item in node.items}
        if len(before) == len(node.items):  # a signature may be written with other blanks
            names = {id(item): key for item, key in zip(node.items, before, strict=True)}
        found = {names[id(item)]: item for item in node.items}
        lost = [r for key, item in found.items() if key not in after for r in self.remarks(item)]
        node.items[:] = [item for item in node.items if names[id(item)] in after]
        at = 0
        for key, value in after.items():
            item = found.get(key)
            if item is None:
                node.items.insert(at, new_item(key, value))
            else:
                self.replace(item, before.get(key), value)
                at = node.index(item)
            at += 1
        node.items[0].above[:0] = lost

    def _adapt_list(self, node: Node, before: list[Tree], after: list[Tree]) -> None:
        if len(before) != len(node.items):
            before = [as_tree(self.data(item.node)) for item in node.items]
        old, new = [repr(plain(one)) for one in before], [repr(plain(one)) for one in after]
        items: list[Item] = []
        lost: list[str] = []
        matcher = difflib.SequenceMatcher(None, old, new, autojunk=False)
        for what, first, last, begin, stop in matcher.get_opcodes():
            if what == "equal":
                items += node.items[first:last]
                continue
            pairs = min(last - first, stop - begin)
            for number in range(pairs):
                item = node.items[first + number]
                self.replace(item, before[first + number], after[begin + number])
                items.append(item)
            for item in node.items[first + pairs : last]:
                lost += self.remarks(item)
            items += [new_item(None, value) for value in after[begin + pairs : stop]]
        node.items[:] = items
        node.items[0].above[:0] = lost

    def data(self, node: Node) -> object:
        """Return a node as texts, lists and pairs."""
        if node.tree is not None:
            return plain(node.tree)
        if isinstance(node.old, cst.Scalar):
            return node.value
        if node.items and node.items[0].key is not None:
            return {item.key: self.data(item.node) for item in node.items}
        return [self.data(item.node) for item in node.items]

    # --- writing ------------------------------------------------------------------------------

    def written(self) -> str:
        """Return the text of the file."""
        first, last = self.root.loaded[0], self.root.loaded[-1]
        old = self.root.old
        if isinstance(old, cst.Block) and old.is_flow:
            inner = self._flow(self.root)
            return self.text[: old.start] + inner + self.text[old.end :]
        body = "".join(self._entries(self.root, 0))
        tail = self.text[last.end :]
        if tail and not body.endswith("\n"):
            body += "\n"
        if not self._ends_as_before(self.root):
            tail = _aligned(tail, 0)
        return self.text[: first.start] + body + tail

    def _ends_as_before(self, node: Node) -> bool:
        """Return whether the last entry of a block is that of the file, unchanged."""
        return node.items[-1] is node.loaded[-1] and self._is_clean(node.items[-1])

    def _is_clean(self, item: Item) -> bool:
        if item.old is None or item.above:
            return False
        key = None if item.old.key is None else item.old.key.value
        return key == item.key and self._is_same(item.node)

    def _is_same(self, node: Node) -> bool:
        if node.tree is not None or node.old is None:
            return False
        if isinstance(node.old, cst.Scalar):
            return node.value == node.old.value
        return len(node.items) == len(node.loaded) and all(
            new is old and self._is_clean(new)
            for new, old in zip(node.items, node.loaded, strict=True)
        )

    def _entries(self, node: Node, margin: int) -> Iterator[str]:
        """Yield the lines of the entries of a block."""
        follower = {id(one): other for one, other in itertools.pairwise(node.loaded)}
        previous: Item | None = None
        for number, item in enumerate(node.items):
            yield self._gap(node, number)
            part = self._entry(item, margin)
            if previous is not None and (
                follower.get(id(previous)) is not item or not self._is_clean(previous)
            ):
                part = _aligned(part, margin)
            previous = item
            yield part if part.endswith("\n") or number == len(node.items) - 1 else f"{part}\n"

    def _gap(self, node: Node, number: int) -> str:
        """Return the blank lines before an entry: its own, or those of its siblings."""
        item = node.items[number]
        if not number:
            return ""
        if item.margin is not None and any(item is one for one in node.loaded[1:]):
            return item.gap
        gaps = [one.gap for one in node.loaded[1:]]
        if node is self.root:
            after = node.items[number + 1] if number + 1 < len(node.items) else None
            is_airy = any(gaps) or len(gaps) < len(("chart", "states"))
            return "\n" if is_airy and self._is_large(item, after) else ""
        return gaps[0] if gaps and all(gaps) else ""

    def _is_large(self, item: Item, after: Item | None) -> bool:
        return after is None or bool(after.gap) or not item.node.is_scalar

    def _entry(self, item: Item, margin: int) -> str:
        """Return the lines of an entry at a column."""
        pad = " " * margin
        if self._is_clean(item):
            if item.margin is None:  # it was in a flow collection
                return f"{pad}{'- ' if item.key is None else ''}{self._raw(item)}"
            lines = self.text[item.start : item.end]
            if item.start != self._line(item.start):
                lines = " " * item.margin + lines
            return _shifted(lines, margin - item.margin)
        above = "".join(f"{pad}{remark}\n" for remark in item.above)
        if item.old is None:
            return above + self._new(item, margin)
        if item.margin is None:
            above = "".join(f"{pad}{one.strip()}\n" for one in item.old.above if one) + above
            return above + self._changed(item, margin, 0)
        first = item.old.start if item.old.key is not None else self._dash(item.old)
        line = self._line(first)
        if item.start < line:
            above = _shifted(self.text[item.start : line], margin - item.margin) + above
        above += "".join(f"{pad}{remark}\n" for remark in self._before_value(item, item.old))
        return above + self._changed(item, margin, margin - item.margin)

    def _before_value(self, item: Item, old: cst.Entry) -> list[str]:
        """Return the comments between a key or sign and its value, unless these stay there."""
        is_block = isinstance(old.node, cst.Block) and not old.node.is_flow
        if is_block and (old.key is not None or item.node.old is old.node):
            return []
        start = self._dash(old) + 1 if old.key is None else old.key.end
        lines = self.text[start : old.node.start].split("\n")
        if old.key is not None:  # the first is behind the key
            lines = lines[1:]
        return [line.strip() for line in lines if line.strip().startswith("#")]

    def _is_plain(self, item: Item) -> bool:
        """Return whether a new entry is short enough for a collection on one line."""
        return item.key is not None and isinstance(item.node.tree, str) and not item.above

    def _raw(self, item: Item) -> str:
        """Return the text of an entry of a flow collection."""
        old = item.old
        if old is None:
            raise TypeError("a new entry has no text")
        return self.text[
            old.start : max(old.node.end, old.start if old.key is None else old.key.end)
        ]

    def _head(self, item: Item, margin: int) -> str:
        """Return the line of an entry up to its colon or sign."""
        pad = " " * margin
        if item.key is None:
            return f"{pad}-"
        old = None if item.old is None else item.old.key
        if old is not None and old.value == item.key and "\n" not in old.raw:
            return f"{pad}{old.raw}:"
        return f"{pad}{scalar(item.key)}:"

    def _new(self, item: Item, margin: int) -> str:
        """Return the lines of a new entry."""
        node = item.node
        if node.tree is None:  # a new collection
            head = self._head(item, margin)
            if len(node.items) == 1 and self._is_plain(node.items[0]):
                return f"{head} {self._flow_value(node)}\n"
            inner = "".join(self._entries(node, margin + len(STEP)))
            return f"{head}\n{inner}" if inner else f"{head} {{}}\n"
        pad = " " * margin
        if item.key is None:
            return "\n".join(item_lines(node.tree, pad)) + "\n"
        return "\n".join(entry_lines(item.key, node.tree, pad)) + "\n"

    def _changed(self, item: Item, margin: int, shift: int) -> str:
        """Return the lines of an entry of the file whose key or value changed, without comments."""
        old, node = item.old, item.node
        if old is None:
            raise TypeError("an entry of the file")
        head, was = self._head(item, margin), old.node
        behind = "".join(old.behind[:1]) if item.margin is not None else "".join(old.behind)
        more = "".join(f"{' ' * margin}{one.strip()}\n" for one in old.behind[1:])
        if item.margin is None:
            more = ""
        if self._is_same(node) and not isinstance(was, cst.Block):
            rest = (
                self.text[(was.start if was.raw else was.end) : item.end]
                if item.margin is not None
                else self._value(was)
            )
            if item.margin is None or not rest.endswith("\n"):
                rest += "\n"
            return f"{head} {_shifted_rest(rest, shift)}" if was.raw else f"{head}{rest}"
        if node.tree is not None:
            return more + self._fresh(item, head, margin, behind)
        if node.is_block:
            body = "".join(self._entries(node, margin + len(STEP)))
            return more + f"{head}{behind}\n{body}"
        if isinstance(was, cst.Scalar):
            first, *others = _restyled(was, node.value, " " * (margin + 2), len(head) + 1)
            lines = [f"{head} {first}{behind}" if first else head + behind, *others]
            return more + "\n".join(lines) + "\n"
        if was.is_flow:
            return more + self._changed_flow(item, head, margin, behind)
        return self._changed_block(item, head, margin, shift)

    def _value(self, one: cst.Scalar) -> str:
        return self.text[one.start : one.end]

    def _fresh(self, item: Item, head: str, margin: int, behind: str) -> str:
        pad = " " * margin
        tree = item.node.tree
        if tree is None:
            raise TypeError("a new value")
        if isinstance(tree, dict | list) and tree and _is_small(item):
            tree = Short(tree)
        if item.key is None:
            first, *rest = item_lines(tree, pad)
        else:
            first, *rest = entry_lines(item.key, tree, pad)
            written = f"{pad}{scalar(item.key)}:"
            if first.startswith(written):
                first = head + first[len(written) :]
        if (
            behind
            and rest
            and item.key is None
            and not first.rstrip().endswith(("|", ">", "|-", ">-"))
        ):
            return f"{pad}{behind.strip()}\n" + "\n".join([first, *rest]) + "\n"
        return "\n".join([first + behind, *rest]) + "\n"

    def _changed_flow(self, item: Item, head: str, margin: int, behind: str) -> str:
        node = item.node
        old = node.old
        if not isinstance(old, cst.Block):
            raise TypeError("a flow collection")
        written = self._flow(node)
        is_wide = "\n" not in written and len(head) + 1 + len(written) > WIDTH
        if not node.items or not (is_wide or self._needs_block(node)):
            return f"{head} {written}{behind}\n"
        inner = "".join(
            f"{' ' * (margin + 2)}{one.strip()}\n" for one in (*old.opening, *old.tail) if one
        )
        for one in node.items:
            remarks = "" if one.old is None else "".join(f" {r}" for r in one.old.behind)
            part = self._entry(one, margin + len(STEP))
            if remarks and self._is_clean(one):
                part = f"{part.rstrip()} {remarks}\n"
                above = [] if one.old is None else [r for r in one.old.above if r]
                part = "".join(f"{' ' * (margin + 2)}{r}\n" for r in above) + part
            inner += part if part.endswith("\n") else f"{part}\n"
        if item.key is None:
            remark = f"{' ' * margin}{behind.strip()}\n" if behind else ""
            return f"{remark}{head} {inner.lstrip()}"
        return f"{head}{behind}\n{inner}"

    def _needs_block(self, node: Node) -> bool:
        """Return whether a flow collection must become a block: for states, and moved lines."""
        for item in node.items:
            if item.margin is not None and "\n" in self.text[item.start : item.end].rstrip("\n"):
                return True
            if item.above or (
                item.margin is not None
                and item.old is not None
                and (item.old.above or item.old.behind)
            ):
                return True
            if item.key in ("states", "regions") and not self._is_clean(item):
                return True
            inner = item.node
            if (
                isinstance(inner.old, cst.Scalar)
                and not self._is_clean(item)
                and "\n" in inner.value
            ):
                return True
            if inner.tree is not None and _has_lines(inner.tree):
                return True
            if inner.items and self._needs_block(inner):
                return True
        return False

    def _flow(self, node: Node) -> str:
        """Return a flow collection, with its own text around what stays."""
        old = node.old
        if not isinstance(old, cst.Block):
            raise TypeError("a flow collection")
        if not node.items:
            return "{}" if old.is_mapping else "[]"
        text = self.text
        starts = [one for one in node.items if any(one is was for was in node.loaded)]
        opening = (
            text[old.start : node.loaded[0].old.start]
            if node.loaded and node.loaded[0].old
            else text[old.start]
        )
        closing = "}" if old.is_mapping else "]"
        if node.loaded and (last := node.loaded[-1].old) is not None:
            closing = text[self._flow_end(last) : old.end]
        if not starts:
            opening = opening[:1] if not opening.strip(" {[") else opening
        flow_text = opening
        previous: Item | None = None
        for number, item in enumerate(node.items):
            if number:
                flow_text += self._separator(node, previous, item)
            flow_text += self._flow_item(item)
            previous = item
        return flow_text + closing

    def _flow_end(self, entry: cst.Entry) -> int:
        end = max(entry.node.end, entry.start)
        return end if entry.key is None else max(end, entry.key.end)

    def _separator(self, node: Node, one: Item | None, other: Item) -> str:
        """Return the text between two entries: of neighbours their own."""
        if one is not None and one.old is not None and other.old is not None:
            for first, second in zip(node.loaded, node.loaded[1:], strict=False):
                if first is one and second is other:
                    return self.text[self._flow_end(one.old) : other.old.start]
        return ", "

    def _flow_item(self, item: Item) -> str:
        if item.margin is None and self._is_clean(item):
            return self._raw(item).rstrip()
        key = None
        if item.key is not None:
            was = None if item.old is None else item.old.key
            is_kept = was is not None and was.value == item.key
            key = was.raw if was is not None and is_kept else flow_scalar(item.key)
        value = self._flow_value(item.node)
        if key is None:
            return value
        return f"{key}: {value}" if value else f"{key}:"

    def _flow_value(self, node: Node) -> str:
        if node.tree is not None:
            return flow(node.tree)
        if isinstance(node.old, cst.Scalar):
            if node.value == node.old.value and node.old.style not in ("|", ">"):
                return node.old.raw
            quote = node.old.style if node.old.style in ("'", '"') else ""
            if quote and "\n" not in node.value:
                return _in_quotes(quote, node.value)
            return flow_scalar(node.value)
        if isinstance(node.old, cst.Block) and node.old.is_flow:
            return self._flow(node)
        if not node.items or node.items[0].key is None:
            return f"[{', '.join(self._flow_value(item.node) for item in node.items)}]"
        return f"{{{', '.join(self._flow_item(item) for item in node.items)}}}"

    def _changed_block(self, item: Item, head: str, margin: int, shift: int) -> str:
        node, old = item.node, item.old
        if old is None or not isinstance(node.old, cst.Block):
            raise TypeError("a block of the file")
        first, last = node.loaded[0], node.loaded[-1]
        after = self._dash(old) + 1 if old.key is None else self.text.find(":", old.key.end) + 1
        between = self.text[after : first.start]
        tail = self.text[last.end : item.end]
        column = (first.margin or 0) + shift
        if not node.items:
            empty = "{}" if node.old.is_mapping else "[]"
            remark, _, more = between.partition("\n")
            return (
                f"{head} {empty}{remark.rstrip()}\n{_shifted(more, shift)}{_shifted(tail, shift)}"
            )
        body = "".join(self._entries(node, column))
        if tail and not body.endswith("\n"):
            body += "\n"
        tail = _shifted(tail, shift)
        if not self._ends_as_before(node):
            tail = _aligned(tail, column)
        if "\n" not in between:  # the first entry is on the line of the sign
            if body.lstrip().startswith("#"):
                lines = body.split("\n")
                count = next(n for n, line in enumerate(lines) if not line.lstrip().startswith("#"))
                above = "".join(f"{' ' * margin}{line.strip()}\n" for line in lines[:count])
                return above + head + between + "\n".join(lines[count:])[column:] + tail
            return head + between + body[column:] + tail
        remark, _, more = between.partition("\n")
        return f"{head}{remark}\n{_shifted(more, shift)}{body}{tail}"


def _bottoms(node: cst.Node) -> Iterator[int]:
    """Yield the offsets of the comments behind the last entries of a node."""
    while isinstance(node, cst.Block) and not node.is_flow:
        if node.bottom is not None:
            yield node.bottom
        if not node.entries:
            break
        node = node.entries[-1].node


def _is_small(item: Item) -> bool:
    return item.old is not None and (isinstance(item.old.node, cst.Scalar) or item.old.node.is_flow)


def _aligned(part: str, margin: int) -> str:
    """Move the comments at the start of a part to its margin, so that no text before takes them."""
    lines = part.split("\n")
    for number, line in enumerate(lines):
        bare = line.lstrip(" ")
        if bare and not bare.startswith("#"):
            break
        if len(line) - len(bare) > margin and bare:
            lines[number] = " " * margin + bare
    return "\n".join(lines)


def _shifted(lines: str, shift: int) -> str:
    """Move lines to the right or left."""
    if not shift or not lines:
        return lines
    return "".join(_shifted_line(line, shift) for line in lines.splitlines(keepends=True))


def _shifted_line(line: str, shift: int) -> str:
    if not line.strip("\n"):
        return line
    if shift > 0:
        return " " * shift + line
    blanks = len(line) - len(line.lstrip(" "))
    return line[min(blanks, -shift) :]


def _shifted_rest(lines: str, shift: int) -> str:
    """Move all lines but the first."""
    first, newline, rest = lines.partition("\n")
    return first + newline + _shifted(rest, shift)


def as_tree(data: object) -> Tree:
    """Return texts, lists and pairs as a tree, on one line where it fits."""
    match data:
        case dict():
            return Short({str(key): as_tree(value) for key, value in data.items()})
        case list():
            return Short([as_tree(value) for value in data])
        case _:
            return str(data)


def plain(tree: Tree) -> object:
    """Return a tree as texts, lists and pairs."""
    match tree:
        case Short(value):
            return plain(value)
        case Prose(text):
            return text
        case dict():
            return {key: plain(value) for key, value in tree.items()}
        case list():
            return [plain(one) for one in tree]
        case _:
            return tree


def _has_lines(tree: Tree) -> bool:
    """Return whether a text of a tree has several lines."""
    match tree:
        case Short(value):
            return _has_lines(value)
        case Prose(text):
            return "\n" in text
        case dict():
            return any(_has_lines(value) for value in tree.values())
        case list():
            return any(_has_lines(one) for one in tree)
        case _:
            return "\n" in tree


def flow(tree: Tree) -> str:
    """Return a tree in flow style, quoted where it must be."""
    match tree:
        case Short(value):
            return flow(value)
        case Prose(text):
            return flow_scalar(text)
        case dict():
            pairs = (f"{flow_scalar(key)}: {flow(value)}" for key, value in tree.items())
            return f"{{{', '.join(pairs)}}}"
        case list():
            return f"[{', '.join(flow(one) for one in tree)}]"
        case _:
            return flow_scalar(tree)


def flow_scalar(text: str) -> str:
    """Return a text in a flow collection."""
    return scalar(text, in_flow=True)


def _restyled(was: cst.Scalar, value: str, margin: str, column: int) -> list[str]:
    """Return the lines of a changed text, in the quotes that it had if it can keep them."""
    if "\n" not in value and was.style in ("'", '"') and value:
        return [_in_quotes(was.style, value)]
    if not value and not was.raw:
        return [""]
    return text_lines(value, margin, column)


def _in_quotes(quote: str, value: str) -> str:
    if quote == "'":
        return "'" + value.replace("'", "''") + "'"
    return quoted(value) if '"' in value or "\\" in value else f'"{value}"'
