"""Frozen dataclasses with a fast constructor.

A frozen dataclass stores each field through `object.__setattr__`, which looks up the slot by name
every time. Reading and compiling a chart creates millions of such objects, which took nearly a
third of the front end's time. `fast_init` stores through the slots themselves. Parameters,
defaults, equality, hash and immutability stay the same.
"""

from __future__ import annotations

from dataclasses import MISSING, Field, fields
from typing import Any, TypeVar

Kind = TypeVar("Kind", bound=type[Any])


def fast_init(kind: Kind) -> Kind:
    """Give a frozen dataclass with slots an ``__init__`` that stores its fields faster.

    Raises:
        TypeError: A field has a factory, is keyword-only, or is not a slot.

    """
    found: tuple[Field[Any], ...] = fields(kind)
    is_plain = all(f.default_factory is MISSING and f.init and not f.kw_only for f in found)
    if not is_plain or kind.__init__.__code__.co_argcount != len(found) + 1:
        raise TypeError(
            f"`{kind.__name__}` has a factory, a keyword-only field or a field without slot"
        )
    names = [field.name for field in found]
    scope: dict[str, Any] = {f"_set_{name}": getattr(kind, name).__set__ for name in names}
    scope |= {f"_default_{f.name}": f.default for f in found if f.default is not MISSING}
    parameters = ", ".join(
        name if f"_default_{name}" not in scope else f"{name}=_default_{name}" for name in names
    )
    body = [f"_set_{name}(self, {name})" for name in names]
    if hasattr(kind, "__post_init__"):
        body.append("self.__post_init__()")
    # generated from the fields, as dataclasses generate their own methods
    exec(f"def __init__(self, {parameters}):\n " + "\n ".join(body), scope)  # noqa: S102
    own = scope["__init__"]
    own.__qualname__, own.__module__ = f"{kind.__qualname__}.__init__", kind.__module__
    own.__annotations__ = dict(kind.__init__.__annotations__)
    kind.__init__ = own
    return kind
