"""Random machines by the rules of other tools, and a reference that executes these rules.

A machine is a tree of states with reactions. The same machine is a Document, whose transitions
follow the rules of the tool until the rewritings have changed it.
"""

from __future__ import annotations

import random
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

from fsmkit.chart.elaborate import elaborate
from fsmkit.diagnostics import Findings, Source, Span, Text
from fsmkit.document import document as doc
from fsmkit.foreign.imports import Recorder
from fsmkit.foreign.rewriting.chained_reactions import CONSUMED, chained_reactions
from fsmkit.foreign.rewriting.local_transitions import local_transitions
from fsmkit.foreign.rewriting.ordered_candidates import ordered_candidates
from fsmkit.foreign.rewriting.resting_composites import resting_composites
from fsmkit.foreign.rewriting.tree import initial_to
from fsmkit.language.statements.tree import Assign, Block, CallOperation
from fsmkit.runtime.session import Session

EVENTS = ("e", "f", "do")
SOURCE = Source("<random>", " " * 10_000)
RULES = ("R1", "R2", "R7", "R9", "R11")


@dataclass
class Reaction:
    """A reaction: ``guard`` is a value of ``x``, ``action`` the number that it reports."""

    event: str
    rank: int
    guard: int | None
    action: int
    target: str | None
    consumes: bool | None
    """The value that the content assigns to `CONSUMED`, if it does."""


@dataclass
class State:
    """A state; its entry and exit report ``+name`` and ``-name``."""

    name: str
    parent: State | None = None
    children: list[State] = field(default_factory=list)
    initial: str | None = None
    reactions: list[Reaction] = field(default_factory=list)


def random_machine(seed: int, rules: Sequence[str]) -> dict[str, State]:
    """Return the states of a machine by name, the root `top` first.

    Without a rule, the machine has no construct that it concerns.
    """
    chosen = random.Random(seed)  # noqa: S311  (to repeat a machine)
    states = {"top": State("top")}
    for number in range(chosen.randrange(2, 9)):
        parent = chosen.choice(list(states.values()))
        state = State(f"s{number}", parent)
        parent.children.append(state)
        states[state.name] = state
    names = [name for name in states if name != "top"]
    for state in states.values():
        inside = [each for each in names if state in path(states[each])[1:]]
        if inside and not (state.parent and "R2" in rules and chosen.random() < 0.4):
            state.initial = chosen.choice(inside)
        left = list(EVENTS)
        for _ in range(chosen.randrange(4) if state.parent else 0):
            target = chosen.choice(names) if chosen.random() < 0.6 else None
            if target is not None and "R1" not in rules and is_related(state, states[target]):
                target = None
            event = chosen.choice(left)
            if "R7" in rules and "R11" not in rules:
                left.remove(event)
            state.reactions.append(
                Reaction(
                    event,
                    chosen.randrange(3) if "R9" in rules else 0,
                    chosen.choice([None, 0, 1, 2]),
                    chosen.randrange(100),
                    target,
                    chosen.choice([None, None, True, False])
                    if "R7" in rules and target is None
                    else None,
                )
            )
    return states


def path(state: State) -> list[State]:
    """Return a state and those around it, the root last."""
    found = [state]
    while found[-1].parent is not None:
        found.append(found[-1].parent)
    return found


def is_related(one: State, two: State) -> bool:
    """Return whether one of two different states is inside the other."""
    return one is not two and (one in path(two) or two in path(one))


# --- the reference: the rules of the tool ---------------------------------------------------------


class Reference:
    """Executes a machine by the rules of a tool."""

    def __init__(self, states: dict[str, State], rules: Sequence[str]) -> None:
        """Enter the initial states."""
        self.states, self.rules, self.x = states, rules, 0
        self.reported: list[str] = []
        self.active = states["top"]
        self.descend()

    def post(self, event: str) -> None:
        """React to an event: inner states first, outer ones while it is not consumed."""
        for state in path(self.active):
            found = [each for each in state.reactions if each.event == event]
            if "R9" in self.rules:
                found.sort(key=lambda each: each.rank)
            is_consumed = False
            for reaction in found:
                if reaction.guard not in (None, self.x):
                    continue
                if reaction.target is not None:
                    self.take(state, reaction)
                    return
                is_consumed = is_consumed or not ("R7" in self.rules and event == "do")
                self.act(reaction)
                if reaction.consumes is not None:
                    is_consumed = reaction.consumes
                if "R11" not in self.rules:
                    break
            if is_consumed:
                return

    def take(self, state: State, reaction: Reaction) -> None:
        """Take a transition: exits, content, entries."""
        target = self.states[reaction.target or ""]
        if "R1" in self.rules and is_related(state, target):
            home = state if state in path(target) else target
        else:
            home = next(each for each in path(state)[1:] if each in path(target)[1:])
        while self.active is not home:
            self.reported.append(f"-{self.active.name}")
            self.active = self.active.parent or home
        self.act(reaction)
        self.enter(target)
        self.descend()

    def enter(self, target: State) -> None:
        """Enter the states from the active one down to a target."""
        inside = path(target)[: path(target).index(self.active)]
        self.reported += [f"+{each.name}" for each in reversed(inside)]
        self.active = target

    def descend(self) -> None:
        """Follow initial states; a composite state without one stays active alone."""
        while self.active.initial is not None:
            self.enter(self.states[self.active.initial])

    def act(self, reaction: Reaction) -> None:
        """Report the content of a reaction, which changes ``x``."""
        self.reported.append(f"a{reaction.action}")
        self.x = reaction.action % 3


