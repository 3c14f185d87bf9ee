"""Random statecharts of itemis CREATE, and a reference that executes the rules of its generator.

The reference keeps a vector with the active leaf of each orthogonal region, as generated code does.
A step visits the places of the vector; the leaf there reacts, and so do the states around it that
have the same first place (parent first) or last place (child first). The statechart reaches fsmkit
as a file; both report each action.
"""

from __future__ import annotations

import random
from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass, field
from xml.sax.saxutils import quoteattr

from fsmkit.chart.elaborate import elaborate
from fsmkit.diagnostics import Findings, Source
from fsmkit.foreign.itemis.reader import import_machine
from fsmkit.runtime.session import Session

EVENTS, LOCALS = ("e", "f"), ("l", "m")
TYPES = 'xmlns:xmi="http://www.omg.org/XMI" xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance"'
ENDLESS = "endless"
MOST_STEPS = 40
"""Steps of one event; a machine that raises local events without end is not compared."""


class Endless(Exception):  # noqa: N818
    """The machine raises local events without end."""


@dataclass(frozen=True, eq=False)
class Condition:
    """An event, ``always``, a timer in milliseconds, and a value of ``x``; each can be absent."""

    event: str | None
    value: int | None
    timer: int | None = None

    def __str__(self) -> str:
        """Return it as itemis writes it."""
        trigger = f"after {self.timer} ms" if self.timer else self.event or ""
        return trigger + ("" if self.value is None else f" [x == {self.value}]")


@dataclass(frozen=True)
class Action:
    """Reports a number, sets ``x`` and may raise a local event."""

    number: int
    raised: str | None

    def __str__(self) -> str:
        """Return it as itemis writes it."""
        more = f"; raise {self.raised}" if self.raised else ""
        return f"report({self.number}); x = {self.number % 3}{more}"


@dataclass(eq=False)
class State:
    """A state with regions; ``first`` and ``last`` are its places in the vector."""

    name: str
    region: Region
    regions: list[Region] = field(default_factory=list)
    moves: list[tuple[Condition, Action | None, State]] = field(default_factory=list)
    local: list[tuple[Condition, Action]] = field(default_factory=list)
    entry: Action | None = None
    exit: Action | None = None
    first: int = 0
    last: int = 0

    @property
    def path(self) -> list[State]:
        """Return the state and those around it."""
        owner = self.region.owner
        return [self, *([] if owner is None else owner.path)]

    @property
    def timers(self) -> list[Condition]:
        """Return the conditions with a timer."""
        conditions = [one[0] for one in self.local] + [one[0] for one in self.moves]
        return [one for one in conditions if one.timer is not None]


@dataclass(eq=False)
class Region:
    """A region; the entry leads to ``initial``, which ``history`` may replace."""

    name: str
    owner: State | None
    states: list[State] = field(default_factory=list)
    history: str = ""
    first: int = 0
    last: int = 0


@dataclass
class Statechart:
    """A random statechart."""

    is_event_driven: bool
    is_child_first: bool
    regions: list[Region]
    local: list[tuple[Condition, Action]]
    states: list[State]


