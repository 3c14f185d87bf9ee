"""The texts of `fsmkit.runtime.python` that every generated module holds a copy of."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import fsmkit

FOLDER = Path(fsmkit.__file__).parent / "runtime" / "python"
FILES = ("machine.py", "stepping.py", "timers.py", "queues.py", "trace.py")
"""What a host calls comes first; each stands on the next."""
MARK = "    # --- copied from here on into each generated class "


@dataclass(frozen=True, slots=True)
class Template:
    """The body of the class, without what each machine supplies, and its slots."""

    body: str
    slots: tuple[str, ...]
    variables: dict[str, str]
    """Types of the slots."""
    constants: dict[str, str]
    """Types of the constants and tables that each machine supplies."""
    names: frozenset[str]
    """Everything that a generated class has already."""


@cache
def machine() -> Template:
    """Return the part of a machine that does not depend on its chart."""
    bodies: list[str] = []
    slots: tuple[str, ...] = ()
    names: set[str] = set()
    variables: dict[str, str] = {}
    constants: dict[str, str] = {}
    for file in FILES:
        text = (FOLDER / file).read_text(encoding="utf-8")
        bodies.append(text[text.index("\n", text.index(MARK)) + 1 :].strip("\n"))
        (class_,) = [node for node in ast.parse(text).body if isinstance(node, ast.ClassDef)]
        for node in class_.body:
            match node:
                case ast.Assign(targets=[ast.Name("__slots__")], value=value):
                    slots += tuple(ast.literal_eval(value))
                case ast.AnnAssign(target=ast.Name(name), annotation=annotation):
                    names.add(name)
                    type_ = ast.unparse(annotation)
                    (constants if "ClassVar" in type_ else variables)[name] = type_
                case ast.FunctionDef(name=name):
                    names.add(name)
                case _:
                    pass
    return Template("\n\n".join(bodies), slots, variables, constants, frozenset(names | set(slots)))


def arithmetic(used_by: str) -> str:
    """Return the classes, and of the functions those that a text calls, directly or not."""
    text = (FOLDER / "arithmetic.py").read_text(encoding="utf-8")
    pieces = dict(_pieces(text))
    wanted = [name for name in pieces if name[0].isupper()]
    todo = [used_by]
    while todo:
        mentioned = set(re.findall(r"(?<![.\w])(\w+)\(", todo.pop()))
        for name, piece in pieces.items():
            if name in mentioned and name not in wanted:
                wanted.append(name)
                todo.append(piece)
    return "\n\n\n".join(piece for name, piece in pieces.items() if name in wanted)


def _pieces(text: str) -> Iterator[tuple[str, str]]:
    lines = text.splitlines()
    for node in ast.parse(text).body:
        if isinstance(node, ast.ClassDef | ast.FunctionDef):
            piece = "\n".join(lines[node.lineno - 1 : node.end_lineno])
            yield node.name, re.sub(r"  # noqa.*", "", piece)
