"""Runtime text with optional lines: conditions on facts that are decided at compile time.

The C pieces and the Python runtime are source files that compilers and linters read as they are.
A line ``#if FACT`` (``# if FACT`` in Python), ``#elif``, ``#else`` or ``#endif`` keeps or drops the
lines that follow. A condition joins facts by ``&&`` and ``||`` and negates one by ``!``. The
preprocessor's ``#ifdef`` and ``#ifndef`` belong to the host and stay, with their ``#endif``.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping

Facts = Mapping[str, bool]
"""Whether a machine has a mechanism, by the name that conditions use."""
_CONDITION = re.compile(r" *# ?(?:(if|elif) ([A-Z_!&| ]+)|(else|endif))$")
_OF_HOST = ("#ifdef ", "#ifndef ")


def selected(lines: Iterable[str], facts: Facts) -> Iterator[str]:
    """Yield the lines whose conditions hold; KeyError for a fact that is not in ``facts``."""
    open_: list[tuple[bool | None, bool]] = []
    """For each open condition: whether it holds, None for the host's; whether a branch held."""
    for line in lines:
        found = _CONDITION.match(line)
        word = "" if found is None else found[1] or found[3]
        if word == "if":
            assert found is not None  # noqa: S101
            holds = _holds(found[2], facts)
            open_.append((holds, holds))
        elif word and open_[-1][0] is not None:
            assert found is not None  # noqa: S101
            if word == "endif":
                open_.pop()
            else:
                before = open_[-1][1]
                holds = not before and (word == "else" or _holds(found[2], facts))
                open_[-1] = holds, before or holds
        else:
            if all(holds is not False for holds, _ in open_):
                yield line
            if line.startswith(_OF_HOST):
                open_.append((None, False))
            elif word == "endif":
                open_.pop()


def _holds(condition: str, facts: Facts) -> bool:
    return any(
        all(facts[term.lstrip("!")] is not term.startswith("!") for term in each.split(" && "))
        for each in condition.split(" || ")
    )
