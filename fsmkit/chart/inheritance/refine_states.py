"""Put the states of a derived chart into the tree of its base."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

from fsmkit.chart.inheritance.override_transitions import (
    holds_super,
    insert_super,
    override_transitions,
)
from fsmkit.chart.inheritance.refine_uses import refine_use
from fsmkit.diagnostics import Findings, Fix, Span, Text
from fsmkit.diagnostics.fixes import add_key, remove_entry
from fsmkit.diagnostics.suggestions import suggest
from fsmkit.document import keys
from fsmkit.document.document import HISTORIES, DocState, DocTransition, Document, Kind, Origin
from fsmkit.document.walk import states
from fsmkit.language.statements.tree import Block, Super


def refine_states(root: DocState, derived: Document, findings: Findings) -> DocState:
    """Return the inherited tree with the changes and additions of a derived chart."""
    refiner = _Refiner(derived, findings)
    refiner.places = {s.id.value: s.span for s in states(root) if s.id is not None}
    refiner.collect(derived.refine)
    top = replace(derived.root, id=None, kind=root.kind)
    return refiner.change(refiner.rebuild(root), top, "the chart")


@dataclass
class _Refiner:
    derived: Document
    findings: Findings
    places: dict[str, Span] = field(default_factory=dict)
    """Where each inherited state stands."""
    entries: dict[str, DocState] = field(default_factory=dict)

    def collect(self, refine: tuple[DocState, ...]) -> None:
        """Sort the entries by the id of the inherited state they change."""
        for entry in refine:
            name = "" if entry.id is None else entry.id.value
            at = entry.id or entry.span
            if name not in self.places:
                self.findings.add(
                    "override-of-nothing",
                    f"the base has no state `{name}` to refine",
                    at,
                    help=suggest(name, self.places, "define a new state under `states`"),
                )
            elif name in self.entries:
                self.findings.add(
                    "duplicate-state",
                    f"`{name}` is refined twice",
                    at,
                    secondary=[(self.entries[name].span, "the first")],
                    help="join the two entries",
                )
            else:
                self.entries[name] = entry

    def rebuild(self, state: DocState) -> DocState:
        """Return an inherited state with the changes of all inherited states in it."""
        state = replace(state, children=tuple(self.rebuild(child) for child in state.children))
        entry = None if state.id is None else self.entries.get(state.id.value)
        return state if entry is None else self.change(state, entry, f"`{state.id}`")

    def change(self, base: DocState, entry: DocState, what: str) -> DocState:
        """Return an inherited state with the changes of its entry."""
        if base.kind is Kind.ATOMIC and base.children:  # as another derived chart filled it
            base = replace(base, kind=Kind.COMPOUND)
        self._check_kind(base, entry, what)
        if base.kind is Kind.COMPOUND and entry.kind is Kind.PARALLEL and base.children:
            base = self._with_main_region(base, entry)
        becomes_parallel = entry.kind is Kind.PARALLEL and base.kind is Kind.ATOMIC
        if becomes_parallel:
            base = replace(base, kind=Kind.PARALLEL)
        transitions = override_transitions(base, entry, self.findings)
        children = tuple(c for child in entry.children for c in self._new(child))
        changed = replace(
            base,
            children=(*base.children, *children),
            transitions=transitions,
            initial=self._initial(base, entry, what),
            entry=self._content(base, entry, "entry", what),
            exit=self._content(base, entry, "exit", what),
            invokes=(*base.invokes, *entry.invokes),
            use=refine_use(base, entry, what, self.findings),
            abstract=entry.abstract if entry.id is not None else base.abstract,
            **keys.merge_fields(base, entry, keys.STATE),
            **keys.merge_fields(base, entry, keys.DONE),
        )
        changed = self._with_invariant(changed, entry, what)
        untouched = (
            changed.entry == base.entry
            and changed.exit == base.exit
            and changed.initial == base.initial
            and changed.invariant == base.invariant
            and changed.use == base.use
            and not becomes_parallel
        )
        return changed if untouched else replace(changed, origin=Origin.OVERRIDDEN)

    def _check_kind(self, base: DocState, entry: DocState, what: str) -> None:
        ordinary = (Kind.ATOMIC, Kind.COMPOUND)
        allowed = entry.kind is base.kind or (
            (entry.kind in (*ordinary, Kind.PARALLEL) and base.kind in ordinary)
            or (entry.kind in ordinary)
        )
        if not allowed:
            self.findings.add(
                "forbidden-change",
                f"{what} is {base.kind.value} in the base and cannot become {entry.kind.value}",
                entry.span,
                secondary=[(base.span, "the inherited state")],
                help="keep the kind of the inherited state",
            )

    def _with_main_region(self, base: DocState, entry: DocState) -> DocState:
        """Return a compound state as a parallel one with its old children in the region ``S.main``.

        The region takes over the initial transition and shallow histories. A deep history stays,
        because it remembers all regions.
        """
        name = base.id or Text("", base.span)
        deep = tuple(c for c in base.children if c.kind is Kind.DEEP_HISTORY)
        inner = tuple(c for c in base.children if c.kind is not Kind.DEEP_HISTORY)
        initial = base.initial
        if entry.initial is not None:
            initial = self._initial(base, entry, f"`{base.id}`")
        for transition in base.transitions:
            if transition.internal and transition.targets:
                self.findings.add(
                    "internal-of-parallel",
                    f"this internal transition leaves `{base.id}` now, which has become parallel",
                    transition.span,
                    secondary=[(entry.span, "it gets regions here")],
                    help="target its states from a transition inside of it",
                )
        main = DocState(
            id=replace(name, value=f"{name}.main"),
            kind=Kind.COMPOUND,
            span=base.span,
            initial=initial,
            children=inner,
            origin=Origin.INHERITED,
        )
        return replace(base, kind=Kind.PARALLEL, initial=None, children=(main, *deep))

    def _new(self, state: DocState) -> tuple[DocState, ...]:
        """Return an own state, without those in it that would define an inherited one again."""
        if state.id is not None and state.id.value in self.places:
            self.findings.add(
                "redefines-inherited",
                f"the state `{state.id}` is inherited and cannot be defined again",
                state.id,
                secondary=[(self.places[state.id.value], "the base defines it")],
                help=f"change it under `refine: {{{state.id}: ...}}`, or choose another name",
            )
            return ()
        for transition in state.transitions:
            if transition.override is not None:
                self.findings.add(
                    "override-of-nothing",
                    f"`{state.id}` is a new state: it inherits no transition",
                    transition.override,
                    help="remove `override`",
                    fixes=remove_entry(transition.override),
                )
        return (replace(state, children=tuple(c for s in state.children for c in self._new(s))),)

    def _initial(self, base: DocState, entry: DocState, what: str) -> DocTransition | None:
        if entry.initial is None or base.kind is Kind.PARALLEL:
            return base.initial if entry.initial is None or base.initial is None else entry.initial
        is_change = base.initial is not None or any(
            child.kind not in HISTORIES for child in base.children
        )
        if not is_change:
            return entry.initial
        is_marked = entry.id is None or entry.overrides & {"initial", "default"}
        if not is_marked:
            word = "default" if base.kind in HISTORIES else "initial"
            before = base.initial.span if base.initial is not None else base.span
            self.findings.add(
                "unmarked-override",
                f"`{word}` of {what} replaces the base's",
                entry.initial.span,
                secondary=[(before, "what it replaces")],
                help=f"mark it with `override: [{word}]`, or remove it",
                fixes=_marked(entry, word),
            )
        old = base.initial.content if base.initial is not None else None
        content = entry.initial.content
        return replace(
            entry.initial,
            content=old if content is None else insert_super(content, old or ()),
            origin=Origin.OVERRIDDEN,
        )

    def _content(self, base: DocState, entry: DocState, part: str, what: str) -> tuple[Block, ...]:
        """Return the entry or exit handlers: new ones replace inherited ones, marked so."""
        old, new = (base.entry, entry.entry) if part == "entry" else (base.exit, entry.exit)
        if not new:
            if part in entry.overrides:
                return ()
            return old
        marked = part in entry.overrides or any(holds_super(block) for block in new)
        if old and not marked:
            self.findings.add(
                "unmarked-override",
                f"the {part} content of {what} replaces the base's",
                entry.span,
                secondary=[(base.span, "the inherited state")],
                help=f"write `super` in it where the base's belongs, or mark `override: [{part}]`",
                fixes=_marked(entry, part),
            )
        blocks: list[Block] = []
        for block in new:
            if len(block) == 1 and isinstance(block[0], Super):
                blocks += old
            else:
                blocks.append(insert_super(block, tuple(s for b in old for s in b)))
        return tuple(blocks)

    def _with_invariant(self, state: DocState, entry: DocState, what: str) -> DocState:
        if entry.invariant is None:
            return state
        if state.invariant is not None and "invariant" not in entry.overrides:
            self.findings.add(
                "unmarked-override",
                f"the invariant of {what} replaces the base's",
                entry.invariant,
                secondary=[(state.invariant, "what it replaces")],
                help="mark it with `override: [invariant]`, or remove it",
                fixes=_marked(entry, "invariant"),
            )
        return replace(state, invariant=entry.invariant)


def _marked(entry: DocState, what: str) -> tuple[Fix, ...]:
    """Return the fix that marks a replaced part of a refined state."""
    return () if entry.overrides else add_key(entry.span, "override", f"[{what}]")
