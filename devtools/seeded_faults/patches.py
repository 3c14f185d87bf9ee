"""Patches of the generator of C: small changes of its source that change generated code.

A patch is applied to a copy of `fsmkit.codegen.c`, which a process of its own imports in place of
the original. A patch counts if the changed generator generates other code, and that code compiles.
"""

from __future__ import annotations

import ast
import copy
import difflib
import importlib
import multiprocessing
import re
import shutil
import sys
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from functools import partial
from multiprocessing.connection import Connection
from pathlib import Path
from random import Random
from typing import NamedTuple

import fsmkit.codegen.c
from devtools.seeded_faults.statements import statement_changes
from devtools.seeded_faults.subject import CompilationError, Fault, Subject, Totals, is_covered
from fsmkit.chart.chart import Chart

ORIGINAL = Path(fsmkit.codegen.c.__file__).parent
PACKAGE = "fsmkit.codegen.c"
SECONDS = 60
"""The time after which a changed generator counts as endless."""
OPPOSITES: Mapping[type[ast.cmpop], type[ast.cmpop]] = {
    ast.Eq: ast.NotEq, ast.NotEq: ast.Eq, ast.Lt: ast.LtE, ast.LtE: ast.Lt, ast.Gt: ast.GtE,
    ast.GtE: ast.Gt, ast.In: ast.NotIn, ast.NotIn: ast.In, ast.Is: ast.IsNot, ast.IsNot: ast.Is,
}  # fmt: skip
TEXTS = (
    ("++", "--"), ("--", "++"), (" == ", " != "), (" != ", " == "), (" < ", " <= "),
    (" > ", " >= "), (" && ", " || "), (" || ", " && "), ("true", "false"), ("false", "true"),
    (" + ", " - "), ("0u", "1u"), ("1u", "2u"), ("(!", "("), ("if (", "if (!"),
)  # fmt: skip
"""Changes of texts that are printed."""
EMITTING = ("line", "lines", "text", "wrapped", "print", "append", "add", "extend", "update")


class Patch(NamedTuple):
    """A changed file of the generator."""

    file: str
    """Its path in the package."""
    line: int
    kind: str
    before: str
    text: Callable[[], str]
    """Returns all of the changed file."""

    @property
    def fault(self) -> Fault:
        """The patch in a report."""
        return Fault(f"{self.file}:{self.line}: {self.before}", self.kind)


# --- changes of Python -------------------------------------------------------------------------

Change = Callable[[ast.AST], None]
"""Changes a node in place."""


def python_patches(file: str, text: str, lines: Collection[int]) -> Iterator[Patch]:
    """Yield the patches of a module of Python, in some of its lines."""
    tree, source = ast.parse(text), text.splitlines()
    for place, node in enumerate(ast.walk(tree)):
        line = getattr(node, "lineno", 0)
        if line not in lines:
            continue
        for kind, change in _changes(node):
            changed = partial(_changed, tree, place, change)
            yield Patch(file, line, kind, source[line - 1].strip(), changed)


def _changed(tree: ast.Module, place: int, change: Change) -> str:
    """Return a module with a change of the node at a place in the order of `ast.walk`."""
    found = copy.deepcopy(tree)
    change(next(each for number, each in enumerate(ast.walk(found)) if number == place))
    return ast.unparse(found)


def _changes(node: ast.AST) -> Iterator[tuple[str, Change]]:
    match node:
        case ast.Compare(ops=[op]) if type(op) in OPPOSITES:
            yield "comparison changed", _set("ops", [OPPOSITES[type(op)]()])
        case ast.BoolOp(op=op):
            other = ast.Or() if isinstance(op, ast.And) else ast.And()
            yield "and, or exchanged", _set("op", other)
        case ast.If(test=test) | ast.IfExp(test=test):
            yield "condition inverted", _set("test", ast.UnaryOp(ast.Not(), test))
        case ast.comprehension(ifs=[test]):
            yield "condition inverted", _set("ifs", [ast.UnaryOp(ast.Not(), test)])
        case ast.Constant(value=bool(value)):
            yield "constant inverted", _set("value", not value)
        case ast.Constant(value=int(value)):
            yield "constant off by one", _set("value", value + 1)
        case ast.Constant(value=str(value)):
            for old, new in TEXTS:
                if old in value:
                    yield f"text `{old}` to `{new}`", _set("value", value.replace(old, new, 1))
        case ast.Expr(value=ast.Call(func=ast.Attribute(attr=name))) if name in EMITTING:
            yield "statement dropped", _set("value", ast.Constant(None))
        case _:
            pass


def _set(name: str, value: object) -> Change:
    return lambda node: setattr(node, name, copy.deepcopy(value))


def piece_patches(file: str, text: str) -> Iterator[Patch]:
    """Yield the patches of a file of C that the generator adapts."""
    source = text.splitlines()
    for number, kind, changed in statement_changes(text):
        lines = [*source[:number], changed, *source[number + 1 :]]
        changed_text = partial("{}\n".format, "\n".join(lines))
        yield Patch(file, number + 1, kind, source[number].strip(), changed_text)


# --- generators in processes of their own ------------------------------------------------------


def generate(overlay: Path, charts: Sequence[Chart]) -> dict[str, dict[str, str]] | None:
    """Return the files that a changed generator generates, by the charts' names; None if it fails.

    ``overlay``: a folder with the changed package ``c``.
    """
    context = multiprocessing.get_context("fork")
    receive, send = context.Pipe(duplex=False)
    process = context.Process(target=_generate, args=(overlay, charts, send))
    process.start()
    send.close()
    try:
        found: dict[str, dict[str, str]] | None = receive.recv() if receive.poll(SECONDS) else None
    except EOFError:
        found = None
    process.kill()
    process.join()
    return found


