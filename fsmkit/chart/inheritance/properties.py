"""Inheritance of properties and of the environment.

A derived chart inherits both. It replaces a property only with ``override: [its name]``. Its
external events are those of the base and its own, unless it says ``override: [environment]``.
"""

from __future__ import annotations

from dataclasses import replace

from fsmkit.diagnostics import Findings
from fsmkit.diagnostics.fixes import remove_entry
from fsmkit.diagnostics.suggestions import suggest
from fsmkit.document.document import DocEnvironment, DocProperty, Document, Origin

ENVIRONMENT = "environment"
"""The word under ``override`` that names the environment: the external events."""


def inherited_properties(
    base: Document, derived: Document, findings: Findings
) -> tuple[DocProperty, ...]:
    """Return the properties of the base with their overrides, then the added ones."""
    marked = {name.value for name in derived.overrides}
    found = {one.name.value: replace(one, origin=Origin.INHERITED) for one in base.properties}
    first = {one.name.value: one.name for one in base.properties}
    added = []
    for one in derived.properties:
        before = first.get(one.name.value)
        if before is None:
            added.append(one)
        elif one.name.value in marked:
            found[one.name.value] = replace(one, origin=Origin.OVERRIDDEN)
        else:
            findings.add(
                "redefines-inherited",
                f"the property `{one.name}` is inherited",
                one.name,
                secondary=[(before, "the base declares it")],
                help=f"mark the change with `override: [{one.name}]`, or choose another name",
            )
    return (*found.values(), *added)


def inherited_environment(base: Document, derived: Document) -> DocEnvironment | None:
    """Return the environment of a derived chart: the external events it may receive."""
    old, new = base.environment, derived.environment
    if old is None or new is None:
        return new or old
    if any(name.value == ENVIRONMENT for name in derived.overrides):
        return new
    return DocEnvironment((*old.may, *new.may), (*old.will, *new.will), new.span)


def check_overrides(derived: Document, base: Document | None, findings: Findings) -> None:
    """Report `override` entries that name nothing inherited, or nothing that is replaced."""
    known = [one.name.value for one in base.properties] if base is not None else []
    if base is not None and base.environment is not None:
        known.append(ENVIRONMENT)
    own = {one.name.value for one in derived.properties}
    if derived.environment is not None:
        own.add(ENVIRONMENT)
    for name in derived.overrides:
        if name.value in known and name.value in own:
            continue
        inherited = name.value in known
        findings.add(
            "override-of-nothing",
            f"`{name}` is inherited, but nothing replaces it"
            if inherited
            else f"`{derived.name}` inherits no property `{name}`",
            name,
            help="write what shall count instead, or remove the mark"
            if inherited
            else suggest(name.value, known, "remove the mark"),
            fixes=remove_entry(name),
        )
