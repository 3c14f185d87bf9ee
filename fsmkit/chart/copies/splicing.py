"""Splice the typed parts of used charts into the chart that uses them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace

import fsmkit.language as lang
from fsmkit.chart.chart import (
    Chart,
    CopyOf,
    Data,
    Event,
    Invocation,
    Operation,
    Passage,
    State,
    Transition,
)
from fsmkit.chart.copies.bound_names import Binder, mapper_of
from fsmkit.chart.copies.copy import Copy, Place
from fsmkit.chart.copies.declarations import (
    mapped_fields,
    own_data,
    own_operations,
    start_values,
)
from fsmkit.chart.copies.mapping import Mapper, mapped_type
from fsmkit.chart.passes.collect_events import Events
from fsmkit.chart.passes.collect_names import Names
from fsmkit.chart.passes.number_states import Tree
from fsmkit.chart.statements import Assign, Block
from fsmkit.diagnostics import Findings
from fsmkit.document import keys
from fsmkit.document.document import Kind
from fsmkit.language.walk import nodes

KEPT = tuple(row.field for row in keys.kept_keys(keys.STATE, State) if row.field != "abstract")
"""The fields that a state of a copy has from the used chart as they are."""


@dataclass(frozen=True, slots=True)
class Spliced:
    """The copies of a chart. ``mappers`` and ``starts`` go by copy.

    ``bases``: the index of the state that each fills. ``places``: what more is known where content
    of a using state or of an exit point stands.
    """

    copies: tuple[Copy, ...]
    bases: tuple[int, ...]
    slots: tuple[int, ...]
    mappers: tuple[Mapper, ...]
    starts: tuple[Mapping[str, lang.Literal], ...]
    places: Mapping[int, Place]

    def readable(self, scope: lang.Scope) -> lang.Scope:
        """Return a scope that also has the bound names of copies."""
        found = dict(scope.copies)
        for copy, mapper in zip(self.copies, self.mappers, strict=True):
            found |= {copy.name(name): expr for name, expr in mapper.variables.items()}
        return replace(scope, copies=found)

    # --- states and transitions -----------------------------------------------------------

    def state(self, outline: State, copy: int, inner: int) -> State:
        """Return a state of a copy; ``outline`` has the parts that follow from its position."""
        mapper = self.mappers[copy]
        state = self.copies[copy].used.chart.states[inner]
        is_exit = outline.kind is Kind.CHOICE and state.kind is Kind.FINAL
        return replace(
            outline,
            on_entry=tuple(mapper.block(block) for block in state.on_entry),
            on_exit=tuple(mapper.block(block) for block in state.on_exit),
            defer=tuple(sorted({mapper.events[e] for e in state.defer if e in mapper.events})),
            invariant=None if state.invariant is None else mapper.expr(state.invariant),
            done_data=() if is_exit else tuple(map(mapper.expr, state.done_data)),
            invokes=tuple(mapper.block(block) for block in state.invokes),
            **{name: getattr(state, name) for name in KEPT},
        )

    def filled_state(self, state: State, copy: int) -> State:
        """Return the state that a copy fills; it implements the requirements of that chart."""
        return replace(state, req=(*state.req, *self.copies[copy].used.chart.req))

    def transition(self, outline: Transition, copy: int, inner: int) -> Transition:
        """Return a transition of a copy; ``outline`` has its number, source and targets."""
        mapper, chart = self.mappers[copy], self.copies[copy].used.chart
        transition = chart.transitions[inner]
        events = {mapper.events[e] for e in transition.events if e in mapper.events}
        at = tuple(sorted(events))
        return replace(
            transition,
            index=outline.index,
            source=outline.source,
            targets=outline.targets,
            events=at,
            descriptors=tuple(self._descriptor(copy, d) for d in transition.descriptors),
            guard=None if transition.guard is None else mapper.expr(transition.guard, at),
            content=(*outline.content, *mapper.block(transition.content, at)),
            delay_name=None
            if transition.delay_name is None
            else mapper.name(transition.delay_name),
            id=None if transition.id is None else mapper.name(transition.id),
        )

    def _descriptor(self, copy: int, written: str) -> str:
        mapper = self.mappers[copy]
        plain = written.removesuffix(".*").removesuffix(".")
        for event in mapper.before:
            if event.name == plain and event.index in mapper.events:
                return mapper.after[mapper.events[event.index]].name
        if plain in ("*", "error") or plain.startswith("error."):
            return written
        for platform in ("done.state.", "done.invoke."):
            if written.startswith(platform):
                return platform + mapper.name(written.removeprefix(platform))
        return mapper.name(written)

    def resets(self, copy: int) -> Block:
        """Return the assignments that reset the variables of a copy, if its use says ``reset``."""
        if not self.copies[copy].use.reset:
            return ()
        span = self.copies[copy].use.span
        return tuple(
            Assign(place, value, span)
            for data in self._data(copy, "data")
            for place, value in _parts(
                lang.Variable(data.name, data.type, lang.Storage.DATA, span), data.init
            )
        )

    # --- declarations ---------------------------------------------------------------------

    def _data(self, copy: int, group: str) -> tuple[Data, ...]:
        chart: Chart = self.copies[copy].used.chart
        own: tuple[Data, ...] = getattr(chart, group)
        return own_data(self.copies[copy], own, self.mappers[copy].types, self.starts[copy])

    def data(self, group: str) -> tuple[Data, ...]:
        """Return the own variables of all copies: of ``data``, ``inputs`` or ``outputs``."""
        return tuple(d for number, _ in enumerate(self.copies) for d in self._data(number, group))

    def operations(self) -> tuple[Operation, ...]:
        """Return the operations of copies that are not bound."""
        return tuple(
            operation
            for copy, mapper in zip(self.copies, self.mappers, strict=True)
            for operation in own_operations(copy, mapper.types)
        )

    def functions(self) -> Iterator[lang.FunctionBody]:
        """Yield the functions of all copies."""
        for copy, mapper in zip(self.copies, self.mappers, strict=True):
            yield from map(mapper.function, copy.used.chart.functions)

    def constants(self) -> Iterator[tuple[str, lang.Literal]]:
        """Yield the constants of all copies."""
        for copy, mapper in zip(self.copies, self.mappers, strict=True):
            for name, value in copy.used.chart.constants:
                yield copy.name(name), replace(value, type=mapper.type(value.type))

    def script(self) -> Block:
        """Return the scripts of the used charts, which run before that of the chart."""
        return tuple(
            statement
            for copy, mapper in zip(self.copies, self.mappers, strict=True)
            for statement in mapper.block(copy.used.chart.script)
        )

    def finalized(self, events: Iterable[Event]) -> tuple[Event, ...]:
        """Return the events; those of machines that copies invoke have their ``finalize``."""
        found = {event.index: event for event in events}
        for copy, mapper in zip(self.copies, self.mappers, strict=True):
            for event in copy.used.chart.events:
                if event.finalize:
                    here = mapper.events[event.index]
                    block = mapper.block(event.finalize, (here,))
                    found[here] = replace(found[here], finalize=block)
        return tuple(found.values())

    def invocations(self) -> Iterator[Invocation]:
        """Yield the slots of machines that copies invoke."""
        for number, (copy, mapper) in enumerate(zip(self.copies, self.mappers, strict=True)):
            for one in copy.used.chart.invocations:
                yield replace(
                    one,
                    index=one.index + self.slots[number],
                    state=one.state + self.bases[number],
                    id=copy.name(one.id),
                    passages=_passages(one, mapper),
                    returns=tuple(None if e is None else mapper.events[e] for e in one.returns),
                )

    def described(self) -> Iterator[CopyOf]:
        """Yield the description of each copy in the finished chart, including nested copies."""
        for number, copy in enumerate(self.copies):
            base, chart = self.bases[number], copy.used.chart
            own = [*chart.data, *chart.inputs, *chart.outputs]
            bound = {one.name.value for one in copy.use.bind}
            within = {name for inner in chart.copies for name, _ in inner.variables}
            yield CopyOf(
                state=base,
                name=copy.prefix,
                chart=chart.name,
                entries=_shifted(chart.entries, base),
                exits=tuple(base + state for state, _ in copy.used.exits.values()),
                variables=tuple(
                    (copy.name(d.name), d.name) for d in own if d.name not in bound | within
                ),
                span=copy.use.span,
                source=chart.sources[0] if chart.sources else None,
            )
            for inner in chart.copies:
                kept = tuple((copy.name(n), o) for n, o in inner.variables if n not in bound)
                yield replace(
                    inner,
                    state=inner.state + base,
                    name=copy.name(inner.name),
                    entries=_shifted(inner.entries, base),
                    exits=tuple(base + state for state in inner.exits),
                    variables=kept,
                )


def _parts(
    place: lang.Location, value: lang.Literal
) -> Iterator[tuple[lang.Location, lang.Literal]]:
    """Yield the location and value of each part of a constant; C cannot assign arrays whole."""
    span = value.span
    match value.type, value.value:
        case lang.ArrayType(element, length), tuple(parts) if isinstance(place, lang.Variable):
            for index, part in enumerate(parts):
                at = lang.Literal(index, lang.IntType(index, index), span)
                inner = lang.Element(place, at, element, span)
                assert index < length  # noqa: S101  (a constant is one of its type)
                yield from _parts(inner, lang.Literal(part, element, span))
        case lang.RecordType(_, fields), tuple(parts):
            for field_, part in zip(fields, parts, strict=True):
                inner_ = lang.Member(place, field_.name, field_.type, span)
                yield from _parts(inner_, lang.Literal(part, field_.type, span))
        case _:
            yield place, value


def _shifted(
    entries: tuple[tuple[str, tuple[int, ...]], ...], base: int
) -> tuple[tuple[str, tuple[int, ...]], ...]:
    return tuple((name, tuple(base + state for state in states)) for name, states in entries)


def _passages(one: Invocation, mapper: Mapper) -> tuple[Passage | None, ...]:
    """Return by event of the chart its passage into an invoked machine of the copy, or None."""
    found: list[Passage | None] = [None] * len(mapper.after)
    for event, passage in zip(mapper.before, one.passages, strict=True):
        here = mapper.events.get(event.index)
        if passage is None or here is None or found[here] is not None:
            continue
        places = {part.name: place for place, part in enumerate(mapper.after[here].fields)}
        names = [part.name for part in event.fields]
        fields = tuple(None if p is None else places.get(names[p]) for p in passage.fields)
        found[here] = replace(passage, fields=fields)
    return tuple(found)


# --- joining ----------------------------------------------------------------------------------


def splicer_of(
    copies: tuple[Copy, ...], tree: Tree, names: Names, slots: int, findings: Findings
) -> Splicer:
    """Return the splicer for copies and a chart with ``slots`` invocations of its own."""
    bases = {n.state.copy: n.index for n in tree.nodes if n.state.copied is None}
    first = []
    for copy in copies:
        first.append(slots)
        slots += len(copy.used.chart.invocations)
    return Splicer(
        copies=copies,
        binders=tuple(Binder(copy, names.scope, findings) for copy in copies),
        bases=tuple(bases[copy.number] for copy in copies),
        slots=tuple(first),
        findings=findings,
    )


def check_binding(copies: tuple[Copy, ...], findings: Findings, *, is_late: bool) -> None:
    """Report charts of which only one binds its data late (SCXML 5.3.3)."""
    for copy in copies:
        if copy.used.is_late != is_late:
            findings.add(
                "not-in-a-copy",
                f"only one of this chart and `{copy.used.chart.name}` binds its data late",
                copy.use.span,
                help="give both the same `binding`",
            )


@dataclass
class Splicer:
    """Joins the copies of a chart with it, while the names of that become known."""

    copies: tuple[Copy, ...]
    binders: tuple[Binder, ...]
    bases: tuple[int, ...]
    slots: tuple[int, ...]
    findings: Findings
    types: Mapping[int, Mapping[lang.Type, lang.Type]] = field(default_factory=dict)

    def with_events(self, events: Events) -> Events:
        """Return the events of a chart with those of its copies."""
        return replace(events, all=self._with_own(events.all, events.implied))

    def _with_own(self, events: tuple[Event, ...], implied: frozenset[str]) -> tuple[Event, ...]:
        """Return the events of a chart with those of its copies, before those of the platform.

        It may be done again with what it gave. What is not declared has the fields of the event
        that is bound to it.
        """
        found = list(events)
        index: dict[tuple[str, int | None], int] = {}
        for event in found:
            index.setdefault((event.name, event.invocation), event.index)
        for binder, slot in zip(self.binders, self.slots, strict=True):
            for event, name, one in binder.event_names():
                fields = mapped_fields(event.fields, binder.types)
                called = f"done.state.{binder.copy.prefix}" if name is None else name
                invocation = None if event.invocation is None else event.invocation + slot
                here = index.get((called, invocation))
                if here is not None:
                    is_done = one is None and not found[here].directions
                    if is_done or (called in implied and not found[here].fields):
                        found[here] = replace(found[here], fields=found[here].fields or fields)
                    continue
                if name is None or (one is not None and binder.scope.dialect == "fsmkit"):
                    continue
                index[called, invocation] = len(found)
                reply = None if event.reply is None else mapped_type(event.reply, binder.types)
                found.append(
                    replace(
                        event,
                        index=len(found),
                        name=called,
                        fields=fields,
                        reply=reply,
                        invocation=invocation,
                        finalize=(),
                    )
                )
        if len(found) == len(events):
            return tuple(found)
        in_order = sorted(found, key=lambda event: not event.directions)  # stable
        return tuple(replace(event, index=place) for place, event in enumerate(in_order))

    def spliced(
        self, scope: lang.Scope, events: tuple[Event, ...], operations: Iterable[Operation]
    ) -> Spliced | None:
        """Return the copies joined with a chart whose names are known, or None on failure.

        Unbound elements have no node in the tree of that chart.
        """
        mappers, starts = [], []
        for number, binder in enumerate(self.binders):
            copy = binder.copy
            constants = {**scope.constants, **copy.index}
            binder.scope = replace(scope, constants=constants, indices=frozenset(copy.index))
            known = {operation.name: operation for operation in operations}
            mapper = mapper_of(binder, self.bases[number], self.slots[number], events, known)
            mappers.append(mapper)
            starts.append(start_values(copy, binder.types, binder.scope, self.findings))
            self._check(copy, mapper)
        if self.findings.has_errors:
            return None
        places: dict[int, Place] = {}
        for copy, base, mapper in zip(self.copies, self.bases, mappers, strict=True):
            if copy.index:
                places[base] = Place(copy.index)
            bound = {one.name.value for one in copy.use.exits}
            for name, (state, values) in copy.used.exits.items():
                if name in bound:
                    given = {f"exit.{part}": mapper.expr(e) for part, e in values.items()}
                    places[base + state] = Place(copy.index, given)
        return Spliced(self.copies, self.bases, self.slots, tuple(mappers), tuple(starts), places)

    def _check(self, copy: Copy, mapper: Mapper) -> None:
        """Report constructs of a used chart that a copy does not support."""
        chart = copy.used.chart
        names = {
            event.index
            for event in chart.events
            if event.index in mapper.events
            and mapper.after[mapper.events[event.index]].name != event.name
        }
        for handled, part in _content(chart):
            if not names or (handled is not None and names.isdisjoint(handled)):
                continue
            for node in nodes(part):
                if isinstance(node, lang.EventName) and not isinstance(node, lang.EventType):
                    self.findings.add(
                        "not-in-a-copy",
                        f"the names of events are others in the copy `{copy.prefix}`",
                        node.span,
                        secondary=[(copy.use.span, "used here")],
                        help="write a transition for each event instead of asking for its name",
                    )


def _content(chart: Chart) -> Iterator[tuple[tuple[int, ...] | None, object]]:
    """Yield all content of a chart with the events that it handles, None if it may be any."""
    for transition in chart.transitions:
        handled = transition.events or None
        yield handled, transition.guard
        yield handled, transition.content
    for state in chart.states:
        yield None, (state.on_entry, state.on_exit, state.invokes, state.invariant)
    yield None, chart.script
