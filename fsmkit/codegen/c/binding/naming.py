"""Check the names that a binding chooses against those of the machine."""

from __future__ import annotations

from fsmkit.codegen.c.names import Names
from fsmkit.codegen.existing_c.model import ChosenName
from fsmkit.diagnostics import Findings
from fsmkit.emit import plain

PREFIXED = ("type", "operation")
"""Kinds whose names start with the prefix of the machine, as its functions and types do."""
NUMBERS = ("constant",)


def report_chosen(names: Names, findings: Findings) -> None:
    """Report chosen names that lack the prefix, or that C or the machine uses otherwise."""
    binding = names.options.binding
    if binding is None:
        return
    for chosen in binding.names.values():
        start = f"{names.prefix}_"
        if chosen.kind in PREFIXED and not chosen.text.startswith(start):
            findings.add(
                "unfit-binding",
                f"`{chosen.text}` lacks the prefix of the machine's functions and types",
                chosen.place,
                help=f"name it `{start}{chosen.text}`",
            )
            continue
        found = _found(names, chosen)
        if found is None:
            findings.add(
                "unfit-binding",
                f"the {chosen.kind} `{chosen.name}` has no name in C",
                chosen.place,
                help="only constants that are whole numbers of 32 bits or durations have one",
            )
        elif found.lower() != chosen.text.lower():
            findings.add(
                "c-name-taken",
                f"`{chosen.text}` is taken: the {chosen.kind} `{chosen.name}` would be `{found}`",
                chosen.place,
                help="choose another name",
            )


def _found(names: Names, chosen: ChosenName) -> str | None:
    """Return the identifier in the generated C, or the word that its identifiers contain."""
    kind, name = chosen.kind, chosen.name
    if kind == "type":
        return names.enumerations.get(name) or names.records.get(name)
    if kind == "operation":
        return f"{names.prefix}_{names.operations[name]}"
    if kind in ("data", "input", "output"):
        return names.variables[name].partition(".")[2]
    if kind == "field":
        return names.fields[name]
    if kind == "constant":
        return names.constants.get(name)
    if kind == "member":
        type_, _, member = name.rpartition(".")
        members = next(t.members for t in names.chart.types if plain(str(t)) == type_)  # type: ignore[union-attr]
        return names.members[type_][[plain(m) for m in members].index(member)]
    if kind == "state":
        place = next(s.index for s in names.chart.states if plain(s.id) == name)
        return names.state_names[place]
    place = next(e.index for e in names.chart.events if plain(e.name) == name)
    return names.event_names[place]
