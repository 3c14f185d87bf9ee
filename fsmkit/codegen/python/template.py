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
INVOKING = "invoking.py"
SAVING = "saving.py"
BASES = ("_Machine", "_Invoking")
"""Classes that a module of several machines holds once, the second derived from the first."""
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
    bases: str = ""
    """Classes that all others of the module derive from, instead of holding the body each."""


@cache
def machine(*, saved: bool = False) -> Template:
    """Return the part of a machine that does not depend on its chart; ``saved``: it can be."""
    return _read((*FILES, SAVING) if saved else FILES)


@cache
def invoking(*, saved: bool = False) -> Template:
    """Return what machines that invoke each other derive from: two classes, whole."""
    alone, more = machine(saved=saved), _read((INVOKING,))
    declared = [_declared(FILES[-1]), *([_declared(SAVING)] if saved else [])]
    first = _class(BASES[0], "What all machines share.", alone, "\n\n".join(declared))
    doc = "A machine with slots for others, which know it."
    second = _class(f"{BASES[1]}({BASES[0]})", doc, more, _declared(INVOKING))
    constants, names = alone.constants | more.constants, alone.names | more.names
    return Template("", (), {}, constants, names, f"{first}\n\n\n{second}")


def _class(opening: str, doc: str, read: Template, declared: str) -> str:
    slots = "".join(f'        "{slot}",\n' for slot in sorted(read.slots))
    head = f'class {opening}:\n    """{doc}"""\n\n    __slots__ = (\n{slots}    )\n'
    return f"{head}\n{declared}\n\n{read.body}"


def _declared(file: str) -> str:
    """Return what stands in a class between its docstring and what is copied."""
    text = (FOLDER / file).read_text(encoding="utf-8")
    (class_,) = [node for node in ast.parse(text).body if isinstance(node, ast.ClassDef)]
    before = text[: text.index(MARK)].splitlines()
    return "\n".join(before[class_.body[0].end_lineno or 0 :]).strip("\n")


def _read(files: tuple[str, ...]) -> Template:
    bodies: list[str] = []
    slots: tuple[str, ...] = ()
    names: set[str] = set()
    variables: dict[str, str] = {}
    constants: dict[str, str] = {}
    for file in files:
        text = (FOLDER / file).read_text(encoding="utf-8")
        bodies.append(text[text.index("\n", text.index(MARK)) + 1 :].strip("\n"))
        (class_,) = [node for node in ast.parse(text).body if isinstance(node, ast.ClassDef)]
        for node in class_.body:
            match node:
                case ast.AnnAssign(target=ast.Name(name), annotation=annotation):
                    names.add(name)
                    type_ = ast.unparse(annotation)
                    if "ClassVar" in type_:
                        constants[name] = type_
                    else:
                        variables[name] = type_
                        slots += (name,) if file != SAVING else ()  # its children are Invoking's
                case ast.FunctionDef(name=name):
                    names.add(name)
                case _:
                    pass
    return Template("\n\n".join(bodies), slots, variables, constants, frozenset(names | set(slots)))


def arithmetic(used_by: str) -> str:
    """Return the classes, and of the functions those that a text calls, directly or not."""
    text = (FOLDER / "arithmetic.py").read_text(encoding="utf-8")
    pieces = dict(_pieces(text))
    wanted: list[str] = []
    todo = [used_by]
    while todo:
        mentioned = set(re.findall(r"(?<![.\w])(\w+)\(|(?:except|raise) (\w+)", todo.pop()))
        mentioned = {name for pair in mentioned for name in pair if name}
        for name, piece in pieces.items():
            if name in mentioned and name not in wanted:
                wanted.append(name)
                todo.append(piece)
    return "\n\n\n".join(piece for name, piece in pieces.items() if name in wanted)


def without(body: str, own: str) -> str:
    """Return the methods of a template that a class does not define itself."""
    defined = set(re.findall(r"^    def (\w+)\(", own, re.MULTILINE))
    lines = body.splitlines()
    (class_,) = ast.parse(f"class _:\n{body}").body
    assert isinstance(class_, ast.ClassDef)  # noqa: S101
    for node in reversed(class_.body):
        if isinstance(node, ast.FunctionDef) and node.name in defined:
            # the first line of what is parsed is the class, and an empty line follows a method
            first = min(node.lineno, *(each.lineno for each in node.decorator_list), node.lineno)
            del lines[first - 2 : node.end_lineno]
    return "\n".join(lines)


def _pieces(text: str) -> Iterator[tuple[str, str]]:
    lines = text.splitlines()
    for node in ast.parse(text).body:
        if isinstance(node, ast.ClassDef | ast.FunctionDef):
            piece = "\n".join(lines[node.lineno - 1 : node.end_lineno])
            yield node.name, re.sub(r"  # noqa.*", "", piece)
