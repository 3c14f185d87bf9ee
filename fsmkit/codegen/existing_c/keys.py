"""The keys of a binding, as tables for the reader and the JSON Schema."""

from __future__ import annotations

from fsmkit.document.keys import named

BINDING = named(
    binding="the name of the chart",
    chart="the file of the chart",
    extends="the binding of its base",
    doc="what it is for",
    include="the headers of the host",
    context="the struct that the machine is embedded in: `ctx` in expressions",
    constants="constants of the chart, and what they are in the headers",
    types="enumerations and records, and the types of C that they are",
    operations="operations, and the expressions that call them",
    sends="events that leave the machine, and the expressions that deliver them",
    inputs="inputs, and the expressions that they are read from",
    outputs="outputs, and what they are assigned to",
    names="what generated C calls something of the chart",
    exports="constants of the chart in the header",
)
CONTEXT = named(
    type="the type that `ctx` points to",
    member="the member of it that the machine is",
    expression="or an expression of `m` that is such a pointer",
)
TYPE = named(
    type="the type in C",
    members="of an enumeration: each member and its constant",
    fields="of a record: each field and its member",
)
OPERATION = named(call="the expression", trusted="true: the result is not tested against its range")
INPUT = named(get="the expression", trusted="true: the value is not tested against its range")
OUTPUT = named(set="an expression with `value`")
KINDS = (
    "type",
    "member",
    "operation",
    "event",
    "state",
    "data",
    "input",
    "output",
    "constant",
    "field",
)
"""The kinds of names under `names`."""
