"""Inline functions of a chart into conditions over a system, with the condition's variables."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields, is_dataclass, replace
from typing import Any

from fsmkit.language import FunctionBody, InState, Storage, Type, Variable
from fsmkit.language.walk import child_getter

Read = Callable[[Variable | InState], Variable]
"""Returns the condition's variable for one of the chart, or for whether a state is active."""


def inline_function(function: FunctionBody, name: str, read: Read) -> FunctionBody:
    """Return a renamed function whose variables are those of the condition."""
    changed: FunctionBody = _rename_variables(function, read)
    return replace(changed, name=name)


def _rename_variables(part: Any, read: Read) -> Any:
    if isinstance(part, tuple):
        return tuple(_rename_variables(each, read) for each in part)
    if isinstance(part, InState) or (
        isinstance(part, Variable) and part.storage is not Storage.LOCAL
    ):
        return read(part)
    if (
        not is_dataclass(part)
        or isinstance(part, type | Type)
        or child_getter(part.__class__) is None
    ):
        return part
    values = {field.name: getattr(part, field.name) for field in fields(part) if field.init}
    new = {name: _rename_variables(value, read) for name, value in values.items() if name != "span"}
    return replace(
        part, **{name: value for name, value in new.items() if value is not values[name]}
    )