# --- the same machine as a chart ------------------------------------------------------------------


def text(value: str) -> Text:
    """Return a string with a location."""
    return Text(value, Span(SOURCE, 0, 1), ())


def document_of(states: dict[str, State], rules: Sequence[str]) -> doc.Document:
    """Return the rewritten document of a machine."""
    ranks: dict[Span, int] = {}
    operations: dict[str, None] = {}

    def report(value: str) -> Block:
        name = f"report_{value.replace('+', 'in_').replace('-', 'out_')}"
        operations[name] = None
        return (CallOperation(text(f"{name}()"), Span(SOURCE, 0, 0)),)

    def reaction(one: Reaction) -> doc.DocTransition:
        span = Span(SOURCE, len(ranks), len(ranks) + 1)
        ranks[span] = one.rank
        at = Span(SOURCE, 0, 0)
        block = report(f"a{one.action}")
        block += (Assign(text("x"), text(str(one.action % 3)), at),)
        if one.consumes is not None:
            block += (Assign(text(CONSUMED), text(str(one.consumes).lower()), at),)
        return doc.DocTransition(
            doc.Trigger.EVENT, span, events=(text(one.event),), content=block, ordered=True,
            guard=None if one.guard is None else text(f"x == {one.guard}"),
            targets=() if one.target is None else (text(one.target),),
        )  # fmt: skip

    def state(node: State) -> doc.DocState:
        return doc.DocState(
            text(node.name),
            doc.Kind.COMPOUND if node.children else doc.Kind.ATOMIC,
            Span(SOURCE, 0, 0),
            initial=None if node.initial is None else initial_to(text(node.initial)),
            children=tuple(map(state, node.children)),
            transitions=tuple(map(reaction, node.reactions)),
            entry=(report(f"+{node.name}"),),
            exit=(report(f"-{node.name}"),),
        )

    top = states["top"]
    root = doc.DocState(
        None, doc.Kind.COMPOUND, Span(SOURCE, 0, 0),
        initial=initial_to(text(top.initial or top.children[0].name)),
        children=tuple(map(state, top.children)),
    )  # fmt: skip
    document = doc.Document(
        SOURCE, text("Random"), root,
        data=(doc.DocData(text("x"), text("0..2"), text("0")),),
        operations=tuple(doc.DocOperation(text(name), (), None) for name in operations),
        events=tuple(doc.DocEvent(text(name), (), doc.Direction.IN) for name in EVENTS),
    )  # fmt: skip
    recorder = Recorder()
    if "R9" in rules:
        document = ordered_candidates(document, recorder, lambda each: ranks[each.span])
    if "R7" in rules:
        document = chained_reactions(document, recorder, lambda event: event == "do")
    elif "R11" in rules:
        document = chained_reactions(document, recorder)
    if "R2" in rules:
        document = resting_composites(document, recorder)
    return local_transitions(document, recorder) if "R1" in rules else document


def difference(seed: int, rules: Sequence[str], events: int = 30) -> str | None:
    """Return the first difference between a machine by its reference and as a chart."""
    states = random_machine(seed, rules)
    reference = Reference(states, rules)
    findings = Findings()
    chart = elaborate((document_of(states, rules),), findings)
    findings.stop_on_errors()
    if chart is None:
        return "no chart"
    reported: list[str] = []

    def operation(name: str) -> Callable[[], None]:
        word = name.removeprefix("report_").replace("in_", "+").replace("out_", "-")
        return lambda: reported.append(word)

    session = Session(chart, {each.name: operation(each.name) for each in chart.operations})
    chosen = random.Random(seed)  # noqa: S311  (to repeat a machine)
    for number in range(events):
        expected, reference.reported = reference.reported, []
        active = session.active[-1].removesuffix("_self")
        if expected != reported or active != reference.active.name:
            shown = f"{expected} {reference.active.name}, not {reported} {active}"
            return f"machine {seed}, event {number}: {shown}"
        reported.clear()
        event = chosen.choice(EVENTS)
        reference.post(event)
        session.post(event)
        session.run()
    return None
