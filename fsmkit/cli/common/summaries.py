"""The verbs as a list shows them: their docstrings are read from the source, nothing is imported.

An import of all verbs is an import of all of fsmkit, which takes longer than any list should.
"""

from __future__ import annotations

import ast
from importlib import import_module
from pathlib import Path

import click

VERBS = Path(__file__).parents[1]


def listed(verb: str) -> click.Command:
    """Return a verb that can be listed, but not run.

    Args:
        verb: The name of a module of this package that defines ``command``.

    Returns:
        A command of that name with the help of the verb and no options. Where there is no source
        to read, or another form of ``command`` in it, the verb itself, imported.

    """
    try:
        tree = ast.parse((VERBS / f"{verb}.py").read_text(encoding="utf-8"))
    except OSError:
        tree = ast.Module([], [])
    for node in tree.body:
        if isinstance(node, ast.FunctionDef) and node.name == "command":
            return click.Command(verb, help=ast.get_docstring(node))
    command = import_module(f"fsmkit.cli.{verb}").command
    assert isinstance(command, click.Command)  # noqa: S101  (a law of this package)
    return command
