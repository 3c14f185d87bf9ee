"""Names of a chart that differ in C."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from fsmkit.codegen.c.names import Names
from fsmkit.codegen.c.naming import event_words
from fsmkit.diagnostics import Findings, Severity
from fsmkit.emit import legal, snake
from fsmkit.emit import plain as unguarded
from fsmkit.language import EnumType

MOST = 5
"""The greatest number of names in a message."""


@dataclass(frozen=True, slots=True)
class Renamed:
    """A name of the chart that a host reads in C: its kind, its C text, its default C text."""

    kind: str
    name: str
    text: str
    default: str


def report_names(names: Names, findings: Findings, *, is_prefixed: bool = False) -> None:
    """Add a note with the names of a machine, and of those that it invokes, that differ in C."""
    own = snake(names.chart.name)
    changed = []
    if not (is_prefixed or names.is_invoked) and names.prefix != own:
        changed.append(f"machine `{own}` is `{names.prefix}`")
    changed += [f"{each.kind} `{each.name}` is `{each.text}`" for each in renamed(names)]
    if changed:
        more = f" and {len(changed) - MOST} more" if len(changed) > MOST else ""
        findings.add(
            "c-name-taken",
            f"some names are different in C: {', '.join(changed[:MOST])}{more}",
            names.chart.root.span, severity=Severity.NOTE,
            help="the header lists them; `--prefix` chooses the name of the machine",
        )  # fmt: skip
    for inner in names.invoked:
        report_names(inner, findings)


def renamed(names: Names) -> list[Renamed]:
    """Return the names that differ in C, or in case.

    The binding's own choices are not among them.
    """
    is_chosen = names.options.chosen.is_chosen
    return [
        each
        for each in _declared(names)
        if (each.text != each.default or not each.name.isascii())
        and not is_chosen(each.kind, each.name)
    ]


def _declared(names: Names) -> Iterator[Renamed]:
    """Yield every name of the chart that a host reads in C."""
    chart, p, upper = names.chart, names.prefix, names.upper
    for kind, types in (("type", names.enumerations), ("record", names.records)):
        for name, c in types.items():
            yield Renamed(kind, name, c, f"{p}_{snake(name)}")
    for operation in chart.operations:
        c, plain = names.operations[operation.name], snake(operation.name)
        yield Renamed("operation", operation.name, f"{p}_{c}", f"{p}_{plain}")
    called = event_words(chart)
    for place, event in enumerate(chart.events):
        post = f"{p}_post_{snake(called[place])}"
        yield Renamed("event", event.name, f"{p}_post_{names.event_names[place]}", post)
        wanted = f"{upper}_EVENT_{legal(called[place])}".upper()
        yield Renamed("event", event.name, names.events[place], wanted)
    for state, c in zip(chart.states[1:], names.states[1:], strict=True):
        yield Renamed("state", state.id, c, f"{upper}_STATE_{legal(state.id)}".upper())
    for variable in (*chart.inputs, *chart.outputs, *chart.data):
        c = names.variables[variable.name]
        wanted = f"{c.partition('.')[0]}.{unguarded(variable.name)}"
        yield Renamed("variable", variable.name, c, wanted)
    for name, c in names.fields.items():
        yield Renamed("field", name, c, unguarded(name))
    for name, c in names.constants.items():
        yield Renamed("constant", name, c, f"{upper}_{snake(name).upper()}")
    for type_ in chart.types:
        if isinstance(type_, EnumType):
            for name, c in zip(type_.members, names.members[type_.name], strict=True):
                wanted = f"{upper}_{snake(type_.name)}_{legal(name)}".upper()
                yield Renamed("member", name, c, wanted)
