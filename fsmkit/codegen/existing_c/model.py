"""A binding as its file has it: what names of a chart are in the headers of a host."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum

from fsmkit.codegen.existing_c.tokens import CExpression
from fsmkit.diagnostics import Span, Text


class Exports(Enum):
    """How the constants of a chart stand in the header of its machine."""

    DEFINE = "define"
    ENUM = "enum"
    NONE = "none"


@dataclass(frozen=True, slots=True)
class Context:
    """What expressions call ``ctx``: a pointer to ``type``.

    It is found by the ``member`` of that type that the machine is, or is an ``expression`` of the
    machine ``m``.
    """

    type: str
    member: str
    expression: CExpression | None
    place: Text


@dataclass(frozen=True, slots=True)
class Bound:
    """A name of the chart and the expression that it is in C.

    ``is_trusted``: a value that it gives is not tested against the range of the chart.
    ``is_setter``: of an output: it is evaluated with ``value``, not assigned to.
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
    """An enumeration or a record of the chart, and the type of C that it is."""

    name: Text
    type: str
    members: Mapping[str, Bound]
    fields: Mapping[str, Path]


@dataclass(frozen=True, slots=True)
class ChosenName:
    """What something of the chart is to be called in generated C."""

    kind: str
    name: str
    text: str
    place: Text


@dataclass(frozen=True, eq=False)
class Binding:
    """A binding with those it extends: the nearest entry for a name counts.

    ``includes``: as they follow ``#include``, with quotes or angle brackets. ``names``: by kind
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
        """Return how something is to be called; None where nothing is said."""
        found = self.names.get((kind, name))
        return None if found is None else found.text
