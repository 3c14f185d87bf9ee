"""The edges of a template: macrosteps as chains through committed locations.

Each edge tests, then updates; tests that follow updates stand on an edge of their own.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass, field, replace

from fsmkit.chart.walk import nodes
from fsmkit.export.uppaal.automaton import Automaton
from fsmkit.export.uppaal.data import Data
from fsmkit.export.uppaal.entries import (
    AT_HAND,
    FIRST_SLOT,
    Assigned,
    Entry,
    Key,
    Path,
    Picked,
    Posted,
    Test,
    Told,
    scratch,
)
from fsmkit.export.uppaal.network import Edge, Location
from fsmkit.export.uppaal.space import Space, leaves
from fsmkit.export.uppaal.terms import refuse
from fsmkit.language import ArrayType, Element, Expr, Fragment, Literal, Member, Type, Variable
from fsmkit.system.system import EventLink


@dataclass(frozen=True, slots=True)
class Beginning:
    """How the first edge of a step begins."""

    guard: tuple[str, ...] = ()
    sync: str = ""
    comment: str = ""
    pops: bool = False
    starts: bool = False
    given: tuple[tuple[str, Fragment, tuple[str, int, int] | None], ...] = ()
    """What stands for a path before anything is stored, and the selection that gives it."""


@dataclass(slots=True)
class Steps:
    """Writes the edges of one template."""

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

    def _pass(self) -> Location:
        number = len(self.automaton.keys) + len(self.passed)
        found = Location(f"id{number}", committed=True)
        self.passed.append(found)
        return found

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
        key: Key,
        start: Key,
    ) -> None:
        """Add the edges of paths that are the same up to an entry."""
        if beginning is not None and "false" in beginning.guard:
            return
        groups: dict[tuple[tuple[Entry, ...], tuple[Entry, ...]], list[Path]] = {}
        for path in paths:
            tests, deeds = piece(path.entries, at)
            groups.setdefault((tests, deeds), []).append(path)
        for (tests, deeds), alike in groups.items():
            end = at + len(tests) + len(deeds)
            ended = list(dict.fromkeys(p for p in alike if len(p.entries) == end))
            going = [p for p in alike if len(p.entries) > end]
            if going:
                through = self._pass()
                self.takes_steps = True
                later = [entry for path in going for entry in path.entries[end:]]
                edge = self._edge(source, beginning, tests, deeds, later)
                before = (
                    [f"{self.space.stable} = false"] if beginning and not beginning.starts else []
                )
                update = (*before, *edge.update)
                self.edges.append(replace(edge, target=through.id, update=update))
                self.grow(going, end, through.id, None, key, start)
            for path in ended:
                edge = self._edge(source, beginning, tests, deeds, [])
                closing = self._closing(path, start)
                if beginning is None:
                    closing.append(f"{self.space.stable} = true")
                if start.configuration == frozenset():
                    closing = [u for u in closing if not u.startswith(f"{self.space.stable} =")]
                    closing += self._booted()
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
        deeds: tuple[Entry, ...],
        later: list[Entry],
    ) -> Edge:
        """Return an edge without a target: what it tests and does."""
        begun = beginning or Beginning()
        posts = any(self._is_own(deed) for deed in deeds) and begun.pops
        self.data.given = {path: text for path, text, _ in begun.given}
        guard = [*begun.guard, *(self.condition(t) for t in tests if isinstance(t, Test))]
        picked = [f"{t.operation}() = {t.value}" for t in tests if isinstance(t, Picked)]
        needed = names_in((*later, *(deeds if posts else ())))
        keeps_inputs = self.space.closed.keeps_inputs
        update = []
        for path, text, _ in begun.given:
            is_input = not path.startswith("@")
            if path in needed or (is_input and keeps_inputs):
                update.append(f"{self._kept(path)} = {text.at_least(2)}")
        if posts:
            update += self.space.queues[self.machine].pop(flat=self.space.flat)
            self.data.given = {p: t for p, t in self.data.given.items() if not p.startswith("@")}
        for deed in deeds:
            update += self._deed(deed)
        if begun.pops and not posts:
            update += self.space.queues[self.machine].pop(flat=self.space.flat)
        used = " ".join([*guard, *update])
        select = tuple(s for _, _, s in begun.given if s is not None and _mentions(used, s[0]))
        self.data.given = {}
        comment = ", ".join([*([begun.comment] if begun.comment else []), *picked])
        return Edge(
            source, "", select, tuple(dict.fromkeys(guard)), begun.sync, tuple(update), comment
        )

    def _kept(self, path: str) -> str:
        chart = self.automaton.paths.chart
        if not path.startswith("@"):
            return self.data.variables[path]
        for event in chart.events:
            for part in event.fields:
                if scratch(AT_HAND, part.name) == path and self._fits(path, part.type):
                    return self.data.kept(path, part.type)
        raise AssertionError(path)

    def _fits(self, path: str, type_: Type) -> bool:
        """Demand that parts of one name have one type, so that one variable keeps them."""
        chart = self.automaton.paths.chart
        types = {
            part.type
            for event in chart.events
            for part in event.fields
            if scratch(AT_HAND, part.name) == path
        }
        if len(types) > 1:
            raise refuse(
                f"`{path.partition('.')[2]}` is `{type_}` in one event and another type in another",
                chart.root.span,
                "give both the same type, or another name",
            )
        return True

    def _is_own(self, entry: Entry) -> bool:
        """Whether something goes to the own queue."""
        if isinstance(entry, Posted):
            return True
        return isinstance(entry, Told) and any(
            link.target == self.machine for link in self._links(entry.port)
        )

    def _links(self, port: int) -> list[EventLink]:
        wire = self.automaton.paths.wire(port) if port < (1 << 16) else port
        return [
            link
            for link in self.space.closed.system.event_links
            if link.source == self.machine and link.port == wire
        ]

    def _deed(self, deed: Entry) -> list[str]:
        data, space = self.data, self.space
        match deed:
            case Assigned(location, value):
                return self._stored(location, value)
            case Posted(event, values):
                texts = [data.number(value) for value in values]
                return space.queues[self.machine].push(event, texts, flat=space.flat)
            case Told(port, values):
                found = []
                for link in self._links(port):
                    queue = space.queues[link.target]
                    texts = [data.number(values[n]) for n in link.arguments]
                    found += queue.push(link.event, texts, flat=space.flat)
                return found
            case _:
                return []

    def _stored(self, location: Expr, value: Expr) -> list[str]:
        """Return the updates that store a value, one for each part of a record or an array."""
        printer = self.data.printer
        if isinstance(location, Element) or not isinstance(location, Variable | Member):
            return [f"{printer.print(location)} = {printer.print(value)}"]
        assert location.type is not None  # noqa: S101  (a value)
        path = _path(location)
        found = []
        base = value.value if isinstance(value, Literal) else None
        for name, type_, constant in leaves(path, location.type, base):
            text = self.data.kept(name, type_) if name[0] == "@" else self.data.name(name)
            other: Expr = value
            if constant is not None and isinstance(value, Literal):
                other = Literal(constant, type_, value.span)
            elif name != path:
                source = _path(value) + name[len(path) :]
                other = replace(_variable(value), name=source, type=type_)
            if not isinstance(type_, ArrayType):
                found.append(f"{text} = {printer.print(other)}")
                continue
            for place in range(type_.length):
                if isinstance(other, Literal) and isinstance(other.value, tuple):
                    item = printer.print(Literal(other.value[place], type_.element, value.span))
                else:
                    item = f"{self.data.name(_path(other))}[{place}]"
                found.append(f"{text}[{place}] = {item}")
        return found

    # --- the end of a step -----------------------------------------------------------------------

    def _closing(self, path: Path, start: Key) -> list[str]:
        """Return the last updates of a step: what it leaves to others, and what is forgotten."""
        self._require_order(path)
        data, found = self.data, []
        stored = {_path(e.location) for e in path.entries if isinstance(e, Assigned)}
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
        """Refuse what would come to the own queue in another order."""
        wired = False
        for entry in path.entries:
            if isinstance(entry, Told):
                wired = wired or self._is_own(entry)
            elif isinstance(entry, Posted) and wired:
                chart = self.automaton.paths.chart
                raise refuse(
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
        """Return the updates that forget the events at hand, and inputs that are not state."""
        data = self.data
        used = names_in(path.entries)
        tests, deeds = piece(path.entries, 0)
        kept = names_in(path.entries[len(tests) + len(deeds) :])
        if any(self._is_own(deed) for deed in deeds):
            kept |= names_in(deeds)
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
        if self.space.closed.is_open and not self.space.closed.keeps_inputs:
            inputs = self.automaton.paths.chart.inputs
            free = (inputs[one.input].name for one in self.space.closed.free_inputs)
            found += [data.initial(name) for name in free if name in kept]
        return found

    def _copied(self, stored: set[str]) -> list[str]:
        """Return the updates that bring outputs to the inputs they are wired to."""
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
                count = part.length if isinstance(part, ArrayType) else 0
                places = [f"[{n}]" for n in range(count)] or [""]
                changes.setdefault(link.target, []).extend(
                    (left + place, right + place) for place in places
                )
        for number, pairs in changes.items():
            queue = space.queues.get(number)
            if queue is not None and queue.look:
                changed = " || ".join(f"{left} != {right}" for left, right in pairs)
                found += queue.let_look(changed, flat=space.flat)
            found += [f"{left} = {right}" for left, right in pairs]
        return found


def piece(entries: tuple[Entry, ...], at: int) -> tuple[tuple[Entry, ...], tuple[Entry, ...]]:
    """Return the next tests of a path, and what it does then."""
    end = at
    while end < len(entries) and isinstance(entries[end], Test | Picked):
        end += 1
    stop = end
    while stop < len(entries) and not isinstance(entries[stop], Test | Picked):
        stop += 1
    return entries[at:end], entries[end:stop]


def names_in(entries: Iterable[Entry]) -> set[str]:
    """Return the variables that entries name."""
    return {n.name for n in nodes(tuple(entries)) if isinstance(n, Variable)}


def _mentions(text: str, name: str) -> bool:
    return re.search(rf"\b{name}\b", text) is not None


def _path(location: Expr) -> str:
    match location:
        case Member(record, name):
            return f"{_path(record)}.{name}"
        case Element(array):
            return array.name
        case Variable(name):
            return name
        case _:
            raise refuse("this value cannot be copied", location.span, "store its parts")


def _variable(expr: Expr) -> Variable:
    while isinstance(expr, Member):
        expr = expr.record
    if not isinstance(expr, Variable):
        raise refuse("this value cannot be copied", expr.span, "store its parts")
    return expr
