"""Random charts that the library `transitions` can mostly express.

They have transitions with one target, numbers that wrap around, and no deferral. Two of three have
timers, histories, choices and eventless transitions. ``python -m devtools.plain --charts 1000``
compares the target on them.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass, field

import click

import fsmkit
from devtools.differential import (
    Case,
    Divergence,
    Totals,
    compare_all,
    elaborated,
    explain,
    first_difference,
)
from devtools.random_charts.choices import Choices, SeededChoices
from devtools.random_charts.content import PLACE, SOURCE, text
from devtools.random_charts.scripts import random_script
from devtools.random_charts.tree import HISTORIES, LETTERS, Node
from devtools.random_charts.walks import walk
from devtools.transitions_harness import TransitionsHarness
from fsmkit.chart.chart import Chart
from fsmkit.codegen.transitions.limits import check
from fsmkit.diagnostics import Findings, Text
from fsmkit.document import document as doc
from fsmkit.language.statements import tree as stmt

NUMBERS = ("uint8", "int16", "int32", "0..9 wrap", "-3..12 wrap")
TURNS = "turns"
"""The counter that bounds what content raises, so that every macrostep ends."""
DELAYS = ("1ms", "2ms", "5ms", "20ms")
BATCH = 50
LONGEST_WALK = 10_000
"""Steps of one walk."""


def random_plain(choices: Choices) -> doc.Document:
    """Return a document of about a dozen states at most."""
    return _Author(choices).document()


def plain_case(seed: int, number: int) -> Case:
    """Return one example; the same for the same seed and number."""
    choices = SeededChoices(f"plain {seed}:{number}")
    documents = (random_plain(choices),)
    chart = elaborated(documents)
    is_walk = choices.chance(50)
    script = walk(choices, chart, 60)[0] if is_walk else random_script(choices, chart, 60)
    return Case(documents, chart, tuple(script), f"chart {number} of {seed}")


@dataclass
class _Author:
    """Writes one document."""

    choices: Choices
    made: int = 0
    numbers: list[str] = field(default_factory=list)
    flags: list[str] = field(default_factory=list)
    events: dict[str, bool] = field(default_factory=dict)
    """The received events, and whether each carries a number."""
    states: list[Node] = field(default_factory=list)
    content_chance: int = 20
    has_steps: bool = False
    """Whether it has features that the library lacks: time, histories, eventless transitions."""

    def document(self) -> doc.Document:
        pick = self.choices.pick
        types = ["uint8", pick(NUMBERS), pick(NUMBERS)][: self.choices.integer(0, 3)]
        self.numbers = [f"v{n}" for n in range(len(types))]
        self.flags = ["b0", "b1"][: self.choices.integer(0, 2)]
        self.events = {f"e{n}": n == 1 for n in range(self.choices.integer(1, 5))}
        self.content_chance = pick((20, 8, 40))
        self.has_steps = self.choices.chance(66)
        root = Node("", doc.Kind.COMPOUND, None)
        self._fill(root, self.choices.integer(2, 9))
        self.states = root.below()
        inputs = (
            doc.DocData(text("i0"), text("bool"), None),
            doc.DocData(text("i1"), text("0..9"), None),
        )
        number = (stmt.DocField(text("n"), text("0..9")),)
        operations = (
            doc.DocOperation(text("act"), (stmt.DocField(text("x"), text("int32")),), None),
            doc.DocOperation(text("ask"), (), text("bool")),
            doc.DocOperation(text("get"), (), text("0..9")),
        )
        data = [doc.DocData(text(f"v{n}"), text(type_), text("1")) for n, type_ in enumerate(types)]
        data += [doc.DocData(text(name), text("bool"), text("false")) for name in self.flags]
        data += [
            doc.DocData(text(TURNS), text("uint8"), text("0")),
            doc.DocData(text("a"), text("uint8[3]"), text("2")),
        ]
        return doc.Document(
            SOURCE,
            text("Plain"),
            self._state(root),
            data=tuple(data),
            inputs=inputs,
            outputs=(doc.DocData(text("o0"), text("bool"), text("false")),),
            operations=operations,
            events=(
                *(
                    doc.DocEvent(text(name), number if has else (), doc.Direction.IN)
                    for name, has in self.events.items()
                ),
                doc.DocEvent(text("n0"), (), doc.Direction.INTERNAL),
                doc.DocEvent(text("out0"), number, doc.Direction.OUT),
            ),
            # wide: the library has no such bounds, so none may be reached
            capacities=(
                doc.DocCapacity(text("internal"), text("64")),
                doc.DocCapacity(text("delayed"), text("64")),
                doc.DocCapacity(text("queue"), text("64")),
                doc.DocCapacity(text("microsteps"), text("1000")),
            ),
        )

    # --- the tree ---------------------------------------------------------------------------

    def _fill(self, node: Node, budget: int) -> None:
        is_parallel = node.kind is doc.Kind.PARALLEL
        count = 2 if is_parallel else max(1, self.choices.integer(1, 4))
        for place in range(count):
            self.made += 1
            kind = doc.Kind.ATOMIC
            if budget > 2 and node.depth < 4:
                wish = self.choices.integer(0, 9)
                kind = doc.Kind.COMPOUND if wish < (8 if is_parallel else 3) else kind
                kind = doc.Kind.PARALLEL if wish >= 8 else kind
            if kind is doc.Kind.ATOMIC and place and not is_parallel and self.choices.chance(20):
                kind = doc.Kind.FINAL
            elif self._may_choose(node) and kind is doc.Kind.ATOMIC and self.choices.chance(15):
                kind = doc.Kind.CHOICE
            child = Node(f"{LETTERS[kind]}{self.made}", kind, node)
            node.children.append(child)
            if kind in (doc.Kind.COMPOUND, doc.Kind.PARALLEL):
                self._fill(child, budget // 2)
        if self.has_steps and node.depth and self.choices.chance(40):
            self.made += 1
            kind = self.choices.pick((doc.Kind.SHALLOW_HISTORY, doc.Kind.DEEP_HISTORY))
            node.children.append(Node(f"{LETTERS[kind]}{self.made}", kind, node))

    def _may_choose(self, node: Node) -> bool:
        """Whether a child may be a choice: it must be able to lead to another one."""
        return self.has_steps and node.kind is not doc.Kind.PARALLEL and bool(node.children)

    def _state(self, node: Node) -> doc.DocState:
        has_content = node.parent is not None
        if node.kind in HISTORIES and node.parent is not None:
            is_deep = node.kind is doc.Kind.DEEP_HISTORY
            inside = node.parent.below() if is_deep else node.parent.children
            default = self.choices.pick([c for c in inside if c.is_real])
            leads = doc.DocTransition(doc.Trigger.INITIAL, PLACE, targets=(text(default.id),))
            return doc.DocState(text(node.id), node.kind, PLACE, initial=leads)
        is_top_final = node.kind is doc.Kind.FINAL and node.depth == 1
        initial = None
        if node.kind is doc.Kind.COMPOUND:
            inside = node.below() if self.has_steps and self.choices.chance(15) else node.children
            first = self.choices.pick(
                [c for c in inside if c.is_real and c.kind is not doc.Kind.FINAL]
            )
            initial = doc.DocTransition(doc.Trigger.INITIAL, PLACE, targets=(text(first.id),))
        return doc.DocState(
            text(node.id) if node.id else None,
            node.kind,
            PLACE,
            initial=initial,
            children=tuple(self._state(child) for child in node.children),
            transitions=self._transitions(node),
            entry=self._handlers() if has_content else (),
            exit=self._handlers() if has_content and not is_top_final else (),
        )

    # --- transitions ------------------------------------------------------------------------

    def _transitions(self, node: Node) -> tuple[doc.DocTransition, ...]:
        if node.kind is doc.Kind.CHOICE:
            return self._branches(node)
        if not node.has_behaviour:
            return ()
        found = [self._transition(node) for _ in range(self.choices.pick((1, 2, 0, 3)))]
        ended = [c for c in node.children if c.kind is doc.Kind.FINAL]
        if node.kind is doc.Kind.COMPOUND and ended and self.choices.chance(50):
            found.append(self._leading(node, (f"done.state.{node.id}",)))
        return tuple(found)

    def _branches(self, node: Node) -> tuple[doc.DocTransition, ...]:
        """Return the transitions of a choice; the last has no guard and leads to no choice."""
        near = [n for n in self.states if n.kind is doc.Kind.ATOMIC]
        near = [n for n in near if n.parent is node.parent] or near
        guard = text(self._truth(False))
        if not near:
            return ()
        ways = [(guard, self.choices.pick(near)), (None, self.choices.pick(near))]
        return tuple(
            doc.DocTransition(doc.Trigger.EVENTLESS, PLACE, guard=guard, targets=(text(way.id),),
                content=self._block(False) if self.choices.chance(40) else None)
            for guard, way in ways
        )  # fmt: skip

    def _without_event(self, node: Node) -> doc.DocTransition:
        """Return a transition that a time triggers, or nothing at all, some times."""
        kind = self.choices.pick(
            (doc.Trigger.AFTER, doc.Trigger.AFTER, doc.Trigger.EVERY, doc.Trigger.EVENTLESS)
        )
        targets = tuple(text(n.id) for n in self._targets(node) if n.kind is not doc.Kind.CHOICE)
        guard = self._test(False) if self.choices.chance(35) else None
        counted: stmt.Block = ()
        if kind is doc.Trigger.EVENTLESS:
            guard = f"{TURNS} < 30 and {self._test(False)}"
            counted = (stmt.Assign(text(TURNS), text("1"), PLACE, "+"),)
        return doc.DocTransition(
            kind,
            PLACE,
            delay=None if kind is doc.Trigger.EVENTLESS else text(self.choices.pick(DELAYS)),
            guard=None if guard is None else text(guard),
            targets=targets,
            content=(*counted, *(self._block(False) if self.choices.chance(50) else ())),
            ordered=True,
        )

    def _transition(self, node: Node) -> doc.DocTransition:
        if self.has_steps and self.choices.chance(45):
            return self._without_event(node)
        kind = self.choices.integer(0, 11)
        names = list(self.events)
        if kind == 11:
            return self._leading(node, ("*",))
        if kind == 10:
            return self._leading(node, self.choices.some(names, 2))
        if kind == 9:
            return self._leading(node, ("n0",))
        return self._leading(node, (self.choices.pick(names),))

    def _leading(self, node: Node, events: tuple[str, ...]) -> doc.DocTransition:
        targets = self._targets(node)
        if events[0] == "*" or events[0].startswith("done."):  # or they might go on for ever
            targets = tuple(n for n in targets if n.kind is doc.Kind.ATOMIC)
        has_number = len(events) == 1 and self.events.get(events[0], False)
        is_inner = bool(targets) and targets[0].is_below(node)
        return doc.DocTransition(
            doc.Trigger.EVENT,
            PLACE,
            events=tuple(text(name) for name in events),
            guard=text(self._test(has_number)) if self.choices.chance(35) else None,
            targets=tuple(text(target.id) for target in targets),
            internal=is_inner and node.kind is doc.Kind.COMPOUND,
            content=self._block(has_number) if self.choices.chance(50) else None,
            ordered=True,
        )

    def _targets(self, node: Node) -> tuple[Node, ...]:
        kind = self.choices.integer(0, 9)
        if kind == 0:
            return ()
        if kind == 1:
            return (node,)
        if kind == 2 and node.children:
            return (self.choices.pick(node.children),)
        if kind == 3:
            return (self.choices.pick(self.states),)
        here = node
        while here.parent is not None and here.parent.kind is doc.Kind.PARALLEL:
            here = here.parent
        assert here.parent is not None  # noqa: S101  (the root is not parallel)
        near = [n for n in here.parent.children if n is not here] or [here]
        inner = [n for n in near if n.kind is doc.Kind.COMPOUND]
        if kind == 4 and inner:
            return (self.choices.pick(self.choices.pick(inner).children),)
        return (self.choices.pick(near),)

    # --- content ----------------------------------------------------------------------------

    def _handlers(self) -> tuple[stmt.Block, ...]:
        return (self._block(False),) if self.choices.chance(self.content_chance) else ()

    def _block(self, has_number: bool) -> stmt.Block:
        count = self.choices.integer(1, 2)
        return tuple(self._statement(has_number, 1) for _ in range(count))

    def _statement(self, has_number: bool, depth: int) -> stmt.WrittenStatement:
        number = self._number(has_number, 1)
        kind = self.choices.integer(0, 11)
        if kind <= 3 and self.numbers:
            return stmt.Assign(text(self.choices.pick(self.numbers)), text(number), PLACE)
        if kind == 4 and self.flags:
            flag = self.choices.pick(self.flags)
            return stmt.Assign(text(flag), text(self._truth(has_number)), PLACE)
        if kind == 5:
            return stmt.CallOperation(text(f"act({number})"), PLACE)
        if kind == 6:
            name = self.choices.pick([*self.events, "n0"])
            arguments = self._arguments() if self.events.get(name, False) else ()
            counted = stmt.Assign(text(TURNS), text("1"), PLACE, "+")
            raised = stmt.Raise(text(name), arguments, PLACE)
            return stmt.If((stmt.Branch(text(f"{TURNS} < 30"), (counted, raised)),), PLACE)
        if kind in (6, 7) and self.has_steps and self.choices.chance(70):
            return self._delayed()
        if kind == 7:
            return stmt.DocSend(PLACE, event=text("out0"), arguments=self._arguments())
        if kind == 8 and depth > 0:
            branch = stmt.Branch(text(self._truth(has_number)), (self._statement(has_number, 0),))
            other: stmt.Branch[Text, stmt.WrittenStatement] = stmt.Branch(
                None, (self._statement(has_number, 0),)
            )
            return stmt.If((branch, other)[: self.choices.integer(1, 2)], PLACE)
        if kind == 9 and "v0" in self.numbers and depth > 0:
            body = (self._statement(has_number, 0),)
            return stmt.ForEach(text("a"), text("v0"), None, body, PLACE)
        if kind == 10:
            index = self.choices.integer(0, 2)
            return stmt.Assign(text(f"a[{index}]"), text(number), PLACE)
        if kind == 11:
            return stmt.Assign(text("o0"), text(self._truth(has_number)), PLACE)
        return stmt.Log(text("at"), (text(number),), PLACE)

    def _delayed(self) -> stmt.WrittenStatement:
        name = text(self.choices.pick(("early", "late")))
        if self.choices.chance(25):
            return stmt.DocCancel(name, None, PLACE)
        event = self.choices.pick([*self.events, "out0", "n0"])
        arguments = self._arguments() if event == "out0" or self.events.get(event) else ()
        delay = text(self.choices.pick(DELAYS))
        sent = stmt.DocSend(PLACE, event=text(event), arguments=arguments, delay=delay, id=name)
        counted = stmt.Assign(text(TURNS), text("1"), PLACE, "+")
        return stmt.If((stmt.Branch(text(f"{TURNS} < 30"), (counted, sent)),), PLACE)

    def _arguments(self) -> tuple[stmt.DocArgument, ...]:
        value = self.choices.pick(("3", "0", "get()", "min(9, max(0, a[1]))"))
        return (stmt.DocArgument(text("n"), text(value)),)

    def _number(self, has_number: bool, depth: int) -> str:
        leaves = ["1", "3", "a[1]", "i1", *self.numbers, *self.numbers]
        leaves += ["event.n"] * 2 if has_number else []
        one = self.choices.pick(leaves)
        if depth == 0 or self.choices.chance(40):
            return one
        other = self._number(has_number, depth - 1)
        how = self.choices.pick(("{} + {}", "{} - {}", "{} * {}", "max({}, {})", "({} & {})"))
        return how.format(one, other)

    def _truth(self, has_number: bool) -> str:
        compared = f"{self._number(has_number, 1)} {self.choices.pick(('<', '==', '>='))} 3"
        return self.choices.pick((compared, compared, *self.flags, "i0", "true"))

    def _real(self) -> Node:
        return self.choices.pick([node for node in self.states if node.is_real])

    def _test(self, has_number: bool) -> str:
        kind = self.choices.integer(0, 9)
        if kind == 0 or kind == 9:
            return "ask()"
        if kind == 1:
            return f"not In({self._real().id})"
        if kind == 2:
            return f"{self._truth(has_number)} and not In({self._real().id})"
        return self._truth(has_number)


def compare_plain(seed: int, first: int, charts: int) -> Totals:
    """Compare the target with the interpreter on those charts of a seed that it can express."""
    cases = [plain_case(seed, number) for number in range(first, first + charts)]
    accepted = [case for case in cases if check(case.chart, Findings())]
    totals = compare_all(accepted, [TransitionsHarness()])
    totals.rejected += len(cases) - len(accepted)
    return totals


def compare_walks(chart: Chart, steps: int) -> tuple[int, Divergence | None]:
    """Compare the target on so many steps of one chart; return how many were the same."""
    done = number = 0
    while done < steps:
        choices = SeededChoices(f"walk {number}")
        script, expected = walk(choices, chart, min(LONGEST_WALK, steps - done))
        found = TransitionsHarness().run(chart, script)
        difference = first_difference("transitions", expected, found)
        if difference is not None:
            return done, difference
        done += sum(line.startswith("@") for line in expected)
        number += 1
    return done, None


@click.command()
@click.option("--charts", default=1000, show_default=True, help="How many random charts.")
@click.option("--seed", default=0, show_default=True, help="Which thousand.")
@click.option("--first", default=0, show_default=True, help="The number of the first chart.")
@click.option("--walk", "path", type=click.Path(exists=True), help="Walk about in this chart.")
@click.option("--steps", default=100_000, show_default=True, help="How far to walk.")
def main(charts: int, seed: int, first: int, path: str | None, steps: int) -> None:
    """Compare the target `transitions` with the interpreter on random plain charts, or on walks."""
    if path is not None:
        done, difference = compare_walks(fsmkit.read_chart(path), steps)
        click.echo(f"{path}: {done} steps are the same" + (f"\n{difference}" if difference else ""))
        sys.exit(0 if difference is None else 1)
    totals = Totals()
    for start in range(first, first + charts, BATCH):
        totals.add(compare_plain(seed, start, min(BATCH, first + charts - start)))
    click.echo(
        f"{totals.charts} charts on transitions: {totals.macrosteps} macrosteps, "
        f"{len(totals.divergences)} divergences; {totals.rejected} others rejected"
    )
    for name, divergence in totals.divergences[:1]:
        click.echo(explain(plain_case(seed, int(name.split()[1])), divergence))
    sys.exit(1 if totals.divergences else 0)


if __name__ == "__main__":
    main()
