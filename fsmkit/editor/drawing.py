"""Pictures for a preview: SVG, and where each state and transition of it is written."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fsmkit.chart.chart import Chart
from fsmkit.diagnostics import FsmkitError, Span
from fsmkit.document.document import Kind
from fsmkit.editor.context import Context, uri_of
from fsmkit.editor.index.files import normal

if TYPE_CHECKING:
    from fsmkit.system.deployment.deployment import Deployment
    from fsmkit.system.system import System

Json = dict[str, Any]
MOST_DRAWN = 500
"""Maximum number of drawn states: Graphviz takes a second for them."""


def drawing(context: Context, path: Path, folded: Iterable[str], active: Iterable[str]) -> Json:
    """Return the picture of a file.

    Args:
        context: The editor.
        path: The file of a chart, a system or a deployment.
        folded: States drawn without their content.
        active: Highlighted states.

    Returns:
        ``svg``, and ``items``: the kind and location of each element by its id. If drawing fails,
        ``error`` with the reason.

    """
    from fsmkit.system.deployment.deployment import Deployment
    from fsmkit.system.system import System

    analysis = context.analyses.analysis(path)
    model = analysis.model
    if not isinstance(model, Chart | System | Deployment):
        wrong = next((f.message for f in analysis.findings), "this is nothing that can be drawn")
        return {"error": wrong}
    if not isinstance(model, Chart):
        return _drawn(model, Path("x.svg"), frozenset())
    chart = with_folded(model, frozenset(folded))
    if len(chart.states) > MOST_DRAWN:
        return {"error": f"{len(chart.states)} states are too many to draw: fold some"}
    marked = frozenset(chart.state_index[n] for n in active if n in chart.state_index)
    found = _drawn(chart, Path("x.svg"), marked)
    found["items"] = {
        **{f"s{s.index}": _item(context, s.span, "state", s.id) for s in chart.states[1:]},
        **{
            f"t{t.index}": _item(context, t.span, "transition", str(t.id or ""))
            for t in chart.transitions
        },
    }
    return found


def _drawn(model: Chart | System | Deployment, path: Path, active: frozenset[int]) -> Json:
    from fsmkit.system.views.drawing import draw

    try:
        picture = draw(model, path, active)
    except FsmkitError as error:
        return {"error": error.diagnostics[0].message}
    svg = picture.decode() if isinstance(picture, bytes) else picture
    return {"svg": svg[svg.index("<svg") :] if "<svg" in svg else svg, "items": {}}


def _item(context: Context, span: Span, kind: str, name: str) -> Json:
    place = context.range(span)
    return {
        "kind": kind,
        "name": name,
        "uri": uri_of(Path(normal(Path(span.source.name)))),
        "line": place.start.line,
        "character": place.start.character,
        "endLine": place.end.line,
    }


def with_folded(chart: Chart, folded: frozenset[str]) -> Chart:
    """Return a chart in which some states hold nothing; transitions end at them instead."""
    if not folded & chart.state_index.keys():
        return chart
    stand_in: list[int] = []
    for state in chart.states:
        around = (state.index, *chart.ancestors(state.index))
        outer = [a for a in around if chart.states[a].id in folded]
        stand_in.append(outer[-1] if outer else state.index)
    kept = [state.index for state in chart.states if stand_in[state.index] == state.index]
    number = {old: new for new, old in enumerate(kept)}
    transitions = [
        t
        for t in chart.transitions
        if stand_in[t.source] == t.source
        and (chart.states[t.source].id not in folded or chart.states[t.source].initial != t.index)
    ]
    renumbered = {t.index: place for place, t in enumerate(transitions)}
    states = []
    for old in kept:
        state = chart.states[old]
        is_folded = state.id in folded
        last = max(k for k in kept if old <= k <= state.last_descendant)
        states.append(
            replace(
                state,
                index=number[old],
                kind=Kind.ATOMIC if is_folded else state.kind,
                parent=None if state.parent is None else number[state.parent],
                children=() if is_folded else tuple(number[c] for c in state.children),
                initial=None if state.initial is None else renumbered.get(state.initial),
                transitions=tuple(renumbered[t] for t in state.transitions if t in renumbered),
                last_descendant=number[last],
            )
        )
    moved = tuple(
        replace(
            t,
            index=renumbered[t.index],
            source=number[t.source],
            targets=tuple(dict.fromkeys(number[stand_in[x]] for x in t.targets)),
        )
        for t in transitions
    )
    return replace(chart, states=tuple(states), transitions=moved)
