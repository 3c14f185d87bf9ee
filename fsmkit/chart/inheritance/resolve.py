"""Resolve inheritance: clone the base, then apply the derived chart.

From here on there is one Document, without ``extends``, ``refine``, ``override`` and ``super``
(but for ``super`` in guards, whose meaning goes with the transition).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from functools import reduce
from typing import TypeVar

from fsmkit.chart.inheritance.properties import (
    check_overrides,
    inherited_environment,
    inherited_properties,
)
from fsmkit.chart.inheritance.refine_states import refine_states
from fsmkit.diagnostics import Findings, Text
from fsmkit.diagnostics.fixes import remove_entry, set_chart_key
from fsmkit.document import document as doc
from fsmkit.document import keys
from fsmkit.document.walk import states

Item = TypeVar(
    "Item",
    bound=doc.DocType
    | doc.DocFunction
    | doc.DocConstant
    | doc.DocData
    | doc.DocOperation
    | doc.DocEvent
    | doc.DocEntry
    | doc.DocCapacity,
)


@dataclass(frozen=True, slots=True)
class Resolved:
    """A document without inheritance; ``base`` is its direct base, resolved likewise."""

    document: doc.Document
    base: doc.Document | None = None


def resolve_inheritance(documents: tuple[doc.Document, ...], findings: Findings) -> Resolved:
    """Return the document of a file (the first) folded into its bases (nearest first)."""
    derived, *bases = documents
    if not bases:
        return Resolved(_alone(derived, findings))
    root, *between = reversed(bases)
    base = reduce(
        lambda below, above: extend(below, above, findings), between, _alone(root, findings)
    )
    return Resolved(extend(base, derived, findings), base)


def extend(base: doc.Document, derived: doc.Document, findings: Findings) -> doc.Document:
    """Return the derived document with everything it inherits from a resolved base."""
    _check_datamodel(base, derived, findings)
    inherited = _inherited(base)
    check_overrides(derived, base, findings)
    kept = _Declarations(findings)
    return replace(
        derived,
        root=refine_states(inherited.root, derived, findings),
        extends=None,
        refine=(),
        types=kept.add_only(inherited.types, derived.types, "type"),
        constants=kept.override(inherited.constants, derived.constants, _constant),
        data=kept.override(inherited.data, derived.data, _data),
        inputs=kept.override(inherited.inputs, derived.inputs, _data),
        outputs=kept.override(inherited.outputs, derived.outputs, _data),
        operations=kept.add_only(inherited.operations, derived.operations, "operation"),
        functions=kept.add_only(inherited.functions, derived.functions, "function"),
        events=kept.add_only(inherited.events, derived.events, "event"),
        entries=kept.add_only(inherited.entries, derived.entries, "entry point"),
        capacities=kept.override(inherited.capacities, derived.capacities, _capacity),
        properties=inherited_properties(base, derived, findings),
        environment=inherited_environment(base, derived),
        **keys.merge_fields(inherited, derived, keys.CHART),
    )


def _alone(document: doc.Document, findings: Findings) -> doc.Document:
    """Return a document without a base; report constructs that only a derived chart may have."""
    check_overrides(document, None, findings)
    for entry in document.refine:
        findings.add(
            "override-of-nothing",
            f"`{entry.id}` is refined, but chart `{document.name}` extends no other",
            entry.id or entry.span,
            help="name the base chart under `extends`, or define the state under `states`",
        )
    for state in states(document.root):
        for transition in state.transitions:
            if transition.override is not None:
                findings.add(
                    "override-of-nothing",
                    f"a transition is overridden, but chart `{document.name}` extends no other",
                    transition.override,
                    help="remove `override`",
                    fixes=remove_entry(transition.override),
                )
    return document


def _check_datamodel(base: doc.Document, derived: doc.Document, findings: Findings) -> None:
    models = {base.datamodel, derived.datamodel} - {"null"}
    if len(models) > 1:
        findings.add(
            "datamodel-differs",
            f"chart `{derived.name}` has the datamodel `{derived.datamodel}` and its base "
            f"`{base.name}` has `{base.datamodel}`",
            derived.extends or derived.name,
            secondary=[(base.name, "the base")],
            help=f'write `datamodel="{base.datamodel}"` in the derived chart too',
            fixes=set_chart_key(derived.source, "datamodel", base.datamodel),
        )


def _inherited(base: doc.Document) -> doc.Document:
    """Return a clone of the base in which every item is marked inherited."""
    return replace(
        base,
        root=_inherited_state(base.root),
        types=_mark(base.types),
        constants=_mark(base.constants),
        data=_mark(base.data),
        inputs=_mark(base.inputs),
        outputs=_mark(base.outputs),
        operations=_mark(base.operations),
        functions=_mark(base.functions),
        events=_mark(base.events),
        entries=_mark(base.entries),
        capacities=_mark(base.capacities),
    )


def _inherited_state(state: doc.DocState) -> doc.DocState:
    origin = doc.Origin.INHERITED
    return replace(
        state,
        origin=origin,
        initial=state.initial and replace(state.initial, origin=origin),
        children=tuple(_inherited_state(child) for child in state.children),
        transitions=tuple(replace(t, origin=origin) for t in state.transitions),
        data=_mark(state.data),
    )


def _mark(items: tuple[Item, ...]) -> tuple[Item, ...]:
    return tuple(replace(item, origin=doc.Origin.INHERITED) for item in items)


@dataclass(frozen=True, slots=True)
class _Declarations:
    """Merges lists of declarations: inherited ones first, in their order."""

    findings: Findings

    def add_only(
        self, inherited: tuple[Item, ...], own: tuple[Item, ...], what: str
    ) -> tuple[Item, ...]:
        """Return both lists; an inherited name may not be declared anew."""
        names = {item.name.value: item.name for item in inherited}
        kept = []
        for item in own:
            if item.name.value in names:
                self._redefined(item.name, names[item.name.value], what)
            else:
                kept.append(item)
        return (*inherited, *kept)

    def override(
        self,
        inherited: tuple[Item, ...],
        own: Iterable[Item],
        merge: Callable[[Item, Item], Item],
    ) -> tuple[Item, ...]:
        """Return both lists; an own item of an inherited name changes that one in place."""
        merged = {item.name.value: item for item in inherited}
        added = []
        for item in own:
            name = item.name.value
            if name in merged and merged[name].origin is doc.Origin.INHERITED:
                merged[name] = replace(merge(merged[name], item), origin=doc.Origin.OVERRIDDEN)
            else:
                added.append(item)
        return (*merged.values(), *added)

    def _redefined(self, name: Text, base: Text, what: str) -> None:
        self.findings.add(
            "redefines-inherited",
            f"the {what} `{name}` is inherited and cannot be declared again",
            name,
            secondary=[(base, "the base declares it")],
            help="remove the declaration, or choose another name",
            fixes=remove_entry(name, whole=True),
        )


def _constant(base: doc.DocConstant, own: doc.DocConstant) -> doc.DocConstant:
    return replace(base, name=own.name, value=own.value)


def _data(base: doc.DocData, own: doc.DocData) -> doc.DocData:
    return replace(base, name=own.name, type=own.type or base.type, init=own.init or base.init)


def _capacity(base: doc.DocCapacity, own: doc.DocCapacity) -> doc.DocCapacity:
    return replace(base, value=own.value)
