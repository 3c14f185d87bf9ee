"""Build the template of a machine: a location for each stable configuration.

A macrostep is a chain of edges through committed locations, so that nothing interleaves with it.
Each edge tests, then updates; tests that follow updates are on an edge of their own.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field, replace
from math import prod

import fsmkit.language as lang
from fsmkit.export.identifiers import word
from fsmkit.export.uppaal.automaton import Automaton, Cause, Trigger, Ways
from fsmkit.export.uppaal.data import Data
from fsmkit.export.uppaal.entries import (
    AT_HAND,
    FIRST_SLOT,
    Assignment,
    Entry,
    History,
    Key,
    Output,
    Path,
    QueuedEvent,
    ResultChoice,
    Test,
    TimerStart,
    scratch,
)
from fsmkit.export.uppaal.network import Edge, Location, Template
from fsmkit.export.uppaal.space import Space, leaves
from fsmkit.export.uppaal.terms import unsupported
from fsmkit.language.walk import nodes
from fsmkit.system.machine import EventLink

MOST_CLOCK = 2**30 - 2
"""The longest time that UPPAAL compares a clock with."""
STOPPED = "#d98880"
"""The color of locations of machines that have come to an end or a fault."""


Recorded = tuple[tuple[tuple[int, frozenset[int] | None], ...], ...]
"""Cases of recorded histories, by their states; no case: it does not matter."""


@dataclass(frozen=True, slots=True)
class Beginning:
    """The start of the first edge of a step."""

    guard: tuple[str, ...] = ()
    sync: str = ""
    comment: str = ""
    pops: bool = False
    starts: bool = False
    given: tuple[tuple[str, lang.Fragment, tuple[str, int, int] | None], ...] = ()
    """The term for a path before the first update, and the selection that provides it."""


@dataclass(slots=True)
class Builder:
    """Builds the template of one machine."""

    space: Space
    machine: int
    automaton: Automaton
    data: Data
    boot: tuple[int, int] | None = None
    """The place of the machine in the order of starting, and how many have steps to take then."""
    locations: dict[Key, Location] = field(default_factory=dict)
    passed: list[Location] = field(default_factory=list)
    edges: list[Edge] = field(default_factory=list)
    takes_steps: bool = False
    """Whether some step passes through a committed location."""
    fair: dict[Key, list[tuple[Recorded, tuple[Test, ...]]]] = field(default_factory=dict)
    """For each location when something fair can happen there: histories, and tests."""
    still: dict[Key, tuple[Test, ...] | None] = field(default_factory=dict)
    """For each location when no eventless transition is enabled there; None: never."""
    owes_by_payload: bool = False
    """Whether that depends on what an event carries, somewhere."""

    def template(self) -> Template:
        """Return the template."""
        self._name_locations()
        initial = self._start()
        for key in self.automaton.keys:
            if key.running:
                self._reactions(key)
        return Template(
            self.space.templates[self.machine],
            self.space.instances[self.machine],
            tuple(self.data.declared),
            (*self.locations.values(), *self.passed),
            initial,
            tuple(self.edges),
        )

    # --- locations -------------------------------------------------------------------------------

    def _name_locations(self) -> None:
        chart = self.automaton.paths.chart
        names = self.data.names
        for key in self.automaton.keys:
            active = [chart.states[s] for s in sorted(key.configuration)]
            base = "_".join(word(s.id) for s in active if s.is_leaf) or "stopped"
            if key.fault:
                base += f"_{word(key.fault)}_fault"
            invariant = () if self.space.closed.untimed else self._invariant(key)
            color = "" if key.running else STOPPED
            name = names.take(base)
            self.locations[key] = Location(self.space.id(), name, invariant, color=color)

    def _invariant(self, key: Key) -> tuple[str, ...]:
        found = {}
        for timer in key.timers:
            self._require_short(timer)
            if timer.greatest is not None:
                found[self.data.clock(timer)] = f"{self.data.clock(timer)} <= {timer.greatest}"
        return tuple(found.values())

    def _require_short(self, timer: TimerStart) -> None:
        """Reject a delay that a clock of UPPAAL cannot represent."""
        if max(timer.least, timer.greatest or 0) > MOST_CLOCK:
            raise unsupported(
                f"a delay of {timer.greatest} ticks is longer than clocks of UPPAAL count",
                self.automaton.paths.chart.root.span,
                "let a tick be longer: `capacity: {tick: 1ms}`",
            )

    # --- the start -------------------------------------------------------------------------------

    def _start(self) -> str:
        if self.boot is None:
            (path,) = self.automaton.start
            return self.locations[path.target].id
        name = self.data.names.take("starting")
        first = Location(self.space.id(), name, committed=True)
        self.passed.append(first)
        place, count = self.boot
        guard = (f"{self.space.boot} == {place}",) if count > 1 else ()
        beginning = Beginning(guard, starts=True, given=self._free_inputs())
        source = Key(frozenset(), running=False)
        self.grow(list(self.automaton.start), 0, first.id, beginning, source)
        return first.id

    def _free_inputs(self) -> tuple[tuple[str, lang.Fragment, tuple[str, int, int] | None], ...]:
        closed = self.space.closed
        if not closed.is_open:
            return ()
        chart = closed.charts[self.machine]
        inputs = ((chart.inputs[free.input], free.values) for free in closed.free_inputs)
        return tuple(self._selected(i.name, i.name, i.type, values) for i, values in inputs)

    def _selected(
        self, path: str, word: str, type_: lang.Type, values: tuple[lang.Value, ...]
    ) -> tuple[str, lang.Fragment, tuple[str, int, int] | None]:
        """Return the expression of a value that is chosen among several."""
        if any(isinstance(v, tuple | float) for v in values):
            raise unsupported(
                f"the external value `{word}` has the type `{type_}`",
                self.automaton.paths.chart.root.span,
                "use numbers, truth values and enumerations",
            )
        numbers = sorted({self.space.number(value) for value in values})
        name = self.data.names_of_select(word)
        if len(numbers) == 1:
            text, select = str(numbers[0]), None
        elif numbers[-1] - numbers[0] == len(numbers) - 1:
            text, select = name, (name, numbers[0], numbers[-1])
        else:
            text = f"{self.data.table(word, numbers)}[{name}]"
            select = (name, 0, len(numbers) - 1)
        if isinstance(type_, lang.BoolType):
            fragment = lang.Fragment(f"{text} == 1", 7)
            if select is None:
                fragment = lang.Fragment("true" if numbers[0] else "false")
            return path, fragment, select
        return path, lang.Fragment(text), select

    # --- reactions -------------------------------------------------------------------------------

    def _reactions(self, key: Key) -> None:
        reactions = self.automaton.reactions.get(key, {})
        quiet: list[str] = []
        for trigger, paths_by_history in reactions.items():
            if trigger.cause is Cause.EVENTLESS and not self.space.closed.is_open:
                self.still[key] = _still(paths_by_history)
                quiet = self._quiet(self.still[key])
        merged: dict[object, list[tuple[Trigger, Ways]]] = {}
        for trigger, paths_by_history in reactions.items():
            same: object = trigger
            if trigger.cause in (Cause.TAKE, Cause.OUTSIDE) and not _reads_payload(
                paths_by_history
            ):
                same = trigger.cause, trigger.fair, frozenset(paths_by_history.items())
            merged.setdefault(same, []).append((trigger, paths_by_history))
        for alike in merged.values():
            self._reaction(key, [trigger for trigger, _ in alike], alike[0][1], quiet)

    def rests(self) -> dict[str, tuple[str, ...]]:
        """Return for locations, by id, when no eventless transition is enabled."""
        return {
            self.locations[key].id: tuple(self._quiet(still)) for key, still in self.still.items()
        }

    def _quiet(self, still: tuple[Test, ...] | None) -> list[str]:
        """Return the condition under which no eventless transition is enabled."""
        return ["false"] if still is None else [self.condition(test) for test in still]

    def _reaction(
        self, key: Key, triggers: list[Trigger], paths_by_history: Ways, quiet: list[str]
    ) -> None:
        trigger, space = triggers[0], self.space
        machine = space.closed.system.machines[self.machine]
        own = space.queues.get(self.machine)
        empty = [f"{own.length} == 0"] if own else []
        beginnings: list[Beginning]
        match trigger.cause:
            case Cause.EVENTLESS:
                sync = "" if space.closed.is_open else space.urgently
                guard = self._may_move(machine.environment, machine.is_monitor)
                beginnings = [Beginning(tuple(guard), sync)]
            case Cause.TAKE:
                assert own is not None  # noqa: S101  (something can be taken)
                heads = [f"{own.events}[0] == {own.numbers[t.event]}" for t in triggers]
                head = _some(heads)
                if len(heads) > 1 and len(heads) == len(own.numbers):
                    head = f"{own.length} > 0"
                first: list[str] = []
                if not machine.is_monitor:
                    first = space.no_priority_events(environment=not machine.environment)
                given = self._front(trigger.event)
                guard = [head, *first, *quiet]
                beginnings = [Beginning(tuple(guard), space.urgently, pops=True, given=given)]
            case Cause.FIRE:
                guard = [
                    *self._due(key, trigger.place),
                    *empty,
                    *space.no_priority_events(),
                    *quiet,
                ]
                beginnings = [Beginning(tuple(dict.fromkeys(guard)))]
            case Cause.SPONTANEOUS:
                guard = [*empty, *space.no_priority_events(), *quiet]
                word = "sometimes"
                beginnings = [Beginning(tuple(dict.fromkeys(guard)), comment=word)]
            case _:
                beginnings = self._from_outside(triggers)
        inputs = self._free_inputs()
        for beginning in beginnings:
            begun = replace(beginning, given=(*beginning.given, *inputs))
            for remembered, paths in self._by_history(paths_by_history):
                effective = self._effective(trigger, key, paths)
                if trigger.fair:
                    self._note_fair(key, trigger, paths, remembered)
                begun_here = replace(begun, guard=(*begun.guard, *self.remembers(remembered)))
                self.grow(effective, 0, self.locations[key].id, begun_here, key)

    def _effective(self, trigger: Trigger, key: Key, paths: Iterable[Path]) -> list[Path]:
        if trigger.cause is Cause.EVENTLESS:
            return [path for path in paths if path.happened]
        if trigger.cause is Cause.OUTSIDE:
            return [path for path in paths if not path.is_idle(key)]
        return list(paths)

    def _note_fair(
        self, key: Key, trigger: Trigger, paths: Iterable[Path], remembered: Recorded
    ) -> None:
        """Record the condition of fair events in a location that may be stable forever."""
        found = self.fair.setdefault(key, [])
        for path in paths:
            if trigger.cause is not Cause.SPONTANEOUS and path.is_idle(key):
                continue
            tests: list[Test] = []
            for entry in path.entries:
                if not isinstance(entry, Test | ResultChoice):
                    break
                if isinstance(entry, Test):
                    if any(isinstance(n, lang.Variable) and n.name[0] == "@" for n in nodes(entry)):
                        self.owes_by_payload = True
                        continue
                    tests.append(entry)
            found.append((remembered, tuple(tests)))

    def _may_move(self, environment: bool, monitor: bool) -> list[str]:
        """Return the condition under which a machine may move without an event."""
        own = self.space.queues.get(self.machine)
        everybody = self.space.no_priority_events()
        if not environment or own is None:
            return everybody
        busy = _some([f"{own.length} > 0", " && ".join(everybody)])
        return [busy] if monitor else [busy, *self.space.no_priority_events(environment=False)]

    def _due(self, key: Key, place: int) -> list[str]:
        """Return the condition under which a timer fires: expired, and no earlier one has."""
        if self.space.closed.untimed:
            return []
        fired = key.timers[place]
        self._require_short(fired)
        found = [f"{self.data.clock(fired)} >= {fired.least}"] if fired.least else []
        if not fired.is_interval:
            found += [
                f"{self.data.clock(other)} < {other.greatest}"
                for other in key.timers
                if other.greatest is not None and other.greatest > fired.least
            ]
        return found

    def _front(self, event: int) -> tuple[tuple[str, lang.Fragment, None], ...]:
        """Return the location of the payload of the first event of the queue."""
        own = self.space.queues[self.machine]
        found = []
        for place, part in enumerate(self.automaton.paths.chart.events[event].fields):
            text = f"{own.lanes[place][0]}[0]"
            is_bool = isinstance(part.type, lang.BoolType)
            fragment = lang.Fragment(f"{text} == 1", 7) if is_bool else lang.Fragment(text)
            found.append((scratch(AT_HAND, part.name), fragment, None))
        return tuple(found)

    def _from_outside(self, triggers: list[Trigger]) -> list[Beginning]:
        guard = tuple(
            dict.fromkeys([*self.space.no_priority_events(), *self.space.has_few_events()])
        )
        chart = self.automaton.paths.chart
        names = ", ".join(chart.events[t.event].name for t in triggers)
        trigger = triggers[0]
        fields = chart.events[trigger.event].fields
        if len(triggers) > 1 or not fields:
            return [Beginning(guard, comment=names)]
        columns = [tuple(dict.fromkeys(column)) for column in zip(*trigger.payloads, strict=True)]
        groups: list[list[tuple[lang.Value, ...]]] = [columns]
        if prod(map(len, columns)) != len(trigger.payloads):
            groups = [[(value,) for value in payload] for payload in trigger.payloads]
        return [
            Beginning(
                guard,
                comment=names,
                given=tuple(
                    self._selected(scratch(AT_HAND, part.name), part.name, part.type, values)
                    for part, values in zip(fields, group, strict=True)
                ),
            )
            for group in groups
        ]

    def _by_history(self, paths_by_history: Ways) -> Iterator[tuple[Recorded, tuple[Path, ...]]]:
        """Yield the different paths of a reaction, each with the recorded histories it needs."""
        groups: dict[frozenset[Path], list[History]] = {}
        order: dict[frozenset[Path], tuple[Path, ...]] = {}
        for history, paths in paths_by_history.items():
            groups.setdefault(frozenset(paths), []).append(history)
            order.setdefault(frozenset(paths), paths)
        if len(groups) == 1:
            yield (), next(iter(order.values()))
            return
        states = sorted({state for history in paths_by_history for state, _ in history})
        for same, histories in groups.items():
            seen = dict.fromkeys(tuple(dict(h).get(state) for state in states) for h in histories)
            yield tuple(tuple(zip(states, values, strict=True)) for values in seen), order[same]

    def remembers(self, recorded: Recorded, template: str = "") -> list[str]:
        """Return the condition of a recorded history.

        ``template``: the prefix of the machine elsewhere.
        """
        data = self.data
        cases = [
            " && ".join(
                f"{template}{data.histories[state]} == {data.history_text(state, value)}"
                for state, value in case
            )
            for case in recorded
        ]
        return [_some(cases)] if cases else []

    def condition(self, test: Test) -> str:
        """Return a test as a part of a guard."""
        return self.data.printer.condition(test.condition, holds=test.holds)

    # --- edges -----------------------------------------------------------------------------------

    def grow(
        self,
        paths: list[Path],
        at: int,
        source: str,
        beginning: Beginning | None,
        start: Key,
    ) -> None:
        """Add the edges of paths with a common start up to an entry."""
        if beginning is not None and "false" in beginning.guard:
            return
        groups: dict[tuple[tuple[Entry, ...], tuple[Entry, ...]], list[Path]] = {}
        for path in paths:
            tests, actions = piece(path.entries, at)
            groups.setdefault((tests, actions), []).append(path)
        for (tests, actions), alike in groups.items():
            end = at + len(tests) + len(actions)
            ended = list(dict.fromkeys(p for p in alike if len(p.entries) == end))
            going = [p for p in alike if len(p.entries) > end]
            if going:
                through = Location(self.space.id(), committed=True)
                self.passed.append(through)
                self.takes_steps = True
                later = [entry for path in going for entry in path.entries[end:]]
                edge = self._edge(source, beginning, tests, actions, later)
                before = (
                    [f"{self.space.stable} = false"] if beginning and not beginning.starts else []
                )
                update = (*before, *edge.update)
                self.edges.append(replace(edge, target=through.id, update=update))
                self.grow(going, end, through.id, None, start)
            for path in ended:
                edge = self._edge(source, beginning, tests, actions, [])
                closing = self._closing(path, start)
                if not start.configuration:
                    closing += self._booted()
                elif beginning is None:
                    closing.append(f"{self.space.stable} = true")
                target = self.locations[path.target].id
                update = (*edge.update, *closing)
                self.edges.append(replace(edge, target=target, update=update))

    def _booted(self) -> list[str]:
        assert self.boot is not None  # noqa: S101  (there are steps to take)
        place, count = self.boot
        found = [f"{self.space.boot} = {place + 1}"] if count > 1 else []
        return [*found, f"{self.space.stable} = true"] if place + 1 == count else found

    def _edge(
        self,
        source: str,
        beginning: Beginning | None,
        tests: tuple[Entry, ...],
        actions: tuple[Entry, ...],
        later: list[Entry],
    ) -> Edge:
        """Return an edge without a target: its tests and updates."""
        begun = beginning or Beginning()
        posts = any(self._is_own(action) for action in actions) and begun.pops
        self.data.bind({path: text for path, text, _ in begun.given})
        guard = [*begun.guard, *(self.condition(t) for t in tests if isinstance(t, Test))]
        picked = [f"{t.operation}() = {t.value}" for t in tests if isinstance(t, ResultChoice)]
        needed = names_in((*later, *(actions if posts else ())))
        closed = self.space.closed
        inputs = closed.charts[0].inputs
        kept_inputs = {inputs[n].name for n in closed.kept_inputs}
        update = []
        for path, text, _ in begun.given:
            if path in needed or path in kept_inputs:
                update.append(f"{self._kept(path)} = {text.at_least(2)}")
                self.data.bound.add(path)
        if posts:
            update += self.space.queues[self.machine].pop(flat=self.space.flat)
            self.data.bindings = {
                p: t for p, t in self.data.bindings.items() if not p.startswith("@")
            }
        for action in actions:
            update += self._action(action)
        if begun.pops and not posts:
            update += self.space.queues[self.machine].pop(flat=self.space.flat)
        bound = self.data.bound
        select = tuple(s for path, _, s in begun.given if s is not None and path in bound)
        self.data.bind({})
        comment = ", ".join([*([begun.comment] if begun.comment else []), *picked])
        return Edge(
            source, "", select, tuple(dict.fromkeys(guard)), begun.sync, tuple(update), comment
        )

    def _kept(self, path: str) -> str:
        """Return the variable for a part of the current event, or for an input."""
        if not path.startswith("@"):
            return self.data.variables[path]
        chart, name = self.automaton.paths.chart, path.partition(".")[2]
        types = {part.type for event in chart.events for part in event.fields if part.name == name}
        if len(types) > 1:
            raise unsupported(
                f"`{name}` is `{min(types, key=str)}` in one event and another type in another",
                chart.root.span,
                "give both the same type, or another name",
            )
        return self.data.kept(path, types.pop())

    def _is_own(self, entry: Entry) -> bool:
        """Whether an entry sends to the own queue."""
        if isinstance(entry, QueuedEvent):
            return True
        return isinstance(entry, Output) and any(
            link.target == self.machine for link in self._links(entry.port)
        )

    def _links(self, port: int) -> list[EventLink]:
        wire = self.automaton.paths.wire(port) if port < (1 << 16) else port
        return [
            link
            for link in self.space.closed.system.event_links
            if link.source == self.machine and link.port == wire
        ]

    def _action(self, action: Entry) -> list[str]:
        data, space = self.data, self.space
        match action:
            case Assignment(location, value):
                return self._stored(location, value)
            case QueuedEvent(event, values):
                texts = [data.number(value) for value in values]
                return space.queues[self.machine].push(event, texts, flat=space.flat)
            case Output(port, values):
                found = []
                for link in self._links(port):
                    queue = space.queues[link.target]
                    texts = [data.number(values[n]) for n in link.arguments]
                    found += queue.push(link.event, texts, flat=space.flat)
                return found
            case _:
                return []

    def _stored(self, location: lang.Expr, value: lang.Expr) -> list[str]:
        """Return the updates that store a value, one for each part of a record or an array."""
        printer = self.data.printer
        if isinstance(location, lang.Element) or not isinstance(
            location, lang.Variable | lang.Member
        ):
            return [f"{printer.print(location)} = {printer.print(value)}"]
        assert location.type is not None  # noqa: S101  (a value)
        path = _path(location)
        found = []
        base = value.value if isinstance(value, lang.Literal) else None
        for name, type_, constant in leaves(path, location.type, base):
            text = self.data.kept(name, type_) if name[0] == "@" else self.data.name(name)
            other: lang.Expr = value
            if constant is not None and isinstance(value, lang.Literal):
                other = lang.Literal(constant, type_, value.span)
            elif name != path:
                source = _path(value) + name[len(path) :]
                other = replace(_variable(value), name=source, type=type_)
            if not isinstance(type_, lang.ArrayType):
                found.append(f"{text} = {printer.print(other)}")
                continue
            for place in range(type_.length):
                if isinstance(other, lang.Literal) and isinstance(other.value, tuple):
                    item = printer.print(
                        lang.Literal(other.value[place], type_.element, value.span)
                    )
                else:
                    item = f"{self.data.name(_path(other))}[{place}]"
                found.append(f"{text}[{place}] = {item}")
        return found

    # --- the end of a step -----------------------------------------------------------------------

    def _closing(self, path: Path, start: Key) -> list[str]:
        """Return the last updates of a step: its outputs, and cleared temporaries."""
        self._require_order(path)
        data, found = self.data, []
        stored = {_path(e.location) for e in path.entries if isinstance(e, Assignment)}
        found += self._copied({name.split(".")[0] for name in stored})
        target = path.target
        histories = path.written if target.running else ()
        for state, value in histories:
            found.append(f"{data.histories[state]} = {data.history_text(state, value)}")
        for state, flag in data.flags.items():
            now = state in target.configuration
            if now != (state in start.configuration):
                found.append(f"{flag} = {'true' if now else 'false'}")
        if not self.space.closed.untimed:
            found += dict.fromkeys(f"{data.clock(timer)} = 0" for timer in path.fresh)
        found += self._forgotten(path, start)
        if not target.running:
            found += self._stopped()
        return found

    def _require_order(self, path: Path) -> None:
        """Reject a step whose events would reach the own queue in another order."""
        wired = False
        for entry in path.entries:
            if isinstance(entry, Output):
                wired = wired or self._is_own(entry)
            elif isinstance(entry, QueuedEvent) and wired:
                chart = self.automaton.paths.chart
                raise unsupported(
                    f"`{chart.name}` sends itself an event by a wire and then one without",
                    chart.root.span,
                    "send both the same way",
                )

    def _stopped(self) -> list[str]:
        data = self.data
        found = [f"{name} = 0" for name in data.histories.values()]
        queue = self.space.queues.get(self.machine)
        if queue is not None:
            found += [*queue.clear(), f"{queue.stopped} = true"]
        return found

    def _forgotten(self, path: Path, start: Key) -> list[str]:
        """Return the updates that clear the current events, and inputs that are not state."""
        data = self.data
        used = names_in(path.entries)
        tests, actions = piece(path.entries, 0)
        kept = names_in(path.entries[len(tests) + len(actions) :])
        if any(self._is_own(action) for action in actions):
            kept |= names_in(actions)
        gone = []
        for name in sorted(data.scratch):
            instance = int(name[1:].partition(".")[0])
            if instance < FIRST_SLOT:
                if name in (kept if instance == AT_HAND else used):
                    gone.append(name)
                continue
            before = any(timer.slot == instance for timer in start.timers)
            after = any(timer.slot == instance for timer in path.target.timers)
            if not after and (before or name in used):
                gone.append(name)
        found = [data.reset(name) for name in gone]
        closed = self.space.closed
        if closed.is_open:
            inputs = self.automaton.paths.chart.inputs
            free = (
                inputs[one.input].name
                for one in closed.free_inputs
                if one.input not in closed.kept_inputs
            )
            found += [data.initial(name) for name in free if name in kept]
        return found

    def _copied(self, stored: set[str]) -> list[str]:
        """Return the updates that copy outputs to connected inputs."""
        space, found = self.space, []
        machines = space.closed.system.machines
        changes: dict[int, list[tuple[str, str]]] = {}
        for link in space.closed.system.input_links:
            target = machines[link.target]
            if link.source != self.machine or link.input >= len(target.chart.inputs):
                continue
            name, type_, _ = space.source_of(self.machine, link.output)
            if name not in stored:
                continue
            to = target.chart.inputs[link.input].name
            for path, part, _ in leaves(name, type_):
                left = space.inputs[link.target, to + path[len(name) :]]
                right = self.data.name(path)
                count = part.length if isinstance(part, lang.ArrayType) else 0
                places = [f"[{n}]" for n in range(count)] or [""]
                changes.setdefault(link.target, []).extend(
                    (left + place, right + place) for place in places
                )
        for number, pairs in changes.items():
            queue = space.queues.get(number)
            if queue is not None and queue.look:
                changed = " || ".join(f"{left} != {right}" for left, right in pairs)
                found += queue.insert_sampling(changed, flat=space.flat)
            found += [f"{left} = {right}" for left, right in pairs]
        return found


def _some(cases: list[str]) -> str:
    """Return a disjunction, as one part of a conjunction."""
    if len(cases) == 1:
        return cases[0]
    return f"({' || '.join(f'({case})' if ' && ' in case else case for case in cases)})"


def _still(paths_by_history: Ways) -> tuple[Test, ...] | None:
    """Return the condition without an enabled eventless transition; None: one is always enabled."""
    still = [path for path in next(iter(paths_by_history.values())) if not path.happened]
    return tuple(e for e in still[0].entries if isinstance(e, Test)) if still else None


def _reads_payload(paths_by_history: Ways) -> bool:
    """Whether a part of the current event is read."""
    prefix = scratch(AT_HAND, "")
    return any(
        name.startswith(prefix)
        for paths in paths_by_history.values()
        for path in paths
        for name in names_in(path.entries)
    )


def piece(entries: tuple[Entry, ...], at: int) -> tuple[tuple[Entry, ...], tuple[Entry, ...]]:
    """Return the next tests of a path, and the actions after them."""
    end = at
    while end < len(entries) and isinstance(entries[end], Test | ResultChoice):
        end += 1
    stop = end
    while stop < len(entries) and not isinstance(entries[stop], Test | ResultChoice):
        stop += 1
    return entries[at:end], entries[end:stop]


def names_in(entries: Iterable[Entry]) -> set[str]:
    """Return the variables in entries."""
    return {n.name for n in nodes(tuple(entries)) if isinstance(n, lang.Variable)}


def _path(location: lang.Expr) -> str:
    match location:
        case lang.Member(record, name):
            return f"{_path(record)}.{name}"
        case lang.Element(array):
            return array.name
        case lang.Variable(name):
            return name
        case _:
            raise unsupported("this value cannot be copied", location.span, "store its parts")


def _variable(expr: lang.Expr) -> lang.Variable:
    while isinstance(expr, lang.Member):
        expr = expr.record
    if not isinstance(expr, lang.Variable):
        raise unsupported("this value cannot be copied", expr.span, "store its parts")
    return expr
