"""A plan as a tree on the terminal and as data: what a machine executes."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, assert_never

from rich.text import Text
from rich.tree import Tree

from fsmkit.chart.format import format_trigger
from fsmkit.plan.operations import Branch, Content, Enter, Op, Restore, Variant
from fsmkit.plan.plan import Plan


def plan_tree(plan: Plan) -> Tree:
    """Return regions with their numbers, then what each transition exits and enters."""
    found, speller = plan_document(plan), _Speller(plan)
    tree = Tree(Text(f"plan of {plan.chart.name}", "bold"))
    regions = tree.add(Text("regions", "bold"))
    for index, region in enumerate(found["regions"]):
        states = ", ".join(f"{number} {name}" for name, number in region["states"].items())
        regions.add(f"{index}: {region['top']}: {states}")
    tree.add(Text(f"start: {found['start']}"))
    moves = tree.add(Text("transitions", "bold"))
    for move in found["moves"]:
        number, variants = move["transition"], move["variants"]
        heading = Text(f"{number} {speller.transition(number)}")
        if len(variants) == 1:
            moves.add(heading.append(f": {variants[0]}", "dim"))
        else:
            node = moves.add(heading)
            for variant in variants:
                node.add(Text(variant, "dim"))
    return tree


def plan_document(plan: Plan) -> dict[str, Any]:
    """Return a plan as data for JSON."""
    speller = _Speller(plan)
    return {
        "regions": [
            {
                "top": plan.chart.states[region.top].id,
                "states": {plan.chart.states[s].id: s for s in region.states},
            }
            for region in plan.regions
        ],
        "start": speller.ops(plan.start),
        "moves": [
            {
                "transition": index,
                "variants": [speller.variant(variant) for variant in variants],
            }
            for index, variants in enumerate(plan.variants)
        ],
    }


@dataclass(frozen=True, slots=True)
class _Speller:
    plan: Plan

    def state(self, index: int) -> str:
        """Return the id of a state."""
        return self.plan.chart.states[index].id

    def transition(self, index: int) -> str:
        transition = self.plan.chart.transitions[index]
        trigger = format_trigger(transition, self.plan.chart)
        return f"{self.state(transition.source)} {trigger}"

    def variant(self, variant: Variant) -> str:
        if variant.domain is None:
            return "stays"
        effect = f"within {self.state(variant.domain)}: {self.ops(variant.entry) or 'nothing'}"
        conditions = " and ".join(
            f"{self.state(c.history)} recorded {c.first}..{c.last} in region {c.region}"
            for c in variant.conditions
        )
        return f"if {conditions}: {effect}" if conditions else effect

    def ops(self, ops: Iterable[Op]) -> str:
        return ", ".join(self.op(op) for op in ops)

    def op(self, op: Op) -> str:
        match op:
            case Enter(state, defaults):
                content = "".join(f" with content of {t}" for t in defaults)
                return f"enter {self.state(state)}{content}"
            case Restore(history, below):
                return f"restore {self.state(history)} below {self.state(below)}"
            case Branch(history, recorded, unrecorded):
                return (
                    f"if {self.state(history)} is recorded ({self.ops(recorded)})"
                    f" else ({self.ops(unrecorded)})"
                )
            case Content(transition):
                return f"content of {transition}"
            case _:
                assert_never(op)
