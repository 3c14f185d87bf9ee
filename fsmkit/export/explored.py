"""Compute the local steps of each machine of a closed system, over all of its global states.

The core explores, and reports the local states and the messages to them; the interpreter then
performs each local step once. Without a compiler the interpreter does both.
"""

from __future__ import annotations

from contextlib import closing
from typing import Any

from fsmkit.diagnostics import Findings, fail
from fsmkit.export.exporter import ExportOptions
from fsmkit.export.transition_system import breadth_first, too_many_choices, within_limits
from fsmkit.verify.engines.c.engine import CEngine, compiler
from fsmkit.verify.resources.deadline import TimeUp
from fsmkit.verify.statespace.actions import Message, Outcome, Step, TooManyChoices
from fsmkit.verify.statespace.closed_system import ClosedSystem
from fsmkit.verify.statespace.exploration import End
from fsmkit.verify.statespace.global_steps import Edge, GlobalSteps, State
from fsmkit.verify.statespace.reduced_successors import ReducedSuccessors

MEMORY = 4 << 30
"""Bytes that the core may use."""


class LocalExploration(GlobalSteps):
    """All global states, and the local states in them."""

    def __init__(self, closed: ClosedSystem) -> None:
        """Start without states."""
        super().__init__(closed, ReducedSuccessors(closed))
        self.starts: list[State] = []
        self.how_started: tuple[tuple[Step, ...], ...] = ()
        self.states = 0
        self.transitions = 0
        self.reached: tuple[set[int], ...] = tuple(set() for _ in closed.charts)

    def start(self) -> list[Edge]:
        """Start the machines with all possible choices."""
        edges = list(self.initial())
        ways: dict[State, tuple[Step, ...]] = {}
        for edge in edges:
            ways.setdefault(edge.to, edge.steps)
        self.starts, self.how_started = list(ways), tuple(ways.values())
        return edges

    def run(self, options: ExportOptions) -> None:
        """Reach all global states by the interpreter."""
        self.start()
        for state, edges in breadth_first(self, dict.fromkeys(self.starts, 0), options):
            self.states += 1
            self.transitions += len(edges)
            for locals_, number in zip(self.reached, state, strict=True):
                locals_.add(number)

    def follow(self, graph: dict[str, Any]) -> None:
        """Perform the local steps of the core."""
        _Follower(self, graph).run()


def local_steps_of(closed: ClosedSystem, options: ExportOptions) -> LocalExploration:
    """Return the local steps of all reachable local states.

    Raises `FsmkitError` (``export-too-large``) beyond the limits.
    """
    explored = LocalExploration(closed)
    try:
        if compiler() is None:
            explored.run(options)
        else:
            _explore_by_core(closed, options, explored)
    except TooManyChoices as error:
        raise too_many_choices(closed) from error
    return explored


def _explore_by_core(
    closed: ClosedSystem, options: ExportOptions, explored: LocalExploration
) -> None:
    limited = within_limits(closed, options)
    with closing(CEngine(closed, Findings(), options.deadline)) as engine:
        command = [str(engine.program), "--graph", "--memory", str(MEMORY), *engine.limits(0)]
        found = engine.result(command, lambda states, steps, _: limited(states, steps))
    limited(found["states"], found["transitions"])
    match End(found["outcome"]):
        case End.COMPLETE:
            pass
        case End.TIME:
            raise TimeUp
        case End.INTERRUPTED:
            raise KeyboardInterrupt
        case _:
            raise fail(
                "export-too-large",
                f"`{closed.system.name}` has more than {found['states']:,} states; "
                f"the explorer has no more memory than {MEMORY >> 30} GiB",
                help="export a smaller system",
            )
    explored.states = found["states"]
    explored.transitions = found["transitions"]
    explored.follow(found["graph"])


class _Follower:
    """Matches the local states of the interpreter with those of the core."""

    def __init__(self, explored: LocalExploration, graph: dict[str, Any]) -> None:
        self._explored = explored
        self._steps = graph["locals"]
        self._starts = graph["starts"]
        self._coming: dict[tuple[int, int], list[tuple[int, int]]] = {}
        self._numbers: dict[tuple[int, int], int] = {}
        self._messages: dict[int, Message] = {}
        self._ahead: list[tuple[int, int]] = []
        for target, local, message, after in graph["deliveries"]:
            self._coming.setdefault((target, local), []).append((message, after))

    def run(self) -> None:
        """Follow all steps, then all messages, until nothing is new."""
        edges = self._explored.start()
        for edge, locals_ in zip(edges, self._starts, strict=True):
            for machine, (ours, theirs) in enumerate(zip(edge.to, locals_, strict=True)):
                self._same(machine, theirs, ours)
        done: set[tuple[int, int, int]] = set()
        while self._ahead:
            while self._ahead:
                self._follow(*self._ahead.pop())
            for (machine, theirs), ours in list(self._numbers.items()):
                for message, after in self._coming.get((machine, theirs), ()):
                    key = machine, theirs, message
                    if message in self._messages and key not in done:
                        done.add(key)
                        number = self._explored.after(machine, ours, self._messages[message])
                        self._same(machine, after, number)

    def _same(self, machine: int, theirs: int, ours: int) -> None:
        """Record a pair of equal local states; the core and the interpreter must agree."""
        known = self._numbers.get((machine, theirs))
        if known is None:
            self._numbers[machine, theirs] = ours
            self._explored.reached[machine].add(ours)
            self._ahead.append((machine, theirs))
        elif known != ours:
            raise fail(
                "explorer-build",
                "the explorer and the interpreter disagree on a local state",
                help="please report it",
            )

    def _follow(self, machine: int, theirs: int) -> None:
        ours = self._numbers[machine, theirs]
        own, open_, elapsed = self._steps[machine][theirs]
        if own is not None:
            self._match(machine, own, self._explored.own_steps(machine, ours))
        if open_ is not None:
            self._match(machine, open_, self._explored.open_steps(machine, ours))
        if elapsed is not None:
            self._same(machine, elapsed, self._explored.elapsed(machine, ours))

    def _match(self, machine: int, theirs: list[Any], ours: list[Outcome]) -> None:
        found = {(o.step.action.value, o.step.argument, o.step.choices): o for o in ours}
        for action, argument, choices, after, messages in theirs:
            outcome = found[action, argument, tuple(choices)]
            self._messages.update(zip(messages, outcome.messages, strict=True))
            self._same(machine, after, self._explored.intern(machine, outcome.after))
