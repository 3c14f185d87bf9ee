"""The template of a machine: a location for each stable configuration, committed ones between.

A macrostep is a chain of edges through committed locations, so that nothing interleaves with it.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field, replace

from fsmkit.chart.walk import nodes
from fsmkit.export.uppaal.automaton import Cause, Trigger, Ways
from fsmkit.export.uppaal.edges import Beginning, Steps, names_in
from fsmkit.export.uppaal.entries import AT_HAND, Armed, History, Key, Path, Picked, Test, scratch
from fsmkit.export.uppaal.names import spelled
from fsmkit.export.uppaal.network import Location, Template
from fsmkit.export.uppaal.terms import refuse
from fsmkit.language import BoolType, Fragment, Type, Value, Variable

MOST_CLOCK = 2**30 - 2
"""The longest time that UPPAAL compares a clock with."""
STOPPED = "#d98880"
"""The color of locations of machines that have come to an end or a fault."""


@dataclass(slots=True)
class Builder(Steps):
    """Makes the template of one machine."""

    owed: dict[Key, list[tuple[tuple[str, ...], tuple[Test, ...]]]] = field(default_factory=dict)
    """For each location when something owed can happen there: histories, and tests."""
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
            (*self.passed[:1], *self.locations.values(), *self.passed[1:])
            if self.boot
            else (*self.locations.values(), *self.passed),
            initial,
            tuple(self.edges),
        )

    # --- locations -------------------------------------------------------------------------------

    def _name_locations(self) -> None:
        chart = self.automaton.paths.chart
        names = self.data.names
        for number, key in enumerate(self.automaton.keys):
            active = [chart.states[s] for s in sorted(key.configuration)]
            wanted = "_".join(spelled(s.id) for s in active if s.is_leaf) or "stopped"
            if key.fault:
                wanted += f"_{spelled(key.fault)}_fault"
            invariant = () if self.space.closed.untimed else self._invariant(key)
            color = "" if key.running else STOPPED
            name = names.take(wanted)
            self.locations[key] = Location(f"id{number}", name, invariant, color=color)

    def _invariant(self, key: Key) -> tuple[str, ...]:
        found = {}
        for timer in key.timers:
            self._require_short(timer)
            if timer.greatest is not None:
                found[self.data.clock(timer)] = f"{self.data.clock(timer)} <= {timer.greatest}"
        return tuple(found.values())

    def _require_short(self, timer: Armed) -> None:
        if max(timer.least, timer.greatest or 0) > MOST_CLOCK:
            raise refuse(
                f"a delay of {timer.greatest} ticks is longer than clocks of UPPAAL count",
                self.automaton.paths.chart.root.span,
                "let a tick be longer: `capacity: {tick: 1ms}`",
            )

    # --- the start -------------------------------------------------------------------------------

    def _start(self) -> str:
        if self.boot is None:
            (path,) = self.automaton.start
            return self.locations[path.target].id
        number = len(self.automaton.keys) + len(self.passed)
        name = self.data.names.take("starting")
        first = Location(f"id{number}", name, committed=True)
        self.passed.append(first)
        place, count = self.boot
        guard = (f"{self.space.boot} == {place}",) if count > 1 else ()
        beginning = Beginning(guard, starts=True, given=self._free_inputs())
        source = Key(frozenset(), running=False)
        self.grow(list(self.automaton.start), 0, first.id, beginning, source, source)
        return first.id

    def _free_inputs(self) -> tuple[tuple[str, Fragment, tuple[str, int, int] | None], ...]:
        closed = self.space.closed
        if not closed.is_open:
            return ()
        chart = closed.charts[self.machine]
        inputs = ((chart.inputs[free.input], free.values) for free in closed.free_inputs)
        return tuple(self._selected(i.name, i.name, i.type, values) for i, values in inputs)

    def _selected(
        self, path: str, word: str, type_: Type, values: tuple[Value, ...]
    ) -> tuple[str, Fragment, tuple[str, int, int] | None]:
        """Return what stands for something that may have any of some values."""
        if any(isinstance(v, tuple | float) for v in values):
            raise refuse(
                f"`{word}` comes from outside as `{type_}`",
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
        if isinstance(type_, BoolType):
            fragment = Fragment(f"{text} == 1", 7)
            if select is None:
                fragment = Fragment("true" if numbers[0] else "false")
            return path, fragment, select
        return path, Fragment(text), select

    # --- reactions -------------------------------------------------------------------------------

    def _reactions(self, key: Key) -> None:
        reactions = self.automaton.reactions.get(key, {})
        quiet: list[str] = []
        for trigger, ways in reactions.items():
            if trigger.cause is Cause.EVENTLESS and not self.space.closed.is_open:
                self.still[key] = _still(ways)
                quiet = self._quiet(self.still[key])
        merged: dict[object, list[tuple[Trigger, Ways]]] = {}
        for trigger, ways in reactions.items():
            same: object = trigger
            if trigger.cause in (Cause.TAKE, Cause.OUTSIDE) and not _reads_payload(ways):
                same = trigger.cause, trigger.owed, frozenset(ways.items())
            merged.setdefault(same, []).append((trigger, ways))
        for alike in merged.values():
            self._reaction(key, [trigger for trigger, _ in alike], alike[0][1], quiet)

    def rests(self) -> dict[str, tuple[str, ...]]:
        """Return for locations, by id, when no eventless transition is enabled there."""
        return {
            self.locations[key].id: tuple(self._quiet(still)) for key, still in self.still.items()
        }

    def _quiet(self, still: tuple[Test, ...] | None) -> list[str]:
        """Return when no eventless transition is enabled."""
        return ["false"] if still is None else [self.condition(test) for test in still]

    def _reaction(self, key: Key, triggers: list[Trigger], ways: Ways, quiet: list[str]) -> None:
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
                head = heads[0] if len(heads) == 1 else f"({' || '.join(heads)})"
                if len(heads) > 1 and len(heads) == len(own.numbers):
                    head = f"{own.length} > 0"
                first: list[str] = []
                if not machine.is_monitor:
                    first = space.nobody_answers(environment=not machine.environment)
                given = self._front(trigger.event)
                guard = [head, *first, *quiet]
                beginnings = [Beginning(tuple(guard), space.urgently, pops=True, given=given)]
            case Cause.FIRE:
                guard = [*self._due(key, trigger.place), *empty, *space.nobody_answers(), *quiet]
                beginnings = [Beginning(tuple(dict.fromkeys(guard)))]
            case Cause.SPONTANEOUS:
                guard = [*empty, *space.nobody_answers(), *quiet]
                word = "sometimes"
                beginnings = [Beginning(tuple(dict.fromkeys(guard)), comment=word)]
            case _:
                beginnings = self._from_outside(triggers)
        inputs = self._free_inputs()
        for beginning in beginnings:
            begun = replace(beginning, given=(*beginning.given, *inputs))
            for remembered, paths in self._by_history(ways):
                wanted = self._wanted(trigger, key, paths)
                if trigger.owed:
                    self._note_owed(key, trigger, paths, remembered)
                begun_here = replace(begun, guard=(*begun.guard, *remembered))
                self.grow(wanted, 0, self.locations[key].id, begun_here, key, key)

    def _wanted(self, trigger: Trigger, key: Key, paths: Iterable[Path]) -> list[Path]:
        if trigger.cause is Cause.EVENTLESS:
            return [path for path in paths if path.happened]
        if trigger.cause is Cause.OUTSIDE:
            return [path for path in paths if not path.is_idle(key)]
        return list(paths)

    def _note_owed(
        self, key: Key, trigger: Trigger, paths: Iterable[Path], remembered: list[str]
    ) -> None:
        """Note when something owed can happen in a location that is stable for ever."""
        found = self.owed.setdefault(key, [])
        for path in paths:
            if trigger.cause is not Cause.SPONTANEOUS and path.is_idle(key):
                continue
            tests: list[Test] = []
            for entry in path.entries:
                if not isinstance(entry, Test | Picked):
                    break
                if isinstance(entry, Test):
                    if any(isinstance(n, Variable) and n.name[0] == "@" for n in nodes(entry)):
                        self.owes_by_payload = True
                        continue
                    tests.append(entry)
            found.append((tuple(remembered), tuple(tests)))

    def _may_move(self, environment: bool, monitor: bool) -> list[str]:
        """Return when a machine may move without an event."""
        own = self.space.queues.get(self.machine)
        everybody = self.space.nobody_answers()
        if not environment or own is None:
            return everybody
        rests = " && ".join(everybody)
        busy = f"{own.length} > 0"
        if monitor:
            return [f"({busy} || {rests})" if " && " not in rests else f"({busy} || ({rests}))"]
        watched = self.space.nobody_answers(environment=False)
        return [f"({busy} || ({rests}))", *watched]

    def _due(self, key: Key, place: int) -> list[str]:
        """Return when a timer fires: it is due, and none armed before it is."""
        if self.space.closed.untimed:
            return []
        fired = key.timers[place]
        self._require_short(fired)
        found = [f"{self.data.clock(fired)} >= {fired.least}"]
        if not fired.is_interval:
            found += [
                f"{self.data.clock(other)} < {other.greatest}"
                for other in key.timers
                if other.greatest is not None and other.greatest > fired.least
            ]
        return found

    def _front(self, event: int) -> tuple[tuple[str, Fragment, None], ...]:
        """Return where the payload of the first event of the queue stands."""
        own = self.space.queues[self.machine]
        found = []
        for place, part in enumerate(self.automaton.paths.chart.events[event].fields):
            text = f"{own.lanes[place][0]}[0]"
            is_bool = isinstance(part.type, BoolType)
            fragment = Fragment(f"{text} == 1", 7) if is_bool else Fragment(text)
            found.append((scratch(AT_HAND, part.name), fragment, None))
        return tuple(found)

    def _from_outside(self, triggers: list[Trigger]) -> list[Beginning]:
        guard = tuple(dict.fromkeys([*self.space.nobody_answers(), *self.space.is_patient()]))
        chart = self.automaton.paths.chart
        names = ", ".join(chart.events[t.event].name for t in triggers)
        trigger = triggers[0]
        fields = chart.events[trigger.event].fields
        if len(triggers) > 1 or not fields:
            return [Beginning(guard, comment=names)]
        columns = [tuple(dict.fromkeys(column)) for column in zip(*trigger.payloads, strict=True)]
        size = 1
        for column in columns:
            size *= len(column)
        groups: list[list[tuple[Value, ...]]] = [columns]
        if size != len(trigger.payloads):
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

    def _by_history(self, ways: Ways) -> Iterator[tuple[list[str], tuple[Path, ...]]]:
        """Yield the different ways of a reaction, each with what histories it is for."""
        groups: dict[frozenset[Path], list[History]] = {}
        order: dict[frozenset[Path], tuple[Path, ...]] = {}
        for history, paths in ways.items():
            groups.setdefault(frozenset(paths), []).append(history)
            order.setdefault(frozenset(paths), paths)
        if len(groups) == 1:
            yield [], next(iter(order.values()))
            return
        states = sorted({state for history in ways for state, _ in history})
        telling = next(
            (
                [state]
                for state in states
                if _tells([{dict(h).get(state) for h in group} for group in groups.values()])
            ),
            states,
        )
        for same, histories in groups.items():
            seen = {tuple(dict(h).get(state) for state in telling): None for h in histories}
            cases = [
                " && ".join(
                    f"{self.data.histories[state]} == {self.data.history_text(state, value)}"
                    for state, value in zip(telling, values, strict=True)
                )
                for values in seen
            ]
            text = cases[0] if len(cases) == 1 else f"({' || '.join(cases)})"
            if " && " in text and len(cases) > 1:
                text = f"({' || '.join(f'({case})' for case in cases)})"
            yield [text], order[same]


def _tells(groups: list[set[frozenset[int] | None]]) -> bool:
    """Whether no value is in two groups."""
    return sum(map(len, groups)) == len(set().union(*groups))


def _still(ways: Ways) -> tuple[Test, ...] | None:
    """Return when no eventless transition is enabled; None: one always is."""
    still = [path for path in next(iter(ways.values())) if not path.happened]
    return tuple(e for e in still[0].entries if isinstance(e, Test)) if still else None


def _reads_payload(ways: Ways) -> bool:
    """Whether a part of the event at hand is asked for anywhere."""
    prefix = scratch(AT_HAND, "")
    return any(
        name.startswith(prefix)
        for paths in ways.values()
        for path in paths
        for name in names_in(path.entries)
    )
