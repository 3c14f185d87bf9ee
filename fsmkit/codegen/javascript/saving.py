"""Tables for saving machines; the layout is that of `fsmkit.plan.image`."""

from __future__ import annotations

from collections.abc import Iterator
from typing import assert_never

import fsmkit.language as lang
from fsmkit.codegen.javascript.content import ROUTES
from fsmkit.codegen.javascript.expressions import Printer
from fsmkit.emit.javascript import quoted
from fsmkit.language.values import part_types
from fsmkit.plan.image import MAGIC, Image, code, head


def image_lines(image: Image, printer: Printer) -> Iterator[str]:
    """Yield the properties of the image of a chart."""
    chart = image.chart
    regions = (f"[{', '.join(map(str, region.states))}]" for region in image.plan.regions)
    yield f"head: [{', '.join(map(str, head(chart)[len(MAGIC) :]))}],"
    yield f"regions: [{', '.join(regions)}],"
    yield f"recorded: [{', '.join(f'[{history}, {r}]' for history, r in image.histories)}],"
    owners = ((image.plan.region_of[owner] if owner else 0, owner) for owner in image.owners)
    yield f"owners: [{', '.join(f'[{region}, {owner}]' for region, owner in owners)}],"
    yield f"resting: [{', '.join(map(str, sorted(image.resting)))}],"
    records = (f"[{', '.join(map(str, sorted(each)))}]" for each in image.recordable)
    yield f"recordable: [{', '.join(records)}],"
    below = (f"[{', '.join(map(str, each))}]" for each in image.recorded_below)
    yield f"recordedBelow: [{', '.join(below)}],"
    yield f"endings: [{', '.join(map(str, sorted(image.endings)))}],"
    yield f"canStop: {str(image.can_stop).lower()},"
    groups = (("data", chart.data), ("outputs", chart.outputs), ("inputs", chart.inputs))
    yield "values: ["
    for place, variables in groups:
        for variable in variables:
            yield f'  ["{place}", {quoted(variable.name)}, {_type(variable.type, printer)}],'
    yield "],"
    yield "events: ["
    for event in chart.events:
        yield f"  [{', '.join(_type(part.type, printer) for part in event.fields)}],"
    yield "],"
    routes = (
        f"[{ROUTES[destination]}, [{', '.join(map(str, slots))}]]"
        for destination, slots in image.routes
    )
    yield f"routes: [{', '.join(routes)}],"
    for name, texts in (("ids", image.ids), ("peers", image.peers), ("texts", image.texts)):
        found = ("null" if text is None else quoted(text) for text in texts)
        yield f"{name}: [{', '.join(found)}],"
    yield f"payload: {image.payload},"
    yield f"deferred: {image.deferred},"
    yield f"timers: {image.timers},"
    yield f"delayed: {image.delayed},"
    yield f"waiting: {image.waiting},"
    yield f"size: {image.size},"


def _type(type_: lang.Type, printer: Printer) -> str:
    """Return the saved format of a type, with the bounds of its values."""
    match type_:
        case lang.ArrayType() | lang.RecordType():
            parts = ", ".join(_type(part, printer) for part in part_types(type_))
            return f'["parts", {parts}]'
        case lang.SymbolType():
            return f'["text", "{code(type_)}"]'
        case lang.FloatType():
            return f'["real", "{code(type_)}"]'
        case lang.BoolType():
            return f'["bool", "{code(type_)}", 0, 1]'
        case lang.IntType(lo, hi):
            ends = f"{printer.spell(lo, type_)}, {printer.spell(hi, type_)}"
            return f'["whole", "{code(type_)}", {ends}]'
        case lang.EnumType():
            lo, hi = type_.bounds
            known = "" if type_.is_counted else f", [{', '.join(map(str, type_.numbers))}]"
            return f'["whole", "{code(type_)}", {lo}, {hi}{known}]'
        case lang.DurationType():
            return f'["whole", "{code(type_)}", 0, {lang.LONGEST_DURATION}]'
        case _:
            assert_never(type_)