def random_statechart(seed: int) -> Statechart:
    """Return a statechart with nested and orthogonal regions."""
    chosen = random.Random(seed)  # noqa: S311  (to repeat a machine)
    numbers = iter(range(1, 1000))
    states: list[State] = []
    is_event_driven = chosen.random() < 0.5

    def region(owner: State | None, depth: int) -> Region:
        found = Region(f"r{next(numbers)}", owner)
        found.history = chosen.choice(["", "", "", "SHALLOW_HISTORY", "DEEP_HISTORY"])
        for _ in range(chosen.randrange(1, 4)):
            state = State(f"S{len(states)}", found)
            states.append(state)
            found.states.append(state)
            if depth < 2 and chosen.random() < 0.4:
                several = chosen.choice([1, 1, 2, 3])
                state.regions = [region(state, depth + 1) for _ in range(several)]
        return found

    def action(*, may_raise: bool) -> Action:
        raised = chosen.choice([*[None] * 8, *LOCALS]) if may_raise else None
        return Action(next(numbers), raised)

    def condition(*, timer: bool) -> Condition:
        if timer and chosen.random() < 0.15:
            return Condition(None, None, chosen.choice([50, 250, 1_000]))
        event = chosen.choice([*EVENTS, *LOCALS, "always", None])
        value = chosen.choice([None, 0, 1, 2])
        return Condition(event or ("always" if value is None else None), value)

    regions = [region(None, 0) for _ in range(chosen.choice([1, 1, 2, 3]))]
    for state in states:
        state.entry = action(may_raise=False) if chosen.random() < 0.7 else None
        state.exit = action(may_raise=False) if chosen.random() < 0.7 else None
        for _ in range(chosen.randrange(3)):
            state.local.append((condition(timer=True), action(may_raise=True)))
        targets = [other for other in states if not crosses(state, other)]
        for _ in range(chosen.randrange(4)):
            own = action(may_raise=True) if chosen.random() < 0.7 else None
            state.moves.append((condition(timer=True), own, chosen.choice(targets)))
    local = [(condition(timer=False), action(may_raise=True)) for _ in range(chosen.randrange(2))]
    place = 0
    for each in regions:
        place = number_places(each, place)
    return Statechart(is_event_driven, chosen.random() < 0.5, regions, local, states)


def crosses(one: State, two: State) -> bool:
    """Return whether two states are in different regions of the same state."""
    around = one.path
    shared = next((each for each in two.path if each in around), None)
    if shared in (one, two):
        return False
    tops = [each.path[each.path.index(shared) - 1 if shared else -1] for each in (one, two)]
    return tops[0].region is not tops[1].region


def number_places(region: Region, place: int) -> int:
    """Give a region and its states their places in the vector; return the next free place."""
    region.first, end = place, place + 1
    for state in region.states:
        state.first, inner = place, place
        for each in state.regions:
            inner = number_places(each, inner)
        state.last = max(inner, place + 1) - 1
        end = max(end, inner)
    region.last = end - 1
    return end


# --- the reference --------------------------------------------------------------------------------


