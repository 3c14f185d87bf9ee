"""The texts of `fsmkit.runtime.python` that every generated module copies."""

from __future__ import annotations

import ast
from collections.abc import Collection, Iterable
from dataclasses import dataclass
from functools import cache
from textwrap import dedent, indent

from fsmkit.codegen.conditional import Facts
from fsmkit.codegen.definitions import reached
from fsmkit.codegen.python.lines import Piece
from fsmkit.codegen.python.trimming import facts_of_family, trimmed_method, uses_of
from fsmkit.runtime.library import PYTHON_LIBRARY

FILES = ("machine.py", "stepping.py", "timers.py", "queues.py", "trace.py")
"""The files in the order of the class: methods for hosts first, helpers last."""
INVOKING = "invoking.py"
IMAGING = "imaging.py"
SAVING = "saving.py"
RECORDING = "recording.py"
BASES = ("_Machine", "_Invoking")
"""Classes that a module of several machines shares; the second derives from the first."""
MARK = "    # --- copied from here on into each generated class "
SECTION = "# --- "
"""The start of the line above the first method of a section."""
REMARK = "  # noqa"
"""The start of a linter's remark, which generated modules omit."""


@dataclass(frozen=True, slots=True)
class Template:
    """The methods of the class, except those that each machine supplies, and its slots."""

    methods: tuple[Piece, ...]
    """The methods, not indented."""
    headings: dict[str, str]
    """The headings of sections, by the first method of each."""
    slots: tuple[str, ...]
    variables: dict[str, str]
    """Types of the slots."""
    constants: dict[str, str]
    """Types of the constants and tables that each machine supplies."""
    bases: Piece | None = None
    """Classes from which the other classes of the module derive."""

    @property
    def names(self) -> frozenset[str]:
        """The names that a generated class already has."""
        own = (method.name for method in self.methods)
        return frozenset((*own, *self.slots, *self.variables, *self.constants))

    def trimmed(self, facts: Facts, own: Collection[Piece]) -> tuple[list[Piece], set[str]]:
        """Return the methods that a machine needs, and all names that they and its own read.

        ``own``: the printed methods of the machine, which replace methods of the same name.
        """
        defined = {piece.name for piece in own}
        methods = {m.name: trimmed_method(m, facts) for m in self.methods if m.name not in defined}
        wanted = {name for name in (*methods, *defined) if is_offered(name)}
        found = reached([*own, *methods.values()], wanted)
        is_changed = True
        while is_changed:
            read = {name for piece in own if piece.name in found for name in piece.names}
            read |= {n for name, method in methods.items() if name in found for n in method.names}
            before = methods
            methods = {name: method.without_stores(read) for name, method in before.items()}
            is_changed = any(method is not before[name] for name, method in methods.items())
        kept = []
        heading = ""
        for name, method in methods.items():
            heading = self.headings.get(name, heading)
            if name in found:
                kept.append(Piece(name, indent(f"\n{heading}{method.text}", "    "), method.uses))
                heading = ""
        return kept, read | found


def is_offered(name: str) -> bool:
    """Whether a host may use a method."""
    return not name.startswith("_") or name.endswith("__")


@cache
def machine(*, saved: bool = False, recorded: bool = False) -> Template:
    """Return the chart-independent part of a machine.

    ``saved``: with saving and restoring; ``recorded``: with records.
    """
    return _read((*FILES, *_more(saved=saved, recorded=recorded)))


def _more(*, saved: bool, recorded: bool) -> tuple[str, ...]:
    """Return the files of the optional parts."""
    parts = {IMAGING: saved or recorded, SAVING: saved, RECORDING: recorded}
    return tuple(file for file, is_wanted in parts.items() if is_wanted)


