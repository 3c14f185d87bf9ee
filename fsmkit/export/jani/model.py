"""A network of automata as a jani-model (https://jani-spec.org).

Each step of the explorer is a step of one edge, with an action that names it and no other automaton
takes part in; so Storm has the same states. Steps that do the same share an edge, see `edges`.
Components of local states, and queues, are global variables, which guards of others and properties
read and which a step changes in several machines at once, in the order of the ``index`` of its
assignments. Each edge has one destination. The type is ``mdp``, of which a labelled transition
system is the case without chance: Storm reads that, and no ``lts``.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from fsmkit.diagnostics import Findings
from fsmkit.export.changes import Joint, by_themselves, changes
from fsmkit.export.jani.edges import edges_of
from fsmkit.export.jani.identifiers import UNFORESEEN, Spelling
from fsmkit.export.jani.properties import properties_of
from fsmkit.export.jani.terms import (
    Json,
    binary,
    bounded,
    call,
    choice,
    conjunction,
    differ,
    disjunction,
    equal,
    negated,
    total,
)
from fsmkit.export.network import Automaton, Move, Network, Sent, is_idle
from fsmkit.texts import notating, telling
from fsmkit.verify.statespace.actions import Action
from fsmkit.verify.statespace.closed_system import MAX_PENDING_BEFORE_INPUT

MONITORS_WAIT, PLANT_WAITS, CALM, FEW_WAIT = "monitors_wait", "plant_waits", "calm", "few_wait"
"""Functions that say who may move: monitors see everything first, then the environment answers."""
TICK = "tick"
PLACE = "here"
"""The only location of each automaton."""


@notating
def model_of(network: Network, findings: Findings | None = None) -> Json:
    """Return the model; ``findings`` report the properties that are left out."""
    return _Writer(network).model(findings)


class _Writer:
    """Writes the parts in their order."""

    def __init__(self, network: Network) -> None:
        self._network = network
        self._spelling = Spelling(network)
        self._automata = network.automata

    def model(self, findings: Findings | None) -> Json:
        network = self._network
        elements = [
            *self._spelling.machines,
            *([self._spelling.clock] if network.closed.unit else []),
        ]
        actions: dict[str, int] = {}
        automata: list[Json] = []
        for machine, automaton in enumerate(self._automata):
            actions |= {self._action(machine, move): machine for move in automaton.moves}
            joint = edges_of(automaton, self._spelling.parts.codes[machine])
            edges = [self._edge(machine, automaton, moves) for moves in joint]
            automata.append(_automaton(self._spelling.machines[machine], edges, automaton.name))
        if network.closed.unit:
            actions[TICK] = len(self._automata)
            note = f"{network.closed.unit} ticks of time pass"
            automata.append(_automaton(self._spelling.clock, [self._tick()], note))
        properties, remarks = properties_of(network, self._spelling, findings)
        return {
            "jani-version": 1,
            "name": network.name,
            "metadata": {"description": "\n".join([*self._remarks(), *remarks])},
            "type": "mdp",
            "features": ["derived-operators", "functions"],
            "actions": [{"name": action} for action in actions],
            "constants": list(self._constants()),
            "variables": list(self._variables()),
            **self._initial(),
            "functions": list(self._rules()),
            "properties": properties,
            "automata": automata,
            "system": {
                "elements": [{"automaton": element} for element in elements],
                "syncs": [
                    {
                        "synchronise": [
                            action if n == machine else None for n in range(len(elements))
                        ],
                        "result": action,
                    }
                    for action, machine in actions.items()
                ],
            },
        }

    def _remarks(self) -> Iterator[str]:
        network = self._network
        yield (
            f"Written by fsmkit; {network.states:,} states and {network.transitions:,} steps. "
            "Local states that the explorer never saw are not here; "
            f"`{UNFORESEEN}` becomes true where one would be needed."
        )
        if network.closed.untimed:
            yield "Untimed: an armed timer fires at any time."
        for sample in network.closed.samples:
            yield f"Only some values are tried of {sample}."

    # --- declarations ----------------------------------------------------------------------------

    def _constants(self) -> Iterator[Json]:
        for machine, automaton in enumerate(self._automata):
            for part, component in enumerate(self._spelling.parts.components[machine]):
                for number in () if component.plain else component.texts:
                    note = component.note(number)
                    name = self._spelling.constant(machine, part, number)
                    yield _constant(name, number, {"comment": note} if note else {})
            for number, arrival in enumerate(automaton.arrivals if automaton.queue else ()):
                if arrival.is_event:
                    name = self._spelling.message(machine, number)
                    yield _constant(name, number + 1, {"comment": arrival.text})

    def _variables(self) -> Iterator[Json]:
        starts = [dict(zip(self._names(), self._values(n), strict=True)) for n in self._starts()]
        for machine, automaton in enumerate(self._automata):
            components = enumerate(self._spelling.parts.components[machine])
            bounds = {self._spelling.component(machine, n): max(c.texts) for n, c in components}
            bounds |= dict.fromkeys(self._spelling.slots(machine), len(automaton.arrivals))
            for name, bound in bounds.items():
                yield {"name": name, "type": bounded(bound), **_first(name, starts)}
        yield {"name": UNFORESEEN, "type": "bool", **_first(UNFORESEEN, starts)}

    def _starts(self) -> range:
        return range(len(self._network.initial))

    def _names(self) -> Iterator[str]:
        for machine in range(len(self._automata)):
            for component in range(len(self._spelling.parts.components[machine])):
                yield self._spelling.component(machine, component)
            yield from self._spelling.slots(machine)
        yield UNFORESEEN

    def _values(self, start: int) -> Iterator[Json]:
        for machine, place in enumerate(self._network.initial[start]):
            code = enumerate(self._spelling.parts.codes[machine][place.local])
            yield from (self._spelling.value(machine, n, number) for n, number in code)
            waiting = [self._spelling.message(machine, message) for message in place.queue]
            yield from waiting
            yield from (0 for _ in self._spelling.slots(machine)[len(waiting) :])
        yield False

    def _initial(self) -> dict[str, Json]:
        """Return the condition of initial states, if there are several."""
        if len(self._network.initial) == 1:
            return {}
        found = []
        for start in self._starts():
            pairs = zip(self._names(), self._values(start), strict=True)
            tests = (negated(n) if value is False else equal(n, value) for n, value in pairs)
            found.append(conjunction(tests))
        return {"restrict-initial": {"exp": disjunction(found)}}

    # --- functions -------------------------------------------------------------------------------

    def _rules(self) -> Iterator[Json]:
        """Yield who may move, and how many events wait."""
        network = self._network
        for name, machines in ((MONITORS_WAIT, network.monitors), (PLANT_WAITS, network.plant)):
            yield _function(name, "bool", disjunction(map(self._spelling.waits, machines)))
        waits = call(MONITORS_WAIT), call(PLANT_WAITS)
        yield _function(CALM, "bool", conjunction(map(negated, waits)))
        yield _function(
            FEW_WAIT, "bool", binary("≤", total(self._waiting()), MAX_PENDING_BEFORE_INPUT)
        )

    def _waiting(self) -> Iterator[Json]:
        """Yield numbers of waiting events; beyond `MAX_PENDING_BEFORE_INPUT` not always exact."""
        for machine, automaton in enumerate(self._automata):
            for slot in self._spelling.slots(machine)[: MAX_PENDING_BEFORE_INPUT + 1]:
                yield choice(differ(slot, 0), 1, 0)
            for waiting, of in automaton.waiting():
                yield choice(self._spelling.is_in(machine, of), waiting, 0)

    # --- steps -----------------------------------------------------------------------------------

    @telling
    def _action(self, machine: int, move: Move) -> str:
        return f"{self._automata[machine].name}: {move.label}"

    def _edge(self, machine: int, automaton: Automaton, joint: Joint) -> Json:
        spelling, move = self._spelling, joint.moves[0]
        slots = spelling.slots(machine)
        guard = [spelling.is_in(machine, joint.sources)]
        steps = [spelling.becomes(machine, joint.change)]
        if move.taken is not None:
            guard.append(equal(slots[0], spelling.message(machine, move.taken)))
            steps[0] |= dict(zip(slots, (*slots[1:], 0), strict=True))
        elif move.needs_empty and slots:
            guard.append(equal(slots[0], 0))
        guard.append(self._turn(machine, automaton, move))
        if move.from_outside:
            guard.append(call(FEW_WAIT))
        steps += (told for told in map(self._tell, move.sent) if told)
        if automaton.stops(move):
            steps.append(dict.fromkeys(slots, 0))
        return _edge(self._action(machine, move), conjunction(guard), steps)

    def _turn(self, machine: int, automaton: Automaton, move: Move) -> Json:
        """Return whether the machine may move (see `_rules`)."""
        takes = move.action is Action.TAKE
        waits = self._spelling.waits(machine)
        if automaton.is_monitor and waits is not False:
            return True if takes else disjunction((call(CALM), waits))
        if automaton.is_environment and waits is not False:
            answers = negated(call(MONITORS_WAIT))
            if takes:
                return answers
            if move.action is Action.EVENTLESS:
                return disjunction((call(CALM), conjunction((answers, waits))))
        return call(CALM)

    def _tell(self, sent: Sent) -> dict[str, Json]:
        """Return what a message changes."""
        machine, automaton, spelling = sent.target, self._automata[sent.target], self._spelling
        if automaton.queues(sent.message):
            return self._post(machine, automaton, spelling.message(machine, sent.message))
        maps = {n: after for n, (after, _) in automaton.received(sent.message).items()}
        return self._becomes(machine, maps) | _unforeseen(negated(spelling.is_in(machine, maps)))

    def _becomes(self, machine: int, maps: Mapping[int, int]) -> dict[str, Json]:
        """Return what each component is after something that happens to each local state."""
        spelling, steps = self._spelling, list(maps.items())
        codes = spelling.parts.codes[machine]
        alone = by_themselves(codes, steps)
        found: dict[str, Json] = {}
        for component, shifts in alone.items():
            name = spelling.component(machine, component)
            found[name] = name
            for shift, numbers in shifts.items():
                there = spelling.has(machine, component, numbers)
                found[name] = choice(there, binary("+", name, shift), found[name])
        for change, places in changes(codes, steps, but=alone):
            before = spelling.is_in(machine, {steps[place][0] for place in places})
            for name, after in spelling.becomes(machine, change).items():
                found[name] = choice(before, after, found.get(name, name))
        return found

    def _post(self, machine: int, automaton: Automaton, message: str) -> dict[str, Json]:
        """Return what an event changes that goes to a queue: the first slot that is empty."""
        stopped = automaton.where(lambda local: not local.running)
        runs = negated(self._spelling.is_in(machine, stopped))
        slots = self._spelling.slots(machine)
        found: dict[str, Json] = {}
        for number, slot in enumerate(slots):
            ahead = [differ(slots[number - 1], 0)] if number else []
            room = conjunction((equal(slot, 0), *ahead, runs))
            found[slot] = choice(room, message, slot)
        too_long = len(slots) < automaton.queue
        return found | _unforeseen(conjunction((differ(slots[-1], 0), runs)) if too_long else False)

    def _tick(self) -> Json:
        """Time passes where nothing is left to do and a timer is armed."""
        spelling = self._spelling
        armed: list[Json] = []
        guard: list[Json] = []
        step: dict[str, Json] = {}
        unknown: list[Json] = []
        for machine, automaton in enumerate(self._automata):
            awaited = automaton.where(lambda local: local.awaited)
            idle = automaton.where(lambda local: not local.has_work)
            armed.append(spelling.is_in(machine, awaited))
            guard += [equal(slot, 0) for slot in spelling.slots(machine)[:1]]
            guard.append(spelling.is_in(machine, idle))
            if not is_idle(automaton.elapsed):
                step |= self._becomes(machine, automaton.elapsed)
                unknown.append(negated(spelling.is_in(machine, automaton.elapsed)))
        step |= _unforeseen(disjunction(unknown))
        return _edge(TICK, conjunction((disjunction(armed), *guard)), [step])


def _unforeseen(condition: Json) -> dict[str, Json]:
    if condition is False:
        return {}
    return {UNFORESEEN: disjunction((UNFORESEEN, condition))}


def _first(name: str, starts: list[dict[str, Json]]) -> dict[str, Json]:
    """Return the initial value, if it is the only one."""
    return {"initial-value": starts[0][name]} if len(starts) == 1 else {}


def _constant(name: str, value: int, note: Mapping[str, Json]) -> Json:
    return {"name": name, "type": "int", "value": value, **note}


def _function(
    name: str, type_: str, body: Json, parameters: list[Json] | None = None
) -> dict[str, Json]:
    return {"name": name, "type": type_, "parameters": parameters or [], "body": body}


def _automaton(name: str, edges: list[Json], note: str) -> Json:
    return {
        "name": name,
        "comment": note,
        "locations": [{"name": PLACE}],
        "initial-locations": [PLACE],
        "edges": edges,
    }


def _edge(action: str, guard: Json, steps: list[dict[str, Json]]) -> Json:
    """Return an edge whose steps follow one another; assignments of one happen at once."""
    assignments: list[Json] = [
        {"ref": name, "value": value, **({"index": index} if index else {})}
        for index, step in enumerate(steps)
        for name, value in step.items()
    ]
    destination: Json = {"location": PLACE, "assignments": assignments}
    return {
        "location": PLACE,
        "action": action,
        "guard": {"exp": guard},
        "destinations": [destination],
    }
