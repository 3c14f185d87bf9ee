"""YAML files in their usual layout."""

from __future__ import annotations

import re
from collections import Counter

from fsmkit.diagnostics import Findings, FsmkitError, Source, Span, fail
from fsmkit.editor.formatting.concrete import Block, concrete, remarks
from fsmkit.editor.formatting.layout import lay_out
from fsmkit.editor.formatting.shapes import SHAPES, Scalar, Shape, shape_of
from fsmkit.editor.formatting.spacing import words_of
from fsmkit.yaml.nodes import Mapping, Node, Sequence, read_nodes
from fsmkit.yaml.nodes import Scalar as Read

MARKER = re.compile(r"\A(?:\ufeff)?(?:---[ \t]*\n)?")
SEPARATOR = re.compile("[\x85\u2028\u2029]")
BEYOND = re.compile(r"^(?:%|\.\.\.(?:\s|$))", re.MULTILINE)


def format_yaml(text: str, name: str) -> str:
    """Return a YAML file of ours in its usual layout; any other text as it is.

    Raises:
        FsmkitError: Where the text cannot be read; ``not-formatted`` where it cannot be laid out.

    """
    findings = Findings()
    source = Source(name, text)
    root = read_nodes(source, findings)
    findings.stop_on_errors()
    if root is None:
        raise FsmkitError(findings)
    if not isinstance(root, Mapping) or not root.entries:
        return text
    kind = shape_of(key.value for key, _ in root.entries)
    if kind is None:
        return text
    if BEYOND.search(text):
        raise fail(
            "not-formatted",
            f"`{name}` has a directive or the end of a document",
            help="remove the lines that start with `%` or `...`",
        )
    if (found := SEPARATOR.search(text)) is not None:
        raise fail(
            "not-formatted",
            f"the character U+{ord(found[0]):04X} ends a line in some versions of YAML",
            Span(source, found.start(), found.end()),
            help="replace it by a blank or a new line",
        )
    tree = concrete(source)
    if not isinstance(tree, Block) or tree.is_flow:
        return text
    marker = MARKER.match(text)
    lines = lay_out(tree, SHAPES[kind])
    begin = "" if marker is None else marker[0]
    made = begin + "\n".join(lines) + "\n"
    _require_same(source, root, made, SHAPES[kind])
    return made


def _require_same(source: Source, before: Node, made: str, shape: Shape) -> None:
    """Raise `FsmkitError` if formatting changed the meaning or lost a comment."""
    written = Source(source.name, made)
    after = read_nodes(written, Findings())
    is_same = after is not None and _is_same(before, after, shape)
    if not is_same or Counter(remarks(source)) != Counter(remarks(written)):
        raise fail(
            "not-formatted",
            f"`{source.name}` would have another meaning or lack a comment",
            help="this is a bug of fsmkit; the file is left as it is",
        )


def _is_same(before: Node, after: Node, shape: Shape) -> bool:
    """Whether two nodes mean the same: order of keys and white space in expressions aside."""
    match before, after:
        case Read(), Read():
            old, new = before.text.value, after.text.value
            if old == new:
                return True
            return shape.text in (Scalar.CODE, Scalar.SIGNATURE) and words_of(old) == words_of(new)
        case Sequence(), Sequence():
            item = SHAPES[shape.items] if shape.items else shape
            return len(before.items) == len(after.items) and all(
                _is_same(old, new, item) for old, new in zip(before.items, after.items, strict=True)
            )
        case Mapping(), Mapping():
            return _has_same_entries(before, after, shape)
        case _:
            return False


def _has_same_entries(before: Mapping, after: Mapping, shape: Shape) -> bool:
    names = [key.value for key, _ in before.entries]
    others = [key.value for key, _ in after.entries]
    if shape.order:
        kept = [[k for k in keys if k in shape.ordered] for keys in (names, others)]
        if sorted(names) != sorted(others) or kept[0] != kept[1]:
            return False
    elif names != others:
        return False
    values = {key.value: node for key, node in after.entries}
    return all(
        _is_same(node, values[key.value], SHAPES[shape.keys.get(key.value, shape.each)])
        for key, node in before.entries
    )