@cache
def invoking(*, saved: bool = False, recorded: bool = False, covered: bool = False) -> Template:
    """Return the base classes of machines that invoke each other: two complete classes."""
    alone, more = machine(saved=saved, recorded=recorded), _read((INVOKING,))
    files = (FILES[-1], *_more(saved=saved, recorded=recorded))
    declared = [text for file in files if (text := _declared(file))]
    facts = facts_of_family(recorded=recorded, covered=covered, saved=saved)
    first = _class(BASES[0], "What all machines share.", alone, "\n\n".join(declared), facts)
    doc = "A machine with slots for others, which know it."
    second = _class(f"{BASES[1]}({BASES[0]})", doc, more, _declared(INVOKING), facts)
    constants = alone.constants | more.constants
    text = f"{first}\n\n\n{second}"
    return Template((), {}, (), {}, constants, Piece(BASES[1], text, uses_of(ast.parse(text))))


def _class(opening: str, doc: str, read: Template, declared: str, facts: Facts) -> str:
    slots = "".join(f'        "{slot}",\n' for slot in sorted(read.slots))
    head = f'class {opening}:\n    """{doc}"""\n\n    __slots__ = (\n{slots}    )\n'
    methods = indent(
        "\n\n".join(trimmed_method(method, facts).text for method in read.methods), "    "
    )
    return f"{head}\n{declared}\n\n{methods}"


def _declared(file: str) -> str:
    """Return the declarations of a class between its docstring and the copied methods."""
    text = (PYTHON_LIBRARY / file).read_text(encoding="utf-8")
    (class_,) = [node for node in ast.parse(text).body if isinstance(node, ast.ClassDef)]
    before = text[: text.index(MARK)].splitlines()
    return "\n".join(before[class_.body[0].end_lineno or 0 :]).strip("\n")


def _read(files: tuple[str, ...]) -> Template:
    methods: list[Piece] = []
    headings: dict[str, str] = {}
    slots: tuple[str, ...] = ()
    variables: dict[str, str] = {}
    constants: dict[str, str] = {}
    for file in files:
        text = (PYTHON_LIBRARY / file).read_text(encoding="utf-8")
        for piece in pieces(dedent(text[text.index("\n", text.index(MARK)) + 1 :])):
            lines = piece.text.split("\n")
            found = [line for line in lines if line.startswith(SECTION)]
            if found:
                headings[piece.name] = f"{found[0]}\n\n"
            method = "\n".join(line for line in lines if line not in found).strip("\n")
            methods.append(Piece(piece.name, method, piece.read))
        (class_,) = [node for node in ast.parse(text).body if isinstance(node, ast.ClassDef)]
        for node in class_.body:
            if isinstance(node, ast.AnnAssign) and isinstance(node.target, ast.Name):
                name, type_ = node.target.id, ast.unparse(node.annotation)
                if "ClassVar" in type_:
                    constants[name] = type_
                else:
                    variables[name] = type_
                    slots += (
                        (name,) if file not in (IMAGING, SAVING) else ()
                    )  # its children are Invoking's
    return Template(tuple(methods), headings, slots, variables, constants)


@cache
def _functions() -> tuple[Piece, ...]:
    """Return the classes and functions of `arithmetic`."""
    text = (PYTHON_LIBRARY / "arithmetic.py").read_text(encoding="utf-8")
    return tuple(pieces(without_remarks(text[text.index("class ") :])))


def without_remarks(text: str) -> str:
    """Return a file of the library without linters' remarks."""
    return "\n".join(line.partition(REMARK)[0] for line in text.split("\n"))


def arithmetic(names: Iterable[str]) -> list[Piece]:
    """Return the classes and functions that some names need, directly or not."""
    found = reached(_functions(), names)
    return [piece for piece in _functions() if piece.name in found]


def pieces(text: str) -> list[Piece]:
    """Return the definitions of a text, each with the lines before it."""
    found, lines, start = [], text.splitlines(), 0
    for node in ast.parse(text).body:
        if isinstance(node, ast.ClassDef | ast.FunctionDef):
            name = node.name
        else:
            assert isinstance(node, ast.AnnAssign)  # noqa: S101
            assert isinstance(node.target, ast.Name)  # noqa: S101
            name = node.target.id
        end = node.end_lineno or start
        while end < len(lines) and lines[end].lstrip(" ") == "# endif":
            end += 1
        found.append(Piece(name, "\n".join(lines[start:end]).strip("\n"), uses_of(node)))
        start = end
    return found
