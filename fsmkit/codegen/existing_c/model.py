"""A binding as in its file: the names of a chart in a host's headers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum

from fsmkit.codegen.existing_c.tokens import CExpression
from fsmkit.diagnostics import Span, Text


class Exports(Enum):
    """The form of a chart's constants in the header of its machine."""

    DEFINE = "define"
    ENUM = "enum"
    NONE = "none"


@dataclass(frozen=True, slots=True)
class Context:
    """The expressions' variable ``ctx``: a pointer to ``type``.

    Its value is the struct of that type with the machine as ``member``, or an ``expression`` of the
    machine ``m``.
    """

    type: str
    member: str
    expression: CExpression | None
    place: Text


@dataclass(frozen=True, slots=True)
class Bound:
    """A name of the chart and its expression in C.

    ``is_trusted``: its values are not checked against the range of the chart. ``is_setter``: for an
    output, the expression is evaluated with ``value`` instead of being assigned to.
    """

    name: Text
    expression: CExpression
    is_trusted: bool = False
    is_setter: bool = False


@dataclass(frozen=True, slots=True)
class Path:
    """A field of the chart's record and the member of the C type."""

    name: Text
    member: Text


@dataclass(frozen=True, slots=True)
class BoundType:
    """An enumeration or a record of the chart, and its C type."""

    name: Text
    type: str
    members: Mapping[str, Bound]
    fields: Mapping[str, Path]


@dataclass(frozen=True, slots=True)
class ChosenName:
    """A chosen name in generated C."""

    kind: str
    name: str
    text: str
    place: Text


@dataclass(frozen=True, eq=False)
class Binding:
    """A binding with those it extends: the nearest entry for a name counts.

    ``includes``: the arguments of ``#include``, with quotes or angle brackets. ``names``: by kind
    and name.
    """

    name: Text
    chart: Text
    span: Span
    includes: tuple[str, ...] = ()
    context: Context | None = None
    constants: Mapping[str, Bound] = field(default_factory=dict)
    types: Mapping[str, BoundType] = field(default_factory=dict)
    operations: Mapping[str, Bound] = field(default_factory=dict)
    sends: Mapping[str, Bound] = field(default_factory=dict)
    inputs: Mapping[str, Bound] = field(default_factory=dict)
    outputs: Mapping[str, Bound] = field(default_factory=dict)
    names: Mapping[tuple[str, str], ChosenName] = field(default_factory=dict)
    exports: Exports | None = None
    extends: Text | None = None

    def chosen(self, kind: str, name: str) -> str | None:
        """Return the chosen name of an item, or None."""
        found = self.names.get((kind, name))
        return None if found is None else found.text