class Reference:
    """Executes a statechart as code generated by itemis CREATE does."""

    def __init__(self, chart: Statechart) -> None:
        """Enter the statechart."""
        self.chart, self.x, self.now = chart, 0, 0
        self.reported: list[int] = []
        size = chart.regions[-1].last + 1
        self.vector: list[State | None] = [None] * size
        self.history: dict[Region, State] = {}
        self.raised: set[str] = set()
        self.timed: set[Condition] = set()
        self.armed: dict[Condition, int] = {}
        self.queue: deque[str] = deque()
        self.place = 0
        for region in chart.regions:
            self.enter_region(region, [])

    def is_active(self, state: State) -> bool:
        """Return whether a leaf within a state is active."""
        return any(leaf is not None and state in leaf.path for leaf in self.vector)

    def act(self, action: Action | None) -> None:
        """Report an action."""
        if action is not None:
            self.reported.append(action.number)
            self.x = action.number % 3
            if action.raised and self.chart.is_event_driven:
                self.queue.append(action.raised)
            elif action.raised:
                self.raised.add(action.raised)

    def holds(self, condition: Condition) -> bool:
        """Return whether a condition holds during a step."""
        if condition.timer is not None:
            return condition in self.timed
        is_there = condition.event in (None, "always") or condition.event in self.raised
        return is_there and condition.value in (None, self.x)

    def step(self, event: str | None) -> None:
        """Make a step: that of an event, or that of a cycle."""
        for count in range(MOST_STEPS + 1):
            if count == MOST_STEPS:
                raise Endless
            if event is not None:
                self.raised.add(event)
            self.place = 0
            while self.place < len(self.vector):
                leaf = self.vector[self.place]
                if leaf is not None:
                    self.react(leaf, tries=True)
                self.place += 1
            self.raised.clear()
            self.timed.clear()
            if not self.queue:
                return
            event = self.queue.popleft()

    def react(self, state: State | None, *, tries: bool) -> bool:
        """Let a state, or the statechart, react; return whether it took a transition."""
        if state is None:
            for condition, action in self.chart.local:
                if self.holds(condition):
                    self.act(action)
            return False
        child_first, parent = self.chart.is_child_first, state.region.owner
        if child_first:
            with_parent = self.impact(parent) == self.impact(state)
        else:
            with_parent = (0 if parent is None else parent.first) == state.first
        did = tries
        if tries:
            did = with_parent and not child_first and self.react(parent, tries=tries)
            if not did:
                did = self.take_first(state)
        if not did:
            for condition, action in state.local:
                if self.holds(condition):
                    self.act(action)
            if with_parent and child_first:
                did = self.react(parent, tries=tries)
        return did

    def impact(self, state: State | None) -> int:
        """Return the last place that a state takes part in: that of the last region around it."""
        if state is None:
            return len(self.vector) - 1
        owner = state.region.owner
        siblings = self.chart.regions if owner is None else owner.regions
        return self.impact(owner) if state.region is siblings[-1] else state.region.last

    def take_first(self, state: State) -> bool:
        """Take the first enabled transition."""
        for condition, action, target in state.moves:
            if self.holds(condition):
                left = [one for one in state.path if one in (state, target)
                        or one not in target.path]  # fmt: skip
                outer = left[-1]
                around = outer.region
                self.leave(outer)
                self.act(action)
                inside = target.path[: target.path.index(around.owner)] if (
                    around.owner is not None) else target.path  # fmt: skip
                self.enter(inside[-1], inside[:-1])
                is_last = self.impact(around.owner) == self.impact(outer)
                if self.chart.is_child_first and is_last:
                    self.react(around.owner, tries=False)
                return True
        return False

    def leave(self, state: State) -> None:
        """Leave a state: its regions in order, then itself."""
        for region in state.regions:
            active = next((one for one in region.states if self.is_active(one)), None)
            if active is not None:
                self.leave(active)
        if not state.regions:
            self.vector[state.first] = None
        for timer in state.timers:
            self.armed.pop(timer, None)
        self.act(state.exit)

    def enter(self, state: State, inside: list[State], *, deep: bool = False) -> None:
        """Enter a state, and states within it (the innermost first) or its initial ones.

        Deep history enters the last states of all regions.
        """
        for timer in state.timers:
            self.armed[timer] = self.now + (timer.timer or 0)
        self.act(state.entry)
        if not state.regions:
            self.vector[state.first] = state
            self.place = state.first
        for region in state.regions:
            if deep and region in self.history:
                self.enter(self.history[region], [], deep=True)
            else:
                self.enter_region(region, inside)
        self.history[state.region] = state

    def enter_region(self, region: Region, inside: list[State]) -> None:
        """Enter a region: a given state, by its history, or its first state."""
        if inside and inside[-1].region is region:
            self.enter(inside[-1], inside[:-1])
            return
        last = self.history.get(region)
        if region.history and last is not None:
            self.enter(last, [], deep=region.history == "DEEP_HISTORY")
            return
        self.enter(region.states[0], [])

    def advance(self, until: int) -> Iterator[None]:
        """Let time pass; yield after each timer that expires."""
        while due := [(at, n, key) for n, (key, at) in enumerate(self.armed.items())
                      if at <= until]:  # fmt: skip
            at, _, key = min(due, key=lambda one: one[:2])
            del self.armed[key]
            self.now = at
            self.timed.add(key)
            if self.chart.is_event_driven:
                self.step(None)
            yield
        self.now = until


# --- the file -------------------------------------------------------------------------------------


