"""From the machine of a diagram to a document: names, content, and the rules of StateSmith."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field

from fsmkit.diagnostics import Findings, Source, Span, Text
from fsmkit.document import document as doc
from fsmkit.emit.identifiers import Namer, legal
from fsmkit.foreign.content import Content, Operations, uses
from fsmkit.foreign.imports import Import, Recorder, counts, reject
from fsmkit.foreign.rewriting.chained_reactions import CONSUMED, chained_reactions
from fsmkit.foreign.rewriting.local_transitions import local_transitions
from fsmkit.foreign.rewriting.ordered_candidates import ordered_candidates
from fsmkit.foreign.rewriting.resting_composites import resting_composites
from fsmkit.foreign.rewriting.tree import initial_to
from fsmkit.foreign.statesmith.labels import Behaviour
from fsmkit.foreign.statesmith.machine import MachineReader, Vertex
from fsmkit.foreign.statesmith.triggers import ENTER, EXIT, Triggers, read_map
from fsmkit.foreign.words import RESERVED
from fsmkit.language.statements.tree import Assign, Block, Branch, If

DO = "do"
"""The event that is passed on unless content consumes it."""
VARIABLE = re.compile(
    r"\s*(u?int(?:8|16|32|64)_t|bool|int|unsigned|float|double)\s+([A-Za-z_]\w*)"
    r"\s*(?:=\s*(-?[\w.]+)\s*)?;?\s*(?://.*)?"
)
TYPES = {"int": "int32", "unsigned": "uint32", "float": "float32", "double": "float64"}
ACCESS = ("", "vars.", "sm->vars.", "self->vars.", "this.vars.", "this.")
"""Prefixes of variables in content."""
CONSUMING = re.compile(rf"\s*{CONSUMED}\s*=(?!=)(.*)", re.DOTALL)
CHOICES = ("initial", "choice", "entry", "exit", "history", "deep")
"""Kinds that are choice states in a chart."""
HISTORIES = ("history", "deep")
MOST_PARTS = 8
"""Names of outer states before that of a state whose name is not unique."""


def import_vertex(
    reader: MachineReader, root: Vertex, source: Source, findings: Findings
) -> Import | None:
    """Return the import of a machine whose diagram was read; None without an initial state."""
    owned = {data.name.value: data for data in _declared(reader.variables)}
    while True:
        builder = _Builder(reader, root, source, owned, Findings())
        document = builder.document()
        opaque = builder.operations.opaque
        kept = {
            name: data
            for name, data in owned.items()
            if not any(uses(opaque, prefix + name) for prefix in ACCESS)
        }
        if kept == owned:
            break
        owned = kept
    findings.extend(builder.findings)
    if document is None:
        return None
    recorder, read = builder.recorder, counts(document)
    orders = builder.orders
    document = ordered_candidates(document, recorder, lambda each: orders.get(each.span, 0.0))
    document = chained_reactions(document, recorder, lambda event: event.lower() == DO)
    document = local_transitions(resting_composites(document, recorder), recorder)
    for message, span in (*reader.diagram.lost, *reader.lost):
        recorder.lose(message, span)
    return recorder.imported(root.name, document, read, builder.operations.opaque)


def _declared(texts: Iterable[Text]) -> Iterator[doc.DocData]:
    """Yield the variables that a configuration declares in C."""
    for text in texts:
        at = 0
        for line in text.value.split("\n"):
            match = VARIABLE.fullmatch(line)
            if match is not None and match[2] not in RESERVED:
                name = text.part(at + match.start(2), at + match.end(2))
                type_ = TYPES.get(match[1], match[1].removesuffix("_t"))
                value = match[3] or ("false" if type_ == "bool" else "0")
                yield doc.DocData(name, name.with_value(type_), name.with_value(value))
            at += len(line) + 1


@dataclass
class _Builder:
    reader: MachineReader
    root: Vertex
    source: Source
    variables: Mapping[str, doc.DocData]
    findings: Findings
    recorder: Recorder = field(default_factory=Recorder)
    orders: dict[Span, float] = field(default_factory=dict)
    operations: Operations = field(init=False)
    plain: Content = field(init=False)
    reacting: Content = field(init=False)
    names: dict[str, str] = field(default_factory=dict)
    tracked: dict[str, list[tuple[str, int]]] = field(default_factory=dict)
    """The histories of a state's siblings: the variable, and the number of the state."""
    histories: dict[str, tuple[str, list[tuple[str, int]]]] = field(default_factory=dict)
    """The variable of a history, by its key, and the states that it restores, with numbers."""

    def __post_init__(self) -> None:
        taken = {*RESERVED, *self.variables, CONSUMED}
        self.operations = Operations(Namer(taken))
        known = {p + name: name for name in self.variables for p in ACCESS}
        self.plain = Content(self.operations, known, self._no_flag)
        self.reacting = Content(self.operations, known, self._flag)
        self.triggers = Triggers(self.findings, read_map(self.reader.trigger_map))
        self.data = list(self.variables.values())
        self.data_namer = Namer({*taken, *self.variables})

    def document(self) -> doc.Document | None:
        """Return the document before any rewriting."""
        self._name_states()
        everything = list(self.root.walk())
        self.triggers.declare(
            trigger
            for vertex in everything
            for each in vertex.behaviours
            for trigger in each.triggers
        )
        is_default = any(
            not each.triggers and vertex.kind in ("state", "root")
            for vertex in everything
            for each in vertex.behaviours
        )
        if is_default:
            self.triggers.declare([self.root.at.with_value(DO)])
        self.targets = {each.target for v in everything for each in v.behaviours if each.target}
        for vertex in everything:
            if vertex.kind in HISTORIES:
                self._track(vertex)
        kinds = {child.kind for child in self.root.children}
        if "state" not in kinds:
            self.findings.add(
                "foreign-syntax",
                f"the machine `{self.root.name}` has no states",
                self.root.at,
                help="draw a state, and an arrow to it from an initial state",
            )
            return None
        if "initial" not in kinds:
            self.recorder.differ(
                f"the machine `{self.root.name}` has no initial state, which StateSmith rejects",
                self.root.at,
                self.findings,
            )
        is_state = self.root.key in self.targets or bool(self.root.behaviours)
        is_state = is_state or "initial" not in kinds
        top = self._state(self.root)
        whole = top.span
        if is_state:
            at = self.root.at.with_value(self.names[self.root.key])
            root = doc.DocState(None, doc.Kind.COMPOUND, whole, initial_to(at), (top,))
        else:
            root = doc.DocState(None, doc.Kind.COMPOUND, whole, top.initial, top.children)
        events = tuple(
            doc.DocEvent(text, (), doc.Direction.IN) for text in self.triggers.events.values()
        )
        chart = self.root.at.with_value(legal(self.root.name) or "Machine")
        return doc.Document(
            self.source, chart, root, data=tuple(self.data), events=events,
            operations=self.operations.declarations(),
        )  # fmt: skip

    # --- names --------------------------------------------------------------------------------

    def _name_states(self) -> None:
        """Name the states: with the prefixes of the states around them, and unique."""
        written: dict[str, str] = {self.root.key: self.root.name}
        around: dict[str, Vertex] = {}

        def visit(vertex: Vertex, prefix: str) -> None:
            inner = f"{prefix}{vertex.prefix}__" if vertex.prefix else prefix
            for child in vertex.children:
                around[child.key] = vertex
                own = child.name if child.kind == "state" else f"{vertex.name}_{child.kind}"
                if child.kind in ("entry", "exit", "choice") and child.name:
                    own = f"{own}_{child.name}"
                written[child.key] = prefix_of(child, inner) + own
                visit(child, inner)

        def prefix_of(child: Vertex, inner: str) -> str:
            return inner if child.kind == "state" else ""

        visit(self.root, "")
        left = {key: around.get(key) for key in written}
        for _ in range(MOST_PARTS):
            count = Counter(name.lower() for name in written.values())
            for key, name in list(written.items()):
                outer = left[key]
                if count[name.lower()] > 1 and outer is not None:
                    written[key] = f"{outer.name}__{name}"
                    left[key] = around.get(outer.key)
        namer = Namer(RESERVED)
        self.names = {key: namer.name(name, "_state") for key, name in written.items()}

    def _id(self, vertex: Vertex) -> Text:
        return vertex.at.with_value(self.names[vertex.key])

    # --- states -------------------------------------------------------------------------------

    def _state(self, vertex: Vertex) -> doc.DocState:
        """Return a state, with the initial state and the handlers of the tool."""
        children = [self._child(child) for child in vertex.children]
        starts = [child for child in vertex.children if child.kind == "initial"]
        initial = None
        for start in starts[:1]:
            initial = self._initial(start)
        for start in starts[1:]:
            reject(self.findings, f"`{vertex.name}` has two initial states", start.at, "remove one")
        entry, exit_ = (self._handlers(vertex, word) for word in (ENTER, EXIT))
        marks = tuple(
            Assign(vertex.at.with_value(name), vertex.at.with_value(str(number)), vertex.at.span)
            for name, number in self.tracked.get(vertex.key, ())
        )
        return doc.DocState(
            self._id(vertex),
            doc.Kind.COMPOUND if vertex.children else doc.Kind.ATOMIC,
            vertex.at.span,
            initial=initial,
            children=tuple(child for child in children if child is not None),
            transitions=tuple(self._transitions(vertex)),
            entry=(marks + entry,) if marks + entry else (),
            exit=(exit_,) if exit_ else (),
        )

    def _child(self, vertex: Vertex) -> doc.DocState | None:
        if vertex.kind == "state":
            return self._state(vertex)
        if vertex.kind == "continued" or (vertex.kind == "initial" and self._is_plain(vertex)):
            return None
        legs = [*self._restoring(vertex), *self._legs(vertex)]
        if all(leg.guard is not None for leg in legs):
            self.findings.add(
                "foreign-syntax", f"a leg of `{self.names[vertex.key]}` without a guard is missing",
                vertex.at, help="add an arrow with `else`",
            )  # fmt: skip
        return doc.DocState(
            self._id(vertex), doc.Kind.CHOICE, vertex.at.span, transitions=tuple(legs)
        )

    def _is_plain(self, start: Vertex) -> bool:
        """Return whether an initial state is an initial transition: one leg without a guard."""
        legs = start.behaviours
        is_single = len(legs) == 1 and legs[0].target is not None
        return is_single and self._guard(legs[0]) is None and start.key not in self.targets

    def _initial(self, start: Vertex) -> doc.DocTransition | None:
        if not self._is_plain(start):
            return initial_to(self._id(start))
        (leg,) = start.behaviours
        content = self.plain.block(leg.action) if leg.action is not None else ()
        return initial_to(self._target(leg), content=content or None)

    def _legs(self, vertex: Vertex) -> Iterator[doc.DocTransition]:
        for leg in sorted(vertex.behaviours, key=lambda each: each.order):
            if leg.target is None or leg.triggers:
                reject(
                    self.findings, f"a leg of `{self.names[vertex.key]}` has an event or no target",
                    leg.span, "remove the event, or connect the arrow",
                )  # fmt: skip
                continue
            content = self.plain.block(leg.action) if leg.action is not None else ()
            content = self._left(vertex, leg) + content
            self.orders[leg.span] = leg.order
            yield doc.DocTransition(
                doc.Trigger.EVENTLESS,
                leg.span,
                guard=self._guard(leg),
                targets=(self._target(leg),),
                content=content or None,
            )

    def _left(self, vertex: Vertex, leg: Behaviour) -> Block:
        """Return the exit behaviours of a state whose exit point leads back into it.

        The tool executes them, although it does not enter the state again.
        """
        home = self.reader.parents.get(vertex.key)
        if vertex.kind != "exit" or home is None:
            return ()
        is_back = any(inner.key == leg.target for inner in home.walk())
        return self._handlers(home, EXIT) if is_back else ()

    def _target(self, behaviour: Behaviour) -> Text:
        vertex = self.reader.vertices[behaviour.target or self.root.key]
        return Text(self.names[vertex.key], behaviour.span, ())

    # --- histories ----------------------------------------------------------------------------

    def _track(self, history: Vertex) -> None:
        """Give the states that a history restores numbers; its default has 0.

        ``$HC`` in a state lets a history of the state around it track its children, too.
        """
        name = self.data_namer.name(f"{self.names[history.key]}_last")
        home = self.reader.parents[history.key]
        default = next((each.target for each in history.behaviours if each.target), None)
        found: list[tuple[str, int]] = []
        left = [child for child in home.children if child.kind == "state"]
        while left:
            state = left.pop(0)
            number = 0 if state.key == default else len(found) + 1
            if number:
                found.append((state.key, number))
            self.tracked.setdefault(state.key, []).append((name, number))
            if history.kind == "deep" or any(c.kind == "continued" for c in state.children):
                left = [*(child for child in state.children if child.kind == "state"), *left]
        self.histories[history.key] = name, found
        at = history.at
        type_ = at.with_value(f"0..{max(1, len(found))}")
        self.data.append(doc.DocData(at.with_value(name), type_, at.with_value("0")))

    def _restoring(self, vertex: Vertex) -> Iterator[doc.DocTransition]:
        """Yield the legs of a history to the states that it restores."""
        variable, found = self.histories.get(vertex.key, ("", []))
        for key, number in found:
            guard = vertex.at.with_value(f"{variable} == {number}")
            target = vertex.at.with_value(self.names[key])
            span = self.reader.vertices[key].at.span
            yield doc.DocTransition(doc.Trigger.EVENTLESS, span, guard=guard, targets=(target,))

    # --- behaviours ---------------------------------------------------------------------------

    def _handlers(self, vertex: Vertex, word: str) -> Block:
        """Return the behaviours at entry or exit, in their order."""
        block: Block = ()
        for each in sorted(vertex.behaviours, key=lambda one: one.order):
            if any(word in self.triggers.meanings(trigger) for trigger in each.triggers):
                if each.target is not None:
                    reject(
                        self.findings,
                        "an arrow has the trigger `enter` or `exit`",
                        each.span,
                        "use an event",
                    )
                    continue
                body = self.plain.block(each.action) if each.action is not None else ()
                guard = self._guard(each)
                if guard is not None and body:
                    body = (If((Branch(guard, body),), each.span),)
                block += body
        return block

    def _events(self, behaviour: Behaviour) -> list[str]:
        """Return the events of a behaviour: `do` where it has no trigger."""
        if not behaviour.triggers:
            return [DO]
        words = [word for trigger in behaviour.triggers for word in self.triggers.meanings(trigger)]
        return [word for word in dict.fromkeys(words) if word not in (ENTER, EXIT)]

    def _transitions(self, vertex: Vertex) -> Iterator[doc.DocTransition]:
        count = Counter(event for each in vertex.behaviours for event in self._events(each))
        for each in vertex.behaviours:
            events = self._events(each)
            if not events:
                continue
            content = self.plain if each.target is not None else self.reacting
            block = content.block(each.action) if each.action is not None else ()
            self.orders[each.span] = each.order
            yield doc.DocTransition(
                doc.Trigger.EVENT,
                each.span,
                events=tuple(
                    Text(self.triggers.events[event].value, each.span, ()) for event in events
                ),
                guard=self._guard(each),
                targets=() if each.target is None else (self._target(each),),
                content=block or None,
                ordered=any(count[event] > 1 for event in events),
            )

    def _guard(self, behaviour: Behaviour) -> Text | None:
        if behaviour.guard is None or behaviour.guard.value in ("true", "1"):
            return None
        return self.plain.guard(behaviour.guard)

    def _flag(self, statement: Text) -> Block | None:
        """Read a statement that consumes the event or passes it on, perhaps by an expansion."""
        if CONSUMED not in statement.value:
            return None
        flag = statement.with_value(CONSUMED)
        match = CONSUMING.fullmatch(statement.value)
        if match is None:
            value = statement.with_value(self.operations.guard(statement))
        else:
            value = self.plain.guard(statement.part(*match.span(1)).strip()) or flag
        return (Assign(flag, value, statement.span),)

    def _no_flag(self, statement: Text) -> Block | None:
        """Skip such a statement where it has no effect: the event ends with the transition."""
        return () if CONSUMING.fullmatch(statement.value) else None
