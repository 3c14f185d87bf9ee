"""Templates: files with ``@{name}`` in place of a value."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

FIELD = re.compile(r"^([ \t]*)@\{(\w+)\}\n|@\{(\w+)\}", re.MULTILINE)
"""A field, with its whole line if it is alone there."""

Fields = Mapping[str, str | Sequence[str]]


def filled(template: str, fields: Fields) -> str:
    """Return a template with its fields filled in.

    A field alone on its line becomes as many lines as its value has, each indented as that line.

    Raises:
        KeyError: the template has a field that is not given.

    """

    def value_of(found: re.Match[str]) -> str:
        value = fields[found[2] or found[3]]
        if found[3] is not None:
            return f"{value}"
        lines = f"{value}".splitlines() if isinstance(value, str) else value
        return "".join(f"{found[1]}{line}\n" if line else "\n" for line in lines)

    return FIELD.sub(value_of, template)
