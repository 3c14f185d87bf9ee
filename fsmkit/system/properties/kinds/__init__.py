"""One kind of property a file: a module that defines ``KIND``."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from importlib import import_module
from pkgutil import iter_modules

from fsmkit.system.properties.property import Kind


@cache
def kinds() -> Mapping[str, Kind]:
    """Return all kinds by their keys."""
    modules = (import_module(f"{__name__}.{found.name}") for found in iter_modules(__path__))
    return {module.KIND.key: module.KIND for module in modules}
