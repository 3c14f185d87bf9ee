"""The keys of the project file: the reader and the JSON Schema go by them."""

from __future__ import annotations

from fsmkit.document.keys import Key, Keys


def _named(**docs: str) -> Keys:
    return {name: Key(name, doc) for name, doc in docs.items()}


PROJECT = _named(
    search="folders with charts that others extend, use, invoke or run in a system",
    exclude="folders and files that no search of a folder takes",
    rules="for rules by name or code: off, note, warning or error",
    check="defaults of `fsmkit check`",
    compile="defaults of `fsmkit compile`",
)
CHECK = _named(timeout="give up after that long, such as 60s", memory="the most to use, such as 2G")
COMPILE = _named(target="the target, such as c", out="the folder of the generated files")
LEVELS = ("off", "note", "warning", "error")
"""The levels of a rule."""
