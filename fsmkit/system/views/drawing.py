"""Draw a chart with its states, or a system with its machines and their connections."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator
from pathlib import Path

from fsmkit.chart.chart import Chart
from fsmkit.chart.drawing.drawing import Drawing
from fsmkit.chart.drawing.fitting import fitted
from fsmkit.chart.drawing.graphviz.engine import BITMAPS, run_graphviz
from fsmkit.chart.drawing.layout import improve_layout
from fsmkit.chart.drawing.positions.placement import Placement
from fsmkit.chart.drawing.positions.redraw import redraw
from fsmkit.chart.drawing.states.boxes import boxed, composites
from fsmkit.chart.drawing.states.dot.draw import (
    AREAS,
    BELOW_BORDER,
    DASHED,
    FONT,
    GREY,
    INK,
    NAME,
    ROUNDED,
    SMALL,
    SOFT,
    TITLE,
)
from fsmkit.chart.drawing.states.folding import ALL, folded
from fsmkit.chart.drawing.states.labels import WIDTH, wrapped
from fsmkit.diagnostics import fail
from fsmkit.diagnostics.suggestions import suggest
from fsmkit.emit import notating
from fsmkit.emit.dot import escaped, font, label_with_title, left, quoted, statement
from fsmkit.emit.svg import with_dark_colours
from fsmkit.plugins import plugin, plugin_for, plugins
from fsmkit.system.any_file import Model
from fsmkit.system.deployment.deployment import Deployment
from fsmkit.system.machine import port_name
from fsmkit.system.system import System

PICTURES = (".svg", *(f".{kind}" for kind in BITMAPS))
"""The kinds of pictures by Graphviz."""
MOST_PICTURED = 2_000
"""States of a picture, beyond which the layout takes many minutes."""


def require_suffix(path: Path) -> None:
    """Raise `FsmkitError` (``unknown-suffix``) if no drawing has the suffix of a file."""
    known = (*PICTURES, *(suffix for one in plugins(Drawing) for suffix in one.suffixes))
    if path.suffix.lower() not in known:
        raise fail(
            "unknown-suffix",
            f"no kind of drawing has the suffix `{path.suffix}` of `{path.name}`",
            help=f"use one of {', '.join(known)}",
        )


def draw(
    model: Model,
    path: Path,
    active: frozenset[int] = frozenset(),
    unfolded: Collection[str] = (),
    fold: frozenset[int] = frozenset(),
) -> str | bytes:
    """Return the content of a drawing of a model.

    Args:
        model: A chart; or a system or a deployment, drawn as machines and connections.
        path: The file: its suffix is the kind of drawing. It is not written.
        active: Highlighted states of a chart (`states_named`).
        unfolded: The copies of used charts that are drawn whole, by name, or ``all``; others are
            boxes with their entry and exit points.
        fold: States of a chart that are drawn as boxes without their content (`folds_named`).

    Raises:
        FsmkitError: ``unknown-suffix``; ``missing-graphviz``, ``drawing-failed`` for pictures;
            ``not-a-chart`` for a system in a notation other than Graphviz'.

    """
    require_suffix(path)
    suffix = path.suffix.lower()
    drawing = plugin(Drawing, "dot") if suffix in PICTURES else plugin_for(Drawing, path)
    if isinstance(model, Chart):
        shown, marked = _drawn_chart(model, active, unfolded, fold)
        if suffix in PICTURES and len(shown.states) - 1 > MOST_PICTURED:
            raise fail(
                "drawing-failed",
                f"{len(shown.states) - 1:,} states are too many for a picture, which has at most "
                f"{MOST_PICTURED:,}",
                help="fold states with `--fold`, or draw `.dot`, `.mmd` or `.puml`",
            )
        text = drawing.draw(shown, marked)
    elif drawing.name == "dot":
        text = block_diagram(model)
    else:
        raise fail(
            "not-a-chart",
            f"`{_system(model).name}` is a system, which cannot be drawn as `{suffix}`",
            help=f"draw `.dot`, {', '.join(f'`{known}`' for known in PICTURES)}; or a chart",
        )
    return _picture(text, suffix[1:]) if suffix in PICTURES else text


def draw_kept(
    chart: Chart,
    placement: Placement | None,
    active: frozenset[int] = frozenset(),
    unfolded: Collection[str] = (ALL,),
    fold: frozenset[int] = frozenset(),
) -> tuple[str, Placement]:
    """Return a drawing in SVG that keeps the positions of an earlier one, and its own.

    Args:
        chart: The chart.
        placement: The positions of an earlier drawing; None for a whole new layout.
        active: Highlighted states.
        unfolded: The copies of used charts that are drawn whole.
        fold: States that are drawn as boxes without their content.

    Raises:
        FsmkitError: ``missing-graphviz``, ``drawing-failed``.

    """
    shown, marked = _drawn_chart(chart, active, unfolded, fold)
    text = plugin(Drawing, "dot").draw(shown, marked)
    return redraw(shown, text, placement)


def _drawn_chart(
    chart: Chart, active: frozenset[int], unfolded: Collection[str], fold: frozenset[int]
) -> tuple[Chart, frozenset[int]]:
    """Return the chart with folded copies and states, and the highlighted states in it."""
    copied, marked = folded(chart, unfolded, active)
    names = {chart.states[state].id for state in fold}
    boxes = (state.index for state in copied.states if state.id in names)
    return boxed(copied, boxes), marked


def states_named(model: Model, names: Iterable[str]) -> frozenset[int]:
    """Return the states of these names in a chart, and their ancestors.

    Raises `FsmkitError` (``unknown-name``).
    """
    found: set[int] = set()
    for name in names:
        known = model.state_index if isinstance(model, Chart) else {}
        if not isinstance(model, Chart) or name not in known:
            owner = model.name if isinstance(model, Chart) else _system(model).name
            help_ = suggest(name, known, "see `fsmkit show` for the names")
            raise fail("unknown-name", f"`{owner}` has no state `{name}`", help=help_)
        found |= {known[name], *model.ancestors(known[name])}
    return frozenset(found)


def folds_named(model: Model, names: Iterable[str]) -> frozenset[int]:
    """Return the states of a chart to fold, by name; ``*`` folds every compound state.

    Raises `FsmkitError` (``unknown-name``) for a state without child states.
    """
    names = [*names]
    if not isinstance(model, Chart):
        return states_named(model, names)
    can = composites(model)
    if "*" in names and "*" not in model.state_index:
        return can
    known = {model.states[state].id: state for state in sorted(can)}
    for name in names:
        if name not in known:
            what = "has no states in it" if name in model.state_index else "is not there"
            help_ = suggest(name, known, f"one of {', '.join(known)} can be folded")
            message = f"`{name}` of `{model.name}` {what}, so it cannot be folded"
            raise fail("unknown-name", message, help=help_ if known else None)
    return frozenset(known[name] for name in names)


def require_copies(model: Model, names: Iterable[str]) -> None:
    """Raise `FsmkitError` (``unknown-name``) for an unknown copy of a chart."""
    known = [copy.name for copy in model.copies] if isinstance(model, Chart) else []
    for name in names:
        if name not in (*known, ALL):
            owner = model.name if isinstance(model, Chart) else _system(model).name
            otherwise = f"there are {', '.join(known)}" if known else "no chart is used there"
            help_ = suggest(name, known, otherwise)
            raise fail("unknown-name", f"`{owner}` has no copy `{name}`", help=help_)


def _system(model: System | Deployment) -> System:
    return model.written if isinstance(model, Deployment) else model


@notating
def block_diagram(model: System | Deployment) -> str:
    """Return machines as boxes and connections as arrows, for Graphviz; nodes as frames."""
    return "\n".join((*_lines(model), ""))


def _lines(model: System | Deployment) -> Iterator[str]:
    system = _system(model)
    title = font(f"<b>{escaped(system.name)}</b>", INK, TITLE)
    yield f"digraph {quoted(system.name)} {{"
    yield "  " + statement(
        "graph", rankdir="LR", nodesep=0.4, ranksep=0.5, fontname=FONT, label=f"<{title}>",
        labelloc="t", pad=0.2, bgcolor="white",
    )  # fmt: skip
    yield "  " + statement(
        "node", fontname=FONT, fontsize=NAME, color=INK, shape="box", style=ROUNDED,
        fillcolor="white", margin="0.16,0.1", height=0.5,
    )  # fmt: skip
    yield "  " + statement("edge", fontname=FONT, fontsize=SMALL, color=INK, arrowsize=0.7)
    placed: tuple[int | None, ...] = (None,) * len(system.machines)
    nodes: tuple[str, ...] = ()
    if isinstance(model, Deployment):
        nodes = model.nodes
        where = {m.name: p for m, p in zip(model.system.machines, model.placed, strict=True)}
        placed = tuple(where.get(machine.name) for machine in system.machines)
    for place, node in enumerate(nodes):
        name = font(f"<b>{escaped(node)}</b>", INK, NAME)
        yield f"  subgraph cluster_{place} {{"
        yield "    " + statement(
            "graph", label=label_with_title(name, (), "left", room=BELOW_BORDER), labeljust="l",
            labelloc="t", style=ROUNDED, color=INK, fillcolor=AREAS[0], margin=14,
        )  # fmt: skip
        yield from (f"    m{n};" for n, p in enumerate(placed) if p == place)
        yield "  }"
    for number, machine in enumerate(system.machines):
        color = GREY if machine.environment else INK
        name = font(f"<b>{escaped(machine.name)}</b>", color, NAME)
        of_chart = font(escaped(machine.chart.name), GREY if machine.environment else SOFT, SMALL)
        yield "  " + statement(
            f"m{number}", label=label_with_title(name, [(of_chart, {})], "center"), color=color,
            style=DASHED if machine.environment else ROUNDED, id=f"m{number}",
        )  # fmt: skip
    for number, ((source, target, style), names) in enumerate(_arrows(system).items()):
        color = INK if style == "solid" else SOFT
        lines = wrapped(", ".join(dict.fromkeys(names)), WIDTH, "")
        yield "  " + statement(
            f"m{source} -> m{target}", style=style, color=color, id=f"l{number}",
            label=f"<{font(left(lines), color, SMALL)}>",
        )  # fmt: skip
    yield "}"


def _arrows(system: System) -> dict[tuple[int, int, str], list[str]]:
    """Return the arrows between machines: solid for events, dashed for levels."""
    found: dict[tuple[int, int, str], list[str]] = {}
    for link in system.event_links:
        chart = system.machines[link.source].chart
        names = found.setdefault((link.source, link.target, "solid"), [])
        names.append(port_name(chart, link.port))
    for level in system.input_links:
        outputs = system.machines[level.source].chart.outputs
        if level.output < len(outputs):  # else shared data
            names = found.setdefault((level.source, level.target, "dashed"), [])
            names.append(outputs[level.output].name)
    return found


def _picture(text: str, kind: str) -> bytes:
    """Return the picture of a source for Graphviz: ``svg``, ``png`` or ``pdf``."""
    layout = improve_layout(run_graphviz(text, ("dot", "json")))
    if kind != "svg":
        return run_graphviz(layout, (kind,), "neato -n2")
    return _svg(layout).encode()


def _svg(layout: str) -> str:
    """Return the drawing of a layout, in whose dark form the colours differ."""
    return with_dark_colours(fitted(run_graphviz(layout, ("svg", "json"), "neato -n2")))
