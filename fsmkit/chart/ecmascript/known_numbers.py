"""The integers that each variable can hold, if they are few and known at compile time.

A range that is declared, or the positions of arrays in loops. As part of a string a number is
written as it is (ECMA-262, Number::toString).
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Mapping
from itertools import chain

from fsmkit.diagnostics import Text
from fsmkit.document.document import DocData, DocInvoke
from fsmkit.language.constants import is_list, split_list
from fsmkit.language.statements.tree import Assign, DocSend, ForEach

MOST_NUMBERS = 256
"""The most known numbers of a variable; with more, its value counts as unknown."""
RANGE = re.compile(r"\s*(-?\d{1,6})\s*\.\.\s*(-?\d{1,6})\s*")
LENGTH = re.compile(r"\[\s*(\d{1,6})\s*\]\s*\Z")
WHOLE = re.compile(r"\s*(\d{1,6})\s*")


def find_numbers(
    whole: Iterable[object], others: Collection[str] = ()
) -> Mapping[str, tuple[int, ...]]:
    """Return the numbers that variables can hold, in order; ``whole`` are parts of a document.

    The index of loops is known if all arrays are, and nothing else assigns it. ``others`` are
    variables with external assignments: only a declared range bounds them.
    """
    listed = tuple(whole)
    data = {part.name.value: part for part in listed if isinstance(part, DocData)}
    found: dict[str, set[int] | None] = dict.fromkeys(others)
    for part in listed:
        match part:
            case ForEach(array=array, item=item, index=index):
                found[item.value.strip()] = None
                if index is not None:
                    _add(found, index.value.strip(), _positions(data.get(array.value.strip())))
            case Assign(location=location) | DocSend(id_location=Text() as location):
                found[location.value.strip()] = None
            case DocInvoke(id_location=location, name_list=inside):
                names = (*inside, *([] if location is None else [location]))
                found |= dict.fromkeys(name.value.strip() for name in names)
            case DocData(name=name, init=init) if init is not None or part.type is not None:
                _add(found, name.value, _start(part))
            case _:
                pass
    found |= {name: set(held) for name, each in data.items() if (held := _range(each.type))}
    return {
        name: tuple(sorted(held))
        for name, held in found.items()
        if held is not None and 0 < len(held) <= MOST_NUMBERS
    }


def _add(found: dict[str, set[int] | None], name: str, numbers: Iterable[int] | None) -> None:
    held = found.get(name, set())
    found[name] = None if held is None or numbers is None else set(chain(held, numbers))


def _start(data: DocData) -> Iterable[int] | None:
    """Return the start value, or None if it is not a number or the type sets another one."""
    match = None if data.init is None or data.type is not None else WHOLE.fullmatch(data.init.value)
    return None if match is None else (int(match[1]),)


def _positions(array: DocData | None) -> Iterable[int] | None:
    if array is None:
        return None
    declared = None if array.type is None else LENGTH.search(array.type.value)
    if declared is not None:
        return range(int(declared[1]))
    is_known = array.type is None and array.init is not None and is_list(array.init)
    return range(len(split_list(array.init))) if is_known and array.init is not None else None


def _range(type_: Text | None) -> Iterable[int]:
    match = None if type_ is None else RANGE.fullmatch(type_.value)
    if match is None:
        return ()
    first, last = int(match[1]), int(match[2])
    return range(first, last + 1) if last - first < MOST_NUMBERS else ()
