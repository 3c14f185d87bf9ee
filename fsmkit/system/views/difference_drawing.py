"""Draw two charts side by side with their differences in colours.

The new chart keeps the positions of the old one, so that a reader finds each state at once.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping

from fsmkit.chart.chart import Chart
from fsmkit.chart.differences.compare import Change
from fsmkit.chart.drawing.positions.placement import renamed
from fsmkit.system.views.drawing import draw_kept

COLOURS = {"added": "#15803d", "removed": "#b91c1c", "moved": "#1d4ed8", "changed": "#b45309"}
"""The colours of elements by their change; renamed ones are drawn as changed."""
GAP = 40.0
"""Points between the drawings."""
SIZE = re.compile(r'<svg width="([\d.]+)pt" height="([\d.]+)pt"')
ELEMENT = re.compile(r'<g id="(a_)?([stw])(\d+)(_\w+)?"( class="([^"]*)")?')


def draw_differences(old: Chart, new: Chart, changes: Iterable[Change]) -> str:
    """Return an SVG picture of the old and the new chart; raises as `draw_kept`."""
    changes = [*changes]
    before, placement = draw_kept(old, None)
    for each in changes:
        if each.kind == "renamed" and each.what == "state":
            placement = renamed(placement, str(each.details[0].old), each.name)
    after, _ = draw_kept(new, placement)
    marks = {"renamed": "changed"}
    olds = {_key(c, c.old): marks.get(c.kind, c.kind) for c in changes if c.old is not None}
    news = {_key(c, c.new): marks.get(c.kind, c.kind) for c in changes if c.new is not None}
    left, width, height = _part(before, "old_", olds)
    right, more, other = _part(after, "new_", news)
    style = "".join(
        f".{name} > path, .{name} > polygon, .{name} > ellipse, .{name} > g > a > path, "
        f".{name} > g > a > polygon, .{name} > g > a > ellipse {{stroke: {colour}; "
        f"stroke-width: 2.4}} .{name} > text, .{name} > a > text, .{name} > g > a > text "
        f"{{fill: {colour}}}"
        for name, colour in COLOURS.items()
    )
    return (
        '<?xml version="1.0" encoding="UTF-8"?>\n'
        '<svg xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink" '
        f'width="{width + GAP + more:g}pt" height="{max(height, other):g}pt" '
        f'viewBox="0 0 {width + GAP + more:g} {max(height, other):g}">\n'
        f"<style>{style}</style>\n{left}"
        f'<svg x="{width + GAP:g}"{right.removeprefix("<svg")}</svg>\n'
    )


def _key(change: Change, number: int | None) -> str:
    return f"{'t' if change.what == 'transition' else 's'}{number}"


def _part(svg: str, prefix: str, marks: Mapping[str, str]) -> tuple[str, float, float]:
    """Return a drawing within another, with the classes of changes; and its size in points."""
    svg = svg[svg.index("<svg") :]
    found = SIZE.search(svg)
    width, height = (float(found[1]), float(found[2])) if found else (0.0, 0.0)

    def mark(element: re.Match[str]) -> str:
        link, kind, number, piece, _, classes = element.groups()
        change = marks.get(f"{'s' if kind == 's' else 't'}{number}", "")
        names = " ".join(filter(None, (classes, change)))
        own = f"{prefix}{link or ''}{kind}{number}{piece or ''}"
        return f'<g id="{own}"' + (f' class="{names}"' if names else "")

    svg = SIZE.sub(f'<svg width="{width:g}" height="{height:g}"', svg, count=1)
    return ELEMENT.sub(mark, svg), width, height
