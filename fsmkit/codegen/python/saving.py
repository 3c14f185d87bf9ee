"""The tables with which a class saves and restores itself: those of `plan.image`."""

from __future__ import annotations

import fsmkit.language as lang
from fsmkit.chart.statements import Destination
from fsmkit.codegen.python.content import ROUTES, Needs
from fsmkit.codegen.python.lines import Lines
from fsmkit.codegen.python.linking import ME
from fsmkit.codegen.python.names import Names
from fsmkit.document.document import Kind
from fsmkit.plan.exits import recordable
from fsmkit.plan.image import Image, code, head

UNKNOWN = 0xFFFF
"""The number for a route or an id that the machine never uses."""


def constants(image: Image, names: Names, needs: Needs) -> dict[str, object]:
    """Return the tables by name."""
    chart = image.chart
    return {
        "SAVED_BYTES": image.total,
        "_HEAD": head(chart),
        "_REGIONS": tuple(region.states for region in image.plan.regions),
        "_ABOVE": tuple(_mask((*chain, 0)) for chain in image.plan.chains),
        "_RECORDED": tuple(_recorded(image, *each) for each in image.histories),
        "_VARIABLES": tuple((names.variables[v.name], type_code(v.type)) for v in image.values),
        "_EVENT_TYPES": tuple(tuple(type_code(f.type) for f in e.fields) for e in chart.events),
        "_PAYLOAD": image.payload,
        "_DEFERRABLE": image.deferred,
        "_ARMED": image.timers,
        "_LATER": image.delayed,
        "_TIMED": {t.index: 1 << t.source for t in chart.transitions if t.has_timer},
        "_OWNERS": tuple((image.plan.region_of[o] if o else 0, 1 << o) for o in image.owners),
        "_RESTING": _mask(tuple(image.resting)),
        "_RECORDED_BELOW": image.recorded_below,
        "_ENDINGS": _mask(tuple(image.endings)),
        "_CAN_STOP": image.can_stop,
        "_RECORDABLE": tuple(_mask(tuple(each)) for each in image.recordable),
        "_ROUTES": tuple(_route(needs, *route) for route in image.routes),
        "_IDS": tuple(-1 if i is None else needs.marks.get(i, UNKNOWN) for i in image.ids),
        "_PEERS": image.peers,
        "_TEXTS": image.texts,
        "_SLOT_BYTES": tuple(inner.size for inner in image.inner),
    }


def _mask(states: tuple[int, ...]) -> int:
    return sum(1 << state for state in states)


def print_histories(out: Lines, image: Image, names: Names) -> None:
    """Print the methods that read and write the records of histories."""
    held = [f"{ME}_history_{names.bare[history]}" for history, _ in image.histories]
    if not held:
        return
    doc = "Return what each history recorded, as often as it has an entry in `_RECORDED`."
    with out.method("_recorded", doc, result="tuple[int, ...]"):
        out.line("return (")
        with out.indented():
            out.lines(f"{name}," for name in held)
        out.line(")")
    doc = "Let the history of an entry of `_RECORDED` remember some states more."
    with out.method("_remember", doc, "place: int, states: int"):
        for place, (name, (history, _)) in enumerate(zip(held, image.histories, strict=True)):
            parent = names.states[image.plan.parents[history]]
            unread = f" and not {ME}_active & {parent}" if image.plan.is_forgotten(history) else ""
            with out.suite(f"if place == {place}{unread}:"):
                out.line(f"{name} |= states")


def _recorded(image: Image, history: int, region: int) -> tuple[object, ...]:
    """Return the region, the states below the parent, and those that can be recorded of it.

    Also return whether it is recorded as a whole or not at all, as a shallow history of a parallel
    state does.
    """
    plan, states = image.plan, image.chart.states
    parent = plan.parents[history]
    is_deep = states[history].kind is Kind.DEEP_HISTORY
    is_whole = not is_deep and states[parent].kind is Kind.PARALLEL
    return region, _mask(plan.descendants(parent)), _mask(recordable(plan, history)), is_whole


def type_code(type_: lang.Type) -> tuple[object, ...]:
    """Return the code of a type and its bounds, or those of its elements."""
    match type_:
        case lang.ArrayType(element, length):
            return ("[", *[type_code(element)] * length)
        case lang.RecordType(_, fields):
            return ("[", *(type_code(part.type) for part in fields))
        case lang.BoolType():
            return ("?",)
        case lang.SymbolType():
            return ("text",)
        case lang.FloatType():
            return (code(type_), None, None)
        case lang.IntType(lo, hi):
            return (code(type_), lo, hi)
        case lang.EnumType():
            lo, hi = type_.bounds
            return (code(type_), lo, hi, *(() if type_.is_counted else (type_.numbers,)))
        case lang.DurationType():
            return (code(type_), 0, lang.LONGEST_DURATION)


def _route(needs: Needs, destination: Destination, slots: tuple[int, ...]) -> int:
    if destination is not Destination.INVOKED:
        return ROUTES[destination]
    known = needs.addresses
    return ROUTES[destination] + known.index(slots) if slots in known else UNKNOWN
