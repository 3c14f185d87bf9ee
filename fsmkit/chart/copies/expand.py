"""Put the states of used charts, as stubs, below the states that they fill."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from typing import Protocol

from fsmkit.chart.chart import Chart
from fsmkit.chart.copies.copy import Copy, Used
from fsmkit.diagnostics import Findings, Span, Text
from fsmkit.diagnostics.suggestions import suggest
from fsmkit.document.document import DocExit, DocState, DocTransition, Document, DocUse, Kind
from fsmkit.document.walk import states
from fsmkit.language import IntType, Literal, Scope
from fsmkit.language.constants import constant_value

DEEPEST = 6
"""Charts used within each other."""
MOST_COPIES = 1024
"""Elements of one array."""
EACH = re.compile(r"([^\W\d]\w*)\s+in\s+(.+?)\s*\.\.\s*(.+)", re.DOTALL)
WORDS = frozenset(
    ("and", "event", "exit", "false", "In", "not", "or", "super", "true", "True", "False")
)
"""Names that mean something else in expressions."""


class ElaborateUsed(Protocol):
    """Elaborates a chart that is used, with values for its constants (`chart.elaborate`)."""

    def __call__(
        self,
        documents: tuple[Document, ...],
        findings: Findings,
        *,
        strict: bool,
        constants: dict[str, Literal],
    ) -> Used | None:
        """Return the chart, or None if it has errors."""
        ...


def has_copies(document: Document) -> bool:
    """Whether a state uses a chart or is an element of an array of states."""
    return any(
        state.use is not None or state.index_range is not None for state in states(document.root)
    )


def expand(
    document: Document, scope: Scope, elaborate: ElaborateUsed, findings: Findings, *, strict: bool
) -> tuple[Document, tuple[Copy, ...]]:
    """Return the document with the states of each copy below its using state, and the copies.

    ``scope`` holds the constants. For a state in a copy, the document has its id and its kind. A
    bound exit point also has the transitions that follow it. All other parts are copied once typed.
    """
    expander = _Expander(scope, elaborate, findings, strict)
    top = tuple(part for child in document.root.children for part in expander.expanded(child))
    return replace(document, root=replace(document.root, children=top)), tuple(expander.copies)


@dataclass
class _Expander:
    scope: Scope
    elaborate: ElaborateUsed
    findings: Findings
    strict: bool
    copies: list[Copy] = field(default_factory=list)
    known: dict[tuple[object, ...], Used | None] = field(default_factory=dict)

    def expanded(self, state: DocState) -> Iterator[DocState]:
        """Yield the expansion of a state; for an array of states, each of its elements."""
        if state.use is None and state.index_range is None:
            children = tuple(part for child in state.children for part in self.expanded(child))
            yield state if children == state.children else replace(state, children=children)
            return
        if not self._is_sound(state):
            return
        name = "" if state.id is None else state.id.value
        if state.index_range is None:
            yield self._filled(state, name, {})
            return
        for variable, number in self._indices(state.index_range):
            value = Literal(number, IntType(number, number), state.index_range.span)
            yield self._filled(state, f"{name}.{number}", {variable: value})

    def _is_sound(self, state: DocState) -> bool:
        """Report a using state that cannot be one."""
        if state.use is None or state.use.chart is None:
            at = state.span if state.use is None else state.use.span
            self.findings.add(
                "missing-key",
                f"`{state.id}` does not say which chart fills it",
                at,
                help="name its file under `use`",
            )
            return False
        if state.kind not in (Kind.ATOMIC, Kind.COMPOUND) or state.children:
            held = "holds states of its own" if state.children else f"is {state.kind.value}"
            self.findings.add(
                "bad-use",
                f"`{state.id}` is filled by a chart and {held}",
                state.use.span,
                help="move one of the two to another state",
            )
            return False
        if state.id is None or not state.id.value.isidentifier() or state.id.value in WORDS:
            self.findings.add(
                "bad-use",
                f"`{state.id or ''}` cannot be the name of a copy",
                state.id or state.span,
                help="give it a name of letters, digits and `_`: names of the chart follow its dot",
            )
            return False
        return True

    def _indices(self, index_range: Text) -> Iterator[tuple[str, int]]:
        """Yield the index and each of its values; a bad range is a finding."""
        match = EACH.fullmatch(index_range.value)
        if match is None:
            self._bad_index(index_range, "this is no range", "write it as `axis[i in 0..1]`")
            return
        low, high = (self._number(index_range.part(*match.span(n))) for n in (2, 3))
        if low is None or high is None:
            return
        if not 0 <= low <= high or high - low >= MOST_COPIES:
            message = f"an index cannot run from {low} to {high}"
            self._bad_index(index_range, message, f"count upwards, at most {MOST_COPIES} copies")
            return
        yield from ((match[1], number) for number in range(low, high + 1))

    def _number(self, text: Text) -> int | None:
        value = constant_value(text, self.scope, self.findings)
        if value is None:
            return None
        if not isinstance(value.type, IntType) or not isinstance(value.value, int):
            self._bad_index(text, f"`{text}` is no whole number", "write `0..3`")
            return None
        return value.value

    def _bad_index(self, at: Text, message: str, advice: str) -> None:
        self.findings.add("bad-index", message, at, help=advice)

    def _filled(self, state: DocState, prefix: str, index: dict[str, Literal]) -> DocState:
        """Return a state with the stubs of its copy."""
        use = state.use
        assert use is not None  # noqa: S101  (`_is_sound`)
        id_ = Text(prefix, state.span if state.id is None else state.id.span, ())
        state = replace(state, id=id_, index_range=None, kind=Kind.COMPOUND)
        used = self._used(use, index)
        if used is None:
            return state
        copy = Copy(len(self.copies), prefix, use, state, used, index)
        self.copies.append(copy)
        exits = {used.exits[e.name.value][0]: e for e in self._exits(copy)}
        children = tuple(
            _stub(used.chart, child, copy, exits) for child in used.chart.root.children
        )
        return replace(state, children=children, copy=copy.number)

    def _exits(self, copy: Copy) -> Iterator[DocExit]:
        """Yield the exits that are bound; one that is not there, or twice, is a finding."""
        seen: set[str] = set()
        known = copy.used.exits
        for one in copy.use.exits:
            if one.name.value not in known:
                other = ", ".join(f"`{name}`" for name in known)
                advice = f"its exit points are {other}" if known else "it has no final state"
                _unknown(copy, "exit point", one.name, list(known), advice, self.findings)
            elif one.name.value in seen:
                self.findings.add(
                    "duplicate-argument",
                    f"the exit point `{one.name}` is bound twice",
                    one.name,
                    help="remove one of the two",
                )
            else:
                yield one
            seen.add(one.name.value)

    def _used(self, use: DocUse, index: dict[str, Literal]) -> Used | None:
        """Return a used chart with the constants that it is given here."""
        scope = replace(self.scope, constants={**self.scope.constants, **index})
        given: dict[str, Literal] = {}
        names = {c.name.value for document in use.loaded for c in document.constants}
        for one in use.constants:
            value = constant_value(one.value, scope, self.findings)
            if one.name.value not in names:
                advice = f"declare it under `constants` of `{use.chart}`"
                chart = use.loaded[0].name.value if use.loaded else str(use.chart)
                self.findings.add(
                    "unknown-binding",
                    f"`{chart}` has no constant `{one.name}`",
                    one.name,
                    help=suggest(one.name.value, names, advice),
                )
            elif value is not None:
                given[one.name.value] = value
        if len(given) < len(use.constants) or not use.loaded:
            return None
        key = (use.loaded[0].source.name, *((n, v.value, v.type) for n, v in sorted(given.items())))
        if key not in self.known:
            own = Findings()
            self.known[key] = self.elaborate(use.loaded, own, strict=self.strict, constants=given)
            self.findings.extend(own)
            self._check(self.known[key], use)
        return self.known[key]

    def _check(self, used: Used | None, use: DocUse) -> None:
        """Report a chart that cannot be used."""
        if used is None or use.chart is None:
            return
        chart = used.chart
        if chart.abstract:
            self.findings.add(
                "abstract-chart",
                f"chart `{chart.name}` is abstract: it fills no state",
                use.chart,
                help="use a chart that extends it",
            )
        if used.depth > DEEPEST:
            self.findings.add(
                "bad-use",
                f"{used.depth} charts are used within each other",
                use.chart,
                help=f"keep to {DEEPEST} levels",
            )
        if used.datamodel != self.scope.dialect:
            self._not_in_a_copy(
                f"`{chart.name}` has the datamodel `{used.datamodel}`, and this chart has "
                f"`{self.scope.dialect}`",
                use.chart,
                "give both the same datamodel",
            )
        if chart.capacities.tick != self.scope.tick:
            self.findings.add(
                "different-ticks",
                f"a tick of `{chart.name}` lasts {chart.capacities.tick}us, one of this chart "
                f"{self.scope.tick}us",
                use.chart,
                help="give both the same `tick` under `capacity`",
            )

    def _not_in_a_copy(self, message: str, at: Text | Span, advice: str) -> None:
        self.findings.add("not-in-a-copy", message, at, help=advice)


def _unknown(
    copy: Copy, what: str, name: Text, known: list[str], otherwise: str, findings: Findings
) -> None:
    findings.add(
        "unknown-binding",
        f"`{copy.used.chart.name}` has no {what} `{name}`",
        name,
        help=suggest(name.value, known, otherwise),
    )


def _stub(chart: Chart, index: int, copy: Copy, exits: dict[int, DocExit]) -> DocState:
    """Return a state of a copy, with those below it."""
    state = chart.states[index]
    transitions: tuple[DocTransition, ...] = ()
    kind = state.kind
    if index in exits:
        transitions = exits[index].transitions
        kind = Kind.CHOICE
    return DocState(
        id=Text(copy.name(state.id), state.span, ()),
        kind=kind,
        span=state.span,
        children=tuple(_stub(chart, child, copy, exits) for child in state.children),
        transitions=transitions,
        origin=state.origin,
        copy=copy.number,
        copied=index,
    )
