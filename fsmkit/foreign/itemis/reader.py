"""From a statechart of itemis CREATE to a document.

A step of itemis visits the regions in a fixed order: a region before those within its states
(parent first), or after them (child first). The active state of a visited region takes its first
enabled transition, or else does its local reactions. A transition ends the visit of everything
within the region that it changes. The chart does the same: a step raises an internal event for
each region in that order (R5). Events set a flag, which lasts until the end of the step (R6): an
event-driven statechart makes a step for each event, a cycle-based one for each event `cycle`.
The facts are those of `ReactMethod`, `BehaviorMapping` and `SequenceBuilder` of the generator.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace

from fsmkit.diagnostics import Findings, Source, Span, Text
from fsmkit.document.document import (
    Direction,
    DocCapacity,
    DocData,
    DocEvent,
    DocState,
    DocTransition,
    Document,
    Kind,
    Trigger,
)
from fsmkit.emit.identifiers import Namer
from fsmkit.foreign.imports import Counts, Import, Recorder, reject
from fsmkit.foreign.itemis.declarations import Declarations, declared, read_declarations
from fsmkit.foreign.itemis.model import Arc, Region, Vertex, all_vertices, read_regions
from fsmkit.foreign.itemis.text import (
    Code,
    Parser,
    Reaction,
    Scope,
    Symbol,
    SyntaxFault,
    Timer,
    report,
)
from fsmkit.foreign.rewriting.tree import initial_to
from fsmkit.foreign.words import RESERVED
from fsmkit.language.statements.reading import read_statements
from fsmkit.language.statements.tree import Block, DocField
from fsmkit.scxml.nodes import Element, decode, read_nodes

__all__ = ["decode", "import_machine", "import_named", "machines"]

STATES = ("State", "FinalState")
KNOWN = (*STATES, "Entry", "Exit", "Choice", "Synchronization")
HISTORIES = {"SHALLOW_HISTORY": Kind.SHALLOW_HISTORY, "DEEP_HISTORY": Kind.DEEP_HISTORY}
READ = ("EventDriven", "CycleBased", "ChildFirstExecution", "ParentFirstExecution")
"""Annotations that are read; the last two of a kind are the defaults."""
MOST_REGIONS = 200
MICROSTEPS = 10_000
LONGEST_PATH = 50
"""Exit points and forks of one transition."""
FAULT = "check the statechart in itemis CREATE"


def machines(source: Source, findings: Findings) -> tuple[str, ...]:
    """Return the names of the statecharts in a file."""
    return tuple(_name(one) for one in _charts(read_nodes(source, findings), findings))


def import_machine(source: Source, machine: str, findings: Findings) -> Import | None:
    """Return a statechart; None if nothing of it can be read."""
    found = import_named(source, machine, findings)
    return None if found is None else found[0]


def import_named(source: Source, machine: str, findings: Findings) -> tuple[Import, Names] | None:
    """Return a statechart, and what its names are in the chart."""
    charts = _charts(read_nodes(source, Findings()), Findings())
    element = next((one for one in charts if _name(one) == machine), None)
    if element is None:
        return None
    reader = _Machine(element, machine, findings)
    document = reader.document()
    if document is None:
        return None
    recorder, vertices = reader.recorder, list(all_vertices(reader.regions))
    arcs = sum(len(one.out) for one in vertices if one.kind != "Entry")
    states = sum(one.kind in STATES for one in vertices)
    events = sum(s.kind in ("in", "out", "local") for s in reader.declared.symbols.values())
    found = recorder.imported(machine, document, Counts(states, arcs, events))
    return found, Names(reader.paths(), dict(reader.declared.symbols), reader.is_event_driven)


@dataclass(frozen=True, slots=True)
class Names:
    """The names of a statechart in its chart."""

    states: dict[str, tuple[str, str]]
    """By path: the id of the state, and the name of its class."""
    symbols: dict[str, Symbol]
    is_event_driven: bool


def _charts(root: Element | None, findings: Findings) -> list[Element]:
    if root is None:
        return []
    found = [root] if root.name == "Statechart" else []
    found += [one for one in root.children if one.name == "Statechart"]
    if not found:
        findings.add("foreign-syntax", f"`<{root.name}>` holds no statechart", root.span,
                     help="save the statechart with itemis CREATE")  # fmt: skip
    return found


def _name(element: Element) -> str:
    found = element.get("name")
    return found.value if found is not None and found.value.strip() else "statechart"


@dataclass(frozen=True, slots=True)
class _Path:
    """Where a transition leads: states, actions in order, and its last two vertices."""

    targets: tuple[Vertex, ...]
    actions: tuple[str, ...]
    last: tuple[Vertex, Vertex]


@dataclass
class _Machine:
    """Reads one statechart."""

    element: Element
    name: str
    findings: Findings
    recorder: Recorder = field(default_factory=Recorder)
    names: Namer = field(default_factory=lambda: Namer(RESERVED))
    count: int = 0
    """The number of regions."""
    flow: int = 0
    """The number of the event on which the machine itself reacts."""
    start: list[str] = field(default_factory=list)
    local_start: list[str] = field(default_factory=list)
    ids: dict[Vertex | Region, Text] = field(default_factory=dict)
    flags: list[str] = field(default_factory=list)
    """The numbers of the order of a step that the chart needs."""
    step_names: dict[int, str] = field(default_factory=dict)
    chosen: int = 0
    """Transitions that content chooses."""
    read: dict[Arc | Vertex, list[Reaction]] = field(default_factory=dict)
    leaving: dict[Vertex | None, str] = field(default_factory=dict)
    """Flags of states (None: the machine) that are left, whose regions leave in their order."""
    timers: dict[Vertex | None, list[tuple[Timer, str]]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.span = self.element.span
        self.at = self.element.get("name") or Text(self.name, self.span, ())
        self.regions = read_regions(self.element, self.findings)
        text = self.element.get("specification") or Text("", self.span, ())
        self.declared: Declarations = declared(text, self.names)
        self.scope = Scope(self.declared.symbols, self._active, self._raised, self._temporary)
        annotations = self.declared.annotations
        self.is_event_driven = "EventDriven" in annotations
        self.is_child_first = "ChildFirstExecution" in annotations
        for name, at in annotations.items():
            if name not in READ:
                reject(self.findings, f"the annotation `@{name}` is not read", at, "remove it")
        self.vertices = list(all_vertices(self.regions))
        for vertex in self.vertices:
            wanted = vertex.name.strip() or vertex.kind
            self.ids[vertex] = self._at(vertex.span, self.names.name(wanted, "_state"))
        paths = self.paths()
        self.active = {path: id_ for path, (id_, _) in paths.items()}
        self.fixed = {n: self.names.name(n) for n in (
            "cycle", "enter", "exit", "inactive", "active", "step_ends", "resume", "quiet", "go",
            "is_in_step",
        )}  # fmt: skip
        read_declarations(text, self.declared, self.scope, self.findings)

    # --- names ------------------------------------------------------------------------------------

    def paths(self) -> dict[str, tuple[str, str]]:
        """Return the ids and kinds of the states by their paths, the statechart's name omitted."""
        found: dict[str, tuple[str, str]] = {}
        for vertex in self.vertices:
            if vertex.kind in STATES:
                steps = [one.name for one in vertex.containers][::-1]
                path = ".".join("_".join(step.split()) for step in steps)
                found.setdefault(path, (self.ids[vertex].value, vertex.kind))
        return found

    def _active(self, path: str) -> str | None:
        steps = path.split(".")
        for start in range(len(steps)):
            found = self.active.get(".".join(steps[start:]))
            if found is not None:
                return found
        return None

    def _temporary(self) -> str:
        return self.names.name("value")

    def _at(self, at: Span, value: str) -> Text:
        return Text(value, at, ())

    def _block(self, statements: tuple[str, ...] | list[str], at: Span) -> Block:
        return read_statements(self._at(at, "\n".join(statements)), self.findings)

    def _raised(self, event: Symbol, value: str | None) -> tuple[str, ...]:
        """Return the statements that raise an event from within the machine."""
        given = "" if value is None else f"(value = {value})"
        stored = () if value is None else (f"{event.name}_value = {value}",)
        flag = (f"?{event.name}", *stored, f"{event.name}_now = true")
        if event.kind == "out":
            return (f"send {event.name}{given}", *flag)
        if not self.is_event_driven:
            return flag
        if event.kind == "in":
            reject(self.findings, "an event-driven statechart raises its own `in` event", event.at,
                   "declare it under `internal`")  # fmt: skip
        return (f"raise {event.name}{given}",)

    def _finished(self, actions: tuple[str, ...]) -> list[str]:
        """Return statements without the flags of `out` events that the machine does not read."""
        found: list[str] = []
        skip = ""
        for one in actions:
            if one.startswith("?"):
                skip = one[1:]
            elif skip and one.startswith((f"{skip}_now", f"{skip}_value")):
                if skip in self.scope.used:
                    found.append(one)
            else:
                skip = ""
                found.append(one)
        return found

    # --- the document -----------------------------------------------------------------------------

    def document(self) -> Document | None:
        """Return the document."""
        self._read_all()
        for region in self.regions:
            if region.entry is None:
                self.recorder.lose("a region without entry, which is never active", region.span)
        self.regions = [region for region in self.regions if region.entry is not None]
        self.count = count = self._number(self.regions, 0)
        self.flow = count + 1 if self.is_child_first else 0
        if not 0 < count <= MOST_REGIONS:
            reject(self.findings, f"{count} regions, and not 1 to {MOST_REGIONS}", self.span,
                   "split the statechart")  # fmt: skip
            return None
        self.flags = [] if self._is_flat() else ["resume"]
        self.flags += ["quiet"] if self.flags and self.is_child_first else []
        self._find_leaving()
        self._check_order()
        self.start, self.local_start = self._step_starts()
        active = self._active_state()
        fixed = {key: self._at(self.span, name) for key, name in self.fixed.items()}
        inactive = DocState(fixed["inactive"], Kind.ATOMIC, self.span, rest=True,
                            transitions=(self._on(self.fixed["enter"], fixed["active"]),)
                            )  # fmt: skip
        machine = self._at(self.span, self.names.name(f"{self.name}_machine"))
        outer = DocState(machine, Kind.COMPOUND, self.span, initial=initial_to(fixed["active"]),
                         children=(active, inactive), transitions=tuple(self._handlers())
                         )  # fmt: skip
        for region in self.regions:
            self.recorder.rewrite("R5", region.span, self._step(region.own))
        timers = [timer for found in self.timers.values() for timer, _ in found]
        if self.is_event_driven and len(timers) > 1:
            self.recorder.differ("timers that expire at the same time do so in the order of their "
                                 "start; in itemis CREATE the host decides", self.span,
                                 self.findings)  # fmt: skip
        return Document(
            self.span.source,
            self.at.with_value(Namer(RESERVED).name(self.name, "_chart")),
            DocState(
                None, Kind.COMPOUND, self.span, initial=initial_to(machine), children=(outer,)
            ),
            constants=tuple(self.declared.constants),
            data=(*self.declared.data, *self._flags()),
            operations=tuple(self.declared.operations),
            events=tuple(self._events()),
            capacities=(
                DocCapacity(self._at(self.span, "internal"), self._at(self.span, str(count + 40))),
                DocCapacity(
                    self._at(self.span, "microsteps"), self._at(self.span, str(MICROSTEPS))
                ),
            ),
        )

    def _read_all(self) -> None:
        """Read the texts of all states and transitions."""
        for vertex in self.vertices:
            if vertex.kind not in KNOWN:
                reject(self.findings, f"a vertex of the kind `{vertex.kind}` is not read",
                       vertex.span, "use states, choices, entries, exits and forks")  # fmt: skip
            self.read[vertex] = []
            if vertex.text is not None and vertex.kind == "State":
                parser = Parser(vertex.text, self.scope)
                try:
                    self.read[vertex] = parser.reactions()
                except SyntaxFault as fault:
                    report(fault, parser, self.findings)
            for arc in vertex.out:
                parser = Parser(arc.text, self.scope)
                try:
                    self.read[arc] = [parser.transition()]
                except SyntaxFault as fault:
                    report(fault, parser, self.findings)
                    self.read[arc] = [Reaction((), None, (), arc.text)]

    def _number(self, regions: list[Region], count: int) -> int:
        """Assign numbers to regions in the order of a step; return the last number."""
        for region in regions:
            region.lo = count + 1
            if not self.is_child_first:
                count = region.own = count + 1
            for vertex in region.vertices:
                count = self._number(vertex.regions, count)
            if self.is_child_first:
                count = region.own = count + 1
            region.hi = count
        return count

    def _step(self, number: int) -> str:
        """Return the event of a region."""
        if number not in self.step_names:
            self.step_names[number] = self.names.name(f"step_{number}")
        return self.step_names[number]

    def _step_starts(self) -> tuple[list[str], list[str]]:
        """Return the statements that start a step, and those that start one for a local event."""
        numbers = list(range(1, self.count + 1))
        if self.declared.reactions:
            numbers = [*numbers, self.flow] if self.is_child_first else [self.flow, *numbers]
        again = [f"{self.fixed['is_in_step']} = true"] if self._is_queued() else []
        again += [f"{self.fixed[one]} = 0" for one in self.flags]
        again += [f"raise {self._step(number)}" for number in numbers]
        again.append(f"raise {self.fixed['step_ends']}")
        cleared = [f"{e.name}_now = false" for e in self._of_kind("out") if self._kept(e)]
        return [*cleared, *again], again

    def _is_queued(self) -> bool:
        """Return whether local events wait for the end of a step."""
        return self.is_event_driven and bool(self._of_kind("local"))

    # --- events and data --------------------------------------------------------------------------

    def _of_kind(self, *kinds: str) -> list[Symbol]:
        return [one for one in self.declared.symbols.values() if one.kind in kinds]

    def _kept(self, event: Symbol) -> bool:
        """Return whether the machine reads an event, so that it needs a flag."""
        return event.name in self.scope.used

    def _payload(self, event: Symbol) -> tuple[DocField, ...]:
        if not event.type:
            return ()
        return (DocField(event.at.with_value("value"), event.at.with_value(event.type)),)

    def _events(self) -> Iterator[DocEvent]:
        names = [self.fixed["enter"], self.fixed["exit"]]
        for name in names if self.is_event_driven else [self.fixed["cycle"], *names]:
            yield DocEvent(self._at(self.span, name), (), Direction.IN)
        for event in self._of_kind("in", "out"):
            direction = Direction.IN if event.kind == "in" else Direction.OUT
            yield DocEvent(event.at.with_value(event.name), self._payload(event), direction)
        for event in self._of_kind("local"):
            if self.is_event_driven:
                yield DocEvent(event.at.with_value(event.name), self._payload(event),
                               Direction.INTERNAL)  # fmt: skip
        for name in (*self.step_names.values(), self.fixed["step_ends"]):
            yield DocEvent(self._at(self.span, name), (), Direction.INTERNAL)

    def _flags(self) -> Iterator[DocData]:
        def data(name: str, type_: str, value: str) -> DocData:
            at = self.span
            return DocData(self._at(at, name), self._at(at, type_), self._at(at, value))

        defaults = {"int32": "0", "bool": "false", "float64": "0.0", "symbol": '""'}
        for event in self._of_kind("in", "out", "local"):
            if self._kept(event):
                yield data(f"{event.name}_now", "bool", "false")
                if event.type:
                    yield data(f"{event.name}_value", event.type, defaults[event.type])
        for timers in self.timers.values():
            for _, flag in timers:
                yield data(flag, "bool", "false")
        for flag in self.leaving.values():
            yield data(flag, "bool", "false")
        for name in (*self.flags, *(("go",) if self.chosen else ())):
            if name:
                yield data(self.fixed[name], "0..65535", "0")
        if self._is_queued():
            yield data(self.fixed["is_in_step"], "bool", "false")

    def _on(
        self, event: str, target: Text | None, *statements: str, guard: str = ""
    ) -> DocTransition:
        return DocTransition(
            Trigger.EVENT, self.span, events=(self._at(self.span, event),),
            targets=() if target is None else (target,),
            guard=self._at(self.span, guard) if guard else None,
            content=self._block(statements, self.span) if statements else None,
        )  # fmt: skip

    def _handlers(self) -> Iterator[DocTransition]:
        """Yield the transitions of the machine: events set flags, and start steps."""
        for event in self._of_kind("in", "local") if self.is_event_driven else self._of_kind("in"):
            value = [f"{event.name}_value = event.value"] if event.type else []
            flag = [*value, f"{event.name}_now = true"] if self._kept(event) else []
            self.recorder.rewrite("R6", event.at, event.name)
            if event.kind == "local":
                again = "(value = event.value)" if event.type else ""
                yield self._on(event.name, None, f"raise {event.name}{again}",
                               guard=self.fixed["is_in_step"])  # fmt: skip
                yield self._on(event.name, None, *flag, *self.local_start)
            elif flag or self.is_event_driven:
                start = self.start if self.is_event_driven else ()
                yield self._on(event.name, None, *flag, *start)
        if not self.is_event_driven:
            yield self._on(self.fixed["cycle"], None, *self.start)
        ends = [f"{e.name}_now = false" for e in self._of_kind("in", "local") if self._kept(e)]
        ends += [f"{flag} = false" for timers in self.timers.values() for _, flag in timers]
        ends += [f"{self.fixed['is_in_step']} = false"] if self._is_queued() else []
        yield self._on(self.fixed["step_ends"], None, *ends)

    # --- states -----------------------------------------------------------------------------------

    def _active_state(self) -> DocState:
        """Return the state that is active from `enter` to `exit`."""
        id_, reactions = self._at(self.span, self.fixed["active"]), self.declared.reactions
        local, own = self._local(reactions, None), []
        children = self._children(None, self.regions)
        if local:
            guard = self._unpassed(self.flow) if self.is_child_first else ""
            own.append(self._on(self._step(self.flow), None, *local, guard=guard))
        own.append(self._on(self.fixed["exit"], self._at(self.span, self.fixed["inactive"])))
        return self._shaped(id_, self.span, None, self.regions, children, reactions, own)

    def _shaped(
        self, id_: Text, at: Span, owner: Vertex | None, regions: list[Region],
        children: tuple[DocState, ...], reactions: list[Reaction], own: list[DocTransition],
    ) -> DocState:  # fmt: skip
        """Return a state with its entry and exit actions, time events and regions."""
        entry = self._triggered(reactions, "entry")
        exit_ = self._exit(owner, self._triggered(reactions, "exit"))
        for number, (timer, flag) in enumerate(self.timers.get(owner, ())):
            trigger = Trigger.AFTER if timer.word == "after" else Trigger.EVERY
            delay = self._at(at, f"{'0' * number}{timer.delay // 1_000_000}ms")
            done = [f"{flag} = true", *(self.start if self.is_event_driven else ())]
            own.append(DocTransition(trigger, at, delay=delay, content=self._block(done, at)))
        several = len(regions) > 1
        initial = None if several or not regions else self._initial(regions[0])
        kind = Kind.PARALLEL if several else Kind.COMPOUND if regions else Kind.ATOMIC
        return DocState(
            id_, kind, at, initial=initial, children=children, transitions=tuple(own),
            entry=(self._block(entry, at),) if entry else (),
            exit=(self._block(exit_, at),) if exit_ else (),
        )  # fmt: skip

    def _children(self, owner: Vertex | None, regions: list[Region]) -> tuple[DocState, ...]:
        found = []
        for region in regions:
            inner = [s for v in region.vertices if (s := self._vertex(v)) is not None]
            if len(regions) == 1:
                found += inner
                continue
            name = self.names.name("_".join((region.name.strip() or "region").split()), "_region")
            found.append(DocState(self._at(region.span, name), Kind.COMPOUND, region.span,
                                  initial=self._initial(region), children=tuple(inner))
                         )  # fmt: skip
        if owner in self.leaving:
            found.append(self._leaver(owner, regions))
        return tuple(found)

    def _initial(self, region: Region) -> DocTransition | None:
        entry = region.entry
        if entry is None and self._is_entered_explicitly(region):
            return initial_to(next(self.ids[v] for v in region.vertices if v.kind in STATES))
        if entry is None or not entry.out:
            reject(self.findings, f"the region `{region.name}` has no default entry", region.span,
                   "add an entry")  # fmt: skip
            return None
        if entry.history in HISTORIES:
            return initial_to(self.ids[entry])
        return self._entry_transition(entry, Trigger.INITIAL)

    def _is_entered_explicitly(self, region: Region) -> bool:
        """Return whether a region without entry can only be entered by a target within it."""
        owner = region.owner
        if owner is None or len(owner.regions) > 1:
            return False
        states = any(vertex.kind in STATES for vertex in region.vertices)
        is_target = owner.incoming or any(v.history for v in owner.region.vertices)
        return states and not is_target

    def _entry_transition(self, entry: Vertex, trigger: Trigger) -> DocTransition | None:
        path = self._path(entry.out[0])
        if path is None:
            return None
        content = self._finished(path.actions)
        return DocTransition(
            trigger, entry.out[0].span, targets=tuple(self.ids[one] for one in path.targets),
            content=self._block(content, entry.out[0].span) if content else None,
        )  # fmt: skip

    def _vertex(self, vertex: Vertex) -> DocState | None:
        id_, at = self.ids[vertex], vertex.span
        match vertex.kind:
            case "FinalState":
                return DocState(id_, Kind.ATOMIC, at, rest=True)
            case "Choice":
                return self._choice(vertex)
            case "Entry" if vertex.history in HISTORIES:
                entry = vertex if vertex.out else vertex.region.entry
                default = None
                if entry is not None and entry.out:
                    default = self._entry_transition(entry, Trigger.INITIAL)
                return DocState(id_, HISTORIES[vertex.history], at, initial=default)
            case "Entry" if self._is_transient(vertex):
                move = self._entry_transition(vertex, Trigger.EVENTLESS)
                return None if move is None else DocState(id_, Kind.CHOICE, at, transitions=(move,))
            case "State":
                reactions = self.read[vertex]
                own = self._reactions(vertex, self._local(reactions, vertex))
                regions = vertex.regions
                children = self._children(vertex, regions)
                return self._shaped(id_, at, vertex, regions, children, reactions, own)
        return None

    def _is_transient(self, entry: Vertex) -> bool:
        """Return whether an entry point has an action, so that it is a state for a moment."""
        return bool(entry.out) and entry is not entry.region.entry and bool(
            self.read[entry.out[0]][0].actions
        )  # fmt: skip

    def _choice(self, vertex: Vertex) -> DocState:
        moves: list[DocTransition] = []
        default = next((a for a in vertex.out if self._is_else(a)), None)
        arcs = [arc for arc in vertex.out if arc is not default]
        for arc in [*arcs, *([] if default is None else [default])]:
            guard, path = self._condition(self.read[arc][0], None), self._path(arc)
            if path is None:
                continue
            if not guard.is_pure:
                reject(self.findings, "a guard of a choice has an effect or calls an operation",
                       arc.span, "call it in the action before the choice")  # fmt: skip
            content = [*self._passing(arc, path), *self._finished(path.actions)]
            is_free = arc is default or guard.text == "true"
            moves.append(DocTransition(
                Trigger.EVENTLESS, arc.span, targets=tuple(self.ids[o] for o in path.targets),
                guard=None if is_free else self._at(arc.span, guard.text),
                content=self._block(content, arc.span) if content else None,
            ))  # fmt: skip
            if is_free:
                break
        if moves and moves[-1].guard is not None:
            reject(self.findings, "this choice has no transition for all other cases", vertex.span,
                   "add a transition with `else`")  # fmt: skip
        return DocState(self.ids[vertex], Kind.CHOICE, vertex.span, transitions=tuple(moves))

    def _is_else(self, arc: Arc) -> bool:
        return self.read[arc][0].is_default or not self.read[arc][0].has_trigger

    # --- reactions --------------------------------------------------------------------------------

    def _condition(self, reaction: Reaction, owner: Vertex | None) -> Code:
        """Return the condition of a reaction during a step."""
        events: list[str] = []
        for trigger in reaction.triggers:
            if isinstance(trigger, Timer):
                flag = self.names.name(f"{trigger.word}_{trigger.delay // 1_000_000}ms")
                if trigger.delay % 1_000_000 or not trigger.delay:
                    reject(self.findings, "a delay is not a positive number of milliseconds",
                           reaction.at, "round it")  # fmt: skip
                self.timers.setdefault(owner, []).append((trigger, flag))
                events.append(flag)
            elif isinstance(trigger, Symbol):
                events.append(f"{trigger.name}_now")
            elif trigger == "always":
                events = ["true"]
                break
        parts = []
        if events and events != ["true"]:
            parts.append(" || ".join(events) if len(events) == 1 else f"({' || '.join(events)})")
        guard = reaction.guard
        if guard is not None:
            parts.append(guard.text)
        text = " && ".join(parts) or "true"
        if guard is None:
            return Code(text)
        if guard.before and len(parts) > 1:
            reject(self.findings, "an assignment within a guard with a trigger is not read",
                   reaction.at, "assign in an action")  # fmt: skip
        return replace(guard, text=text)

    def _local(self, reactions: list[Reaction], owner: Vertex | None) -> list[str]:
        """Return the statements of local reactions, each done if its condition holds."""
        found: list[str] = []
        for one in reactions:
            built_in = [t for t in one.triggers if t in ("entry", "exit")]
            if built_in and len(built_in) == len(one.triggers):
                continue
            condition, actions = self._condition(one, owner), self._finished(one.actions)
            if not actions:
                continue
            inner = "\n".join(actions)
            found += condition.before
            is_always = condition.text == "true" and not any("let " in a for a in actions)
            found.append(inner if is_always else f"if {condition.text} {{\n{inner}\n}}")
        if found:
            self.recorder.rewrite("R11", self.span if owner is None else owner.span)
        return found

    def _triggered(self, reactions: list[Reaction], word: str) -> list[str]:
        """Return the statements of entry or exit actions."""
        found: list[str] = []
        for one in reactions:
            if word not in one.triggers:
                continue
            actions = self._finished(one.actions)
            if one.guard is None:
                found += actions
            elif actions:
                inner = "\n".join(actions)
                found += [*one.guard.before, f"if {one.guard.text} {{\n{inner}\n}}"]
        return found

    def _reactions(self, state: Vertex, local: list[str]) -> list[DocTransition]:
        """Return the transitions of a state on the event of its region."""
        number = state.region.own
        passed = self._unpassed(number)
        quiet = self._not_quiet(number)
        moves = []
        for arc in state.out:
            reaction = self.read[arc][0]
            joins = arc.target.kind == "Synchronization" and len(arc.target.incoming) > 1
            if not reaction.has_trigger and not joins:
                continue
            condition = Code("true") if reaction.is_default else self._condition(reaction, state)
            path = self._path(arc)
            if path is None:
                continue
            if joins:
                condition, path = self._join(arc, condition, path)
            content = [*self._passing(arc, path), *self._finished(path.actions)]
            moves.append((arc, condition, path, content))
        event = (self._at(state.span, self._step(number)),)
        own: list[DocTransition] = []
        if all(condition.is_pure for _, condition, _, _ in moves):
            for arc, condition, path, content in moves:
                parts = [p for p in (quiet, condition.text) if p and p != "true"]
                guard = " && ".join(parts)
                own.append(self._move(arc, path, content, event, guard))
            if local:
                own.append(DocTransition(
                    Trigger.EVENT, state.span, events=event, ordered=True,
                    guard=self._at(state.span, passed) if passed else None,
                    content=self._block(local, state.span),
                ))  # fmt: skip
            return own
        go, otherwise = self.fixed["go"], local
        for arc, condition, path, content in reversed(moves):
            self.chosen += 1
            own.insert(0, replace(
                self._move(arc, path, [f"{go} = 0", *content], (), f"{go} == {self.chosen}"),
                trigger=Trigger.EVENTLESS,
            ))  # fmt: skip
            rest = "" if not otherwise else " else {\n" + "\n".join(otherwise) + "\n}"
            otherwise = [*condition.before,
                         f"if {condition.text} {{ {go} = {self.chosen} }}{rest}"]  # fmt: skip
        if quiet and quiet != passed:
            rest = "" if not local else " else {\n" + "\n".join(local) + "\n}"
            otherwise = [f"if {quiet} {{\n" + "\n".join(otherwise) + "\n}" + rest]
        own.append(DocTransition(
            Trigger.EVENT, state.span, events=event,
            guard=self._at(state.span, passed) if passed else None,
            content=self._block(otherwise, state.span),
        ))  # fmt: skip
        return own

    def _move(
        self, arc: Arc, path: _Path, content: list[str], event: tuple[Text, ...], guard: str
    ) -> DocTransition:
        return DocTransition(
            Trigger.EVENT, arc.span, events=event, ordered=True,
            guard=self._at(arc.span, guard) if guard else None,
            targets=tuple(self.ids[one] for one in path.targets),
            content=self._block(content, arc.span) if content else None,
        )  # fmt: skip

    # --- the order of a step ----------------------------------------------------------------------

    def _unpassed(self, number: int) -> str:
        """Return the guard of an event that a transition of the same step may have made void."""
        if self._is_flat():
            return ""
        return f"{self.fixed['resume']} < {number}"

    def _not_quiet(self, number: int) -> str:
        if self._is_flat() or not self.is_child_first:
            return self._unpassed(number)
        return f"{self.fixed['quiet']} < {number}"

    def _is_flat(self) -> bool:
        """Return whether no region is within another, and nothing is visited after regions."""
        return all(r.lo == r.hi for r in self.regions) and not (
            self.is_child_first and self.declared.reactions
        )  # fmt: skip

    def _passing(self, arc: Arc, path: _Path) -> list[str]:
        """Return the statements that end the visit of states that a transition changes."""
        if self._is_flat():
            return []
        source, number = arc.source, arc.source.region.own
        targets = [o for t in path.targets for o in t.containers]
        outermost = source if source.kind in STATES else None
        for one in source.containers:
            if isinstance(one, Vertex) and one.kind in STATES and (
                one is source or one in path.targets or one not in targets
            ):  # fmt: skip
                outermost = one
        if outermost is None:
            return []
        region = outermost.region
        resume, quiet = self.fixed["resume"], self.fixed["quiet"]
        if not self.is_child_first:
            if region.hi <= number and source.kind in STATES:
                return []
            if source.kind in STATES:
                return [f"{resume} = {region.hi}"]
            return [f"if {resume} < {region.hi} {{ {resume} = {region.hi} }}"]
        if source.kind not in STATES:
            if outermost is not source:
                reject(self.findings, "a choice leads out of its state in a child-first statechart",
                       arc.span, "lead the transition to its target directly")  # fmt: skip
            return []
        last = self._chain(region)
        around = [one for one in path.last[0].containers if one not in path.last]
        reacts = path.last[0].kind in STATES and any(
            isinstance(one, Vertex) and one.kind == "State" and one not in around
            for one in path.last[1].containers
        )
        own = region.own if reacts else last
        if last <= number:
            return []
        return [f"{quiet} = {last}", *([f"{resume} = {own}"] if own > number else [])]

    def _chain(self, region: Region) -> int:
        """Return the last number that is visited right after a region, child first."""
        owner = region.owner
        siblings = self.regions if owner is None else owner.regions
        if siblings[-1] is not region:
            return region.own
        return self.flow if owner is None else self._chain(owner.region)

    # --- paths ------------------------------------------------------------------------------------

    def _path(self, arc: Arc, depth: int = 0) -> _Path | None:
        """Return where a transition leads; None, and a finding, if that has no chart form."""
        target, actions = arc.target, self.read[arc][0].actions
        if depth > LONGEST_PATH:
            self._reject(arc, "the exit points of this transition lead in a circle")
            return None
        if self._crosses(arc):
            self._reject(arc, "this transition leads from one region to another of the same state")
            return None
        match target.kind:
            case "Exit":
                return self._through_exit(arc, actions, depth)
            case "Synchronization":
                return self._through_fork(arc, actions, depth)
            case "Entry" if target.history not in HISTORIES and not self._is_transient(target):
                if not target.out:
                    self._reject(arc, "this entry leads nowhere")
                    return None
                rest = self._path(target.out[0], depth + 1)
                if rest is None:
                    return None
                return _Path(rest.targets, (*actions, *rest.actions), (arc.source, target))
            case "State":
                points = self.read[arc][0].entry_points
                targets = self._entered(target, points[0] if points else "", depth)
                return None if targets is None else _Path(targets, actions, (arc.source, target))
        return _Path((target,), actions, (arc.source, target))

    def _entered(self, state: Vertex, point: str, depth: int) -> tuple[Vertex, ...] | None:
        """Return the targets within a state that is entered through an entry point."""
        found: list[Vertex] = []
        for region in state.regions if point and point != "default" else ():
            entry = region.named(point)
            if entry is None:
                continue
            if entry.history in HISTORIES or self._is_transient(entry):
                found.append(entry)
            elif entry.out and (inner := self._path(entry.out[0], depth + 1)) is not None:
                found += inner.targets
        return tuple(found) or (state,)

    def _through_exit(self, arc: Arc, actions: tuple[str, ...], depth: int) -> _Path | None:
        owner, name = arc.target.region.owner, arc.target.name.strip() or "default"
        outer = () if owner is None else [a for a in owner.out if not self.read[a][0].has_trigger]
        free = [a for a in outer if a.target.kind != "Synchronization"]
        exits = [(a, self.read[a][0].exit_points) for a in free]
        found = [a for a, points in exits if name in points or (name == "default" and not points)]
        found += [a for a, points in exits if not points or "default" in points]
        if not found or arc.source.kind not in STATES or owner is None:
            self._reject(arc, "no transition takes over from this exit point")
            return None
        if actions and self._has_exit(owner):
            self._reject(arc, "an action before an exit point and exit actions of its state")
            return None
        rest = self._path(found[0], depth + 1)
        return None if rest is None else _Path(rest.targets, (*actions, *rest.actions), rest.last)

    def _through_fork(self, arc: Arc, actions: tuple[str, ...], depth: int) -> _Path | None:
        targets: list[Vertex] = []
        for leg in arc.target.out:
            path = self._path(leg, depth + 1)
            if path is None:
                return None
            targets += [one for one in path.targets if one not in targets]
            actions += path.actions
        within = all(arc.target.region in one.containers for one in targets)
        if not targets or not within or arc.target.region not in arc.source.containers:
            self._reject(arc, "this fork or join is not beside the states that it leads to")
            return None
        return _Path(tuple(targets), actions, (arc.source, arc.target))

    def _join(self, arc: Arc, own: Code, path: _Path) -> tuple[Code, _Path]:
        """Return the condition of all transitions of a join, and their actions."""
        others = sorted((a for a in arc.target.incoming if a.source.kind == "State"),
                        key=lambda a: a.source.region.own)  # fmt: skip
        conditions: list[Code] = [own]
        actions: list[str] = []
        for one in others:
            actions += self.read[one][0].actions
            if one is arc:
                continue
            conditions.append(Code(f"In({self.ids[one.source]})"))
            if self.read[one][0].has_trigger:
                conditions.append(self._condition(self.read[one][0], one.source))
        if not all(one.is_pure for one in conditions):
            self._reject(arc, "a guard of this join has an effect or calls an operation")
        text = " && ".join(one.text for one in conditions if one.text != "true") or "true"
        rest = path.actions[len(self.read[arc][0].actions) :]
        return Code(text), replace(path, actions=(*actions, *rest))

    def _crosses(self, arc: Arc) -> bool:
        """Return whether a transition leads into another region of a state that stays active."""
        source, target = arc.source.containers, arc.target.containers
        common = next((o for o in source if o in target), None)
        return isinstance(common, Vertex) and common not in (arc.source, arc.target)

    def _reject(self, arc: Arc, message: str) -> None:
        reject(self.findings, message, arc.span, "lead the transition to a state directly")

    # --- what charts do in another order ----------------------------------------------------------

    def _check_order(self) -> None:
        """Reject pseudo-states and events that a chart would handle in another order."""
        for regions in (self.regions, *(vertex.regions for vertex in self.vertices)):
            for region in regions[:-1]:
                if self._chooses(region, set()):
                    reject(self.findings, "a choice is entered before other regions are",
                           region.span, "make the choice before the state is entered")  # fmt: skip
        for vertex in self.vertices:
            self._check_history(vertex)
            for arc in vertex.out if vertex.kind != "Entry" else ():
                self._check_entry(arc)
        if not self.is_event_driven:
            return
        found: set[Vertex] = set()
        for region in self.regions:
            self._chooses(region, found)
        reactions = [*self.declared.reactions, *(r for v in found for r in self.read[v])]
        early = [one for one in reactions if "entry" in one.triggers]
        choices = [v for v in found if v.kind in ("Entry", "Choice")]
        early += [self.read[arc][0] for v in choices for arc in v.out]
        if any(self._raises_local(one.actions) for one in early):
            reject(self.findings, "a local event is raised while the machine is entered", self.span,
                   "raise it in a transition")  # fmt: skip
        everywhere = [*self.declared.reactions, *(r for v in self.vertices for r in self.read[v])]
        leaving = [one for one in everywhere if "exit" in one.triggers]
        if any(self._raises_local(one.actions) for one in leaving):
            self.recorder.differ("a local event that an exit action raises is lost at `exit`; in "
                                 "itemis CREATE it waits for the next `enter`", self.span,
                                 self.findings)  # fmt: skip

    def _raises_local(self, actions: tuple[str, ...]) -> bool:
        return any(one.startswith("raise ") for one in actions)

    def _chooses(self, region: Region, found: set[Vertex]) -> bool:
        """Return whether default entry of a region meets a choice; add its vertices to `found`."""
        entries = [region.entry] if region.entry is not None else []
        chooses = False
        while entries:
            vertex = entries.pop()
            if vertex is None or vertex in found:
                continue
            found.add(vertex)
            chooses = chooses or vertex.kind == "Choice"
            if vertex.kind in ("Entry", "Choice"):
                entries += [arc.target for arc in vertex.out]
            around = [one for one in vertex.containers if isinstance(one, Vertex)]
            entries += [one for one in around if region in one.containers]
            for inner in vertex.regions:
                chooses = self._chooses(inner, found) or chooses
        return chooses

    def _check_entry(self, arc: Arc) -> None:
        """Reject a transition to a choice, or an entry with an action, before other regions."""
        target, source = arc.target, arc.source.containers
        if target.kind != "Choice" and not (target.kind == "Entry" and self._is_transient(target)):
            return
        for one in target.containers:
            owner = one.owner if isinstance(one, Region) else None
            if owner is not None and owner not in source and one is not owner.regions[-1]:
                self._reject(arc, "a choice is entered before other regions are")

    def _check_history(self, vertex: Vertex) -> None:
        """Reject states that a history of itemis does not remember, but one of a chart does."""
        regions = [one for one in vertex.containers if isinstance(one, Region)]
        kinds = [{v.history for v in one.vertices if v.kind == "Entry"} for one in regions]
        is_recorded = bool(kinds[0] & set(HISTORIES)) or any("DEEP_HISTORY" in k for k in kinds)
        leaves = any(vertex.region not in arc.target.containers for arc in vertex.out)
        if is_recorded and (vertex.kind == "FinalState" or (vertex.kind == "Choice" and leaves)):
            what = "final state" if vertex.kind == "FinalState" else "choice that leads out"
            reject(self.findings, f"a {what} in a region with history", vertex.span,
                   "move it out of the region")  # fmt: skip
        if vertex.history in HISTORIES and not vertex.out and (
            vertex.region.entry is None or not vertex.region.entry.out):  # fmt: skip
            reject(self.findings, "a history without default entry", vertex.span,
                   "add a transition to a state")  # fmt: skip

    # --- exit actions in the order of regions -----------------------------------------------------

    def _has_exit(self, owner: Vertex) -> bool:
        inner = [owner, *all_vertices(owner.regions)]
        return any("exit" in one.triggers for v in inner for one in self.read[v])

    def _find_leaving(self) -> None:
        """Note the states whose regions have exit actions, in which itemis leaves them in order."""
        owners: list[tuple[Vertex | None, list[Region]]] = [(None, self.regions)]
        owners += [(v, v.regions) for v in self.vertices]
        for owner, regions in owners:
            with_exit = [r for r in regions if any(map(self._has_exit, r.vertices))]
            if len(with_exit) > 1:
                name = "machine" if owner is None else self.ids[owner].value
                self.leaving[owner] = self.names.name(f"{name}_is_left")

    def _exit(self, owner: Vertex | None, own: list[str]) -> list[str]:
        """Return the exit actions of a state: none while an outer state leaves its regions."""
        own = self._unless_left(owner, own)
        return [f"{self.leaving[owner]} = false", *own] if owner in self.leaving else own

    def _leaver(self, owner: Vertex | None, regions: list[Region]) -> DocState:
        """Return the last region of a state, which is left first and does all exit actions."""
        at = self.span if owner is None else owner.span
        name = self.leaving[owner].removesuffix("_is_left")
        ids = [self._at(at, self.names.name(f"{name}_{word}")) for word in ("order", "ordered")]
        done = self._ordered(regions)
        block = self._block(self._unless_left(owner, [f"{self.leaving[owner]} = true", *done]), at)
        leaf = DocState(ids[1], Kind.ATOMIC, at, exit=(block,))
        return DocState(ids[0], Kind.COMPOUND, at, initial=initial_to(ids[1]), children=(leaf,))

    def _unless_left(self, owner: Vertex | None, done: list[str]) -> list[str]:
        flags = []
        at = owner
        while at is not None:
            at = at.region.owner
            if at in self.leaving:
                flags.append(f"!{self.leaving[at]}")
        if not flags or not done:
            return done
        inner = "\n".join(done)
        return [f"if {' && '.join(flags)} {{\n{inner}\n}}"]

    def _ordered(self, regions: list[Region]) -> list[str]:
        found = []
        for region in regions:
            for vertex in region.vertices:
                if vertex.kind == "State" and self._has_exit(vertex):
                    inner = [*self._ordered(vertex.regions),
                             *self._triggered(self.read[vertex], "exit")]  # fmt: skip
                    body = "\n".join(inner)
                    found.append(f"if In({self.ids[vertex]}) {{\n{body}\n}}")
        return found
