"""The verbs, in groups, and as a list shows them: read from the source, nothing is imported.

An import of all verbs is an import of all of fsmkit, which takes longer than any list should.
"""

from __future__ import annotations

import ast
from functools import cache
from importlib import import_module
from pathlib import Path

import click

FOLDER = Path(__file__).parents[1]
GROUPS = {
    "Write": "writing",
    "Look": "looking",
    "Prove": "proving",
    "Generate": "generating",
    "Test": "testing",
    "Deploy": "deploying",
    "Tools": "tools",
}
"""The groups of verbs in the order in which they are listed, each with its folder."""


@cache
def verbs() -> dict[str, str]:
    """Return the folder of each verb; within a group, in order of name.

    The module of ``trace-requirements`` is ``trace_requirements``.
    """
    return {
        file.stem.replace("_", "-"): folder
        for folder in GROUPS.values()
        for file in sorted((FOLDER / folder).glob("*.py"))
        if not file.stem.startswith("_")
    }


def command_of(verb: str) -> click.Command:
    """Import a verb."""
    command = import_module(f"fsmkit.cli.{verbs()[verb]}.{_module(verb)}").command
    assert isinstance(command, click.Command)  # noqa: S101  (a law of this package)
    return command


def listed(verb: str) -> click.Command:
    """Return a verb that can be listed, but not run.

    Args:
        verb: Its name.

    Returns:
        A command of that name with the help of the verb and no options. Where there is no source
        to read, or another form of ``command`` in it, the verb itself, imported.

    """
    try:
        source = (FOLDER / verbs()[verb] / f"{_module(verb)}.py").read_text(encoding="utf-8")
        tree = ast.parse(source)
    except OSError:
        tree = ast.Module([], [])
    for node in tree.body:
        if isinstance(node, ast.FunctionDef) and node.name == "command":
            return click.Command(verb, help=ast.get_docstring(node))
    return command_of(verb)


def _module(verb: str) -> str:
    return verb.replace("-", "_")
