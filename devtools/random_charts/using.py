"""Random charts that use random charts: one to four copies, arrays, up to two levels.

Both are those of `random_document`. Names of the used ones are bound at random to fitting names of
the using chart, exit points lead on, and the using chart reads its copies. `random_pair` returns a
chart and one that only uses it, with the new name of each name.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace

from devtools.random_charts.charts import random_document
from devtools.random_charts.choices import Choices
from devtools.random_charts.content import PLACE, SENT, SOURCE, TURNS, text
from fsmkit.chart.chart import Chart
from fsmkit.chart.elaborate import elaborate
from fsmkit.diagnostics import Findings, FsmkitError, Severity, Source
from fsmkit.document import document as doc
from fsmkit.document.walk import states as all_states
from fsmkit.language import Type
from fsmkit.language.conversion import fits
from fsmkit.language.statements.tree import Assign, DocArgument

OVER = "over"
LEVEL = "LEVEL"
"""A constant of each used chart, and the variable that it starts."""
MOST_TRIES = 200
FOLDERS = (doc.Kind.COMPOUND, doc.Kind.PARALLEL)


def random_using(choices: Choices, states: int = 8) -> tuple[doc.Document, ...]:
    """Return a document that uses others."""
    for _ in range(MOST_TRIES):
        document = _using(choices, states, 0)
        if is_sound((document,)):
            return (document,)
    raise AssertionError("no chart could be made")


def used_document(choices: Choices, number: int) -> doc.Document:
    """Return a chart to be used, which uses none."""
    return _used(choices, 1, number)


def is_sound(documents: tuple[doc.Document, ...]) -> bool:
    """Return whether a chart has no errors.

    A chart that reads the names of events cannot be copied. A parallel state with a copy that
    never ends has no done event.
    """
    findings = Findings()
    chart = elaborate(documents, findings)
    errors = [d for d in findings if d.severity is Severity.ERROR]
    rules = {d.rule.name for d in errors if "there is no event `done.state" not in d.message}
    if rules and not rules <= {"not-in-a-copy", "binding-mismatch"}:
        raise FsmkitError(findings)
    return chart is not None


def _using(choices: Choices, states: int, level: int) -> doc.Document:
    document = random_document(choices, states)
    used = [_used(choices, level, number) for number in range(choices.integer(1, 2))]
    host = _Host(choices, document, level)
    for number in range(choices.integer(1, 4 if level == 0 else 2)):
        host.add(choices.pick(used), number)
    return host.document


def _used(choices: Choices, level: int, number: int) -> doc.Document:
    """Return a chart to be used, which may use others itself."""
    if level == 0 and choices.chance(30):
        inner = _using(choices, 4, level + 1)
    else:
        inner = random_document(choices, choices.integer(1, 6))
    source = Source(f"used{level}{number}.yaml", "")
    given = (DocArgument(text("n"), text(LEVEL)),)
    over = doc.DocState(text(OVER), doc.Kind.FINAL, PLACE, done_data=given)
    ends = choices.chance(60)
    root = inner.root
    if ends:
        root = replace(root, children=(*root.children, over))
        root = _with_transition_to_end(choices, root)
    entries = tuple(
        doc.DocEntry(text(f"entry{n}"), (text(target),))
        for n, target in enumerate(_enterable(choices, root))
    )
    return replace(
        inner,
        source=source,
        name=text(f"Used{level}{number}"),
        root=root,
        entries=entries,
        constants=(*inner.constants, doc.DocConstant(text(LEVEL), text("3"))),
        data=(*inner.data, doc.DocData(text("started"), text("0..99"), text(LEVEL))),
    )


def _with_transition_to_end(choices: Choices, root: doc.DocState) -> doc.DocState:
    """Return a chart some of whose states lead to its end after a while."""

    def changed(state: doc.DocState) -> doc.DocState:
        children = tuple(changed(child) for child in state.children)
        transitions = state.transitions
        if (
            state.kind in (doc.Kind.ATOMIC, doc.Kind.COMPOUND)
            and state.use is None
            and choices.chance(25)
        ):
            leave = doc.DocTransition(
                doc.Trigger.AFTER, PLACE, delay=text(choices.pick(("5ms", "11ms"))), ordered=True,
                targets=(text(OVER),),
            )  # fmt: skip
            transitions = (*transitions, leave)
        return replace(state, children=children, transitions=transitions)

    return replace(root, children=tuple(changed(child) for child in root.children))


def _enterable(choices: Choices, root: doc.DocState) -> tuple[str, ...]:
    names = [
        s.id.value for s in all_states(root) if s.id and s.kind is doc.Kind.ATOMIC and s.use is None
    ]
    return choices.some(names, 2) if names and choices.chance(60) else ()


@dataclass
class _Host:
    """Fills states of a chart with others."""

    choices: Choices
    document: doc.Document
    level: int
    charts: dict[str, Chart] = field(default_factory=dict)

    def chart_of(self, document: doc.Document) -> Chart:
        """Return the chart of a used document, elaborated alone."""
        name = document.source.name
        if name not in self.charts:
            chart = elaborate((document,), Findings())
            if chart is None:  # it cannot be used either
                return replace(_EMPTY)
            self.charts[name] = chart
        return self.charts[name]

    own: Chart = field(init=False)
    """The using chart, without the used one."""

    def __post_init__(self) -> None:
        self.own = elaborate((self.document,), Findings()) or _EMPTY

    def add(self, used: doc.Document, number: int) -> None:
        """Fill a new state with a copy."""
        choices = self.choices
        name = f"u{self.level}{number}"
        inner = self.chart_of(used)
        is_array = choices.chance(25)
        exits = self._exits(inner)
        use = doc.DocUse(
            PLACE,
            chart=text(used.source.name),
            reset=choices.chance(25),
            constants=self._constants(is_array=is_array),
            start=self._start(inner) if choices.chance(40) else (),
            bind=self._bind(inner) if choices.chance(80) else (),
            exits=exits,
            loaded=(used,),
        )
        started = {b.name.value for b in use.bind}
        use = replace(use, start=tuple(s for s in use.start if s.name.value not in started))
        entries = [entry for entry, _ in inner.entries]
        initial = None
        if entries and choices.chance(30):
            target = (text(choices.pick(entries)),)
            initial = doc.DocTransition(doc.Trigger.INITIAL, PLACE, targets=target)
        state = doc.DocState(
            text(name),
            doc.Kind.ATOMIC,
            PLACE,
            use=use,
            initial=initial,
            index_range=text("i in 0..1") if is_array else None,
        )
        element = f"{name}.{choices.integer(0, 1)}" if is_array else name
        self._place(state)
        self._enter(element, entries)
        self._read(element, inner)

    def _constants(self, *, is_array: bool) -> tuple[DocArgument, ...]:
        if self.choices.chance(50):
            return ()
        return (DocArgument(text(LEVEL), text("7 + 2 * i" if is_array else "7")),)

    def _start(self, inner: Chart) -> tuple[DocArgument, ...]:
        names = [d.name for d in inner.data if d.name == "started"]
        return tuple(DocArgument(text(name), text("5")) for name in names)

    def _bind(self, inner: Chart) -> tuple[DocArgument, ...]:
        own, choices = self.own, self.choices
        found: list[tuple[str, str]] = []
        counters = {SENT, TURNS}
        for data in inner.data:
            same = [d.name for d in own.data if d.type == data.type and d.name not in counters]
            if same and data.name not in counters and choices.chance(15):
                found.append((data.name, choices.pick(same)))
        found += [
            (data.name, choices.pick(self._sources(data.type, own)))
            for data in inner.inputs
            if choices.chance(60)
        ]
        places = [*own.outputs, *own.data]
        for data in inner.outputs:
            same = [
                d.name
                for d in places
                if d.name not in counters and (d.type == data.type or _is_wider(d.type, data.type))
            ]
            if same and choices.chance(50):
                found.append((data.name, choices.pick(same)))
        for operation in inner.operations:
            same = [
                o.name
                for o in own.operations
                if [p.type for p in o.parameters] == [p.type for p in operation.parameters]
                and o.result == operation.result
            ]
            if same and choices.chance(60):
                name = choices.pick(same)
                listed = ", ".join(p.name for p in operation.parameters)
                called = f"{name}({listed})"
                found.append((operation.name, called if choices.chance(50) else name))
        for event in inner.events:
            if not event.directions or event.directions == {doc.Direction.INTERNAL}:
                continue
            same = [
                e.name
                for e in own.events
                if e.directions
                and len(e.directions) == 1
                and (set(e.fields), e.reply) == (set(event.fields), event.reply)
                and (
                    doc.Direction.IN not in event.directions
                    or doc.Direction.OUT not in e.directions
                )
                # sent and received again immediately, without end
                and (doc.Direction.OUT not in event.directions or doc.Direction.OUT in e.directions)
            ]
            if same and choices.chance(50):
                found.append((event.name, choices.pick(same)))
        return tuple(DocArgument(text(name), text(value)) for name, value in found)

    def _sources(self, type_: Type, own: Chart) -> list[str]:
        names = [d.name for d in (*own.inputs, *own.data, *own.outputs) if d.type == type_]
        if str(type_) == "bool":
            names += ["true", *(f"not {name}" for name in names)]
            ids = [s.id for s in own.states[1:] if s.id.isidentifier() and not s.is_history]
            names += [f"In({i})" for i in ids[:3]]
        elif str(type_) == "Color":
            names.append("Color.green")
        else:
            names += ["1", *(f"1 if {name} > 2 else 3" for name in names)]
        return names

    def _exits(self, inner: Chart) -> tuple[doc.DocExit, ...]:
        finals = [s for s in inner.states[1:] if s.kind is doc.Kind.FINAL and s.parent == 0]
        targets = [
            s.id for s in self.own.states[1:] if s.kind is doc.Kind.ATOMIC and _is_name(s.id)
        ]
        found = []
        for final in finals:
            if not targets or self.choices.chance(35):
                continue
            taken = doc.DocTransition(
                doc.Trigger.EVENTLESS, PLACE, targets=(text(self.choices.pick(targets)),)
            )
            transitions: tuple[doc.DocTransition, ...] = (taken,)
            if final.id == OVER and self.choices.chance(50):
                guard = text(f"exit.n > {self.choices.integer(2, 4)}")
                content = (Assign(text(TURNS), text("exit.n"), PLACE),)
                other = replace(
                    taken, targets=(text(self.choices.pick(targets)),), guard=guard, content=content
                )
                transitions = (other, taken)
            found.append(doc.DocExit(text(final.id), transitions))
        return tuple(found)

    def _place(self, state: doc.DocState) -> None:
        root = self.document.root
        folders = [s.id.value for s in all_states(root) if s.id is not None and s.kind in FOLDERS]
        where = self.choices.pick(["", *folders])

        def changed(folder: doc.DocState) -> doc.DocState:
            children = tuple(changed(child) for child in folder.children)
            if (folder is root and not where) or (
                folder.id is not None and folder.id.value == where
            ):
                if folder.kind is doc.Kind.PARALLEL or folder.initial or self.choices.chance(50):
                    children = (*children, state)
                else:
                    children = (state, *children)
            return replace(folder, children=children)

        self.document = replace(self.document, root=changed(root))

    def _enter(self, name: str, entries: list[str]) -> None:
        """Let some states lead to the copy, and one of its entry points."""
        targets = [name, *(f"{name}.{entry}" for entry in entries)]
        events = [
            e.name.value
            for e in self.document.events
            if e.direction is doc.Direction.IN and "." not in e.name.value
        ]

        def transition() -> tuple[doc.DocTransition, ...]:
            event = (text(self.choices.pick(events)),)
            target = (text(self.choices.pick(targets)),)
            return (
                doc.DocTransition(doc.Trigger.EVENT, PLACE, event, targets=target, ordered=True),
            )

        if events:
            self._add(transition, 35)

    def _read(self, name: str, inner: Chart) -> None:
        """Let some guards read the copy."""
        path = name.replace(".0", "[0]").replace(".1", "[1]")
        conditions = [
            f"In({path}.{s.id})" for s in inner.states[1:] if _is_name(s.id) and not s.is_history
        ]
        conditions = [c for c in conditions if "." not in c.removeprefix(f"In({path}.")]
        own = [d for d in (*inner.data, *inner.inputs, *inner.outputs) if "." not in d.name]
        conditions += [f"{path}.{d.name}" for d in own if str(d.type) == "bool"]
        conditions += [f"{path}.{d.name} > 3" for d in own if d.name in (SENT, TURNS, "started")]

        def transition() -> tuple[doc.DocTransition, ...]:
            guard = text(self.choices.pick(conditions))
            content = (Assign(text(SENT), text(SENT), PLACE),)
            return (
                doc.DocTransition(
                    doc.Trigger.EVERY, PLACE, delay=text("7ms"), guard=guard, content=content,
                    ordered=True,
                ),
            )  # fmt: skip

        if conditions:
            self._add(transition, 20)

    def _add(self, draw: Callable[[], tuple[doc.DocTransition, ...]], percent: int) -> None:
        def changed(state: doc.DocState) -> doc.DocState:
            children = tuple(changed(child) for child in state.children)
            transitions = state.transitions
            is_plain = state.id is not None and state.kind in (doc.Kind.ATOMIC, *FOLDERS)
            if is_plain and self.choices.chance(percent):
                transitions = (*transitions, *draw())
            return replace(state, children=children, transitions=transitions)

        root = self.document.root
        children = tuple(changed(child) for child in root.children)
        self.document = replace(self.document, root=replace(root, children=children))


def _is_name(name: str) -> bool:
    return all(part.isidentifier() for part in name.split("."))


def _is_wider(outer: Type, inner: Type) -> bool:
    return fits(inner, outer) and not hasattr(inner, "element") and not hasattr(inner, "fields")


_EMPTY: Chart = elaborate(  # type: ignore[assignment]
    (doc.Document(SOURCE, text("Empty"), doc.DocState(None, doc.Kind.COMPOUND, PLACE,
              children=(doc.DocState(text("empty"), doc.Kind.ATOMIC, PLACE),))),),
    Findings(),
)  # fmt: skip
