"""Two parameters of one name are two fields, and the last of them has the name (SCXML 5.7, 6.2).

All of them go with the event; ``_event.data.x`` reads the last that is written, as in ECMAScript.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from itertools import count

from fsmkit.language.statements.tree import DocArgument, DocSend


def with_fields_of_their_own(send: DocSend) -> DocSend:
    """Return a send in which each value has a name of its own; ``namelist`` comes first."""
    listed = tuple(DocArgument(name, name) for name in send.name_list)
    written = (*listed, *send.arguments)
    if not _repeated(written):
        return send
    return replace(send, arguments=apart(written), name_list=())


def apart(arguments: tuple[DocArgument, ...]) -> tuple[DocArgument, ...]:
    """Return the same values, but the earlier ones of a name as ``name_1``, ``name_2`` ..."""
    if not _repeated(arguments):
        return arguments
    left = Counter(argument.name.value for argument in arguments)
    taken = set(left)
    found: list[DocArgument] = []
    for argument in arguments:
        name = argument.name.value
        left[name] -= 1
        if left[name]:
            own = next(n for i in count(1) if (n := f"{name}_{i}") not in taken)
            taken.add(own)
            found.append(replace(argument, name=argument.name.instead(own)))
        else:
            found.append(argument)
    return tuple(found)


def _repeated(arguments: tuple[DocArgument, ...]) -> bool:
    return len({argument.name.value for argument in arguments}) < len(arguments)
