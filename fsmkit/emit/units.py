"""Texts in the files of supervisors: units of systemd, configurations of supervisord."""

from __future__ import annotations

import re

from fsmkit.emit.lines import one_line


def unit_text(text: str) -> str:
    """Return a text as the value of a key of a unit: no specifier, no continued line.

    Source: systemd.unit(5), "Specifiers"; systemd.syntax(7).
    """
    return one_line(text).replace("\\", "/").replace("%", "%%")


def unit_word(word: str) -> str:
    """Return a word of ``ExecStart=``, quoted: no specifier, no variable, no escape.

    Source: systemd.service(5), "Command lines".
    """
    inside = word.replace("\\", "\\\\").replace('"', '\\"').replace("%", "%%").replace("$", "$$")
    return f'"{inside}"'


def supervised_text(text: str) -> str:
    """Return a text for a comment of a configuration of supervisord."""
    return one_line(text)


def supervised_word(word: str) -> str:
    """Return a word of supervisord's ``command=``, quoted as for a shell.

    ``%`` is doubled, because values are expanded. ``;`` and ``#`` start a comment after a space,
    even in quotes, so each gets its own quotes.
    """
    if re.fullmatch(r"[\w@+=:,./-]+", word, re.ASCII):
        return word
    inside = word.replace("'", "'\\''").replace("%", "%%")
    return "'" + re.sub(r"([;#])", r"''\1''", inside) + "'"
