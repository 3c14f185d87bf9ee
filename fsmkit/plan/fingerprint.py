"""The hash of a chart: equal for charts of equal meaning, in every process and runtime."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import fields, is_dataclass
from enum import Enum
from functools import cache
from hashlib import sha256
from typing import Any

from fsmkit.chart.chart import Chart
from fsmkit.chart.forms import by_form
from fsmkit.chart.statements import STATEMENTS
from fsmkit.diagnostics import Source, Span
from fsmkit.language.types import Type

PLAIN = re.compile(r"(?:str|int|bool|float|None|[ |])+")
"""Types of fields whose values are formatted with ``repr``."""
MEMO = "_fingerprint"
"""The attribute of a chart that caches its hash."""


def fingerprint(chart: Chart) -> str:
    """Return a hash of a chart's meaning; locations and comments do not count."""
    if MEMO not in chart.__dict__:
        chart.__dict__[MEMO] = sha256(_canonical(chart).encode()).hexdigest()
    return str(chart.__dict__[MEMO])


def _canonical(node: Any) -> str:
    """Return the text of a value without locations, equal in every process."""
    return _writer(node.__class__)(node)


@cache
def _writer(kind: type[Any]) -> Callable[[Any], str]:
    """Return the function that formats values of a class."""
    name = kind.__name__
    if issubclass(kind, Enum):
        return lambda node: f"{name}.{node.name}"
    if kind in (Span, Source):
        return lambda _: ""
    if issubclass(kind, tuple):
        return lambda node: f"({','.join([_writer(n.__class__)(n) for n in node])})"
    if issubclass(kind, frozenset):
        return lambda node: f"{{{','.join(sorted(map(_canonical, node)))}}}"
    if not is_dataclass(kind):
        return repr
    told = [f for f in fields(kind) if f.compare and f.name not in ("doc", "origin")]
    parts = ",".join(f"{f.name}={{{_field_expression(f.name, str(f.type))}}}" for f in told)
    scope = {"writer": _writer, "guard": by_form(_canonical)}
    # made of the fields, as a dataclass makes its own methods: a chart has very many nodes
    written: Callable[[Any], str] = eval(f"lambda node: f'{name}({parts})'", scope)  # noqa: S307
    if issubclass(kind, Type):
        return cache(written)
    return by_form(written) if kind in STATEMENTS else written


def _field_expression(name: str, type_: str) -> str:
    """Return the expression that formats a field; ``name``: the field's name in its class."""
    if PLAIN.fullmatch(type_):
        return f"node.{name}!r"
    if name == "guard":
        return f"guard(node.{name})"
    return f"writer(node.{name}.__class__)(node.{name})"
