"""Write a network of automata as a jani-model (https://jani-spec.org).

Each step of the explorer is a step of one edge, with an action of its own that no other automaton
takes part in; so Storm has the same states. Steps with the same effect share an edge
(`joint_moves`). Components of local states, and queues, are global variables: guards of others and
properties read them, and a step changes them in several machines at once, in the order of the
``index`` of its assignments. Each edge has one destination. The type is ``mdp``, whose case without
chance is a labelled transition system: Storm reads that, and no ``lts``. So reachability has the
greatest probability 1, else 0.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping

from fsmkit.diagnostics import Findings
from fsmkit.emit import notating, plain, telling
from fsmkit.export.changes import Joint, changes, joint_moves, shifting_components
from fsmkit.export.collect import export_network
from fsmkit.export.exporter import ExportedModel, ExportOptions
from fsmkit.export.formula import Claim, Form, claims
from fsmkit.export.network import Automaton, Move, Network, Sent, is_idle
from fsmkit.export.terms import (
    Json,
    binary,
    choice,
    conjunction,
    differ,
    disjunction,
    equal,
    negation,
)
from fsmkit.export.vocabulary import Vocabulary
from fsmkit.system.system import System
from fsmkit.verify.statespace.closed_system import MAX_PENDING_BEFORE_INPUT

TICK = "tick"
PLACE = "here"
"""The only location of each automaton."""
UNFORESEEN = "unforeseen"
"""The variable that is true once something happened which the explorer never saw."""
FORESEEN = "foreseen"
"""The property that this never happens."""
WIDTH = 100
FORMS = (Form.NEVER, Form.REACHED, Form.RECOVERABLE, Form.LEADS_TO)
DEEPEST = 8
"""So deep are lists and objects broken into lines: down to assignments, not into expressions."""


def export(system: System, options: ExportOptions) -> ExportedModel:
    """Explore a system, then write its local steps."""
    return export_network(system, options, write_model)


def write_model(network: Network, findings: Findings | None = None) -> str:
    """Return the model as readable JSON: short values are on one line."""
    return _lines(model_of(network, findings), 0, "") + "\n"


def _lines(value: Json, depth: int, prefix: str) -> str:
    indent = " " * depth
    line = indent + prefix + json.dumps(value, ensure_ascii=False)
    if len(line) <= WIDTH or depth >= DEEPEST or not isinstance(value, list | dict):
        return line
    if isinstance(value, list):
        parts, ends = [_lines(item, depth + 1, "") for item in value], "[]"
    else:
        found = ((f"{json.dumps(key)}: ", item) for key, item in value.items())
        parts, ends = [_lines(item, depth + 1, key) for key, item in found], "{}"
    return f"{indent}{prefix}{ends[0]}\n" + ",\n".join(parts) + f"\n{indent}{ends[1]}"


@notating
def model_of(network: Network, findings: Findings | None = None) -> Json:
    """Return the model; ``findings`` report the omitted properties."""
    return _Writer(network).model(findings)


class _Writer(Vocabulary):
    """Writes the parts in their order.

    The queue of a machine ``m`` is the variables ``m_queue_1`` (the head), ``m_queue_2``, 0 if
    free; one more than the explorer ever saw in use, if the queue has that capacity.
    """

    def __init__(self, network: Network) -> None:
        super().__init__(network)
        self.clock = self.names.take("clock")
        self.automata = network.automata
        counts = (min(a.queue, 1 + max(map(len, a.contents))) for a in network.automata)
        self.slots = tuple(
            tuple(f"{name}_queue_{n + 1}" for n in range(count))
            for name, count in zip(self.machines, counts, strict=True)
        )

    def component(self, machine: int, component: int) -> str:
        return f"{self.machines[machine]}_at_{self.fields[machine][component]}"

    def is_empty(self, machine: int) -> Json:
        return equal(self.slots[machine][0], 0)

    def is_first(self, machine: int, message: int) -> Json:
        return equal(self.slots[machine][0], self.message(machine, message))

    def counts(self, machine: int) -> Iterator[Json]:
        """Yield numbers of waiting events; beyond `MAX_PENDING_BEFORE_INPUT` not always exact."""
        for slot in self.slots[machine][: MAX_PENDING_BEFORE_INPUT + 1]:
            yield choice(differ(slot, 0), 1, 0)

    def model(self, findings: Findings | None) -> Json:
        network = self.network
        actions: dict[str, int] = {}
        automata: list[Json] = []
        for machine, automaton in enumerate(self.automata):
            actions |= {self._action(machine, move): machine for move in automaton.moves}
            joints = joint_moves(automaton, self.parts.codes[machine], named=True)
            edges = [self._edge(machine, automaton, joint) for joint in joints]
            automata.append(_automaton(self.machines[machine], edges, automaton.name))
        elements = [*self.machines]
        if network.closed.unit:
            elements.append(self.clock)
            actions[TICK] = len(self.automata)
            note = f"{network.closed.unit} ticks of time pass"
            automata.append(_automaton(self.clock, [self._tick()], note))
        found = list(claims(network, FORMS, findings, "formula over states"))
        return {
            "jani-version": 1,
            "name": network.name,
            "metadata": {"description": "\n".join(self._remarks(found))},
            "type": "mdp",
            "features": ["derived-operators", "functions"],
            "actions": [{"name": action} for action in actions],
            "constants": list(self._constants()),
            **self._variables(),
            "functions": [
                {"name": name, "type": "bool", "parameters": [], "body": body}
                for name, body in self.rules().items()
            ],
            "properties": list(self._properties(found)),
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

    def _remarks(self, found: list[Claim]) -> Iterator[str]:
        network = self.network
        yield (
            f"Written by fsmkit; {network.states:,} states and {network.transitions:,} steps. "
            "Local states that the explorer never saw are not here; "
            f"`{UNFORESEEN}` becomes true where one would be needed."
        )
        if network.closed.untimed:
            yield "Untimed: an armed timer fires at any time."
        for sample in network.closed.samples:
            yield f"Only some values are tried of {sample}."
        for claim in (claim for claim in found if claim.missing):
            name, text = plain(claim.property.name), plain(claim.property.text)
            yield f"Property `{name}` ({text}) is not carried over: {plain(claim.missing)}."

    # --- declarations ----------------------------------------------------------------------------

    def _constants(self) -> Iterator[Json]:
        for machine, automaton in enumerate(self.automata):
            for name, number, note in self.constants(machine):
                comment: dict[str, Json] = {"comment": note} if note else {}
                yield {"name": name, "type": "int", "value": number, **comment}
            for number, arrival in enumerate(automaton.arrivals if automaton.queue else ()):
                if arrival.is_event:
                    name, note = self.message(machine, number), arrival.text
                    yield {"name": name, "type": "int", "value": number + 1, "comment": note}

    def _variables(self) -> dict[str, Json]:
        """Return the variables, and the condition of initial states if there are several."""
        types: dict[str, Json] = {}
        for machine, automaton in enumerate(self.automata):
            for number, component in enumerate(self.parts.components[machine]):
                types[self.component(machine, number)] = _bounded(max(component.texts))
            types |= dict.fromkeys(self.slots[machine], _bounded(len(automaton.arrivals)))
        types[UNFORESEEN] = "bool"
        starts = [self._start(n) for n in range(len(self.network.initial))]
        if len(starts) == 1:
            return {
                "variables": [
                    {"name": name, "type": type_, "initial-value": starts[0][name]}
                    for name, type_ in types.items()
                ]
            }
        condition = disjunction(
            conjunction(
                negation(name) if value is False else equal(name, value)
                for name, value in start.items()
            )
            for start in starts
        )
        return {
            "variables": [{"name": name, "type": type_} for name, type_ in types.items()],
            "restrict-initial": {"exp": condition},
        }

    def _start(self, start: int) -> dict[str, Json]:
        found: dict[str, Json] = {}
        for machine, place in enumerate(self.network.initial[start]):
            found |= self.becomes(machine, dict(enumerate(self.parts.codes[machine][place.local])))
            found |= dict.fromkeys(self.slots[machine], 0)
            waiting = (self.message(machine, message) for message in place.queue)
            found |= dict(zip(self.slots[machine], waiting, strict=False))
        return {**found, UNFORESEEN: False}

    # --- steps -----------------------------------------------------------------------------------

    @telling
    def _action(self, machine: int, move: Move) -> str:
        return f"{self.automata[machine].name}: {move.label}"

    def _edge(self, machine: int, automaton: Automaton, joint: Joint) -> Json:
        move, slots = joint.moves[0], self.slots[machine]
        steps = [self.becomes(machine, joint.change)]
        if move.taken is not None:
            steps[0] |= dict(zip(slots, (*slots[1:], 0), strict=True))
        steps += filter(None, map(self._sent, move.sent))
        if automaton.stops(move):
            steps.append(dict.fromkeys(slots, 0))
        return _edge(self._action(machine, move), self.guard(machine, joint), steps)

    def _sent(self, sent: Sent) -> dict[str, Json]:
        """Return the changes of a message."""
        machine, automaton = sent.target, self.automata[sent.target]
        if automaton.queues(sent.message):
            return self._posted(machine, automaton, self.message(machine, sent.message))
        maps = {n: after for n, (after, _) in automaton.received(sent.message).items()}
        return self._mapped(machine, maps) | _unforeseen(negation(self.is_in(machine, maps)))

    def _mapped(self, machine: int, maps: Mapping[int, int]) -> dict[str, Json]:
        """Return the value of each component after an effect on each local state."""
        steps, codes = list(maps.items()), self.parts.codes[machine]
        alone = shifting_components(codes, steps)
        found: dict[str, Json] = {}
        for component, shifts in alone.items():
            name = self.component(machine, component)
            found[name] = name
            for shift, numbers in shifts.items():
                there = self.has(machine, component, numbers)
                found[name] = choice(there, binary("+", name, shift), found[name])
        for change, places in changes(codes, steps, but=alone):
            before = self.is_in(machine, {steps[place][0] for place in places})
            for name, after in self.becomes(machine, change).items():
                found[name] = choice(before, after, found.get(name, name))
        return found

    def _posted(self, machine: int, automaton: Automaton, message: str) -> dict[str, Json]:
        """Return the changes of an event that is queued: the first free slot."""
        stopped = automaton.where(lambda local: not local.running)
        runs = negation(self.is_in(machine, stopped))
        slots = self.slots[machine]
        found: dict[str, Json] = {}
        for number, slot in enumerate(slots):
            ahead = [differ(slots[number - 1], 0)] if number else []
            room = conjunction((equal(slot, 0), *ahead, runs))
            found[slot] = choice(room, message, slot)
        too_long = len(slots) < automaton.queue
        return found | _unforeseen(conjunction((differ(slots[-1], 0), runs)) if too_long else False)

    def _tick(self) -> Json:
        step: dict[str, Json] = {}
        unknown: list[Json] = []
        for machine, automaton in enumerate(self.automata):
            if not is_idle(automaton.elapsed):
                step |= self._mapped(machine, automaton.elapsed)
                unknown.append(negation(self.is_in(machine, automaton.elapsed)))
        return _edge(TICK, self.time_passes(), [step | _unforeseen(disjunction(unknown))])

    # --- properties ------------------------------------------------------------------------------

    def _properties(self, found: list[Claim]) -> Iterator[Json]:
        for claim in (claim for claim in found if not claim.missing):
            of, condition = claim.property, self.formula(claim.condition)
            note = ""
            if claim.form is Form.LEADS_TO:
                note = " (no fairness: an obligation may never be met)"
                avoided = binary("<", _probability("Pmin", self.formula(claim.goal)), 1)
                condition = conjunction((condition, avoided))
            elif claim.form is Form.RECOVERABLE:
                condition = _compared("≤", condition)
            is_existential = claim.form is Form.REACHED
            values = _compared(">" if is_existential else "≤", condition)
            yield _property(of.name, values, of.text + note, some=is_existential)
        name = FORESEEN
        while name in {claim.property.name for claim in found}:
            name += "_"
        note = "the explorer saw every step"
        yield _property(name, _compared("≤", UNFORESEEN), note)


def _compared(sign: str, state: Json) -> Json:
    """Return that a state can be reached (``>``), or never is (``≤``)."""
    return binary(sign, _probability("Pmax", state), 0)


def _probability(op: str, state: Json) -> Json:
    return {"op": op, "exp": {"op": "F", "exp": state}}


def _property(name: str, values: Json, note: str, *, some: bool = False) -> Json:
    """Return a property of all initial states, or of ``some`` of them."""
    fun = "∃" if some else "∀"
    return {
        "name": name,
        "expression": {"op": "filter", "fun": fun, "values": values, "states": {"op": "initial"}},
        "comment": note,
    }


def _bounded(greatest: int) -> Json:
    return {"kind": "bounded", "base": "int", "lower-bound": 0, "upper-bound": greatest}


def _unforeseen(condition: Json) -> dict[str, Json]:
    if condition is False:
        return {}
    return {UNFORESEEN: disjunction((UNFORESEEN, condition))}


def _automaton(name: str, edges: list[Json], note: str) -> Json:
    return {
        "name": name,
        "comment": note,
        "locations": [{"name": PLACE}],
        "initial-locations": [PLACE],
        "edges": edges,
    }


def _edge(action: str, guard: Json, steps: list[dict[str, Json]]) -> Json:
    """Return an edge whose steps follow one another; assignments of one step are simultaneous."""
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