def _generate(overlay: Path, charts: Sequence[Chart], send: Connection) -> None:
    sys.dont_write_bytecode = True
    try:
        generator = _imported(overlay)
        send.send({str(chart.name): generator(chart) for chart in charts})
    except Exception:  # noqa: BLE001  (a faulty generator fails in any manner)
        send.close()


def _imported(overlay: Path) -> Callable[[Chart], dict[str, str]]:
    """Import the generator of a folder in place of the original."""
    for name in [each for each in sys.modules if each == PACKAGE or each.startswith(f"{PACKAGE}.")]:
        del sys.modules[name]
    parent = importlib.import_module("fsmkit.codegen")
    parent.__path__ = [str(overlay), *parent.__path__]
    generating = importlib.import_module(f"{PACKAGE}.generate")
    options = importlib.import_module(f"{PACKAGE}.options").read_options({"with": "save"})
    return lambda chart: dict(generating.generate_machine(chart, None, options).files)


def executed_lines(charts: Sequence[Chart]) -> dict[str, set[int]]:
    """Return the lines of the generator that the charts execute, by file."""
    found: dict[str, set[int]] = {}
    root = str(ORIGINAL)

    def local(frame: object, event: str, argument: object) -> object:
        del argument
        if event == "line":
            found[frame.f_code.co_filename].add(frame.f_lineno)  # type: ignore[attr-defined]
        return local

    def called(frame: object, event: str, argument: object) -> object:
        del event, argument
        name = frame.f_code.co_filename  # type: ignore[attr-defined]
        if not name.startswith(root):
            return None
        found.setdefault(name, set())
        return local

    generating = importlib.import_module(f"{PACKAGE}.generate")
    options = importlib.import_module(f"{PACKAGE}.options").read_options({"with": "save"})
    previous = sys.gettrace()
    sys.settrace(called)  # type: ignore[arg-type]
    try:
        for chart in charts:
            generating.generate_machine(chart, None, options)
    finally:
        sys.settrace(previous)
    return {str(Path(name).relative_to(ORIGINAL)): lines for name, lines in found.items()}


# --- the campaign ------------------------------------------------------------------------------


def all_patches(charts: Sequence[Chart], random: Random) -> Iterator[Patch]:
    """Yield patches in random order: each file in turn, so that all kinds of code are changed."""
    executed = executed_lines(charts)
    waiting: dict[str, Iterator[Patch]] = {}
    files = [*sorted(executed), *(f"pieces/{p.name}" for p in sorted(ORIGINAL.glob("pieces/*.c")))]
    for file in files:
        text = (ORIGINAL / file).read_text(encoding="utf-8")
        patches = (
            piece_patches(file, text)
            if file.endswith(".c")
            else python_patches(file, text, executed[file])
        )
        every = list(patches)
        random.shuffle(every)
        waiting[file] = iter(every)
    while waiting:
        for file in random.sample(sorted(waiting), len(waiting)):
            found = next(waiting[file], None)
            if found is None:
                del waiting[file]
            else:
                yield found


def without_comments(text: str) -> str:
    """Return C without comments and empty lines."""
    bare = re.sub(r"/\*.*?\*/", "", text, flags=re.DOTALL)
    return "\n".join(line.rstrip() for line in bare.splitlines() if line.strip())


def patched(
    subjects: Sequence[Subject], number: int, patches: Iterable[Patch], folder: Path
) -> Totals:
    """Apply patches to the generator, one at a time, until so many generate other code."""
    charts = [subject.chart for subject in subjects]
    overlay = folder / "overlay"
    shutil.copytree(ORIGINAL, overlay / "c")
    covered = [subject.executed_lines() for subject in subjects]
    totals, done = Totals(), 0
    for patch in patches:
        if done == number:
            break
        path = overlay / "c" / patch.file
        path.write_text(patch.text(), encoding="utf-8")
        generated = generate(overlay, charts)
        shutil.copy2(ORIGINAL / patch.file, path)
        if generated is None:
            continue
        fates = [
            fate
            for subject, lines in zip(subjects, covered, strict=True)
            if (fate := _fate(subject, generated[str(subject.chart.name)], lines))
        ]
        if not fates or "rejected" in fates:
            continue
        done += 1
        if "found" in fates:
            totals.found += 1
        elif "survived" in fates:
            totals.survived.append(patch.fault)
        elif "never executed" in fates:
            totals.never_executed.append(patch.fault)
        else:
            totals.equivalent.append(patch.fault)
    return totals


def _fate(
    subject: Subject, generated: Mapping[str, str], covered: Mapping[str, Collection[int]]
) -> str:
    """Return what becomes of a changed machine; empty if nothing that ships is changed."""
    own = subject.program.files
    files = {
        name: generated.get(name, "")
        for name in subject.program.shipped
        if without_comments(generated.get(name, "")) != without_comments(own[name])
    }
    if not files:
        return ""
    try:
        differs = subject.differs(files)
    except CompilationError:
        return "rejected"
    if differs:
        return "found"
    if differs is None:
        return "equal"
    is_executed = any(
        name.endswith(".h") or is_covered(_changed_lines(own[name], text), covered[name])
        for name, text in files.items()
    )
    return "survived" if is_executed else "never executed"


def _changed_lines(before: str, after: str) -> Iterator[int]:
    """Yield the lines, from 0 on, that are changed, or beside which lines are inserted."""
    matcher = difflib.SequenceMatcher(None, before.splitlines(), after.splitlines(), autojunk=False)
    for tag, first, end, _, _ in matcher.get_opcodes():
        if tag == "insert":
            yield from (first - 1, first)
        elif tag != "equal":
            yield from range(first, end)