def xml_of(chart: Statechart) -> str:
    """Return a statechart as a file of itemis CREATE."""
    model = "@EventDriven" if chart.is_event_driven else "@CycleBased(200)"
    order = "@ChildFirstExecution" if chart.is_child_first else "@ParentFirstExecution"
    events = "\n".join(f"in event {name}" for name in EVENTS)
    inner = "\n".join(f"event {name}" for name in LOCALS)
    local = "\n".join(f"{condition} / {action}" for condition, action in chart.local)
    text = (f"{model} {order}\ninterface:\n{events}\nvar x : integer = 0\n"
            f"operation report(number : integer)\ninternal:\n{inner}\n{local}")  # fmt: skip
    regions = "".join(map(_region, chart.regions))
    return (
        f'<xmi:XMI xmi:version="2.0" {TYPES} xmlns:sgraph="http://www.yakindu.org/sct/sgraph/2.0.0">'
        f'<sgraph:Statechart xmi:id="c" name="Random" specification={_quoted(text)}>'
        f"{regions}</sgraph:Statechart></xmi:XMI>"
    )


def _quoted(text: str) -> str:
    return quoteattr(text, {"\n": "&#xA;"})


def _region(region: Region) -> str:
    kind = f' kind="{region.history}"' if region.history else ""
    entry = (f'<vertices xsi:type="sgraph:Entry" xmi:id="entry_{region.name}"{kind}>'
             f'<outgoingTransitions target="{region.states[0].name}"/></vertices>')  # fmt: skip
    return f'<regions name="{region.name}">{entry}{"".join(map(_state, region.states))}</regions>'


def _state(state: State) -> str:
    named = (("entry", state.entry), ("exit", state.exit))
    lines = [f"{word} / {action}" for word, action in named if action]
    lines += [f"{condition} / {action}" for condition, action in state.local]
    moves = "".join(
        f"<outgoingTransitions specification="
        f"{_quoted(f'{condition}' + (f' / {action}' if action else ''))}"
        f' target="{target.name}"/>'
        for condition, action, target in state.moves
    )
    return (f'<vertices xsi:type="sgraph:State" xmi:id="{state.name}" name="{state.name}" '
            f"specification={_quoted(chr(10).join(lines))}>{moves}"
            f"{''.join(map(_region, state.regions))}</vertices>")  # fmt: skip


def difference(seed: int) -> str | None:
    """Return the first difference between a statechart by the reference and as a chart.

    A statechart that raises local events without end is not compared; another one takes its place.
    """
    for again in range(10):
        found = verdict(seed + again * 1_000_000)
        if found != ENDLESS:
            return found
    return None


def verdict(seed: int, events: int = 25) -> str | None:
    """Return the first difference, or `ENDLESS`."""
    statechart = random_statechart(seed)
    findings = Findings()
    found = import_machine(Source("<random>", xml_of(statechart)), "Random", findings)
    if found is None or findings.has_errors:
        return f"machine {seed}: {[one.message for one in findings][:1]}"
    chart = elaborate((found.document,), findings)
    findings.stop_on_errors()
    assert chart is not None  # noqa: S101  (there are no errors)
    reported: list[int] = []
    reference = Reference(statechart)
    session = Session(chart, {"report": reported.append})
    chosen = random.Random(seed)  # noqa: S311  (to repeat a machine)
    try:
        for number in range(events):
            if (reference.reported, reference.x) != (reported, session["x"]):
                return (f"machine {seed}, event {number}: {reference.reported} x {reference.x}, "
                        f"not {reported} x {session['x']} {session.fault}")  # fmt: skip
            active = sorted(s.name for s in statechart.states if reference.is_active(s))
            other = sorted(s.name for s in statechart.states if session.is_in(s.name))
            if active != other:
                return f"machine {seed}, event {number}: {active}, not {other}"
            reported.clear()
            reference.reported = []
            _do(chosen, statechart, reference, session)
    except Endless:
        return ENDLESS
    return None


def _do(chosen: random.Random, chart: Statechart, reference: Reference, session: Session) -> None:
    if chosen.random() < 0.3:
        until = reference.now + chosen.choice([50, 200, 1_000])
        for _ in reference.advance(until):
            pass
        session.advance(until - session.now)
        if chart.is_event_driven:
            return
    event = chosen.choice(EVENTS)
    session.post(event)
    if chart.is_event_driven:
        reference.step(event)
    else:
        reference.raised.add(event)
        if chosen.random() < 0.7:
            session.post("cycle")
            reference.step(None)
    session.run()
