"""Random models of QM, and a reference implementation of QP's rules for them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

from devtools.random_charts.choices import Choices, SeededChoices
from fsmkit.chart.chart import Chart
from fsmkit.chart.elaborate import elaborate
from fsmkit.diagnostics import Findings, Source
from fsmkit.foreign.imports import Rewriting
from fsmkit.foreign.qm.reader import import_machine
from fsmkit.testing.harness.harness import INTERPRETER

EVENTS = ("A", "B", "C")
GUARDS = ("me->x == 0U", "me->x != 0U", "else")


@dataclass(eq=False)
class State:
    """A state of a model; ``initial`` and the targets are names of states or histories."""

    name: str
    parent: State | None
    children: list[State] = field(default_factory=list)
    has_handlers: bool = True
    initial: str | None = None
    history: tuple[str, str] | None = None
    """Its kind and its default target."""
    moves: list[Move] = field(default_factory=list)

    def ancestors(self) -> Iterator[State]:
        """Yield the state itself and those around it, the innermost first."""
        yield self
        if self.parent is not None:
            yield from self.parent.ancestors()

    def below(self) -> Iterator[State]:
        """Yield the state itself and all inside it."""
        yield self
        for child in self.children:
            yield from child.below()


@dataclass
class Move:
    """A transition: an event, its action, and choices of guard, action and target."""

    event: str
    action: str
    target: str | None
    choices: list[tuple[str, str, str | None]]


@dataclass
class Model:
    """A model: the outermost state represents the state machine."""

    top: State

    def states(self) -> list[State]:
        """Return the states in document order."""
        return [state for child in self.top.children for state in child.below()]

    def named(self, name: str) -> State:
        """Return a state."""
        return next(state for state in self.states() if state.name == name)


def random_model(choices: Choices) -> Model:
    """Return a model with up to ten states."""
    top = State("top", None)
    states: list[State] = []
    for number in range(choices.integer(2, 10)):
        places = [top, *(state for state in states if sum(1 for _ in state.ancestors()) < 5)]
        parent = choices.pick(places)
        states.append(State(f"s{number}", parent, has_handlers=choices.chance(70)))
        parent.children.append(states[-1])
    model = Model(top)
    top.initial = choices.pick(model.states()).name
    for state in states:
        inner = [one.name for one in state.below()][1:]
        if inner and choices.chance(60):
            state.initial = choices.pick(inner)
        if inner and choices.chance(30):
            kind = choices.pick(("shallow", "deep"))
            names = inner if kind == "deep" else [child.name for child in state.children]
            state.history = kind, choices.pick(names)
    for state in states:
        targets = [one.name for one in states]
        targets += [
            f"{one.name}*"
            for one in states
            if one.history and one not in state.ancestors() and state not in one.ancestors()
        ]
        for event in EVENTS:
            if choices.chance(55):
                state.moves.append(_move(choices, state, event, targets))
    return model


def _move(choices: Choices, state: State, event: str, targets: list[str]) -> Move:
    def target() -> str | None:
        return choices.pick(targets) if choices.chance(80) else None

    action = f"{state.name}_{event}"
    if choices.chance(60):
        return Move(event, action, target(), [])
    guards = choices.pick((GUARDS[:1], GUARDS[1:2], (GUARDS[0], GUARDS[2]), (GUARDS[1], GUARDS[2])))
    is_whole = "else" in guards and choices.chance(50)
    found = [(guard, f"{action}_{number}", target()) for number, guard in enumerate(guards)]
    return Move(event, action if is_whole else "", None, found)


# --- as a file ------------------------------------------------------------------------------------


def text_of(model: Model) -> str:
    """Return a model as QM saves it."""
    lines = [
        '<model version="7.0.3"><package name="P"><class name="Random" superclass="qpc::QHsm">',
        '<attribute name="x" type="uint8_t"/><statechart>',
    ]
    lines += _initial(model, model.top)
    for child in model.top.children:
        lines += _state(model, child)
    return "\n".join([*lines, "</statechart></class></package></model>"])


def _initial(model: Model, state: State) -> list[str]:
    if state.initial is None:
        return []
    path = _path(model, state, state.initial, 1)
    action = f"<action>{state.name}_init();</action>"
    return [f'<initial target="{path}">{action}</initial>']


def _state(model: Model, state: State) -> list[str]:
    lines = [f'<state name="{state.name}">']
    if state.has_handlers:
        lines.append(f"<entry>{state.name}_entry();</entry><exit>{state.name}_exit();</exit>")
    lines += _initial(model, state)
    for move in state.moves:
        at = _target(model, state, move.target, 1)
        lines.append(f'<tran trig="{move.event}"{at}>{_action(move.action)}')
        for guard, action, target in move.choices:
            at = _target(model, state, target, 2)
            lines.append(f"<choice{at}><guard>{guard}</guard>{_action(action)}</choice>")
        lines.append("</tran>")
    for child in state.children:
        lines += _state(model, child)
    if state.history:
        path = _path(model, state, state.history[1], 1)
        lines.append(f'<history type="{state.history[0]}" target="{path}"/>')
    return [*lines, "</state>"]


def _action(name: str) -> str:
    """Return an action; it also changes ``x``."""
    return f"<action>{name}(); me->x = {len(name) % 2}U;</action>" if name else ""


def _target(model: Model, state: State, target: str | None, up: int) -> str:
    return "" if target is None else f' target="{_path(model, state, target, up)}"'


def _path(model: Model, state: State, target: str, up: int) -> str:
    """Return the path from an element ``up`` levels below a state to a target."""
    wanted = model.named(target.rstrip("*"))
    common = next(one for one in state.ancestors() if one in list(wanted.ancestors()))
    steps = [".."] * (up + list(state.ancestors()).index(common))
    down = list(wanted.ancestors())
    inner = down[: down.index(common)][::-1]
    places = [common, *inner]
    for outer, child in zip(places, inner, strict=False):
        first = (outer.initial is not None) + len(outer.moves)
        steps.append(str(first + outer.children.index(child)))
    if target.endswith("*"):
        first = (wanted.initial is not None) + len(wanted.moves) + len(wanted.children)
        steps.append(str(first))
    return "/".join(steps)


# --- the reference --------------------------------------------------------------------------------


class Reference:
    """A hierarchical state machine by the rules of QP (class ``QHsm``)."""

    def __init__(self, model: Model) -> None:
        self.model, self.x = model, 0
        self.calls: list[str] = []
        self.kept: dict[str, State] = {}
        self.at = model.top
        self._settle(model.top)

    def dispatch(self, event: str) -> None:
        """Handle an event: the innermost state with a transition for it decides."""
        for source in self.at.ancestors():
            for move in source.moves:
                if move.event == event and self._take(source, move):
                    return

    def _take(self, source: State, move: Move) -> bool:
        self._act(move.action)
        if not move.choices:
            self._transit(source, move.target)
            return True
        for guard, action, target in move.choices:
            if {"me->x == 0U": self.x == 0, "me->x != 0U": self.x != 0}.get(guard, True):
                self._act(action)
                self._transit(source, target)
                return True
        return False

    def _act(self, action: str) -> None:
        if action:
            self.calls.append(action)
            self.x = len(action) % 2

    def _transit(self, source: State, target: str | None) -> None:
        if target is None:
            return
        goal = self._goal(target)
        leaf = self.at
        while self.at is not source:
            self._leave(leaf)
        outer = list(goal.ancestors())
        if goal is source:
            self._leave(leaf)
        while self.at not in outer:
            self._leave(leaf)
        self._enter(goal)
        self._settle(goal)

    def _goal(self, target: str) -> State:
        state = self.model.named(target.rstrip("*"))
        if not target.endswith("*"):
            return state
        assert state.history is not None  # noqa: S101  (the target names it)
        return self.kept.get(state.name) or self.model.named(state.history[1])

    def _leave(self, leaf: State) -> None:
        state = self.at
        if state.history:
            path = list(leaf.ancestors())
            child = leaf if state is leaf else path[path.index(state) - 1]
            self.kept[state.name] = leaf if state.history[0] == "deep" else child
        if state.has_handlers:
            self.calls.append(f"{state.name}_exit")
        assert state.parent is not None  # noqa: S101  (not the root)
        self.at = state.parent

    def _enter(self, goal: State) -> None:
        path = list(goal.ancestors())
        for state in reversed(path[: path.index(self.at)]):
            if state.has_handlers:
                self.calls.append(f"{state.name}_entry")
        self.at = goal

    def _settle(self, state: State) -> None:
        while state.initial is not None:
            self.calls.append(f"{state.name}_init")
            state = self.model.named(state.initial)
            self._enter(state)


def reference_calls(model: Model, events: list[str]) -> list[list[str]]:
    """Return the calls of the start and of each event, by the reference."""
    reference = Reference(model)
    found = [reference.calls]
    for event in events:
        reference.calls = []
        reference.dispatch(event)
        found.append(reference.calls)
    return found


def chart_calls(chart: Chart, events: list[str]) -> list[list[str]]:
    """Return the same of a chart, by the interpreter."""
    known = [event for event in events if event in chart.event_index]
    found: list[list[str]] = [[]]
    for line in INTERPRETER.run(chart, ["start 0", *(f"dispatch {event}" for event in known)]):
        if line.startswith("op "):
            found[-1].append(line.split()[1])
        elif line.startswith("="):
            found.append([])
    found.pop()
    rest = iter(found[1:])
    return [found[0], *([] if event not in chart.event_index else next(rest) for event in events)]


def difference(number: int) -> str | None:
    """Return the difference between a random model by the reference and as a chart."""
    return comparison(number)[0]


def comparison(number: int) -> tuple[str | None, tuple[Rewriting, ...]]:
    """Return the difference of a random model, if any, and the rewritings of its import."""
    choices = SeededChoices(f"qm {number}")
    model = random_model(choices)
    events = [choices.pick(EVENTS) for _ in range(30)]
    text, findings = text_of(model), Findings()
    found = import_machine(Source("random.qm", text), "Random", findings)
    chart = None if found is None else elaborate((found.document,), findings)
    findings.stop_on_errors()
    if found is None or chart is None:
        return "no chart", ()
    expected, called = reference_calls(model, events), chart_calls(chart, events)
    same = expected == called
    return None if same else f"model {number}: {expected}, not {called}", found.rewritten
