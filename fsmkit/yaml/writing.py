"""Small parts of a Document as texts and mappings: declarations, statements, arguments."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping
from typing import Any

from fsmkit.diagnostics import Text, fail
from fsmkit.document.document import DocData
from fsmkit.document.keys import Form, Key, Keys
from fsmkit.document.statement_text import statements_text
from fsmkit.language.statements.tree import Block, DocArgument, DocField, ForEach, If
from fsmkit.yaml.layout import Prose, Short, Tree

JOINED = 72
"""Simple statements are joined on one line up to this length."""
NOTHING: Mapping[str, Tree] = {}
WORD = re.compile(r"[^\s,]+")


def write_keys(part: object, rows: Keys, own: Mapping[str, Tree] = NOTHING) -> dict[str, Tree]:
    """Return the given keys of a part of a document; ``own`` has those with a codec."""
    tree: dict[str, Tree] = {}
    for row in rows.values():
        if row.name in own:
            tree[row.name] = own[row.name]
        elif row.form in WRITE and row.is_given(part):
            tree[row.name] = WRITE[row.form](getattr(part, row.field), row)
    return tree


def mapping(pairs: Iterable[tuple[Text, Tree]]) -> dict[str, Tree]:
    """Return pairs as a mapping; YAML cannot express a repeated name."""
    tree: dict[str, Tree] = {}
    for name, value in pairs:
        if name.value in tree:
            raise fail(
                "not-expressible",
                f"`{name}` is there twice, which YAML cannot say",
                name,
                help="rename or remove one of them",
            )
        tree[name.value] = value
    return tree


def data(variables: tuple[DocData, ...]) -> dict[str, Tree]:
    """Return declarations of variables: ``name: type = start value``."""
    return mapping((one.name, _typed(one)) for one in variables)


def _typed(variable: DocData) -> str:
    type_ = "" if variable.type is None else variable.type.value
    if variable.init is None:
        return type_
    return f"{type_} = {variable.init.value}".lstrip()


def type_of(one: DocField) -> str:
    """Return the type of a field."""
    if one.type is None:
        raise fail(
            "not-expressible",
            f"the type of `{one.name}` is not given",
            one.name,
            help="give it one, such as `0..100`",
        )
    return one.type.value


def signature(
    name: Text, fields: tuple[DocField, ...], result: Text | None, *, is_called: bool = False
) -> str:
    """Return the declaration of an event, an operation or a function (``is_called``).

    A parameter of a function in ECMAScript has no type.
    """
    inside = ", ".join(
        one.name.value if is_called and one.type is None else f"{one.name} {type_of(one)}"
        for one in fields
    )
    arguments = f"({inside})" if fields else "()" if result is not None or is_called else ""
    return f"{name}{arguments}{'' if result is None else f' -> {result}'}"


def arguments(given: tuple[DocArgument, ...]) -> dict[str, Tree]:
    """Return ``name: expression`` pairs."""
    return mapping((one.name, one.value.value) for one in given)


def statements(block: Block) -> str:
    """Return statements as text: a few simple ones on one line, others one per line."""
    text = statements_text(block)
    lines = text.split("\n")
    is_simple = not any(isinstance(one, If | ForEach) for one in block)
    if is_simple and len(lines) == len(block) and len(text) + len(lines) <= JOINED:
        return "; ".join(line.removesuffix(";") for line in lines)
    return text if len(lines) == 1 else text + "\n"


def handlers(blocks: tuple[Block, ...]) -> Tree:
    """Return handlers: a single one as text, several as a list."""
    if len(blocks) == 1 and blocks[0]:
        return statements(blocks[0])
    return [statements(block) for block in blocks]


def listed(names: Iterable[Text]) -> Tree:
    """Return names as a list."""
    return Short([name.value for name in names])


def targets(names: tuple[Text, ...]) -> Tree:
    """Return one name as a text, several as a list."""
    if len(names) == 1 and WORD.fullmatch(names[0].value):
        return names[0].value
    return listed(names)


WRITE: Mapping[Form, Callable[[Any, Key], Tree]] = {
    Form.TEXT: lambda value, _: str(value.value),
    Form.NAME: lambda value, _: str(value.value),
    Form.PROSE: lambda value, _: Prose(value),
    Form.FLAG: lambda _, __: "true",
    Form.CHOICE: lambda value, row: row.word(value),
    Form.MARKS: lambda value, _: Short([*sorted(value)]),
    Form.NAMES: lambda value, _: listed(value),
    Form.TARGETS: lambda value, _: targets(value),
    Form.IDS: lambda value, _: targets(value),
    Form.STATEMENTS: lambda value, _: statements(value),
    Form.HANDLERS: lambda value, _: handlers(value),
    Form.ARGUMENTS: lambda value, _: arguments(value),
    Form.DATA: lambda value, _: data(value),
}
"""The writers of the forms; `OWN` has none here."""
